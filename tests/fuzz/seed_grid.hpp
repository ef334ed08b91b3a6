#pragma once

#include <openvdb/openvdb.h>

namespace cumulet::test {

/// A small grid with everything that a tree can hold: leaves, tiles, inactive voxels. Its background is 0, because with
/// another one OpenVDB leaks the nodes of a truncated file (volume/vdb_import.cpp, OwningTree), and fuzzing would run
/// out of memory.
inline openvdb::FloatGrid::Ptr seed_grid() {
  openvdb::initialize();
  auto grid = openvdb::FloatGrid::create();
  grid->setName("density");
  grid->setGridClass(openvdb::GRID_FOG_VOLUME);
  grid->insertMeta("author", openvdb::StringMetadata("nobody"));
  grid->setTransform(openvdb::math::Transform::createLinearTransform(0.25));
  auto access = grid->getAccessor();
  for (int i = 0; i < 12; ++i) access.setValue(openvdb::Coord(i, i / 2, 3 * i % 7), 0.1F * static_cast<float>(i));
  access.setValueOff(openvdb::Coord(2, 2, 2), 0.5F);
  grid->tree().addTile(1, openvdb::Coord(64, 0, 0), 0.75F, true);
  return grid;
}

}  // namespace cumulet::test
