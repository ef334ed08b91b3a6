// Volumes of the C API from files and from grids of the host's own OpenVDB.

#include <cumulet/cumulet.h>
#include <gtest/gtest.h>
#include <openvdb/tools/LevelSetSphere.h>
#include <cumulet/cumulet_openvdb.hpp>

#include <cmath>
#include <random>
#include <stdexcept>

#include "support/c_volumes.hpp"
#include "support/folder.hpp"
#include "support/openvdb.hpp"
#include "support/volumes.hpp"

namespace {

using cumulet::test::expect_identical;
using cumulet::test::inside;
using cumulet::test::made;
using cumulet::test::refused;
using cumulet::test::value_at;
using cumulet::test::Volume;
using cumulet::volume::ScalarVolume;
using openvdb::Coord;

class OpenVdbVolume : public ::testing::Test {
 protected:
  void SetUp() override { openvdb::initialize(); }
  std::string write(const openvdb::GridCPtrVec& grids) const {
    const std::string file = (folder_ / "test.vdb").string();
    openvdb::io::File(file).write(grids);
    return file;
  }
  static Volume open(const std::string& file, const char* grid = nullptr) {
    return made([&](auto... arguments) { return cumulet_volume_open(file.c_str(), grid, arguments...); });
  }
  static Volume copy(const openvdb::GridBase::ConstPtr& grid) {
    return made([&](auto... arguments) { return cumulet::volume_from_openvdb(grid, arguments...); });
  }
  static std::string refusal(const openvdb::GridBase::ConstPtr& grid, cumulet_status status = CUMULET_ERROR_FILE) {
    return refused(status, [&](auto... arguments) { return cumulet::volume_from_openvdb(grid, arguments...); });
  }

  template <class GridT = openvdb::FloatGrid>
  static typename GridT::Ptr rich(float background) {
    using ValueT = typename GridT::ValueType;
    auto grid = GridT::create(ValueT(background));
    grid->setName("density");
    auto& tree = grid->tree();
    std::mt19937 random(3);
    for (int i = 0; i < 3000; ++i) {
      const Coord c(static_cast<int>(random() % 60) - 23, static_cast<int>(random() % 50) - 19,
                    static_cast<int>(random() % 40) + 5);
      tree.setValue(c, ValueT(static_cast<float>(random() % 64) / 32.0F));
      if (i % 4 == 0) tree.setValueOff(c.offsetBy(1, 0, 0), ValueT(static_cast<float>(random() % 64) / 32.0F));
    }
    tree.addTile(1, Coord(64, 0, 0), ValueT(0.75F), true);
    tree.addTile(1, Coord(64, 8, 0), ValueT(0.5F), false);
    tree.addTile(1, Coord(64, 16, 0), ValueT(background), true);
    tree.addTile(2, Coord(128, 0, 0), ValueT(1.25F), true);
    tree.addTile(2, Coord(0, 128, 0), ValueT(0.375F), false);
    tree.addTile(3, Coord(4096, 0, 0), ValueT(0.25F), true);
    tree.setValueOff(Coord(-200, 0, 0), ValueT(9.0F));
    tree.setValue(Coord(-30, -130, 7), ValueT(-0.25F));
    openvdb::Mat4d m = openvdb::Mat4d::identity();
    m.preScale(openvdb::Vec3d(0.5, 2.0, 1e-3));
    m.postRotate(openvdb::math::Y_AXIS, 0.7);
    m.postTranslate(openvdb::Vec3d(10, -20, 30));
    grid->setTransform(openvdb::math::Transform::createLinearTransform(m));
    return grid;
  }

  cumulet::test::Folder folder_;
};

TEST_F(OpenVdbVolume, MatchesTheFileImport) {
  for (const float background : {0.0F, 0.125F}) {
    const auto grid = rich(background);
    const Volume file = open(write({grid}));
    const Volume memory = copy(grid);
    EXPECT_GT(inside(memory).brick_origins.size(), 20U);
    EXPECT_GE(inside(memory).tiles.size(), 4U);
    expect_identical(inside(memory), inside(file));
  }
  const auto wide = rich<openvdb::DoubleGrid>(0.0F);
  expect_identical(inside(copy(wide)), inside(open(write({wide}))));
  // Values that are exact halves: stored as half in the file, or half in memory.
  const auto narrow = rich(0.0F);
  narrow->setSaveFloatAsHalf(true);
  const Volume file = open(write({narrow}));
  expect_identical(inside(copy(narrow)), inside(file));
  using HalfGrid = openvdb::Grid<openvdb::tree::Tree4<openvdb::math::half, 5, 4, 3>::Type>;
  expect_identical(inside(copy(rich<HalfGrid>(0.0F))), inside(file));
}

TEST_F(OpenVdbVolume, ReadsDelayLoadedLeaves) {
  const auto grid = rich(0.125F);
  const std::string file = write({grid});
  openvdb::io::File lazy(file);
  lazy.setCopyMaxBytes(0);
  lazy.open(true);
  const auto delayed = openvdb::gridPtrCast<openvdb::FloatGrid>(lazy.readGrid("density"));
  ASSERT_TRUE(delayed->tree().cbeginLeaf()->buffer().isOutOfCore());
  expect_identical(inside(copy(delayed)), inside(open(file)));
}

TEST_F(OpenVdbVolume, RejectsTheSameGridsAsFiles) {
  EXPECT_HAS(refusal(nullptr, CUMULET_ERROR_INVALID_ARGUMENT), "grid is NULL");
  const auto sphere = openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(5.0F, openvdb::Vec3f(0), 1.0F);
  sphere->setName("surface");
  EXPECT_EQ(refusal(sphere), "surface: is a level set, not a fog volume");
  const auto vec = openvdb::Vec3SGrid::create();
  vec->setName("vel\nocity");
  vec->tree().setValue(Coord(0), openvdb::Vec3s(1));
  EXPECT_EQ(refusal(vec), "vel ocity: has type vec3s, not a float or half scalar");
  const auto number = openvdb::Int32Grid::create();
  number->tree().setValue(Coord(0), 1);
  EXPECT_EQ(refusal(number), "openvdb: has type int32, not a float or half scalar");
  const auto frustum = openvdb::FloatGrid::create();
  frustum->tree().setValue(Coord(0), 1.0F);
  frustum->setTransform(openvdb::math::Transform::createFrustumTransform(
      openvdb::BBoxd(openvdb::Vec3d(0), openvdb::Vec3d(10)), 0.5, 2.0));
  EXPECT_HAS(refusal(frustum), "frustum");
  EXPECT_TRUE(inside(copy(openvdb::FloatGrid::create())).empty());
  const auto bad = openvdb::FloatGrid::create();
  bad->tree().setValue(Coord(1, 2, 3), NAN);
  EXPECT_EQ(inside(copy(bad)).non_finite_voxels, 1U);
  EXPECT_EQ(cumulet::volume_from_openvdb(rich(0.0F), nullptr), CUMULET_ERROR_INVALID_ARGUMENT);
}

TEST_F(OpenVdbVolume, FilesUseTheHostsTransform) {
  const auto grid = rich(0.0F);
  const std::string file = write({grid});
  cumulet_volume_file_desc desc{};
  desc.struct_size = sizeof desc;
  desc.path = file.c_str();
  const auto call = [&](cumulet_volume** out, char* error, size_t size) {
    return cumulet_volume_open_file(&desc, out, error, size);
  };
  expect_identical(inside(made(call)), inside(open(file)));
  // Z up to Y up: (x, y, z) to (x, z, -y).
  const double upright[16] = {1, 0, 0, 0, 0, 0, -1, 0, 0, 1, 0, 0, 0, 0, 0, 1};
  std::ranges::copy(upright, desc.to_world);
  const Volume turned = made(call);
  const glm::dmat4 before = inside(open(file)).index_to_world;
  const glm::dmat4& after = inside(turned).index_to_world;
  for (int column = 0; column < 4; ++column)
    EXPECT_EQ(after[column], glm::dvec4(before[column].x, before[column].z, -before[column].y, before[column].w));
  desc.to_world[3] = 0.5;
  EXPECT_HAS(refused(CUMULET_ERROR_INVALID_ARGUMENT, call), "not affine");
  desc.to_world[3] = NAN;
  EXPECT_HAS(refused(CUMULET_ERROR_INVALID_ARGUMENT, call), "not finite");
  std::fill_n(desc.to_world, 15, 0.0);
  desc.to_world[15] = 1.0;
  EXPECT_HAS(refused(CUMULET_ERROR_INVALID_ARGUMENT, call), "is singular");
}

TEST_F(OpenVdbVolume, CanBeInspected) {
  const auto grid = rich(0.0F);
  grid->insertMeta("author", openvdb::StringMetadata("me"));
  const auto sphere = openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(5.0F, openvdb::Vec3f(0), 1.0F);
  sphere->setName("surface");
  const std::string file = write({sphere, grid});
  cumulet_inspection* inspection = nullptr;
  char error[256] = "x";
  ASSERT_EQ(cumulet_inspect_volume_file(file.c_str(), &inspection, error, sizeof error), CUMULET_OK) << error;
  cumulet_volume_file_info info{};
  info.struct_size = sizeof info;
  ASSERT_EQ(cumulet_inspection_get_file(inspection, &info), CUMULET_OK);
  EXPECT_EQ(info.grid_count, 2U);
  EXPECT_EQ(info.default_grid, 1);
  EXPECT_STREQ(info.format, "OpenVDB 224");
  cumulet_grid_info found{};
  found.struct_size = sizeof found;
  ASSERT_EQ(cumulet_inspection_get_grid(inspection, 1, &found), CUMULET_OK);
  EXPECT_STREQ(found.name, "density");
  EXPECT_STREQ(found.type, "float");
  EXPECT_STREQ(found.unsupported_reason, "");
  EXPECT_EQ(found.values, CUMULET_GRID_VALUES_SCALARS);
  const Volume volume = open(file);
  EXPECT_EQ(found.active_voxels, inside(volume).active_voxels);
  EXPECT_EQ(found.max_value, inside(volume).max_value);
  std::uint64_t counted = 0;
  for (const std::uint64_t bin : found.histogram) counted += bin;
  EXPECT_EQ(counted, found.active_voxels);
  cumulet_volume_info shown{};
  shown.struct_size = sizeof shown;
  ASSERT_EQ(cumulet_volume_get_info(volume.get(), &shown), CUMULET_OK);
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_EQ(found.bounds_min[axis], shown.bounds_min[axis]);
    EXPECT_EQ(found.bounds_max[axis], shown.bounds_max[axis]);
  }
  bool author = false;
  cumulet_metadata entry{};
  entry.struct_size = sizeof entry;
  for (std::uint32_t i = 0; i < found.metadata_count; ++i) {
    ASSERT_EQ(cumulet_inspection_get_metadata(inspection, 1, i, &entry), CUMULET_OK);
    author = author || (std::string(entry.name) == "author" && std::string(entry.value) == "me");
  }
  EXPECT_TRUE(author);
  ASSERT_EQ(cumulet_inspection_get_grid(inspection, 0, &found), CUMULET_OK);
  EXPECT_STREQ(found.unsupported_reason, "is a level set, not a fog volume");
  EXPECT_EQ(cumulet_inspection_get_grid(inspection, 2, &found), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(cumulet_inspection_get_grid(inspection, 0, nullptr), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(cumulet_inspection_get_metadata(inspection, 1, 1000, &entry), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(cumulet_inspection_get_metadata(inspection, 2, 0, &entry), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(cumulet_inspection_get_metadata(inspection, -2, 0, &entry), CUMULET_ERROR_INVALID_ARGUMENT);
  cumulet_inspection_release(inspection);
  cumulet_inspection_release(nullptr);
  EXPECT_EQ(cumulet_inspect_volume_file("/nowhere/x.vdb", &inspection, error, sizeof error), CUMULET_ERROR_FILE);
  EXPECT_EQ(inspection, nullptr);
  EXPECT_STREQ(error, "/nowhere/x.vdb: no such file");
  EXPECT_EQ(cumulet_inspect_volume_file(nullptr, &inspection, error, sizeof error), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(cumulet_inspection_get_file(nullptr, &info), CUMULET_ERROR_INVALID_ARGUMENT);
}

TEST_F(OpenVdbVolume, FilesOpenAndFail) {
  const auto grid = rich(0.0F);
  const auto other = openvdb::FloatGrid::create();
  other->setName("density");
  other->tree().setValue(Coord(3), 8.0F);
  const std::string file = write({grid, other});
  EXPECT_EQ(inside(open(file, "density[1]")).max_value, 8.0F);
  const auto opening = [](const char* path, const char* name) {
    return [=](auto... arguments) { return cumulet_volume_open(path, name, arguments...); };
  };
  const std::string several = refused(CUMULET_ERROR_FILE, opening(file.c_str(), "density"));
  EXPECT_EQ(several.rfind(file + ": ", 0), 0U) << several;
  EXPECT_HAS(refused(CUMULET_ERROR_FILE, opening(file.c_str(), "dust")), "has no grid \"dust\"");
  EXPECT_HAS(refused(CUMULET_ERROR_FILE, opening("/nowhere/x.vdb", nullptr)), "/nowhere/x.vdb: no such file");
  EXPECT_HAS(refused(CUMULET_ERROR_INVALID_ARGUMENT, opening(nullptr, nullptr)), "path is NULL");
  EXPECT_EQ(cumulet_volume_open(file.c_str(), "density[1]", nullptr, nullptr, 0), CUMULET_ERROR_INVALID_ARGUMENT);
  // A control cube cannot hold it; the message still names the file.
  other->tree().setValue(Coord(500000, 0, 0), 1.0F);
  const std::string wide = write({other});
  const std::string line = refused(CUMULET_ERROR_UNSUPPORTED, opening(wide.c_str(), nullptr));
  EXPECT_EQ(line.rfind(wide + ": ", 0), 0U) << line;
  // A message longer than its buffer is truncated and terminated.
  std::array<char, 12> buffer{};
  buffer.fill('x');
  cumulet_volume* volume = nullptr;
  EXPECT_EQ(cumulet_volume_open("/nowhere/x.vdb", nullptr, &volume, buffer.data(), buffer.size()), CUMULET_ERROR_FILE);
  EXPECT_STREQ(buffer.data(), "/nowhere/x.");
}

TEST_F(OpenVdbVolume, ListsGrids) {
  const auto grid = rich(0.0F);
  const auto sphere = openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(5.0F, openvdb::Vec3f(0), 1.0F);
  sphere->setName("surface");
  const std::string file = write({grid, sphere, grid->deepCopy()});
  std::vector<std::array<std::string, 3>> listed;
  const auto list = [](void* user, const char* name, const char* type, const char* refusal) {
    static_cast<decltype(listed)*>(user)->push_back({name, type, refusal});
  };
  char error[256] = "x";
  ASSERT_EQ(cumulet_list_grids(file.c_str(), list, &listed, error, sizeof error), CUMULET_OK) << error;
  EXPECT_STREQ(error, "");
  ASSERT_EQ(listed.size(), 3U);
  EXPECT_EQ(listed[0], (std::array<std::string, 3>{"density[0]", "float", ""}));
  EXPECT_EQ(listed[1], (std::array<std::string, 3>{"surface", "float", "is a level set, not a fog volume"}));
  EXPECT_EQ(listed[2][0], "density[1]");
  // Every listed name can be opened.
  expect_identical(inside(open(file, "density[0]")), inside(open(file, "density[1]")));

  EXPECT_EQ(cumulet_list_grids("/nowhere/x.vdb", list, &listed, error, sizeof error), CUMULET_ERROR_FILE);
  EXPECT_STREQ(error, "/nowhere/x.vdb: no such file");
  EXPECT_EQ(cumulet_list_grids(nullptr, list, &listed, error, sizeof error), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(cumulet_list_grids(file.c_str(), nullptr, nullptr, error, sizeof error), CUMULET_ERROR_INVALID_ARGUMENT);
  // An exception of a host's callback does not leave the call.
  const auto throwing = [](void*, const char*, const char*, const char*) { throw std::runtime_error("host's own"); };
  EXPECT_EQ(cumulet_list_grids(file.c_str(), throwing, nullptr, error, sizeof error), CUMULET_ERROR_INTERNAL);
  // A callback may not open files, and gets NULL instead.
  const auto nested = [](void* user, const char*, const char*, const char*) {
    auto* inspection = static_cast<cumulet_inspection*>(user);
    EXPECT_EQ(cumulet_inspect_volume_file("/nowhere/x.vdb", &inspection, nullptr, 0), CUMULET_ERROR_INVALID_ARGUMENT);
    EXPECT_EQ(inspection, nullptr);
  };
  EXPECT_EQ(cumulet_list_grids(file.c_str(), nested, &listed, error, sizeof error), CUMULET_OK);
}

// Grids of a host's own OpenVDB as a state of a dynamic volume. The density equals that of a volume made from it.
TEST(LiveOpenVdb, LiveStateMatchesTheVolume) {
  const auto density = openvdb::FloatGrid::create();
  const auto heat = openvdb::DoubleGrid::create();
  for (int i = 0; i < 600; ++i) {
    density->tree().setValue(Coord(i % 13, i / 13 % 17, i / 200), 0.1F + 0.01F * static_cast<float>(i));
    heat->tree().setValue(Coord(i % 11, i / 11 % 15, i / 170), 1.0 + 0.002 * i);
  }
  density->fill(openvdb::CoordBBox(Coord(32), Coord(47)), 0.5F);
  density->setName("smoke");
  const auto desc = cumulet_dynamic_volume_desc{
      .struct_size = sizeof(cumulet_dynamic_volume_desc), .bounds_min = {}, .bounds_max = {}, .gpu_resident = 0};
  cumulet_dynamic_volume* live = nullptr;
  ASSERT_EQ(cumulet_dynamic_volume_create(&desc, &live, nullptr, 0), CUMULET_OK);
  const std::unique_ptr<cumulet_dynamic_volume, decltype(&cumulet_dynamic_volume_release)> owner(
      live, cumulet_dynamic_volume_release);
  char error[256] = "";
  ASSERT_EQ(
      cumulet::dynamic_volume_set_openvdb(
          live, {{CUMULET_CHANNEL_TEMPERATURE, heat}, {CUMULET_CHANNEL_DENSITY, density}}, "fire", error, sizeof error),
      CUMULET_OK)
      << error;
  const Volume state = made([&](auto** out, char* line, std::size_t size) {
    return cumulet_dynamic_volume_get_volume(live, out, line, size);
  });
  const Volume alone = made(
      [&](auto** out, char* line, std::size_t size) { return cumulet::volume_from_openvdb(density, out, line, size); });
  ScalarVolume wanted = inside(alone);
  wanted.name = "density";
  cumulet::test::expect_same_voxels(inside(state), wanted);
  ASSERT_TRUE(state->asset->frame().temperature);
  EXPECT_EQ(value_at(*state->asset->frame().temperature, {3, 1, 0}), static_cast<float>(1.0 + 0.002 * 14));
  const auto level_set = openvdb::FloatGrid::create();
  level_set->setGridClass(openvdb::GRID_LEVEL_SET);
  level_set->setName("surface");
  EXPECT_EQ(
      cumulet::dynamic_volume_set_openvdb(live, {{CUMULET_CHANNEL_DENSITY, level_set}}, "fire", error, sizeof error),
      CUMULET_ERROR_FILE);
  EXPECT_STREQ(error, "fire: surface: is a level set, not a fog volume");
}

}  // namespace
