#pragma once

// Checks what src/surface/scene.hpp guarantees for every scene and pose, whatever the file contained.

#include <cmath>
#include <string>

#include "surface/scene.hpp"

namespace cumulet::test {

inline bool finite(const glm::vec3& v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }
inline bool unit(const glm::vec3& v) { return finite(v) && std::abs(glm::length(v) - 1.0F) < 1e-3F; }

/// Returns a description of the first violation, "" if there is none.
inline std::string broken(const surface::Scene& scene, const surface::Material& m) {
  for (const surface::TextureUse* use :
       {&m.base_color_texture, &m.metallic_roughness_texture, &m.normal_texture, &m.occlusion_texture,
        &m.emission_texture, &m.specular_texture, &m.specular_color_texture, &m.clearcoat_texture,
        &m.clearcoat_roughness_texture, &m.transmission_texture, &m.sheen_color_texture, &m.sheen_roughness_texture,
        &m.anisotropy_texture, &m.iridescence_texture, &m.film_thickness_texture}) {
    if (use->texture < -1 || use->texture >= static_cast<std::int32_t>(scene.textures.size()) || use->uv_set > 1) {
      return "a texture use is out of range";
    }
    for (int c = 0; c < 3; ++c) {
      if (!std::isfinite(use->transform[c].x) || !std::isfinite(use->transform[c].y))
        return "a transform is not finite";
    }
  }
  const float numbers[] = {m.base_color.a,        m.metallic,    m.roughness,  m.normal_scale,    m.alpha_cutoff,
                           m.occlusion_strength,  m.ior,         m.specular,   m.clearcoat,       m.clearcoat_roughness,
                           m.transmission,        m.thickness,   m.dispersion, m.sheen_roughness, m.anisotropy,
                           m.anisotropy_rotation, m.iridescence, m.film_ior,   m.film_thinnest,   m.film_thickest};
  for (const float number : numbers) {
    if (!std::isfinite(number)) return "a material is not finite";
  }
  if (!finite(glm::vec3(m.base_color)) || !finite(m.emission) || !finite(m.specular_color) || !finite(m.absorption) ||
      !finite(m.sheen_color)) {
    return "a colour is not finite";
  }
  return "";
}

inline std::string broken(const surface::Scene& scene) {
  if (scene.materials.empty()) return "no material";
  if (scene.indices.size() % 3 != 0) return "indices are not triangles";
  for (const std::uint32_t index : scene.indices) {
    if (index >= scene.attributes.size()) return "an index is out of range";
  }
  for (const surface::Draw& draw : scene.draws) {
    if (draw.index_count % 3 != 0 || draw.first_index > scene.indices.size() ||
        draw.index_count > scene.indices.size() - draw.first_index) {
      return "a draw is out of range";
    }
    if (draw.material >= scene.materials.size()) return "a draw's material is out of range";
  }
  for (const surface::Variant& variant : scene.variants) {
    if (variant.materials.size() != scene.draws.size()) return "a variant lacks draws";
    for (const std::uint32_t material : variant.materials) {
      if (material >= scene.materials.size()) return "a variant's material is out of range";
    }
  }
  for (const surface::Texture& texture : scene.textures) {
    if (texture.image >= scene.images.size()) return "a texture's image is out of range";
  }
  for (const surface::Image& image : scene.images) {
    if (image.width == 0 || image.height == 0) return "an image has no pixels";
    if (image.rgba.size() != std::size_t{4} * image.width * image.height) return "an image is of another size";
  }
  for (const surface::Material& m : scene.materials) {
    if (const std::string what = broken(scene, m); !what.empty()) return what;
  }
  for (const surface::VertexAttributes& a : scene.attributes) {
    if (!finite(glm::vec3(a.uv[0], a.uv[1].x)) || !std::isfinite(a.uv[1].y)) return "a coordinate is not finite";
    if (!finite(glm::vec3(a.color)) || !std::isfinite(a.color.a)) return "a vertex colour is not finite";
  }
  for (const surface::Animation& animation : scene.animations) {
    if (!(animation.duration >= 0.0) || !std::isfinite(animation.duration)) return "a duration is not one";
  }
  return "";
}

inline std::string broken(const surface::Scene& scene, const surface::Pose& pose) {
  if (pose.vertices.size() != scene.attributes.size()) return "a pose lacks vertices";
  if (pose.flipped.size() != scene.draws.size()) return "a pose lacks draws";
  if (!pose.hidden.empty() && pose.hidden.size() != scene.draws.size()) return "a pose lacks draws";
  if (!pose.materials.empty() && pose.materials.size() != scene.materials.size()) return "a pose lacks materials";
  for (const surface::Material& m : pose.materials) {
    if (const std::string what = broken(scene, m); !what.empty()) return what;
  }
  if (pose.prototype_transforms.size() != scene.prototypes.size())
    return "there are not as many placings as prototypes";
  for (const std::vector<glm::dmat4>& transforms : pose.prototype_transforms) {
    for (const glm::dmat4& transform : transforms) {
      if (!(std::abs(glm::determinant(glm::dmat3(transform))) > 0.0)) return "a placing is flat";
    }
  }
  for (std::size_t d = 0; d < scene.draws.size(); ++d) {
    const surface::Draw& draw = scene.draws[d];
    const auto has_map = [&](std::uint32_t m) {
      return scene.materials[m].normal_texture.texture >= 0 || scene.materials[m].anisotropy > 0.0F;
    };
    bool mapped = has_map(draw.material);
    for (const surface::Variant& variant : scene.variants) mapped = mapped || has_map(variant.materials[d]);
    for (std::size_t i = draw.first_index; i < std::size_t{draw.first_index} + draw.index_count; ++i) {
      const surface::PosedVertex& v = pose.vertices[scene.indices[i]];
      if (!finite(v.position)) return "a position is not finite";
      for (int c = 0; c < 3 && !surface::is_hidden(pose, d) && d < scene.first_prototype_draw(); ++c) {
        const double coordinate = pose.origin[c] + double{v.position[c]};
        if (coordinate < pose.low[c] || coordinate > pose.high[c]) return "a position is out of bounds";
      }
      if (!unit(v.normal)) return "a normal is not of unit length";
      const glm::vec3 tangent(v.tangent);
      if (mapped ? !unit(tangent) || std::abs(v.tangent.w) != 1.0F || std::abs(glm::dot(tangent, v.normal)) > 1e-3F
                 : v.tangent != glm::vec4(0.0F)) {
        return "a tangent is none";
      }
    }
  }
  for (const surface::PunctualLight& light : pose.lights) {
    if (!finite(light.position) || !unit(light.direction) || !finite(light.intensity)) return "a light is not finite";
  }
  for (const surface::SceneCamera& camera : pose.cameras) {
    for (int n = 0; n < 16; ++n) {
      if (!std::isfinite(camera.to_world[n / 4][n % 4])) return "a camera is not finite";
    }
  }
  return "";
}

}  // namespace cumulet::test
