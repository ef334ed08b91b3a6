#include "surface/material_motion.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace cumulet::surface::detail {

namespace {

using Numbers = std::span<const float>;
using MaterialMember = Member<MovableMaterial>;
using LightMember = Member<MovableLight>;

constexpr float right_angle = std::numbers::pi_v<float> / 2;

float unit(float value) { return narrow(std::clamp(value, 0.0F, 1.0F)); }
float positive(float value) { return narrow(std::max(value, 0.0F)); }
glm::vec3 color(Numbers v) { return {positive(v[0]), positive(v[1]), positive(v[2])}; }

struct Slot {
  std::string_view path;
  TextureUse Material::*use;
};

// In the order of TextureSlot.
constexpr std::array<Slot, texture_slots> slots = {{
    {"pbrMetallicRoughness/baseColorTexture", &Material::base_color_texture},
    {"pbrMetallicRoughness/metallicRoughnessTexture", &Material::metallic_roughness_texture},
    {"normalTexture", &Material::normal_texture},
    {"occlusionTexture", &Material::occlusion_texture},
    {"emissiveTexture", &Material::emission_texture},
    {"extensions/KHR_materials_specular/specularTexture", &Material::specular_texture},
    {"extensions/KHR_materials_specular/specularColorTexture", &Material::specular_color_texture},
    {"extensions/KHR_materials_clearcoat/clearcoatTexture", &Material::clearcoat_texture},
    {"extensions/KHR_materials_clearcoat/clearcoatRoughnessTexture", &Material::clearcoat_roughness_texture},
    {"extensions/KHR_materials_transmission/transmissionTexture", &Material::transmission_texture},
    {"extensions/KHR_materials_sheen/sheenColorTexture", &Material::sheen_color_texture},
    {"extensions/KHR_materials_sheen/sheenRoughnessTexture", &Material::sheen_roughness_texture},
    {"extensions/KHR_materials_anisotropy/anisotropyTexture", &Material::anisotropy_texture},
    {"extensions/KHR_materials_iridescence/iridescenceTexture", &Material::iridescence_texture},
    {"extensions/KHR_materials_iridescence/iridescenceThicknessTexture", &Material::film_thickness_texture},
}};

struct Factor {
  std::string_view path;
  std::size_t width;
  void (*set)(MovableMaterial&, Numbers);
};

void fold_emission(MovableMaterial& m) {
  for (int c = 0; c < 3; ++c) m.now.emission[c] = narrow(double{m.emissive_factor[c]} * m.emissive_strength);
}

constexpr Factor factors[] = {
    {"pbrMetallicRoughness/baseColorFactor", 4,
     [](MovableMaterial& m, Numbers v) { m.now.base_color = glm::vec4(color(v), unit(v[3])); }},
    {"pbrMetallicRoughness/metallicFactor", 1, [](MovableMaterial& m, Numbers v) { m.now.metallic = unit(v[0]); }},
    {"pbrMetallicRoughness/roughnessFactor", 1, [](MovableMaterial& m, Numbers v) { m.now.roughness = unit(v[0]); }},
    {"alphaCutoff", 1, [](MovableMaterial& m, Numbers v) { m.now.alpha_cutoff = positive(v[0]); }},
    {"normalTexture/scale", 1, [](MovableMaterial& m, Numbers v) { m.now.normal_scale = narrow(v[0]); }},
    {"occlusionTexture/strength", 1, [](MovableMaterial& m, Numbers v) { m.now.occlusion_strength = unit(v[0]); }},
    {"emissiveFactor", 3,
     [](MovableMaterial& m, Numbers v) {
       m.emissive_factor = color(v);
       fold_emission(m);
     }},
    {"extensions/KHR_materials_emissive_strength/emissiveStrength", 1,
     [](MovableMaterial& m, Numbers v) {
       m.emissive_strength = positive(v[0]);
       fold_emission(m);
     }},
    {"extensions/KHR_materials_ior/ior", 1,
     [](MovableMaterial& m, Numbers v) { m.now.ior = v[0] == 0.0F ? 0.0F : std::max(v[0], 1.0F); }},
    {"extensions/KHR_materials_specular/specularFactor", 1,
     [](MovableMaterial& m, Numbers v) { m.now.specular = unit(v[0]); }},
    {"extensions/KHR_materials_specular/specularColorFactor", 3,
     [](MovableMaterial& m, Numbers v) { m.now.specular_color = color(v); }},
    {"extensions/KHR_materials_clearcoat/clearcoatRoughnessFactor", 1,
     [](MovableMaterial& m, Numbers v) { m.now.clearcoat_roughness = unit(v[0]); }},
    {"extensions/KHR_materials_volume/attenuationDistance", 1,
     [](MovableMaterial& m, Numbers v) {
       m.attenuation_distance = positive(v[0]);
       fold_absorption(m);
     }},
    {"extensions/KHR_materials_volume/attenuationColor", 3,
     [](MovableMaterial& m, Numbers v) {
       m.attenuation_color = color(v);
       fold_absorption(m);
     }},
    {"extensions/KHR_materials_dispersion/dispersion", 1,
     [](MovableMaterial& m, Numbers v) { m.now.dispersion = positive(v[0]); }},
    {"extensions/KHR_materials_sheen/sheenColorFactor", 3,
     [](MovableMaterial& m, Numbers v) { m.now.sheen_color = glm::min(color(v), 1.0F); }},
    {"extensions/KHR_materials_sheen/sheenRoughnessFactor", 1,
     [](MovableMaterial& m, Numbers v) { m.now.sheen_roughness = unit(v[0]); }},
    {"extensions/KHR_materials_anisotropy/anisotropyRotation", 1,
     [](MovableMaterial& m, Numbers v) { m.now.anisotropy_rotation = narrow(v[0]); }},
    {"extensions/KHR_materials_iridescence/iridescenceFactor", 1,
     [](MovableMaterial& m, Numbers v) { m.now.iridescence = unit(v[0]); }},
    {"extensions/KHR_materials_iridescence/iridescenceIor", 1,
     [](MovableMaterial& m, Numbers v) { m.now.film_ior = film_ior(v[0]); }},
    {"extensions/KHR_materials_iridescence/iridescenceThicknessMinimum", 1,
     [](MovableMaterial& m, Numbers v) { m.now.film_thinnest = film_thickness(v[0]); }},
    {"extensions/KHR_materials_iridescence/iridescenceThicknessMaximum", 1,
     [](MovableMaterial& m, Numbers v) { m.now.film_thickest = film_thickness(v[0]); }},
};

/// Applies `change` to the slot's transform and updates the matrix of the texture use.
template <class Change>
MaterialMember transform_member(std::size_t slot, std::size_t width, const Change& change) {
  return {width, [slot, change](MovableMaterial& m, Numbers v) {
            change(m.transforms[slot], v);
            (m.now.*slots[slot].use).transform = m.transforms[slot].matrix();
          }};
}

}  // namespace

float narrow(double value) {
  // Products of a few such values are still finite floats.
  constexpr double most = 1e18;
  return static_cast<float>(std::clamp(value, -most, most));
}

glm::mat3x2 TextureTransform::matrix() const {
  const double cosine = std::cos(rotation);
  const double sine = std::sin(rotation);
  return {narrow(cosine * scale.x), narrow(-sine * scale.x), narrow(sine * scale.y),
          narrow(cosine * scale.y), narrow(offset.x),        narrow(offset.y)};
}

void fold_absorption(MovableMaterial& m) {
  // Beer-Lambert law: white light has the attenuation color after this distance.
  constexpr float darkest = 1e-30F;
  const float distance = m.attenuation_distance;
  for (int c = 0; c < 3; ++c) {
    const float left = std::clamp(m.attenuation_color[c], darkest, 1.0F);
    m.now.absorption[c] = distance > 0.0F ? narrow(-std::log(double{left}) / distance) : 0.0F;
  }
}

TextureUse& use_of(Material& material, TextureSlot slot) { return material.*slots[static_cast<std::size_t>(slot)].use; }

std::optional<MaterialMember> material_member(std::string_view path) {
  for (const Factor& factor : factors) {
    if (factor.path == path) return MaterialMember{factor.width, factor.set};
  }
  for (std::size_t slot = 0; slot < slots.size(); ++slot) {
    std::string_view rest = path;
    if (!rest.starts_with(slots[slot].path)) continue;
    rest.remove_prefix(slots[slot].path.size());
    constexpr std::string_view extension = "/extensions/KHR_texture_transform/";
    if (!rest.starts_with(extension)) continue;
    rest.remove_prefix(extension.size());
    if (rest == "offset") {
      return transform_member(slot, 2, [](TextureTransform& t, Numbers v) { t.offset = {v[0], v[1]}; });
    }
    // A mesh's tangents are computed for the map's transform at rest.
    if (slot == static_cast<std::size_t>(TextureSlot::normal)) return std::nullopt;
    if (rest == "rotation") {
      return transform_member(slot, 1, [](TextureTransform& t, Numbers v) { t.rotation = v[0]; });
    }
    if (rest == "scale") {
      return transform_member(slot, 2, [](TextureTransform& t, Numbers v) { t.scale = {v[0], v[1]}; });
    }
  }
  return std::nullopt;
}

std::optional<LightMember> light_member(std::string_view path) {
  const auto fold = [](MovableLight& l) { l.now.intensity = l.color * l.intensity; };
  if (path == "color") {
    return LightMember{3, [fold](MovableLight& l, Numbers v) {
                         l.color = color(v);
                         fold(l);
                       }};
  }
  if (path == "intensity") {
    return LightMember{1, [fold](MovableLight& l, Numbers v) {
                         l.intensity = positive(v[0]);
                         fold(l);
                       }};
  }
  if (path == "range") return LightMember{1, [](MovableLight& l, Numbers v) { l.now.range = positive(v[0]); }};
  if (path == "spot/outerConeAngle") {
    return LightMember{1, [](MovableLight& l, Numbers v) { l.now.outer_cone = std::clamp(v[0], 0.0F, right_angle); }};
  }
  if (path == "spot/innerConeAngle") {
    return LightMember{1, [](MovableLight& l, Numbers v) { l.now.inner_cone = std::clamp(v[0], 0.0F, right_angle); }};
  }
  return std::nullopt;
}

}  // namespace cumulet::surface::detail
