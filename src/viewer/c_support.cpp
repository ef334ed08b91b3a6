#include "viewer/c_support.hpp"

#include <array>

namespace cumulet::c_abi {

namespace {

// A buffer, which exists until its thread ends: handles may be used while other objects of the thread are destroyed.
thread_local std::array<char, 1024> line_of_thread{};

}  // namespace

void set_thread_line(std::string_view line) noexcept { copy_text(line, line_of_thread.data(), line_of_thread.size()); }

const char* thread_line() noexcept { return line_of_thread.data(); }

}  // namespace cumulet::c_abi
