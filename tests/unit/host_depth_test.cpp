// Conversion of the host's depth buffer to view depth: a known scene, drawn with plain GL, compared with its analytic
// depth.

#include "render/raster/host_depth.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <vector>

#include "gl/state_guard.hpp"
#include "support/gl_state.hpp"
#include "support/host_depths.hpp"

namespace {

using cumulet::gl::Object;
using cumulet::gl::StateGuard;
using cumulet::render::DepthSource;
using cumulet::render::HostDepthInput;
using cumulet::test::Camera;
using cumulet::test::cameras;
using cumulet::test::DepthScene;
using cumulet::test::HostDepths;
using cumulet::test::infinite;
namespace gl = cumulet::gl;

CUMULET_ON_BACKENDS(HostDepths);

double step_of(GLenum format) {
  if (format == GL_DEPTH_COMPONENT16) return 1.0 / 65535.0;
  if (format == GL_DEPTH_COMPONENT32F || format == GL_DEPTH32F_STENCIL8) return 1.2e-7;
  return 2.5e-7;
}

TEST_P(HostDepths, EveryConventionFromTextures) {
  for (const Camera& camera : cameras) {
    for (const int samples : {0, 4}) {
      for (const bool flip : {false, true}) {
        SCOPED_TRACE(testing::Message() << camera.name << ", samples " << samples << ", flip " << flip);
        const DepthScene::Host host = scene_->make_host(GL_DEPTH_COMPONENT32F, samples, false);
        const glm::ivec4 viewport(0, 0, size);
        scene_->draw_scene(camera, host.framebuffer.name(), viewport);
        HostDepthInput input = DepthScene::input_of(
            camera, samples > 0 ? DepthSource::texture_multisample : DepthSource::texture, host.depth.name(), viewport);
        input.flip_y = flip;
        scene_->update(input);
        scene_->expect_scene(camera, viewport, flip, samples > 0 ? 4 : 1, step_of(GL_DEPTH_COMPONENT32F));
        ASSERT_FALSE(HasFatalFailure());
      }
    }
  }
}

TEST_P(HostDepths, EveryFormatFromFramebuffers) {
  for (const GLenum format : {GL_DEPTH_COMPONENT16, GL_DEPTH_COMPONENT24, GL_DEPTH_COMPONENT32, GL_DEPTH_COMPONENT32F,
                              GL_DEPTH24_STENCIL8, GL_DEPTH32F_STENCIL8}) {
    for (const bool renderbuffer : {false, true}) {
      for (const int samples : {0, 4}) {
        for (const Camera* camera : {&cameras[0], &cameras[2]}) {
          SCOPED_TRACE(testing::Message() << "format " << format << ", renderbuffer " << renderbuffer << ", samples "
                                          << samples << ", " << camera->name);
          const DepthScene::Host host = scene_->make_host(format, samples, renderbuffer);
          const glm::ivec4 viewport(0, 0, size);
          scene_->draw_scene(*camera, host.framebuffer.name(), viewport);
          scene_->update(DepthScene::input_of(*camera, DepthSource::framebuffer, host.framebuffer.name(), viewport));
          scene_->expect_scene(*camera, viewport, false, samples > 0 ? 4 : 1, step_of(format));
          if (!renderbuffer) {
            scene_->update(DepthScene::input_of(*camera,
                                                samples > 0 ? DepthSource::texture_multisample : DepthSource::texture,
                                                host.depth.name(), viewport));
            scene_->expect_scene(*camera, viewport, false, samples > 0 ? 4 : 1, step_of(format));
          }
          ASSERT_FALSE(HasFatalFailure());
        }
      }
    }
  }
}

TEST_P(HostDepths, SubRectangles) {
  const Camera& camera = cameras[2];
  const glm::ivec4 viewport(9, 4, 33, 24);
  for (const int samples : {0, 4}) {
    const DepthScene::Host host = scene_->make_host(GL_DEPTH_COMPONENT32F, samples, false);
    scene_->draw_scene(camera, host.framebuffer.name(), viewport);
    const DepthSource texture = samples > 0 ? DepthSource::texture_multisample : DepthSource::texture;
    for (const bool flip : {false, true}) {
      for (const DepthSource source : {texture, DepthSource::framebuffer}) {
        SCOPED_TRACE(testing::Message() << "samples " << samples << ", source " << int(source) << ", flip " << flip);
        HostDepthInput input = DepthScene::input_of(
            camera, source, source == texture ? host.depth.name() : host.framebuffer.name(), viewport);
        input.flip_y = flip;
        scene_->update(input);
        scene_->expect_scene(camera, viewport, flip, samples > 0 ? 4 : 1, 1.2e-7);
      }
    }
  }
  // A depth texture of the viewport's size starts at the viewport's corner.
  const DepthScene::Host own = scene_->make_host(GL_DEPTH_COMPONENT32F, 0, false, {33, 24});
  scene_->draw_scene(camera, own.framebuffer.name(), {0, 0, 33, 24});
  scene_->update(DepthScene::input_of(camera, DepthSource::texture, own.depth.name(), viewport));
  scene_->expect_scene(camera, viewport, false, 1, 1.2e-7);
  scene_->update(DepthScene::input_of(camera, DepthSource::framebuffer, own.framebuffer.name(), viewport));
  scene_->expect_scene(camera, viewport, false, 1, 1.2e-7);
}

TEST_P(HostDepths, TextureParametersAreIgnoredAndKept) {
  const Camera& camera = cameras[0];
  const glm::ivec4 viewport(0, 0, size);
  const DepthScene::Host host = scene_->make_host(GL_DEPTH24_STENCIL8, 0, false);
  const GLuint name = host.depth.name();
  scene_->draw_scene(camera, host.framebuffer.name(), viewport);
  const HostDepthInput input = DepthScene::input_of(camera, DepthSource::texture, name, viewport);
  const auto set = [&](GLenum parameter, GLenum value) {
    gl_->TextureParameteri(name, parameter, static_cast<GLint>(value));
  };
  const auto expect = [&](const char* what) {
    SCOPED_TRACE(what);
    const StateGuard guard(*gl_);
    scene_->depth_.emplace(gl_, programs_);
    scene_->update(input);
    scene_->expect_scene(camera, viewport, false, 1, 2.5e-7);
  };
  set(GL_TEXTURE_COMPARE_MODE, GL_COMPARE_REF_TO_TEXTURE);
  set(GL_TEXTURE_MAG_FILTER, GL_LINEAR);
  expect("a shadow map");
  set(GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_LINEAR);
  set(GL_TEXTURE_MAX_LEVEL, 5);
  expect("filters that need mipmaps");
  set(GL_DEPTH_STENCIL_TEXTURE_MODE, GL_STENCIL_INDEX);
  expect("stencil sampling");
  set(GL_DEPTH_STENCIL_TEXTURE_MODE, GL_DEPTH_COMPONENT);
  set(GL_TEXTURE_SWIZZLE_R, GL_ZERO);
  expect("swizzled");
}

TEST_P(HostDepths, MutableTextures) {
  const Camera& camera = cameras[0];
  GLuint name = 0;
  gl_->GenTextures(1, &name);
  const Object texture(gl_, Object::Kind::texture, name);
  gl_->BindTexture(GL_TEXTURE_2D, name);  // incomplete: its filters need mipmaps, and the depth format is unsized
  gl_->TexImage2D(GL_TEXTURE_2D, 0, GL_DEPTH_COMPONENT, size.x, size.y, 0, GL_DEPTH_COMPONENT, GL_UNSIGNED_INT,
                  nullptr);
  gl_->BindTexture(GL_TEXTURE_2D, 0);
  const Object framebuffer = gl::make_framebuffer(gl_);
  gl_->NamedFramebufferTexture(framebuffer.name(), GL_DEPTH_ATTACHMENT, name, 0);
  gl_->NamedFramebufferDrawBuffer(framebuffer.name(), GL_NONE);
  const glm::ivec4 viewport(0, 0, size);
  scene_->draw_scene(camera, framebuffer.name(), viewport);
  for (const bool by_texture : {true, false}) {
    scene_->update(DepthScene::input_of(camera, by_texture ? DepthSource::texture : DepthSource::framebuffer,
                                        by_texture ? name : framebuffer.name(), viewport));
    scene_->expect_scene(camera, viewport, false, 1, 2.5e-7);
  }
}

TEST_P(HostDepths, R32FValues) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const std::vector<float> depths{0.0F, 0.5F, 0.999F, 1.0F, 1.5F, nan, infinite, -infinite};
  const Object texture = gl::make_texture_2d(gl_, GL_R32F, 8, 1, "depth");
  gl_->TextureSubImage2D(texture.name(), 0, 0, 0, 8, 1, GL_RED, GL_FLOAT, depths.data());
  HostDepthInput input;
  input.source = DepthSource::texture;
  input.name = texture.name();
  input.viewport = {0, 0, 8, 1};
  input.target_size = {8U, 1U};
  input.depth_a = 1.0;  // standard, infinite far plane: z = 0.5 / (1 - d)
  input.depth_b = -0.5;
  EXPECT_TRUE(scene_->update(input));
  std::vector<float> z = scene_->read();
  EXPECT_FLOAT_EQ(z[0], 0.5F);
  EXPECT_FLOAT_EQ(z[1], 1.0F);
  EXPECT_NEAR(z[2], 500.0F, 0.05F);
  for (std::size_t i = 3; i < 7; ++i) EXPECT_EQ(z[i], infinite) << i;
  EXPECT_FALSE(scene_->update(input));  // the converted values compare equal, even where the input is NaN
  input.depth_a = 0.0;                  // reversed: z = 0.5 / d
  input.depth_b = 0.5;
  EXPECT_TRUE(scene_->update(input));
  z = scene_->read();
  EXPECT_EQ(z[0], infinite);
  EXPECT_FLOAT_EQ(z[1], 1.0F);
  EXPECT_FLOAT_EQ(z[3], 0.5F);
  EXPECT_EQ(z[5], infinite);
  EXPECT_EQ(z[7], infinite);
}

TEST_P(HostDepths, FarSurfacesKeepTheirPrecision) {
  // Depths within a few roundings of `a`: the error of `a` as a float would be a large part of z.
  const std::vector<float> depths{1.0F - 0x1p-24F, 1.0F - 0x1p-22F, 1.0F - 0x1p-20F, 0.999F};
  const Object texture = gl::make_texture_2d(gl_, GL_R32F, 4, 1, "depth");
  gl_->TextureSubImage2D(texture.name(), 0, 0, 0, 4, 1, GL_RED, GL_FLOAT, depths.data());
  HostDepthInput input;
  input.source = DepthSource::texture;
  input.name = texture.name();
  input.viewport = {0, 0, 4, 1};
  input.target_size = {4U, 1U};
  const double near = 0.1;
  const double far = 123456.0;
  input.depth_a = far / (far - near);
  input.depth_b = -far * near / (far - near);
  scene_->update(input);
  const std::vector<float> z = scene_->read();
  for (std::size_t i = 0; i < 4; ++i) {
    const double expected = input.depth_b / (double(depths[i]) - input.depth_a);
    EXPECT_NEAR(z[i], expected, 1e-6 * expected);
  }
}

TEST_P(HostDepths, ChangesAreDetected) {
  const Camera& camera = cameras[0];
  const glm::ivec4 viewport(0, 0, size);
  const DepthScene::Host host = scene_->make_host(GL_DEPTH_COMPONENT32F, 4, false);
  scene_->draw_scene(camera, host.framebuffer.name(), viewport);
  HostDepthInput input = DepthScene::input_of(camera, DepthSource::texture_multisample, host.depth.name(), viewport);
  EXPECT_TRUE(scene_->update(input));
  EXPECT_FALSE(scene_->update(input));
  scene_->draw_scene(camera, host.framebuffer.name(), viewport);
  EXPECT_FALSE(scene_->update(input));  // unchanged
  // Changes one pixel.
  gl_->BindFramebuffer(GL_DRAW_FRAMEBUFFER, host.framebuffer.name());
  gl_->Enable(GL_SCISSOR_TEST);
  gl_->Scissor(17, 11, 1, 1);
  gl_->ClearDepth(0.25);
  gl_->Clear(GL_DEPTH_BUFFER_BIT);
  gl_->Disable(GL_SCISSOR_TEST);
  gl_->BindFramebuffer(GL_DRAW_FRAMEBUFFER, 0);
  input.unchanged = true;  // the host declares it unchanged
  EXPECT_FALSE(scene_->update(input));
  input.unchanged = false;
  EXPECT_TRUE(scene_->update(input));
  EXPECT_FALSE(scene_->update(input));
  // A change of the depth convention or of the source is a change, whatever `unchanged` says.
  input.unchanged = true;
  input.depth_b *= 2.0;
  EXPECT_TRUE(scene_->update(input));
  input.flip_y = true;
  EXPECT_TRUE(scene_->update(input));
  input.viewport.z -= 1;
  EXPECT_TRUE(scene_->update(input));
  EXPECT_EQ(scene_->depth_->size(), glm::uvec2(size.x - 1, size.y));
  EXPECT_FALSE(scene_->update(input));
  input.source = DepthSource::none;
  EXPECT_TRUE(scene_->update(input));
  EXPECT_EQ(scene_->depth_->texture(), 0U);
  EXPECT_EQ(scene_->depth_->layers(), 0U);
  EXPECT_FALSE(scene_->update(input));
  input.source = DepthSource::texture_multisample;
  input.viewport.z = 0;  // an empty viewport
  EXPECT_FALSE(scene_->update(input));
}

}  // namespace
