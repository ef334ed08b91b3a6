#pragma once

// Private to surface/: the memory of an import, and its errors.

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "base/error.hpp"
#include "base/one_line.hpp"
#include "base/progress_part.hpp"
#include "surface/gltf_limits.hpp"

namespace cumulet::surface::detail {

/// Throws Error(file) with a one-line cause. import_gltf() prepends the file's name.
[[noreturn]] void malformed(const std::string& cause);
/// Returns text from the file or a library on one line, shortened.
inline std::string one_line(std::string_view text) { return cumulet::one_line(text, 200); }
/// Returns the result of `body`; prepends "what: " to any Error that it throws.
template <class Body>
auto naming(const std::string& what, const Body& body) {
  try {
    return body();
  } catch (const Error& error) {
    throw Error(error.code(), what + ": " + error.what());
  }
}
/// Returns for example "node 3".
inline std::string numbered(std::string_view what, std::size_t number) {
  return std::string(what) + " " + std::to_string(number);
}

/// Memory that an import may still allocate. Counts from a file are checked against it before allocation.
class Budget {
 public:
  Budget(const GltfLimits& limits, const Progress* progress)
      : limits_(limits), left_(limits.memory), progress_(progress) {}

  /// Throws if count * size bytes exceed the budget. Throws Error(cancelled), because large allocations take time.
  void take(std::uint64_t count, std::uint64_t size, std::string_view what);
  [[nodiscard]] std::uint64_t left() const { return left_; }
  [[nodiscard]] const GltfLimits& limits() const { return limits_; }
  /// For long loops: checks for cancellation every 16384 turns; throws Error(cancelled).
  void check(std::size_t turn) const {
    if (turn % 16384 == 0) cumulet::check(progress_);
  }
  /// Returns the progress to pass to run_cancellable() for work on this many bytes; null for few bytes, which are not
  /// worth a thread.
  [[nodiscard]] const Progress* progress_for(std::uint64_t bytes) const {
    constexpr std::uint64_t few = 65536;
    return bytes < few ? nullptr : progress_;
  }

 private:
  GltfLimits limits_;
  std::uint64_t left_;
  const Progress* progress_;
};

/// Reads a whole regular file. Throws Error(file) with only the cause.
std::vector<std::uint8_t> read_file(const std::filesystem::path& path, Budget& budget);

}  // namespace cumulet::surface::detail
