// Writes the volume that the hosts of exits.py read: files.cpp OUT.vdb
#include <openvdb/openvdb.h>

#include <cmath>

#include "support/openvdb.hpp"

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  openvdb::initialize();
  const auto grid = openvdb::FloatGrid::create();
  grid->setName("density");
  grid->setGridClass(openvdb::GRID_FOG_VOLUME);
  auto accessor = grid->getAccessor();
  constexpr int side = 72;
  for (int x = 0; x < side; ++x) {
    for (int y = 0; y < side; ++y) {
      for (int z = 0; z < side; ++z) {
        const double wave = std::sin(0.3 * x) * std::sin(0.23 * y) * std::sin(0.19 * z);
        if (wave > 0.1) accessor.setValue({x, y, z}, static_cast<float>(wave));
      }
    }
  }
  openvdb::io::File file(argv[1]);
  file.write({grid});
  file.close();
  return 0;
}
