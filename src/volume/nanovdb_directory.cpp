#include "volume/nanovdb_directory.hpp"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <map>
#include <optional>
#include <string_view>

#include "volume/import_detail.hpp"

namespace cumulet::volume::detail {
namespace {

using nanovdb::io::Codec;

// The last character of the magic number is 0 up to NanoVDB 32.7; later it is 1 for grids and 2 for files.
constexpr std::uint64_t magic_of_both = 0x304244566f6e614e;   // "NanoVDB0"
constexpr std::uint64_t magic_of_grids = 0x314244566f6e614e;  // "NanoVDB1"
constexpr std::uint64_t magic_of_files = 0x324244566f6e614e;  // "NanoVDB2"
bool is_known(std::uint64_t magic) {
  return magic == magic_of_both || magic == magic_of_grids || magic == magic_of_files;
}

constexpr std::uint32_t known_minor = 9;  // NanoVDB 32.9, of OpenVDB 13
constexpr std::uint64_t head_bytes = sizeof(nanovdb::GridData) + sizeof(NanoTreeData);
constexpr std::uint32_t name_class = 3;  // GridBlindDataClass::GridName

std::string text_of(const nanovdb::Version& version) {
  return std::to_string(version.getMajor()) + "." + std::to_string(version.getMinor()) + "." +
         std::to_string(version.getPatch());
}

/// Whether the bytes are probably a version: other bytes would have any of 2048 major numbers.
bool is_likely(const nanovdb::Version& version) {
  constexpr std::uint32_t last_likely_major = 99;
  return version.getMajor() > 0 && version.getMajor() <= last_likely_major;
}

// Numbers and names of NanoVDB 32.9; those up to 19 are valid for all versions of 32.
std::string type_name(nanovdb::GridType type) {
  constexpr std::array<const char*, 27> names = {
      "unknown", "float",  "double",  "int16",     "int32",       "int64",      "Vec3f",   "Vec3d",   "Mask",
      "Half",    "uint32", "bool",    "RGBA8",     "Float4",      "Float8",     "Float16", "FloatN",  "Vec4f",
      "Vec4d",   "Index",  "OnIndex", "IndexMask", "OnIndexMask", "PointIndex", "Vec3u8",  "Vec3u16", "uint8"};
  const auto number = static_cast<std::uint32_t>(type);
  return number < names.size() ? names[number] : "unknown type " + std::to_string(number);
}

std::string class_name(nanovdb::GridClass grid_class) {
  constexpr std::array<const char*, 11> names = {"unknown",    "level set",   "fog volume",    "staggered",
                                                 "point grid", "point grid",  "topology grid", "voxel volume",
                                                 "index grid", "tensor grid", "grid of a BVH"};
  const auto number = static_cast<std::uint32_t>(grid_class);
  return number < names.size() ? names[number] : names[0];
}

/// Returns a name up to its terminator, which may be missing.
template <std::size_t Size>
std::string bounded(const char (&name)[Size]) {
  return {name, std::find(name, name + Size, '\0')};
}

class DirectoryReader {
 public:
  explicit DirectoryReader(SourceFile& stream) : stream_(stream), size_(static_cast<std::uint64_t>(stream.size())) {}

  NanoDirectory run() {
    bool after_grids = false;
    for (std::uint64_t position = 0; position < size_;) {
      const std::optional<Part> part = part_at(position, after_grids);
      if (!part) break;
      after_grids = *part == Part::grid;
      position = after_grids ? read_grid(position) : read_segment(position);
    }
    if (expected_grids_ > out_.grids.size()) {
      out_.remarks.push_back("was written with " + std::to_string(expected_grids_) + " grids, but holds " +
                             std::to_string(out_.grids.size()));
    }
    make_unique_names();
    return std::move(out_);
  }

 private:
  enum class Part { segment, grid };

  void read_bytes(std::uint64_t position, void* to, std::uint64_t bytes) {
    if (position > size_ || bytes > size_ - position) fail(end_of_file);
    stream_.seekg(static_cast<std::streamoff>(position));
    stream_.read(static_cast<char*>(to), static_cast<std::streamsize>(bytes));
  }
  template <typename T>
  T read_value(std::uint64_t position) {
    std::array<char, sizeof(T)> bytes{};
    read_bytes(position, bytes.data(), bytes.size());
    T value;
    std::memcpy(static_cast<void*>(&value), bytes.data(), bytes.size());
    return value;
  }

  /// Returns the kind of part that begins here; nullopt for trailing bytes after grid buffers.
  std::optional<Part> part_at(std::uint64_t position, bool after_grids) {
    if (after_grids && size_ - position < sizeof(std::uint64_t)) return std::nullopt;
    const auto magic = read_value<std::uint64_t>(position);
    if (is_known(magic)) {
      // Some programs write files with the magic number of grids. The bytes after it distinguish the two.
      const Part likely = magic == magic_of_grids ? Part::grid : Part::segment;
      const Part other = likely == Part::grid ? Part::segment : Part::grid;
      return !looks_like(likely, position) && looks_like(other, position) ? other : likely;
    }
    if (after_grids) return std::nullopt;
    if (position > 0) fail("the file is damaged");
    std::string digit(1, '\0');
    read_bytes(position + 7, digit.data(), 1);
    fail("has the magic number NanoVDB" + digit + "; this library knows NanoVDB0, NanoVDB1 and NanoVDB2");
  }

  /// Checks the version, which follows the checksum in a grid, but comes first in a segment.
  bool looks_like(Part part, std::uint64_t position) {
    if (part == Part::segment) {
      if (size_ - position < sizeof(NanoFileHeader)) return false;
      const auto header = read_value<NanoFileHeader>(position);
      return is_likely(header.version) && header.codec <= Codec::BLOSC;
    }
    if (size_ - position < head_bytes) return false;
    const auto grid = read_value<nanovdb::GridData>(position);
    return is_likely(grid.mVersion) && grid.mGridSize >= head_bytes && grid.mGridIndex < grid.mGridCount;
  }

  void take_version(const nanovdb::Version& version) {
    const std::uint32_t major = version.getMajor();
    if (!is_likely(version)) fail("the file is damaged: invalid NanoVDB version");
    if (major != NANOVDB_MAJOR_VERSION_NUMBER) {
      fail("was written by NanoVDB " + text_of(version) + "; this library reads NanoVDB " +
           std::to_string(NANOVDB_MAJOR_VERSION_NUMBER) + "." +
           (major < NANOVDB_MAJOR_VERSION_NUMBER ? "0 and later" : "x"));
    }
    if (version.getMinor() > known_minor && out_.remarks.empty()) {
      out_.remarks.push_back("was written by NanoVDB " + text_of(version) + ", which is newer than the known " +
                             std::to_string(NANOVDB_MAJOR_VERSION_NUMBER) + "." + std::to_string(known_minor) +
                             ": its checksums are not verified");
    }
    out_.format = "NanoVDB " + std::to_string(major) + "." + std::to_string(version.getMinor());
  }

  void add(const NanoLocation& location, const std::string& name, nanovdb::GridClass grid_class) {
    GridInfo entry;
    entry.name = name;
    entry.type = type_name(location.type);
    entry.grid_class = class_name(grid_class);
    entry.refusal = scalar_fog_refusal(entry.type, entry.grid_class, is_nano_scalar(location.type));
    entry.values = is_nano_scalar(location.type)   ? Values::scalars
                   : is_nano_vector(location.type) ? Values::lengths
                                                   : Values::none;
    out_.locations.push_back(location);
    out_.grids.push_back(std::move(entry));
  }

  /// Returns the position after these bytes.
  [[nodiscard]] std::uint64_t behind(std::uint64_t position, std::uint64_t bytes) const {
    if (bytes > size_ - position) {
      fail("the file is truncated: " + std::to_string(size_) + " bytes of at least " +
           std::to_string(position + std::min(bytes, ~position)));
    }
    return position + bytes;
  }

  /// Lists the grids of the segment at this position. Returns the position of the next part.
  std::uint64_t read_segment(std::uint64_t position) {
    const auto header = read_value<NanoFileHeader>(position);
    take_version(header.version);
    if (header.codec > Codec::BLOSC) fail("the file is damaged: unknown compression");
    position += sizeof header;
    const std::size_t first = out_.locations.size();
    for (int i = 0; i < header.gridCount; ++i) {
      const auto meta = read_value<NanoFileMetaData>(position);
      position += sizeof meta;
      std::string name(std::min<std::uint64_t>(meta.nameSize, size_), '\0');
      read_bytes(position, name.data(), meta.nameSize);
      position += meta.nameSize;
      if (name.empty() || name.back() != '\0') fail("the file is damaged: a grid name is not terminated");
      name.resize(name.find('\0'));
      add({0, meta.fileSize, meta.gridSize, header.codec, meta.gridType}, name, meta.gridClass);
    }
    for (std::size_t i = first; i < out_.locations.size(); ++i) {
      out_.locations[i].position = position;
      position = behind(position, out_.locations[i].file_bytes);
    }
    return position;
  }

  /// Lists the grid whose buffer begins at this position. Returns the position of the next part.
  std::uint64_t read_grid(std::uint64_t position) {
    const auto grid = read_value<nanovdb::GridData>(position);
    take_version(grid.mVersion);
    if (grid.mGridSize < head_bytes) fail("the file is damaged: grid too small");
    const std::uint64_t next = behind(position, grid.mGridSize);
    if (position == 0 && grid.mGridIndex == 0) expected_grids_ = grid.mGridCount;
    add({position, grid.mGridSize, grid.mGridSize, Codec::NONE, grid.mGridType},
        long_name(position, grid).value_or(bounded(grid.mGridName)), grid.mGridClass);
    return next;
  }

  /// Names of more than 255 characters are in the grid's blind data, all of which is validated.
  std::optional<std::string> long_name(std::uint64_t position, const nanovdb::GridData& grid) {
    if ((flags_of(grid) & static_cast<std::uint32_t>(nanovdb::GridFlags::HasLongGridName)) == 0) return std::nullopt;
    const std::uint64_t bytes = grid.mGridSize;
    auto at = static_cast<std::uint64_t>(grid.mBlindMetadataOffset);
    for (std::uint32_t i = 0; i < grid.mBlindMetadataCount; ++i, at += sizeof(NanoBlindData)) {
      if (at > bytes || sizeof(NanoBlindData) > bytes - at) return std::nullopt;
      const auto blind = read_value<NanoBlindData>(position + at);
      if (blind.data_class != name_class) continue;
      // Relative to the entry itself, in all versions that write grid buffers.
      const std::uint64_t start = at + static_cast<std::uint64_t>(blind.data_offset);
      if (start > bytes || blind.value_count > bytes - start) return std::nullopt;
      std::string name(blind.value_count, '\0');
      read_bytes(position + start, name.data(), name.size());
      return name.substr(0, name.find('\0'));
    }
    return std::nullopt;
  }

  void make_unique_names() {
    std::map<std::string, int> uses;
    for (const GridInfo& entry : out_.grids) ++uses[entry.name];
    std::map<std::string, int> seen;
    for (GridInfo& entry : out_.grids) {
      const std::string& name = entry.name;
      entry.unique_name = uses[name] > 1 ? name + "[" + std::to_string(seen[name]++) + "]" : name;
    }
  }

  SourceFile& stream_;
  std::uint64_t size_;
  std::uint64_t expected_grids_ = 0;  // grid count of a buffer at the beginning of the file
  NanoDirectory out_;
};

}  // namespace

NanoDirectory read_nano_directory(SourceFile& stream) { return DirectoryReader(stream).run(); }

bool is_nano_grid(const nanovdb::GridData& grid) { return is_known(grid.mMagic); }

bool has_right_checksum(const nanovdb::GridData& grid, std::uint64_t root_bytes) {
  constexpr std::uint32_t none = ~std::uint32_t{0};
  const auto stored = static_cast<std::uint32_t>(checksum_of(grid));
  if (stored == none || grid.mVersion.getMinor() > known_minor) return true;
  // Up to 32.6.0 the checksum also covers the root.
  const bool with_root =
      grid.mVersion.getMinor() < 6 || (grid.mVersion.getMinor() == 6 && grid.mVersion.getPatch() == 0);
  const std::uint64_t end = head_bytes + (with_root ? root_bytes : 0);
  constexpr std::uint64_t begin = sizeof grid.mMagic + sizeof grid.mChecksum;
  const auto* bytes = reinterpret_cast<const Bytef*>(&grid);
  return crc32_z(0, bytes + begin, end - begin) == stored;
}

bool is_nano_scalar(nanovdb::GridType type) {
  switch (type) {
    case nanovdb::GridType::Float:
    case nanovdb::GridType::Double:
    case nanovdb::GridType::Fp4:
    case nanovdb::GridType::Fp8:
    case nanovdb::GridType::Fp16:
    case nanovdb::GridType::FpN:
      return true;
    default:
      return false;
  }
}

bool is_nano_vector(nanovdb::GridType type) {
  return type == nanovdb::GridType::Vec3f || type == nanovdb::GridType::Vec3d;
}

}  // namespace cumulet::volume::detail
