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

/// A folder of program binaries, of drivers that give them (glGetProgramBinary): good for the driver and the source
/// that made them, to which a file's name is the key. What is damaged, cut short or not of this kind counts as not
/// there and is written anew. Bounded: what was not used for longest goes. Any number of processes may use one folder.
/// Safe from any thread.
class ProgramFiles {
 public:
  struct Binary {
    std::uint32_t format = 0;
    std::vector<std::byte> bytes;
  };

  /// The folder is made with the first file.
  explicit ProgramFiles(FilePath folder, std::uintmax_t most_bytes = default_most_bytes)
      : folder_(std::move(folder)), most_bytes_(most_bytes) {}

  [[nodiscard]] std::optional<Binary> find(const std::string& driver, const std::string& source);
  /// Throws Error(file).
  void keep(const std::string& driver, const std::string& source, const Binary& binary);
  [[nodiscard]] const FilePath& folder() const { return folder_; }

  static constexpr std::uintmax_t default_most_bytes = std::uintmax_t{256} << 20U;

 private:
  void make_room() const;

  std::mutex mutex_;
  FilePath folder_;
  std::uintmax_t most_bytes_;
};

}  // namespace cumulet::gl
