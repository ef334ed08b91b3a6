#include <tiffio.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <cstring>
#include <exception>
#include <new>
#include <utility>

#include "base/number_parsing.hpp"
#include "volume/array_file.hpp"
#include "volume/source_file.hpp"

namespace cumulet::volume::detail {

namespace {

constexpr const char* too_short = "the file is truncated or damaged: its slices have more values than bytes";

/// Source of libtiff's reads, and the first error.
struct Stream {
  ByteSource& content;
  std::uint64_t position = 0;
  std::string message{};
  std::exception_ptr error{};

  static Stream& of(thandle_t handle) { return *static_cast<Stream*>(handle); }

  static tmsize_t read(thandle_t handle, void* to, tmsize_t count) {
    Stream& stream = of(handle);
    try {
      const std::uint64_t from = std::min(stream.position, stream.content.size());
      const std::size_t got = stream.content.read(from, static_cast<char*>(to), static_cast<std::size_t>(count));
      stream.position += got;
      return static_cast<tmsize_t>(got);
    } catch (...) {
      if (!stream.error) stream.error = std::current_exception();
      return -1;
    }
  }
  static tmsize_t write(thandle_t /*handle*/, void* /*from*/, tmsize_t /*count*/) { return -1; }
  static toff_t seek(thandle_t handle, toff_t offset, int whence) {
    Stream& stream = of(handle);
    std::uint64_t base = 0;
    if (whence == SEEK_CUR) base = stream.position;
    if (whence == SEEK_END) base = stream.content.size();
    stream.position = base + offset;
    return stream.position;
  }
  static int close(thandle_t /*handle*/) { return 0; }
  static toff_t size(thandle_t handle) { return of(handle).content.size(); }

  static int keep_error(TIFF* /*tiff*/, void* user, const char* /*module*/, const char* format, va_list values) {
    auto& stream = *static_cast<Stream*>(user);
    std::array<char, 256> line{};
    if (stream.message.empty() && std::vsnprintf(line.data(), line.size(), format, values) > 0)
      stream.message = line.data();
    return 1;
  }
  static int ignore(TIFF* /*tiff*/, void* /*user*/, const char* /*module*/, const char* /*format*/,
                    va_list /*values*/) {
    return 1;
  }
};

struct CloseTiff {
  void operator()(TIFF* tiff) const { TIFFClose(tiff); }
};
using TiffPtr = std::unique_ptr<TIFF, CloseTiff>;

TiffPtr open_stream(Stream& stream) {
  const std::unique_ptr<TIFFOpenOptions, void (*)(TIFFOpenOptions*)> options(TIFFOpenOptionsAlloc(),
                                                                             TIFFOpenOptionsFree);
  if (options == nullptr) throw std::bad_alloc();
  // Tables and strips of a file are at most as large as the file, except decoded ones, for which this file allocates.
  constexpr std::uint64_t min_limit = std::uint64_t{64} << 20U;
  constexpr std::uint64_t max_limit = std::uint64_t{1} << 40U;
  const std::uint64_t limit = std::clamp(2 * std::min(stream.content.size(), max_limit), min_limit, max_limit);
  TIFFOpenOptionsSetMaxSingleMemAlloc(options.get(), static_cast<tmsize_t>(limit));
  TIFFOpenOptionsSetErrorHandlerExtR(options.get(), Stream::keep_error, &stream);
  TIFFOpenOptionsSetWarningHandlerExtR(options.get(), Stream::ignore, &stream);
  // m: the content is not mapped into memory.
  return TiffPtr(TIFFClientOpenExt("TIFF", "rm", &stream, Stream::read, Stream::write, Stream::seek, Stream::close,
                                   Stream::size, nullptr, nullptr, options.get()));
}

/// A codec and the greatest ratio of decoded to encoded bytes.
struct Compression {
  std::uint16_t number;
  std::uint64_t expansion;
};
constexpr std::array compressions = {Compression{COMPRESSION_NONE, 1}, Compression{COMPRESSION_LZW, 2800},
                                     Compression{COMPRESSION_ADOBE_DEFLATE, 1040},
                                     Compression{COMPRESSION_DEFLATE, 1040}, Compression{COMPRESSION_PACKBITS, 65}};

/// An image of a file, which is one slice.
struct Page {
  std::uint64_t directory = 0;  ///< its position in the file
  std::uint64_t first_byte = 0;
  std::uint64_t stored_bytes = 0;
  glm::ivec2 size{0};
  NumberType type = NumberType::uint8;
  bool is_plain = false;  ///< uncompressed and in strips

  [[nodiscard]] std::size_t row_bytes() const { return static_cast<std::size_t>(size.x) * size_of(type); }
  [[nodiscard]] std::size_t bytes() const { return row_bytes() * static_cast<std::size_t>(size.y); }
  [[nodiscard]] bool same_format(const Page& other) const { return size == other.size && type == other.type; }
  [[nodiscard]] std::string format() const {
    return std::to_string(size.x) + " x " + std::to_string(size.y) + " pixels of " + name_of(type);
  }
};

/// The description of the first page, as of ImageJ and of OME-TIFF, and the resolution.
struct Description {
  std::string text;
  glm::dvec2 pixels_per_unit{0.0};
  std::uint16_t unit = RESUNIT_INCH;
};

template <class Number>
Number field_of(TIFF* tiff, std::uint32_t tag) {
  Number number{};
  static_cast<void>(TIFFGetFieldDefaulted(tiff, tag, &number));
  return number;
}

NumberType type_of(TIFF* tiff) {
  const auto bits = field_of<std::uint16_t>(tiff, TIFFTAG_BITSPERSAMPLE);
  const auto format = field_of<std::uint16_t>(tiff, TIFFTAG_SAMPLEFORMAT);
  if (format == SAMPLEFORMAT_UINT && bits == 8) return NumberType::uint8;
  if (format == SAMPLEFORMAT_UINT && bits == 16) return NumberType::uint16;
  if (format == SAMPLEFORMAT_INT && bits == 8) return NumberType::int8;
  if (format == SAMPLEFORMAT_INT && bits == 16) return NumberType::int16;
  if (format == SAMPLEFORMAT_IEEEFP && bits == 32) return NumberType::float32;
  constexpr std::array names = {"unknown", "unsigned", "signed", "float"};
  fail("has " + std::string(format < names.size() ? names.at(format) : names[0]) + " values of " +
       std::to_string(bits) + " bits; integers of 8 and 16 bits and floats of 32 bits are read");
}

std::uint64_t expansion_of(TIFF* tiff) {
  const auto number = field_of<std::uint16_t>(tiff, TIFFTAG_COMPRESSION);
  const auto* const found = std::ranges::find(compressions, number, &Compression::number);
  if (found != compressions.end()) return found->expansion;
  const TIFFCodec* const codec = TIFFFindCODEC(number);
  fail("is compressed by " + (codec != nullptr ? std::string(codec->name) : "method " + std::to_string(number)) +
       "; LZW, deflate and PackBits are read");
}

/// Adds up the bytes of the strips or tiles. most: bytes of the file.
std::uint64_t stored_bytes_of(TIFF* tiff, std::uint64_t most) {
  const std::uint32_t count = TIFFIsTiled(tiff) != 0 ? TIFFNumberOfTiles(tiff) : TIFFNumberOfStrips(tiff);
  if (count == 0 || count > most) fail(too_short);
  std::uint64_t sum = 0;
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::uint64_t bytes = TIFFGetStrileByteCount(tiff, i);
    if (bytes > most - sum) fail(too_short);
    sum += bytes;
  }
  return sum;
}

/// Checks the current page. file_bytes: size of the file. Throws for pages that are not slices of single values.
Page page_of(TIFF* tiff, std::uint64_t file_bytes) {
  Page page;
  page.directory = TIFFCurrentDirOffset(tiff);
  const auto samples = field_of<std::uint16_t>(tiff, TIFFTAG_SAMPLESPERPIXEL);
  if (samples != 1) fail("has " + std::to_string(samples) + " values per pixel; one is read");
  std::uint16_t photometric = PHOTOMETRIC_MINISBLACK;
  static_cast<void>(TIFFGetField(tiff, TIFFTAG_PHOTOMETRIC, &photometric));
  if (photometric == PHOTOMETRIC_MINISWHITE) fail("has values whose 0 is white; make 0 black");
  if (photometric == PHOTOMETRIC_PALETTE) fail("has a color palette; values without a palette are read");
  if (photometric != PHOTOMETRIC_MINISBLACK)
    fail("has the photometric interpretation " + std::to_string(photometric) + "; gray values are read");
  const auto orientation = field_of<std::uint16_t>(tiff, TIFFTAG_ORIENTATION);
  if (orientation != ORIENTATION_TOPLEFT)
    fail("has the orientation " + std::to_string(orientation) + "; 1 (first row at the top) is read");
  if (field_of<std::uint32_t>(tiff, TIFFTAG_IMAGEDEPTH) != 1) fail("has pages with a depth, which are not read");
  const auto width = field_of<std::uint32_t>(tiff, TIFFTAG_IMAGEWIDTH);
  const auto height = field_of<std::uint32_t>(tiff, TIFFTAG_IMAGELENGTH);
  constexpr std::uint32_t most = 1U << 30U;
  page.size = glm::ivec2(std::min(width, most), std::min(height, most));
  page.type = type_of(tiff);
  ArrayField slice;
  slice.size = glm::ivec3(page.size, 1);
  check_array_size(slice);
  const std::uint64_t expansion = expansion_of(tiff);
  page.stored_bytes = stored_bytes_of(tiff, file_bytes);
  const bool tiled = TIFFIsTiled(tiff) != 0;
  const tmsize_t part = tiled ? TIFFTileSize(tiff) : TIFFStripSize(tiff);
  if (part <= 0 ||
      std::max<std::uint64_t>(page.bytes(), static_cast<std::uint64_t>(part)) / expansion > page.stored_bytes)
    fail(too_short);
  page.is_plain = expansion == 1 && !tiled;
  page.first_byte = TIFFGetStrileOffset(tiff, 0);
  return page;
}

/// A TIFF file.
class TiffFile {
 public:
  explicit TiffFile(std::unique_ptr<ByteSource> content, Progress* progress)
      : content_(std::move(content)), stream_{.content = *content_} {
    tiff_ = open_stream(stream_);
    if (tiff_ == nullptr) fail_as("cannot be read as TIFF");
    read_description();
    read_pages(progress);
  }

  [[nodiscard]] const std::vector<Page>& pages() const { return pages_; }
  [[nodiscard]] const Description& description() const { return description_; }
  [[nodiscard]] bool is_big_endian() const { return TIFFIsBigEndian(tiff_.get()) != 0; }
  /// Gives up the content.
  [[nodiscard]] std::unique_ptr<ByteSource> release() && {
    tiff_.reset();
    return std::move(content_);
  }

  /// Decodes a page, row by row in the byte order of this machine.
  void decode(const Page& page, char* to) {
    stream_.message.clear();
    if (TIFFSetSubDirectory(tiff_.get(), page.directory) == 0) fail_as(end_of_file);
    if (TIFFIsTiled(tiff_.get()) != 0) {
      decode_tiles(page, to);
    } else {
      decode_strips(page, to);
    }
  }

 private:
  /// Throws the error of the content or of libtiff, or else the cause.
  [[noreturn]] void fail_as(const std::string& cause) {
    if (stream_.error) std::rethrow_exception(std::exchange(stream_.error, nullptr));
    fail(stream_.message.empty() ? cause : "the file is truncated or damaged: " + one_line(stream_.message));
  }

  void read_description() {
    const char* text = nullptr;
    if (TIFFGetField(tiff_.get(), TIFFTAG_IMAGEDESCRIPTION, &text) != 0 && text != nullptr) description_.text = text;
    glm::vec2 resolution(0.0F);
    static_cast<void>(TIFFGetField(tiff_.get(), TIFFTAG_XRESOLUTION, &resolution.x));
    static_cast<void>(TIFFGetField(tiff_.get(), TIFFTAG_YRESOLUTION, &resolution.y));
    description_.pixels_per_unit = resolution;
    description_.unit = field_of<std::uint16_t>(tiff_.get(), TIFFTAG_RESOLUTIONUNIT);
  }

  void read_pages(Progress* progress) {
    std::uint64_t left = content_->size();
    do {
      check(progress);
      // Smaller copies of pages are not slices.
      if ((field_of<std::uint32_t>(tiff_.get(), TIFFTAG_SUBFILETYPE) & FILETYPE_REDUCEDIMAGE) != 0) continue;
      const std::string name = "page " + std::to_string(pages_.size() + 1) + ' ';
      try {
        pages_.push_back(page_of(tiff_.get(), content_->size()));
      } catch (const std::runtime_error& cause) {
        fail(pages_.empty() ? cause.what() : name + cause.what());
      }
      const Page& page = pages_.back();
      if (!page.same_format(pages_.front()))
        fail(name + "has " + page.format() + ", and the first page has " + pages_.front().format());
      if (page.stored_bytes > left) fail(too_short);
      left -= page.stored_bytes;
    } while (TIFFReadDirectory(tiff_.get()) != 0);
    if (stream_.error || !stream_.message.empty()) fail_as(end_of_file);
    if (pages_.empty()) fail("has no image of full size");
  }

  void decode_strips(const Page& page, char* to) {
    const std::size_t rows =
        std::min(field_of<std::uint32_t>(tiff_.get(), TIFFTAG_ROWSPERSTRIP), static_cast<std::uint32_t>(page.size.y));
    const std::size_t whole = rows * page.row_bytes();
    std::uint32_t strip = 0;
    for (std::size_t at = 0; at < page.bytes(); at += whole) {
      const auto bytes = static_cast<tmsize_t>(std::min(whole, page.bytes() - at));
      if (TIFFReadEncodedStrip(tiff_.get(), strip++, to + at, bytes) != bytes) fail_as(end_of_file);
    }
  }

  void decode_tiles(const Page& page, char* to) {
    const auto width = static_cast<std::size_t>(field_of<std::uint32_t>(tiff_.get(), TIFFTAG_TILEWIDTH));
    const auto height = static_cast<std::size_t>(field_of<std::uint32_t>(tiff_.get(), TIFFTAG_TILELENGTH));
    const std::size_t tile_row = width * size_of(page.type);
    std::vector<char> tile(tile_row * height);
    const auto columns = static_cast<std::size_t>(page.size.x);
    const auto rows = static_cast<std::size_t>(page.size.y);
    std::uint32_t number = 0;
    for (std::size_t y = 0; y < rows; y += height) {
      for (std::size_t x = 0; x < columns; x += width) {
        const auto bytes = static_cast<tmsize_t>(tile.size());
        if (TIFFReadEncodedTile(tiff_.get(), number++, tile.data(), bytes) != bytes) fail_as(end_of_file);
        const std::size_t copied = std::min(tile_row, page.row_bytes() - x * size_of(page.type));
        for (std::size_t row = 0; row < std::min(height, rows - y); ++row)
          std::memcpy(to + (y + row) * page.row_bytes() + x * size_of(page.type), tile.data() + row * tile_row, copied);
      }
    }
  }

  std::unique_ptr<ByteSource> content_;
  Stream stream_;
  TiffPtr tiff_;
  Description description_;
  std::vector<Page> pages_;
};

/// The decoded slices one after the other.
class Slices : public ByteSource {
 public:
  Slices(std::size_t count, const Page& format) : count_(count), slice_bytes_(format.bytes()) {}

  [[nodiscard]] std::uint64_t size() const override { return std::uint64_t{count_} * slice_bytes_; }
  std::size_t read(std::uint64_t position, char* to, std::size_t count) override {
    std::size_t done = 0;
    while (done < count && position < size()) {
      const auto slice = static_cast<std::size_t>(position / slice_bytes_);
      if (decoded_ != slice) {
        decoded_.reset();
        slice_.resize(slice_bytes_);
        decode(slice, slice_.data());
        decoded_ = slice;
      }
      const auto at = static_cast<std::size_t>(position % slice_bytes_);
      const std::size_t bytes = std::min(count - done, slice_bytes_ - at);
      std::memcpy(to + done, slice_.data() + at, bytes);
      done += bytes;
      position += bytes;
    }
    return done;
  }

 private:
  virtual void decode(std::size_t slice, char* to) = 0;

  std::size_t count_;
  std::size_t slice_bytes_;
  std::vector<char> slice_;
  std::optional<std::size_t> decoded_;
};

class PageSlices final : public Slices {
 public:
  explicit PageSlices(std::unique_ptr<TiffFile> file)
      : Slices(file->pages().size(), file->pages().front()), file_(std::move(file)) {}

 private:
  void decode(std::size_t slice, char* to) override { file_->decode(file_->pages()[slice], to); }

  std::unique_ptr<TiffFile> file_;
};

/// Returns the value of KEY=VALUE on a line of ImageJ's description.
std::string line_value_of(const std::string& text, const std::string& key) {
  const std::string begin = '\n' + key + '=';
  const std::size_t found = text.find(begin);
  if (found == std::string::npos) return {};
  const std::size_t from = found + begin.size();
  return text.substr(from, std::min(text.find('\n', from), text.size()) - from);
}

/// Returns the value of an XML attribute in OME's description.
std::string attribute_of(const std::string& text, const std::string& key) {
  constexpr std::string_view spaces = " \t\r\n";
  for (std::size_t at = text.find(key); at != std::string::npos; at = text.find(key, at + 1)) {
    if (at == 0 || spaces.find(text[at - 1]) == std::string_view::npos) continue;
    const std::size_t equals = text.find_first_not_of(spaces, at + key.size());
    if (equals == std::string::npos || text[equals] != '=') continue;
    const std::size_t quote = text.find_first_not_of(spaces, equals + 1);
    if (quote == std::string::npos || (text[quote] != '"' && text[quote] != '\'')) continue;
    return text.substr(quote + 1, std::min(text.find(text[quote], quote + 1), text.size()) - quote - 1);
  }
  return {};
}

bool is_ome(const std::string& text) { return text.find("<OME") != std::string::npos; }
bool is_image_j(const std::string& text) { return text.starts_with("ImageJ="); }

double number_of(const std::string& text) {
  double number = 0.0;
  const auto [end, error] = number_from_chars(text.data(), text.data() + text.size(), number);
  return error == std::errc{} && std::isfinite(number) ? number : 0.0;
}

/// Refuses files whose pages are several channels or time points.
void require_one_volume(const std::string& text) {
  const bool ome = is_ome(text);
  if (!ome && !is_image_j(text)) return;
  const std::string channels = ome ? attribute_of(text, "SizeC") : line_value_of(text, "channels");
  const std::string times = ome ? attribute_of(text, "SizeT") : line_value_of(text, "frames");
  if (number_of(channels) > 1.0) fail("has " + one_line(channels, 20) + " channels; one is read");
  if (number_of(times) > 1.0) fail("has " + one_line(times, 20) + " time points; one is read");
}

/// Refuses files whose description gives several slices, but another number than there are pages.
void require_all_slices(const std::string& slices, std::size_t pages) {
  const double given = number_of(slices);
  if (given > 1.0 && given != static_cast<double>(pages))
    fail("has " + std::to_string(pages) + (pages == 1 ? " page" : " pages") + ", and its description gives " +
         one_line(slices, 20) + " slices");
}

/// Opens a file that is one slice.
std::unique_ptr<TiffFile> open_slice(const std::filesystem::path& file, Progress* progress) {
  try {
    auto opened = std::make_unique<TiffFile>(open_file(file), progress);
    if (opened->pages().size() > 1)
      fail("has " + std::to_string(opened->pages().size()) + " pages; in a folder, each file is one slice");
    require_one_volume(opened->description().text);
    return opened;
  } catch (const Error&) {
    throw;  // canceled
  } catch (const std::runtime_error& cause) {
    fail(file.filename().string() + ": " + cause.what());
  }
}

class FileSlices final : public Slices {
 public:
  FileSlices(std::vector<std::filesystem::path> files, const Page& format)
      : Slices(files.size(), format), files_(std::move(files)), format_(format) {}

 private:
  void decode(std::size_t slice, char* to) override {
    const auto file = open_slice(files_[slice], nullptr);
    const Page& page = file->pages().front();
    if (!page.same_format(format_)) fail(files_[slice].filename().string() + ": was changed meanwhile");
    file->decode(page, to);
  }

  std::vector<std::filesystem::path> files_;
  Page format_;
};

/// Returns the meters of a unit as OME writes it; 0: unknown.
double meters_of(const std::string& unit) {
  struct Unit {
    std::string_view name;
    double meters;
  };
  // The micro sign, the Greek letter, and the sign as a character reference.
  constexpr std::array units = {
      Unit{"nm", 1e-9}, Unit{"\xC2\xB5m", 1e-6},  Unit{"\xCE\xBCm", 1e-6}, Unit{"&#181;m", 1e-6}, Unit{"&#xB5;m", 1e-6},
      Unit{"um", 1e-6}, Unit{"micrometer", 1e-6}, Unit{"mm", 1e-3},        Unit{"cm", 1e-2},      Unit{"m", 1.0}};
  const auto* const found = std::ranges::find(units, std::string_view(unit), &Unit::name);
  return found == units.end() ? 0.0 : found->meters;
}

/// Returns the unit of an axis of OME's description, or else OME's default.
std::string unit_of(const std::string& text, char axis) {
  const std::string unit = attribute_of(text, std::string("PhysicalSize") + axis + "Unit");
  return unit.empty() ? "micrometer" : unit;
}

/// Returns the distance between voxels along an axis of OME's description, in the unit of X; 0: not given.
double physical_size_of(const std::string& text, char axis) {
  const double size = number_of(attribute_of(text, std::string("PhysicalSize") + axis));
  const std::string unit = unit_of(text, axis);
  const std::string unit_of_x = unit_of(text, 'X');
  if (!(size > 0.0) || unit == unit_of_x) return size;
  const double ratio = meters_of(unit) / meters_of(unit_of_x);
  if (!(ratio > 0.0) || !std::isfinite(size * ratio))
    fail("has voxel sizes in " + one_line(unit_of_x, 20) + " and " + one_line(unit, 20) +
         "; units that differ are converted if they are nm, \xC2\xB5m, mm, cm or m");
  return size * ratio;
}

/// Distance between voxels, in the unit of the file, and a line about its origin.
struct VoxelSize {
  glm::dvec3 size{1.0};
  std::string source;
};

VoxelSize voxel_size_of(const Description& from) {
  VoxelSize voxel;
  std::string unit = from.unit == RESUNIT_CENTIMETER ? "centimeter" : from.unit == RESUNIT_INCH ? "inch" : "no unit";
  double depth = 0.0;
  if (is_ome(from.text)) {
    const glm::dvec2 physical(physical_size_of(from.text, 'X'), physical_size_of(from.text, 'Y'));
    if (physical.x > 0.0 && physical.y > 0.0) {
      depth = physical_size_of(from.text, 'Z');
      voxel.size = glm::dvec3(physical, 0.0);
      voxel.source = "PhysicalSize of OME, " + unit_of(from.text, 'X');
    }
  }
  if (voxel.source.empty()) {
    if (!(from.pixels_per_unit.x > 0.0 && from.pixels_per_unit.y > 0.0)) return {};
    if (!std::isfinite(from.pixels_per_unit.x) || !std::isfinite(from.pixels_per_unit.y)) return {};
    voxel.size = glm::dvec3(1.0 / from.pixels_per_unit, 0.0);
    if (is_image_j(from.text)) {
      depth = std::abs(number_of(line_value_of(from.text, "spacing")));
      if (const std::string given = line_value_of(from.text, "unit"); !given.empty()) unit = given;
    }
    voxel.source = "resolution tags, " + unit;
  }
  voxel.size.z = depth > 0.0 ? depth : voxel.size.x;
  if (!(depth > 0.0)) voxel.source += "; the distance of slices is not given, and is that of columns";
  return voxel;
}

std::unique_ptr<Reader> reader_of(ArrayField field, const Page& format, std::size_t slices,
                                  const Description& description, std::unique_ptr<ByteSource> content,
                                  Progress* progress) {
  constexpr std::size_t most = std::size_t{1} << 30U;
  field.type = format.type;
  field.size = glm::ivec3(format.size, std::min(slices, most));
  const VoxelSize voxel = voxel_size_of(description);
  for (int axis = 0; axis < 3; ++axis) field.index_to_world[axis] *= voxel.size[axis];
  std::vector<Metadata> metadata;
  if (!voxel.source.empty()) metadata.push_back({"voxel size", "string", one_line(voxel.source)});
  return make_array_reader("TIFF", {std::move(field)}, std::move(metadata), std::move(content), progress);
}

/// Returns the field of values that this machine decoded.
ArrayField decoded_field() {
  ArrayField field;
  field.big_endian = std::endian::native == std::endian::big;
  return field;
}

}  // namespace

std::unique_ptr<Reader> open_tiff(std::unique_ptr<ByteSource> content, Progress* progress) {
  auto file = std::make_unique<TiffFile>(std::move(content), progress);
  const Page format = file->pages().front();
  const Description description = file->description();
  require_one_volume(description.text);
  // ImageJ writes stacks above 4 GB as one page, which the other slices follow.
  const std::string given_images = is_image_j(description.text) ? line_value_of(description.text, "images") : "";
  const double images = number_of(given_images);
  if (file->pages().size() == 1 && images > 1.0 && images <= 1e9) {
    if (!format.is_plain) fail("has one page of " + one_line(given_images, 20) + ", and it is compressed");
    ArrayField field;
    field.first_byte = format.first_byte;
    field.big_endian = file->is_big_endian();
    return reader_of(std::move(field), format, static_cast<std::size_t>(images), description,
                     std::move(*file).release(), progress);
  }
  const std::size_t slices = file->pages().size();
  require_all_slices(is_ome(description.text) ? attribute_of(description.text, "SizeZ") : given_images, slices);
  return reader_of(decoded_field(), format, slices, description, std::make_unique<PageSlices>(std::move(file)),
                   progress);
}

std::unique_ptr<Reader> open_tiff_slices(const std::vector<std::filesystem::path>& files, Progress* progress) {
  const auto first = open_slice(files.front(), progress);
  const Page format = first->pages().front();
  const std::string first_name = files.front().filename().string();
  for (std::size_t i = 1; i < files.size(); ++i) {
    const Page page = open_slice(files[i], progress)->pages().front();
    if (!page.same_format(format))
      fail(files[i].filename().string() + " has " + page.format() + ", and " + first_name + " has " + format.format());
  }
  return reader_of(decoded_field(), format, files.size(), first->description(),
                   std::make_unique<FileSlices>(files, format), progress);
}

}  // namespace cumulet::volume::detail
