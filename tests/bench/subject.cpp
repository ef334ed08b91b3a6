#include "subject.hpp"

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

viewer::Light bench_light() {
  viewer::Light light;
  light.sun_azimuth_degrees = 60.0F;
  light.sun_elevation_degrees = 40.0F;
  light.sun_irradiance = {2.6F, 2.5F, 2.3F};
  light.sky_radiance = {0.2F, 0.3F, 0.5F};
  return light;
}

Subject::Subject(headless::Context& context, volume::ScalarVolume volume, Kind kind, const Options& options,
                 double density_scale)
    : kind_(kind),
      size_(options.size),
      albedo_(options.albedo),
      density_scale_(density_scale),
      viewer_(std::make_unique<viewer::Viewer>(headless::Context::get_proc, &context, Log())) {
  viewer_->set_volume(std::move(volume));
  viewer_->set_light(bench_light());
  viewer::GridSettings settings;
  if (kind == Kind::dense) settings.march = render::March::dense;
  if (kind == Kind::brick) settings.march = render::March::brick;
  viewer_->set_grid(settings);
}

void Subject::refine(grid::Criterion criterion, double threshold, std::uint64_t max_cells) {
  viewer::GridSettings settings;
  settings.refine.criterion = criterion;
  settings.refine.cells = kind_ == Kind::tet_constant ? grid::CellKind::constant : grid::CellKind::linear;
  settings.refine.threshold = threshold;
  settings.refine.max_cells = max_cells;
  viewer_->set_grid(settings);
  viewer_->build();
}

Run Subject::shaded(std::uint32_t samples, std::uint32_t seed) {
  return trace(density_scale_, samples, seed, render::View::shaded);
}

Run Subject::primary(double density_scale) { return trace(density_scale, 1, 0, render::View::density); }

Run Subject::trace(double density_scale, std::uint32_t samples, std::uint32_t seed, render::View view) {
  viewer::Medium medium;
  medium.density_scale = density_scale;
  medium.albedo = albedo_;
  viewer_->set_medium(medium);
  viewer::Image image;
  image.width = image.height = size_;
  image.samples = samples;
  image.seed = seed;
  image.view = view;
  viewer_->set_image(image);
  double progress = 0.0;
  while (!viewer_->render(500.0, progress)) {
  }
  Run run;
  run.rgba.resize(std::size_t{size_} * size_ * 4);
  viewer_->read(run.rgba.data(), run.rgba.size());
  run.seconds = viewer_->trace_seconds();
  run.samples = viewer_->totals().samples;
  run.steps = viewer_->totals().steps;
  return run;
}

}  // namespace cumulet::bench
