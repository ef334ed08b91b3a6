#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

#include "support/backends.hpp"
#include "support/still.hpp"

namespace cumulet::test {

/// A viewer in a context of its own, on each backend.
class ViewerTest : public BackendTest {
 protected:
  std::unique_ptr<Still> make() const { return std::make_unique<Still>(*context_); }
};

/// A viewer in daylight, in a context of its own, on each backend.
class StillTest : public ViewerTest {
 protected:
  void SetUp() override {
    ViewerTest::SetUp();
    if (IsSkipped()) return;
    still_ = make();
    still_->set_light({30.0F, 30.0F, glm::vec3(3.0F), glm::vec3(0.3F)});
  }
  [[nodiscard]] viewer::Viewer& viewer() const { return still_->viewer(); }
  /// A frame that is not drawn (Target::none).
  static viewer::Frame frame(std::uint32_t width, std::uint32_t height, double budget_ms = 20.0) {
    viewer::Frame f;
    f.target = viewer::Target::none;
    f.size = {width, height};
    f.viewport = {0, 0, width, height};
    f.budget_ms = budget_ms;
    return f;
  }

  std::unique_ptr<Still> still_;
};

inline viewer::CameraPose camera_at(const glm::dvec3& eye, const glm::dvec3& target, double fovy = 30.0) {
  viewer::CameraPose c;
  c.eye = eye;
  c.target = target;
  c.fovy_degrees = fovy;
  return c;
}

/// A camera that looks straight down at (32, y, 32), the middle of slab().
inline viewer::CameraPose looking_down(double fovy = 1.0) {
  viewer::CameraPose c = camera_at({32.0, 300.0, 32.0}, {32.0, 0.0, 32.0}, fovy);
  c.up = {0.0, 0.0, -1.0};
  return c;
}

struct Picture {
  std::uint32_t width = 0;
  std::vector<glm::vec4> pixels;

  [[nodiscard]] glm::dvec4 mean() const {
    glm::dvec4 sum(0.0);
    for (const glm::vec4& p : pixels) sum += glm::dvec4(p);
    return sum / double(pixels.size());
  }
};

inline Picture render(Still& still, const Image& image, double budget_ms = 1e9) {
  still.set_image(image);
  still.build();
  while (!still.render(budget_ms)) {
  }
  Picture picture;
  picture.width = image.width;
  picture.pixels.resize(std::size_t{image.width} * image.height);
  still.viewer().read_linear(&picture.pixels[0].x, picture.pixels.size() * 4);
  return picture;
}

}  // namespace cumulet::test
