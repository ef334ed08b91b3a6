#pragma once

#include <memory>
#include <stdexcept>
#include <string>

namespace cumulet {

/// Why an operation failed. The C ABI maps each to one cumulet_status.
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

/// The library's one exception. It never crosses the C ABI. The message is one
/// line that names the file (where there is one) and the cause.
class Error : public std::runtime_error {
 public:
  Error(ErrorCode code, const std::string& message)
      : std::runtime_error(message), code_(code), occurrence_(std::make_shared<char>()) {}
  [[nodiscard]] ErrorCode code() const noexcept { return code_; }
  /// Whether one is a copy of the other: the same operation failed, not a second one with the same message.
  [[nodiscard]] bool is_copy_of(const Error& other) const noexcept { return occurrence_ == other.occurrence_; }

 private:
  ErrorCode code_;
  std::shared_ptr<const char> occurrence_;
};

/// What is being handled, as an Error; what: was begun, where there was not enough memory. Only in a handler.
[[nodiscard]] Error caught(const std::string& what);

}  // namespace cumulet
