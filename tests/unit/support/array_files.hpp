#pragma once

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <string>

#include "base/error.hpp"
#include "support/folder.hpp"
#include "support/volumes.hpp"
#include "volume/frame_import.hpp"
#include "volume/volume.hpp"

namespace cumulet::test {

/// All test arrays have this size and the values of value_of().
inline constexpr glm::ivec3 array_size{5, 4, 3};
inline const std::string in_grid = "grid \"density\": ";

inline float value_of(const glm::ivec3& at) { return static_cast<float>(1 + at.x + 10 * at.y + 50 * at.z); }

/// Returns the bytes of the array. swapped: in big-endian byte order.
template <class T>
std::string bytes_of(bool swapped = false) {
  std::string bytes;
  for (int z = 0; z < array_size.z; ++z) {
    for (int y = 0; y < array_size.y; ++y) {
      for (int x = 0; x < array_size.x; ++x) {
        const T value = static_cast<T>(value_of({x, y, z}));
        std::array<char, sizeof(T)> raw{};
        std::memcpy(raw.data(), &value, sizeof value);
        bytes.append(swapped ? std::string(raw.rbegin(), raw.rend()) : std::string(raw.begin(), raw.end()));
      }
    }
  }
  return bytes;
}

/// Writes and reads files that hold arrays.
class ArrayFile : public testing::Test {
 protected:
  std::string write(const std::string& name, const std::string& content) const {
    const std::string file = (folder_ / name).string();
    std::ofstream(file, std::ios::binary) << content;
    return file;
  }
  static volume::ScalarVolume read(const std::string& file) { return volume::import_volume(file, "", {}); }
  /// The cause of a failure, without the file's name.
  [[nodiscard]] std::string refusal(const std::string& content, const std::string& name = "bad.nrrd") const {
    const std::string file = write(name, content);
    try {
      read(file);
    } catch (const Error& error) {
      const std::string line = error.what();
      EXPECT_EQ(line.rfind(file + ": ", 0), 0U) << line;
      EXPECT_EQ(line.find('\n'), std::string::npos) << line;
      EXPECT_EQ(error.code(), ErrorCode::file);
      return line.substr(file.size() + 2);
    }
    return "no error";
  }
  static void expect_values(const volume::ScalarVolume& got) {
    EXPECT_EQ(got.active_voxels, 60U);
    for (int z = 0; z < array_size.z; ++z) {
      for (int y = 0; y < array_size.y; ++y) {
        for (int x = 0; x < array_size.x; ++x) ASSERT_EQ(value_at(got, {x, y, z}), value_of({x, y, z}));
      }
    }
  }

  Folder folder_;
};

}  // namespace cumulet::test
