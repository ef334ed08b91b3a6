#pragma once

// The contents of a glTF 2.0 file as plain arrays. The import checks them once: there are no indices out of range, no
// NaNs and no cycles. Does not use GL.

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <glm/gtc/matrix_transform.hpp>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/file_path.hpp"
#include "base/log.hpp"
#include "base/progress.hpp"

namespace cumulet::surface {

/// Eight bits per channel, rows from the top, straight alpha. The use of the image determines whether it is sRGB (glTF
/// 2.0, 3.9).
struct Image {
  std::string name;
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  std::vector<std::uint8_t> rgba;
};

enum class Wrap : std::uint8_t { repeat, mirrored, clamp };
enum class Filter : std::uint8_t { nearest, linear };

struct Sampler {
  Wrap wrap_s = Wrap::repeat;
  Wrap wrap_t = Wrap::repeat;
  Filter magnify = Filter::linear;
  Filter minify = Filter::linear;
  bool mipmaps = true;
  Filter between_mipmaps = Filter::linear;
};

struct Texture {
  std::uint32_t image = 0;
  Sampler sampler;
};

/// A material's use of a texture; KHR_texture_transform is folded in: uv' = transform * (uv, 1).
struct TextureUse {
  std::int32_t texture = -1;  ///< -1: none
  std::uint32_t uv_set = 0;   ///< 0 or 1
  glm::mat3x2 transform{1.0F, 0.0F, 0.0F, 1.0F, 0.0F, 0.0F};
  bool operator==(const TextureUse&) const = default;
};

enum class AlphaMode : std::uint8_t { opaque, mask, blend };

/// Metallic-roughness material (glTF 2.0, 3.9 and appendix B) with the extensions that Cumulet reads. Colors are
/// linear.
struct Material {
  std::string name;
  glm::vec4 base_color{1.0F};
  TextureUse base_color_texture;
  float metallic = 1.0F;
  float roughness = 1.0F;
  TextureUse metallic_roughness_texture;  ///< B metallic, G roughness
  TextureUse normal_texture;
  float normal_scale = 1.0F;
  TextureUse occlusion_texture;  ///< R
  float occlusion_strength = 1.0F;
  glm::vec3 emission{0.0F};  ///< emissiveFactor times KHR_materials_emissive_strength
  TextureUse emission_texture;
  AlphaMode alpha_mode = AlphaMode::opaque;
  float alpha_cutoff = 0.5F;
  bool double_sided = false;
  bool unlit = false;
  float ior = 1.5F;
  float specular = 1.0F;
  TextureUse specular_texture;  ///< A
  glm::vec3 specular_color{1.0F};
  TextureUse specular_color_texture;
  float clearcoat = 0.0F;
  TextureUse clearcoat_texture;  ///< R
  float clearcoat_roughness = 0.0F;
  TextureUse clearcoat_roughness_texture;  ///< G
  float transmission = 0.0F;
  TextureUse transmission_texture;  ///< R
  float thickness = 0.0F;  ///< meters; 0: thin wall; else the triangles bound a volume, and previews use this thickness
  glm::vec3 absorption{0.0F};  ///< of that volume, per meter in world space
  float dispersion = 0.0F;     ///< 20 / Abbe number, of that volume
  glm::vec3 sheen_color{0.0F};
  TextureUse sheen_color_texture;
  float sheen_roughness = 0.0F;
  TextureUse sheen_roughness_texture;  ///< A
  float anisotropy = 0.0F;             ///< strength, along the tangent
  float anisotropy_rotation = 0.0F;    ///< radians, from the tangent to the bitangent
  TextureUse anisotropy_texture;       ///< RG direction, B strength
  float iridescence = 0.0F;
  TextureUse iridescence_texture;  ///< R
  float film_ior = 1.3F;
  float film_thinnest = 100.0F;       ///< nanometers, where the texture is 0
  float film_thickest = 400.0F;       ///< nanometers, where the texture is 1, or without one
  TextureUse film_thickness_texture;  ///< G
  bool operator==(const Material&) const = default;
};

/// Returns true if the triangles are the boundary of a volume that light enters by transmission (KHR_materials_volume).
/// Both sides of such triangles are hit.
inline bool bounds_volume(const Material& m) { return m.transmission > 0.0F && m.thickness > 0.0F && !m.unlit; }
/// Returns true if rays may pass straight on through the triangles, because they are thin walls that transmit. The
/// fraction that passes is cm_bsdf_passes (glsl/surface/bsdf.glsl).
inline bool may_be_clear(const Material& m) { return m.transmission > 0.0F && !bounds_volume(m) && !m.unlit; }
/// The variants of the path tracer for materials. The values are those of CM_EXTENDED_BSDF (glsl/surface/ggx.glsl).
/// Each has all lobes of those before it.
enum class BsdfVariant : std::uint8_t { basic, extended, iridescent };
/// Returns the first variant that has all lobes of the material.
inline BsdfVariant bsdf_variant(const Material& m) {
  if (m.unlit) return BsdfVariant::basic;
  if (m.iridescence > 0.0F) return BsdfVariant::iridescent;
  const bool extended = m.transmission > 0.0F || m.sheen_color != glm::vec3(0.0F) || m.anisotropy > 0.0F;
  return extended ? BsdfVariant::extended : BsdfVariant::basic;
}

/// KHR_lights_punctual, in the scene's units: candela for point and spot lights, lux for directional ones. Cumulet
/// interprets both as radiant quantities (W/sr, W/m2).
struct PunctualLight {
  enum class Kind : std::uint8_t { directional, point, spot };
  Kind kind = Kind::point;
  glm::vec3 intensity{1.0F};  ///< color times intensity
  float range = 0.0F;         ///< 0: no limit
  float inner_cone = 0.0F;    ///< radians
  float outer_cone = 0.785398F;
  glm::vec3 position{0.0F};       ///< world; in a pose, relative to its origin
  glm::vec3 direction{0, 0, -1};  ///< world, in which it shines, unit
};

struct SceneCamera {
  std::string name;
  bool orthographic = false;
  double vertical_fov = 0.8;  ///< radians; for perspective
  double aspect = 0.0;        ///< 0: that of the window
  double near_plane = 0.1;
  double far_plane = 0.0;  ///< 0: infinite
  double height = 2.0;     ///< world units, for orthographic
  glm::dmat4 to_world{1.0};
};

/// Triangles of one material and one node, a range of Scene::indices.
struct Draw {
  std::uint32_t first_index = 0;
  std::uint32_t index_count = 0;  ///< a multiple of 3
  std::uint32_t material = 0;     ///< if no variant is chosen
  std::uint32_t node = 0;
};

/// Draws that a pose shows any number of times with instance transforms (EXT_mesh_gpu_instancing). Their vertices are
/// in their own space. They are consecutive in the draws and in the indices, in the order of the prototypes.
struct Prototype {
  std::uint32_t first_draw = 0;
  std::uint32_t draw_count = 0;
  std::uint32_t instance_count = 0;  ///< number of instances
};

/// Vertex attributes that do not move; all poses share them.
struct VertexAttributes {
  glm::vec2 uv[2] = {};
  glm::vec4 color{1.0F};  ///< linear
};

/// Vertex attributes that move, in world space relative to the pose's origin, or in the prototype's space.
struct PosedVertex {
  glm::vec3 position;
  glm::vec3 normal;         ///< unit
  glm::vec4 tangent{0.0F};  ///< unit; w: sign of the bitangent; 0 if the material needs no tangents
};

/// The scene at one time. Triangles wind counter-clockwise seen from their front, unless `flipped` is set. All values
/// are finite.
struct Pose {
  double time = 0.0;
  glm::dvec3 origin{0.0};             ///< world; vertices and lights are relative to it, to keep float precision far
                                      ///< from 0
  std::vector<PosedVertex> vertices;  ///< as many as Scene::attributes
  std::vector<std::uint8_t> flipped;  ///< per Draw: 1 if the node mirrors, so that the winding is clockwise
  std::vector<std::uint8_t> hidden;   ///< per Draw: 1 if it is not visible at this time; empty: all are visible
  std::vector<std::vector<glm::dmat4>> prototype_transforms;  ///< per Prototype: transforms to world space
  std::vector<Material> materials;                            ///< at this time; empty: those of the scene
  std::vector<std::uint32_t> chosen;  ///< per Draw: its material in the chosen variant; empty: the Draw's own
  bool double_sided = false;          ///< treat all materials as double sided
  std::vector<PunctualLight> lights;
  std::vector<SceneCamera> cameras;
  glm::dvec3 low{0.0};  ///< world bounds of all visible triangles
  glm::dvec3 high{0.0};
};

/// Returns a model's transform, applied to positions relative to the pose's origin.
inline glm::dmat4 from_origin(const glm::dmat4& to_world, const Pose& pose) {
  return to_world * glm::translate(glm::dmat4(1.0), pose.origin);
}

/// Poses at shutter open and shutter close.
struct PoseEnds {
  Pose open;
  Pose close;
};

struct Animation {
  std::string name;
  double duration = 0.0;  ///< seconds
};

/// A choice of materials (KHR_materials_variants).
struct Variant {
  std::string name;
  std::vector<std::uint32_t> materials;  ///< one per Draw
};

/// A checked glTF scene. Immutable, so any thread may pose it.
class Scene {
 public:
  virtual ~Scene() = default;

  std::vector<Image> images;
  std::vector<Texture> textures;
  std::vector<Material> materials;  ///< at least one
  std::vector<Draw> draws;          ///< in the order of the file, except that those of prototypes come last
  std::vector<Prototype> prototypes;
  std::vector<std::uint32_t> indices;
  std::vector<VertexAttributes> attributes;
  std::vector<Animation> animations;
  std::vector<Variant> variants;

  /// Counts of the file's contents, visible or not.
  struct Counts {
    std::uint32_t meshes = 0;
    std::uint32_t primitives = 0;
    std::uint32_t materials = 0;
    std::uint32_t textures = 0;
  };
  Counts counts;
  std::string precision_remark;  ///< one line about positions too far from 0 for float precision; empty: none

  [[nodiscard]] std::size_t triangle_count() const { return indices.size() / 3; }
  /// Counts a prototype's triangles once per instance.
  [[nodiscard]] std::uint64_t shown_triangles() const;
  /// Index of the first draw of a prototype.
  [[nodiscard]] std::size_t first_prototype_draw() const {
    return prototypes.empty() ? draws.size() : prototypes.front().first_draw;
  }

  /// Returns the scene `time` seconds into animation `animation` (looped past its end). Without such an animation it
  /// returns the scene at rest. Supports linear, step and cubic spline interpolation, skins and morph targets (glTF
  /// 2.0, 3.7.3, 3.7.2.2, 3.11). Throws Error(cancelled).
  [[nodiscard]] virtual Pose pose(double time, std::size_t animation = 0, const Progress* progress = nullptr) const = 0;

  /// Returns false if pose_ends() always returns nullopt.
  [[nodiscard]] virtual bool may_move(std::size_t /*animation*/) const { return false; }
  /// Returns the poses half of `seconds` before and after a time of the animation. Past its end the animation continues
  /// from its beginning if both poses agree. Otherwise the interval is clamped, so that nothing sweeps from the last
  /// pose to the first. Returns nullopt if the scene cannot move. Both poses are relative to the origin of pose() at
  /// that time. Throws Error(cancelled).
  [[nodiscard]] virtual std::optional<PoseEnds> pose_ends(double /*time*/, std::size_t /*animation*/,
                                                          double /*seconds*/,
                                                          const Progress* /*progress*/ = nullptr) const {
    return std::nullopt;
  }
};

inline std::uint64_t Scene::shown_triangles() const {
  std::uint64_t all = triangle_count();
  for (const Prototype& prototype : prototypes) {
    std::uint64_t own = 0;
    for (std::uint32_t i = 0; i < prototype.draw_count; ++i) own += draws[prototype.first_draw + i].index_count / 3;
    all = all - own + own * prototype.instance_count;
  }
  return all;
}

/// Returns the materials in a pose of the scene.
inline const std::vector<Material>& materials_of(const Scene& scene, const Pose& pose) {
  return pose.materials.empty() ? scene.materials : pose.materials;
}
/// Returns the index of a draw's material.
inline std::uint32_t material_of(const Scene& scene, const Pose& pose, std::size_t draw) {
  return pose.chosen.empty() ? scene.draws[draw].material : pose.chosen[draw];
}
/// Returns true if a draw is not visible in the pose.
inline bool is_hidden(const Pose& pose, std::size_t draw) { return !pose.hidden.empty() && pose.hidden[draw] != 0; }

using ScenePtr = std::shared_ptr<const Scene>;

/// Reads a .gltf or .glb. Throws Error(file), one line with the file and the cause, if the file cannot be read or is
/// malformed. Throws Error(unsupported) with the name of an unknown extension in extensionsRequired. Logs a warning for
/// extensions in extensionsUsed that are ignored. Checks `progress` (may be null) for cancellation.
ScenePtr import_gltf(const FilePath& path, const Log& log, Progress* progress = nullptr);

}  // namespace cumulet::surface
