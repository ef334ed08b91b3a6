#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "gl/objects.hpp"
#include "gl/word_heap.hpp"
#include "render/grid_build.hpp"
#include "render/parameters.hpp"
#include "render/upload.hpp"
#include "scene/march_source.hpp"

namespace cumulet::render {

using scene::March;

/// What one march reads on the GPU of the grids of a set of volumes, and the boxes that hold their density: wherever
/// those stand.
class MarchData {
 public:
  [[nodiscard]] March march() const { return march_; }
  [[nodiscard]] std::uint64_t bytes() const { return bytes_; }
  /// The macros that select this march in a shader, of one volume or of several (InstanceData). motion: of what moves
  /// while the shutter is open.
  [[nodiscard]] std::vector<std::string> defines(bool several, bool motion = false) const;
  void bind(const gl::Functions& gl) const;
  /// How many grids there are.
  [[nodiscard]] std::size_t size() const { return parts_.size(); }
  /// In the order in which their sources were given.
  [[nodiscard]] const core::CmGrid& grid(std::size_t i = 0) const { return parts_.at(i).grid; }
  /// Null: it is not here. O(grids).
  [[nodiscard]] const core::CmGrid* grid(const scene::MarchSource& source) const;
  /// Of tetrahedra: how many there are, and whether max_cells ended their refinement.
  struct Cells {
    std::size_t count = 0;
    bool limited = false;
    std::optional<std::string> on_cpu{};  ///< why GL did not build it that was to
  };
  /// Null: it is not here. O(grids).
  [[nodiscard]] const Cells* cells(const scene::MarchSource& source) const;
  /// Null: it is not here. O(grids).
  [[nodiscard]] const scene::GlowSum* glow(const scene::MarchSource& source) const;

 private:
  friend class MarchUpload;
  // A grid of the set, and where it begins.
  struct Part {
    scene::MarchSourcePtr source;
    core::CmGrid grid{};
    Cells cells;
    scene::GlowSum glow;
    std::size_t glowing = 0;   // cells in the table of those
    std::size_t inner = 0;     // nodes of its tree
    std::size_t cell = 0;      // among those of all
    std::size_t tree = 0;      // bytes into the trees: its roots, then its own
    std::size_t channels = 0;  // bytes into those
  };
  [[nodiscard]] const Part* part_of(const scene::MarchSource& source) const;
  // Of these cells, the first ones that are in one page.
  struct Run {
    std::size_t page = 0;
    std::size_t cell = 0;  // in it
    std::size_t count = 0;
  };
  [[nodiscard]] Run run(std::size_t cell, std::size_t count) const;
  [[nodiscard]] Upload::Place place_of(const Run& run) const;

  March march_ = March::tet;
  bool linear_ = false;
  std::vector<Part> parts_;
  gl::Object brick_values_;
  gl::Object brick_changes_;
  std::vector<gl::WordHeap::Span> cells_;  // a page's records each
  std::uint32_t page_shift_ = 0;
  std::array<gl::Object, 2> textures_;  // voxels, or values of bricks; slots of bricks
  gl::WordHeap::Span channels_;         // of cells: what they give off, the table of those that do, their velocities,
                                        // their colours, their anisotropies; grid by grid
  gl::Object emission_voxels_;
  gl::Object scattering_voxels_;
  gl::Object anisotropy_voxels_;
  gl::Object velocity_voxels_;
  gl::Object changes_;  // of voxels, or of bricks
  gl::WordHeap::Span trees_;
  std::uint64_t bytes_ = 0;
};

/// Brings sources to GL piece by piece. All calls need the context current and a StateGuard around.
class MarchUpload {
 public:
  using Sources = std::vector<scene::MarchSourcePtr>;
  /// sources: one at least, each another, of one march; of tetrahedra there may be several. before: what was here,
  /// whose grids are copied from there where they are among these, or null; it has to live until the last step is made.
  /// page_texels: where a page of records ends; 0: where the driver's limit is. built: the grids of sources with a
  /// plan, unless they are in `before`; likewise. Throws Error(unsupported) that names the limit that does not suffice;
  /// allocates nothing yet.
  MarchUpload(gl::FunctionsPtr gl, const gl::Limits& limits, gl::WordHeap& heap, const Sources& sources,
              const MarchData* before = nullptr, std::int64_t page_texels = 0, const BuiltGrids* built = nullptr);
  MarchUpload(const MarchUpload&) = delete;
  MarchUpload& operator=(const MarchUpload&) = delete;
  /// As Upload has them.
  bool advance(Deadline deadline) { return upload_.advance(deadline); }
  [[nodiscard]] double progress() const { return upload_.progress(); }
  /// Of GL memory, of what will be there.
  [[nodiscard]] std::uint64_t bytes() const { return data_.bytes(); }
  /// Only after advance returned true.
  MarchData take() { return std::move(data_); }

 private:
  // What is known of a part before it comes.
  void describe(MarchData::Part& part) const;
  // In main memory; null: GL built it, or it was here before.
  [[nodiscard]] const grid::TetGrid* grid_of(const MarchData::Part& part) const;
  [[nodiscard]] const scene::GlowTable& glow_of(const MarchData::Part& part) const;
  void plan_tets(gl::WordHeap& heap, std::int64_t page_texels);
  void plan_cells(gl::WordHeap& heap, std::int64_t texels);
  void plan_channels(gl::WordHeap& heap, std::int64_t texels);
  void plan_trees(gl::WordHeap& heap);
  // A piece of a buffer by pieces, from another.
  using PlaceOf = std::function<Upload::Place()>;
  void add_copy(const PlaceOf& to, const PlaceOf& from, std::size_t bytes);
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
  const MarchData* before_;
  const BuiltGrids* built_;
  scene::MarchSourcePtr source_;  // the first; of voxels the only one
  MarchData data_;
  Upload upload_;  // its steps use the above
};

}  // namespace cumulet::render
