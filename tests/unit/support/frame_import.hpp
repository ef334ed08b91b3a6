#pragma once

// Files with several fields, and their import as one frame.

#include <gtest/gtest.h>

#include <filesystem>
#include <initializer_list>
#include <string>
#include <utility>

#include "support/folder.hpp"
#include "support/vdb_files.hpp"
#include "volume/frame_import.hpp"

namespace cumulet::test {

inline volume::GridNames naming(
    std::initializer_list<std::pair<std::string volume::GridNames::*, std::string>> fields) {
  volume::GridNames names;
  for (const auto& [field, name] : fields) names.*field = name;
  return names;
}

class VolumeFrameImport : public ::testing::Test {
 protected:
  void SetUp() override { openvdb::initialize(); }

  std::filesystem::path write(const openvdb::GridPtrVec& grids) const {
    openvdb::io::File(path().string()).write(grids);
    return path();
  }
  std::filesystem::path path() const { return folder_ / "frame.vdb"; }

  static std::string refusal(const std::filesystem::path& file, const volume::GridNames& names) {
    return test::refusal(file, [&] { (void)volume::import_frame(file, names, {}); });
  }

  Folder folder_;
};

/// A box of voxels with values function(world position) and this transform.
template <class Function>
openvdb::FloatGrid::Ptr box(const std::string& name, const openvdb::math::Mat4d& index_to_world, int size,
                            Function function) {
  auto grid = fog(name);
  grid->setTransform(openvdb::math::Transform::createLinearTransform(index_to_world));
  auto accessor = grid->getAccessor();
  for (openvdb::Coord c(0); c.x() < size; ++c.x()) {
    for (c.y() = 0; c.y() < size; ++c.y()) {
      for (c.z() = 0; c.z() < size; ++c.z()) accessor.setValue(c, function(grid->indexToWorld(c)));
    }
  }
  return grid;
}

inline openvdb::math::Mat4d scaled(double voxel, const openvdb::Vec3d& first = openvdb::Vec3d(0.0)) {
  openvdb::math::Mat4d m;
  m.setToScale(openvdb::Vec3d(voxel));
  m.postTranslate(first);
  return m;
}

inline float plane(const openvdb::Vec3d& p) {
  return static_cast<float>(2.0 + 0.125 * p.x() - 0.0625 * p.y() + 0.03125 * p.z());
}

}  // namespace cumulet::test
