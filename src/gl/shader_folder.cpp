#include "gl/shader_folder.hpp"

#include <algorithm>
#include <fstream>
#include <set>
#include <string_view>
#include <system_error>

#include "base/error.hpp"

namespace cumulet::gl {

namespace {

namespace fs = std::filesystem;

constexpr auto pause = std::chrono::milliseconds(250);

// Returns "grid/cell.glsl" if the line includes that file.
std::optional<std::string> included(const std::string& line) {
  constexpr std::string_view directive = "#include \"";
  const std::size_t at = line.find_first_not_of(" \t");
  if (at == std::string::npos || line.compare(at, directive.size(), directive) != 0) return std::nullopt;
  const std::size_t begin = at + directive.size();
  const std::size_t end = line.find('"', begin);
  if (end == std::string::npos) return std::nullopt;
  return line.substr(begin, end - begin);
}

void append(const FilePath& folder, const fs::path& name, std::set<fs::path>& seen, std::string& text) {
  std::ifstream file(folder.absolute() / name);
  if (!file) throw Error(ErrorCode::file, (folder.given() / name).string() + ": cannot be read");
  for (std::string line; std::getline(file, line);) {
    if (const auto include = included(line)) {
      if (seen.insert(*include).second) append(folder, *include, seen, text);
    } else {
      text.append(line).append(1, '\n');
    }
  }
}

}  // namespace

std::string ShaderFolder::source(std::string_view path) const {
  std::string text;
  std::set<fs::path> seen;
  append(folder_, path, seen, text);
  return text;
}

bool ShaderFolder::changed() {
  const auto now = Clock::now();
  if (looked_ && now - *looked_ < pause) return false;
  const bool first = !looked_;
  looked_ = now;
  auto newest = fs::file_time_type::min();
  std::error_code error;
  for (fs::recursive_directory_iterator at(folder_.absolute(), error), end; !error && at != end; at.increment(error)) {
    std::error_code gone;
    const fs::file_time_type time = at->last_write_time(gone);
    if (!gone) newest = std::max(newest, time);
  }
  const bool newer = !first && newest > newest_;
  newest_ = newest;
  return newer;
}

}  // namespace cumulet::gl
