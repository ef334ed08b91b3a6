// The fields of one file, resampled to one lattice.

#define NANOVDB_USE_ZIP
#define NANOVDB_USE_BLOSC

#include "volume/frame_import.hpp"

#include <gtest/gtest.h>
#include <nanovdb/util/IO.h>
#include <nanovdb/util/OpenToNanoVDB.h>
#include <openvdb/io/Stream.h>

#include <fstream>

#include "support/frame_import.hpp"
#include "support/vdb_files.hpp"
#include "support/volumes.hpp"

namespace {

using cumulet::test::box;
using cumulet::test::fog;
using cumulet::test::Messages;
using cumulet::test::naming;
using cumulet::test::scaled;
using cumulet::test::two_voxels;
using cumulet::test::value_at;
using cumulet::test::VolumeFrameImport;
using cumulet::volume::GridNames;
using cumulet::volume::import_frame;
using cumulet::volume::import_volume;
using cumulet::volume::ScalarVolume;
using cumulet::volume::VolumeFrame;
using openvdb::Coord;
using openvdb::Vec3d;
namespace fs = std::filesystem;

TEST_F(VolumeFrameImport, FieldNamesAreCaseInsensitive) {
  struct Case {
    std::vector<std::string> grids;
    std::string density, temperature, flame;
  };
  const std::vector<Case> cases = {
      {{"density", "temperature", "flame"}, "density", "temperature", "flame"},
      {{"Fuel", "Heat", "Smoke"}, "Smoke", "Heat", "Fuel"},
      {{"fuel", "burn", "heat", "temperature", "soot"}, "soot", "temperature", "burn"},
      {{"flames", "temp"}, "", "temp", "flames"},
      {{"fire", "other"}, "", "", "fire"},
      {{"other", "another"}, "other", "", ""},
  };
  for (const Case& c : cases) {
    openvdb::GridPtrVec grids;
    for (const std::string& name : c.grids) grids.push_back(two_voxels(name, 1.0F));
    const VolumeFrame frame = import_frame(write(grids), {}, {});
    EXPECT_EQ(frame.density.name, c.density);
    EXPECT_EQ(frame.temperature ? frame.temperature->name : "", c.temperature);
    EXPECT_EQ(frame.flame ? frame.flame->name : "", c.flame);
    EXPECT_EQ(frame.density.empty(), c.density.empty());
    EXPECT_FALSE(frame.color);
  }
}

TEST_F(VolumeFrameImport, NamesSelectAndExcludeFields) {
  const auto file = write({two_voxels("density", 1.0F), two_voxels("temperature", 2.0F), two_voxels("flame", 3.0F),
                           two_voxels("shadow", 4.0F)});
  VolumeFrame frame = import_frame(
      file,
      naming({{&GridNames::density, "shadow"}, {&GridNames::temperature, "none"}, {&GridNames::flame, "temperature"}}),
      {});
  EXPECT_EQ(frame.density.max_value, 4.0F);
  EXPECT_FALSE(frame.temperature);
  ASSERT_TRUE(frame.flame);
  EXPECT_EQ(frame.flame->max_value, 2.0F);

  frame = import_frame(file, naming({{&GridNames::density, "none"}}), {});
  EXPECT_TRUE(frame.density.empty());
  EXPECT_TRUE(frame.temperature && frame.flame);

  // A grid named for one field is not used for another.
  frame = import_frame(file, naming({{&GridNames::flame, "temperature"}}), {});
  EXPECT_FALSE(frame.temperature);

  // Without fire, the choice is that of import_volume.
  const auto fire = write({two_voxels("temperature", 2.0F), two_voxels("flames", 3.0F)});
  frame = import_frame(fire, naming({{&GridNames::temperature, "none"}, {&GridNames::flame, "none"}}), {});
  EXPECT_EQ(frame.density.name, "flames");
  EXPECT_FALSE(frame.temperature || frame.flame);
}

TEST_F(VolumeFrameImport, MissingRequestedFieldIsNamed) {
  const auto file = write({two_voxels("density", 1.0F), two_voxels("temperature", 2.0F)});
  for (const GridNames& names : {naming({{&GridNames::density, "nope"}}), naming({{&GridNames::temperature, "nope"}}),
                                 naming({{&GridNames::flame, "nope"}}), naming({{&GridNames::color, "nope"}})}) {
    const std::string what = refusal(file, names);
    EXPECT_HAS(what, "\"nope\"");
    EXPECT_HAS(what, "\"density\" (float, fog volume), \"temperature\" (float, fog volume)");
  }
  EXPECT_HAS(refusal(file, naming({{&GridNames::density, "none"}, {&GridNames::temperature, "none"}})),
             "all fields are excluded; the file has \"density\"");
  auto level_set = two_voxels("temperature", 1.0F);
  level_set->setGridClass(openvdb::GRID_LEVEL_SET);
  EXPECT_HAS(refusal(write({level_set}), naming({{&GridNames::temperature, "temperature"}})), "is a level set");
}

TEST_F(VolumeFrameImport, ColorFromThreeGrids) {
  const auto file = write({two_voxels("density", 1.0F), two_voxels("color_r", 0.25F), two_voxels("color_g", 0.5F),
                           two_voxels("color_b", 0.75F), two_voxels("x_r", 1.0F)});
  const VolumeFrame frame = import_frame(file, naming({{&GridNames::color, "color"}}), {});
  ASSERT_TRUE(frame.color);
  EXPECT_EQ((*frame.color)[0].max_value, 0.25F);
  EXPECT_EQ((*frame.color)[1].max_value, 0.5F);
  EXPECT_EQ((*frame.color)[2].max_value, 0.75F);
  Messages messages;
  EXPECT_FALSE(import_frame(file, {}, messages.log).color);
  ASSERT_EQ(messages.hints.size(), 1U);
  EXPECT_HAS(messages.hints[0], "color can be read from \"color_r\"");
  EXPECT_HAS(refusal(file, naming({{&GridNames::color, "x"}})), "\"x_g\"");
}

openvdb::Vec3SGrid::Ptr colors(const std::string& name) {
  auto grid = openvdb::Vec3SGrid::create(openvdb::Vec3f(0.0F));
  grid->setName(name);
  for (int i = 0; i < 100; ++i) {
    const float value = static_cast<float>(i) / 128.0F;
    grid->tree().setValue(Coord(i % 11, i % 7, i % 5), openvdb::Vec3f(value, 1.0F - value, 0.25F));
  }
  grid->tree().addTile(1, Coord(16, 0, 0), openvdb::Vec3f(0.0F, 0.5F, 1.0F), true);
  return grid;
}

void expect_colors(const VolumeFrame& frame, const openvdb::Vec3SGrid& grid) {
  ASSERT_TRUE(frame.color);
  for (int axis = 0; axis < 3; ++axis) {
    const ScalarVolume& v = (*frame.color)[static_cast<std::size_t>(axis)];
    EXPECT_EQ(v.active_voxels, grid.activeVoxelCount());
    for (auto it = grid.cbeginValueOn(); it; ++it) {
      const Coord c = it.getCoord();
      ASSERT_EQ(value_at(v, glm::ivec3(c.x(), c.y(), c.z())), (*it)[axis]) << c;
    }
  }
}

TEST_F(VolumeFrameImport, ColorFromAVectorGrid) {
  for (const bool half : {false, true}) {
    const auto grid = colors("Cd");
    grid->setSaveFloatAsHalf(half);
    auto velocity = colors("color");
    velocity->setGridClass(openvdb::GRID_STAGGERED);
    const auto file = write({two_voxels("density", 1.0F), velocity, grid, two_voxels("Cd_r", 1.0F)});
    expect_colors(import_frame(file, {}, {}), *grid);
    expect_colors(import_frame(file, naming({{&GridNames::color, "Cd"}}), {}), *grid);
    EXPECT_FALSE(import_frame(file, naming({{&GridNames::color, "none"}}), {}).color);
    EXPECT_HAS(refusal(file, naming({{&GridNames::color, "color"}})), "grid \"color\" is staggered");
    EXPECT_HAS(refusal(file, naming({{&GridNames::color, "density"}})), "has type float, not vec3s");
  }
}

// Velocities are listed as such in every form, and are never used as density.
TEST_F(VolumeFrameImport, VelocityGridsAreRecognized) {
  const auto channels_of = [&](const openvdb::GridPtrVec& grids) {
    return cumulet::volume::channels_by_name(cumulet::volume::list_grids(write(grids)));
  };
  using Channels = std::vector<std::string>;
  for (const char* name : {"vel", "V", "velocity"})
    EXPECT_EQ(channels_of({colors(name), two_voxels("density", 1.0F)}), (Channels{"velocity", "density"})) << name;
  auto staggered = colors("motion");
  staggered->setGridClass(openvdb::GRID_STAGGERED);
  EXPECT_EQ(channels_of({staggered, colors("Cd"), two_voxels("soot", 1.0F)}),
            (Channels{"velocity", "color", "density"}));
  for (const std::string name : {"vel", "vel.", "v_", "Velocity_"}) {
    const openvdb::GridPtrVec parts{two_voxels(name + "x", 3.0F), two_voxels(name + "y", 3.0F),
                                    two_voxels(name + "z", 3.0F)};
    openvdb::GridPtrVec grids = parts;
    grids.push_back(two_voxels("other", 1.0F));
    EXPECT_EQ(channels_of(grids), (Channels{"velocity", "velocity", "velocity", "density"})) << name;
    Messages messages;
    EXPECT_EQ(import_frame(write(grids), {}, messages.log).density.name, "other");
    EXPECT_TRUE(messages.warnings.empty()) << "there is nothing else to show";
    EXPECT_EQ(channels_of(parts), (Channels(3, "velocity")));
    EXPECT_HAS(refusal(write(parts), {}), "no scalar fog volume");
  }
  EXPECT_EQ(channels_of({two_voxels("v", 1.0F), two_voxels("velx", 1.0F)}), (Channels{"density", ""}))
      << "numbers, and one of three";
  EXPECT_EQ(channels_of({two_voxels("v_x", 1.0F), two_voxels("v_x", 1.0F), two_voxels("v_y", 1.0F)}),
            (Channels{"density", "", ""}))
      << "no z";
}

// A value stored in two volumes: its positive and its negative part.
float anisotropy_at(const VolumeFrame& frame, const glm::ivec3& p) {
  return value_at((*frame.anisotropy)[0], p) - value_at((*frame.anisotropy)[1], p);
}

TEST_F(VolumeFrameImport, AnisotropyIsReadWithItsSign) {
  const auto grid = fog("Anisotropy");
  for (int i = 0; i < 100; ++i) grid->tree().setValue(Coord(i % 11, i % 7, i % 5), static_cast<float>(i - 50) / 50.0F);
  grid->tree().addTile(1, Coord(16, 0, 0), -0.75F, true);
  const auto expect = [&](const VolumeFrame& frame) {
    ASSERT_TRUE(frame.anisotropy);
    for (auto it = grid->cbeginValueOn(); it; ++it) {
      const glm::ivec3 p(it.getCoord().x(), it.getCoord().y(), it.getCoord().z());
      ASSERT_EQ(anisotropy_at(frame, p), *it) << it.getCoord();
    }
    EXPECT_EQ(anisotropy_at(frame, glm::ivec3(-3)), 0.0F);
  };
  const auto density = two_voxels("density", 1.0F);
  for (const bool half : {false, true}) {
    grid->setSaveFloatAsHalf(half);
    Messages messages;
    if (half) grid->tree().voxelizeActiveTiles();
    for (auto it = grid->beginValueOn(); half && it; ++it) it.setValue(static_cast<float>(openvdb::math::half(*it)));
    const auto file = write({density, grid});
    expect(import_frame(file, {}, messages.log));
    EXPECT_TRUE(messages.warnings.empty());
    EXPECT_FALSE(import_frame(file, naming({{&GridNames::anisotropy, "none"}}), {}).anisotropy);
    EXPECT_HAS(refusal(file, naming({{&GridNames::anisotropy, "nope"}})), "\"nope\"");
    EXPECT_FALSE(import_frame(file, naming({{&GridNames::temperature, "Anisotropy"}}), {}).anisotropy);
  }
  const fs::path nano = folder_ / "frame.nvdb";
  std::vector<nanovdb::GridHandle<>> handles;
  handles.push_back(nanovdb::openToNanoVDB(*density));
  handles.push_back(nanovdb::openToNanoVDB(*grid));
  nanovdb::io::writeGrids<nanovdb::HostBuffer, std::vector>(nano.string(), handles);
  expect(import_frame(nano, {}, {}));
  for (const char* name : {"scatter_anisotropy", "phase_anisotropy", "phase_g"}) {
    grid->setName(name);
    EXPECT_TRUE(import_frame(write({density, grid}), {}, {}).anisotropy) << name;
  }
  // It is not used as density either, unless there is no other grid.
  const VolumeFrame cloud = import_frame(write({grid, two_voxels("cloud", 1.0F)}), {}, {});
  EXPECT_EQ(cloud.density.name, "cloud");
  EXPECT_TRUE(cloud.anisotropy);
  const VolumeFrame alone = import_frame(write({grid}), {}, {});
  EXPECT_EQ(alone.density.name, "phase_g");
  EXPECT_FALSE(alone.anisotropy);
}

TEST_F(VolumeFrameImport, AnisotropyBeyondOneIsClamped) {
  const auto grid = fog("anisotropy");
  grid->tree().setValue(Coord(0, 0, 0), 1.5F);
  grid->tree().setValue(Coord(0, 0, 1), -30.0F);
  grid->tree().setValue(Coord(0, 0, 2), std::numeric_limits<float>::quiet_NaN());
  grid->tree().setValue(Coord(0, 1, 2), std::numeric_limits<float>::infinity());
  grid->tree().setValue(Coord(0, 2, 2), -std::numeric_limits<float>::infinity());
  grid->tree().setValue(Coord(0, 0, 3), 0.5F);
  grid->tree().addTile(1, Coord(16, 0, 0), -2.0F, true);
  Messages messages;
  const VolumeFrame frame = import_frame(write({two_voxels("density", 1.0F), grid}), {}, messages.log);
  EXPECT_EQ(anisotropy_at(frame, {0, 0, 0}), 1.0F);
  EXPECT_EQ(anisotropy_at(frame, {0, 0, 1}), -1.0F);
  for (int y = 0; y < 3; ++y) EXPECT_EQ(anisotropy_at(frame, {0, y, 2}), 0.0F);
  EXPECT_EQ(anisotropy_at(frame, {0, 0, 3}), 0.5F);
  EXPECT_EQ(anisotropy_at(frame, {17, 1, 1}), -1.0F);
  EXPECT_EQ((*frame.anisotropy)[1].max_value, 1.0F);
  ASSERT_EQ(messages.warnings.size(), 2U);
  EXPECT_HAS(messages.warnings[0], "3 non-finite voxels read as 0");
  EXPECT_HAS(messages.warnings[1], "grid \"anisotropy\": 514 voxels clamped to the range from -1 to 1");
}

// Grids with another transform are resampled with their signs.
TEST_F(VolumeFrameImport, AnisotropyIsResampled) {
  const auto density = fog("density");
  density->fill({{0, 0, 0}, {15, 15, 15}}, 1.0F);
  const auto grid = fog("anisotropy");
  grid->fill({{0, 0, 0}, {3, 7, 7}}, -0.5F);
  grid->fill({{4, 0, 0}, {7, 7, 7}}, 0.5F);
  grid->setTransform(openvdb::math::Transform::createLinearTransform(2.0));
  const VolumeFrame frame = import_frame(write({density, grid}), {}, {});
  EXPECT_NEAR(anisotropy_at(frame, {4, 8, 8}), -0.5F, 1e-6F);
  EXPECT_NEAR(anisotropy_at(frame, {10, 8, 8}), 0.5F, 1e-6F);
  EXPECT_NEAR(anisotropy_at(frame, {7, 8, 8}), 0.0F, 1e-6F) << "half way between";
}

TEST_F(VolumeFrameImport, BlackAndEmptyColors) {
  auto black = colors("Cd");
  black->tree().clear();
  black->tree().setValue(Coord(1, 2, 3), openvdb::Vec3f(0.0F));
  VolumeFrame frame = import_frame(write({two_voxels("density", 1.0F), black}), {}, {});
  ASSERT_TRUE(frame.color);
  EXPECT_EQ((*frame.color)[1].max_value, 0.0F);
  black->tree().clear();
  Messages messages;
  frame = import_frame(write({two_voxels("density", 1.0F), black}), {}, messages.log);
  ASSERT_TRUE(frame.color);
  EXPECT_TRUE((*frame.color)[2].empty());
  EXPECT_EQ(messages.warnings.size(), 1U);
}

TEST_F(VolumeFrameImport, NanoVdbHasTheSameFields) {
  const auto density = two_voxels("density", 1.0F);
  const auto heat = two_voxels("heat", 2.5F);
  const auto flame = two_voxels("Flame", 0.5F);
  const auto color = colors("Cd");
  const VolumeFrame truth = import_frame(write({density, heat, flame, color}), {}, {});
  for (const auto codec : {nanovdb::io::Codec::NONE, nanovdb::io::Codec::ZIP, nanovdb::io::Codec::BLOSC}) {
    std::vector<nanovdb::GridHandle<>> handles;
    for (const auto& grid : {density, heat, flame}) handles.push_back(nanovdb::openToNanoVDB(*grid));
    handles.push_back(nanovdb::openToNanoVDB(*color));
    const auto file = folder_ / "frame.nvdb";
    nanovdb::io::writeGrids(file.string(), handles, codec);
    const VolumeFrame frame = import_frame(file, {}, {});
    cumulet::test::expect_same_voxels(frame.density, truth.density);
    ASSERT_TRUE(frame.temperature && frame.flame);
    cumulet::test::expect_same_voxels(*frame.temperature, *truth.temperature);
    cumulet::test::expect_same_voxels(*frame.flame, *truth.flame);
    expect_colors(frame, *color);
  }
}

TEST_F(VolumeFrameImport, FilesWithoutOffsetsHaveTheSameFields) {
  const auto grid = colors("Cd");
  {
    std::ofstream out(path(), std::ios::binary);
    openvdb::io::Stream(out).write(
        openvdb::GridCPtrVec{two_voxels("temperature", 2.0F), grid, two_voxels("density", 1.0F)});
  }
  cumulet::Progress progress;
  const VolumeFrame frame = import_frame(path(), {}, {}, &progress);
  EXPECT_EQ(frame.density.max_value, 1.0F);
  EXPECT_EQ(frame.temperature->max_value, 2.0F);
  expect_colors(frame, *grid);
}

TEST_F(VolumeFrameImport, UnusedFieldsAreReported) {
  Messages messages;
  (void)import_frame(write({two_voxels("smoke", 1.0F), two_voxels("temperature", 1.0F), two_voxels("shadow", 1.0F)}),
                     {}, messages.log);
  ASSERT_EQ(messages.warnings.size(), 1U);
  EXPECT_HAS(messages.warnings[0], "uses the grid \"smoke\" (float, fog volume); it also has \"shadow\"");
}

// --- fields on another lattice ---

TEST_F(VolumeFrameImport, WithoutDensityTheFinestFieldSetsTheResolution) {
  const auto ones = [](const Vec3d&) { return 1.0F; };
  auto heat = box("temperature", scaled(0.5), 10, ones);
  auto flame = box("flame", scaled(0.25), 10, ones);
  EXPECT_EQ(import_frame(write({heat, flame}), {}, {}).density.index_to_world[0][0], 0.25);
  EXPECT_EQ(import_frame(write({flame, heat}), naming({{&GridNames::flame, "none"}}), {}).density.index_to_world[0][0],
            0.5);
  // An empty density, as in frames before the smoke, does not determine the lattice.
  auto none = box("density", scaled(1.0), 10, ones);
  none->clear();
  const VolumeFrame early = import_frame(write({none, heat, flame}), {}, {});
  EXPECT_EQ(early.density.index_to_world[0][0], 0.25);
  EXPECT_TRUE(early.density.empty());
  // If voxel sizes are equal, the field with more voxels determines the lattice and is not resampled.
  heat = box("temperature", scaled(0.25, Vec3d(0.1)), 11, ones);
  const VolumeFrame frame = import_frame(write({flame, heat}), {}, {});
  EXPECT_TRUE(frame.density.empty());
  EXPECT_NEAR(frame.density.index_to_world[3][0], 0.1, 1e-12);
  ASSERT_TRUE(frame.flame && frame.temperature);
  EXPECT_EQ(frame.flame->index_to_world, frame.density.index_to_world);
  EXPECT_EQ(frame.temperature->active_voxels, 1331U);
}

TEST_F(VolumeFrameImport, AdditionalFieldsAreKeptAndReported) {
  const auto ones = [](const Vec3d&) { return 1.0F; };
  auto color = colors("Cd");
  color->setTransform(openvdb::math::Transform::createLinearTransform(scaled(1.0, Vec3d(100.0))));
  const openvdb::GridPtrVec grids = {box("density", scaled(1.0), 10, ones),
                                     box("flame", scaled(1.0, Vec3d(100.0)), 10, ones),
                                     box("temperature", scaled(0.9, Vec3d(100.0)), 10, ones),
                                     color,
                                     box("anisotropy", scaled(1.0, Vec3d(100.0)), 10, ones),
                                     box("vel_x", scaled(1.0, Vec3d(100.0)), 10, ones),
                                     box("vel_y", scaled(1.0, Vec3d(100.0)), 10, ones),
                                     box("vel_z", scaled(1.0, Vec3d(100.0)), 10, ones)};
  Messages messages;
  const VolumeFrame frame = import_frame(write(grids), {}, messages.log);
  EXPECT_EQ(frame.flame->bounds_min, glm::ivec3(100));
  EXPECT_EQ(frame.temperature->bounds_min, glm::ivec3(100));
  ASSERT_EQ(messages.warnings.size(), 4U);
  const std::string where = path().string() + ": grid ";
  EXPECT_EQ(messages.warnings[0], where + "\"temperature\": does not overlap \"density\"");
  EXPECT_EQ(messages.warnings[1], where + "\"Cd\": does not overlap \"density\"");
  EXPECT_EQ(messages.warnings[2], where + "\"anisotropy\": does not overlap \"density\"");
  EXPECT_EQ(messages.warnings[3], where + "\"vel_x\": does not overlap \"density\"");
}

TEST_F(VolumeFrameImport, OutOfRangeGridsAreRejected) {
  auto far = two_voxels("flame", 1.0F);
  far->setTransform(openvdb::math::Transform::createLinearTransform(scaled(1e9)));
  EXPECT_HAS(refusal(write({two_voxels("density", 1.0F), far}), {}),
             "grid \"flame\": is too far from the file's other grids or too large");
  far->setTransform(openvdb::math::Transform::createLinearTransform(scaled(1e-3)));
  EXPECT_HAS(refusal(write({two_voxels("density", 1.0F), far}), {}), "grid \"flame\": has voxels that are too small");
  // Near the limits of the coordinates.
  auto wide = fog("flame");
  wide->tree().setValue(Coord(1 << 30), 1.0F);
  wide->setTransform(openvdb::math::Transform::createLinearTransform(scaled(0.5)));
  const VolumeFrame frame = import_frame(write({two_voxels("density", 1.0F), wide}), {}, {});
  EXPECT_EQ(frame.flame->bounds_min, glm::ivec3(1 << 29));
  EXPECT_EQ(frame.flame->max_value, 0.125F);
}

TEST_F(VolumeFrameImport, UnusualTemperaturesAreReported) {
  struct Case {
    float low, high;
    std::string hint;
  };
  for (const Case& c : {Case{0.0F, 2.5F, ""}, Case{0.0F, 0.9F, "has values from 0 to 1; "},
                        Case{0.0F, 1800.0F, "has values above 20, "}, Case{-5.0F, 900.0F, "may be degrees Celsius"}}) {
    auto heat = two_voxels("temperature", c.high);
    heat->tree().setValue(Coord(5, 5, 5), c.low);
    Messages messages;
    (void)import_frame(write({two_voxels("density", 1.0F), heat}), {}, messages.log);
    ASSERT_EQ(messages.hints.size(), c.hint.empty() ? 0U : 1U);
    if (!c.hint.empty()) {
      EXPECT_HAS(messages.hints[0], c.hint);
    }
  }
}

TEST_F(VolumeFrameImport, SimulatedFiresAreReadUnchanged) {
  const fs::path data = CUMULET_SHARED_DATA "/vdb";
  if (!fs::exists(data)) GTEST_SKIP() << "no " << data;
  const auto smoke = data / "mantaflow_fire/fluid_data_0015.vdb";
  Messages messages;
  VolumeFrame frame = import_frame(smoke, naming({{&GridNames::color, "color"}}), messages.log);
  cumulet::test::expect_same_voxels(frame.density, import_volume(smoke, "density", {}));
  ASSERT_TRUE(frame.temperature && frame.flame && frame.color);
  cumulet::test::expect_same_voxels(*frame.temperature, import_volume(smoke, "temperature", {}));
  cumulet::test::expect_same_voxels(*frame.flame, import_volume(smoke, "flame", {}));
  cumulet::test::expect_same_voxels((*frame.color)[2], import_volume(smoke, "color_b", {}));
  EXPECT_EQ(messages.warnings, std::vector<std::string>{});

  const auto fire = data / "embergen_fire_a/embergen_fire_a_0050.vdb";
  frame = import_frame(fire, {}, messages.log);
  EXPECT_TRUE(frame.density.empty());
  ASSERT_TRUE(frame.temperature && frame.flame);
  cumulet::test::expect_same_voxels(*frame.temperature, import_volume(fire, "temperature", {}));
  cumulet::test::expect_same_voxels(*frame.flame, import_volume(fire, "flames", {}));
  EXPECT_EQ(frame.density.index_to_world, frame.flame->index_to_world);
  EXPECT_FALSE(frame.color);

  // A first frame in which nothing burns yet.
  frame = import_frame(data / "embergen_fire_a/embergen_fire_a_0000.vdb", {}, {});
  EXPECT_TRUE(frame.density.empty());
  ASSERT_TRUE(frame.temperature && frame.flame);
  EXPECT_TRUE(frame.temperature->empty() && frame.flame->empty());
}

}  // namespace
