#pragma once

#include <cstdint>
#include <ctime>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace cumulet::demo {

/// A file or folder in the list of a file dialog.
struct FolderEntry {
  std::string name;
  bool folder = false;
  std::uint64_t bytes = 0;  // of a file
  std::time_t written = 0;  // 0: unknown
  std::string size;         // texts of the two
  std::string date;
};

enum class FolderOrder { name, size, date };

/// A place that a file dialog offers.
struct Place {
  std::string label;
  std::string folder;  // absolute path
};

/// Lists a folder: its folders, and the files that have one of the extensions, without hidden ones. Throws
/// std::runtime_error, one line with the path and the cause.
[[nodiscard]] std::vector<FolderEntry> list_folder(const std::string& folder, std::span<const std::string> extensions);
/// Sorts the entries, folders first. Entries that are equal in the order are sorted by name.
void sort_entries(std::vector<FolderEntry>& entries, FolderOrder order, bool descending);
/// Returns true if the name contains all words of the search, in any case.
[[nodiscard]] bool matches(std::string_view name, std::string_view search);
/// Returns the user's folders that exist, and the folders of the recent files.
[[nodiscard]] std::vector<Place> places(std::span<const std::string> recent_files);

}  // namespace cumulet::demo
