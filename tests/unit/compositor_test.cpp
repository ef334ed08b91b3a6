// Display of an image in the host's framebuffer, compared pixel by pixel with a CPU evaluation.

#include "render/compositor.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <random>
#include <vector>

#include "base/error.hpp"
#include "gl/state_guard.hpp"
#include "image.hpp"
#include "support/busy_host.hpp"
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
namespace gl = cumulet::gl;
namespace image = cumulet::image;
namespace render = cumulet::render;

struct Picture {
  glm::ivec2 size{0};
  bool holes = false;
  std::vector<glm::vec4> sum;
  std::vector<glm::vec4> background;
  std::vector<glm::uvec2> counts;
  std::vector<float> z;
  Object sum_texture, background_texture, counts_texture, z_texture;

  Picture(const gl::FunctionsPtr& gl, int width, int height, bool legend) : size(width, height) {
    std::mt19937 random(static_cast<unsigned>(width * 131 + height));
    std::uniform_real_distribution<float> unit(0.0F, 1.0F);
    for (int i = 0; i < width * height; ++i) {
      const unsigned samples = i % 5 == 0 ? 0U : 1U + static_cast<unsigned>(random() % 7);
      const float alpha = i % 7 == 1 ? 0.0F : (i % 7 == 2 ? 1.0F : unit(random));
      const float bright = legend ? 1.0F : (i % 3 == 0 ? 6.0F : 0.8F);
      const glm::vec3 radiance = alpha * bright * glm::vec3(unit(random), unit(random), unit(random));
      sum.push_back(static_cast<float>(samples) * glm::vec4(radiance, alpha));
      background.emplace_back((1.0F - alpha) * (legend ? 0.0F : 1.0F) * glm::vec3(0.3F, 0.6F, unit(random)), 9.0F);
      counts.emplace_back(samples, 9U);
      z.push_back(i % 3 == 0 ? 0.0F : 0.5F + 20.0F * unit(random));
    }
    sum_texture = gl::make_texture_2d(gl, GL_RGBA32F, width, height, "sum");
    background_texture = gl::make_texture_2d(gl, GL_RGBA32F, width, height, "background");
    counts_texture = gl::make_texture_2d(gl, GL_RG32UI, width, height, "counts");
    z_texture = gl::make_texture_2d(gl, GL_R32F, width, height, "z");
    gl->TextureSubImage2D(sum_texture.name(), 0, 0, 0, width, height, GL_RGBA, GL_FLOAT, sum.data());
    gl->TextureSubImage2D(background_texture.name(), 0, 0, 0, width, height, GL_RGBA, GL_FLOAT, background.data());
    gl->TextureSubImage2D(counts_texture.name(), 0, 0, 0, width, height, GL_RG_INTEGER, GL_UNSIGNED_INT, counts.data());
    gl->TextureSubImage2D(z_texture.name(), 0, 0, 0, width, height, GL_RED, GL_FLOAT, z.data());
  }
  [[nodiscard]] PictureTextures textures() const {
    PictureTextures textures;
    textures.sum = sum_texture.name();
    textures.background = background_texture.name();
    textures.counts = counts_texture.name();
    textures.size = glm::uvec2(size);
    textures.holes = holes;
    textures.volume_z = z_texture.name();
    return textures;
  }
  [[nodiscard]] std::size_t index(glm::ivec2 p) const {
    p = glm::clamp(p, glm::ivec2(0), size - 1);
    return static_cast<std::size_t>(p.y * size.x + p.x);
  }
  /// Mean of a pixel's samples, 0 without samples; with_background adds the background's radiance.
  [[nodiscard]] glm::dvec4 mean(glm::ivec2 p, bool with_background) const {
    const std::size_t i = index(p);
    glm::dvec4 mean(0.0);
    if (counts[i].x > 0) mean = glm::dvec4(sum[i]) / double(counts[i].x);
    if (with_background) mean += glm::dvec4(glm::dvec3(background[i]), 0.0);
    return mean;
  }
  [[nodiscard]] glm::dvec4 around(glm::ivec2 p, bool with_background) const {
    glm::dvec4 total(0.0);
    double n = 0.0;
    for (int k = 0; k < 9; ++k) {
      const glm::ivec2 near = p + glm::ivec2(k % 3 - 1, k / 3 - 1);
      if (counts[index(near)].x == 0) continue;
      total += mean(near, with_background);
      n += 1.0;
    }
    return n > 0.0 ? total / n : mean(p, with_background);
  }
  [[nodiscard]] glm::dvec4 texel(glm::ivec2 p, const Display& display) const {
    const bool hole = holes && counts[index(p)].x == 0;
    const bool all = display.shows_background();
    const glm::dvec4 value = hole ? around(glm::clamp(p, glm::ivec2(0), size - 1), all) : mean(p, all);
    if (display.transparent) return value;
    const glm::dvec3 behind(display.backdrop.value_or(glm::vec3(0.0F)));
    return {glm::dvec3(value) + (1.0 - value.a) * behind, 1.0};
  }
};

/// The value written at a pixel of the viewport, before GL blending and encoding. Row 0 is the image's top.
glm::dvec4 evaluate(const Picture& picture, const Display& display, glm::ivec2 pixel, glm::ivec2 viewport) {
  glm::dvec4 value;
  if (picture.size == viewport) {
    value = picture.texel(pixel, display);
  } else {
    const glm::dvec2 at = (glm::dvec2(pixel) + 0.5) * glm::dvec2(picture.size) / glm::dvec2(viewport) - 0.5;
    const glm::ivec2 low(glm::floor(at));
    const glm::dvec2 weight = at - glm::dvec2(low);
    value = glm::mix(glm::mix(picture.texel(low, display), picture.texel(low + glm::ivec2(1, 0), display), weight.x),
                     glm::mix(picture.texel(low + glm::ivec2(0, 1), display),
                              picture.texel(low + glm::ivec2(1, 1), display), weight.x),
                     weight.y);
  }
  glm::dvec3 c(value);
  if (!display.legend) c *= std::exp2(double(display.exposure_stops));
  if (display.encoding != ColorEncoding::hdr) {
    if (!display.legend && display.tone_map == ToneMap::neutral) {
      const auto mapped = image::tone_map_neutral({float(c.x), float(c.y), float(c.z)});
      c = {mapped[0], mapped[1], mapped[2]};
    } else if (!display.legend && display.tone_map == ToneMap::filmic) {
      c = (c * (2.51 * c + 0.03)) / (c * (2.43 * c + 0.59) + 0.14);
    }
    c = glm::clamp(c, 0.0, 1.0);
  }
  if (display.encoding != ColorEncoding::srgb) return {c, value.a};
  // The alpha that is exact over white for the smallest channel.
  const double least = std::min({c.x, c.y, c.z});
  const double white = image::srgb_encode(float(std::min(least + 1.0 - value.a, 1.0)));
  const double alpha = std::clamp(1.0 - (white - image::srgb_encode(float(least))), 0.0, 1.0);
  for (int k = 0; k < 3; ++k) c[k] = image::srgb_encode(float(c[k]));
  return {c, alpha};
}

class Compositing : public cumulet::test::GlTest {
 protected:
  static constexpr glm::ivec2 size{40, 28};

  void SetUp() override {
    GlTest::SetUp();
    if (gl_) compositor_.emplace(gl_, programs_);
  }

  /// A framebuffer with a color attachment of this format (samples 0: not multisampled) and depth, cleared to known
  /// values.
  struct Target {
    Object color, depth, framebuffer;
  };
  [[nodiscard]] Target make_target(GLenum format, int samples, float depth = 1.0F) const {
    Target target;
    if (samples > 0) {
      target.color = gl::make_texture_2d_multisample(gl_, format, samples, size.x, size.y, "colour");
      target.depth = gl::make_texture_2d_multisample(gl_, GL_DEPTH_COMPONENT32F, samples, size.x, size.y, "depth");
    } else {
      target.color = gl::make_texture_2d(gl_, format, size.x, size.y, "colour");
      target.depth = gl::make_texture_2d(gl_, GL_DEPTH_COMPONENT32F, size.x, size.y, "depth");
    }
    target.framebuffer = gl::make_framebuffer(gl_);
    gl_->NamedFramebufferTexture(target.framebuffer.name(), GL_COLOR_ATTACHMENT0, target.color.name(), 0);
    gl_->NamedFramebufferTexture(target.framebuffer.name(), GL_DEPTH_ATTACHMENT, target.depth.name(), 0);
    gl_->ClearNamedFramebufferfv(target.framebuffer.name(), GL_COLOR, 0, &before.x);
    gl_->ClearNamedFramebufferfv(target.framebuffer.name(), GL_DEPTH, 0, &depth);
    return target;
  }
  /// The stored values, neither decoded nor clamped. Multisampled targets are resolved first.
  [[nodiscard]] std::vector<glm::vec4> read(const Target& target, GLenum format, int samples) const {
    GLuint texture = target.color.name();
    Target resolved;
    if (samples > 0) {
      resolved = make_target(format, 0);
      gl_->BlitNamedFramebuffer(target.framebuffer.name(), resolved.framebuffer.name(), 0, 0, size.x, size.y, 0, 0,
                                size.x, size.y, GL_COLOR_BUFFER_BIT, GL_NEAREST);
      texture = resolved.color.name();
    }
    std::vector<glm::vec4> pixels(static_cast<std::size_t>(size.x * size.y));
    if (format == GL_RGBA8 || format == GL_SRGB8_ALPHA8) {
      std::vector<glm::u8vec4> bytes(pixels.size());
      gl_->GetTextureImage(texture, 0, GL_RGBA, GL_UNSIGNED_BYTE, static_cast<GLsizei>(bytes.size() * 4), bytes.data());
      for (std::size_t i = 0; i < bytes.size(); ++i) pixels[i] = glm::vec4(bytes[i]);
    } else {
      gl_->GetTextureImage(texture, 0, GL_RGBA, GL_FLOAT, static_cast<GLsizei>(pixels.size() * 16), pixels.data());
    }
    return pixels;
  }
  [[nodiscard]] std::vector<float> read_depth(const Target& target) const {
    std::vector<float> depths(static_cast<std::size_t>(size.x * size.y));
    gl_->GetTextureImage(target.depth.name(), 0, GL_DEPTH_COMPONENT, GL_FLOAT, static_cast<GLsizei>(depths.size() * 4),
                         depths.data());
    return depths;
  }

  /// Draws and compares every pixel of the target, inside and outside of the viewport. Bytes must be the nearest to the
  /// exact value, unless that is within `slack` of a half.
  void check(const Picture& picture, const Display& display, const FrameTarget& wanted, GLenum format, int samples) {
    const Target made = make_target(format, samples);
    const std::vector<glm::vec4> untouched = read(made, format, samples);
    FrameTarget target = wanted;
    target.wait = render::Wait::always;
    target.framebuffer = made.framebuffer.name();
    {
      const StateGuard guard(*gl_);
      compositor_->draw(picture.textures(), display, target);
    }
    const std::vector<glm::vec4> got = read(made, format, samples);
    const glm::ivec4 viewport = target.viewport;
    const bool bytes = format == GL_RGBA8 || format == GL_SRGB8_ALPHA8;
    const bool srgb_target = format == GL_SRGB8_ALPHA8;
    for (int y = 0; y < size.y; ++y) {
      for (int x = 0; x < size.x; ++x) {
        const auto i = static_cast<std::size_t>(y * size.x + x);
        const glm::ivec2 in(x - viewport.x, y - viewport.y);
        if (in.x < 0 || in.y < 0 || in.x >= viewport.z || in.y >= viewport.w) {
          ASSERT_EQ(got[i], untouched[i]) << x << ' ' << y;
          continue;
        }
        const int row = target.flip_y ? in.y : viewport.w - 1 - in.y;
        glm::dvec4 expected = evaluate(picture, display, {in.x, row}, {viewport.z, viewport.w});
        if (target.blend_over) {
          glm::dvec4 below = before;
          if (bytes && !srgb_target) below = glm::dvec4(untouched[i]) / 255.0;
          if (srgb_target) {
            for (int k = 0; k < 3; ++k) below[k] = image::srgb_decode(untouched[i][k] / 255.0F);
            below.a = untouched[i].a / 255.0;
          }
          expected += below * (1.0 - expected.a);
        }
        if (srgb_target) {
          for (int k = 0; k < 3; ++k) expected[k] = image::srgb_encode(float(expected[k]));
        }
        for (int k = 0; k < 4; ++k) {
          const double want = bytes ? 255.0 * std::min(expected[k], 1.0) : expected[k];
          // llvmpipe blends in bytes: it rounds source, alpha and product. NVIDIA's pow() is slightly inexact.
          const double byte_slack = target.blend_over && expected.a < 1.0 ? 1.6 : 0.6;
          const double slack = bytes ? (srgb_target ? 0.85 : byte_slack) : 4e-5 * std::max(1.0, expected[k]);
          ASSERT_NEAR(got[i][k], want, slack) << "pixel " << x << ',' << y << " channel " << k;
        }
      }
    }
  }

  glm::vec4 before{0.25F, 0.5F, 0.125F, 0.75F};
  std::optional<render::Compositor> compositor_;
};
CUMULET_ON_BACKENDS(Compositing);

TEST_P(Compositing, EveryEncodingCurveAndBackground) {
  const Picture picture(gl_, 21, 13, false);
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
  const std::vector<Picture> pictures = [this] {
    std::vector<Picture> made;
    for (const glm::ivec2 s : {glm::ivec2(23, 17), glm::ivec2(6, 4), glm::ivec2(1, 1), glm::ivec2(37, 29)}) {
      made.emplace_back(gl_, s.x, s.y, false);
    }
    return made;
  }();
  Display display;
  display.transparent = true;
  for (const Picture& picture : pictures) {
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

TEST_P(Compositing, UnsampledPixelsAreFilledFromNeighbors) {
  for (const glm::ivec2 s : {glm::ivec2(40, 28), glm::ivec2(11, 9), glm::ivec2(1, 1)}) {
    Picture picture(gl_, s.x, s.y, false);
    picture.holes = true;
    FrameTarget target;
    target.viewport = {0, 0, 40, 28};
    for (const bool transparent : {false, true}) {
      Display display;
      display.transparent = transparent;
      check(picture, display, target, GL_RGBA32F, 0);
    }
  }
}

TEST_P(Compositing, BackgroundColorIsBehindEverything) {
  Picture picture(gl_, 21, 13, false);
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
  const Picture picture(gl_, 21, 13, true);
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
  const Picture picture(gl_, 16, 16, false);
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
  const Picture picture(gl_, 20, 12, false);
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
  const Picture picture(gl_, 8, 8, false);
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

// The upper rows have no samples yet, more rows than neighbors can fill.
TEST_P(Compositing, UnsampledPixelsShowThePreviousImage) {
  const auto flat = [&](int side, const glm::vec4& color, int empty_rows) {
    Picture picture(gl_, side, side, false);
    picture.holes = true;
    for (int i = 0; i < side * side; ++i) {
      const unsigned samples = i / side < empty_rows ? 0U : 2U;
      picture.sum[static_cast<std::size_t>(i)] = static_cast<float>(samples) * color;
      picture.background[static_cast<std::size_t>(i)] = glm::vec4(0.0F, 0.0F, samples == 0 ? 1.0F : 0.0F, 0.0F);
      picture.counts[static_cast<std::size_t>(i)] = {samples, 0U};
    }
    gl_->TextureSubImage2D(picture.sum_texture.name(), 0, 0, 0, side, side, GL_RGBA, GL_FLOAT, picture.sum.data());
    gl_->TextureSubImage2D(picture.background_texture.name(), 0, 0, 0, side, side, GL_RGBA, GL_FLOAT,
                           picture.background.data());
    gl_->TextureSubImage2D(picture.counts_texture.name(), 0, 0, 0, side, side, GL_RG_INTEGER, GL_UNSIGNED_INT,
                           picture.counts.data());
    return picture;
  };
  const Picture earlier = flat(4, {0.0F, 1.0F, 0.0F, 1.0F}, 0);
  const Picture now = flat(16, {1.0F, 0.0F, 0.0F, 1.0F}, 8);
  const Target made = make_target(GL_RGBA32F, 0);
  FrameTarget target;
  target.framebuffer = made.framebuffer.name();
  target.viewport = {0, 0, 16, 16};
  target.blend_over = false;
  Display display;
  display.encoding = ColorEncoding::hdr;
  for (const bool has_before : {true, false}) {
    PictureTextures textures = now.textures();
    if (has_before) {
      textures.sum_before = earlier.sum_texture.name();
      textures.background_before = earlier.background_texture.name();
      textures.counts_before = earlier.counts_texture.name();
    }
    {
      const StateGuard guard(*gl_);
      compositor_->draw(textures, display, target);
    }
    const std::vector<glm::vec4> got = read(made, GL_RGBA32F, 0);
    for (int row = 0; row < 16; ++row) {
      const glm::vec4 value = got[static_cast<std::size_t>((15 - row) * size.x + 5)];
      EXPECT_EQ(value.x > 0.0F, row >= 7) << row;  // one empty row is filled from its neighbors
      EXPECT_EQ(value.y > 0.0F, row < 7 && has_before) << row;
      EXPECT_EQ(value.z > 0.0F, row < 7 && !has_before) << row;  // only the background
    }
  }
}

// Draws as many images as may be in flight, alternating between two displays. Each is drawn as requested, with programs
// that are already compiled.
TEST_P(Compositing, BackgroundChangesAreDrawnWhileTheGpuIsBusy) {
  gl::find_out_dispatches(gl_, *programs_);
  const Picture picture(gl_, 21, 13, false);
  const Target made = make_target(GL_RGBA32F, 0);
  FrameTarget target;
  target.viewport = {7, 5, 21, 13};
  target.blend_over = false;
  target.framebuffer = made.framebuffer.name();
  const auto draw = [&](bool transparent) {
    Display display;
    display.transparent = transparent;
    const StateGuard guard(*gl_);
    compositor_->draw(picture.textures(), display, target);
  };
  for (const bool transparent : {false, true}) {
    check(picture, {.transparent = transparent}, target, GL_RGBA32F, 0);
  }
  const std::size_t programs = programs_->counts().asked;
  bool busy = false;
  // On a busy machine, the GPU work may have finished by then; try again with more.
  for (double ms = 500.0; !busy && ms <= 8000.0; ms *= 4.0) {
    const cumulet::test::BusyHost host(*gl_, ms);
    host.queue();
    const gl::Fence queued(gl_);
    for (int i = 0; i < 8; ++i) {
      draw(i % 2 == 1);
      EXPECT_FALSE(compositor_->lags());
    }
    busy = !queued.passed();
  }
  EXPECT_TRUE(busy);
  EXPECT_EQ(programs_->counts().asked, programs);
  const std::vector<glm::vec4> got = read(made, GL_RGBA32F, 0);
  check(picture, {.transparent = true}, target, GL_RGBA32F, 0);
  draw(true);
  EXPECT_EQ(read(made, GL_RGBA32F, 0), got);
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
  const Picture like(gl_, 3, 2, false);
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

TEST_P(Compositing, EmptyImageDrawsTheBackground) {
  const Picture picture(gl_, 8, 8, false);
  const Target made = make_target(GL_RGBA8, 0);
  const std::vector<glm::vec4> untouched = read(made, GL_RGBA8, 0);
  FrameTarget target;
  target.framebuffer = made.framebuffer.name();
  target.blend_over = false;
  const StateGuard guard(*gl_);
  compositor_->draw(picture.textures(), {}, target);  // a viewport of size 0
  target.viewport = {0, 0, 8, 8};
  compositor_->draw({}, {}, target);
  EXPECT_EQ(read(made, GL_RGBA8, 0), untouched);
}

TEST_P(Compositing, InvalidTargetsAreReported) {
  const Picture picture(gl_, 8, 8, false);
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
