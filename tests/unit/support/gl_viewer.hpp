#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

#include "headless.hpp"
#include "viewer/viewer.hpp"

namespace cumulet::test {

/// A viewer in a context of its own, on each backend.
class ViewerTest : public testing::TestWithParam<headless::Backend> {
 protected:
  void SetUp() override {
    try {
      context_ = std::make_unique<headless::Context>(headless::Context::create(GetParam()));
    } catch (const std::exception& error) {
      GTEST_SKIP() << error.what();
    }
  }

  std::unique_ptr<viewer::Viewer> make() const {
    return std::make_unique<viewer::Viewer>(headless::Context::get_proc, context_.get(), Log());
  }

  std::unique_ptr<headless::Context> context_;
};

struct Picture {
  std::uint32_t width = 0;
  std::vector<glm::vec4> pixels;

  [[nodiscard]] glm::dvec4 mean() const {
    glm::dvec4 sum(0.0);
    for (const glm::vec4& p : pixels) sum += glm::dvec4(p);
    return sum / double(pixels.size());
  }
};

inline Picture render(viewer::Viewer& viewer, const viewer::Image& image, double budget_ms = 1e9) {
  viewer.set_image(image);
  double progress = 0.0;
  while (!viewer.render(budget_ms, progress)) {
  }
  Picture picture;
  picture.width = image.width;
  picture.pixels.resize(std::size_t{image.width} * image.height);
  viewer.read(&picture.pixels[0].x, picture.pixels.size() * 4);
  return picture;
}

inline std::string backend_name(const testing::TestParamInfo<headless::Backend>& info) {
  return info.param == headless::Backend::egl ? "egl" : "osmesa";
}

}  // namespace cumulet::test

/// Runs a ViewerTest suite on both backends.
#define CUMULET_ON_BACKENDS(suite)                                                                               \
  INSTANTIATE_TEST_SUITE_P(Gl, suite,                                                                            \
                           testing::Values(cumulet::headless::Backend::egl, cumulet::headless::Backend::osmesa), \
                           cumulet::test::backend_name)
