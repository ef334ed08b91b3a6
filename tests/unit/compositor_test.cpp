// Display of an image in the host's framebuffer, compared pixel by pixel with a CPU evaluation.

#include "render/passes/compositor.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "base/error.hpp"
#include "gl/state_guard.hpp"
#include "image.hpp"
#include "support/busy_host.hpp"
#include "support/compositing.hpp"
#include "support/gl_state.hpp"

namespace {

using cumulet::Error;
using cumulet::ErrorCode;
using cumulet::gl::Object;
using cumulet::gl::StateGuard;
using cumulet::render::ColorEncoding;
using cumulet::render::Display;
using cumulet::render::FrameTarget;
using cumulet::render::PictureTextures;
using cumulet::render::ToneMap;
using cumulet::test::Compositing;
using cumulet::test::ComputedPicture;
namespace gl = cumulet::gl;
namespace image = cumulet::image;
namespace render = cumulet::render;

CUMULET_ON_BACKENDS(Compositing);

TEST_P(Compositing, EveryEncodingCurveAndBackground) {
  const ComputedPicture picture(gl_, 21, 13, false);
  FrameTarget target;
  target.viewport = {7, 5, 21, 13};
  for (const ColorEncoding encoding :
       {ColorEncoding::srgb, ColorEncoding::srgb_framebuffer, ColorEncoding::linear, ColorEncoding::hdr}) {
    for (const ToneMap curve : {ToneMap::neutral, ToneMap::filmic, ToneMap::clip}) {
      for (const bool transparent : {false, true}) {
        for (const bool over : {false, true}) {
          SCOPED_TRACE(testing::Message() << "encoding " << int(encoding) << " curve " << int(curve) << " transparent "
                                          << transparent << " over " << over);
          Display display;
          display.encoding = encoding;
          display.tone_map = curve;
          display.transparent = transparent;
          display.exposure_stops = -0.5F;
          target.blend_over = over;
          if (encoding == ColorEncoding::srgb_framebuffer) {
            check(picture, display, target, GL_SRGB8_ALPHA8, 0);
          } else {
            check(picture, display, target, GL_RGBA32F, 0);
            if (encoding != ColorEncoding::hdr) check(picture, display, target, GL_RGBA8, 0);
          }
          ASSERT_FALSE(HasFatalFailure());
        }
      }
    }
  }
}

TEST_P(Compositing, SizesFlipsRectanglesAndSamples) {
  const std::vector<ComputedPicture> pictures = [this] {
    std::vector<ComputedPicture> made;
    for (const glm::ivec2 s : {glm::ivec2(23, 17), glm::ivec2(6, 4), glm::ivec2(1, 1), glm::ivec2(37, 29)}) {
      made.emplace_back(gl_, s.x, s.y, false);
    }
    return made;
  }();
  Display display;
  display.transparent = true;
  for (const ComputedPicture& picture : pictures) {
    for (const glm::ivec4 viewport : {glm::ivec4(0, 0, 40, 28), glm::ivec4(3, 9, 23, 17), glm::ivec4(-5, 20, 30, 30)}) {
      for (const bool flip : {false, true}) {
        for (const int samples : {0, 4}) {
          SCOPED_TRACE(testing::Message()
                       << picture.size.x << " wide into " << viewport.z << " flip " << flip << " samples " << samples);
          FrameTarget target;
          target.viewport = viewport;
          target.flip_y = flip;
          check(picture, display, target, GL_RGBA32F, samples);
          check(picture, display, target, GL_RGBA8, samples);
          ASSERT_FALSE(HasFatalFailure());
        }
      }
    }
  }
}

TEST_P(Compositing, BackgroundColorIsBehindEverything) {
  ComputedPicture picture(gl_, 21, 13, false);
  for (const bool holes : {false, true}) {
    picture.holes = holes;
    for (const glm::ivec4 viewport : {glm::ivec4(7, 5, 21, 13), glm::ivec4(0, 0, 40, 28)}) {
      FrameTarget target;
      target.viewport = viewport;
      Display display;
      display.backdrop = glm::vec3(0.7F, 0.2F, 3.0F);
      display.exposure_stops = -0.5F;
      check(picture, display, target, GL_RGBA32F, 0);
      check(picture, display, target, GL_RGBA8, 0);
    }
  }
}

TEST_P(Compositing, LegendsAreNotToneMapped) {
  const ComputedPicture picture(gl_, 21, 13, true);
  FrameTarget target;
  target.viewport = {7, 5, 21, 13};
  for (const bool transparent : {false, true}) {
    Display display;
    display.legend = true;
    display.transparent = transparent;
    display.exposure_stops = 3.0F;
    check(picture, display, target, GL_RGBA8, 0);
    display.encoding = ColorEncoding::linear;
    check(picture, display, target, GL_RGBA32F, 0);
  }
}

TEST_P(Compositing, OnlyTheFirstDrawBufferIsWritten) {
  const ComputedPicture picture(gl_, 16, 16, false);
  const Target made = make_target(GL_RGBA32F, 0);
  const Object other = gl::make_texture_2d(gl_, GL_RGBA32F, size.x, size.y, "another");
  gl_->NamedFramebufferTexture(made.framebuffer.name(), GL_COLOR_ATTACHMENT1, other.name(), 0);
  const std::array<GLenum, 2> buffers{GL_COLOR_ATTACHMENT0, GL_COLOR_ATTACHMENT1};
  gl_->NamedFramebufferDrawBuffers(made.framebuffer.name(), 2, buffers.data());
  gl_->ClearNamedFramebufferfv(made.framebuffer.name(), GL_COLOR, 1, &before.x);
  FrameTarget target;
  target.framebuffer = made.framebuffer.name();
  target.viewport = {0, 0, size.x, size.y};
  target.write_depth = true;
  {
    const StateGuard guard(*gl_);
    compositor_->draw(picture.textures(), {}, target);
  }
  std::vector<glm::vec4> pixels(static_cast<std::size_t>(size.x * size.y));
  gl_->GetTextureImage(other.name(), 0, GL_RGBA, GL_FLOAT, static_cast<GLsizei>(pixels.size() * 16), pixels.data());
  for (const glm::vec4& pixel : pixels) ASSERT_EQ(pixel, before);
  const std::vector<glm::vec4> drawn = read(made, GL_RGBA32F, 0);
  EXPECT_LT(std::count(drawn.begin(), drawn.end(), before), size.x * size.y / 4);
}

TEST_P(Compositing, DepthFollowsTheConvention) {
  struct Convention {
    bool reversed, orthographic;
    double a, b;
  };
  const double near = 0.25;
  const double far = 50.0;
  const std::array<Convention, 4> conventions{{{false, false, far / (far - near), -far * near / (far - near)},
                                               {true, false, 0.0, near},
                                               {false, true, 0.0, 1.0 / far},
                                               {true, true, 1.0, -1.0 / far}}};
  const ComputedPicture picture(gl_, 20, 12, false);
  for (const auto& [reversed, orthographic, a, b] : conventions) {
    for (const bool flip : {false, true}) {
      SCOPED_TRACE(testing::Message() << "reversed " << reversed << " orthographic " << orthographic << " flip "
                                      << flip);
      // The host's surface is at z = 8.
      const auto surface = static_cast<float>(orthographic ? a + b * 8.0 : a + b / 8.0);
      const Target made = make_target(GL_RGBA32F, 0, surface);
      FrameTarget target;
      target.framebuffer = made.framebuffer.name();
      target.viewport = {10, 6, 20, 12};
      target.flip_y = flip;
      target.write_depth = true;
      target.reversed = reversed;
      target.orthographic = orthographic;
      target.depth_a = a;
      target.depth_b = b;
      {
        const StateGuard guard(*gl_);
        compositor_->draw(picture.textures(), {}, target);
        // The next draw starts from the same state.
        EXPECT_EQ(gl_->IsEnabled(GL_DEPTH_TEST), GL_FALSE);
      }
      const std::vector<float> depths = read_depth(made);
      const std::vector<glm::vec4> colors = read(made, GL_RGBA32F, 0);
      int written = 0;
      for (int y = 0; y < size.y; ++y) {
        for (int x = 0; x < size.x; ++x) {
          const auto i = static_cast<std::size_t>(y * size.x + x);
          const glm::ivec2 in(x - 10, y - 6);
          if (in.x < 0 || in.y < 0 || in.x >= 20 || in.y >= 12) {
            ASSERT_EQ(depths[i], surface);
            continue;
          }
          const std::size_t p = picture.index({in.x, flip ? in.y : 11 - in.y});
          const double z = picture.z[p];
          const bool in_front = z > 0.0 && z < 8.0;
          written += in_front ? 1 : 0;
          const double expected = in_front ? (orthographic ? a + b * z : a + b / z) : double(surface);
          ASSERT_NEAR(depths[i], expected, 3e-7) << x << ' ' << y;
          if (picture.counts[p].x > 0) {
            ASSERT_NE(colors[i], before);  // hidden or not
          }
        }
      }
      EXPECT_GT(written, 20);
    }
  }
}

TEST_P(Compositing, DepthOutsideItsRangeIsClamped) {
  const ComputedPicture picture(gl_, 8, 8, false);
  const Target made = make_target(GL_RGBA32F, 0, 1.0F);
  FrameTarget target;
  target.framebuffer = made.framebuffer.name();
  target.viewport = {0, 0, 8, 8};
  target.write_depth = true;
  target.depth_a = -3.0;
  {
    const StateGuard guard(*gl_);
    compositor_->draw(picture.textures(), {}, target);
  }
  const std::vector<float> depths = read_depth(made);
  for (int y = 0; y < 8; ++y) {
    for (int x = 0; x < 8; ++x) {
      const bool surface = picture.z[picture.index({x, 7 - y})] > 0.0F;
      ASSERT_EQ(depths[static_cast<std::size_t>(y * size.x + x)], surface ? 0.0F : 1.0F);
    }
  }
}

// Surface layers beneath the image have their own resolution and are enlarged after the display transform, each pixel
// once.
TEST_P(Compositing, SurfacesAreUpscaledInDisplaySpace) {
  const glm::ivec2 coarse(9, 7);
  render::SurfaceLayers layers;
  layers.size = glm::uvec2(coarse);
  layers.layers = 1;
  layers.color = gl::make_texture_2d_array(gl_, GL_RGBA16F, coarse.x, coarse.y, 1, "colour");
  layers.z = gl::make_texture_2d_array(gl_, GL_R32F, coarse.x, coarse.y, 1, "z");
  std::vector<glm::vec4> colors;
  for (int i = 0; i < coarse.x * coarse.y; ++i)
    colors.emplace_back(float(i % 8) / 8.0F, float(i % 5) / 4.0F, float(i % 3) / 2.0F, 1.0F);
  const std::vector<float> near(colors.size(), 1.0F);
  gl_->TextureSubImage3D(layers.color.name(), 0, 0, 0, 0, coarse.x, coarse.y, 1, GL_RGBA, GL_FLOAT, colors.data());
  gl_->TextureSubImage3D(layers.z.name(), 0, 0, 0, 0, coarse.x, coarse.y, 1, GL_RED, GL_FLOAT, near.data());
  const ComputedPicture like(gl_, 3, 2, false);
  const std::vector<glm::vec4> nothing(6, glm::vec4(0.0F));
  gl_->TextureSubImage2D(like.sum_texture.name(), 0, 0, 0, 3, 2, GL_RGBA, GL_FLOAT, nothing.data());
  PictureTextures picture = like.textures();
  picture.beneath = &layers;
  const glm::ivec4 viewport(3, 4, 31, 22);
  for (const ColorEncoding encoding : {ColorEncoding::srgb, ColorEncoding::hdr}) {
    for (const bool flip : {false, true}) {
      SCOPED_TRACE(testing::Message() << "encoding " << int(encoding) << " flip " << flip);
      Display display;
      display.tone_map = ToneMap::clip;
      display.encoding = encoding;
      const Target made = make_target(GL_RGBA32F, 0);
      FrameTarget target;
      target.framebuffer = made.framebuffer.name();
      target.viewport = viewport;
      target.flip_y = flip;
      target.wait = render::Wait::always;
      {
        const StateGuard guard(*gl_);
        compositor_->draw(picture, display, target);
      }
      const std::vector<glm::vec4> got = read(made, GL_RGBA32F, 0);
      const auto shown = [&](glm::ivec2 p) {
        p = glm::clamp(p, glm::ivec2(0), coarse - 1);
        glm::dvec4 color(colors[static_cast<std::size_t>(p.y * coarse.x + p.x)]);
        for (int k = 0; k < 3 && encoding == ColorEncoding::srgb; ++k)
          color[k] = image::srgb_encode(static_cast<float>(color[k]));
        return color;
      };
      for (int y = 0; y < viewport.w; ++y) {
        for (int x = 0; x < viewport.z; ++x) {
          const int row = flip ? y : viewport.w - 1 - y;
          const glm::dvec2 at =
              (glm::dvec2(x, row) + 0.5) * glm::dvec2(coarse) / glm::dvec2(viewport.z, viewport.w) - 0.5;
          const glm::ivec2 low(glm::floor(at));
          const glm::dvec2 part = at - glm::dvec2(low);
          const glm::dvec4 expected =
              glm::mix(glm::mix(shown(low), shown(low + glm::ivec2(1, 0)), part.x),
                       glm::mix(shown(low + glm::ivec2(0, 1)), shown(low + glm::ivec2(1, 1)), part.x), part.y);
          const auto i = static_cast<std::size_t>((y + viewport.y) * size.x + x + viewport.x);
          // Drivers filter with 8-bit weights.
          for (int k = 0; k < 4; ++k) ASSERT_NEAR(got[i][k], expected[k], 0.01) << x << ' ' << y << ' ' << k;
        }
      }
    }
  }
}

TEST_P(Compositing, InvalidTargetsAreReported) {
  const ComputedPicture picture(gl_, 8, 8, false);
  const Object incomplete = gl::make_framebuffer(gl_);
  FrameTarget target;
  target.viewport = {0, 0, 8, 8};
  const StateGuard guard(*gl_);
  const auto cause = [&](GLuint name) -> std::string {
    target.framebuffer = name;
    try {
      compositor_->draw(picture.textures(), {}, target);
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::invalid_argument);
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(cause(4711), "the target, 4711, is not a framebuffer of the current context");
  EXPECT_EQ(cause(incomplete.name()),
            "the target, framebuffer " + std::to_string(incomplete.name()) + ", is not complete");
  EXPECT_EQ(gl_->GetError(), GLenum{GL_NO_ERROR});
}

}  // namespace
