// Files of newer OpenVDB and NanoVDB versions than those in this build, made by patching files of the current versions.

#define NANOVDB_USE_ZIP
#define NANOVDB_USE_BLOSC

#include <blosc.h>
#include <gtest/gtest.h>
#include <nanovdb/util/IO.h>
#include <nanovdb/util/OpenToNanoVDB.h>
#include <openvdb/io/Stream.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <fstream>
#include <random>
#include <vector>

#include "support/file_bytes.hpp"
#include "support/folder.hpp"
#include "support/vdb_files.hpp"
#include "volume/frame_import.hpp"
#include "volume/inspection.hpp"
#include "volume/volume.hpp"

namespace {

namespace fs = std::filesystem;
using cumulet::test::fog;
using cumulet::test::Messages;
using cumulet::volume::import_frame;
using cumulet::volume::import_volume;
using cumulet::volume::list_grids;
using cumulet::volume::ScalarVolume;
using nanovdb::io::Codec;
using openvdb::Coord;

using Handle = nanovdb::GridHandle<nanovdb::HostBuffer>;
using HalfGrid = openvdb::Grid<openvdb::tree::Tree4<openvdb::math::half, 5, 4, 3>::Type>;

/// Voxels of halves that are not constant, and a tile.
template <class GridT>
typename GridT::Ptr cloud(const std::string& name) {
  auto grid = GridT::create();
  grid->setName(name);
  grid->setGridClass(openvdb::GRID_FOG_VOLUME);
  std::mt19937 random(5);
  for (int i = 0; i < 900; ++i) {
    const Coord voxel(static_cast<int>(random() % 20), static_cast<int>(random() % 12),
                      static_cast<int>(random() % 40));
    grid->tree().setValue(voxel, typename GridT::ValueType(static_cast<float>(random() % 256) / 64.0F));
  }
  grid->tree().addTile(1, Coord(64, 0, 0), typename GridT::ValueType(0.75F), true);
  return grid;
}

struct NanoVersion {
  char file_digit;  ///< of the magic number
  char grid_digit;
  std::uint32_t minor;
  std::uint32_t patch;
};
constexpr std::array<NanoVersion, 8> nano_versions = {{{'0', '0', 3, 3},
                                                       {'0', '0', 4, 2},
                                                       {'0', '0', 6, 0},
                                                       {'0', '0', 7, 0},
                                                       {'2', '1', 8, 0},
                                                       {'2', '1', 9, 2},
                                                       {'1', '1', 9, 0},
                                                       {'2', '2', 9, 0}}};

std::uint64_t magic(char digit) {
  std::array<char, 8> text = {'N', 'a', 'n', 'o', 'V', 'D', 'B', digit};
  std::uint64_t number = 0;
  std::memcpy(&number, text.data(), text.size());
  return number;
}

template <class T>
void append(std::string& bytes, const T& value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

/// The grid's bytes as this version stores them, with the checksum of its head as that version computes it.
std::string grid_bytes(const Handle& handle, const NanoVersion& version, std::uint32_t index = 0,
                       std::uint32_t count = 1) {
  std::string bytes(reinterpret_cast<const char*>(handle.data()), handle.size());
  auto& grid = *reinterpret_cast<nanovdb::GridData*>(bytes.data());
  grid.mMagic = magic(version.grid_digit);
  grid.mVersion = nanovdb::Version(32, version.minor, version.patch);
  grid.mGridIndex = index;
  grid.mGridCount = count;
  const auto& tree = *reinterpret_cast<const nanovdb::TreeData<>*>(bytes.data() + sizeof grid);
  // Up to 32.6.0, the checksum also covers the root. The first upper node follows the root.
  const bool old = grid.mVersion <= nanovdb::Version(32, 6, 0);
  const std::uint64_t end = sizeof grid + (old ? tree.mNodeOffset[2] : sizeof tree);
  const auto head = crc32(0, reinterpret_cast<const Bytef*>(bytes.data()) + 16, static_cast<uInt>(end - 16));
  grid.mChecksum = (std::uint64_t{0xffffffff} << 32U) | head;
  return bytes;
}

std::string packed(const std::string& bytes, Codec codec) {
  if (codec == Codec::NONE) return bytes;
  std::string room(bytes.size() + bytes.size() / 100 + 1000, '\0');
  std::uint64_t size = room.size();
  if (codec == Codec::ZIP) {
    uLongf zipped = size;
    EXPECT_EQ(compress(reinterpret_cast<Bytef*>(room.data()), &zipped, reinterpret_cast<const Bytef*>(bytes.data()),
                       bytes.size()),
              Z_OK);
    size = zipped;
  } else {
    const int got = blosc_compress_ctx(9, 1, sizeof(float), bytes.size(), bytes.data(), room.data(), room.size(),
                                       BLOSC_LZ4_COMPNAME, 1U << 18U, 1);
    EXPECT_GT(got, 0);
    size = static_cast<std::uint64_t>(got);
  }
  std::string frame;
  append(frame, size);
  return frame.append(room, 0, size);
}

/// A segment of a file.
std::string segment(const std::vector<std::string>& grids, const NanoVersion& version, Codec codec) {
  nanovdb::io::Header header(codec);
  header.magic = magic(version.file_digit);
  header.version = nanovdb::Version(32, version.minor, version.patch);
  header.gridCount = static_cast<std::uint16_t>(grids.size());
  std::string bytes;
  append(bytes, header);
  std::string values;
  for (const std::string& grid : grids) {
    const auto& data = *reinterpret_cast<const nanovdb::GridData*>(grid.data());
    const std::string frame = packed(grid, codec);
    const std::string name = data.mGridName;
    nanovdb::io::MetaData meta{};
    meta.gridSize = grid.size();
    meta.fileSize = frame.size();
    meta.gridType = data.mGridType;
    meta.gridClass = data.mGridClass;
    meta.nameSize = static_cast<std::uint32_t>(name.size() + 1);
    meta.codec = codec;
    meta.version = header.version;
    append(bytes, meta);
    bytes.append(name.c_str(), name.size() + 1);
    values += frame;
  }
  return bytes + values;
}

class FileVersions : public ::testing::Test {
 protected:
  void SetUp() override { openvdb::initialize(); }

  [[nodiscard]] fs::path write(const std::string& bytes, const std::string& name) const {
    std::ofstream(folder_ / name, std::ios::binary) << bytes;
    return folder_ / name;
  }
  [[nodiscard]] std::string vdb(const openvdb::GridPtrVec& grids) const {
    const fs::path file = folder_ / "written.vdb";
    openvdb::io::File(file.string()).write(grids);
    return cumulet::test::bytes_of(file);
  }
  static std::string refusal(const fs::path& file) {
    return cumulet::test::refusal(file, [&] { (void)import_volume(file, "", {}); });
  }
  /// Reads it and expects no warning.
  static ScalarVolume read(const fs::path& file, const std::string& grid = {}) {
    Messages messages;
    ScalarVolume volume = import_volume(file, grid, messages.log);
    EXPECT_TRUE(messages.warnings.empty()) << messages.warnings[0];
    return volume;
  }

  cumulet::test::Folder folder_;
};

void expect_same(const ScalarVolume& a, const ScalarVolume& b) {
  EXPECT_EQ(a.brick_origins, b.brick_origins);
  ASSERT_EQ(a.brick_values.size(), b.brick_values.size());
  for (std::size_t i = 0; i < a.brick_values.size(); ++i) ASSERT_EQ(a.brick_values[i], b.brick_values[i]) << i;
  EXPECT_EQ(a.tiles.size(), b.tiles.size());
  EXPECT_EQ(a.max_value, b.max_value);
  EXPECT_EQ(a.active_voxels, b.active_voxels);
}

void patch(std::string& vdb, std::uint32_t version) { std::memcpy(vdb.data() + 8, &version, sizeof version); }

template <class BuildT>
Handle nano_of(const openvdb::FloatGrid& grid) {
  return nanovdb::openToNanoVDB<nanovdb::HostBuffer, openvdb::FloatTree, BuildT>(grid);
}

TEST_F(FileVersions, NanoVdbOfEveryVersionCodecAndType) {
  const auto grid = cloud<openvdb::FloatGrid>("density");
  const auto wide = cloud<openvdb::DoubleGrid>("density");
  std::vector<Handle> handles;
  handles.push_back(nano_of<float>(*grid));
  handles.push_back(nanovdb::openToNanoVDB(*wide));
  handles.push_back(nano_of<nanovdb::Fp4>(*grid));
  handles.push_back(nano_of<nanovdb::Fp8>(*grid));
  handles.push_back(nano_of<nanovdb::Fp16>(*grid));
  handles.push_back(nano_of<nanovdb::FpN>(*grid));
  const fs::path plain = folder_ / "plain.nvdb";
  for (const Handle& handle : handles) {
    nanovdb::io::writeGrid(plain.string(), handle);
    const ScalarVolume wanted = read(plain);
    for (const NanoVersion& version : nano_versions) {
      for (const Codec codec : {Codec::NONE, Codec::ZIP, Codec::BLOSC}) {
        SCOPED_TRACE(std::to_string(version.minor) + version.file_digit + std::to_string(static_cast<int>(codec)));
        const fs::path file = write(segment({grid_bytes(handle, version)}, version, codec), "versions.nvdb");
        expect_same(read(file), wanted);
        EXPECT_EQ(cumulet::volume::Inspection(file).format(), "NanoVDB 32." + std::to_string(version.minor));
      }
    }
  }
}

TEST_F(FileVersions, NanoVdbVectorsOfEveryVersion) {
  const auto density = cloud<openvdb::FloatGrid>("density");
  const auto velocity = openvdb::Vec3SGrid::create();
  velocity->setName("vel");
  velocity->tree().setValue(Coord(1, 2, 3), openvdb::Vec3s(3, -4, 12));
  velocity->tree().setValue(Coord(1, 2, 4), openvdb::Vec3s(1, 0, 0));
  const Handle of_density = nanovdb::openToNanoVDB(*density);
  const Handle of_velocity = nanovdb::openToNanoVDB(*velocity);
  for (const NanoVersion& version : nano_versions) {
    Messages messages;
    const fs::path file = write(
        segment({grid_bytes(of_density, version, 0, 2), grid_bytes(of_velocity, version, 1, 2)}, version, Codec::ZIP),
        "vectors.nvdb");
    const auto frame = import_frame(file, {}, messages.log);
    EXPECT_TRUE(messages.warnings.empty()) << messages.warnings[0];
    ASSERT_TRUE(frame.velocity);
    EXPECT_EQ(frame.velocity->parts[0].max_value, 3.0F);
    EXPECT_EQ(frame.velocity->parts[3].max_value, 4.0F);
    EXPECT_EQ(frame.velocity->parts[4].max_value, 12.0F);
  }
}

TEST_F(FileVersions, NanoVdbBuffersOfOneOrMoreGrids) {
  const Handle density = nanovdb::openToNanoVDB(*cloud<openvdb::FloatGrid>("density"));
  const auto flame = cloud<openvdb::FloatGrid>("flame");
  flame->tree().setValue(Coord(3, 3, 3), 9.0F);
  const Handle of_flame = nano_of<nanovdb::Fp16>(*flame);
  const fs::path plain = folder_ / "plain.nvdb";
  nanovdb::io::writeGrid(plain.string(), density);
  const ScalarVolume wanted = read(plain);
  for (const NanoVersion& version : nano_versions) {
    SCOPED_TRACE(version.minor);
    expect_same(read(write(grid_bytes(density, version), "one.nvdb")), wanted);
    const std::string both = grid_bytes(density, version, 0, 2) + grid_bytes(of_flame, version, 1, 2);
    const fs::path file = write(both, "two.nvdb");
    ASSERT_EQ(list_grids(file).size(), 2U);
    EXPECT_EQ(list_grids(file)[1].type, "Float16");
    expect_same(read(file, "density"), wanted);
    EXPECT_NEAR(read(file, "flame").max_value, 9.0F, 1e-3F);
    // Unused space of a buffer after its grids.
    EXPECT_EQ(list_grids(write(both + std::string(4096, '\0'), "room.nvdb")).size(), 2U);
    // One of several grids, written separately.
    EXPECT_EQ(read(write(grid_bytes(density, version, 1, 2), "second.nvdb")).max_value, wanted.max_value);
    // A segment after the grids, as `cat` of two files gives.
    EXPECT_EQ(list_grids(write(both + segment({grid_bytes(density, version)}, version, Codec::ZIP), "cat.nvdb")).size(),
              3U);

    Messages messages;
    (void)import_volume(write(both.substr(0, density.size()), "part.nvdb"), "", messages.log);
    ASSERT_EQ(messages.warnings.size(), 1U);
    EXPECT_HAS(messages.warnings[0], "part.nvdb: was written with 2 grids, but holds 1");
    EXPECT_HAS(refusal(write(both.substr(0, both.size() - 9), "cut.nvdb")), "the file is truncated: ");
  }
}

TEST_F(FileVersions, NanoVdbLongNamesOfBuffers) {
  const Handle handle = nanovdb::openToNanoVDB(*cloud<openvdb::FloatGrid>("density"));
  std::string bytes = grid_bytes(handle, nano_versions[5]);
  const std::string name(300, 'n');
  auto& grid = *reinterpret_cast<nanovdb::GridData*>(bytes.data());
  grid.mFlags |= static_cast<std::uint32_t>(nanovdb::GridFlags::HasLongGridName);
  grid.mBlindMetadataOffset = static_cast<std::int64_t>(bytes.size());
  grid.mBlindMetadataCount = 1;
  std::memset(grid.mGridName, 'n', sizeof grid.mGridName);
  nanovdb::GridBlindMetaData blind{};
  blind.mByteOffset = sizeof blind;
  blind.mElementCount = name.size() + 1;
  blind.mDataClass = nanovdb::GridBlindDataClass::GridName;
  grid.mGridSize = bytes.size() + sizeof blind + 320;
  append(bytes, blind);
  bytes.append(name).append(20, '\0');
  EXPECT_EQ(list_grids(write(bytes, "long.nvdb")).at(0).name, name);
  // If the entry points outside of the grid, the reader falls back to the name in the grid itself.
  reinterpret_cast<nanovdb::GridBlindMetaData*>(bytes.data() + handle.size())->mByteOffset = 1 << 30;
  EXPECT_EQ(list_grids(write(bytes, "bad.nvdb")).at(0).name, name.substr(0, 256));
}

TEST_F(FileVersions, NanoVdbChecksumsAreThoseOfTheVersion) {
  const Handle handle = nanovdb::openToNanoVDB(*cloud<openvdb::FloatGrid>("density"));
  const auto warnings = [&](NanoVersion version, std::size_t flipped) {
    std::string bytes = grid_bytes(handle, version);
    bytes[flipped] = static_cast<char>(bytes[flipped] ^ 1);
    Messages messages;
    (void)import_volume(write(segment({bytes}, version, Codec::NONE), "flipped.nvdb"), "", messages.log);
    return messages.warnings;
  };
  constexpr std::size_t in_the_name = 60;
  for (const NanoVersion& version : nano_versions) {
    ASSERT_EQ(warnings(version, in_the_name).size(), 1U) << version.minor;
    EXPECT_HAS(warnings(version, in_the_name)[0], "checksum");
  }
  // For a newer version the checksum's range is unknown. The log warns once about the version instead.
  const std::vector<std::string> later = warnings({'2', '1', 11, 4}, in_the_name);
  ASSERT_EQ(later.size(), 1U);
  EXPECT_HAS(later[0], "flipped.nvdb: was written by NanoVDB 32.11.4, which is newer than the known 32.9");
}

TEST_F(FileVersions, NanoVdbRefusalsNameVersionAndCause) {
  const Handle handle = nanovdb::openToNanoVDB(*cloud<openvdb::FloatGrid>("density"));
  const NanoVersion known = nano_versions[5];
  const auto with_version = [](std::string bytes, std::size_t at, const nanovdb::Version& version) {
    std::memcpy(bytes.data() + at, &version, sizeof version);
    return bytes;
  };
  const std::string file = segment({grid_bytes(handle, known)}, known, Codec::NONE);
  EXPECT_HAS(refusal(write(with_version(file, 8, {33, 1, 0}), "33.nvdb")),
             "was written by NanoVDB 33.1.0; this library reads NanoVDB 32.x");
  EXPECT_HAS(refusal(write(with_version(file, 8, {29, 3, 0}), "29.nvdb")),
             "was written by NanoVDB 29.3.0; this library reads NanoVDB 32.0 and later");
  for (const NanoVersion& version : nano_versions) {
    EXPECT_HAS(refusal(write(with_version(grid_bytes(handle, version), 16, {34, 0, 1}), "raw.nvdb")),
               "was written by NanoVDB 34.0.1; this library reads NanoVDB 32.x");
  }
  std::string other = file;
  other[7] = '7';
  EXPECT_HAS(refusal(write(other, "other.nvdb")), "magic number NanoVDB7");
  for (const char digit : {'0', '1', '2'}) {
    EXPECT_HAS(refusal(write(digit + std::string("BDVonaN") + std::string(800, '\0'), "big.nvdb")), "big-endian");
  }
  EXPECT_HAS(refusal(write(std::string("\0\0\0\0VDB ", 8) + std::string(800, '\0'), "big.vdb")), "big-endian");
  // Types that were added after NanoVDB 32.4.
  const std::vector<std::pair<std::uint32_t, std::string>> types = {
      {20, "OnIndex"}, {23, "PointIndex"}, {24, "Vec3u8"}, {26, "uint8"}, {41, "unknown type 41"}};
  for (const auto& [type, name] : types) {
    std::string grid = grid_bytes(handle, known);
    reinterpret_cast<nanovdb::GridData*>(grid.data())->mGridType = static_cast<nanovdb::GridType>(type);
    EXPECT_HAS(refusal(write(segment({grid}, known, Codec::BLOSC), "type.nvdb")), "has type " + name);
    EXPECT_HAS(refusal(write(grid, "raw_type.nvdb")), "has type " + name);
  }
}

TEST_F(FileVersions, DamagedNanoVdbBuffersNeverCrash) {
  const Handle handle = nanovdb::openToNanoVDB(*cloud<openvdb::FloatGrid>("density"));
  const std::string whole = grid_bytes(handle, nano_versions[5], 0, 2) + grid_bytes(handle, nano_versions[5], 1, 2);
  std::mt19937 random(11);
  for (int round = 0; round < 400; ++round) {
    std::string bytes = whole;
    const std::size_t start = round % 2 == 0 ? 0 : handle.size();
    for (int flip = 0; flip < 4; ++flip) bytes[start + random() % 800] = static_cast<char>(random());
    const fs::path file = write(bytes, "damaged.nvdb");
    try {
      (void)import_frame(file, {}, {});
    } catch (const cumulet::Error& error) {
      EXPECT_EQ(std::string(error.what()).rfind(file.string() + ": ", 0), 0U) << error.what();
    }
  }
  for (std::size_t size = 8; size < whole.size(); size += size < 1000 ? 13 : whole.size() / 20) {
    try {
      (void)import_frame(write(whole.substr(0, size), "cut.nvdb"), {}, {});
    } catch (const cumulet::Error& error) {
      const std::string what = error.what();
      EXPECT_TRUE(what.find("truncated") != std::string::npos || what.find("damaged") != std::string::npos) << what;
    }
  }
}

TEST_F(FileVersions, AnyVdbVersionNumberIsAccepted) {
  const auto grid = cloud<openvdb::FloatGrid>("density");
  std::string bytes = vdb({grid});
  const ScalarVolume wanted = read(write(bytes, "224.vdb"));
  patch(bytes, 225);
  // OpenVDB 13 leaves the identifier blank if it cannot make one.
  std::string blank = bytes;
  std::fill_n(blank.begin() + 21, 36, '\0');
  for (const std::string& file : {bytes, blank}) {
    expect_same(read(write(file, "225.vdb")), wanted);
    EXPECT_EQ(cumulet::volume::Inspection(write(file, "225.vdb")).format(), "OpenVDB 225");
  }
  for (const std::uint32_t later : {226U, 300U, 0xffffffffU}) {
    patch(bytes, later);
    Messages messages;
    const fs::path file = write(bytes, "later.vdb");
    expect_same(import_volume(file, "", messages.log), wanted);
    ASSERT_EQ(messages.warnings.size(), 1U);
    EXPECT_EQ(messages.warnings[0],
              file.string() + ": has VDB file format " + std::to_string(later) + ", which is newer than the known 225");
    messages.warnings.clear();
    (void)import_frame(file, {}, messages.log);
    EXPECT_EQ(messages.warnings.size(), 1U);
  }
  // Errors in a file of a newer format name its version.
  patch(bytes, 231);
  EXPECT_HAS(refusal(write(bytes.substr(0, 90), "cut.vdb")), "231, which is newer than the known 225");
  patch(bytes, 215);
  EXPECT_HAS(refusal(write(bytes, "old.vdb")), "VDB file format 215 is not supported");
}

TEST_F(FileVersions, VdbHalfFloatGridsAreRead) {
  const auto grid = cloud<HalfGrid>("density");
  const auto same = cloud<openvdb::FloatGrid>("density");
  const auto other = cloud<openvdb::FloatGrid>("flame");
  const ScalarVolume wanted = read(write(vdb({same}), "float.vdb"));
  for (const bool half : {false, true}) {
    grid->setSaveFloatAsHalf(half);
    for (const std::uint32_t flags :
         {std::uint32_t{openvdb::io::COMPRESS_NONE}, std::uint32_t{openvdb::io::COMPRESS_ACTIVE_MASK},
          std::uint32_t{openvdb::io::COMPRESS_ZIP} | openvdb::io::COMPRESS_ACTIVE_MASK,
          std::uint32_t{openvdb::io::COMPRESS_BLOSC} | openvdb::io::COMPRESS_ACTIVE_MASK}) {
      const fs::path file = folder_ / "half.vdb";
      openvdb::io::File out(file.string());
      out.setCompression(flags);
      out.write({other, grid});
      out.close();
      std::string bytes = cumulet::test::bytes_of(file);
      patch(bytes, 225);
      const fs::path later = write(bytes, "later.vdb");
      const auto listed = list_grids(later);
      ASSERT_EQ(listed.size(), 2U);
      const auto& entry = listed[0].name == "density" ? listed[0] : listed[1];
      EXPECT_EQ(entry.type, "half");
      EXPECT_EQ(entry.refusal, "");
      expect_same(read(later, "density"), wanted);
      expect_same(read(later, "flame"), wanted);
    }
  }
  // Written to a pipe, without offsets: the second grid follows the first.
  std::ofstream(folder_ / "pipe.vdb", std::ios::binary).close();
  {
    std::ofstream out(folder_ / "pipe.vdb", std::ios::binary);
    openvdb::io::Stream(out).write(openvdb::GridCPtrVec{grid, other});
  }
  expect_same(read(folder_ / "pipe.vdb", "density"), wanted);
  expect_same(read(folder_ / "pipe.vdb", "flame"), wanted);
}

TEST_F(FileVersions, VdbHalfFloatMetadataIsRead) {
  const auto grid = cloud<openvdb::FloatGrid>("density");
  openvdb::UnknownMetadata half("half");
  half.setValue({0x00, 0x3e});
  grid->insertMeta("scale", half);
  std::string bytes = vdb({grid});
  patch(bytes, 225);
  const cumulet::volume::Inspection inspection(write(bytes, "metadata.vdb"));
  const auto& entries = inspection.grids().at(0).metadata;
  const auto found = std::ranges::find(entries, "scale", &cumulet::volume::Metadata::name);
  ASSERT_NE(found, entries.end());
  EXPECT_EQ(found->type, "half");
  EXPECT_EQ(found->value, "1.5");
}

TEST_F(FileVersions, OnlyUnknownGridTypesAreRejected) {
  const auto grid = cloud<openvdb::FloatGrid>("density");
  std::string bytes = vdb({grid, cloud<openvdb::FloatGrid>("future")});
  patch(bytes, 226);
  const std::string known = "Tree_float_5_4_3";
  const std::size_t at = bytes.find(known, bytes.find("future"));
  const std::size_t first = bytes.find("future");
  ASSERT_NE(at, std::string::npos);
  ASSERT_LT(at, first + 20);
  bytes.replace(at, known.size(), "Tree_quarter_543");
  Messages messages;
  const fs::path file = write(bytes, "future.vdb");
  EXPECT_EQ(import_volume(file, "density", messages.log).max_value, grid->tree().cbeginLeaf() ? 255.0F / 64.0F : 0.0F);
  const std::string refused = cumulet::test::refusal(file, [&] { (void)import_volume(file, "future", {}); });
  EXPECT_HAS(refused, "grid \"future\" has type Tree_quarter_543");
}

}  // namespace
