#pragma once

// Surface scenes built in code.

#include <cmath>
#include <memory>
#include <numbers>

#include "render/scene/model_data.hpp"
#include "support/meshes.hpp"

namespace cumulet::test {

/// A scene whose images are built in code too.
class TexturedScene : public surface::Scene {
 public:
  /// Adds a texture and returns its index.
  std::int32_t add_texture(std::uint32_t width, std::uint32_t height, std::vector<std::uint8_t> rgba,
                           surface::Sampler sampler = {}) {
    images.push_back({"by hand", width, height, std::move(rgba)});
    textures.push_back({static_cast<std::uint32_t>(images.size() - 1), sampler});
    return static_cast<std::int32_t>(textures.size() - 1);
  }
};

/// Triangles that do not move.
class StillScene : public TexturedScene {
 public:
  surface::Pose rest;
  [[nodiscard]] surface::Pose pose(double time, std::size_t /*animation*/,
                                   const cumulet::Progress* /*progress*/ = nullptr) const override {
    surface::Pose posed = rest;
    posed.time = time;
    return posed;
  }

  std::uint32_t add(const surface::Material& material) {
    materials.push_back(material);
    return static_cast<std::uint32_t>(materials.size() - 1);
  }
  /// Adds a quadrilateral, counter-clockwise seen from its front; uv 0,0 1,0 1,1 0,1.
  void add_quad(std::array<glm::vec3, 4> corners, std::uint32_t material) {
    const auto first = static_cast<std::uint32_t>(attributes.size());
    const glm::vec3 n = glm::normalize(glm::cross(corners[1] - corners[0], corners[2] - corners[0]));
    const std::array<glm::vec2, 4> uv{{{0, 0}, {1, 0}, {1, 1}, {0, 1}}};
    for (std::size_t i = 0; i < 4; ++i) {
      attributes.push_back({{uv[i], uv[i]}, glm::vec4(1.0F)});
      rest.vertices.push_back({corners[i], n, glm::vec4(0.0F)});
    }
    begin_draw(material);
    for (const std::uint32_t i : {0U, 1U, 2U, 0U, 2U, 3U}) indices.push_back(first + i);
    end_draw();
  }
  /// Adds a sphere of latitudes and longitudes.
  void add_sphere(glm::vec3 centre, float radius, std::uint32_t material, std::uint32_t rings = 24) {
    const auto first = static_cast<std::uint32_t>(attributes.size());
    const float pi = std::numbers::pi_v<float>;
    for (std::uint32_t i = 0; i <= rings; ++i) {
      for (std::uint32_t j = 0; j <= 2 * rings; ++j) {
        const float a = pi * float(i) / float(rings);
        const float b = pi * float(j) / float(rings);
        const glm::vec3 n(std::sin(a) * std::sin(b), std::cos(a), std::sin(a) * std::cos(b));
        attributes.push_back({{glm::vec2(b, a), glm::vec2(0.0F)}, glm::vec4(1.0F)});
        rest.vertices.push_back({centre + radius * n, n, glm::vec4(0.0F)});
      }
    }
    begin_draw(material);
    const std::uint32_t row = 2 * rings + 1;
    for (std::uint32_t i = 0; i < rings; ++i) {
      for (std::uint32_t j = 0; j + 1 < row; ++j) {
        const std::uint32_t at = first + i * row + j;
        for (const std::uint32_t k : {at, at + row, at + row + 1, at, at + row + 1, at + 1}) indices.push_back(k);
      }
    }
    end_draw();
  }
  /// Adds triangles. The normal of a vertex is the area-weighted mean of its triangles' normals.
  void add_mesh(const Mesh& mesh, std::uint32_t material) {
    const auto first = static_cast<std::uint32_t>(attributes.size());
    std::vector<glm::vec3> normals(mesh.vertices.size(), glm::vec3(0.0F));
    for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
      const glm::vec3 a = mesh.corner(i / 3, 0);
      const glm::vec3 n = glm::cross(mesh.corner(i / 3, 1) - a, mesh.corner(i / 3, 2) - a);
      for (std::size_t j = 0; j < 3; ++j) normals[mesh.indices[i + j]] += n;
    }
    for (std::size_t i = 0; i < normals.size(); ++i) {
      const float length = glm::length(normals[i]);
      const glm::vec3 n = length > 0.0F ? normals[i] / length : glm::vec3(0.0F, 1.0F, 0.0F);
      attributes.push_back({});
      rest.vertices.push_back({mesh.vertices[i].position, n, glm::vec4(0.0F)});
    }
    begin_draw(material);
    for (const std::uint32_t i : mesh.indices) indices.push_back(first + i);
    end_draw();
  }

 private:
  void begin_draw(std::uint32_t material) {
    draws.push_back(
        {static_cast<std::uint32_t>(indices.size()), 0, material, static_cast<std::uint32_t>(draws.size())});
  }
  void end_draw() {
    surface::Draw& draw = draws.back();
    draw.index_count = static_cast<std::uint32_t>(indices.size()) - draw.first_index;
    rest.flipped.push_back(0);
    if (draws.size() == 1) rest.low = rest.high = rest.vertices[0].position;
    for (std::size_t i = draw.first_index; i < indices.size(); ++i) {
      rest.low = glm::min(rest.low, glm::dvec3(rest.vertices[indices[i]].position));
      rest.high = glm::max(rest.high, glm::dvec3(rest.vertices[indices[i]].position));
    }
  }
};

/// A Lambertian material with this albedo.
inline surface::Material diffuse(glm::vec3 albedo) {
  surface::Material m;
  m.base_color = glm::vec4(albedo, 1.0F);
  m.metallic = 0.0F;
  m.roughness = 1.0F;
  m.specular = 0.0F;
  return m;
}

inline std::shared_ptr<const scene::ModelSource> source_of(std::shared_ptr<const StillScene> scene) {
  surface::Pose pose = scene->pose(0.0, 0);
  return scene::make_model_source(std::move(scene), std::move(pose), nullptr);
}

}  // namespace cumulet::test
