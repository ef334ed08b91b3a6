#pragma once

// Private to volume/: files that hold dense arrays of numbers, as of microscopes, scanners and simulations.

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/byte_source.hpp"
#include "base/progress.hpp"
#include "volume/array_field.hpp"
#include "volume/import_detail.hpp"

namespace cumulet::volume::detail {

/// Reads the numbers of a field as floats. Throws std::runtime_error if the content, or a file, has too few.
std::vector<float> read_numbers(ByteSource& content, const ArrayField& field, Progress* progress, Portion portion);

/// Makes a reader of a file with arrays. format: as of Reader.
std::unique_ptr<Reader> make_array_reader(std::string format, std::vector<ArrayField> fields,
                                          std::vector<Metadata> metadata, std::unique_ptr<ByteSource> content,
                                          Progress* progress);

/// Opens a NRRD file (http://teem.sourceforge.net/nrrd/format.html). folder: that of detached data, in one or several
/// files; nullopt: such files are refused.
std::unique_ptr<Reader> open_nrrd(std::unique_ptr<ByteSource> content,
                                  const std::optional<std::filesystem::path>& folder, Progress* progress);

/// Opens a file of VTK's image data (.vti) of one piece, with arrays inline or appended.
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
