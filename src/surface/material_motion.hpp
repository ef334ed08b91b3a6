#pragma once

// Private to surface/: materials and lights in glTF's own terms, as animations move them (KHR_animation_pointer).

#include <algorithm>
#include <array>
#include <functional>
#include <glm/glm.hpp>
#include <optional>
#include <span>
#include <string_view>

#include "surface/scene.hpp"

namespace cumulet::surface::detail {

/// KHR_texture_transform.
struct TextureTransform {
  glm::dvec2 offset{0.0};
  double rotation = 0.0;  ///< radians
  glm::dvec2 scale{1.0};

  /// T * R * S, as the extension says it.
  [[nodiscard]] glm::mat3x2 matrix() const;
};

enum class TextureSlot : std::uint8_t {
  base_color,
  metallic_roughness,
  normal,
  occlusion,
  emission,
  specular,
  specular_color,
  clearcoat,
  clearcoat_roughness,
  transmission,
  sheen_color,
  sheen_roughness,
  anisotropy,
  iridescence,
  film_thickness
};
constexpr std::size_t texture_slots = 15;

/// A material's use of a texture.
TextureUse& use_of(Material& material, TextureSlot slot);

/// A material with what Material has folded into products.
struct MovableMaterial {
  Material now;
  glm::vec3 emissive_factor{0.0F};
  float emissive_strength = 1.0F;
  float attenuation_distance = 0.0F;  ///< metres; 0 and beyond what narrow() keeps: nothing is absorbed
  glm::vec3 attenuation_color{1.0F};
  std::array<TextureTransform, texture_slots> transforms;
};

/// An index and a thickness (nanometres) of a film, in the range in which its phases are numbers.
inline float film_ior(float ior) { return std::clamp(ior, 1.0F, 1e4F); }
inline float film_thickness(float thickness) { return std::clamp(thickness, 0.0F, 1e9F); }

/// Makes the absorption of what attenuates.
void fold_absorption(MovableMaterial& material);

/// Likewise.
struct MovableLight {
  PunctualLight now;
  glm::vec3 color{1.0F};
  float intensity = 1.0F;
};

/// A member of `width` numbers, and how it is given others; numbers out of glTF's range become the nearest in it.
template <class Thing>
struct Member {
  std::size_t width = 1;
  std::function<void(Thing&, std::span<const float>)> set;
};

/// What a JSON pointer below a material leads to; nothing for what animations do not move here: textures themselves,
/// and what decides of a pass or of a mesh's tangents (transmission, thickness, clearcoat, the strength of anisotropy,
/// a normal map's rotation and scale).
std::optional<Member<MovableMaterial>> material_member(std::string_view path);
/// The same below a light.
std::optional<Member<MovableLight>> light_member(std::string_view path);

}  // namespace cumulet::surface::detail
