// The fields of one file, on one lattice.

#include "volume/frame.hpp"

#include <gtest/gtest.h>

#include "base/error.hpp"
#include "support/folder.hpp"
#include "support/vdb_files.hpp"
#include "support/volumes.hpp"

namespace {

namespace fs = std::filesystem;
using cumulet::test::fog;
using cumulet::test::Messages;
using cumulet::test::value_at;
using cumulet::volume::GridNames;
using cumulet::volume::import_frame;
using cumulet::volume::import_volume;
using cumulet::volume::ScalarVolume;
using cumulet::volume::VolumeFrame;
using openvdb::Coord;
using openvdb::FloatGrid;

using Field = std::string GridNames::*;

GridNames naming(std::initializer_list<std::pair<Field, std::string>> fields) {
  GridNames names;
  for (const auto& [field, name] : fields) names.*field = name;
  return names;
}

class Frame : public ::testing::Test {
 protected:
  void SetUp() override { openvdb::initialize(); }

  fs::path write(const openvdb::GridPtrVec& grids) const {
    openvdb::io::File(path().string()).write(grids);
    return path();
  }
  fs::path path() const { return folder_ / "frame.vdb"; }

  /// The message of a refusal, which must be one line that begins with the file's name.
  static std::string refusal(const fs::path& file, const GridNames& names) {
    try {
      (void)import_frame(file, names, {});
    } catch (const cumulet::Error& e) {
      const std::string what = e.what();
      EXPECT_EQ(e.code(), cumulet::ErrorCode::file) << what;
      EXPECT_EQ(what.find_first_of("\n\r\t"), std::string::npos) << what;
      EXPECT_EQ(what.rfind(file.string() + ": ", 0), 0U) << what;
      return what;
    }
    ADD_FAILURE() << file << " was accepted";
    return {};
  }

  cumulet::test::Folder folder_;
};

/// One voxel of this value, the second of another so that a grid is no constant.
FloatGrid::Ptr dot(const std::string& name, float value) {
  auto grid = fog(name);
  grid->tree().setValue(Coord(1, 2, 3), value);
  grid->tree().setValue(Coord(1, 2, 4), 0.5F * value);
  return grid;
}

void expect_same(const ScalarVolume& a, const ScalarVolume& b) {
  EXPECT_EQ(a.name, b.name);
  EXPECT_EQ(a.bounds_min, b.bounds_min);
  EXPECT_EQ(a.bounds_max, b.bounds_max);
  EXPECT_EQ(a.background, b.background);
  EXPECT_EQ(a.max_value, b.max_value);
  EXPECT_EQ(a.active_voxels, b.active_voxels);
  EXPECT_EQ(a.brick_origins, b.brick_origins);
  EXPECT_EQ(a.brick_values, b.brick_values);
  EXPECT_EQ(a.tiles.size(), b.tiles.size());
}

TEST_F(Frame, FieldsAreFoundByTheirNamesInWhateverCase) {
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
    for (const std::string& name : c.grids) grids.push_back(dot(name, 1.0F));
    const VolumeFrame frame = import_frame(write(grids), {}, {});
    EXPECT_EQ(frame.density.name, c.density);
    EXPECT_EQ(frame.temperature ? frame.temperature->name : "", c.temperature);
    EXPECT_EQ(frame.flame ? frame.flame->name : "", c.flame);
    EXPECT_EQ(frame.density.empty(), c.density.empty());
    EXPECT_FALSE(frame.colour);
  }
}

TEST_F(Frame, NamesChooseAndLeaveOut) {
  const auto file = write({dot("density", 1.0F), dot("temperature", 2.0F), dot("flame", 3.0F), dot("shadow", 4.0F)});
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

  // What is named for one field is not found for another.
  frame = import_frame(file, naming({{&GridNames::flame, "temperature"}}), {});
  EXPECT_FALSE(frame.temperature);

  // Without fire, as import_volume has it.
  const auto fire = write({dot("temperature", 2.0F), dot("flames", 3.0F)});
  frame = import_frame(fire, naming({{&GridNames::temperature, "none"}, {&GridNames::flame, "none"}}), {});
  EXPECT_EQ(frame.density.name, "flames");
  EXPECT_FALSE(frame.temperature || frame.flame);
}

TEST_F(Frame, WhatIsAskedForAndMissingIsNamed) {
  const auto file = write({dot("density", 1.0F), dot("temperature", 2.0F)});
  for (const GridNames& names : {naming({{&GridNames::density, "nope"}}), naming({{&GridNames::temperature, "nope"}}),
                                 naming({{&GridNames::flame, "nope"}}), naming({{&GridNames::colour, "nope"}})}) {
    const std::string what = refusal(file, names);
    EXPECT_HAS(what, "\"nope\"");
    EXPECT_HAS(what, "\"density\" (float, fog volume), \"temperature\" (float, fog volume)");
  }
  EXPECT_HAS(refusal(file, naming({{&GridNames::density, "none"}, {&GridNames::temperature, "none"}})),
             "every field is left out");
  auto level_set = dot("temperature", 1.0F);
  level_set->setGridClass(openvdb::GRID_LEVEL_SET);
  EXPECT_HAS(refusal(write({level_set}), naming({{&GridNames::temperature, "temperature"}})), "is a level set");
}

TEST_F(Frame, ColourOfThreeGrids) {
  const auto file = write(
      {dot("density", 1.0F), dot("color_r", 0.25F), dot("color_g", 0.5F), dot("color_b", 0.75F), dot("x_r", 1.0F)});
  for (const std::string name : {"", "color"}) {
    const VolumeFrame frame = import_frame(file, naming({{&GridNames::colour, name}}), {});
    ASSERT_TRUE(frame.colour);
    EXPECT_EQ((*frame.colour)[0].max_value, 0.25F);
    EXPECT_EQ((*frame.colour)[1].max_value, 0.5F);
    EXPECT_EQ((*frame.colour)[2].max_value, 0.75F);
  }
  EXPECT_FALSE(import_frame(file, naming({{&GridNames::colour, "none"}}), {}).colour);
  EXPECT_HAS(refusal(file, naming({{&GridNames::colour, "x"}})), "\"x_g\"");
}

TEST_F(Frame, WhatIsNotShownIsRemarkedOn) {
  Messages messages;
  (void)import_frame(write({dot("smoke", 1.0F), dot("temperature", 1.0F), dot("shadow", 1.0F)}), {}, messages.log);
  ASSERT_EQ(messages.warnings.size(), 1U);
  EXPECT_HAS(messages.warnings[0], "shows its grid \"smoke\" (float, fog volume); there is also \"shadow\"");
}

TEST_F(Frame, SimulatedFiresAreReadAsTheyAre) {
  const fs::path data = CUMULET_SHARED_DATA "/vdb";
  if (!fs::exists(data)) GTEST_SKIP() << "no " << data;
  const auto smoke = data / "mantaflow_fire/fluid_data_0015.vdb";
  Messages messages;
  VolumeFrame frame = import_frame(smoke, {}, messages.log);
  expect_same(frame.density, import_volume(smoke, "density", {}));
  ASSERT_TRUE(frame.temperature && frame.flame && frame.colour);
  expect_same(*frame.temperature, import_volume(smoke, "temperature", {}));
  expect_same(*frame.flame, import_volume(smoke, "flame", {}));
  expect_same((*frame.colour)[2], import_volume(smoke, "color_b", {}));
  EXPECT_EQ(messages.warnings, std::vector<std::string>{});

  const auto fire = data / "embergen_fire_a/embergen_fire_a_0050.vdb";
  frame = import_frame(fire, {}, messages.log);
  EXPECT_TRUE(frame.density.empty());
  ASSERT_TRUE(frame.temperature && frame.flame);
  expect_same(*frame.temperature, import_volume(fire, "temperature", {}));
  expect_same(*frame.flame, import_volume(fire, "flames", {}));
  EXPECT_EQ(frame.density.index_to_world, frame.flame->index_to_world);
  EXPECT_FALSE(frame.colour);

  // A first frame in which nothing burns yet.
  frame = import_frame(data / "embergen_fire_a/embergen_fire_a_0000.vdb", {}, {});
  EXPECT_TRUE(frame.density.empty());
  ASSERT_TRUE(frame.temperature && frame.flame);
  EXPECT_TRUE(frame.temperature->empty() && frame.flame->empty());
}

}  // namespace
