#include "folder_list.hpp"

#include <sys/stat.h>

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <filesystem>
#include <sstream>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "file_facts.hpp"
#include "model.hpp"

namespace cumulet::demo {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t max_recent_places = 4;

std::string lower(std::string_view text) {
  std::string result(text);
  for (char& c : result) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return result;
}

}  // namespace

std::vector<FolderEntry> list_folder(const std::string& folder, std::span<const std::string> extensions) {
  std::error_code error;
  fs::directory_iterator iterator(folder, fs::directory_options::skip_permission_denied, error);
  if (error) throw std::runtime_error(folder + ": " + error.message());
  std::vector<FolderEntry> entries;
  for (; iterator != fs::directory_iterator(); iterator.increment(error)) {
    if (error) break;
    FolderEntry entry;
    entry.name = iterator->path().filename().string();
    if (entry.name.empty() || entry.name[0] == '.') continue;
    struct stat status {};
    const bool known = ::stat(iterator->path().c_str(), &status) == 0;
    entry.folder = known && S_ISDIR(status.st_mode);
    const bool listed = entry.folder || std::ranges::any_of(extensions, [&](const std::string& extension) {
                          return has_ending(entry.name, extension);
                        });
    if (!listed) continue;
    if (known) {
      entry.written = status.st_mtime;
      entry.date = time_text(entry.written);
    }
    if (known && !entry.folder) {
      entry.bytes = static_cast<std::uint64_t>(status.st_size);
      entry.size = size_text(entry.bytes);
    }
    entries.push_back(std::move(entry));
  }
  return entries;
}

void sort_entries(std::vector<FolderEntry>& entries, FolderOrder order, bool descending) {
  std::ranges::sort(entries, {}, &FolderEntry::name);
  const auto before = [&](const FolderEntry& a, const FolderEntry& b) {
    if (a.folder != b.folder) return a.folder;
    const FolderEntry& first = descending ? b : a;
    const FolderEntry& second = descending ? a : b;
    if (order == FolderOrder::size) return first.bytes < second.bytes;
    if (order == FolderOrder::date) return first.written < second.written;
    return first.name < second.name;
  };
  std::ranges::stable_sort(entries, before);
}

bool matches(std::string_view name, std::string_view search) {
  const std::string in = lower(name);
  std::istringstream words(lower(search));
  for (std::string word; words >> word;)
    if (in.find(word) == std::string::npos) return false;
  return true;
}

std::vector<Place> places(std::span<const std::string> recent_files) {
  std::vector<Place> all;
  std::error_code error;
  const auto add = [&](const std::string& label, const fs::path& folder) {
    const std::string path = fs::absolute(folder, error).lexically_normal().string();
    const bool there = std::ranges::any_of(all, [&](const Place& place) { return place.folder == path; });
    if (!there && fs::is_directory(path, error)) all.push_back({label, path});
  };
  if (const char* home = std::getenv("HOME"); home != nullptr && *home != '\0') {
    add("Home", home);
    for (const char* name : {"Desktop", "Documents", "Downloads"}) add(name, fs::path(home) / name);
  }
  add("Working folder", fs::current_path(error));
  add("File system", "/");
  const std::size_t most = all.size() + max_recent_places;
  for (const std::string& file : recent_files) {
    const fs::path folder = fs::path(file).parent_path();
    if (all.size() < most && folder.is_absolute()) add(folder.filename().string(), folder);
  }
  return all;
}

}  // namespace cumulet::demo
