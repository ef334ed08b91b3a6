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
#include "grid/channel_table.hpp"
#include "render/grid/built_grid.hpp"
#include "render/pacing/upload.hpp"
#include "render/scene/parameters.hpp"
#include "scene/march_source.hpp"

namespace cumulet::render {

using scene::March;

/// GPU data of the grids of a set of volumes of one grid type (`March`), and the bounding boxes of their density.
/// Independent of instance transforms.
class MarchData {
 public:
  static constexpr std::size_t max_pages = 6;

  [[nodiscard]] March march() const { return march_; }
  [[nodiscard]] std::uint64_t bytes() const { return bytes_; }
  /// Whether the density varies in cells: linear in tetrahedra, trilinear between voxels. Else it is constant.
  [[nodiscard]] bool is_linear() const { return linear_; }
  /// Whether it is trilinear in the finest tetrahedra.
  [[nodiscard]] bool is_trilinear() const { return trilinear_; }
  /// Number of pages of cell records; at most max_pages.
  [[nodiscard]] std::size_t pages() const { return cells_.size(); }
  /// Whether a grid has cells of the wide format (cm_is_wide).
  [[nodiscard]] bool is_wide() const;
  void bind(const gl::Functions& gl) const;
  /// Number of grids.
  [[nodiscard]] std::size_t size() const { return parts_.size(); }
  /// In the order in which their sources were given.
  [[nodiscard]] const core::CmGrid& grid(std::size_t i = 0) const { return parts_.at(i).grid; }
  /// Whether it consists of the grids of these sources, in this order, and was planned for pages of this size.
  [[nodiscard]] bool is_of(const std::vector<scene::MarchSourcePtr>& sources, std::int64_t page_texels) const;
  /// Null: it is not uploaded. O(grids).
  [[nodiscard]] const core::CmGrid* grid(const scene::MarchSource& source) const;
  /// Tetrahedral grids: number of cells, and whether max_cells ended the refinement.
  struct Cells {
    std::size_t count = 0;
    bool limited = false;
    std::optional<std::string> on_cpu{};  ///< why the CPU built a grid that was to be built on the GPU
  };
  /// Null: it is not uploaded. O(grids).
  [[nodiscard]] const Cells* cells(const scene::MarchSource& source) const;
  /// Null: it is not uploaded. O(grids).
  [[nodiscard]] const scene::EmissiveSum* emissive(const scene::MarchSource& source) const;

 private:
  friend class MarchUpload;
  // A grid of the set, with its offsets.
  struct Part {
    scene::MarchSourcePtr source;
    core::CmGrid grid{};
    Cells cells;
    scene::EmissiveSum emissive;
    std::size_t glowing = 0;   // emissive cells in the table
    std::size_t inner = 0;     // inner nodes of its tree
    std::size_t cell = 0;      // first cell, among those of all grids
    std::size_t tree = 0;      // byte offset in trees_: its roots, then its nodes
    std::size_t channels = 0;  // byte offset in channels_
  };
  [[nodiscard]] const Part* part_of(const scene::MarchSource& source) const;
  // The leading part of a range of cells that is in one page.
  struct Run {
    std::size_t page = 0;
    std::size_t cell = 0;  // offset in the page
    std::size_t count = 0;
  };
  [[nodiscard]] Run run(std::size_t cell, std::size_t count) const;
  [[nodiscard]] Upload::Location location_of(const Run& run) const;

  March march_ = March::tet;
  bool linear_ = false;
  bool trilinear_ = false;
  std::vector<Part> parts_;
  std::int64_t page_texels_ = 0;  // wanted size of a page; 0: the driver's limit
  gl::Object brick_values_;
  gl::Object brick_changes_;
  std::vector<gl::WordHeap::Span> cells_;  // cell records, per page
  std::uint32_t page_shift_ = 0;
  std::array<gl::Object, 2> textures_;  // voxels, or values of bricks; slots of bricks
  // per grid: the cells' emission, the table of emissive cells, the cells' corners, and the cells' velocities, changes,
  // colors and anisotropies
  gl::WordHeap::Span channels_;
  std::array<gl::Object, grid::channel_table.size()> voxel_channels_;  // textures of voxels, by channel
  gl::Object changes_;                                                 // of voxels, or of bricks
  gl::WordHeap::Span trees_;
  std::uint64_t bytes_ = 0;
};

using MarchDataPtr = std::shared_ptr<const MarchData>;

/// Uploads sources in steps. The data belong to the heap's functions, and may outlive those of the upload. All calls
/// need a current context and an active StateGuard.
class MarchUpload {
 public:
  using Sources = std::vector<scene::MarchSourcePtr>;
  /// Allocates nothing yet. sources: at least one, all different, of one grid type; only tetrahedral grids may be
  /// several. before: previous data, or null; grids that it has are copied from there. built: grids of the sources with
  /// a plan, unless `before` has them. Both must live until the last step is done. page_texels: size of a page of cell
  /// records; 0: the driver's limit. Throws Error(unsupported), naming the limit that is exceeded.
  MarchUpload(gl::FunctionsPtr gl, const gl::Limits& limits, gl::WordHeap& heap, const Sources& sources,
              const MarchData* before = nullptr, std::int64_t page_texels = 0, const BuiltGrids* built = nullptr);
  MarchUpload(const MarchUpload&) = delete;
  MarchUpload& operator=(const MarchUpload&) = delete;
  /// Returns and throws as Upload::advance().
  bool advance(Deadline deadline) { return upload_.advance(deadline); }
  [[nodiscard]] double progress() const { return upload_.progress(); }
  /// GL memory of the complete data.
  [[nodiscard]] std::uint64_t bytes() const { return data_.bytes(); }
  /// Only after advance() returned true.
  MarchData take() { return std::move(data_); }

 private:
  // Sets the fields of a part that are known before the upload.
  void describe(MarchData::Part& part) const;
  // Returns the grid in main memory; null: it was built on the GPU, or is copied from `before`.
  [[nodiscard]] const grid::TetGrid* grid_of(const MarchData::Part& part) const;
  [[nodiscard]] const scene::EmissiveTable& emissive_of(const MarchData::Part& part) const;
  void plan_tets(gl::WordHeap& heap, std::int64_t page_texels);
  void plan_cells(gl::WordHeap& heap, std::int64_t texels);
  void plan_channels(gl::WordHeap& heap, std::int64_t texels);
  void plan_trees(gl::WordHeap& heap);
  // Adds steps that copy a range from one buffer to another.
  using LocationOf = std::function<Upload::Location()>;
  void add_copy(const LocationOf& to, const LocationOf& from, std::size_t bytes);
  void plan_dense();
  void plan_brick();
  void plan_channel_voxels();
  // Plans a 3D texture of half floats over the box. components: one per component of a texel; null: 0.
  void plan_voxels(gl::Object& texture, const std::vector<const grid::Statistics*>& components, GLenum format,
                   GLenum channels, float scale, const char* what);
  // Texels of 16 bits per component.
  struct Texels {
    GLenum stored, format, type;
    std::size_t count;  // number of components
  };
  // Fills slices [first, last) of the box.
  using FillSlab = std::function<void(std::span<std::uint16_t> slab, int first, int last)>;
  void plan_slabs(gl::Object& texture, const Texels& texels, const char* what, const FillSlab& fill);

  gl::FunctionsPtr gl_;     // of the context that uploads: they keep the host's state
  gl::FunctionsPtr owner_;  // of the objects
  gl::Limits limits_;
  const MarchData* before_;
  const BuiltGrids* built_;
  scene::MarchSourcePtr source_;  // the first source; the only one if it is not tetrahedral
  MarchData data_;
  Upload upload_;  // its steps use the members above
};

}  // namespace cumulet::render
