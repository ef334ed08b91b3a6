#pragma once

#include <cstdint>
#include <ctime>
#include <string>

namespace cumulet::demo {

/// Returns a time of a file: "14:05", with the date if that is not today.
[[nodiscard]] std::string time_text(std::time_t time);
/// Returns the time at which the file was written, as time_text does.
[[nodiscard]] std::string written_text(const std::string& path);
/// Returns a file's size as file managers show it: "512 B", "1.4 MB". Units are powers of 1000.
[[nodiscard]] std::string size_text(std::uint64_t bytes);

}  // namespace cumulet::demo
