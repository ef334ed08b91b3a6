#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "grid/cell.hpp"
#include "grid/channel_table.hpp"
#include "grid/refine_settings.hpp"
#include "grid/statistics.hpp"

namespace cumulet::grid {

/// One cell as the shaders read it; layout: glsl/grid/cell.glsl.
struct CellRecord {
  glm::uvec4 links;
  glm::uvec4 data;
};
static_assert(sizeof(CellRecord) == 32);

/// Returns a cell's emission from the moments of red, green and blue over it. centroid: of the cell, in cube space.
EmissionRecord emission_record(const std::array<Moments, 3>& moments, std::uint32_t shape, const glm::dvec3& centroid,
                               CellKind cells);
/// Returns true if any part of the cell emits light.
bool emits(const std::array<Moments, 3>& moments);

/// Packs the mean scattering color for shaders; layout: glsl/grid/channels.glsl. scattering: mass of density x color.
/// mass: of density; if it is 0 the color is black.
std::uint32_t pack_color(const glm::dvec3& scattering, double mass);

/// Packs the mean cosine of scattering for shaders, clamped to +-0.999. forward: mass of scattering x (1 + anisotropy)
/// / 2. scattering: its mass; if it is 0 the cosine is 0.
std::int16_t pack_anisotropy(double forward, double scattering);

/// Packs the mean velocity along the cube's axes for shaders, in voxels per second; layout: glsl/grid/channels.glsl.
/// momentum: mass of each component of MomentumField. mass: of density; if it is 0 the velocity is 0.
glm::uvec2 pack_velocity(const glm::dvec3& momentum, double mass, float fastest);

/// Packs a density's mean and gradient for shaders; layout: glsl/grid/cell.glsl.
glm::uvec2 pack_fit(const glm::vec4& fit);

/// Start of a root cell's subtree in the leaves and in the tree.
struct RootEntry {
  std::uint32_t first_leaf = 0;
  std::uint32_t first_internal = 0;
};

/// A cell of the unsplit control cube, which has 24. links: as in CellRecord, with root indices.
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
  /// Point location: for each internal node of the bisection forest, in depth-first order, the number of internal nodes
  /// of its child 0. A leaf has none, and a subtree has one leaf more than internal nodes. So this number gives the
  /// start of both children's nodes and leaves.
  std::vector<std::uint32_t> tree;
  std::array<RootEntry, 25> roots{};  ///< 24 and an end mark
  std::uint32_t levels = 0;           ///< deepest bisection level of a cell; the roots are level 0
  float density_unit = 1.0F;          ///< grid value of a record's density 1
  ChannelRecords channels;
  /// One per cell, packed as pack_fit(): half of the change of mean and gradient from shutter open to close. The record
  /// has the value halfway between. Empty if nothing changes.
  std::vector<glm::uvec2> change;
  /// Per cell: the density between voxels in a sixth of a cell of eight voxels, as eight half floats (CellCorners); 0
  /// in larger cells. Empty unless the cells are trilinear.
  std::vector<glm::uvec4> corners;
  glm::vec3 content_min{0.0F};  ///< cube-space bounds of all cells with density or emission
  glm::vec3 content_max{0.0F};
  bool limited = false;  ///< max_cells ended the refinement

  [[nodiscard]] std::uint64_t bytes() const {
    return cells.size() * sizeof(CellRecord) + channels.bytes() + change.size() * 8 + corners.size() * 16 +
           tree.size() * 4 + 200;
  }
};

/// Returns the cell that holds p (cube space); on a face, edge or vertex it is one of the cells that share it. CM_NONE
/// outside the cube.
std::uint32_t locate(const TetGrid& grid, const glm::vec3& p);

}  // namespace cumulet::grid
