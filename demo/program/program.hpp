#pragma once

#include <cstdint>
#include <functional>
#include <stdexcept>
#include <string>
#include <string_view>

namespace cumulet::demo {

/// A command-line error; what() is one line. run_program prints it and returns 2.
class UsageError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Replaces line breaks by blanks and removes those at the end.
[[nodiscard]] std::string one_line(std::string text);

/// True for each byte of a UTF-8 character but the first, before which a text must not be cut.
[[nodiscard]] constexpr bool continues_character(char byte) {
  return (static_cast<unsigned char>(byte) & 0xC0U) == 0x80U;
}

/// FNV-1a hash, 64 bits (Fowler, Noll and Vo).
[[nodiscard]] std::uint64_t fnv1a(std::string_view bytes);

/// Returns an environment variable; "" if it is not set.
[[nodiscard]] std::string environment_variable(const char* name);

/// Returns a folder for user files, by the XDG base directory specification: the value of the environment variable, or
/// a folder in the home directory; "" if neither exists.
[[nodiscard]] std::string user_folder(const char* variable, const std::string& in_home);

/// Runs the body of a main function and returns the exit status. For an exception, or if standard output cannot be
/// written, it prints one line with the program's name to standard error. It then returns 1, or 2 for a UsageError.
[[nodiscard]] int run_program(const char* name, const std::function<void()>& body);

}  // namespace cumulet::demo
