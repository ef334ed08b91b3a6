// Writes the seeds of vdb_fuzz into a folder.

#include <openvdb/openvdb.h>

#include "fuzz/seed_folder.hpp"
#include "fuzz/seed_grid.hpp"

int main(int argc, char** argv) {
  const cumulet::test::SeedFolder folder(argc, argv);
  const auto write = [&](const std::string& name, std::uint32_t compression, const openvdb::GridPtrVec& grids) {
    openvdb::io::File file((folder.path() / name).string());
    file.setCompression(compression);
    file.write(grids);
  };
  const auto grid = cumulet::test::seed_grid();
  auto half = cumulet::test::seed_grid();
  half->setSaveFloatAsHalf(true);
  auto vectors = openvdb::Vec3SGrid::create();
  vectors->setName("velocity");
  vectors->fill(openvdb::CoordBBox(openvdb::Coord(0), openvdb::Coord(5)), openvdb::Vec3f(1, 2, 3));
  write("plain.vdb", openvdb::io::COMPRESS_NONE, {grid});
  write("mask.vdb", openvdb::io::COMPRESS_ACTIVE_MASK, {grid});
  write("zip.vdb", openvdb::io::COMPRESS_ZIP | openvdb::io::COMPRESS_ACTIVE_MASK, {grid, vectors});
  write("blosc.vdb", openvdb::io::COMPRESS_BLOSC, {half});
  write("shared.vdb", openvdb::io::COMPRESS_NONE, {grid, grid->copyGrid()});
  // As OpenVDB 13 writes them: a later version, with a grid of halves.
  using HalfTree = openvdb::tree::Tree4<openvdb::math::half, 5, 4, 3>::Type;
  const auto halves = openvdb::Grid<HalfTree>::create();
  halves->setName("density");
  halves->fill(openvdb::CoordBBox(openvdb::Coord(0), openvdb::Coord(5)), openvdb::math::half(0.5F));
  write("halves.vdb", openvdb::io::COMPRESS_ZIP | openvdb::io::COMPRESS_ACTIVE_MASK, {halves});
  std::fstream later(folder.path() / "halves.vdb", std::ios::binary | std::ios::in | std::ios::out);
  later.seekp(8);
  const std::uint32_t version = 225;
  later.write(reinterpret_cast<const char*>(&version), sizeof version);
  return 0;
}
