#pragma once

#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "headless.hpp"
#include "viewer/viewer.hpp"

namespace cumulet::test {

/// Size and sampling of one image.
struct Image {
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  std::uint32_t samples = 64;
  std::uint32_t seed = 0;
  render::View view = render::View::shaded;
  double shutter_seconds = 0.0;
};

/// A viewer that renders still images in memory and waits for each step, for tests and benchmarks.
class Still {
 public:
  explicit Still(headless::Context& context, viewer::Viewer::GetProc get_proc = headless::Context::get_proc,
                 std::shared_ptr<viewer::Sharing> sharing = nullptr)
      : viewer_(std::make_unique<viewer::Viewer>(Log(), nullptr, true, Trace(), std::move(sharing))) {
    viewer_->attach(get_proc, &context);
  }

  [[nodiscard]] viewer::Viewer& viewer() { return *viewer_; }

  void set_volume(volume::ScalarVolume volume) {
    set_volume(std::make_shared<const viewer::VolumeAsset>(std::move(volume)));
  }
  void set_volume(volume::VolumeFrame frame) {
    set_volume(std::make_shared<const viewer::VolumeAsset>(std::move(frame)));
  }
  void set_volume(viewer::VolumeAssetPtr volume) { viewer_->set_volume(std::move(volume)); }
  void set_grid(const viewer::GridSettings& settings) {
    adaptive_ = settings.camera_adaptive;
    viewer_->set_grid(settings);
  }
  void set_medium(const viewer::Medium& medium) { viewer_->set_medium(medium); }
  void set_light(const viewer::Light& light) { viewer_->set_light(light); }
  void set_camera(const viewer::CameraPose& pose) { viewer_->camera()->set(pose); }
  void set_image(const Image& image) {
    image_ = image;
    viewer::Sampling sampling{image.samples, image.seed, {image.view, false}};
    sampling.shutter_seconds = image.shutter_seconds;
    viewer_->set_sampling(sampling);
  }

  /// Builds and uploads everything that the settings need. Throws on failure.
  void build() {
    viewer_->wait(-1.0);
    if (adaptive_) {
      viewer_->render(frame(1e-3));  // passes the image size
      viewer_->wait(-1.0);
    }
    viewer::Frame nothing;
    nothing.target = viewer::Target::none;
    nothing.budget_ms = 1e6;
    viewer_->render(nothing);
  }
  /// Renders for this time. Returns whether every pixel has its samples.
  bool render(double budget_ms) { return viewer_->render(frame(budget_ms)).converged; }
  std::vector<float> read() {
    std::vector<float> rgba(std::size_t{4} * image_.width * image_.height);
    viewer_->read_linear(rgba.data(), rgba.size());
    return rgba;
  }

 private:
  [[nodiscard]] viewer::Frame frame(double budget_ms) const {
    viewer::Frame frame;
    frame.target = viewer::Target::none;
    frame.size = {image_.width, image_.height};
    frame.viewport = {0, 0, image_.width, image_.height};
    frame.budget_ms = budget_ms;
    return frame;
  }

  std::unique_ptr<viewer::Viewer> viewer_;
  Image image_;
  bool adaptive_ = false;
};

}  // namespace cumulet::test
