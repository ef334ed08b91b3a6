#pragma once

// Settings as the viewer uses them, from checked descriptors (viewer/c_settings.hpp).

#include <cumulet/cumulet.h>

#include <cstdint>
#include <glm/glm.hpp>
#include <glm/gtc/type_ptr.hpp>
#include <optional>

#include "render/film/picture_settings.hpp"
#include "render/passes/display.hpp"
#include "stage/settings.hpp"

namespace cumulet::viewer {

struct Sampling {
  std::uint32_t samples = 256;
  std::uint32_t seed = 0;
  render::PictureOptions options{};
  std::optional<double> noise_target = std::nullopt;  ///< relative
  std::uint32_t first_sample = 0;
  double shutter_seconds = 0.0;

  static Sampling of(const cumulet_sampling_desc& d) {
    Sampling sampling{d.samples,
                      d.seed,
                      {.view = static_cast<render::View>(d.view),
                       .preview = d.preview == CUMULET_PREVIEW_AUTO,
                       .separate_volume_aov = d.separate_volume_aov == 1,
                       .light_groups = d.light_groups,
                       .adaptive = d.adaptive == 1,
                       .region = {{d.region[0], d.region[1]}, {d.region[2], d.region[3]}}}};
    if (d.noise_target_percent > 0.0F) sampling.noise_target = 0.01 * double(d.noise_target_percent);
    sampling.first_sample = d.first_sample;
    sampling.shutter_seconds = d.shutter_seconds;
    return sampling;
  }
};

struct DisplaySettings {
  float exposure_stops = 0.0F;
  render::ToneMap tone_map = render::ToneMap::neutral;
  bool transparent = false;
  std::optional<glm::vec3> backdrop{};
  bool denoise = false;
  render::DisplayLutPtr lut{};

  static DisplaySettings of(const cumulet_display_desc& d) {
    DisplaySettings settings{
        d.exposure_stops, static_cast<render::ToneMap>(d.tone_map), d.background == CUMULET_BACKGROUND_TRANSPARENT, {}};
    if (d.background == CUMULET_BACKGROUND_COLOR) settings.backdrop = glm::make_vec3(d.background_color);
    settings.denoise = d.denoise == CUMULET_DENOISE_FAST;
    return settings;
  }

  /// legend: for a debug view, whose background is black.
  [[nodiscard]] render::Display shown(bool legend) const {
    render::Display display;
    display.exposure_stops = exposure_stops;
    display.tone_map = tone_map;
    display.legend = legend;
    display.transparent = transparent;
    if (!legend) display.backdrop = backdrop;
    display.denoise = denoise && !legend;
    display.lut = lut;
    return display;
  }
};

}  // namespace cumulet::viewer
