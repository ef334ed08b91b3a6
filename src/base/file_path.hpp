#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <system_error>
#include <utility>

namespace cumulet {

/// A file or folder path from a caller. Messages use the path as given; files are opened by the absolute path, so that
/// the process may change its current directory before a worker thread opens the file.
class FilePath {
 public:
  FilePath() = default;
  /// Relative to the current directory at the time of construction.
  FilePath(std::string given) : given_(std::move(given)), folder_(current_folder()) {}
  FilePath(const char* given) : FilePath(std::string(given)) {}
  FilePath(const std::filesystem::path& given) : FilePath(given.string()) {}
  /// Relative to the same directory as `other`.
  FilePath(std::string given, const FilePath& other) : given_(std::move(given)), folder_(other.folder_) {}

  [[nodiscard]] const std::string& given() const { return given_; }
  [[nodiscard]] std::filesystem::path absolute() const {
    return folder_ ? *folder_ / given_ : std::filesystem::path(given_);
  }

 private:
  // Null if the current directory cannot be determined, for example because it was removed. Paths are then used as
  // given.
  static std::shared_ptr<const std::filesystem::path> current_folder() {
    std::error_code error;
    auto folder = std::make_shared<const std::filesystem::path>(std::filesystem::current_path(error));
    return error ? nullptr : folder;
  }

  std::string given_;
  std::shared_ptr<const std::filesystem::path> folder_;
};

}  // namespace cumulet
