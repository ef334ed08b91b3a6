#include "subject.hpp"

#include <ctime>
#include <utility>

namespace cumulet::bench {

const char* name_of(Kind kind) {
  switch (kind) {
    case Kind::tet_constant:
      return "tet-constant";
    case Kind::tet_linear:
      return "tet-linear";
    case Kind::dense:
      return "dense";
    case Kind::brick:
      break;
  }
  return "brick";
}

const char* name_of(viewer::SurfaceLight light) {
  switch (light) {
    case viewer::SurfaceLight::full:
      return "full";
    case viewer::SurfaceLight::none:
      return "none";
    case viewer::SurfaceLight::shadows:
      break;
  }
  return "shadows";
}

viewer::Light bench_light() {
  viewer::Light light;
  light.sun_azimuth_degrees = 60.0F;
  light.sun_elevation_degrees = 40.0F;
  light.sun_irradiance = {2.6F, 2.5F, 2.3F};
  light.sky_radiance = {0.2F, 0.3F, 0.5F};
  return light;
}

Subject::Subject(headless::Context& context, viewer::VolumeAssetPtr volume, Kind kind, const Options& options,
                 double density_scale, std::shared_ptr<viewer::Sharing> programs)
    : kind_(kind),
      interpolation_(options.interpolations.front()),
      size_(options.size),
      albedo_(options.albedo),
      max_bounces_(options.max_bounces),
      density_scale_(density_scale),
      still_(context, headless::Context::get_proc, std::move(programs)) {
  still_.viewer().camera()->frame(volume->bounds(), 1.0);
  still_.set_volume(std::move(volume));
  still_.set_light(bench_light());
  viewer::Medium medium;
  medium.density_scale = density_scale;
  still_.set_medium(medium);
  still_.set_grid(grid_settings());
}

viewer::GridSettings Subject::grid_settings() const {
  viewer::GridSettings settings;
  if (kind_ == Kind::dense) settings.build.march = render::March::dense;
  if (kind_ == Kind::brick) settings.build.march = render::March::brick;
  settings.build.interpolation = interpolation_;
  return settings;
}

void Subject::refine(grid::Criterion criterion, double threshold, std::uint64_t max_cells) {
  viewer::GridSettings settings = grid_settings();
  grid::RefineSettings& refine = settings.build.refine;
  refine.criterion = criterion;
  refine.cells = kind_ == Kind::tet_constant ? grid::CellKind::constant : grid::CellKind::linear;
  refine.threshold = threshold;
  refine.max_cells = max_cells;
  still_.set_grid(settings);
  still_.build();
}

void Subject::show(scene::ModelSourcePtr surfaces) { still_.viewer().show_surfaces(std::move(surfaces)); }

void Subject::light_surfaces(viewer::SurfaceLight light) {
  viewer::SurfaceSettings settings;
  settings.light = light;
  still_.viewer().set_surface_settings(settings);
}

Run Subject::shaded(std::uint32_t samples, std::uint32_t seed) {
  return trace(density_scale_, samples, seed, render::View::shaded);
}

Run Subject::primary(double density_scale) { return trace(density_scale, 1, 0, render::View::density); }

Run Subject::trace(double density_scale, std::uint32_t samples, std::uint32_t seed, render::View view) {
  viewer::Medium medium;
  medium.density_scale = density_scale;
  medium.albedo = albedo_;
  medium.max_bounces = max_bounces_;
  still_.set_medium(medium);
  return bench::trace(still_, {size_, size_, samples, seed, view});
}

Run trace(test::Still& still, const test::Image& image) {
  still.set_image(image);
  still.build();
  const std::clock_t start = std::clock();
  while (!still.render(500.0)) {
  }
  Run run;
  run.processor_seconds = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
  run.rgba = still.read();
  const viewer::Stats stats = still.viewer().stats();
  run.seconds = stats.trace_seconds;
  run.samples = stats.samples;
  run.steps = stats.steps;
  return run;
}

}  // namespace cumulet::bench
