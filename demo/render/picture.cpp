#include "picture.hpp"

#include <cstddef>
#include <cstdint>
#include <exception>
#include <file.hpp>
#include <image.hpp>
#include <straight_alpha.hpp>
#include <utility>

#include "aovs.hpp"
#include "metadata.hpp"
#include "object_name.hpp"

namespace cumulet::demo {
namespace {

/// Warns if the image has pixels that straight alpha in a PNG cannot represent.
void warn_of_raised_alpha(const Viewer& viewer, const RenderOptions& options, const std::vector<float>& denoised,
                          std::size_t floats, Progress& progress) {
  const SceneOptions& scene = options.scene;
  if (scene.display.background != CUMULET_BACKGROUND_TRANSPARENT || scene.sampling.view != CUMULET_VIEW_SHADED) return;
  std::vector<float> linear(denoised);
  if (linear.empty()) {
    linear.resize(floats);
    check(viewer, cumulet_read_linear(viewer.get(), linear.data(), linear.size()));
  }
  const std::size_t pixels = image::pixels_brighter_than_alpha(linear, scene.display.exposure_stops);
  const std::string note = image::raised_alpha_note(options.output, pixels);
  if (!note.empty()) print_line(progress, "warning: " + note);
}

}  // namespace

std::vector<float> denoise(const Viewer& viewer, const RenderOptions& options, const Denoiser& denoiser,
                           Progress& progress) {
  if (options.denoise == Denoise::off) return {};
  progress.stage("denoising");
  try {
    return denoised(viewer.get(), denoiser, std::size_t{4} * options.scene.width * options.scene.height);
  } catch (const std::exception& error) {
    print_line(progress, std::string("not denoised: ") + error.what());
    return {};
  }
}

void write_picture(const Viewer& viewer, const RenderOptions& options, const Instances& others,
                   const std::vector<float>& denoised, Progress& progress) {
  image::Image image{options.scene.width, options.scene.height, {}};
  const std::size_t count = std::size_t{4} * image.width * image.height;
  const image::Windows windows = windows_of(options.scene.sampling.region, image.width, image.height);
  if (options.format == OutputFormat::png) {
    std::vector<std::uint8_t> bytes(count);
    check(viewer, denoised.empty() ? cumulet_read_display(viewer.get(), bytes.data(), bytes.size())
                                   : cumulet_encode_display(viewer.get(), denoised.data(), bytes.data(), bytes.size()));
    warn_of_raised_alpha(viewer, options, denoised, count, progress);
    clear_around(windows, bytes);
    image::write_png(options.output, image.width, image.height, bytes);
    return;
  }
  if (options.format == OutputFormat::pfm && !denoised.empty()) {
    image.rgba = denoised;
    image::write_pfm(options.output, image);
    return;
  }
  image.rgba.resize(count);
  check(viewer, cumulet_read_linear(viewer.get(), image.rgba.data(), image.rgba.size()));
  if (options.format == OutputFormat::exr) {
    ObjectName name;
    if (options.cryptomatte) {
      name = [&](cumulet_object_kind kind, std::uint64_t tag) { return object_name(options.scene, others, kind, tag); };
    }
    write_exr(viewer.get(), options.output, windows,
              {image.rgba, denoised, options.scene.light_groups, std::move(name)}, options.aovs,
              metadata_of(viewer.get(), options.scene, image.width, image.height));
  } else {
    image::write_pfm(options.output, image);
  }
}

}  // namespace cumulet::demo
