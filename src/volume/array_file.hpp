#pragma once

// Private to volume/: files that hold dense arrays of numbers, as of microscopes, scanners and simulations.

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <glm/glm.hpp>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/byte_source.hpp"
#include "base/progress.hpp"
#include "volume/import_detail.hpp"

namespace cumulet::volume::detail {

enum class NumberType { int8, uint8, int16, uint16, int32, uint32, int64, uint64, float32, float64 };
/// Returns the type with this name, of NRRD or of C; nullopt if there is none.
std::optional<NumberType> number_type_of(std::string_view name);
const char* name_of(NumberType type);
std::size_t size_of(NumberType type);

/// vtk_zlib: blocks of zlib data behind a table of their sizes.
enum class ArrayEncoding { raw, gzip, text, vtk_zlib };

/// An array of one or three numbers per voxel, and its place in a content.
struct ArrayField {
  std::string name = "density";
  NumberType type = NumberType::float32;
  std::size_t components = 1;  ///< 1, or 3 side by side
  glm::ivec3 size{0};          ///< x fastest, then y, then z
  glm::dmat4 index_to_world{1.0};
  ArrayEncoding encoding = ArrayEncoding::raw;
  bool big_endian = false;
  std::uint64_t first_byte = 0;
  std::size_t table_number_bytes = 4;  ///< vtk_zlib: bytes of each number of the table

  [[nodiscard]] std::uint64_t numbers() const {
    const glm::u64vec3 voxels(size);
    return voxels.x * voxels.y * voxels.z * components;
  }
};

/// Throws std::runtime_error unless the size is of a volume that can be read, with few enough numbers to count bytes.
void check_array_size(const ArrayField& field);
/// Reads the numbers of a field as floats. Throws std::runtime_error if the content has too few.
std::vector<float> read_numbers(ByteSource& content, const ArrayField& field, Progress* progress, Portion portion);

/// Makes a reader of a file with arrays. format: as of Reader.
std::unique_ptr<Reader> make_array_reader(std::string format, std::vector<ArrayField> fields,
                                          std::vector<Metadata> metadata, std::unique_ptr<ByteSource> content,
                                          Progress* progress);

/// Opens a NRRD file (http://teem.sourceforge.net/nrrd/format.html). folder: that of detached data; nullopt: such files
/// are refused.
std::unique_ptr<Reader> open_nrrd(std::unique_ptr<ByteSource> content,
                                  const std::optional<std::filesystem::path>& folder, Progress* progress);

/// Opens a file of VTK's image data (.vti) whose arrays are appended as raw bytes.
std::unique_ptr<Reader> open_vti(std::unique_ptr<ByteSource> content, Progress* progress);

/// Opens a TIFF file, whose pages are slices of one number per pixel.
std::unique_ptr<Reader> open_tiff(std::unique_ptr<ByteSource> content, Progress* progress);
/// Opens TIFF files that are one slice each. files: not empty, in order.
std::unique_ptr<Reader> open_tiff_slices(const std::vector<std::filesystem::path>& files, Progress* progress);

/// Returns the JSON file that describes a .raw file: NAME.raw.json or NAME.json; nullopt if there is none.
std::optional<std::filesystem::path> raw_description_of(const std::filesystem::path& file);
/// Opens a file of numbers without a header.
std::unique_ptr<Reader> open_raw(std::unique_ptr<ByteSource> content, const std::filesystem::path& description,
                                 Progress* progress);
/// Returns the array that this JSON text describes. Throws std::runtime_error.
ArrayField raw_field_of(std::string_view text);

}  // namespace cumulet::volume::detail
