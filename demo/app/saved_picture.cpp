#include "saved_picture.hpp"

#include <algorithm>
#include <aov_table.hpp>
#include <exception>
#include <image.hpp>
#include <object_name.hpp>
#include <stdexcept>
#include <straight_alpha.hpp>
#include <utility>
#include <vector>

#include "aovs.hpp"
#include "denoised.hpp"
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

namespace {

/// Returns the denoised picture. Returns an empty vector and sets the note if there is none: a noisy picture is better
/// than none.
std::vector<float> denoise(cumulet_viewer* viewer, const cumulet_frame_result& shown, Denoise how, std::string& note) {
  if (how == Denoise::off) return {};
  const Denoiser denoiser = how == Denoise::high ? find_denoiser("", "", note) : Denoiser();
  try {
    return denoised(viewer, denoiser, std::size_t{4} * shown.width * shown.height);
  } catch (const std::exception& error) {
    note = std::string("not denoised: ") + error.what();
    return {};
  }
}

void write_bytes(cumulet_viewer* viewer, const SceneOptions& scene, const cumulet_frame_result& shown,
                 const PictureFile& file, const std::vector<float>& denoised) {
  std::vector<std::uint8_t> bytes(std::size_t{4} * shown.width * shown.height);
  check(viewer, denoised.empty() ? cumulet_read_display(viewer, bytes.data(), bytes.size())
                                 : cumulet_encode_display(viewer, denoised.data(), bytes.data(), bytes.size()));
  clear_around(windows_of(scene.sampling.region, shown.width, shown.height), bytes);
  if (file.format == PictureFormat::webp)
    image::write_webp(file.path, shown.width, shown.height, bytes);
  else
    image::write_png(file.path, shown.width, shown.height, bytes);
}

}  // namespace

std::string write_picture_file(cumulet_viewer* viewer, const SceneOptions& scene, const Instances& others,
                               const cumulet_frame_result& shown, const PictureFile& file) {
  require_picture(shown);
  std::string note;
  const std::vector<float> smooth = denoise(viewer, shown, file.denoise, note);
  if (file.format != PictureFormat::exr) {
    write_bytes(viewer, scene, shown, file, smooth);
    return note;
  }
  const std::vector<float> rgba = read_linear(viewer, shown);
  ObjectName name;
  if (file.cryptomatte)
    name = [&](cumulet_object_kind kind, std::uint64_t tag) { return object_name(scene, others, kind, tag); };
  write_exr(viewer, file.path, windows_of(scene.sampling.region, shown.width, shown.height),
            {rgba, smooth, scene.light_groups, std::move(name)}, file.aovs,
            metadata_of(viewer, scene, shown.width, shown.height));
  return note;
}

}  // namespace cumulet::demo
