#pragma once

// Private to surface/: materials and lights in glTF's own parameters, which animations change (KHR_animation_pointer).

#include <algorithm>
#include <array>
#include <functional>
#include <glm/glm.hpp>
#include <optional>
#include <span>
#include <string_view>

#include "surface/scene.hpp"

namespace cumulet::surface::detail {

/// Converts to float; clamps values that are too large.
float narrow(double value);

/// KHR_texture_transform.
struct TextureTransform {
  glm::dvec2 offset{0.0};
  double rotation = 0.0;  ///< radians
  glm::dvec2 scale{1.0};

  /// Returns T * R * S, as the extension defines.
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

/// Returns a material's use of a texture.
TextureUse& use_of(Material& material, TextureSlot slot);

/// A material with the separate factors whose products Material stores.
struct MovableMaterial {
  Material now;
  glm::vec3 emissive_factor{0.0F};
  float emissive_strength = 1.0F;
  float attenuation_distance = 0.0F;  ///< meters; 0, or beyond the limit of narrow(): no absorption
  glm::vec3 attenuation_color{1.0F};
  std::array<TextureTransform, texture_slots> transforms;
};

/// Clamp the index and the thickness (nanometers) of a film to the range in which its phases are finite.
inline float film_ior(float ior) { return std::clamp(ior, 1.0F, 1e4F); }
inline float film_thickness(float thickness) { return std::clamp(thickness, 0.0F, 1e9F); }

/// Computes `now.absorption` from the attenuation.
void fold_absorption(MovableMaterial& material);

/// A light with the separate factors whose product PunctualLight stores.
struct MovableLight {
  PunctualLight now;
  glm::vec3 color{1.0F};
  float intensity = 1.0F;
};

/// A member of `width` numbers and its setter. Numbers out of glTF's range are clamped.
template <class Thing>
struct Member {
  std::size_t width = 1;
  std::function<void(Thing&, std::span<const float>)> set;
};

/// Returns the member that a JSON pointer below a material names. Returns nullopt for members that animations do not
/// change here: textures themselves, and members that select a pass or a mesh's tangents. These are transmission,
/// thickness, clearcoat, anisotropy strength, and a normal map's rotation and scale.
std::optional<Member<MovableMaterial>> material_member(std::string_view path);
/// Returns the member that a JSON pointer below a light names.
std::optional<Member<MovableLight>> light_member(std::string_view path);

}  // namespace cumulet::surface::detail
