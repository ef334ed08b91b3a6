#pragma once

// A host for tests of the embedding contract.

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <vector>

#include "support/c_host.hpp"
#include "support/fake_gl.hpp"

namespace cumulet::test {

/// A viewer, a volume and a target. The viewer's GL calls pass through a FakeGl.
class Contract : public testing::Test {
 protected:
  using Picture = std::vector<std::uint8_t>;
  static constexpr int side = 32;

  [[nodiscard]] ViewerPtr viewer(ViewerOptions options = {}) {
    options.get_proc = FakeGl::get_proc;
    options.user = &fake_;
    return make_viewer(options);
  }
  void show(cumulet_viewer* v, cumulet_background background) {
    auto display = make_desc<cumulet_display_desc>();
    display.background = background;
    ASSERT_EQ(cumulet_set_display(v, &display), CUMULET_OK);
  }
  [[nodiscard]] std::array<int, 4> at(const Picture& pixels, int x, int y) const {
    std::array<int, 4> rgba{};
    for (std::size_t c = 0; c < 4; ++c) rgba[c] = pixels[static_cast<std::size_t>(y * side + x) * 4 + c];
    return rgba;
  }

  headless::Context context_ = headless::Context::create(headless::Backend::automatic);
  FakeGl fake_{headless::Context::get_proc, &context_};
  const GladGLContext& gl_ = fake_.real();
  HostTarget target_{gl_, side, side};
  VolumeRef volume_ = make_ball(16, 2.0F);
  ViewerPtr viewer_ = viewer();
  cumulet_viewer* v_ = viewer_.get();
};

}  // namespace cumulet::test
