#pragma once

#include <cstdint>
#include <functional>
#include <stdexcept>
#include <string>
#include <string_view>

namespace cumulet::demo {

/// The command line is wrong; what() is one line. run_program prints it and gives 2.
class UsageError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Line breaks become blanks, but for those at the end, which go.
[[nodiscard]] std::string one_line(std::string text);

/// Fowler, Noll and Vo's hash 1a of 64 bits.
[[nodiscard]] std::uint64_t fnv1a(std::string_view bytes);

/// A variable of the environment; empty if it is not set.
[[nodiscard]] std::string environment_variable(const char* name);

/// Where a user's files of a kind are, by the XDG base directory specification: what the variable says, or a folder in
/// the home; empty if there is neither.
[[nodiscard]] std::string user_folder(const char* variable, const std::string& in_home);

/// A main's whole body: calls it, and gives the exit status. What it throws, and a standard output that cannot be
/// written, goes to standard error in one line after the program's name: 1; 2 for a UsageError.
[[nodiscard]] int run_program(const char* name, const std::function<void()>& body);

}  // namespace cumulet::demo
