#pragma once

// Private to surface/: the scene that imports create.

#include <utility>

#include "surface/meshes.hpp"
#include "surface/rig.hpp"
#include "surface/scene.hpp"

namespace cumulet::surface::detail {

/// A part under a node: the Draw of the same index.
struct Instance {
  std::size_t part = 0;
  std::uint32_t node = 0;
  std::uint32_t first_vertex = 0;
  std::int32_t skin = -1;
  bool in_prototype = false;  ///< posed in its node's space
  glm::dvec3 origin{0.0};     ///< of a prototype, in that space: vertices are relative to it
};

/// Instance transforms of a prototype, in the space of its node.
struct PrototypeInstances {
  std::uint32_t node = 0;
  std::vector<glm::dmat4> in_node;
  glm::dvec3 origin{0.0};  ///< in that space: vertices are relative to it
};

/// A light under a node.
struct LightInstance {
  std::uint32_t node = 0;
  std::uint32_t light = 0;  ///< its index in the file
  MovableLight at_rest;
};

class PosableScene final : public Scene {
 public:
  Rig rig;
  std::vector<MeshPart> parts;
  std::vector<Instance> instances;
  std::vector<PrototypeInstances> prototype_instances;  ///< one per prototype
  std::vector<MovableMaterial> movable;                 ///< animatable materials; empty: no animation changes any
  std::vector<LightInstance> lights;
  std::vector<std::pair<std::uint32_t, SceneCamera>> cameras;  ///< with their nodes

  /// Adds a draw of a part under a node; skin: index, negative: none. Throws Error(file) for too many vertices, and
  /// Error(cancelled).
  void add_instance(std::size_t part, std::uint32_t node, std::int32_t skin, const Progress* progress = nullptr);
  /// Must be called after the last instance; frees data that only add_instance() needed. Throws Error(file) if
  /// transforms or positions are too large to be multiplied.
  void finish();

  [[nodiscard]] Pose pose(double time, std::size_t animation, const Progress* progress) const override;
  [[nodiscard]] bool may_move(std::size_t animation) const override;
  [[nodiscard]] std::optional<PoseEnds> pose_ends(double time, std::size_t animation, double seconds,
                                                  const Progress* progress) const override;

 private:
  /// drift: seconds of motion by vertex velocities. origin: of the pose; nullopt: the one of this time.
  [[nodiscard]] Pose pose(double time, std::size_t animation, double drift, const std::optional<glm::dvec3>& origin,
                          const Progress* progress) const;
  /// Returns the looped time within an animation and its track. If there is no such animation, the track is null.
  [[nodiscard]] std::pair<double, const Track*> moment(double time, std::size_t animation) const;
  /// Returns the origin for posed vertices, near the middle of all. It is 0 for a scene near the world's origin.
  [[nodiscard]] glm::dvec3 origin_of(const Stance& now) const;
  /// Gives prototypes with vertices far from their space's origin an origin near them.
  void find_origins_of_prototypes();
  /// Computes the bounds of all visible triangles.
  void bound(Pose& pose) const;
  /// Applies animated materials and lights.
  void move(const Track& track, double time, Pose& pose, std::vector<LightInstance>& lights_now) const;
  /// Returns the world transforms of each prototype's instances. Transforms that flatten space are left out.
  [[nodiscard]] std::vector<std::vector<glm::dmat4>> find_prototype_transforms(const Stance& now) const;
  /// Poses an instance; returns true if the instance mirrors.
  bool pose_instance(const Instance& instance, const Stance& now, double drift, Pose& pose,
                     const Progress* progress) const;
  /// Matrix: a float matrix for an origin of 0, else a double matrix. side: -1 for mirrored instances.
  template <class Matrix>
  void pose_vertices(const Instance& instance, const Stance& now, double drift, float side, Pose& pose,
                     const Progress* progress) const;
};

}  // namespace cumulet::surface::detail
