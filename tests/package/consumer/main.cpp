#include <array>
#include <iostream>

// A macro that X11's headers, included by EGL's, define.
#define Always 2
#define Bool int
#define False 0
#define None 0L
#define Status int
#define Success 0
#define True 1
#include <cumulet/cumulet.hpp>

int main() {
  const auto v = cumulet::version();
  std::cout << v / 10000 << '.' << v / 100 % 100 << '.' << v % 100 << '\n';

  // Without a context: reads a volume and builds its grid.
  auto viewer = cumulet::Viewer::create().value();
  const std::array<float, 9> voxels{1, 2, 3, 4, 5, 6, 7, 8, 9};
  viewer.set_volume(cumulet::Volume::from_dense({.values = voxels, .size = {9, 1, 1}}).value()).value();
  viewer.wait().value();
  return viewer.get_volume()->info()->active_voxels == 9 ? 0 : 1;
}
