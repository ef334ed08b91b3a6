// The importer compared with OpenVDB: accepted grids must equal getValue() inside the active bounds. Rejected files
// give a one-line error that names file and cause.

#define NANOVDB_USE_ZIP
#define NANOVDB_USE_BLOSC

#include "volume/volume.hpp"
#include "volume/inspection.hpp"

#include <gtest/gtest.h>
#include <nanovdb/util/IO.h>
#include <nanovdb/util/OpenToNanoVDB.h>
#include <openvdb/io/Stream.h>
#include <openvdb/points/PointConversion.h>
#include <openvdb/tools/LevelSetSphere.h>

#include <chrono>
#include <cmath>
#include <fstream>
#include <glm/gtc/matrix_transform.hpp>
#include <random>

#include "base/error.hpp"
#include "support/file_bytes.hpp"
#include "support/volume_import.hpp"

namespace {

using cumulet::test::bytes_of;
using cumulet::test::expect_contract;
using cumulet::test::expect_same;
using cumulet::test::fog;
using cumulet::test::Lookup;
using cumulet::test::Messages;
using cumulet::test::reference;
using cumulet::test::rich;
using cumulet::test::VolumeImport;
using cumulet::volume::import_volume;
using cumulet::volume::list_grids;
using cumulet::volume::ScalarVolume;
using openvdb::Coord;
using openvdb::CoordBBox;
using openvdb::FloatGrid;
namespace fs = std::filesystem;

TEST_F(VolumeImport, EqualsOpenVdbWithBricksTilesAndBackground) {
  for (const float background : {0.0F, 0.125F}) {
    const auto grid = rich(background);
    const auto volume = import_volume(write({grid}), "", {});
    EXPECT_EQ(volume.name, "density");
    EXPECT_FALSE(volume.tiles.empty());
    EXPECT_FALSE(volume.brick_origins.empty());
    EXPECT_EQ(volume.max_value, 3.5F);
    expect_same(*grid, volume);
  }
}

TEST_F(VolumeImport, BackgroundCountsWithinBoundsOnly) {
  const auto grid = fog("density", 0.5F);
  grid->tree().setValue(Coord(0, 0, 0), 0.25F);
  grid->tree().setValue(Coord(20, 20, 20), 0.25F);
  const auto volume = import_volume(write({grid}), "", {});
  const Lookup lookup(volume);
  EXPECT_EQ(lookup.value({10, 10, 10}), 0.5F);
  EXPECT_EQ(lookup.value({0, 0, 1}), 0.5F);
  EXPECT_EQ(lookup.value({-1, 0, 0}), 0.0F);
  EXPECT_EQ(lookup.value({20, 20, 21}), 0.0F);
  EXPECT_EQ(volume.max_value, 0.5F);
  expect_same(*grid, volume);
}

TEST_F(VolumeImport, MaximumIgnoresACoveredBackground) {
  // The one voxel fills its bounds, so the larger background is nowhere in the field.
  const auto grid = fog("density", 5.0F);
  grid->tree().setValue(Coord(3, 4, 5), 0.25F);
  const auto volume = import_volume(write({grid}), "", {});
  EXPECT_EQ(volume.max_value, 0.25F);
  EXPECT_EQ(volume.active_voxels, 1U);
  expect_same(*grid, volume);
}

TEST_F(VolumeImport, HugeTilesAreNotDensified) {
  const auto grid = fog("density");
  grid->tree().addTile(3, Coord(0), 0.5F, true);
  grid->tree().addTile(3, Coord(4096, 0, 0), 0.25F, true);
  grid->tree().setValue(Coord(-1, 0, 0), 1.0F);
  const auto volume = import_volume(write({grid}), "", {});
  EXPECT_EQ(volume.active_voxels, 2ULL * 4096 * 4096 * 4096 + 1);
  EXPECT_LE(volume.tiles.size(), 3U);
  EXPECT_LE(volume.brick_origins.size(), 1U);
  expect_same(*grid, volume);
}

TEST_F(VolumeImport, ConstantBricksBecomeTilesOrBackground) {
  const auto grid = fog("density", 0.5F);
  grid->tree().setValue(Coord(100, 0, 0), 1.0F);
  for (int n = 0; n < 512; ++n) {
    const Coord c(n >> 6, (n >> 3) & 7, n & 7);
    grid->tree().setValue(c, 2.0F);
    grid->tree().setValue(c.offsetBy(16, 0, 0), 0.5F);
  }
  const auto volume = import_volume(write({grid}), "", {});
  ASSERT_EQ(volume.tiles.size(), 1U);
  EXPECT_EQ(volume.tiles[0].value, 2.0F);
  EXPECT_EQ(volume.tiles[0].max, glm::ivec3(7));
  EXPECT_EQ(volume.brick_origins.size(), 1U);
  EXPECT_EQ(volume.active_voxels, 1025U);
  expect_same(*grid, volume);
}

TEST_F(VolumeImport, AcceptsHalfDoubleAndUnsetClass) {
  auto half = rich(0.0F);
  half->setSaveFloatAsHalf(true);
  half->setGridClass(openvdb::GRID_UNKNOWN);
  const auto file = write({half});
  const auto listed = list_grids(file);
  ASSERT_EQ(listed.size(), 1U);
  EXPECT_EQ(listed[0].name, "density");
  EXPECT_EQ(listed[0].type, "half");
  EXPECT_EQ(listed[0].grid_class, "unknown");
  expect_same(*half, import_volume(file, "", {}), 2.0F / 1024);

  auto wide = openvdb::DoubleGrid::create(0.25);
  wide->setName("density");
  wide->tree().setValue(Coord(1, 2, 3), 1.5);
  wide->tree().setValue(Coord(9, 2, 3), 1.0 / 3.0);
  wide->tree().addTile(1, Coord(64, 0, 0), 0.75, true);
  expect_same(*wide, import_volume(write({wide}), "", {}));
}

TEST_F(VolumeImport, ReadsEveryCompressionAndPipes) {
  const auto grid = rich(0.125F);
  const auto file = path("test.vdb");
  for (const int flags : {int{openvdb::io::COMPRESS_NONE}, int{openvdb::io::COMPRESS_ZIP},
                          openvdb::io::COMPRESS_BLOSC | openvdb::io::COMPRESS_ACTIVE_MASK}) {
    openvdb::io::File out(file.string());
    out.setCompression(static_cast<std::uint32_t>(flags));
    out.write({grid});
    expect_same(*grid, import_volume(file, "", {}));
  }
  // io::Stream writes no offsets: the second grid can only be reached by reading the first.
  auto other = fog("second");
  other->tree().setValue(Coord(1, 2, 3), 4.0F);
  {
    std::ofstream out(file, std::ios::binary);
    openvdb::io::Stream(out).write(openvdb::GridCPtrVec{grid, other});
  }
  expect_same(*grid, import_volume(file, "", {}));
  expect_same(*other, import_volume(file, "second", {}));
}

TEST_F(VolumeImport, SharedTreesAreFollowed) {
  const auto grid = rich(0.0F);
  auto twin = FloatGrid::create(grid->treePtr());
  twin->setName("twin");
  twin->setTransform(openvdb::math::Transform::createLinearTransform(3.0));
  const auto file = write({grid, twin});
  const auto volume = import_volume(file, "twin", {});
  EXPECT_EQ(volume.index_to_world[0][0], 3.0);
  expect_same(*grid, volume);
}

TEST_F(VolumeImport, TakesAnyAffineTransform) {
  const auto grid = fog("density");
  grid->tree().setValue(Coord(0), 1.0F);
  openvdb::Mat4d m = openvdb::Mat4d::identity();
  m.preScale(openvdb::Vec3d(0.5, 2.0, 1e-3));
  m.postRotate(openvdb::math::Y_AXIS, 0.7);
  m.postShear(openvdb::math::X_AXIS, openvdb::math::Z_AXIS, 0.3);
  m.postTranslate(openvdb::Vec3d(10, -20, 30));
  grid->setTransform(openvdb::math::Transform::createLinearTransform(m));
  const auto nano = path("test.nvdb");
  nanovdb::io::writeGrid(nano.string(), nanovdb::openToNanoVDB(*grid));
  for (const auto& file : {write({grid}), nano}) {
    const auto volume = import_volume(file, "", {});
    for (const openvdb::Vec3d p : {openvdb::Vec3d(0, 0, 0), openvdb::Vec3d(1, 0, 0), openvdb::Vec3d(-3, 5, 7)}) {
      const openvdb::Vec3d truth = grid->transform().indexToWorld(p);
      const glm::dvec4 got = volume.index_to_world * glm::dvec4(p.x(), p.y(), p.z(), 1.0);
      EXPECT_NEAR(got.x, truth.x(), 1e-12);
      EXPECT_NEAR(got.y, truth.y(), 1e-12);
      EXPECT_NEAR(got.z, truth.z(), 1e-12);
      EXPECT_EQ(got.w, 1.0);
    }
  }
}

TEST_F(VolumeImport, NegativeVoxelsAreClampedAndCountedOnce) {
  const auto grid = fog("density");
  grid->tree().setValue(Coord(0), 1.0F);
  grid->tree().setValue(Coord(1, 0, 0), -1.0F);
  grid->tree().setValue(Coord(20, 0, 0), -0.5F);
  grid->tree().setValue(Coord(21, 0, 0), 0.5F);
  grid->tree().addTile(1, Coord(64, 0, 0), -2.0F, true);
  grid->tree().setValueOff(Coord(-50, 0, 0), -3.0F);  // outside of the bounds
  const auto file = write({grid});
  Messages messages;
  const auto volume = import_volume(file, "", messages.log);
  ASSERT_EQ(messages.warnings.size(), 1U);
  EXPECT_HAS(messages.warnings[0], "514 negative voxels");
  EXPECT_HAS(messages.warnings[0], file.string());
  expect_same(*grid, volume);

  Messages quiet;
  (void)import_volume(write({rich(0.0F)}), "", quiet.log);
  EXPECT_TRUE(quiet.warnings.empty());
}

TEST_F(VolumeImport, NegativeBackgroundCounts) {
  const auto grid = fog("density", -1.0F);
  grid->tree().setValue(Coord(0), 1.0F);
  grid->tree().setValue(Coord(0, 0, 31), 1.0F);
  Messages messages;
  const auto volume = import_volume(write({grid}), "", messages.log);
  ASSERT_EQ(messages.warnings.size(), 1U);
  EXPECT_HAS(messages.warnings[0], "30 negative voxels");
  expect_same(*grid, volume);
}

TEST_F(VolumeImport, NonFiniteValuesCountAsZeroAndAreCounted) {
  const float inf = std::numeric_limits<float>::infinity();
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const auto expect_counted = [&](const openvdb::GridBase::Ptr& grid, std::uint64_t count, const std::string& line) {
    Messages messages;
    const auto volume = import_volume(write({grid}), "", messages.log);
    expect_contract(volume);
    EXPECT_EQ(volume.non_finite_voxels, count);
    EXPECT_TRUE(std::isfinite(volume.max_value));
    EXPECT_EQ(messages.warnings.size(), 1U);
    const std::string warning = messages.warnings.empty() ? "" : messages.warnings[0];
    EXPECT_HAS(warning, "grid \"density\": " + line);
    return volume;
  };
  const auto voxel = fog("density");
  voxel->tree().setValue(Coord(0), 1.0F);
  voxel->tree().setValue(Coord(17, 2, 3), nan);
  const auto one = expect_counted(voxel, 1, "1 non-finite voxel read as 0");
  EXPECT_EQ(Lookup(one).value({17, 2, 3}), 0.0F);
  EXPECT_EQ(Lookup(one).value({0, 0, 0}), 1.0F);
  EXPECT_EQ(one.active_voxels, 2U);
  voxel->tree().setValue(Coord(17, 2, 4), -inf);  // counted as non-finite only
  voxel->tree().setValue(Coord(17, 2, 5), inf);
  EXPECT_EQ(expect_counted(voxel, 3, "3 non-finite voxels read as 0").max_value, 1.0F);
  const auto tile = fog("density");
  tile->tree().addTile(1, Coord(8, 0, 0), inf, true);
  EXPECT_EQ(expect_counted(tile, 512, "512 non-finite voxels").max_value, 0.0F);
  const auto background = fog("density", nan);
  background->tree().setValue(Coord(0), 1.0F);
  background->tree().setValue(Coord(0, 0, 9), 2.0F);
  const auto between = expect_counted(background, 8, "8 non-finite voxels");
  EXPECT_EQ(between.background, 0.0F);
  const auto big = openvdb::DoubleGrid::create();
  big->setName("density");
  big->tree().setValue(Coord(0), 1e300);
  expect_counted(big, 1, "1 non-finite voxel");
}

TEST_F(VolumeImport, EmptyGridsAreEmptyVolumes) {
  const auto passive = fog("density", 1.0F);
  passive->tree().setValueOff(Coord(0), 2.0F);
  const auto nano = path("empty.nvdb");
  nanovdb::io::writeGrid(nano.string(), nanovdb::openToNanoVDB(*fog("density")));
  for (const auto& file : {write({fog("density")}), write({passive}, "passive.vdb"), nano}) {
    Messages messages;
    const auto volume = import_volume(file, "", messages.log);
    EXPECT_TRUE(volume.empty());
    EXPECT_EQ(volume.max_value, 0.0F);
    EXPECT_EQ(Lookup(volume).value({0, 0, 0}), 0.0F);
    ASSERT_EQ(messages.warnings.size(), 1U) << file;
    EXPECT_HAS(messages.warnings[0], "grid \"density\": is empty");
  }
}

TEST_F(VolumeImport, RejectsGridsThatAreNotScalarFog) {
  const auto sphere = openvdb::tools::createLevelSetSphere<FloatGrid>(5.0F, openvdb::Vec3f(0), 1.0F);
  sphere->setName("surface");
  EXPECT_HAS(refusal(write({sphere})), "grid \"surface\" is a level set");
  const auto vec = openvdb::Vec3SGrid::create();
  vec->setName("vel");
  vec->tree().setValue(Coord(0), openvdb::Vec3s(1));
  EXPECT_HAS(refusal(write({vec})), "grid \"vel\" has type vec3s");
  EXPECT_HAS(refusal(write({vec, sphere})), "\"vel\" (vec3s, unknown), \"surface\" (float, level set)");
  const auto flag = openvdb::BoolGrid::create();
  flag->setName("density");
  flag->tree().setValue(Coord(0), true);
  EXPECT_HAS(refusal(write({flag})), "has type bool");
  const auto number = openvdb::Int32Grid::create();
  number->setName("id");
  number->tree().setValue(Coord(0), 1);
  EXPECT_HAS(refusal(write({number})), "has type int32");
  const auto points = openvdb::points::createPointDataGrid<openvdb::points::NullCodec, openvdb::points::PointDataGrid>(
      std::vector<openvdb::Vec3R>{{0, 0, 0}, {1, 1, 1}}, *openvdb::math::Transform::createLinearTransform());
  points->setName("particles");
  EXPECT_HAS(refusal(write({points})), "contains points");
  EXPECT_HAS(refusal(write({})), "contains no grids");
  const auto frustum = fog("density");
  frustum->tree().setValue(Coord(0), 1.0F);
  frustum->setTransform(openvdb::math::Transform::createFrustumTransform(
      openvdb::BBoxd(openvdb::Vec3d(0), openvdb::Vec3d(10)), 0.5, 2.0));
  EXPECT_HAS(refusal(write({frustum})), "frustum");
  const auto far = fog("density");
  far->tree().setValue(Coord(-2000000000, 0, 0), 1.0F);
  far->tree().setValue(Coord(2000000000, 0, 0), 1.0F);
  EXPECT_HAS(refusal(write({far})), "span 4000000001 x 1 x 1 voxels");
}

TEST_F(VolumeImport, SelectsTheGrid) {
  const auto make = [](const std::string& name, float value) {
    const auto grid = fog(name);
    grid->tree().setValue(Coord(0), value);
    return grid;
  };
  const auto heat = make("heat", 1.0F);
  const auto smoke = make("smoke", 2.0F);
  const auto density = make("density", 3.0F);
  const auto vec = openvdb::Vec3SGrid::create();
  vec->setName("vel");

  EXPECT_EQ(import_volume(write({heat, density, smoke}), "", {}).max_value, 3.0F);
  EXPECT_EQ(import_volume(write({heat, density, smoke}), "smoke", {}).max_value, 2.0F);
  EXPECT_EQ(import_volume(write({vec, heat}), "", {}).name, "heat");

  // Without a density, the documented order decides, independent of the file's order. A warning names the other grids.
  const auto expect_shown = [&](const openvdb::GridPtrVec& grids, const std::string& name, const std::string& warning) {
    Messages messages;
    const auto file = write(grids);
    EXPECT_EQ(import_volume(file, "", messages.log).name, name);
    if (warning.empty()) {
      EXPECT_TRUE(messages.warnings.empty()) << messages.warnings[0];
      return;
    }
    ASSERT_EQ(messages.warnings.size(), 1U);
    EXPECT_EQ(messages.warnings[0], file.string() + ": " + warning);
  };
  expect_shown({heat, vec}, "heat", "");
  expect_shown({heat, density, smoke}, "density", "");
  expect_shown({heat, vec, smoke}, "smoke",
               "uses the grid \"smoke\" (float, fog volume); it also has \"heat\" (float, fog volume)");
  const auto flames = make("Flames", 5.0F);
  const auto temperature = make("temperature", 6.0F);
  const auto dust = make("dust", 7.0F);
  expect_shown({dust, temperature, flames}, "Flames",
               "uses the grid \"Flames\" (float, fog volume); it also has \"dust\" (float, fog volume), "
               "\"temperature\" (float, fog volume)");
  expect_shown({dust, make("pollen", 8.0F)}, "dust",
               "uses the grid \"dust\" (float, fog volume); it also has \"pollen\" (float, fog volume)");
  expect_shown({dust, make("Density", 9.0F)}, "Density", "");
  const std::string unknown = refusal(write({heat, vec}), "dust");
  EXPECT_HAS(unknown, "has no grid \"dust\"");
  EXPECT_HAS(unknown, "\"heat\" (float, fog volume), \"vel\" (vec3s, unknown)");
  EXPECT_HAS(refusal(write({heat, vec}), "vel"), "has type vec3s");

  const auto second = make("density", 4.0F);
  expect_shown({density, second}, "density",
               "uses the grid \"density[0]\" (float, fog volume); it also has \"density[1]\" (float, fog volume)");
  EXPECT_HAS(refusal(write({density, second}), "density"), "density[1]");
  EXPECT_EQ(import_volume(write({density, second}), "density[1]", {}).max_value, 4.0F);
  EXPECT_EQ(import_volume(write({density, second}), "density[0]", {}).max_value, 3.0F);
}

TEST_F(VolumeImport, RejectsInvalidPathsAndContents) {
  EXPECT_HAS(refusal(path("none.vdb")), "no such file");
  EXPECT_HAS(refusal(folder_.path()), "is a directory");
  EXPECT_HAS(refusal(write_bytes("", "empty.vdb")), "is empty");
  EXPECT_HAS(refusal(write_bytes("abc", "short.vdb")), "too short");
  EXPECT_HAS(refusal(write_bytes("this is a text file, not a volume\n", "text.vdb")), "not a VDB");
  EXPECT_HAS(refusal("/dev/null"), "not a regular file");
  EXPECT_THROW((void)list_grids(path("none.vdb")), cumulet::Error);
  // The content decides, not the extension.
  const auto grid = rich(0.0F);
  fs::rename(write({grid}), path("wrong.nvdb"));
  expect_same(*grid, import_volume(path("wrong.nvdb"), "", {}));
  std::string newer = bytes_of(path("wrong.nvdb"));
  newer[8] = '\x7f';
  EXPECT_HAS(refusal(write_bytes(newer, "newer.vdb")), "format 127 is not supported");
}

// 22M active voxels. The time is relative to OpenVDB reading the same file, because a ratio holds on busy machines too.
TEST_F(VolumeImport, LargeGridsImportInTime) {
  const auto grid = fog("density");
  grid->tree().denseFill(CoordBBox(Coord(-140), Coord(139)), 1.0F, true);
  float value = 0.0F;
  for (auto leaf = grid->tree().beginLeaf(); leaf; ++leaf) {
    for (auto it = leaf->beginValueOn(); it; ++it) it.setValue(value = std::fmod(value + 0.37F, 3.0F));
  }
  const auto file = write({grid}, "large.vdb");
  const auto seconds = [](auto&& work) {
    const auto start = std::chrono::steady_clock::now();
    work();
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  };
  double ours = 1e9;
  double theirs = 1e9;
  ScalarVolume volume;
  for (int i = 0; i < 3; ++i) {
    ours = std::min(ours, seconds([&] { volume = import_volume(file, "", {}); }));
    theirs = std::min(theirs, seconds([&] { EXPECT_NE(reference(file, "density"), nullptr); }));
  }
  RecordProperty("import_milliseconds", static_cast<int>(ours * 1000));
  RecordProperty("openvdb_read_milliseconds", static_cast<int>(theirs * 1000));
  EXPECT_EQ(volume.active_voxels, 21952000U);
#if !defined(__SANITIZE_ADDRESS__)
  EXPECT_LT(ours, 8 * theirs);  // about 2.5
#endif
}

// --- inspection of files ---

TEST_F(VolumeImport, InspectionReportsGridsValuesAndMetadata) {
  using cumulet::volume::Inspection;
  const auto density = fog("density");
  density->setTransform(openvdb::math::Transform::createLinearTransform(0.5));
  density->tree().setValue(Coord(-1, 2, 3), 0.0F);
  density->tree().setValue(Coord(4, 5, 6), 4.0F);
  density->tree().setValue(Coord(4, 5, 7), -4.0F);
  density->tree().setValue(Coord(4, 5, 8), std::numeric_limits<float>::quiet_NaN());
  density->tree().addTile(1, Coord(64, 0, 0), 2.0F, true);
  density->tree().addTile(1, Coord(128, 0, 0), 3.0F, false);
  density->insertMeta("odd \"name\"\n", openvdb::StringMetadata("v\xff"));
  const auto vec = openvdb::Vec3SGrid::create();
  vec->setName("vel");
  vec->tree().setValue(Coord(0), openvdb::Vec3s(3, 0, 4));
  const auto flag = openvdb::BoolGrid::create();
  flag->setName("mask");
  flag->tree().setValue(Coord(0), true);
  const auto file = path("test.vdb");
  openvdb::MetaMap of_file;
  of_file.insertMeta("creator", openvdb::StringMetadata("Blender/OpenVDBWriter"));
  openvdb::io::File(file.string()).write({vec, density, flag}, of_file);

  Inspection inspection(file);
  EXPECT_HAS(inspection.format(), "OpenVDB 22");
  EXPECT_EQ(inspection.bytes(), fs::file_size(file));
  EXPECT_EQ(inspection.chosen(), 1U);
  ASSERT_EQ(inspection.metadata().size(), 1U);
  EXPECT_EQ(inspection.metadata()[0].name, "creator");
  EXPECT_EQ(inspection.metadata()[0].value, "Blender/OpenVDBWriter");
  ASSERT_EQ(inspection.grids().size(), 3U);
  const auto& metadata = inspection.grids()[1].metadata;
  const auto odd = std::ranges::find(metadata, "odd \"name\"\n", &cumulet::volume::Metadata::name);
  ASSERT_NE(odd, metadata.end());
  EXPECT_EQ(odd->value, "v\xff");

  const auto& statistics = inspection.statistics(1);
  EXPECT_EQ(statistics.refusal, "");
  ASSERT_TRUE(statistics.values);
  const cumulet::volume::GridValues& values = *statistics.values;
  EXPECT_EQ(values.active_voxels, 516U);
  EXPECT_EQ(values.bounds_min, glm::ivec3(-1, 0, 0));
  EXPECT_EQ(values.bounds_max, glm::ivec3(71, 7, 8));
  EXPECT_EQ(values.index_to_world[0][0], 0.5);
  EXPECT_EQ(values.min, -4.0F);
  EXPECT_EQ(values.max, 4.0F);
  EXPECT_NEAR(values.mean, 1024.0 / 515.0, 1e-9);
  EXPECT_EQ(values.negative_voxels, 1U);
  EXPECT_EQ(values.non_finite_voxels, 1U);
  std::array<std::uint64_t, cumulet::volume::histogram_bins> histogram{};
  histogram[0] = 1;
  histogram[32] = 1;
  histogram[48] = 512;
  histogram[63] = 1;
  EXPECT_EQ(values.histogram, histogram);
  // The estimated memory is close to the actual memory.
  const auto volume = import_volume(file, "density", {});
  EXPECT_GE(values.memory_bytes, volume.brick_values.size() * sizeof(float));

  ASSERT_TRUE(inspection.statistics(0).values);
  EXPECT_EQ(inspection.statistics(0).values->max, 5.0F) << "a vector's length";
  EXPECT_HAS(inspection.statistics(0).refusal, "has type vec3s");
  EXPECT_FALSE(inspection.statistics(2).values);

  // Errors in damaged voxels name the grid, and the other grids can still be read.
  std::string bytes = bytes_of(file);
  EXPECT_THROW(Inspection(path("none.vdb")), cumulet::Error);
  const auto cut = write_bytes(bytes.substr(0, bytes.size() - 40), "cut.vdb");
  EXPECT_THROW((void)Inspection(cut), cumulet::Error);
  const auto nano = path("test.nvdb");
  nanovdb::io::writeGrid(nano.string(), nanovdb::openToNanoVDB(*density), nanovdb::io::Codec::ZIP);
  Inspection of_nano(nano);
  EXPECT_HAS(of_nano.format(), "NanoVDB 3");
  ASSERT_TRUE(of_nano.statistics(0).values);
  EXPECT_EQ(of_nano.statistics(0).values->histogram, histogram);
  bytes = bytes_of(nano);
  for (std::size_t i = bytes.size() - 60; i < bytes.size(); ++i) bytes[i] = '\x5a';
  Inspection damaged(write_bytes(bytes, "damaged.nvdb"));
  EXPECT_FALSE(damaged.statistics(0).values);
  EXPECT_HAS(damaged.statistics(0).refusal, "damaged");
}

// --- the assets under CUMULET_SHARED_DATA, if present ---

fs::path asset(const std::string& name) { return fs::path(CUMULET_SHARED_DATA) / "vdb" / name; }

class VolumeAssets : public VolumeImport {
 protected:
  void SetUp() override {
    VolumeImport::SetUp();
    if (!fs::exists(fs::path(CUMULET_SHARED_DATA) / "vdb")) GTEST_SKIP() << "no " CUMULET_SHARED_DATA "/vdb";
  }
};

TEST_F(VolumeAssets, DisneyCloud) {
  for (const char* name : {"wdas/wdas_cloud_sixteenth.vdb", "wdas/wdas_cloud_sixteenth_filled_a.vdb"}) {
    const auto grids = list_grids(asset(name));
    ASSERT_FALSE(grids.empty());
    const auto volume = import_volume(asset(name), "", {});
    expect_same(*reference(asset(name), volume.name), volume);
  }
  const auto cloud = import_volume(asset("wdas/wdas_cloud_sixteenth.vdb"), "", {});
  EXPECT_EQ(cloud.name, "density");
  EXPECT_NEAR(static_cast<double>(cloud.active_voxels), 416e3, 1e3);
  EXPECT_EQ(cloud.bounds_max - cloud.bounds_min + 1, glm::ivec3(126, 86, 154));
}

TEST_F(VolumeAssets, EmberGenFire) {
  const auto file = asset("embergen_fire_a/embergen_fire_a_0050.vdb");
  Messages messages;
  EXPECT_EQ(import_volume(file, "", messages.log).name, "flames");
  ASSERT_EQ(messages.warnings.size(), 1U);
  EXPECT_HAS(messages.warnings[0], "\"temperature\" (half, unknown)");
  for (const char* name : {"flames", "temperature"}) {
    expect_same(*reference(file, name), import_volume(file, name, {}));
    EXPECT_TRUE(import_volume(asset("embergen_fire_a/embergen_fire_a_0000.vdb"), name, {}).empty());
  }
}

TEST_F(VolumeAssets, Sergeneren) {
  for (const char* name : {"box.vdb", "dragon.vdb", "dragon_with_xform.vdb"}) {
    const auto file = asset(std::string("sergeneren/") + name);
    const auto volume = import_volume(file, "", {});
    expect_same(*reference(file, volume.name), volume);
  }
}

TEST_F(VolumeAssets, ZenoFilesHaveNoFogGrid) {
  EXPECT_HAS(refusal(asset("zeno/res.vdb")), "level set");
  EXPECT_HAS(refusal(asset("zeno/sphere.vdb")), "level set");
  EXPECT_HAS(refusal(asset("zeno/vel_VDB_bound_v02.vdb")), "has type vec3s");
}

}  // namespace
