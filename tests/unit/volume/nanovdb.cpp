// NanoVDB files are read like OpenVDB files.

#define NANOVDB_USE_ZIP
#define NANOVDB_USE_BLOSC

#include <gtest/gtest.h>
#include <nanovdb/util/IO.h>
#include <nanovdb/util/OpenToNanoVDB.h>
#include <openvdb/tools/LevelSetSphere.h>

#include <filesystem>
#include <limits>
#include <string>
#include <vector>

#include "support/file_bytes.hpp"
#include "support/volume_import.hpp"
#include "volume/inspection.hpp"
#include "volume/volume.hpp"

namespace {

using cumulet::test::bytes_of;
using cumulet::test::expect_same;
using cumulet::test::fog;
using cumulet::test::Messages;
using cumulet::test::rich;
using cumulet::test::VolumeImport;
using cumulet::volume::import_volume;
using cumulet::volume::list_grids;
using openvdb::Coord;
using openvdb::FloatGrid;
namespace fs = std::filesystem;

template <typename BuildT>
void write_nano(const fs::path& file, const FloatGrid& grid, nanovdb::io::Codec codec) {
  nanovdb::io::writeGrid(file.string(), nanovdb::openToNanoVDB<nanovdb::HostBuffer, openvdb::FloatTree, BuildT>(grid),
                         codec);
}

TEST_F(VolumeImport, NanoVdbEqualsOpenVdb) {
  const auto file = path("test.nvdb");
  const auto grid = rich(0.125F);
  for (const auto codec : {nanovdb::io::Codec::NONE, nanovdb::io::Codec::ZIP, nanovdb::io::Codec::BLOSC}) {
    write_nano<float>(file, *grid, codec);
    Messages messages;
    expect_same(*grid, import_volume(file, "", messages.log));
    EXPECT_TRUE(messages.warnings.empty());
  }
  EXPECT_EQ(list_grids(file).at(0).grid_class, "fog volume");
  EXPECT_EQ(list_grids(file).at(0).type, "float");
}

TEST_F(VolumeImport, NanoVdbQuantisedGrids) {
  const auto file = path("test.nvdb");
  const auto grid = rich(0.0F);
  write_nano<nanovdb::Fp4>(file, *grid, nanovdb::io::Codec::NONE);
  expect_same(*grid, import_volume(file, "", {}), 9.0 / 15);
  write_nano<nanovdb::Fp8>(file, *grid, nanovdb::io::Codec::NONE);
  expect_same(*grid, import_volume(file, "", {}), 9.0 / 255);
  write_nano<nanovdb::Fp16>(file, *grid, nanovdb::io::Codec::NONE);
  expect_same(*grid, import_volume(file, "", {}), 9.0 / 65535);
  write_nano<nanovdb::FpN>(file, *grid, nanovdb::io::Codec::NONE);
  expect_same(*grid, import_volume(file, "", {}), 0.1);
}

TEST_F(VolumeImport, NanoVdbListsGridsAndRejectsOthers) {
  const auto file = path("test.nvdb");
  const auto sphere = openvdb::tools::createLevelSetSphere<FloatGrid>(5.0F, openvdb::Vec3f(0), 1.0F);
  sphere->setName("surface");
  const auto vec = openvdb::Vec3SGrid::create();
  vec->setName("vel");
  vec->tree().setValue(Coord(0), openvdb::Vec3s(1));
  const auto smoke = fog("smoke");
  smoke->tree().setValue(Coord(1, 2, 3), 4.0F);
  std::vector<nanovdb::GridHandle<>> handles;
  handles.push_back(nanovdb::openToNanoVDB(*sphere));
  handles.push_back(nanovdb::openToNanoVDB(*vec));
  handles.push_back(nanovdb::openToNanoVDB(*smoke));
  nanovdb::io::writeGrids(file.string(), handles, nanovdb::io::Codec::BLOSC);
  ASSERT_EQ(list_grids(file).size(), 3U);
  EXPECT_EQ(import_volume(file, "", {}).name, "smoke");
  expect_same(*smoke, import_volume(file, "smoke", {}));
  EXPECT_HAS(refusal(file, "surface"), "level set");
  EXPECT_HAS(refusal(file, "vel"), "has type Vec3f");
  EXPECT_HAS(refusal(file, "none"), "\"surface\" (float, level set), \"vel\"");
  handles.push_back(nanovdb::openToNanoVDB(*smoke));
  nanovdb::io::writeGrids(file.string(), handles);
  EXPECT_HAS(refusal(file, "smoke"), "\"smoke[0]\" (float, fog volume), \"smoke[1]\"");
  EXPECT_EQ(import_volume(file, "smoke[1]", {}).max_value, 4.0F);

  const auto bad = fog("density");
  bad->tree().setValue(Coord(0), std::numeric_limits<float>::quiet_NaN());
  write_nano<float>(file, *bad, nanovdb::io::Codec::NONE);
  EXPECT_EQ(import_volume(file, "", {}).non_finite_voxels, 1U);
}

TEST_F(VolumeImport, NanoVdbChecksumIsChecked) {
  const auto grid = rich(0.0F);
  const auto file = path("test.nvdb");
  write_nano<float>(file, *grid, nanovdb::io::Codec::NONE);
  std::string bytes = bytes_of(file);
  const std::size_t grid_start = bytes.find("NanoVDB", 8);
  ASSERT_NE(grid_start, std::string::npos);
  bytes[grid_start + 60] ^= 1;  // in the grid's own copy of its name, harmless otherwise
  Messages messages;
  expect_same(*grid, import_volume(write_bytes(bytes, "flipped.nvdb"), "", messages.log));
  ASSERT_EQ(messages.warnings.size(), 1U);
  EXPECT_HAS(messages.warnings[0], "checksum");
}

}  // namespace
