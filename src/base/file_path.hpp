#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <system_error>
#include <utility>

namespace cumulet {

/// A file or folder as a caller names it. Messages have the name as it was given; what is opened is absolute, so that
/// the process may change its current folder before a worker opens it.
class FilePath {
 public:
  FilePath() = default;
  /// Relative to the folder that is current now.
  FilePath(std::string given) : given_(std::move(given)), folder_(current_folder()) {}
  FilePath(const char* given) : FilePath(std::string(given)) {}
  FilePath(const std::filesystem::path& given) : FilePath(given.string()) {}
  /// Relative to the folder that other is relative to.
  FilePath(std::string given, const FilePath& other) : given_(std::move(given)), folder_(other.folder_) {}

  [[nodiscard]] const std::string& given() const { return given_; }
  [[nodiscard]] std::filesystem::path absolute() const {
    return folder_ ? *folder_ / given_ : std::filesystem::path(given_);
  }

 private:
  // Null where it cannot be found out, as of one that was removed: then names are as they were given.
  static std::shared_ptr<const std::filesystem::path> current_folder() {
    std::error_code error;
    auto folder = std::make_shared<const std::filesystem::path>(std::filesystem::current_path(error));
    return error ? nullptr : folder;
  }

  std::string given_;
  std::shared_ptr<const std::filesystem::path> folder_;
};

}  // namespace cumulet
