#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <memory>
#include <span>
#include <vector>

#include "gl/objects.hpp"
#include "gl/word_heap.hpp"
#include "render/parameters.hpp"
#include "render/upload.hpp"
#include "scene/march_source.hpp"

namespace cumulet::render {

using scene::March;

/// Of a volume in this cube, whose data are inside low to high (cube space).
core::CmGrid grid_parameters(const grid::Cube& cube, const glm::vec3& low, const glm::vec3& high);

/// What one march reads on the GPU, and the box that holds all density.
class MarchData {
 public:
  [[nodiscard]] March march() const { return march_; }
  [[nodiscard]] std::uint64_t bytes() const { return bytes_; }
  /// The macros that select this march in a shader.
  [[nodiscard]] std::vector<std::string> defines() const;
  void bind(const gl::Functions& gl) const;
  [[nodiscard]] const core::CmGrid& grid() const { return grid_; }

 private:
  friend class MarchUpload;
  March march_ = March::tet;
  bool linear_ = false;
  gl::Object brick_values_;
  std::vector<gl::WordHeap::Span> cells_;  // a page's records each
  std::array<gl::Object, 2> textures_;     // voxels, or values of bricks; slots of bricks
  gl::WordHeap::Span channels_;            // of cells: what they give off, the table of those that do, their colours,
                                           // their anisotropies
  gl::Object emission_voxels_;
  gl::Object scattering_voxels_;
  gl::Object anisotropy_voxels_;
  gl::WordHeap::Span tree_;
  gl::Object roots_;
  core::CmGrid grid_{};
  std::uint64_t bytes_ = 0;
};

/// Brings a source to GL piece by piece. All calls need the context current and a StateGuard around.
class MarchUpload {
 public:
  /// page_texels: where a page of records ends; 0: where the driver's limit is. Throws Error(unsupported) that names
  /// the limit that does not suffice; allocates nothing yet.
  MarchUpload(gl::FunctionsPtr gl, const gl::Limits& limits, gl::WordHeap& heap, scene::MarchSourcePtr source,
              std::int64_t page_texels = 0);
  MarchUpload(const MarchUpload&) = delete;
  MarchUpload& operator=(const MarchUpload&) = delete;
  /// As Upload has them.
  bool advance(Deadline deadline) { return upload_.advance(deadline); }
  [[nodiscard]] double progress() const { return upload_.progress(); }
  /// Only after advance returned true.
  MarchData take() { return std::move(data_); }

 private:
  void plan_tet(gl::WordHeap& heap, std::int64_t page_texels);
  void plan_dense();
  void plan_brick();
  void plan_channel_voxels();
  // A 3D texture of half floats over the box. components: of a texel, null: 0.
  void plan_voxels(gl::Object& texture, const std::vector<const grid::Statistics*>& components, GLenum format,
                   GLenum channels, float scale, const char* what);
  // Texels of 16 bits a component.
  struct Texels {
    GLenum stored, format, type;
    std::size_t count;  // of components
  };
  // Receives slices of the box, the first and the one after the last.
  using FillSlab = std::function<void(std::span<std::uint16_t> slab, int first, int last)>;
  void plan_slabs(gl::Object& texture, const Texels& texels, const char* what, const FillSlab& fill);

  gl::FunctionsPtr gl_;
  gl::Limits limits_;
  scene::MarchSourcePtr source_;
  MarchData data_;
  Upload upload_;  // its steps use the above
};

}  // namespace cumulet::render
