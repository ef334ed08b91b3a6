#pragma once

// Private to surface/: what import_gltf() makes.

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
};

class PosableScene final : public Scene {
 public:
  Rig rig;
  std::vector<MeshPart> parts;
  std::vector<Instance> instances;
  std::vector<std::pair<std::uint32_t, PunctualLight>> lights;  ///< with their nodes
  std::vector<std::pair<std::uint32_t, SceneCamera>> cameras;

  [[nodiscard]] Pose pose(double time, std::size_t animation) const override;

 private:
  /// True if the instance mirrors.
  bool place(const Instance& instance, const Stance& now, Pose& pose) const;
};

}  // namespace cumulet::surface::detail
