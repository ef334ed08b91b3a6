#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "base/file_path.hpp"

namespace cumulet::gl {

/// A disk cache of program binaries, for drivers that provide them (glGetProgramBinary). A file's name is a hash of the
/// driver and the source, for which the binary is valid. Files that are damaged, truncated or of another kind count as
/// missing and are rewritten. The cache is bounded: the least recently used files are deleted. Several processes may
/// share a folder. Safe from any thread.
class ProgramFiles {
 public:
  struct Binary {
    std::uint32_t format = 0;
    std::vector<std::byte> bytes;
  };

  /// The folder is created with the first file.
  explicit ProgramFiles(FilePath folder, std::uintmax_t max_bytes = default_max_bytes)
      : folder_(std::move(folder)), max_bytes_(max_bytes) {}

  [[nodiscard]] std::optional<Binary> find(const std::string& driver, const std::string& source);
  /// Throws Error(file).
  void keep(const std::string& driver, const std::string& source, const Binary& binary);
  [[nodiscard]] const FilePath& folder() const { return folder_; }

  static constexpr std::uintmax_t default_max_bytes = std::uintmax_t{256} << 20U;

 private:
  void make_room() const;

  std::mutex mutex_;
  FilePath folder_;
  std::uintmax_t max_bytes_;
};

}  // namespace cumulet::gl
