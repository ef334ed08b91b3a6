#pragma once

// Private to surface/: nodes, skins and animations of a scene.

#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>
#include <span>

#include "surface/gltf_file.hpp"
#include "surface/material_motion.hpp"
#include "surface/scene.hpp"

namespace cumulet::surface::detail {

struct Node {
  std::int32_t parent = -1;
  std::optional<glm::dmat4> matrix;  ///< replaces translation, rotation and scale
  glm::dvec3 translation{0.0};
  glm::dquat rotation{1.0, 0.0, 0.0, 0.0};
  glm::dvec3 scale{1.0};
  std::vector<float> weights;  ///< of its mesh's morph targets, at rest
  bool visible = true;         ///< at rest; an invisible node hides its descendants
};

struct Skin {
  std::vector<std::uint32_t> joints;
  std::vector<glm::mat4> inverse_bind;  ///< one per joint
};

enum class Interpolation : std::uint8_t { linear, step, cubic_spline };
enum class Property : std::uint8_t { translation, rotation, scale, weights, visibility, material, light };

/// glTF 2.0, 3.11 and appendix C.
struct Channel {
  std::uint32_t target = 0;  ///< index of a node, material or light
  Property property = Property::translation;
  Interpolation interpolation = Interpolation::linear;
  std::size_t width = 3;  ///< numbers per key
  std::vector<float> times;
  std::vector<float> values;            ///< per key: its value, or in-tangent, value and out-tangent
  Member<MovableMaterial> of_material;  ///< for Property::material
  Member<MovableLight> of_light;        ///< for Property::light
};

struct Track {
  double duration = 0.0;
  std::vector<Channel> channels;
};

/// Writes a channel's values at a time, `width` numbers. Before the first key and after the last one the values are
/// constant. Rotations are interpolated spherically and have unit length.
void sample(const Channel& channel, double time, std::span<float> to);

struct Rig {
  std::vector<Node> nodes;
  std::vector<std::uint32_t> order;      ///< of nodes, parents first
  std::vector<std::uint32_t> displayed;  ///< nodes of the file's scene, in its order
  std::vector<bool> hidden;              ///< per node: never visible, because of itself or an ancestor
  std::vector<Skin> skins;
  std::vector<Track> tracks;
};

/// Imports nodes, skins and animations. Rejects cycles and nodes with two parents. Fills scene.animations. Throws
/// Error(file).
Rig import_rig(const GltfFile& file, const Log& log, const std::string& name, Budget& budget, Progress* progress,
               Scene& scene);

/// State of all nodes at one time.
struct Stance {
  std::vector<glm::dmat4> to_world;
  std::vector<bool> visible;  ///< including the visibility of its ancestors
  std::vector<std::vector<float>> weights;
};

/// Returns the state `time` seconds into a track; without a track at rest.
Stance stance(const Rig& rig, const Track* track, double time);

}  // namespace cumulet::surface::detail
