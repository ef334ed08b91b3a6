#pragma once

// Private to volume/: describes an array of numbers in a file.

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <glm/glm.hpp>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace cumulet::volume::detail {

enum class NumberType { int8, uint8, int16, uint16, int32, uint32, int64, uint64, float32, float64 };
/// Returns the type with this name, of NRRD or of C; nullopt if there is none.
std::optional<NumberType> number_type_of(std::string_view name);
const char* name_of(NumberType type);
std::size_t size_of(NumberType type);

/// vtk: raw behind the number of bytes. vtk_zlib: blocks of zlib data behind a table of their sizes.
enum class ArrayEncoding { raw, gzip, text, vtk, vtk_zlib };

/// An array of one or three numbers per voxel, and its place in a content or in files of its own.
struct ArrayField {
  std::string name = "density";
  NumberType type = NumberType::float32;
  std::size_t components = 1;  ///< 1, or 3 side by side
  glm::ivec3 size{0};          ///< x fastest, then y, then z
  glm::dmat4 index_to_world{1.0};
  ArrayEncoding encoding = ArrayEncoding::raw;
  bool base64 = false;  ///< vtk, vtk_zlib: as base64 text
  bool big_endian = false;
  std::uint64_t first_byte = 0;
  std::uint64_t end_byte = std::numeric_limits<std::uint64_t>::max();  ///< behind the last byte, or further
  std::uint64_t skipped_lines = 0;                                     ///< from first_byte on
  std::int64_t skipped_bytes = 0;  ///< then of the decoded bytes; -1 - n: all except the values and n bytes at the end
  std::size_t table_number_bytes = 4;        ///< vtk, vtk_zlib: bytes of each number before the values
  std::vector<std::filesystem::path> files;  ///< each holds an equal share of the values; empty: the content has all

  [[nodiscard]] std::uint64_t numbers() const {
    const glm::u64vec3 voxels(size);
    return voxels.x * voxels.y * voxels.z * components;
  }
};

/// Throws std::runtime_error unless the size is of a volume that can be read, with few enough numbers to count bytes.
void check_array_size(const ArrayField& field);

}  // namespace cumulet::volume::detail
