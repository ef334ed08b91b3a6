#pragma once

// Private to surface/: what moves a scene: nodes, skins and animations.

#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>
#include <span>

#include "surface/gltf_file.hpp"
#include "surface/material_motion.hpp"
#include "surface/scene.hpp"

namespace cumulet::surface::detail {

struct Node {
  std::int32_t parent = -1;
  std::optional<glm::dmat4> matrix;  ///< instead of the three that follow
  glm::dvec3 translation{0.0};
  glm::dquat rotation{1.0, 0.0, 0.0, 0.0};
  glm::dvec3 scale{1.0};
  std::vector<float> weights;  ///< of the morph targets of its mesh, as they rest
  bool visible = true;         ///< as it rests; an invisible one hides what descends from it
};

struct Skin {
  std::vector<std::uint32_t> joints;
  std::vector<glm::mat4> inverse_bind;  ///< as many
};

enum class Interpolation : std::uint8_t { linear, step, cubic_spline };
enum class Property : std::uint8_t { translation, rotation, scale, weights, visibility, material, light };

/// glTF 2.0, 3.11 and appendix C.
struct Channel {
  std::uint32_t target = 0;  ///< the number of a node, of a material or of a light
  Property property = Property::translation;
  Interpolation interpolation = Interpolation::linear;
  std::size_t width = 3;  ///< numbers a key
  std::vector<float> times;
  std::vector<float> values;            ///< a key: its value, or in-tangent, value and out-tangent
  Member<MovableMaterial> of_material;  ///< of Property::material
  Member<MovableLight> of_light;        ///< of Property::light
};

struct Track {
  double duration = 0.0;
  std::vector<Channel> channels;
};

/// Values of a channel at a time, `width` numbers; before the first key and after the last one, theirs. A rotation is
/// interpolated along the sphere and of unit length.
void sample(const Channel& channel, double time, std::span<float> to);

struct Rig {
  std::vector<Node> nodes;
  std::vector<std::uint32_t> order;      ///< of nodes, parents first
  std::vector<std::uint32_t> displayed;  ///< nodes of the file's scene, in its order
  std::vector<bool> hidden;              ///< a node each: nothing shows it at any time, itself or what is above it
  std::vector<Skin> skins;
  std::vector<Track> tracks;
};

/// Nodes, skins and animations, checked: no cycles, no node with two parents. Fills scene.animations. Throws
/// Error(file).
Rig import_rig(const GltfFile& file, const Log& log, const std::string& name, Budget& budget, Progress* progress,
               Scene& scene);

/// Of all nodes at a time.
struct Stance {
  std::vector<glm::dmat4> to_world;
  std::vector<bool> visible;  ///< with all that they descend from
  std::vector<std::vector<float>> weights;
};

/// The scene `time` seconds into a track, or at rest without one.
Stance stance(const Rig& rig, const Track* track, double time);

}  // namespace cumulet::surface::detail
