#include "auto_exposure.hpp"

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <default_look.hpp>
#include <suitable_exposure.hpp>

#include "aovs.hpp"

namespace cumulet::demo {
namespace {

bool is_whole(const SceneOptions& scene) {
  const image::Windows windows = windows_of(scene.sampling.region, scene.width, scene.height);
  return windows.width == scene.width && windows.height == scene.height;
}

}  // namespace

AutoExposure::AutoExposure(const RenderOptions& options)
    : measures_(options.format == OutputFormat::png && !options.given.exposure) {}

void AutoExposure::measure(const Viewer& viewer, const SceneOptions& scene, const cumulet_display_desc& display,
                           const std::vector<float>& denoised) {
  if (!measures_ || !is_whole(scene) || scene.sampling.view != CUMULET_VIEW_SHADED) return;
  std::vector<float> read;
  if (denoised.empty()) {
    read.resize(std::size_t{4} * scene.width * scene.height);
    check(viewer, cumulet_read_linear(viewer.get(), read.data(), read.size()));
  }
  const image::Curve curve = display.tone_map == CUMULET_TONE_MAP_FILMIC ? image::Curve::filmic : image::Curve::neutral;
  stops_ = image::suitable_exposure(denoised.empty() ? read : denoised, scene.width, scene.height, curve);
  if (stops_ && std::abs(*stops_ - display.exposure_stops) < exposure_tolerance) stops_.reset();
  cumulet_display_desc exposed = display;
  if (stops_) exposed.exposure_stops = *stops_;
  exposed.denoise = CUMULET_DENOISE_OFF;  // the program denoises pixels after it has read them
  check(viewer, cumulet_set_display(viewer.get(), &exposed));
}

RenderOptions AutoExposure::shown(RenderOptions options) const {
  if (stops_) options.scene.display.exposure_stops = *stops_;
  return options;
}

void AutoExposure::print(const std::string& output, Progress& progress) const {
  if (!stops_) return;
  std::array<char, 64> text{};
  std::snprintf(text.data(), text.size(), ": exposure %+.1f stops suits the image (--exposure)", double{*stops_});
  print_line(progress, output + text.data());
}

}  // namespace cumulet::demo
