#include "fire_look.hpp"

#include <array>
#include <cstdio>
#include <default_look.hpp>
#include <utility>

namespace cumulet::demo {
namespace {

void set_display(const Viewer& viewer, cumulet_display_desc display) {
  display.denoise = CUMULET_DENOISE_OFF;  // the program denoises pixels after it has read them
  check(viewer, cumulet_set_display(viewer.get(), &display));
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

void FireLook::settle(SceneOptions& scene) const {
  if (!dusk_) return;
  scene.light = dusk_->light;
  scene.display = dusk_->display;
}

void FireLook::print_light(Progress& progress) const {
  if (!dusk_) return;
  std::array<char, 200> line{};
  std::snprintf(line.data(), line.size(),
                "the volume burns: using dusk light, --tone-map filmic and --exposure %g (set any option of light, "
                "tone map or exposure to disable this; --tone-map neutral keeps the daylight)",
                double{dusk_exposure});
  print_line(progress, line.data());
}

RenderOptions FireLook::shown(RenderOptions options) const {
  if (dusk_) options.scene.display = dusk_->display;
  return options;
}

}  // namespace cumulet::demo
