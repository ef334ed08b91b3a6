// Files with grids whose names are equal or differ only in case: which grid is read, and which warning is logged.

#include <gtest/gtest.h>

#include "support/folder.hpp"
#include "support/vdb_files.hpp"
#include "volume/frame_import.hpp"
#include "volume/volume.hpp"

namespace {

using cumulet::test::Messages;
using cumulet::test::two_voxels;
using cumulet::volume::channels_by_name;
using cumulet::volume::GridNames;
using cumulet::volume::import_frame;
using cumulet::volume::import_volume;
using cumulet::volume::list_grids;
using cumulet::volume::VolumeFrame;
using openvdb::Coord;

openvdb::Vec3SGrid::Ptr arrow(const std::string& name, float value) {
  auto grid = openvdb::Vec3SGrid::create();
  grid->setName(name);
  grid->tree().setValue(Coord(1, 2, 3), openvdb::Vec3s(value));
  return grid;
}

class GridNameCase : public ::testing::Test {
 protected:
  void SetUp() override { openvdb::initialize(); }
  [[nodiscard]] std::filesystem::path write(const openvdb::GridPtrVec& grids) const {
    openvdb::io::File((folder_ / "case.vdb").string()).write(grids);
    return folder_ / "case.vdb";
  }
  cumulet::test::Folder folder_;
};

TEST_F(GridNameCase, ExactCaseOfDensityIsPreferred) {
  for (const openvdb::GridPtrVec& grids :
       {openvdb::GridPtrVec{two_voxels("Density", 1.0F), two_voxels("DENSITY", 2.0F), two_voxels("density", 3.0F)},
        openvdb::GridPtrVec{two_voxels("density", 3.0F), two_voxels("Density", 1.0F), two_voxels("DENSITY", 2.0F)}}) {
    Messages messages;
    const auto file = write(grids);
    EXPECT_EQ(import_volume(file, "", messages.log).max_value, 3.0F);
    EXPECT_EQ(import_frame(file, {}, messages.log).density.name, "density");
    ASSERT_EQ(messages.warnings.size(), 2U);
    for (const std::string& warning : messages.warnings) {
      EXPECT_HAS(warning, "uses the grid \"density\" (float, fog volume); it also has \"Density\"");
      EXPECT_HAS(warning, "\"DENSITY\"");
    }
  }
  // Any spelling of "density" comes before an exact "soot".
  EXPECT_EQ(import_volume(write({two_voxels("soot", 1.0F), two_voxels("Density", 2.0F)}), "", {}).name, "Density");
}

TEST_F(GridNameCase, CaseInsensitiveMatchIsReported) {
  Messages messages;
  const auto file = write({two_voxels("DENSITY", 1.0F), two_voxels("Density", 2.0F)});
  EXPECT_EQ(import_frame(file, {}, messages.log).density.name, "DENSITY");
  ASSERT_EQ(messages.warnings.size(), 1U);
  EXPECT_EQ(
      messages.warnings[0],
      file.string() + ": uses the grid \"DENSITY\" (float, fog volume); it also has \"Density\" (float, fog volume)");
  // With one candidate there is no warning.
  messages.warnings.clear();
  (void)import_frame(write({two_voxels("Density", 1.0F), two_voxels("Temperature", 2.0F), two_voxels("dust", 1.0F)}),
                     {}, messages.log);
  EXPECT_TRUE(messages.warnings.empty()) << messages.warnings[0];
}

TEST_F(GridNameCase, OtherFieldsFollowTheSameRule) {
  Messages messages;
  const auto file = write({two_voxels("density", 1.0F), two_voxels("Temperature", 2.0F),
                           two_voxels("temperature", 3.0F), two_voxels("FLAME", 4.0F), two_voxels("Flame", 5.0F),
                           two_voxels("Phase_G", 0.5F), two_voxels("phase_g", 0.25F), arrow("Cd", 0.5F),
                           arrow("cd", 0.25F), arrow("Vel", 1.0F), arrow("vel", 2.0F)});
  const VolumeFrame frame = import_frame(file, {}, messages.log);
  EXPECT_EQ(frame.temperature->name, "temperature");
  EXPECT_EQ(frame.flame->name, "FLAME");
  EXPECT_EQ(frame.anisotropy->at(0).name, "phase_g");
  EXPECT_EQ(frame.color->at(0).name, "cd");
  EXPECT_EQ(frame.velocity->parts[0].name, "vel");
  std::string all;
  for (const std::string& warning : messages.warnings) all += warning + "\n";
  EXPECT_EQ(messages.warnings.size(), 5U) << all;
  EXPECT_HAS(all, ": uses the grid \"temperature\" (float, fog volume) as temperature; it also has \"Temperature\"");
  EXPECT_HAS(all, ": uses the grid \"FLAME\" (float, fog volume) as flame; it also has \"Flame\"");
  EXPECT_HAS(all, ": uses the grid \"phase_g\" (float, fog volume) as anisotropy; it also has \"Phase_G\"");
  EXPECT_HAS(all, ": uses the grid \"cd\" (vec3s, unknown) as color; it also has \"Cd\"");
  EXPECT_HAS(all, ": uses the grid \"vel\" (vec3s, unknown) as velocity; it also has \"Vel\"");
  // list_grids and channels_by_name choose the same grids.
  const auto grids = list_grids(file);
  const std::vector<std::string> channels = channels_by_name(grids);
  for (std::size_t i = 0; i < grids.size(); ++i) {
    if (grids[i].name == "temperature" || grids[i].name == "vel" || grids[i].name == "cd") {
      EXPECT_NE(channels[i], "") << grids[i].name;
    }
    if (grids[i].name == "Temperature" || grids[i].name == "Vel" || grids[i].name == "Cd") {
      EXPECT_EQ(channels[i], "") << grids[i].name;
    }
  }
  // An explicitly named grid causes no warning.
  messages.warnings.clear();
  GridNames names;
  names.temperature = "Temperature";
  names.flame = "Flame";
  names.anisotropy = names.color = names.velocity = "none";
  EXPECT_EQ(import_frame(file, names, messages.log).temperature->max_value, 2.0F);
  EXPECT_TRUE(messages.warnings.empty()) << messages.warnings[0];
}

TEST_F(GridNameCase, DuplicateGridNamesAreReported) {
  Messages messages;
  const auto file =
      write({two_voxels("density", 1.0F), two_voxels("temperature", 2.0F), two_voxels("temperature", 3.0F)});
  EXPECT_EQ(import_frame(file, {}, messages.log).temperature->max_value, 2.0F);
  ASSERT_EQ(messages.warnings.size(), 1U);
  EXPECT_HAS(messages.warnings[0], "uses the grid \"temperature[0]\" (float, fog volume) as temperature");
}

TEST_F(GridNameCase, ComponentGridsMustHaveTheSameCase) {
  Messages messages;
  const auto file =
      write({two_voxels("density", 1.0F), two_voxels("Vel_X", 1.0F), two_voxels("Vel_Y", 1.0F),
             two_voxels("Vel_Z", 1.0F), two_voxels("vel_x", 2.0F), two_voxels("vel_y", 2.0F), two_voxels("vel_z", 2.0F),
             two_voxels("Color_r", 1.0F), two_voxels("Color_g", 1.0F), two_voxels("Color_b", 1.0F),
             two_voxels("color_r", 0.5F), two_voxels("color_g", 0.5F), two_voxels("color_b", 0.5F)});
  GridNames names;
  for (const std::string color : {"color", "Color"}) {
    names.color = color;
    const VolumeFrame frame = import_frame(file, names, messages.log);
    EXPECT_EQ(frame.color->at(0).name, color + "_r");
    EXPECT_EQ(frame.velocity->parts[0].name, "vel_x");
    EXPECT_EQ(frame.velocity->parts[4].name, "vel_z");
  }
  names.velocity = "Vel";
  names.color = "none";
  messages.warnings.clear();
  EXPECT_EQ(import_frame(file, names, messages.log).velocity->parts[0].name, "Vel_X");
}

}  // namespace
