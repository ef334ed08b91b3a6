#include "render/gpu_scene.hpp"

#include <algorithm>
#include <chrono>
#include <span>
#include <utility>

#include "base/error.hpp"
#include "light/light_table.hpp"

namespace cumulet::render {

namespace {

using Clock = std::chrono::steady_clock;

}  // namespace

void GpuScene::update(const scene::Snapshot& snapshot, const Wanted& wanted, Deadline deadline) {
  const scene::MarchSourcePtr volume = snapshot.volumes.empty() ? nullptr : snapshot.volumes.front().source;
  const scene::ModelSourcePtr model = snapshot.models.empty() ? nullptr : snapshot.models.front().source;
  if (!volume) drop_data();
  update_environment(*snapshot.surroundings, wanted, deadline);
  update_model(model, wanted, deadline);
  update_lamps(snapshot.lamps, wanted);
  if (volume) update_data(volume, wanted, deadline);
}

void GpuScene::update_model(const scene::ModelSourcePtr& source, const Wanted& wanted, Deadline deadline) {
  if (!source) {
    if (!model_.empty()) model_revision_.advance();
    model_.clear();
    model_upload_.reset();
  }
  if (!source || !wanted.raster) show_raster(source, nullptr);
  // As with volumes: what is under way goes on to its end. What paths meet and what is drawn changes at once, or a
  // picture would be of two poses.
  while (source) {
    if (!model_upload_) {
      const bool paths = model_.wants(source, wanted.settings);
      const bool raster = wanted.raster && raster_.wants(source, wanted.settings);
      if (!paths && !raster) break;
      const ModelParts parts = !raster ? ModelParts::paths : (paths ? ModelParts::both : ModelParts::raster);
      model_upload_ = ModelUnderWay{source, wanted.settings, parts, nullptr};
    }
    ModelUnderWay& upload = *model_upload_;
    try {
      if (!upload.work) {
        upload.work = std::make_unique<ModelUpload>(gl_, programs_, limits_, heap_, upload.of, upload.parts,
                                                    model_.get(), raster_ ? *raster_ : nullptr);
      }
      if (!upload.work->advance(deadline)) break;
      finish_model();
    } catch (const Error&) {
      if (upload.work && upload.work->done()) {
        finish_model();
      } else {
        model_.fail(upload.of, upload.settings);
        raster_.fail(upload.of, upload.settings);
        model_upload_.reset();
      }
      throw;
    }
  }
}

void GpuScene::finish_model() {
  const ModelUnderWay upload = *std::exchange(model_upload_, std::nullopt);
  model_revision_.advance();
  if (auto data = upload.work->take_data()) model_.put(upload.of, std::move(*data));
  if (upload.parts == ModelParts::paths) return;
  const RasterContentPtr raster = upload.work->take_raster();
  show_raster(upload.of, raster);  // where it failed rays meet the triangles
  if (!raster) raster_.fail(upload.of, upload.settings);
}

void GpuScene::show_raster(const scene::ModelSourcePtr& of, const RasterContentPtr& content) {
  if (!content && raster_.empty()) return;
  surface_pass_.show(content);
  raster_.clear();
  if (content) raster_.put(of, content);
}

void GpuScene::update_environment(const light::Surroundings& surroundings, const Wanted& wanted, Deadline deadline) {
  const light::EnvironmentPtr& environment = surroundings.environment;
  if (!environment) {
    if (environment_) environment_revision_.advance();
    environment_.clear();
    environment_upload_.reset();
    return;
  }
  while (environment_upload_ || environment_.wants(environment, wanted.settings)) {
    if (!environment_upload_) environment_upload_ = EnvironmentUnderWay{environment, wanted.settings, nullptr};
    EnvironmentUnderWay& upload = *environment_upload_;
    const light::EnvironmentPtr of = upload.of;
    try {
      if (!upload.work) upload.work = std::make_unique<EnvironmentUpload>(gl_, heap_, of);
      if (!upload.work->advance(deadline)) break;
      environment_.put(of, upload.work->take());
      environment_upload_.reset();
      environment_revision_.advance();
    } catch (const Error&) {
      environment_.fail(of, upload.settings);
      environment_upload_.reset();
      throw;
    }
  }
  if (environment_ && environment_.of() == environment) surroundings_ = surroundings;
}

void GpuScene::update_lamps(const scene::Part<light::Lamps>& of_host, const Wanted& wanted) {
  const LampsOf of{of_host, model_ ? model_.of() : nullptr};
  if (!lamps_.wants(of, wanted.settings)) return;
  lamps_.make(of, wanted.settings, [&] {
    const auto of_scene = of.model ? std::span(of.model->pose.lights) : std::span<const surface::PunctualLight>();
    return LampData::make(gl_, limits_, *of_host, of_scene);
  });
}

void GpuScene::drop_data() {
  if (data_) data_revision_.advance();
  data_.clear();
  upload_.reset();
  took_ = {};  // and what it holds in main memory
}

void GpuScene::update_data(const scene::MarchSourcePtr& source, const Wanted& wanted, Deadline deadline) {
  // What is under way goes on to its end, though there may be something newer by now: that is next. Begun anew with
  // each, an upload that takes longer than a build would never end.
  while (upload_ || data_.wants(source, wanted.settings)) {
    const auto begun = Clock::now();
    if (!upload_) {
      upload_ = VolumeUnderWay{source, wanted.settings, nullptr};
      took_ = {source, 0.0};
    }
    const scene::MarchSourcePtr of = upload_->of;
    try {
      if (!upload_->work) upload_->work = std::make_unique<MarchUpload>(gl_, limits_, heap_, of, wanted.page_texels);
      const bool done = upload_->work->advance(deadline);
      took_.seconds += std::chrono::duration<double>(Clock::now() - begun).count();
      if (!done) break;
      data_.put(of, upload_->work->take());
      upload_.reset();
      data_revision_.advance();
    } catch (const Error&) {
      data_.fail(of, upload_->settings);
      upload_.reset();
      throw;
    }
  }
}

double GpuScene::progress() const {
  if (upload_ && upload_->work) return upload_->work->progress();
  if (model_upload_ && model_upload_->work) return model_upload_->work->progress();
  return environment_upload_ && environment_upload_->work ? environment_upload_->work->progress() : 1.0;
}

std::optional<double> GpuScene::upload_seconds(const scene::MarchSourcePtr& of) const {
  if (took_.of == nullptr || took_.of != of) return std::nullopt;
  return took_.seconds;
}

std::uint64_t GpuScene::other_bytes() const {
  return (model_ ? model_->bytes() : 0) + (raster_ ? (*raster_)->bytes() : 0) +
         (environment_ ? environment_->bytes() : 0) + surface_pass_.bytes() + heap_.free_bytes();
}

light::Surroundings GpuScene::surroundings(const scene::Snapshot& snapshot) const {
  // What is not there yet is not turned or strengthened in what is shown until then.
  if (!environment_) return {};
  return environment_.of() == snapshot.surroundings->environment ? *snapshot.surroundings : surroundings_;
}

light::Surroundings GpuScene::sky_surroundings(const scene::Snapshot& snapshot) const {
  return environment_ ? surroundings(snapshot) : *snapshot.surroundings;
}

light::DistantLights GpuScene::lights(const scene::Snapshot& snapshot) const {
  light::DistantLights lights = *snapshot.lights;
  lights.sky_radiance = light::sky_of(lights, sky_surroundings(snapshot));
  return lights;
}

Obstacles GpuScene::obstacles(const scene::Snapshot& snapshot, bool traced) {
  Obstacles obstacles;
  obstacles.scene = model_.get();
  obstacles.raster = raster_ ? &surface_pass_ : nullptr;
  obstacles.traced = traced || obstacles.raster == nullptr;
  if (*snapshot.view) obstacles.view = **snapshot.view;
  const light::DistantLights lights = this->lights(snapshot);
  const light::Surroundings around = sky_surroundings(snapshot);
  obstacles.lighting = {.sun_direction = glm::vec3(lights.to_sun),
                        .sun_irradiance = lights.sun_irradiance,
                        .sky_radiance = lights.sky_radiance,
                        .sky = light::harmonics_of(around),
                        .gloss = around.environment ? around.environment->gloss : nullptr,
                        .gloss_strength = around.strength,
                        .sky_turn = light::turn_of(around),
                        .lamps = *snapshot.lamps};
  obstacles.environment = environment_.get();
  obstacles.lamps = lamps_.get();
  return obstacles;
}

PictureParameters GpuScene::parameters(const scene::Snapshot& snapshot, const Obstacles& obstacles,
                                       const core::CmIntegrator& integrator, glm::uvec2 size) const {
  const scene::Viewpoint& view = **snapshot.view;
  const scene::MarchSource& source = *data_.of();
  const scene::Medium& medium = *snapshot.volumes.front().medium;
  PictureParameters p;
  p.view.eye = glm::vec3(glm::inverse(source.cube.to_world) * glm::dvec4(view.eye, 1.0));
  p.view.orthographic = view.orthographic ? 1U : 0U;
  p.view.forward = glm::vec3(view.forward);
  p.view.right = glm::vec3(view.right);
  p.view.up = glm::vec3(view.up);
  p.view.size = size;
  p.medium.albedo = medium.albedo;
  p.medium.extinction = static_cast<float>(std::min(1e30, medium.density_scale * std::max(source.max_value, 1e-30F)));
  p.medium.source = medium.emission;
  p.medium.anisotropy = medium.phase.anisotropy;
  p.medium.second_anisotropy = medium.phase.second_anisotropy;
  p.medium.second_bend = medium.phase.second_bend;
  p.medium.second_share = medium.phase.second_share;
  const bool emits = source.emits();
  p.medium.emits = emits ? 1U : 0U;
  p.medium.coloured = source.coloured() ? 1U : 0U;
  p.medium.anisotropic = source.anisotropic() && medium.phase.may_vary() ? 1U : 0U;
  light::MediumLight own;
  own.power = source.glow.power;
  own.length = source.glow.length;
  const core::CmGrid& grid = data_->grid();
  own.radius = 0.5 * glm::length(glm::dmat3(source.cube.to_world) * glm::dvec3(grid.box_max - grid.box_min));
  own.aimed = integrator.light_among_surfaces != 0U && (emits || medium.emission != glm::vec3(0.0F));
  const ModelData* met = obstacles.met();
  light::SceneLights near = met != nullptr ? met->lights() : light::SceneLights{};
  light::add_lamps(near, *snapshot.lamps);
  const light::LightTable table(lights(snapshot), surroundings(snapshot), near, own);
  p.lights = table.parameters();
  if (environment_) p.environment = environment_->parameters();
  if (const std::optional<scene::Ground>& ground = *snapshot.ground)
    p.ground = {ground->albedo, static_cast<float>(ground->height), static_cast<float>(ground->reach)};
  p.integrator = integrator;
  return p;
}

}  // namespace cumulet::render
