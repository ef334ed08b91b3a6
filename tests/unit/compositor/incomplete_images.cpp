// Images with few samples, earlier images, and none.

#include <gtest/gtest.h>

#include <vector>

#include "gl/state_guard.hpp"
#include "render/passes/compositor.hpp"
#include "support/busy_host.hpp"
#include "support/compositing.hpp"
#include "support/gl_state.hpp"

namespace {

using cumulet::gl::StateGuard;
using cumulet::render::ColorEncoding;
using cumulet::render::Display;
using cumulet::render::FrameTarget;
using cumulet::render::PictureTextures;
using cumulet::test::Compositing;
using cumulet::test::ComputedPicture;
namespace gl = cumulet::gl;

TEST_P(Compositing, UnsampledPixelsAreFilledFromNeighbors) {
  for (const glm::ivec2 s : {glm::ivec2(40, 28), glm::ivec2(11, 9), glm::ivec2(1, 1)}) {
    ComputedPicture picture(gl_, s.x, s.y, false);
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

// The upper rows have no samples yet, more rows than neighbors can fill.
TEST_P(Compositing, UnsampledPixelsShowThePreviousImage) {
  const auto flat = [&](int side, const glm::vec4& color, int empty_rows) {
    ComputedPicture picture(gl_, side, side, false);
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
  const ComputedPicture earlier = flat(4, {0.0F, 1.0F, 0.0F, 1.0F}, 0);
  const ComputedPicture now = flat(16, {1.0F, 0.0F, 0.0F, 1.0F}, 8);
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
  const ComputedPicture picture(gl_, 21, 13, false);
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

TEST_P(Compositing, EmptyImageDrawsTheBackground) {
  const ComputedPicture picture(gl_, 8, 8, false);
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

}  // namespace
