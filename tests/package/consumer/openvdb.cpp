#include <cumulet/cumulet.hpp>
#include <cumulet/cumulet_openvdb.hpp>

// Makes a volume from a grid of this program's own OpenVDB.
int main() {
  openvdb::initialize();
  auto grid = openvdb::FloatGrid::create();
  grid->fill(openvdb::CoordBBox(openvdb::Coord(0), openvdb::Coord(9)), 2.0F);
  cumulet_volume* volume = nullptr;
  if (cumulet::volume_from_openvdb(grid, &volume) != CUMULET_OK) return 1;
  return cumulet::Volume::adopt(volume).info()->active_voxels == 1000 ? 0 : 1;
}
