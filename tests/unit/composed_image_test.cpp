// Drawing an image again: copied if nothing changed, composed only in the rows that changed.

#include "render/passes/composed.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <string>
#include <vector>

#include "cumulet/cumulet.h"
#include "gl/state_guard.hpp"
#include "render/passes/compositor.hpp"
#include "support/c_host.hpp"
#include "support/flat_picture.hpp"
#include "support/gl_state.hpp"

namespace {

using cumulet::gl::Object;
using cumulet::gl::StateGuard;
using cumulet::render::ColorEncoding;
using cumulet::render::Display;
using cumulet::render::FrameTarget;
using cumulet::render::PictureTextures;
using cumulet::render::RowRange;
using cumulet::render::RowRevisions;
using cumulet::render::ToneMap;
using cumulet::test::FlatPicture;
namespace gl = cumulet::gl;
namespace render = cumulet::render;

// ---- rows

TEST(RowRevisions, ReportsRowsChangedSince) {
  RowRevisions rows;
  rows.change_all(70, 5);
  EXPECT_EQ(rows.since(4), (std::vector<RowRange>{{0, 70}}));
  EXPECT_TRUE(rows.since(5).empty());
  rows.expect();
  EXPECT_FALSE(rows.known());
  rows.change(0, 0b10010U, 0, 6);
  EXPECT_TRUE(rows.known());
  EXPECT_EQ(rows.since(5), (std::vector<RowRange>{{16, 32}, {64, 70}}));
  EXPECT_EQ(rows.since(5, 1), (std::vector<RowRange>{{15, 33}, {63, 70}}));
  EXPECT_TRUE(rows.since(6).empty());
  // One tile that begins inside a band, and one given by a bit of the second word.
  rows.change_all(2048, 7);
  rows.expect();
  rows.change(1000, 1U, 1U, 8);
  EXPECT_EQ(rows.since(7), (std::vector<RowRange>{{992, 1024}, {1504, 1536}}));
}

// ---- the compositor

class ComposedImageCache : public cumulet::test::GlTest {
 protected:
  static constexpr glm::ivec2 size{40, 64};

  void SetUp() override {
    GlTest::SetUp();
    if (!gl_) return;
    gl_->dispatches_in_call = true;
    compositor_.emplace(gl_, programs_);
    picture_.emplace(gl_, size, colors(0.0F));
    target_ = make_target(GL_RGBA8);
    frame_.viewport = {0, 0, size};
    rows_.change_all(static_cast<std::uint32_t>(size.y), revision_);
  }
  static std::vector<glm::vec4> colors(float more) {
    std::vector<glm::vec4> colors;
    for (int y = 0; y < size.y; ++y) {
      for (int x = 0; x < size.x; ++x)
        colors.emplace_back(float(x) / 50.0F, float(y) / 80.0F, more, 0.5F + 0.5F * float(x % 3 == 0));
    }
    return colors;
  }
  struct Target {
    Object color, depth, framebuffer;
    GLenum format = GL_RGBA8;
  };
  [[nodiscard]] Target make_target(GLenum format) const {
    Target made{gl::make_texture_2d(gl_, format, 60, 80, "color"),
                gl::make_texture_2d(gl_, GL_DEPTH_COMPONENT32F, 60, 80, "depth"), gl::make_framebuffer(gl_), format};
    gl_->NamedFramebufferTexture(made.framebuffer.name(), GL_COLOR_ATTACHMENT0, made.color.name(), 0);
    gl_->NamedFramebufferTexture(made.framebuffer.name(), GL_DEPTH_ATTACHMENT, made.depth.name(), 0);
    return made;
  }
  void clear(glm::vec4 before, float depth = 1.0F) const {
    gl_->ClearTexImage(target_.color.name(), 0, GL_RGBA, GL_FLOAT, &before);
    gl_->ClearTexImage(target_.depth.name(), 0, GL_DEPTH_COMPONENT, GL_FLOAT, &depth);
  }
  [[nodiscard]] PictureTextures textures() const {
    PictureTextures textures = picture_->textures();
    textures.revision = revision_;
    textures.rows = &rows_;
    return textures;
  }
  void draw(render::Compositor& compositor) {
    FrameTarget target = frame_;
    target.framebuffer = target_.framebuffer.name();
    target.wait = render::Wait::always;
    const StateGuard guard(*gl_);
    compositor.draw(textures(), display_, target);
  }
  [[nodiscard]] std::vector<glm::vec4> pixels() const {
    std::vector<glm::vec4> got(60 * 80);
    gl_->GetTextureImage(target_.color.name(), 0, GL_RGBA, GL_FLOAT, static_cast<GLsizei>(got.size() * 16), got.data());
    return got;
  }
  /// Draws with a new compositor into a cleared target.
  std::vector<glm::vec4> fresh(glm::vec4 before = glm::vec4(0.0F)) {
    render::Compositor other(gl_, programs_);
    clear(before);
    draw(other);
    return pixels();
  }
  std::vector<glm::vec4> again(glm::vec4 before = glm::vec4(0.0F)) {
    clear(before);
    draw(*compositor_);
    return pixels();
  }
  [[nodiscard]] std::optional<std::uint32_t> composed() const { return compositor_->composed_rows(); }

  std::optional<render::Compositor> compositor_;
  std::optional<FlatPicture> picture_;
  Target target_;
  FrameTarget frame_;
  Display display_{.transparent = true};
  RowRevisions rows_;
  std::uint64_t revision_ = 1;
};
CUMULET_ON_BACKENDS(ComposedImageCache);

TEST_P(ComposedImageCache, UnchangedImageIsCopied) {
  const auto first = again();
  EXPECT_EQ(composed(), 64U);
  // A change without a new revision is not noticed: the copy is drawn.
  picture_->set(*gl_, colors(0.9F));
  EXPECT_EQ(again(), first);
  EXPECT_EQ(composed(), 0U);
  EXPECT_EQ(compositor_->bytes() % (std::uint64_t{40} * 64 * 4), 0U);
  EXPECT_EQ(compositor_->bytes(), std::uint64_t{40} * 64 * (16 + 4)) << "means and the copy";
}

TEST_P(ComposedImageCache, OnlyChangedRowsAreComposed) {
  const auto first = again();
  picture_->set(*gl_, colors(0.9F));
  const auto all = fresh();
  rows_.expect();
  rows_.change(0, 0b0100U, 0, ++revision_);  // 32 to 47
  const auto some = again();
  EXPECT_EQ(composed(), 16U);
  for (int y = 0; y < 64; ++y) {
    const int row = 63 - y;  // of the image
    for (int x = 0; x < 40; ++x) {
      const auto i = static_cast<std::size_t>(y * 60 + x);
      ASSERT_EQ(some[i], row >= 32 && row < 48 ? all[i] : first[i]) << x << ' ' << row;
    }
  }
  // If the changed rows are unknown, all are composed.
  rows_.expect();
  ++revision_;
  PictureTextures unknown = textures();
  unknown.rows = nullptr;
  clear(glm::vec4(0.0F));
  {
    FrameTarget target = frame_;
    target.framebuffer = target_.framebuffer.name();
    const StateGuard guard(*gl_);
    compositor_->draw(unknown, display_, target);
  }
  EXPECT_EQ(composed(), 64U);
  EXPECT_EQ(pixels(), all);
}

TEST_P(ComposedImageCache, ScaledRowsIncludeTheFilterFootprint) {
  for (const glm::ivec4 viewport : {glm::ivec4(3, 2, 55, 77), glm::ivec4(0, 0, 20, 23)}) {
    frame_.viewport = viewport;
    picture_->set(*gl_, colors(0.0F));
    again();
    auto changed = colors(0.0F);
    for (int i = 16 * 40; i < 32 * 40; ++i) changed[static_cast<std::size_t>(i)].z = 0.8F;
    picture_->set(*gl_, changed);
    rows_.expect();
    rows_.change(0, 0b0010U, 0, ++revision_);
    const auto got = again();
    EXPECT_GT(composed(), 0U);
    EXPECT_LT(composed(), static_cast<std::uint32_t>(viewport.w));
    EXPECT_EQ(got, fresh());
  }
}

// Settings that affect the image. After each change, the result equals a first draw.
TEST_P(ComposedImageCache, ChangedSettingsRecompose) {
  using Change = std::function<void()>;
  const std::vector<std::pair<std::string, Change>> changes{
      {"exposure", [&] { display_.exposure_stops = 1.0F; }},
      {"tone map", [&] { display_.tone_map = ToneMap::filmic; }},
      {"legend", [&] { display_.legend = true; }},
      {"encoding", [&] { display_.encoding = ColorEncoding::linear; }},
      {"opaque", [&] { display_.transparent = false; }},
      {"backdrop", [&] { display_.backdrop = glm::vec3(0.3F, 0.1F, 0.2F); }},
      {"another backdrop", [&] { display_.backdrop = glm::vec3(0.1F, 0.4F, 0.2F); }},
      {"region",
       [&] {
         frame_.region = {{0.25F, 0.5F}, {0.5F, 0.25F}};
       }},
      {"whole", [&] { frame_.region = {}; }},
      {"size",
       [&] {
         frame_.viewport = {5, 6, 50, 70};
       }},
      {"place",
       [&] {
         frame_.viewport = {8, 3, 50, 70};
       }},
      {"flip", [&] { frame_.flip_y = true; }},
      {"blend", [&] { frame_.blend_over = false; }},
      {"format", [&] { target_ = make_target(GL_RGBA32F); }},
      {"hdr", [&] { display_.encoding = ColorEncoding::hdr; }},
      {"sRGB format",
       [&] {
         target_ = make_target(GL_SRGB8_ALPHA8);
         display_.encoding = ColorEncoding::srgb_framebuffer;
       }},
      {"holes", [&] { ++revision_, rows_.change_all(64, revision_), picture_->set(*gl_, colors(0.4F)); }},
  };
  again();
  for (const auto& [name, change] : changes) {
    change();
    const glm::vec4 before(0.2F, 0.3F, 0.1F, 0.6F);
    const auto expected = fresh(before);
    EXPECT_EQ(again(before), expected) << name;
    EXPECT_EQ(again(before), expected) << name << ", copied";
    EXPECT_EQ(composed(), 0U) << name;
  }
}

// The host's image and depth differ in each frame.
TEST_P(ComposedImageCache, IsBlendedOverTheTargetsContent) {
  target_ = make_target(GL_RGBA32F);
  frame_.write_depth = true;
  frame_.depth_a = 0.0;
  frame_.depth_b = 1.0;  // at view depth 2: 0.5
  again();
  for (const float before : {0.1F, 0.7F}) {
    const auto expected = fresh(glm::vec4(before));
    for (const float depth : {0.25F, 1.0F}) {
      clear(glm::vec4(before), depth);
      draw(*compositor_);
      EXPECT_EQ(composed(), 0U);
      EXPECT_EQ(pixels(), expected);
      std::vector<float> depths(60 * 80);
      gl_->GetTextureImage(target_.depth.name(), 0, GL_DEPTH_COMPONENT, GL_FLOAT,
                           static_cast<GLsizei>(depths.size() * 4), depths.data());
      EXPECT_FLOAT_EQ(depths[10 * 60 + 10], std::min(depth, 0.5F));
    }
  }
}

// If the device runs dispatches asynchronously, composing is as fast as copying: only an image that does not change is
// cached.
TEST_P(ComposedImageCache, AsynchronousDriversCacheOnlyStaticImages) {
  gl_->dispatches_in_call = false;
  const auto first = again();
  EXPECT_EQ(composed(), std::nullopt);
  EXPECT_EQ(again(), first);
  EXPECT_EQ(composed(), 64U);
  EXPECT_EQ(again(), first);
  EXPECT_EQ(composed(), 0U);
  const std::uint64_t with = compositor_->bytes();
  ++revision_;
  again();
  EXPECT_EQ(composed(), std::nullopt);
  EXPECT_EQ(compositor_->bytes(), with - std::uint64_t{40} * 64 * 4);
}

// ---- a viewer's images

// An image drawn in each frame while samples arrive, by changed rows, ends equal to one that is drawn once.
TEST(ComposedFrames, RowUpdatesEndWithAllSamples) {
  cumulet::headless::Context context = cumulet::headless::Context::create(cumulet::headless::Backend::automatic);
  const GladGLContext host = cumulet::test::load_gl(cumulet::headless::Context::get_proc, &context);
  cumulet::test::ViewerOptions options;
  options.get_proc = cumulet::headless::Context::get_proc;
  options.user = &context;
  options.samples = 3;
  const cumulet::test::VolumeRef volume = cumulet::test::make_ball(16, 2.0F);
  const cumulet::test::ViewerPtr viewer = cumulet::test::make_viewer(options);
  ASSERT_EQ(cumulet_set_volume(viewer.get(), volume.get()), CUMULET_OK);
  const cumulet::test::HostTarget target(host, 200, 300);
  auto frame = target.frame();
  frame.budget_ms = 4.0;
  frame.flip_y = 1;
  auto result = cumulet::test::make_desc<cumulet_frame_result>();
  for (int i = 0; i < 20000 && (result.flags & CUMULET_RENDER_CONVERGED) == 0; ++i)
    ASSERT_EQ(cumulet_render(viewer.get(), &frame, &result), CUMULET_OK);
  ASSERT_NE(result.flags & CUMULET_RENDER_CONVERGED, 0U);
  std::vector<std::uint8_t> shown(std::size_t{200} * 300 * 4);
  ASSERT_EQ(cumulet_read_display(viewer.get(), shown.data(), shown.size()), CUMULET_OK);
  const auto drawn = target.pixels();
  for (std::size_t i = 0; i < shown.size(); ++i)
    ASSERT_NEAR(int(drawn[i]), int(shown[i]), 1) << "row " << i / 800 << " byte " << i % 800;
}

}  // namespace
