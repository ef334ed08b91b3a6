// The two-level BVH of models: rays hit the same triangles as in a scene where all triangles are in world space.

#include <gtest/gtest.h>

#include <glm/gtc/matrix_transform.hpp>
#include <random>
#include <vector>

#include "base/error.hpp"
#include "support/cpu_tracer.hpp"
#include "support/surfaces.hpp"

namespace cumulet {
namespace {

using glm::dmat4;
using glm::dvec3;
using glm::vec3;

std::shared_ptr<test::StillScene> lumps(std::mt19937& random) {
  auto scene = std::make_shared<test::StillScene>();
  scene->materials.push_back(test::diffuse(vec3(0.5F)));
  scene->add_sphere(vec3(1.0F, 0.0F, 0.0F), 1.0F, 0, 6);
  scene->add_sphere(vec3(-1.0F, std::uniform_real_distribution<float>(-1.0F, 1.0F)(random), 0.5F), 0.7F, 0, 5);
  return scene;
}

// A random transform: rotated, sheared and stretched by up to 10 to 1; mirrored on request.
dmat4 any_transform(std::mt19937& random, bool mirrored) {
  std::uniform_real_distribution<double> even(-1.0, 1.0);
  dmat4 transform(1.0);
  do {
    for (int c = 0; c < 3; ++c) transform[c] = glm::dvec4(even(random), even(random), even(random), 0.0);
  } while (std::abs(glm::determinant(transform)) < 0.1);
  if ((glm::determinant(transform) < 0.0) != mirrored) transform[0] = -transform[0];
  transform[3] = glm::dvec4(4.0 * even(random), 4.0 * even(random), 4.0 * even(random), 1.0);
  return transform;
}

struct Hit {
  double t = 1e30;
  std::size_t model = 0;
  dvec3 normal{0.0};  // towards the ray
};

// Nearest hit among all triangles in world space, in double precision (Moeller and Trumbore).
Hit brute_force(const std::vector<scene::Model>& models, const dvec3& o, const dvec3& d) {
  Hit nearest;
  for (std::size_t m = 0; m < models.size(); ++m) {
    const scene::ModelSource& source = *models[m].source;
    for (std::size_t i = 0; i < source.scene->indices.size(); i += 3) {
      std::array<dvec3, 3> p;
      for (std::size_t k = 0; k < 3; ++k)
        p.at(k) =
            dvec3(models[m].to_world * glm::dvec4(source.pose.vertices[source.scene->indices[i + k]].position, 1.0));
      const dvec3 a = p[1] - p[0];
      const dvec3 b = p[2] - p[0];
      const dvec3 h = glm::cross(d, b);
      const double det = glm::dot(a, h);
      if (std::abs(det) < 1e-14) continue;
      const dvec3 s = o - p[0];
      const double u = glm::dot(s, h) / det;
      const dvec3 q = glm::cross(s, a);
      const double v = glm::dot(d, q) / det;
      const double t = glm::dot(b, q) / det;
      if (u < 0.0 || v < 0.0 || u + v > 1.0 || t <= 0.0 || t >= nearest.t) continue;
      const dvec3 n = glm::normalize(glm::cross(a, b));
      nearest = {t, m, glm::dot(n, d) > 0.0 ? -n : n};
    }
  }
  return nearest;
}

TEST(Models, RaysHitLikeInWorldSpace) {
  std::mt19937 random(7);
  const auto source = test::source_of(lumps(random));
  std::vector<scene::Model> models;
  for (int i = 0; i < 40; ++i) models.push_back({std::uint64_t(i), source, any_transform(random, i % 2 == 1)});
  core::CpuTetSurfaces rays;
  rays.cm.surfaces = rays.show(models);
  const scene::ModelTable table =
      scene::make_model_table(models, [](const scene::ModelSource&) { return scene::ModelWords{}; });
  std::uniform_real_distribution<float> even(-1.0F, 1.0F);
  std::size_t hits = 0;
  std::size_t other = 0;  // where rounding decides
  for (int i = 0; i < 4000; ++i) {
    const vec3 o = 8.0F * vec3(even(random), even(random), even(random));
    const vec3 d = vec3(even(random), even(random), even(random));
    const Hit expected = brute_force(models, dvec3(o), dvec3(d));
    core::CpuTetSurfaces::CmHit hit;
    rays.cm_hit_camera = false;
    const bool is_hit = rays.cm_trace_models(o, d, 0.0F, 1e30F, false, hit);
    core::CpuTetSurfaces::CmHit any;
    EXPECT_EQ(rays.cm_trace_models(o, d, 0.0F, 1e30F, true, any), is_hit);
    if (is_hit != (expected.t < 1e30) || (is_hit && std::abs(hit.t - expected.t) > 1e-4 * (1.0 + expected.t))) {
      ++other;
      continue;
    }
    if (!is_hit) continue;
    ++hits;
    EXPECT_EQ(table.parts[table.record_of(hit.triangle)].model, expected.model);
    const auto point = rays.cm_surface_point(hit.triangle, hit.barycentrics, glm::normalize(d), !hit.front);
    EXPECT_LT(glm::distance(dvec3(point.position), dvec3(o) + expected.t * dvec3(d)), 2e-4 * (1.0 + expected.t));
    EXPECT_GT(glm::dot(dvec3(point.geometric), expected.normal), 0.999);
  }
  EXPECT_GT(hits, 500U);
  EXPECT_LE(other, 4U);
}

TEST(Models, NormalsArePerpendicularUnderShear) {
  std::mt19937 random(11);
  auto scene = std::make_shared<test::StillScene>();
  scene->materials.push_back(test::diffuse(vec3(0.5F)));
  scene->add_sphere(vec3(0.0F), 1.0F, 0, 40);
  const auto source = test::source_of(scene);
  for (int i = 0; i < 20; ++i) {
    const dmat4 transform = any_transform(random, i % 2 == 1);
    core::CpuTetSurfaces rays;
    rays.cm.surfaces = rays.show(std::vector<scene::Model>{{0, source, transform}});
    std::uniform_real_distribution<float> even(-1.0F, 1.0F);
    for (int k = 0; k < 50; ++k) {
      const vec3 towards(transform * glm::dvec4(0.5F * even(random), 0.5F * even(random), 0.5F * even(random), 1.0));
      const vec3 o = towards + 20.0F * glm::normalize(vec3(even(random), even(random), even(random)));
      const vec3 d = glm::normalize(towards - o);
      core::CpuTetSurfaces::CmHit hit;
      ASSERT_TRUE(rays.cm_trace_models(o, d, 0.0F, 1e30F, false, hit));
      EXPECT_TRUE(hit.front);
      const auto point = rays.cm_surface_point(hit.triangle, hit.barycentrics, d, false);
      // The normal of an ellipsoid is the gradient of |A^-1 (p - c)|^2.
      const dvec3 own = glm::inverse(glm::dmat3(transform)) * (dvec3(point.position) - dvec3(transform[3]));
      const dvec3 expected = glm::normalize(glm::transpose(glm::inverse(glm::dmat3(transform))) * own);
      EXPECT_GT(glm::dot(dvec3(point.material.smooth_normal), expected), 0.97) << i;
      EXPECT_LT(glm::dot(dvec3(point.geometric), dvec3(d)), 0.0);
    }
  }
}

// Probabilities of emissive triangles are proportional to their world-space area and sum to 1.
TEST(Models, EmissiveTrianglesAreSelectedByArea) {
  auto scene = std::make_shared<test::StillScene>();
  scene->materials.push_back(test::diffuse(vec3(0.0F)));
  scene->materials.back().emission = vec3(2.0F);
  scene->add_sphere(vec3(0.0F), 1.0F, 0, 5);
  const auto source = test::source_of(scene);
  std::mt19937 random(5);
  std::vector<scene::Model> models;
  for (int i = 0; i < 5; ++i) models.push_back({std::uint64_t(i), source, any_transform(random, i % 2 == 1)});
  core::CpuTetEmitters rays;
  rays.cm.surfaces = rays.show(models);
  double sum = 0.0;
  for (std::size_t m = 0; m < rays.cm_models.size(); ++m) {
    const core::CmModel& record = rays.cm_models[m];
    ASSERT_GT(record.emitter_count, 0U);
    for (core::uint e = 0; e < record.emitter_count; ++e) {
      const glm::uvec4 entry = rays.cm_emitter(static_cast<core::uint>(m), e);
      std::array<dvec3, 3> p;
      for (std::size_t k = 0; k < 3; ++k)
        p.at(k) = dvec3(models[m].to_world *
                        glm::dvec4(source->pose.vertices[scene->indices[3 * entry.x + k]].position, 1.0));
      const dvec3 cross = glm::cross(p[1] - p[0], p[2] - p[0]);
      const double area = 0.5 * glm::length(cross);
      if (!(area > 0.0)) continue;
      // At a distance of 1, straight in front.
      const vec3 n(glm::normalize(cross));
      sum += area * rays.cm_emitter_pdf(static_cast<core::uint>(m), entry, n, n, n);
    }
  }
  EXPECT_NEAR(sum, 1.0, 1e-4);
}

TEST(Models, ShadowOnlyModelsAreHitByAllButCameraRays) {
  std::mt19937 random(3);
  const auto source = test::source_of(lumps(random));
  core::CpuTetSurfaces rays;
  rays.cm.surfaces = rays.show(std::vector<scene::Model>{{0, source, dmat4(1.0), true}});
  core::CpuTetSurfaces::CmHit hit;
  rays.cm_hit_camera = true;
  EXPECT_FALSE(rays.cm_trace_models(vec3(1, 0, 9), vec3(0, 0, -1), 0.0F, 1e30F, false, hit));
  rays.cm_hit_camera = false;
  EXPECT_TRUE(rays.cm_trace_models(vec3(1, 0, 9), vec3(0, 0, -1), 0.0F, 1e30F, false, hit));
}

TEST(Models, InvalidTransformsAreRejected) {
  std::mt19937 random(3);
  const auto source = test::source_of(lumps(random));
  const auto refused = [&](const dmat4& transform, ErrorCode code, const char* cause) {
    const std::vector<scene::Model> models{{0, source}, {1, source, transform}};
    try {
      scene::make_model_table(models, [](const scene::ModelSource&) { return scene::ModelWords{}; });
      ADD_FAILURE() << cause;
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), code);
      EXPECT_STREQ(error.what(), cause);
    }
  };
  const char* const flat = "model 1: its transform is not finite, is singular, or is too large";
  refused(glm::scale(dmat4(1.0), dvec3(1.0, 0.0, 1.0)), ErrorCode::invalid_argument, flat);
  refused(glm::scale(dmat4(1.0), dvec3(std::numeric_limits<double>::quiet_NaN())), ErrorCode::invalid_argument, flat);
  refused(glm::translate(dmat4(1.0), dvec3(1e13, 0.0, 0.0)), ErrorCode::unsupported,
          "model 1: it extends 1e12 or more from the world origin");
}

}  // namespace
}  // namespace cumulet
