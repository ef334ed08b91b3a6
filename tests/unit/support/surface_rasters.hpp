#pragma once

// Scenes built in code, and the raster pass that draws them.

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>
#include <vector>

#include "gl/state_guard.hpp"
#include "render/raster/surface_raster.hpp"
#include "support/gl_state.hpp"
#include "support/surfaces.hpp"

namespace cumulet::test {

/// A scene with a fixed pose.
class HandScene : public TexturedScene {
 public:
  [[nodiscard]] surface::Pose pose(double /*time*/, std::size_t /*animation*/,
                                   const Progress* /*progress*/ = nullptr) const override {
    surface::Pose result = posed;
    result.low = glm::dvec3(std::numeric_limits<float>::infinity());
    result.high = glm::dvec3(-std::numeric_limits<float>::infinity());
    for (const surface::PosedVertex& vertex : result.vertices) {
      result.low = glm::min(result.low, glm::dvec3(vertex.position));
      result.high = glm::max(result.high, glm::dvec3(vertex.position));
    }
    return result;
  }

  /// A parallelogram, counter-clockwise seen from the direction right x up. uv (0, 0) is the corner at `right` 0 and
  /// `up` 1, as in an image.
  void add_quad(glm::vec3 corner, glm::vec3 right, glm::vec3 up, std::uint32_t material, bool flipped = false) {
    const auto base = static_cast<std::uint32_t>(attributes.size());
    const glm::vec3 normal = glm::normalize(glm::cross(right, up));
    for (int i = 0; i < 4; ++i) {
      const auto x = static_cast<float>(i & 1);
      const auto y = static_cast<float>(i >> 1);
      posed.vertices.push_back({corner + right * x + up * y, normal, glm::vec4(0.0F)});
      surface::VertexAttributes attribute;
      attribute.uv[0] = {x, 1.0F - y};
      attribute.uv[1] = {2.0F * x, 2.0F - 2.0F * y};
      attributes.push_back(attribute);
    }
    const auto draw_first = static_cast<std::uint32_t>(indices.size());
    const std::array<std::uint32_t, 6> ccw{0, 1, 2, 2, 1, 3};
    const std::array<std::uint32_t, 6> cw{0, 2, 1, 2, 3, 1};
    for (const std::uint32_t i : flipped ? cw : ccw) indices.push_back(base + i);
    draws.push_back({draw_first, 6, material, 0});
    posed.flipped.push_back(flipped ? 1 : 0);
  }
  /// A quad at z that faces +z and is 2 half wide and high, centered on the z axis.
  void add_wall(float z, float half, std::uint32_t material) {
    add_quad({-half, -half, z}, {2.0F * half, 0.0F, 0.0F}, {0.0F, 2.0F * half, 0.0F}, material);
  }
  /// A material without an interface: Lambertian.
  surface::Material& add_matte(glm::vec3 color) {
    surface::Material& material = materials.emplace_back();
    material.base_color = glm::vec4(color, 1.0F);
    material.metallic = 0.0F;
    material.specular = 0.0F;
    return material;
  }

  surface::Pose posed;
};

/// A view along -z.
inline render::SurfaceView straight(glm::dvec3 eye, double tangent, double aspect = 1.0, bool orthographic = false) {
  render::SurfaceView view;
  view.eye = eye;
  view.right = glm::dvec3(tangent * aspect, 0.0, 0.0);
  view.up = glm::dvec3(0.0, tangent, 0.0);
  view.orthographic = orthographic;
  return view;
}

/// The layers of a raster pass, in main memory.
struct RasterPicture {
  glm::uvec2 size{0U};
  std::vector<glm::vec4> colors;
  std::vector<float> depths;
  std::vector<float> blended_depths;  // of the same pixels
  [[nodiscard]] std::size_t index(unsigned x, unsigned y, unsigned layer) const {
    return (std::size_t{layer} * size.y + y) * size.x + x;
  }
  [[nodiscard]] glm::vec4 color(unsigned x, unsigned y, unsigned layer = 0) const { return colors[index(x, y, layer)]; }
  [[nodiscard]] float z(unsigned x, unsigned y, unsigned layer = 0) const { return depths[index(x, y, layer)]; }
  [[nodiscard]] glm::vec4 centre() const { return color(size.x / 2, size.y / 2); }
  [[nodiscard]] float centre_z() const { return z(size.x / 2, size.y / 2); }
};

/// Draws scenes with a raster pass.
class SurfaceRasters : public GlTest {
 protected:
  void SetUp() override {
    GlTest::SetUp();
    if (gl_) raster_ = std::make_unique<render::SurfaceRaster>(gl_);
  }
  void TearDown() override {
    raster_.reset();
    layers_ = {};
    GlTest::TearDown();
  }

  void set(const std::shared_ptr<HandScene>& scene) {
    const gl::StateGuard guard(*gl_);
    raster_->show({{content_of(scene, scene->pose(0.0, 0))}});
  }
  /// Uploads the scene to GL.
  std::shared_ptr<const render::RasterContent> content_of(const std::shared_ptr<HandScene>& scene, surface::Pose pose) {
    return content_of(scene, std::move(pose), gl::query_limits(*gl_));
  }
  std::shared_ptr<const render::RasterContent> content_of(const std::shared_ptr<HandScene>& scene, surface::Pose pose,
                                                          const gl::Limits& limits) {
    auto source = scene::make_raster_source(scene, pose);
    auto centres = std::make_shared<const std::vector<glm::vec3>>(scene::blended_centres(*source, pose));
    render::Upload upload(gl_, "uploading");
    auto content = render::RasterContent::plan(
        gl_, programs_, limits, upload,
        {std::move(source), std::make_shared<const surface::Pose>(std::move(pose)), std::move(centres)}, nullptr);
    EXPECT_TRUE(upload.advance(render::Deadline::max()));
    return content;
  }
  RasterPicture draw(const render::SurfaceView& view, const render::SurfaceLighting& lighting,
                     glm::uvec2 size = {32U, 32U}, unsigned layers = 1) {
    const gl::StateGuard guard(*gl_);
    raster_->draw(view, lighting, size, layers, layers_);
    EXPECT_EQ(layers_.size, size);
    EXPECT_EQ(layers_.layers, layers);
    RasterPicture picture;
    picture.size = size;
    const std::size_t count = std::size_t{size.x} * size.y * layers;
    const std::size_t all = layers_.blended ? 2 * count : count;
    picture.colors.resize(all);
    picture.depths.resize(all);
    gl_->GetTextureImage(layers_.color.name(), 0, GL_RGBA, GL_FLOAT, static_cast<GLsizei>(all * 16),
                         picture.colors.data());
    gl_->GetTextureImage(layers_.z.name(), 0, GL_RED, GL_FLOAT, static_cast<GLsizei>(all * 4), picture.depths.data());
    // Blended surfaces over the opaque ones.
    for (std::size_t i = 0; i < all - count; ++i) {
      const glm::vec4 over = picture.colors[count + i];
      picture.colors[i] = over + (1.0F - over.a) * picture.colors[i];
    }
    picture.blended_depths.assign(picture.depths.begin() + static_cast<std::ptrdiff_t>(count), picture.depths.end());
    picture.colors.resize(count);
    picture.depths.resize(count);
    return picture;
  }
  /// Draws one wall at z = -2, seen from the origin.
  RasterPicture draw_wall(const std::shared_ptr<HandScene>& scene, const render::SurfaceLighting& lighting) {
    scene->add_wall(-2.0F, 3.0F, 0);
    set(scene);
    return draw(straight(glm::dvec3(0.0), 0.5), lighting);
  }

  std::unique_ptr<render::SurfaceRaster> raster_;
  render::SurfaceLayers layers_;
};

inline void expect_color(glm::vec4 got, glm::vec4 expected, float relative = 2e-3F) {
  for (int c = 0; c < 4; ++c) EXPECT_NEAR(got[c], expected[c], relative * std::abs(expected[c]) + 1e-4F) << c;
}

}  // namespace cumulet::test
