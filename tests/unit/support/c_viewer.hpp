#pragma once

// A viewer of the C API on each backend, with statistics of its images.

#include <cstdint>
#include <vector>

#include "support/backends.hpp"
#include "support/c_host.hpp"

namespace cumulet::test {

class CViewerTest : public BackendTest {
 protected:
  CViewerTest(std::uint32_t width, std::uint32_t height, std::uint32_t samples = ViewerOptions{}.samples)
      : width_(width), height_(height), samples_(samples) {}

  void SetUp() override {
    BackendTest::SetUp();
    if (IsSkipped()) return;
    viewer_ = make_viewer({.get_proc = headless::Context::get_proc, .user = context_.get(), .samples = samples_});
    v_ = viewer_.get();
  }

  /// A frame with CUMULET_TARGET_NONE.
  [[nodiscard]] cumulet_frame_desc undrawn() const {
    auto frame = make_desc<cumulet_frame_desc>();
    frame.target = CUMULET_TARGET_NONE;
    frame.width = width_;
    frame.height = height_;
    frame.budget_ms = 50.0;
    return frame;
  }
  cumulet_frame_result make() { return converge(v_, undrawn()); }
  std::vector<float> linear() {
    std::vector<float> rgba(4 * pixels());
    EXPECT_EQ(cumulet_read_linear(v_, rgba.data(), rgba.size()), CUMULET_OK) << cumulet_last_error(v_);
    return rgba;
  }
  std::vector<float> aov(cumulet_aov which, std::size_t channels) {
    std::vector<float> values(channels * pixels());
    EXPECT_EQ(cumulet_read_aov(v_, which, values.data(), values.size()), CUMULET_OK) << cumulet_last_error(v_);
    return values;
  }

  ViewerPtr viewer_;
  cumulet_viewer* v_ = nullptr;

 private:
  [[nodiscard]] std::size_t pixels() const { return std::size_t{width_} * height_; }
  std::uint32_t width_, height_, samples_;
};

}  // namespace cumulet::test
