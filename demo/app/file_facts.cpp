#include "file_facts.hpp"

#include <sys/stat.h>

#include <array>
#include <cstddef>
#include <cstdio>
#include <ctime>
#include <iterator>

namespace cumulet::demo {

namespace {

constexpr const char* unknown_time = "an unknown time";

}  // namespace

std::string time_text(std::time_t time) {
  std::tm written{};
  std::tm today{};
  const std::time_t now = std::time(nullptr);
  if (::localtime_r(&time, &written) == nullptr || ::localtime_r(&now, &today) == nullptr) return unknown_time;
  const bool is_today = written.tm_year == today.tm_year && written.tm_yday == today.tm_yday;
  std::array<char, 32> text{};
  const std::size_t length = std::strftime(text.data(), text.size(), is_today ? "%H:%M" : "%Y-%m-%d %H:%M", &written);
  return {text.data(), length};
}

std::string written_text(const std::string& path) {
  struct stat status {};
  return ::stat(path.c_str(), &status) == 0 ? time_text(status.st_mtime) : unknown_time;
}

std::string size_text(std::uint64_t bytes) {
  constexpr std::array units = {"kB", "MB", "GB", "TB", "PB", "EB"};
  if (bytes < 1000) return std::to_string(bytes) + " B";
  const auto* unit = units.begin();
  double number = static_cast<double>(bytes) / 1000.0;
  for (; number >= 999.95 && std::next(unit) != units.end(); ++unit) number /= 1000.0;
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.1f %s", number, *unit);
  return text.data();
}

}  // namespace cumulet::demo
