#pragma once

// Private to surface/: converts KHR_materials_pbrSpecularGlossiness to a similar metallic-roughness material.

#include <glm/glm.hpp>
#include <optional>

#include "surface/gltf_file.hpp"
#include "surface/scene.hpp"

namespace cumulet::surface::detail {

/// Linear values at one texel.
struct SpecularGlossiness {
  glm::vec4 diffuse{1.0F};
  glm::vec3 specular{1.0F};
  float glossiness = 1.0F;
};
struct MetallicRoughness {
  glm::vec4 base_color{1.0F};
  float metallic = 1.0F;
  float roughness = 1.0F;
};

/// Converts as in Khronos' example ("Convert between workflows", in the extension's text). Metallic is chosen so that a
/// mixture of a 4 % dielectric and a metal is as bright as both colors. Colors that no such mixture has are
/// approximated.
MetallicRoughness convert(const SpecularGlossiness& from);

/// Converted textures: sRGB base color with alpha; linear roughness in G and metallic in B.
struct ConvertedImages {
  Image base_color;
  Image metallic_roughness;
};

/// Converts texel by texel, factors times texels, at the larger of the two sizes. The smaller image is sampled
/// bilinearly; an absent image is 1 everywhere. At least one image must be present. Uses the budget for its memory.
/// Throws Error(file) and Error(cancelled).
ConvertedImages convert(const SpecularGlossiness& factors, const std::optional<Image>& diffuse,
                        const std::optional<Image>& specular_glossiness, Budget& budget);

}  // namespace cumulet::surface::detail
