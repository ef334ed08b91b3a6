// Display LUTs: interpolation against references, frames and read-back through the C and C++ API.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <random>
#include <vector>

#include "render/passes/display.hpp"
#include "support/c_viewer.hpp"

namespace {

using namespace cumulet;
using glm::vec3;
using render::DisplayLut;
using render::LutShaper;

using Color = std::function<vec3(const vec3& at)>;

vec3 same(const vec3& at) { return at; }
vec3 bent(const vec3& at) {
  return {0.1F + 0.8F * at.y * at.z, 0.9F * at.x * at.x, 0.05F + 0.9F * std::sqrt(at.x * at.y)};
}

/// A LUT of colors at positions in [0, 1].
DisplayLut lut_of(int size, const Color& color, LutShaper shaper = LutShaper::linear, glm::vec2 domain = {0.0F, 1.0F}) {
  DisplayLut lut{shaper, domain, size, {}};
  const auto last = static_cast<float>(size - 1);
  for (int b = 0; b < size; ++b) {
    for (int g = 0; g < size; ++g) {
      for (int r = 0; r < size; ++r) lut.points.push_back(color(vec3(r, g, b) / last));
    }
  }
  return lut;
}

std::vector<vec3> random_values(int count, float most) {
  std::mt19937 random(7);
  std::uniform_real_distribution<float> value(0.0F, most);
  std::vector<vec3> values;
  for (int i = 0; i < count; ++i) values.emplace_back(value(random), value(random), value(random));
  // Equal fractions, and the corners.
  for (const float x : {0.0F, 0.25F, 1.0F}) {
    for (const float y : {0.0F, 0.25F, 1.0F}) {
      for (const float z : {0.0F, 0.25F, 1.0F}) values.push_back(most * vec3(x, y, z));
    }
  }
  return values;
}

/// Tetrahedral interpolation by a walk from the lowest corner: axis by axis, the largest fraction first.
vec3 walked(const DisplayLut& lut, const vec3& position) {
  std::array<int, 3> low{};
  std::array<double, 3> fraction{};
  for (int c = 0; c < 3; ++c) {
    const double at = double{position[c]} * (lut.size - 1);
    low[static_cast<std::size_t>(c)] = std::min(static_cast<int>(at), lut.size - 2);
    fraction[static_cast<std::size_t>(c)] = at - low[static_cast<std::size_t>(c)];
  }
  const auto point = [&lut](const std::array<int, 3>& p) {
    return glm::dvec3(lut.points[static_cast<std::size_t>((p[2] * lut.size + p[1]) * lut.size + p[0])]);
  };
  std::array<std::size_t, 3> axes{0, 1, 2};
  std::ranges::sort(axes, std::ranges::greater(), [&](std::size_t axis) { return fraction[axis]; });
  glm::dvec3 color = point(low);
  for (const std::size_t axis : axes) {
    const glm::dvec3 before = point(low);
    ++low[axis];
    color += fraction[axis] * (point(low) - before);
  }
  return vec3(glm::clamp(color, 0.0, 1.0));
}

TEST(DisplayLut, IdentityIsExact) {
  for (const int size : {2, 17, 33, 65}) {
    const DisplayLut lut = lut_of(size, same);
    for (const vec3& value : random_values(2000, 1.5F)) {
      const vec3 got = encoded_color(lut, value);
      for (int c = 0; c < 3; ++c) ASSERT_NEAR(got[c], std::min(value[c], 1.0F), 3e-7F) << size;
    }
  }
}

TEST(DisplayLut, InterpolatesInTetrahedra) {
  for (const int size : {2, 5, 17}) {
    const DisplayLut lut = lut_of(size, bent);
    for (const vec3& value : random_values(2000, 1.0F)) {
      const vec3 got = encoded_color(lut, value);
      const vec3 expected = walked(lut, value);
      for (int c = 0; c < 3; ++c) ASSERT_NEAR(got[c], expected[c], 2e-6F) << size;
    }
  }
}

TEST(DisplayLut, ShapersMapTheirDomain) {
  const DisplayLut log = lut_of(33, same, LutShaper::log2, {-8.0F, 6.0F});
  for (const float stops : {-8.0F, -3.3F, 0.0F, 4.5F, 6.0F})
    EXPECT_NEAR(encoded_color(log, vec3(std::exp2(stops))).x, (stops + 8.0F) / 14.0F, 1e-6F);
  EXPECT_EQ(encoded_color(log, vec3(0.0F)), vec3(0.0F));
  EXPECT_NEAR(encoded_color(log, vec3(1e30F)).y, 1.0F, 1e-6F);
  const DisplayLut srgb = lut_of(17, same, LutShaper::srgb);
  for (const float x : {0.0F, 0.002F, 0.2F, 1.0F})
    EXPECT_NEAR(encoded_color(srgb, vec3(x)).z, core::cm_srgb_encode(x), 1e-6F);
  const DisplayLut wide = lut_of(17, same, LutShaper::linear, {-1.0F, 3.0F});
  EXPECT_NEAR(encoded_color(wide, vec3(0.0F)).x, 0.25F, 1e-6F);
  EXPECT_NEAR(encoded_color(wide, vec3(3.0F)).x, 1.0F, 1e-6F);
}

TEST(DisplayLut, BytesUseTheLut) {
  render::Display display;
  display.exposure_stops = 1.0F;
  display.lut = std::make_shared<const DisplayLut>(lut_of(17, bent));
  const std::vector<float> linear{0.2F, 0.1F, 0.05F, 0.5F, std::numeric_limits<float>::quiet_NaN(), -1.0F, 7.0F, 1.0F};
  std::vector<std::uint8_t> bytes(linear.size());
  render::to_display(linear, display, bytes);
  const vec3 first = walked(*display.lut, {0.4F, 0.2F, 0.1F});
  for (int c = 0; c < 3; ++c) EXPECT_EQ(bytes[static_cast<std::size_t>(c)], std::lround(255.0F * first[c]));
  const vec3 second = walked(*display.lut, {0.0F, 0.0F, 1.0F});
  for (int c = 0; c < 3; ++c) EXPECT_EQ(bytes[static_cast<std::size_t>(4 + c)], std::lround(255.0F * second[c]));
  EXPECT_EQ(bytes[3], 255);
  display.legend = true;  // a debug view
  render::to_display(linear, display, bytes);
  EXPECT_EQ(bytes[0], std::lround(255.0F * core::cm_srgb_encode(0.2F)));
}

// ---- frames ----

class LutFrames : public test::CViewerTest {
 protected:
  static constexpr int side = 24;
  LutFrames() : CViewerTest(side, side) {}

  void SetUp() override {
    CViewerTest::SetUp();
    if (IsSkipped()) return;
    gl_ = test::load_gl(headless::Context::get_proc, context_.get());
    const test::VolumeRef ball = test::make_ball(12, 2.0F);
    ASSERT_EQ(cumulet_set_volume(v_, ball.get()), CUMULET_OK);
    converge();
  }

  std::vector<std::uint8_t> converge(cumulet_color_encoding encoding = CUMULET_COLOR_SRGB, GLenum format = GL_RGBA8) {
    const test::HostTarget target(gl_, side, side, format);
    draw(target, encoding);
    return target.pixels();
  }
  void draw(const test::HostTarget& target, cumulet_color_encoding encoding) {
    auto frame = target.frame();
    frame.flip_y = 1;
    frame.color = encoding;
    auto result = test::make_desc<cumulet_frame_result>();
    // The LUT's program may still be compiling, also when the image has converged.
    for (int i = 0; i < 2000; ++i) {
      ASSERT_EQ(cumulet_render(v_, &frame, &result), CUMULET_OK) << cumulet_last_error(v_);
      if ((result.flags & CUMULET_RENDER_CONVERGED) != 0 && (result.flags & CUMULET_RENDER_INCOMPLETE) == 0) return;
    }
    FAIL() << "does not converge";
  }
  std::vector<std::uint8_t> read() {
    std::vector<std::uint8_t> bytes(std::size_t{4} * side * side);
    EXPECT_EQ(cumulet_read_display(v_, bytes.data(), bytes.size()), CUMULET_OK) << cumulet_last_error(v_);
    return bytes;
  }
  cumulet_status set(const DisplayLut& lut) {
    auto desc = test::make_desc<cumulet_display_lut_desc>();
    desc.values = &lut.points.front().x;
    desc.value_count = 3 * lut.points.size();
    desc.size = static_cast<std::uint32_t>(lut.size);
    desc.shaper = static_cast<cumulet_lut_shaper>(lut.shaper);
    desc.domain_min = lut.domain.x;
    desc.domain_max = lut.domain.y;
    return cumulet_set_display_lut(v_, &desc);
  }
  static void expect_near(const std::vector<std::uint8_t>& a, const std::vector<std::uint8_t>& b, int step) {
    ASSERT_EQ(a.size(), b.size());
    for (std::size_t i = 0; i < a.size(); ++i) ASSERT_NEAR(int{a[i]}, int{b[i]}, step) << "byte " << i;
  }

  GladGLContext gl_{};
};
CUMULET_ON_BACKENDS(LutFrames);

TEST_P(LutFrames, IdentityWithTheSrgbShaperIsClipping) {
  const std::vector<std::uint8_t> neutral = converge();
  auto display = test::make_desc<cumulet_display_desc>();
  display.tone_map = CUMULET_TONE_MAP_CLIP;
  ASSERT_EQ(cumulet_set_display(v_, &display), CUMULET_OK);
  const std::vector<std::uint8_t> clipped = converge();
  const std::vector<std::uint8_t> read_clipped = read();
  display.tone_map = CUMULET_TONE_MAP_NEUTRAL;
  ASSERT_EQ(cumulet_set_display(v_, &display), CUMULET_OK);
  ASSERT_EQ(set(lut_of(33, same, LutShaper::srgb)), CUMULET_OK);
  expect_near(converge(), clipped, 1);
  expect_near(read(), read_clipped, 1);
  // Another tone map changes nothing, and the LUT is kept when the display settings change.
  display.tone_map = CUMULET_TONE_MAP_FILMIC;
  ASSERT_EQ(cumulet_set_display(v_, &display), CUMULET_OK);
  expect_near(converge(), clipped, 1);
  display.tone_map = CUMULET_TONE_MAP_NEUTRAL;
  ASSERT_EQ(cumulet_set_display(v_, &display), CUMULET_OK);
  ASSERT_EQ(cumulet_set_display_lut(v_, nullptr), CUMULET_OK);
  expect_near(converge(), neutral, 0);
}

TEST_P(LutFrames, FramesMatchTheReferenceInEachEncoding) {
  std::vector<float> linear(std::size_t{4} * side * side);
  ASSERT_EQ(cumulet_read_linear(v_, linear.data(), linear.size()), CUMULET_OK);
  for (const LutShaper shaper : {LutShaper::linear, LutShaper::log2}) {
    const glm::vec2 domain = shaper == LutShaper::log2 ? glm::vec2(-10.0F, 4.0F) : glm::vec2(0.0F, 2.0F);
    const DisplayLut lut = lut_of(17, bent, shaper, domain);
    ASSERT_EQ(set(lut), CUMULET_OK);
    std::vector<vec3> expected;
    for (std::size_t i = 0; i < linear.size(); i += 4) {
      vec3 position(0.0F);
      for (int c = 0; c < 3; ++c)
        position[c] =
            core::cm_lut_position(linear[i + static_cast<std::size_t>(c)], static_cast<std::uint32_t>(shaper), domain);
      expected.push_back(walked(lut, position));
    }
    const std::vector<std::uint8_t> bytes = read();
    const std::vector<std::uint8_t> drawn = converge();
    const std::vector<std::uint8_t> decoded = converge(CUMULET_COLOR_SRGB_FRAMEBUFFER, GL_SRGB8_ALPHA8);
    const test::HostTarget floats(gl_, side, side, GL_RGBA32F);
    draw(floats, CUMULET_COLOR_LINEAR);
    const std::vector<float> values = floats.floats();
    for (std::size_t i = 0; i < linear.size(); ++i) {
      if (i % 4 == 3) continue;
      const float encoded = expected[i / 4][static_cast<int>(i % 4)];
      const int byte = static_cast<int>(std::lround(255.0F * encoded));
      ASSERT_NEAR(bytes[i], byte, 1) << i;
      ASSERT_NEAR(drawn[i], byte, 1) << i;
      ASSERT_NEAR(decoded[i], byte, 1) << i;
      ASSERT_NEAR(values[i], core::cm_srgb_decode(encoded), 1e-3F) << i;
    }
  }
}

TEST_P(LutFrames, HdrTargetsAreNotChanged) {
  const test::HostTarget before(gl_, side, side, GL_RGBA32F);
  draw(before, CUMULET_COLOR_HDR);
  ASSERT_EQ(set(lut_of(17, bent)), CUMULET_OK);
  const test::HostTarget after(gl_, side, side, GL_RGBA32F);
  draw(after, CUMULET_COLOR_HDR);
  EXPECT_EQ(before.floats(), after.floats());
}

TEST_P(LutFrames, UnsuitableLutsAreRefused) {
  const DisplayLut lut = lut_of(3, same);
  auto desc = test::make_desc<cumulet_display_lut_desc>();
  const auto refused = [&](const char* line) {
    EXPECT_EQ(cumulet_set_display_lut(v_, &desc), CUMULET_ERROR_INVALID_ARGUMENT);
    EXPECT_STREQ(cumulet_last_error(v_), line);
  };
  refused("size is not from 2 to 65");
  desc.size = 66;
  refused("size is not from 2 to 65");
  desc.size = 3;
  refused("value_count is not 3 x size^3");
  desc.value_count = 81;
  refused("values are NULL");
  std::vector<float> values(81, 0.5F);
  values[7] = std::numeric_limits<float>::infinity();
  desc.values = values.data();
  refused("values are not finite");
  values[7] = 0.5F;
  desc.domain_min = 1.0F;
  refused("domain_min is not below domain_max, or one is not from -1e6 to 1e6");
  desc.domain_min = 0.0F;
  desc.shaper = static_cast<cumulet_lut_shaper>(3);
  refused("shaper is unknown");
  desc.shaper = CUMULET_LUT_SHAPER_LINEAR;
  EXPECT_EQ(cumulet_set_display_lut(v_, &desc), CUMULET_OK);
  EXPECT_EQ(set(lut), CUMULET_OK);
}

}  // namespace
