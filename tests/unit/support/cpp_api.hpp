#pragma once

// Volumes for tests of cumulet.hpp, and viewers made with it.

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "cumulet/cumulet.hpp"
#include "headless.hpp"
#include "support/folder.hpp"
#include "support/openvdb.hpp"

namespace cumulet::test {

// A ball of density in 16^3 voxels.
inline std::vector<float> ball() {
  std::vector<float> values;
  for (int z = 0; z < 16; ++z) {
    for (int y = 0; y < 16; ++y) {
      for (int x = 0; x < 16; ++x) {
        values.push_back((x - 8) * (x - 8) + (y - 8) * (y - 8) + (z - 8) * (z - 8) < 50 ? 1.0F : 0.0F);
      }
    }
  }
  return values;
}

inline Volume ball_volume() {
  const std::vector<float> values = ball();
  return Volume::from_dense({.values = values, .size = {16, 16, 16}, .name = "ball"}).value();
}

// A temporary file with the ball as grid "density". corner: value of one more voxel, unless 0.
class BallFile {
 public:
  explicit BallFile(float corner = 0.0F) {
    openvdb::initialize();
    auto grid = openvdb::FloatGrid::create();
    grid->setName("density");
    grid->setGridClass(openvdb::GRID_FOG_VOLUME);
    const std::vector<float> values = ball();
    for (int i = 0; i < 4096; ++i) {
      if (values[i] > 0.0F) grid->tree().setValue({i % 16, i / 16 % 16, i / 256}, values[i]);
    }
    if (corner != 0.0F) grid->tree().setValue({0, 0, 0}, corner);
    openvdb::io::File(path()).write(openvdb::GridCPtrVec{grid});
  }

  [[nodiscard]] std::string path() const { return (folder_ / "ball.vdb").string(); }

 private:
  test::Folder folder_;
};

class CppViewer : public testing::Test {
 protected:
  [[nodiscard]] GetProc get_proc() { return {headless::Context::get_proc, &context_}; }

  static FrameResult converge(Viewer& viewer, std::uint32_t width, std::uint32_t height) {
    viewer.wait().value();
    FrameResult frame;
    do {
      frame = viewer.render({.budget_ms = 1000, .target = FrameTarget::none, .width = width, .height = height}).value();
    } while (frame.has(RenderFlags::incomplete | RenderFlags::loading));
    return frame;
  }

  headless::Context context_ = headless::Context::create(headless::Backend::automatic);
};

}  // namespace cumulet::test
