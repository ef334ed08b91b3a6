#pragma once

// Private to surface/: what imports make.

#include <utility>

#include "surface/meshes.hpp"
#include "surface/rig.hpp"
#include "surface/scene.hpp"

namespace cumulet::surface::detail {

/// A part under a node: the Draw of the same number.
struct Instance {
  std::size_t part = 0;
  std::uint32_t node = 0;
  std::uint32_t first_vertex = 0;
  std::int32_t skin = -1;
  bool in_prototype = false;  ///< posed in its node's space
  glm::dvec3 origin{0.0};     ///< of a prototype, there: its vertices count from it
};

/// Where a prototype is shown, in the space of its node.
struct Placings {
  std::uint32_t node = 0;
  std::vector<glm::dmat4> in_node;
  glm::dvec3 origin{0.0};  ///< there: the vertices count from it
};

/// A light under a node.
struct PlacedLight {
  std::uint32_t node = 0;
  std::uint32_t light = 0;  ///< its number in the file
  MovableLight at_rest;
};

class PosableScene final : public Scene {
 public:
  Rig rig;
  std::vector<MeshPart> parts;
  std::vector<Instance> instances;
  std::vector<Placings> placings;        ///< a prototype each
  std::vector<MovableMaterial> movable;  ///< the materials; empty: no animation moves any
  std::vector<PlacedLight> lights;
  std::vector<std::pair<std::uint32_t, SceneCamera>> cameras;  ///< with their nodes

  /// A draw of a part under a node, moved by a skin if that is not below 0. Throws Error(file) for too many vertices,
  /// Error(cancelled).
  void add_instance(std::size_t part, std::uint32_t node, std::int32_t skin, const Progress* progress = nullptr);
  /// After the last instance: drops what only they needed. Throws Error(file) where transforms or positions are too
  /// large to be multiplied.
  void finish();

  [[nodiscard]] Pose pose(double time, std::size_t animation, const Progress* progress) const override;
  [[nodiscard]] bool may_move(std::size_t animation) const override;
  [[nodiscard]] std::optional<PoseEnds> pose_ends(double time, std::size_t animation, double seconds,
                                                  const Progress* progress) const override;

 private:
  /// drift: seconds, for which parts have gone by their velocities.
  /// origin: nothing: that of this moment.
  [[nodiscard]] Pose pose(double time, std::size_t animation, double drift, const std::optional<glm::dvec3>& origin,
                          const Progress* progress) const;
  /// The moment of an animation that a time means; nothing beside it: there is no such animation.
  [[nodiscard]] std::pair<double, const Track*> moment(double time, std::size_t animation) const;
  /// The point that vertices shall count from, near the middle of all. 0 for a scene near the world's origin.
  [[nodiscard]] glm::dvec3 origin_of(const Stance& now) const;
  /// Gives prototypes whose vertices are far from their space's origin one that is near.
  void find_origins_of_prototypes();
  /// Of what is there.
  void bound(Pose& pose) const;
  /// Materials and lights.
  void move(const Track& track, double time, Pose& pose, std::vector<PlacedLight>& lights_now) const;
  /// Where each prototype's draws are shown; those that are flat nowhere.
  [[nodiscard]] std::vector<std::vector<glm::dmat4>> place_prototypes(const Stance& now) const;
  /// True if the instance mirrors.
  bool place(const Instance& instance, const Stance& now, double drift, Pose& pose, const Progress* progress) const;
  /// Matrix: of floats near the origin, else of doubles. side: -1 where it mirrors.
  template <class Matrix>
  void place_vertices(const Instance& instance, const Stance& now, double drift, float side, Pose& pose,
                      const Progress* progress) const;
};

}  // namespace cumulet::surface::detail
