#include "saved_picture.hpp"

#include <algorithm>
#include <aov_table.hpp>
#include <image.hpp>
#include <stdexcept>
#include <straight_alpha.hpp>
#include <vector>

#include "aovs.hpp"
#include "metadata.hpp"

namespace cumulet::demo {
namespace {

void check(cumulet_viewer* viewer, cumulet_status status) {
  if (status != CUMULET_OK) throw std::runtime_error(cumulet_last_error(viewer));
}

void require_picture(const cumulet_frame_result& shown) {
  if (shown.width == 0) throw std::runtime_error("there is no image yet");
}

/// Reads the displayed image as linear values that encode to the same bytes with the sRGB curve.
image::Image read_display(cumulet_viewer* viewer, const cumulet_frame_result& shown) {
  image::Image picture{shown.width, shown.height, {}};
  std::vector<std::uint8_t> bytes(std::size_t{4} * picture.width * picture.height);
  check(viewer, cumulet_read_display(viewer, bytes.data(), bytes.size()));
  picture.rgba.resize(bytes.size());
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    const float value = static_cast<float>(bytes[i]) / 255.0f;
    picture.rgba[i] = i % 4 == 3 ? value : image::srgb_decode(value);
  }
  return picture;
}

std::vector<float> read_linear(cumulet_viewer* viewer, const cumulet_frame_result& shown) {
  std::vector<float> rgba(std::size_t{4} * shown.width * shown.height);
  check(viewer, cumulet_read_linear(viewer, rgba.data(), rgba.size()));
  return rgba;
}

}  // namespace

bool is_whole(const cumulet_frame_result& shown, std::uint32_t width, std::uint32_t height) {
  return shown.width > 0 && shown.width == width && shown.height == height &&
         (shown.flags & CUMULET_RENDER_PREVIEW) == 0;
}

std::string save_png(cumulet_viewer* viewer, const SceneOptions& scene, const cumulet_frame_result& shown,
                     const std::string& path) {
  require_picture(shown);
  image::PngOptions png;
  png.tone_mapping = image::ToneMapping::none;
  const float(&region)[4] = scene.sampling.region;
  const bool part = std::ranges::any_of(region, [](float value) { return value != 0.0f; });
  const bool transparent = scene.display.background == CUMULET_BACKGROUND_TRANSPARENT;
  png.keep_alpha = part || transparent;
  image::write_png(path, read_display(viewer, shown), png);
  if (!transparent || scene.sampling.view != CUMULET_VIEW_SHADED) return {};
  const std::vector<float> linear = read_linear(viewer, shown);
  return image::raised_alpha_note(path, image::pixels_brighter_than_alpha(linear, scene.display.exposure_stops));
}

void save_exr(cumulet_viewer* viewer, const SceneOptions& scene, const cumulet_frame_result& shown,
              const std::string& path) {
  require_picture(shown);
  const std::vector<float> rgba = read_linear(viewer, shown);
  // All AOVs except the separate volume, which would slow down every frame.
  std::vector<cumulet_aov> aovs;
  for (const settings::Aov& aov : settings::named_aovs) {
    if (aov.value != CUMULET_AOV_VOLUME && scene.sampling.view == CUMULET_VIEW_SHADED) aovs.push_back(aov.value);
  }
  write_exr(viewer, path, windows_of(scene.sampling.region, shown.width, shown.height), {rgba}, aovs,
            metadata_of(viewer, scene, shown.width, shown.height));
}

}  // namespace cumulet::demo
