#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "base/progress_part.hpp"
#include "grid/cell.hpp"
#include "grid/refine.hpp"
#include "grid/statistics.hpp"

namespace cumulet::grid {

/// One cell as the shaders read it: glsl/cell.glsl has the layout.
struct CellRecord {
  glm::uvec4 links;
  glm::uvec4 data;
};
static_assert(sizeof(CellRecord) == 32);

/// What a cell gives off, as the shaders read it: glsl/channels.glsl has the layout.
struct EmissionRecord {
  glm::vec3 mean;  ///< radiance a world unit of length
  std::uint32_t gradient;
};
static_assert(sizeof(EmissionRecord) == 16);

/// What a cell gives off, by moments of red, green and blue over it. centroid: of the cell, in cube space.
EmissionRecord emission_record(const std::array<Moments, 3>& moments, std::uint32_t shape, const glm::dvec3& centroid,
                               CellKind cells);
/// Whether anything of it gives off light.
bool emits(const std::array<Moments, 3>& moments);

/// The mean colour of what scatters as the shaders read it: glsl/channels.glsl has the layout. scattering: of density x
/// colour, of what has this mass of density. Black where that is none.
std::uint32_t pack_colour(const glm::dvec3& scattering, double mass);

/// The mean cosine of what scatters as the shaders read it, at most 0.999 either way.
/// forward: of what scatters, times (1 + anisotropy) / 2. 0 where nothing scatters.
std::int16_t pack_anisotropy(double forward, double scattering);

/// The mean velocity along the cube's axes as the shaders read it, voxels a second: glsl/channels.glsl has the layout.
/// momentum: as MomentumField has it, of what has this mass of density. 0 where that is none.
glm::uvec2 pack_velocity(const glm::dvec3& momentum, double mass, float fastest);

/// A density's mean and gradient as the shaders read them: glsl/cell.glsl has the layout.
glm::uvec2 pack_fit(const glm::vec4& fit);

/// Where in the leaves and in the tree a root cell's part begins.
struct RootEntry {
  std::uint32_t first_leaf = 0;
  std::uint32_t first_internal = 0;
};

/// A cell that is there before any split; the control cube has 24. links: as a record's, of the others.
struct RootCell {
  glm::vec3 v0{0.0F};
  std::uint32_t shape = 0;
  std::array<std::uint32_t, 4> links{CM_NONE, CM_NONE, CM_NONE, CM_NONE};
};
std::array<RootCell, 24> root_cells(int log2_size);

/// The adaptive grid: a conforming tetrahedral partition of the control cube, in bisection (depth-first) order.
struct TetGrid {
  Cube cube;
  std::vector<CellRecord> cells;
  /// Point location: for each internal node of the bisection forest in depth-first order, how many internal nodes its
  /// child 0 has. A leaf has none, a subtree has one leaf more than internal nodes: so this one number says where both
  /// children's nodes and leaves begin.
  std::vector<std::uint32_t> tree;
  std::array<RootEntry, 25> roots{};  ///< 24 and an end mark
  std::uint32_t levels = 0;           ///< deepest bisection level of a cell; the roots are level 0
  float density_unit = 1.0F;          ///< grid value of a record's density 1
  /// One a cell; empty where no cell gives off light.
  std::vector<EmissionRecord> emission;
  /// One a cell, glsl/channels.glsl; empty where what scatters is white.
  std::vector<std::uint32_t> colour;
  /// One a cell, pack_anisotropy(); empty where it is the medium's.
  std::vector<std::int16_t> anisotropy;
  /// One a cell, pack_velocity(); empty where nothing moves.
  std::vector<glm::uvec2> velocity;
  /// One a cell, as the second half of a record's data: half of how that changes while the shutter is open, from the
  /// middle of which the record's is. Empty where nothing does.
  std::vector<glm::uvec2> change;
  glm::vec3 content_min{0.0F};  ///< cube-space box that holds every cell with density or emission
  glm::vec3 content_max{0.0F};
  bool limited = false;  ///< max_cells ended the refinement

  [[nodiscard]] std::uint64_t bytes() const {
    return cells.size() * sizeof(CellRecord) + emission.size() * sizeof(EmissionRecord) + colour.size() * 4 +
           anisotropy.size() * 2 + velocity.size() * 8 + change.size() * 8 + tree.size() * 4 + 200;
  }
};

/// Bisects the control cube by the set's diamonds, links neighbours as it goes, and fits densities.
/// The same input gives the same grid, whatever the number of threads. O(cells).
class GridBuilder {
 public:
  GridBuilder(const Statistics& statistics, const DiamondSet& diamonds);
  /// Throws Error(unsupported) for more than 2^31 nodes. progress, here and below: as for Statistics. Cancelled, the
  /// builder is of no use; but records() may be called again.
  void bisect(Progress* progress = nullptr);
  /// channels: of the cells; over the same cube.
  TetGrid records(CellKind cells, float max_value, const Channels& channels, Progress* progress = nullptr);
  TetGrid records(CellKind cells, float max_value, Progress* progress = nullptr) {
    return records(cells, max_value, {}, progress);
  }

 private:
  // A vertex: 16 bits of each coordinate, and 5 more of each in one word.
  struct Vertex {
    std::array<std::uint16_t, 3> low{};
    std::uint16_t high = 0;
    Vertex() = default;
    explicit Vertex(const glm::vec3& at);
    explicit operator glm::vec3() const;
    bool operator==(const Vertex&) const = default;
  };
  struct Node {
    std::array<std::uint32_t, 4> links;
    std::uint32_t child;  // 0: a leaf
    Vertex v0;
    std::uint16_t shape;
    std::uint16_t heap : 12;        // place in the brick's tree, 0 above bricks
    std::uint16_t permutation : 4;  // of that tree
  };
  static_assert(sizeof(Node) == 32);

  void make_roots();
  void split_level(std::uint32_t first, std::uint32_t last, ProgressPart& part);
  // Of these nodes; returns how many split.
  std::uint32_t mark_splits(std::uint32_t first, std::uint32_t last);
  void make_child(std::uint32_t parent, unsigned side);
  [[nodiscard]] std::uint32_t behind_whole(std::uint32_t other, std::uint32_t cell) const;
  [[nodiscard]] std::uint32_t resolve(std::uint32_t from, unsigned face) const;
  void order(Progress* progress);
  // The roots and the tree of point location.
  void number_nodes(TetGrid& grid, ProgressPart& part) const;
  class LeafMoments;
  class LeafDensity;
  class LeafEmission;
  class LeafScattering;
  class LeafVelocity;
  class LeafChannels;
  // fit: mean and gradient, in units of the grid's density_unit.
  [[nodiscard]] CellRecord record(std::uint32_t index, const glm::vec4& fit, bool emits) const;

  const Statistics* statistics_;
  const DiamondSet* diamonds_;
  std::vector<Node> nodes_;
  std::vector<std::uint32_t> level_first_;
  std::vector<std::uint32_t> leaves_below_;
  std::vector<std::uint32_t> first_leaf_;
  std::vector<std::uint32_t> leaf_nodes_;
};

/// The cell that holds p (cube space); on a face, edge or vertex one of those that share it. CM_NONE outside the cube.
std::uint32_t locate(const TetGrid& grid, const glm::vec3& p);

}  // namespace cumulet::grid
