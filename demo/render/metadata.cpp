#include "metadata.hpp"

#include <algorithm>
#include <array>
#include <attributes.hpp>
#include <cmath>
#include <matrix.hpp>
#include <memory>
#include <settings.hpp>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>

#include "aovs.hpp"

namespace cumulet::demo {

namespace {

struct Release {
  void operator()(cumulet_camera* camera) const { cumulet_camera_release(camera); }
};

void check(cumulet_viewer* viewer, cumulet_status status) {
  if (status != CUMULET_OK) throw std::runtime_error(cumulet_last_error(viewer));
}

std::array<float, 16> floats(const Matrix& matrix) {
  std::array<float, 16> result{};
  std::ranges::transform(matrix, result.begin(), [](double x) { return static_cast<float>(x); });
  return result;
}

std::array<double, 3> three(const double v[3]) { return {v[0], v[1], v[2]}; }

/// Returns the name of a value in flags and scene files.
template <class Choices, class Value>
const char* name_of(const Choices& choices, Value value) {
  const auto* const found = std::ranges::find(choices, static_cast<int>(value), &settings::Choice::value);
  return found == choices.end() ? "" : found->name;
}

}  // namespace

const char* grid_type_name(cumulet_grid_type type) { return name_of(settings::grid_type_choices, type); }

const char* cells_name(cumulet_cell_density cells) { return name_of(settings::cells_choices, cells); }

const char* interpolation_name(cumulet_interpolation interpolation) {
  return name_of(settings::voxel_interpolation_choices, interpolation);
}

std::vector<image::Attribute> camera_metadata(const double view[16], const double projection[16]) {
  Matrix eye{};
  std::copy_n(view, 16, eye.begin());
  Matrix clip{};
  std::copy_n(projection, 16, clip.begin());
  // The OpenEXR camera looks along +z, and the image origin is the upper left corner.
  constexpr Matrix forward{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1};
  constexpr Matrix window{0.5, 0, 0, 0, 0, -0.5, 0, 0, 0, 0, 1, 0, 0.5, 0.5, 0, 1};
  std::vector<image::Attribute> attributes{{"worldToCamera", floats(product(forward, eye))},
                                           {"worldToNDC", floats(product(window, product(clip, eye)))}};
  if (clip[15] == 0.0) {
    // Window of the image plane at distance 1 from the eye.
    attributes.push_back({"screenWindowWidth", static_cast<float>(2.0 / clip[0])});
    attributes.push_back({"screenWindowCenter",
                          std::array{static_cast<float>(clip[8] / clip[0]), static_cast<float>(clip[9] / clip[5])}});
  }
  return attributes;
}

std::vector<image::Attribute> metadata_of(cumulet_viewer* viewer, const SceneOptions& scene, std::uint32_t width,
                                          std::uint32_t height) {
  cumulet_camera* made = nullptr;
  check(viewer, cumulet_get_camera(viewer, &made));
  const std::unique_ptr<cumulet_camera, Release> camera(made);
  Matrix view{};
  Matrix projection{};
  check(viewer, cumulet_camera_get_matrices(camera.get(), double(width) / height, CUMULET_CLIP_NEGATIVE_ONE_TO_ONE,
                                            view.data(), projection.data()));
  cumulet_camera_desc stands{};
  stands.struct_size = sizeof stands;
  check(viewer, cumulet_camera_get(camera.get(), &stands));
  cumulet_stats stats{};
  stats.struct_size = sizeof stats;
  check(viewer, cumulet_get_stats(viewer, &stats));
  const image::Windows windows = windows_of(scene.sampling.region, width, height);
  const double samples = static_cast<double>(stats.samples) / (double(windows.width) * windows.height);

  std::vector<image::Attribute> attributes = camera_metadata(view.data(), projection.data());
  const auto add = [&attributes](std::string_view name, auto value) {
    attributes.push_back({std::string(name), std::move(value)});
  };
  namespace names = image::attributes;
  const cumulet_sampling_desc& sampling = scene.sampling;
  const bool shaded = sampling.view == CUMULET_VIEW_SHADED;
  add(names::comments, names::comments_text(version_text(), samples));
  add(names::version, version_text());
  add(names::scene, scene_hash(scene));
  add(names::grid_type, std::string(grid_type_name(scene.grid.type)));
  add(names::background, std::string(name_of(settings::background_choices, scene.display.background)));
  add(names::samples, samples);
  // True only if every pixel has all samples: no pixel has more than the requested number.
  if (shaded && samples == double(sampling.samples)) add(names::first_sample, double(sampling.first_sample));
  add(names::seed, double(sampling.seed));
  if (shaded && std::isfinite(stats.noise)) add(names::noise, stats.noise);
  attributes.push_back({"cumulet:eye", three(stands.eye)});
  attributes.push_back({"cumulet:target", three(stands.target)});
  attributes.push_back({"cumulet:up", three(stands.up)});
  if (stands.orthographic_height > 0.0) {
    attributes.push_back({"cumulet:orthographic_height", stands.orthographic_height});
  } else {
    attributes.push_back({"cumulet:fovy_degrees", stands.fovy_degrees});
  }
  return attributes;
}

}  // namespace cumulet::demo
