#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "gl/objects.hpp"
#include "grid/statistics.hpp"
#include "grid/tet_grid.hpp"
#include "render/parameters.hpp"

namespace cumulet::render {

enum class March { tet = 0, dense = 1, brick = 2 };

/// What one march reads on the GPU, and the box that holds all density.
class MarchData {
 public:
  /// Records and tree as texture buffers, paged where the driver's texture buffer limit ends (page_texels 0: the
  /// driver's). Throws Error(unsupported) that names the limit if the pages do not suffice.
  static MarchData upload_tet(const gl::FunctionsPtr& gl, const gl::Limits& limits, const grid::TetGrid& grid,
                              bool linear, std::int64_t page_texels = 0);
  /// The bounds' voxels as one half-float 3D texture.
  static MarchData upload_dense(const gl::FunctionsPtr& gl, const gl::Limits& limits,
                                const grid::Statistics& statistics, const volume::ScalarVolume& volume);
  /// Non-empty 8^3 bricks as half floats, and a 3D texture of their slots.
  static MarchData upload_brick(const gl::FunctionsPtr& gl, const gl::Limits& limits,
                                const grid::Statistics& statistics, const volume::ScalarVolume& volume);

  [[nodiscard]] March march() const { return march_; }
  [[nodiscard]] std::uint64_t bytes() const { return bytes_; }
  /// The macros that select this march in a shader.
  [[nodiscard]] std::vector<std::string> defines() const;
  void bind(const gl::Functions& gl) const;
  /// Fills the box and the cube.
  void describe(core::CmParameters& parameters) const;

 private:
  MarchData() = default;

  March march_ = March::tet;
  bool linear_ = false;
  int log2_page_cells_ = 0;
  std::vector<gl::Object> buffers_;
  std::vector<gl::Object> pages_;
  std::array<gl::Object, 3> textures_;  // units 12, 13, 14
  gl::Object roots_;
  glm::vec3 box_min_{0.0F};
  glm::vec3 box_max_{0.0F};
  glm::uvec4 cube_{0U};
  std::uint64_t bytes_ = 0;
};

}  // namespace cumulet::render
