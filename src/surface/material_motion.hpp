#pragma once

// Private to surface/: materials and lights in glTF's own terms, as animations move them (KHR_animation_pointer).

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
  transmission
};
constexpr std::size_t texture_slots = 10;

/// A material's use of a texture.
TextureUse& use_of(Material& material, TextureSlot slot);

/// A material with what Material has folded into products.
struct MovableMaterial {
  Material now;
  glm::vec3 emissive_factor{0.0F};
  float emissive_strength = 1.0F;
  std::array<TextureTransform, texture_slots> transforms;
};

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
/// and what decides of a pass or of a mesh's tangents (transmission, clearcoat, a normal map's rotation and scale).
std::optional<Member<MovableMaterial>> material_member(std::string_view path);
/// The same below a light.
std::optional<Member<MovableLight>> light_member(std::string_view path);

}  // namespace cumulet::surface::detail
