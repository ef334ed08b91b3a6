#include "render/frame/tracer.hpp"

#include "render/film/checkpoint.hpp"

namespace cumulet::render {

namespace {

// Returns the noise target of a picture with these settings. Debug views have none.
std::optional<double> noise_target_of(const PictureSettings& settings) {
  return settings.options.view == View::shaded ? settings.noise_target : std::nullopt;
}

}  // namespace

Tracer::Tracer(gl::FunctionsPtr gl, gl::ProgramsPtr programs)
    : gl_(gl),
      programs_(std::move(programs)),
      dispatches_(gl),
      layers_(gl, dispatches_),
      sampler_(gl, programs_, dispatches_),
      inspector_(gl, programs_, dispatches_),
      feature_pass_(std::move(gl), programs_, dispatches_) {}

void Tracer::find_programs(const PathFeatures& features, bool measures, const MarchData& data,
                           const TraceInputs& trace_inputs) {
  if (features.view == View::shaded) {
    sampler_.find_programs(features, measures);
  } else {
    programs_.get(inspect_key(data, trace_inputs));
  }
}

bool Tracer::able(const MarchData& data, const PictureParameters& parameters, const TraceInputs& trace_inputs,
                  const PictureSettings& settings) {
  const PathFeatures features = path_features(data, parameters, trace_inputs, settings);
  const bool measures = noise_target_of(settings).has_value();
  return programs_.asked([&] { find_programs(features, measures, data, trace_inputs); });
}

void Tracer::begin(Picture& picture, const MarchData& data, const PictureParameters& parameters, std::uint32_t samples,
                   const TraceInputs& trace_inputs, const PictureSettings& settings) {
  const glm::uvec2 size = parameters.view.size;
  const PictureOptions& options = settings.options;
  const bool shaded = options.view == View::shaded;
  dispatches_.allocate();
  picture.begin(size, options.region, path_features(data, parameters, trace_inputs, settings));
  const PathFeatures& features = picture.features();
  if (features.layered != Layered::no) {
    draw_layers(picture, trace_inputs, settings);
  } else {
    layers_.drop_unused();
  }
  if (!features.separate_volume_aov) picture.film().drop(film_layers::volume);
  if (features.light_groups == 0) picture.film().drop(film_layers::light_groups(0));
  for (const FilmLayer& layer : picture.accumulated_layers()) picture.film().make(gl_, layer);
  const std::optional<double> noise_target = noise_target_of(settings);
  Accumulation accumulation({.box = options.region.pixels(size, settings.margin),
                             .target_samples = samples,
                             .max_lanes = sampler_.max_lanes(features),
                             .previews_first = options.preview,
                             .short_picture = options.preview ? 0 : sampler_.short_picture(),
                             .noise_target = noise_target,
                             .adaptive = noise_target && options.adaptive});
  if (shaded) sampler_.reserve(features, accumulation);
  find_programs(features, noise_target.has_value(), data, trace_inputs);
  core::CmParameters kernel = kernel_parameters(parameters, trace_inputs);
  kernel.integrator.groups = features.light_groups;
  if (features.layered != Layered::no) {
    const SurfaceLayers& layers = picture.layers();
    kernel.layers = {layers.layers, layers.blended ? 1U : 0U, layers.size,
                     features.layered == Layered::within ? 1U : 0U};
  }
  if (!shaded) kernel.dispatch.view = static_cast<std::uint32_t>(options.view);
  picture.start(kernel, std::move(accumulation), dispatches_.next_revision());
  clear_samples(gl_, picture, shaded ? parameters.lights.sky_radiance : glm::vec3(0.0F), 0);
}

bool Tracer::trace(Picture& picture, const MarchData& data, const TraceInputs& trace_inputs, Deadline deadline,
                   bool until_complete) {
  dispatches_.collect();
  if (picture.view() != View::shaded)
    return picture.done() || inspector_.trace_view(picture, data, trace_inputs, deadline);
  picture.accumulation().end_tile();
  if (picture.done()) return true;
  if (picture.layered() != Layered::no && !layers_.ready(deadline)) return false;
  return sampler_.trace(picture, data, trace_inputs, deadline, until_complete);
}

void Tracer::settle(Picture& picture) {
  dispatches_.in_flight().finish();
  dispatches_.collect();
  if (picture.view() == View::shaded) picture.accumulation().end_tile();
}

void Tracer::clear(Picture& picture) {
  const glm::uvec2 size(1U);
  picture.begin(size, {}, {});
  layers_.drop_unused();
  picture.start({}, Accumulation::finished({glm::uvec2(0U), size}), dispatches_.next_revision());
  clear_samples(gl_, picture, glm::vec3(0.0F), 1);
}

void Tracer::set_background(Picture& picture, const glm::vec3& radiance) {
  if (picture.parameters().lights.sky_radiance == radiance) return;
  clear_samples(gl_, picture, radiance, 1);
  picture.set_background(radiance);
  picture.change_all(dispatches_.next_revision());
}

void Tracer::draw_layers(Picture& picture, const TraceInputs& trace_inputs, const PictureSettings& settings) {
  layers_.draw(picture, trace_inputs, settings);
}

void Tracer::restore(Picture& picture, std::span<const std::byte> saved) {
  restore_checkpoint(*gl_, picture, saved, dispatches_.next_revision());
}

}  // namespace cumulet::render
