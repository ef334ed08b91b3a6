// Emission without opacity, blended over a host's target: each blend mode, encoding and format compared with radiance.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "gl/state_guard.hpp"
#include "image.hpp"
#include "render/passes/compositor.hpp"
#include "straight_alpha.hpp"
#include "support/flat_picture.hpp"
#include "support/gl_state.hpp"

namespace {

using cumulet::gl::Object;
using cumulet::gl::StateGuard;
using cumulet::render::ColorEncoding;
using cumulet::render::Display;
using cumulet::render::FrameTarget;
using cumulet::render::ToneMap;
using cumulet::test::FlatPicture;
namespace core = cumulet::core;
namespace gl = cumulet::gl;
namespace image = cumulet::image;
namespace render = cumulet::render;

float encode(float x) { return image::srgb_encode(std::clamp(x, 0.0F, 1.0F)); }

// Premultiplied: fire, thin emissive smoke, smoke, something dark, something opaque, nothing.
const std::vector<glm::vec4> pixels{{0.2F, 0.2F, 0.2F, 0.0F},    {1.0F, 0.35F, 0.03F, 0.0F},  {3.0F, 1.0F, 0.2F, 0.0F},
                                    {0.5F, 0.3F, 0.1F, 0.05F},   {0.08F, 0.08F, 0.08F, 0.1F}, {0.4F, 0.4F, 0.4F, 0.5F},
                                    {0.02F, 0.02F, 0.02F, 0.5F}, {0.6F, 0.5F, 0.4F, 1.0F},    {0.0F, 0.0F, 0.0F, 0.0F}};
const std::vector<std::size_t> gray_pixels{0, 4, 5, 6, 8};

class PremultipliedAlpha : public cumulet::test::GlTest {
 protected:
  /// Draws over a target of this format that is filled with a value. Returns the stored values, not decoded.
  std::vector<glm::vec4> draw(const Display& display, GLenum format, bool blend_over, glm::vec4 before) {
    const FlatPicture picture(gl_, size, pixels);
    const Object color = gl::make_texture_2d(gl_, format, size.x, size.y, "color");
    const Object framebuffer = gl::make_framebuffer(gl_);
    gl_->NamedFramebufferTexture(framebuffer.name(), GL_COLOR_ATTACHMENT0, color.name(), 0);
    // The clear value is stored without encoding.
    for (int k = 0; k < 3 && format == GL_SRGB8_ALPHA8; ++k) before[k] = encode(before[k]);
    gl_->ClearTexImage(color.name(), 0, GL_RGBA, GL_FLOAT, &before);
    FrameTarget target;
    target.framebuffer = framebuffer.name();
    target.viewport = {0, 0, size};
    target.flip_y = true;
    target.blend_over = blend_over;
    target.wait = render::Wait::always;
    const StateGuard guard(*gl_);
    render::Compositor compositor(gl_, programs_);
    compositor.draw(picture.textures(), display, target);
    std::vector<glm::vec4> got(pixels.size());
    if (format == GL_SRGB8_ALPHA8) {
      std::vector<glm::u8vec4> bytes(pixels.size());
      gl_->GetTextureImage(color.name(), 0, GL_RGBA, GL_UNSIGNED_BYTE, static_cast<GLsizei>(bytes.size() * 4),
                           bytes.data());
      for (std::size_t i = 0; i < bytes.size(); ++i) got[i] = glm::vec4(bytes[i]) / 255.0F;
    } else {
      gl_->GetTextureImage(color.name(), 0, GL_RGBA, GL_FLOAT, static_cast<GLsizei>(got.size() * 16), got.data());
    }
    return got;
  }
  static Display display_of(ColorEncoding encoding, ToneMap tone_map = ToneMap::clip) {
    Display display;
    display.encoding = encoding;
    display.tone_map = tone_map;
    display.transparent = true;
    return display;
  }
  static constexpr glm::ivec2 size{3, 3};
};
CUMULET_ON_BACKENDS(PremultipliedAlpha);

TEST_P(PremultipliedAlpha, LinearTargetsHoldTheRadianceOverAnyBackdrop) {
  struct Case {
    ColorEncoding encoding;
    GLenum format;
    float step;  // of the format
  };
  for (const Case& c : {Case{ColorEncoding::linear, GL_RGBA8, 1.0F / 255.0F},
                        Case{ColorEncoding::linear, GL_RGBA16F, 2e-3F}, Case{ColorEncoding::linear, GL_RGBA32F, 1e-5F},
                        Case{ColorEncoding::hdr, GL_RGBA16F, 4e-3F}, Case{ColorEncoding::hdr, GL_RGBA32F, 1e-5F},
                        Case{ColorEncoding::srgb_framebuffer, GL_SRGB8_ALPHA8, 1.0F / 255.0F}}) {
    for (const bool over : {true, false}) {
      for (const float backdrop : {0.0F, 0.1F, 0.5F, 1.0F}) {
        SCOPED_TRACE(testing::Message() << "encoding " << int(c.encoding) << " format " << std::hex << c.format
                                        << " over " << over << " backdrop " << backdrop);
        const auto got = draw(display_of(c.encoding), c.format, over, glm::vec4(glm::vec3(backdrop), 1.0F));
        for (std::size_t i = 0; i < pixels.size(); ++i) {
          for (int k = 0; k < 4; ++k) {
            float radiance = pixels[i][k];
            if (c.encoding != ColorEncoding::hdr) radiance = std::min(radiance, 1.0F);
            if (over) radiance += (k == 3 ? 1.0F : backdrop) * (1.0F - pixels[i].a);
            const bool bytes = c.format == GL_RGBA8 || c.format == GL_SRGB8_ALPHA8;
            if (bytes) radiance = std::min(radiance, 1.0F);
            if (c.format == GL_SRGB8_ALPHA8 && k < 3) radiance = encode(radiance);
            ASSERT_NEAR(got[i][k], radiance, c.step * (over && bytes ? 1.7F : 0.7F))
                << "pixel " << i << " channel " << k;
          }
        }
      }
    }
  }
}

// GL blends encoded values there, which are not sums of light: exact over black and white, approximate in between.
TEST_P(PremultipliedAlpha, EncodedTargetsAreExactOverBlackAndWhite) {
  for (const GLenum format : {GL_RGBA8, GL_RGBA16F, GL_RGBA32F}) {
    for (const float backdrop : {0.0F, 0.1F, 0.3F, 0.6F, 1.0F}) {
      SCOPED_TRACE(testing::Message() << "format " << std::hex << format << " backdrop " << backdrop);
      const auto got =
          draw(display_of(ColorEncoding::srgb), format, true, glm::vec4(glm::vec3(encode(backdrop)), 1.0F));
      const bool exact = backdrop == 0.0F || backdrop == 1.0F;
      for (std::size_t i = 0; i < pixels.size(); ++i) {
        const bool gray = std::ranges::find(gray_pixels, i) != gray_pixels.end();
        for (int k = 0; k < 3; ++k) {
          const float radiance = std::min(pixels[i][k], 1.0F) + backdrop * (1.0F - pixels[i].a);
          const float shown = std::clamp(got[i][k], 0.0F, 1.0F);
          ASSERT_NEAR(shown, encode(radiance), exact ? 0.01F : (gray ? 0.11F : 0.32F)) << i << ' ' << k;
          if (pixels[i].a == 0.0F) {
            ASSERT_GE(got[i][k], encode(backdrop) - 0.005F) << "light darkens " << i << ' ' << k;
          }
        }
        ASSERT_NEAR(got[i].a, 1.0F, 0.005F);
      }
    }
  }
}

TEST_P(PremultipliedAlpha, OverBlackEqualsTheOpaqueImage) {
  struct Case {
    ColorEncoding encoding;
    GLenum format;
  };
  for (const Case& c : {Case{ColorEncoding::srgb, GL_RGBA8}, Case{ColorEncoding::srgb_framebuffer, GL_SRGB8_ALPHA8},
                        Case{ColorEncoding::linear, GL_RGBA16F}, Case{ColorEncoding::hdr, GL_RGBA32F}}) {
    for (const ToneMap tone_map : {ToneMap::neutral, ToneMap::filmic, ToneMap::clip}) {
      for (const bool over : {true, false}) {
        Display display = display_of(c.encoding, tone_map);
        display.exposure_stops = 0.7F;
        const auto transparent = draw(display, c.format, over, glm::vec4(0.0F));
        display.transparent = false;
        const auto opaque = draw(display, c.format, over, glm::vec4(0.0F));
        float brightest = 0.0F;
        for (std::size_t i = 0; i < pixels.size(); ++i) {
          for (int k = 0; k < 3; ++k) {
            ASSERT_EQ(transparent[i][k], opaque[i][k]) << "encoding " << int(c.encoding) << " pixel " << i;
            brightest = std::max(brightest, opaque[i][k]);
          }
        }
        EXPECT_GT(brightest, 0.5F);
        // Encoded targets use an alpha of their own, chosen for blending.
        if (c.encoding != ColorEncoding::srgb) {
          EXPECT_EQ(transparent[1].a, 0.0F) << "fire covers nothing";
        }
        EXPECT_EQ(transparent[7].a, 1.0F);
      }
    }
  }
}

// ---- straight alpha

TEST(StraightAlpha, RepresentsEmissionThroughAlpha) {
  for (const std::uint32_t curve : {CM_TONE_MAP_NEUTRAL, CM_TONE_MAP_FILMIC, CM_TONE_MAP_CLIP}) {
    for (const glm::vec4& pixel : pixels) {
      const glm::vec4 got = render::straight_display(pixel, curve);
      for (int k = 0; k < 4; ++k) {
        ASSERT_GE(got[k], 0.0F);
        ASSERT_LE(got[k], 1.00001F);
      }
      ASSERT_GE(got.a, pixel.a - 1e-6F);
      const float peak = std::max({pixel.x, pixel.y, pixel.z});
      if (pixel.a == 0.0F || pixel.a == 1.0F) {
        // Over black it equals the displayed color.
        const glm::vec3 shown = core::cm_display(glm::vec3(pixel), 1.0F, curve, true);
        for (int k = 0; k < 3; ++k) ASSERT_NEAR(got.a * got[k], shown[k], 1e-5F);
      } else if (peak <= pixel.a) {
        // A pixel without emission keeps its own color and alpha.
        const glm::vec3 straight = core::cm_display(glm::vec3(pixel) / pixel.a, 1.0F, curve, true);
        ASSERT_FLOAT_EQ(got.a, pixel.a);
        for (int k = 0; k < 3; ++k) ASSERT_NEAR(got[k], straight[k], 1e-5F);
      } else {
        // Thin smoke does not dim the emission in it.
        const glm::vec3 shown = core::cm_display(glm::vec3(pixel), 1.0F, curve, true);
        ASSERT_NEAR(got.a * got.x, shown.x, 0.06F);
      }
    }
  }
  EXPECT_EQ(render::straight_display(glm::vec4(0.0F), CM_TONE_MAP_CLIP), glm::vec4(0.0F));
}

// More radiance never gives a darker color.
TEST(StraightAlpha, IsMonotonicInRadiance) {
  for (const float alpha : {0.0F, 0.01F, 0.3F, 0.9F, 1.0F}) {
    float last = -1.0F;
    for (float x = 0.0F; x < 20.0F; x += 0.01F) {
      const glm::vec4 got = render::straight_display({x, x, x, alpha}, CM_TONE_MAP_NEUTRAL);
      ASSERT_GE(got.x * got.a, last - 1e-5F) << alpha << ' ' << x;
      last = got.x * got.a;
    }
    EXPECT_GT(last, 0.95F);
  }
}

TEST(StraightAlpha, ProgramsReportPixelsWithExcessAlpha) {
  std::vector<float> rgba;
  for (const glm::vec4& pixel : pixels) rgba.insert(rgba.end(), {pixel.x, pixel.y, pixel.z, pixel.a});
  EXPECT_EQ(cumulet::image::pixels_brighter_than_alpha(rgba, 0.0), 4U);
  EXPECT_EQ(cumulet::image::pixels_brighter_than_alpha(rgba, 1.0), 6U)
      << "brighter smoke glows, too; what is opaque does not";
  EXPECT_EQ(cumulet::image::pixels_brighter_than_alpha({}, 0.0), 0U);
  EXPECT_EQ(cumulet::image::raised_alpha_note("a.png", 0), "");
  EXPECT_EQ(cumulet::image::raised_alpha_note("a.png", 4).find("a.png: 4 pixels are brighter"), 0U);
  EXPECT_EQ(cumulet::image::raised_alpha_note("a.png", 1).find('\n'), std::string::npos);
}

}  // namespace
