#pragma once

// Pictures with computed pixels, drawn by the compositor, and their expected pixels in double precision.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <random>
#include <vector>

#include "gl/state_guard.hpp"
#include "image.hpp"
#include "render/passes/compositor.hpp"
#include "support/busy_host.hpp"
#include "support/gl_state.hpp"

namespace cumulet::test {

struct ComputedPicture {
  glm::ivec2 size{0};
  bool holes = false;
  std::vector<glm::vec4> sum;
  std::vector<glm::vec4> background;
  std::vector<glm::uvec2> counts;
  std::vector<float> z;
  gl::Object sum_texture, background_texture, counts_texture, z_texture;

  ComputedPicture(const gl::FunctionsPtr& gl, int width, int height, bool legend) : size(width, height) {
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
  [[nodiscard]] render::PictureTextures textures() const {
    render::PictureTextures textures;
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
  [[nodiscard]] glm::dvec4 texel(glm::ivec2 p, const render::Display& display) const {
    const bool hole = holes && counts[index(p)].x == 0;
    const bool all = display.shows_background();
    const glm::dvec4 value = hole ? around(glm::clamp(p, glm::ivec2(0), size - 1), all) : mean(p, all);
    if (display.transparent) return value;
    const glm::dvec3 behind(display.backdrop.value_or(glm::vec3(0.0F)));
    return {glm::dvec3(value) + (1.0 - value.a) * behind, 1.0};
  }
};

/// The value written at a pixel of the viewport, before GL blending and encoding. Row 0 is the image's top.
inline glm::dvec4 evaluate(const ComputedPicture& picture, const render::Display& display, glm::ivec2 pixel,
                           glm::ivec2 viewport) {
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
  if (display.encoding != render::ColorEncoding::hdr) {
    if (!display.legend && display.tone_map == render::ToneMap::neutral) {
      const auto mapped = image::tone_map_neutral({float(c.x), float(c.y), float(c.z)});
      c = {mapped[0], mapped[1], mapped[2]};
    } else if (!display.legend && display.tone_map == render::ToneMap::filmic) {
      c = (c * (2.51 * c + 0.03)) / (c * (2.43 * c + 0.59) + 0.14);
    }
    c = glm::clamp(c, 0.0, 1.0);
  }
  if (display.encoding != render::ColorEncoding::srgb) return {c, value.a};
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
    gl::Object color, depth, framebuffer;
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
  void check(const ComputedPicture& picture, const render::Display& display, const render::FrameTarget& wanted,
             GLenum format, int samples) {
    const Target made = make_target(format, samples);
    const std::vector<glm::vec4> untouched = read(made, format, samples);
    render::FrameTarget target = wanted;
    target.wait = render::Wait::always;
    target.framebuffer = made.framebuffer.name();
    {
      const gl::StateGuard guard(*gl_);
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

}  // namespace cumulet::test
