#include "fire_look.hpp"

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <default_look.hpp>
#include <suitable_exposure.hpp>
#include <utility>

#include "aovs.hpp"

namespace cumulet::demo {
namespace {

void set_display(const Viewer& viewer, cumulet_display_desc display) {
  display.denoise = CUMULET_DENOISE_OFF;  // the program denoises pixels after it has read them
  check(viewer, cumulet_set_display(viewer.get(), &display));
}

bool is_whole(const SceneOptions& scene) {
  const image::Windows windows = windows_of(scene.sampling.region, scene.width, scene.height);
  return windows.width == scene.width && windows.height == scene.height;
}

}  // namespace

std::optional<DefaultMedium> default_medium(const Viewer& viewer, const SceneOptions& scene) {
  if (!sets_no_medium(scene)) return std::nullopt;
  const DefaultMedium made = default_medium(volume_of(viewer).get(), scene);
  return made.content == Content::cloud ? std::nullopt : std::optional(made);
}

void print_medium(const DefaultMedium& made, Progress& progress) {
  const cumulet_medium_desc& medium = made.medium;
  if (made.content == Content::smoke) {
    print_line(progress,
               "the volume is smoke: using --preset smoke, gray as in Blender (--albedo 1,1,1 makes it white; any "
               "medium option disables this)");
    return;
  }
  std::array<char, 160> line{};
  std::snprintf(
      line.data(), line.size(),
      "the volume burns: using --preset %s --flame-strength %g --blackbody %g (set any medium option to disable this)",
      medium.density_scale > 0.0 ? "explosion" : "fire", double{medium.flame_strength}, double{medium.blackbody});
  print_line(progress, line.data());
}

void FireLook::take(const Viewer& viewer, const SceneOptions& scene) {
  SceneOptions dusk = scene;
  const bool shaded = scene.sampling.view == CUMULET_VIEW_SHADED;
  if (!by_default_ || !shaded || !scene.analytic_lights.empty() || !take_dusk(dusk)) return;
  check(viewer, cumulet_set_sun_sky(viewer.get(), &dusk.light));
  set_display(viewer, dusk.display);
  dusk_ = std::move(dusk);
}

void FireLook::settle(SceneOptions& scene) {
  has_one_image_ = false;
  if (!dusk_) return;
  scene.light = dusk_->light;
  scene.display = dusk_->display;
}

void FireLook::expose(const Viewer& viewer, const RenderOptions& options, const std::vector<float>& denoised) {
  // All regions of an image have the same exposure.
  if (!dusk_ || !has_one_image_ || options.format != OutputFormat::png || !is_whole(options.scene)) return;
  std::vector<float> read;
  if (denoised.empty()) {
    read.resize(std::size_t{4} * options.scene.width * options.scene.height);
    check(viewer, cumulet_read_linear(viewer.get(), read.data(), read.size()));
  }
  const auto stops = image::suitable_exposure(denoised.empty() ? read : denoised, options.scene.width,
                                              options.scene.height, image::Curve::filmic);
  const bool is_close = !stops || std::abs(*stops - dusk_exposure) < exposure_tolerance;
  dusk_->display.exposure_stops = is_close ? dusk_exposure : *stops;
  set_display(viewer, dusk_->display);
}

void FireLook::print_light(Progress& progress) const {
  if (!dusk_) return;
  std::array<char, 200> line{};
  std::snprintf(line.data(), line.size(),
                "the volume burns: using dusk light, --tone-map filmic and --exposure %g (set any option of light, "
                "tone map or exposure to disable this; --tone-map neutral keeps the daylight)",
                double{dusk_->display.exposure_stops});
  print_line(progress, line.data());
}

void FireLook::print_exposure(const std::string& output, Progress& progress) const {
  if (!dusk_ || dusk_->display.exposure_stops == dusk_exposure) return;
  std::array<char, 64> text{};
  std::snprintf(text.data(), text.size(), ": exposure %+.1f stops suits the image (--exposure)",
                double{dusk_->display.exposure_stops});
  print_line(progress, output + text.data());
}

RenderOptions FireLook::shown(RenderOptions options) const {
  if (dusk_) options.scene.display = dusk_->display;
  return options;
}

}  // namespace cumulet::demo
