#pragma once

// Private to surface/: KHR_materials_pbrSpecularGlossiness as the metallic-roughness material that looks like it.

#include <glm/glm.hpp>
#include <optional>

#include "surface/gltf_file.hpp"
#include "surface/scene.hpp"

namespace cumulet::surface::detail {

/// Linear values of one place.
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

/// As Khronos' example of a conversion has it ("Convert between workflows", in the extension's text): metallic so that
/// a dielectric of 4 % and a metal together are as bright as both colours are; what no such mixture is comes near.
MetallicRoughness convert(const SpecularGlossiness& from);

/// What textures become: sRGB base colour with alpha, and linear roughness in G and metallic in B.
struct ConvertedImages {
  Image base_color;
  Image metallic_roughness;
};

/// Texel by texel, factors times texels, at the larger of the two sizes, the other one bilinearly; an image that is not
/// there is 1 everywhere. At least one is. Takes its memory of the budget; throws Error(file), Error(cancelled).
ConvertedImages convert(const SpecularGlossiness& factors, const std::optional<Image>& diffuse,
                        const std::optional<Image>& specular_glossiness, Budget& budget);

}  // namespace cumulet::surface::detail
