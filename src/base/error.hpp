#pragma once

#include <memory>
#include <stdexcept>
#include <string>

namespace cumulet {

/// Reason why an operation failed. The C ABI maps each to one cumulet_status.
enum class ErrorCode {
  invalid_argument,
  unsupported,
  file,
  out_of_memory,
  gl,
  internal,
  cancelled,
  context_lost,
  detached,
  timeout
};

/// The only exception type of the library. It never crosses the C ABI. The message is one line that names the file (if
/// there is one) and the cause.
class Error : public std::runtime_error {
 public:
  Error(ErrorCode code, const std::string& message)
      : std::runtime_error(message), code_(code), occurrence_(std::make_shared<char>()) {}
  [[nodiscard]] ErrorCode code() const noexcept { return code_; }
  /// True if one object is a copy of the other, so both report the same failure. Two failures with equal messages are
  /// not copies.
  [[nodiscard]] bool is_copy_of(const Error& other) const noexcept { return occurrence_ == other.occurrence_; }

 private:
  ErrorCode code_;
  std::shared_ptr<const char> occurrence_;
};

/// Converts the exception that is being handled to an Error. Call it only in a handler. what: the operation, for the
/// message if memory ran out.
[[nodiscard]] Error caught(const std::string& what);

}  // namespace cumulet
