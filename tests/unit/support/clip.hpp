#pragma once

#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "support/folder.hpp"
#include "support/vdb_files.hpp"

/// A sequence of small volumes in a folder of its own.
namespace cumulet::test {

/// A ball that grows and moves and has waves, so that bounds, bricks and values differ in each frame.
inline openvdb::FloatGrid::Ptr clip_ball(int frame, const std::string& name = "density") {
  auto grid = fog(name);
  auto accessor = grid->getAccessor();
  const int radius = 6 + frame % 5;
  for (int x = -radius; x <= radius; ++x) {
    for (int y = -radius; y <= radius; ++y) {
      for (int z = -radius; z <= radius; ++z) {
        const double r = std::sqrt(double(x * x + y * y + z * z)) / radius;
        const double value = (1.0 - r) * (1.2 + std::sin(0.9 * x + frame) * std::sin(0.7 * y) * std::sin(0.5 * z));
        if (value > 0.0) accessor.setValue({x + 2 * frame - 6, y, z}, static_cast<float>(value));
      }
    }
  }
  return grid;
}

inline void write_frame(const std::filesystem::path& file, const openvdb::GridCPtrVec& grids) {
  openvdb::io::File out(file.string());
  out.write(grids);
  out.close();
}

class Clip {
 public:
  explicit Clip(int frames) {
    openvdb::initialize();
    for (int frame = 0; frame < frames; ++frame) {
      paths_.push_back((folder_ / ("clip." + std::to_string(frame) + ".vdb")).string());
      write_frame(paths_.back(), {clip_ball(frame)});
    }
  }
  [[nodiscard]] const std::vector<std::string>& paths() const { return paths_; }
  [[nodiscard]] const std::string& path(int frame) const { return paths_[static_cast<std::size_t>(frame)]; }

  void remove(int frame) const { std::filesystem::remove(path(frame)); }
  void corrupt(int frame) const { std::ofstream(path(frame), std::ios::trunc) << "no volume"; }
  void empty(int frame) const { write_frame(path(frame), {fog("density")}); }
  void with_flame(int frame) const { write_frame(path(frame), {clip_ball(frame), clip_ball(frame + 1, "flame")}); }

 private:
  Folder folder_;
  std::vector<std::string> paths_;
};

}  // namespace cumulet::test
