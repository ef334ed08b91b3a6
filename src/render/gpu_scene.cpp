#include "render/gpu_scene.hpp"

#include <algorithm>
#include <chrono>

#include "base/error.hpp"
#include "render/light_choice.hpp"

namespace cumulet::render {

namespace {

using Clock = std::chrono::steady_clock;

}  // namespace

void GpuScene::update(const scene::Snapshot& snapshot, const Wanted& wanted, Deadline deadline) {
  const scene::MarchSourcePtr volume = snapshot.volumes.empty() ? nullptr : snapshot.volumes.front().source;
  const SurfacePtr model = snapshot.models.empty() ? nullptr : snapshot.models.front().source;
  if (!volume) drop_data();
  update_surfaces(model, wanted);
  if (volume) update_data(volume, wanted, deadline);
  update_raster(model, wanted);
}

void GpuScene::update_raster(const SurfacePtr& source, const Wanted& wanted) {
  if (!wanted.raster || !source) {
    raster_.clear();
    return;
  }
  if (!raster_.wants(source, wanted.settings)) return;
  // Paths that met triangles for want of it end at it from now on.
  if (!raster_) surfaces_revision_.advance();
  const bool same_scene = raster_ && raster_.of()->scene == source->scene;
  std::optional<SurfaceRaster> last = raster_.take();  // where this fails rays meet the triangles
  if (!same_scene) last.reset();
  raster_.make(source, wanted.settings, [&] {
    SurfaceRaster raster = last ? *std::move(last) : SurfaceRaster(gl_, programs_);
    if (!same_scene) raster.set_scene(source->scene);
    raster.set_pose(source->pose);
    return raster;
  });
}

void GpuScene::update_surfaces(const SurfacePtr& source, const Wanted& wanted) {
  if (!source) {
    if (!surfaces_.empty()) surfaces_revision_.advance();
    surfaces_.clear();
    return;
  }
  if (!surfaces_.wants(source, wanted.settings)) return;
  surfaces_revision_.advance();
  std::optional<SurfaceData> last = surfaces_.take();
  surfaces_.make(source, wanted.settings, [&] { return SurfaceData(gl_, limits_, *source, last ? &*last : nullptr); });
}

void GpuScene::drop_data() {
  if (data_) data_revision_.advance();
  data_.clear();
  upload_.reset();
}

void GpuScene::update_data(const scene::MarchSourcePtr& source, const Wanted& wanted, Deadline deadline) {
  // What is under way goes on to its end, though there may be something newer by now: that is next. Begun anew with
  // each, an upload that takes longer than a build would never end.
  while (upload_ || data_.wants(source, wanted.settings)) {
    const auto begun = Clock::now();
    if (!upload_) {
      upload_ = Upload{source, wanted.settings, nullptr};
      took_ = {source, 0.0};
    }
    const scene::MarchSourcePtr of = upload_->of;
    try {
      if (!upload_->work) upload_->work = std::make_unique<MarchUpload>(gl_, limits_, of, wanted.page_texels);
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

std::optional<double> GpuScene::upload_seconds(const scene::MarchSourcePtr& of) const {
  if (took_.of == nullptr || took_.of != of) return std::nullopt;
  return took_.seconds;
}

std::uint64_t GpuScene::surface_bytes() const {
  return (surfaces_ ? surfaces_->bytes() : 0) + (raster_ ? raster_->bytes() : 0);
}

Surfaces GpuScene::surfaces(const scene::Snapshot& snapshot, bool traced) {
  Surfaces surfaces;
  surfaces.scene = surfaces_.get();
  surfaces.raster = raster_.get();
  surfaces.traced = traced || surfaces.raster == nullptr;
  if (*snapshot.view) surfaces.view = **snapshot.view;
  const scene::Lights& lights = *snapshot.lights;
  surfaces.lighting = {glm::vec3(lights.to_sun), lights.sun_irradiance, lights.sky_radiance};
  return surfaces;
}

PictureParameters GpuScene::parameters(const scene::Snapshot& snapshot, const Surfaces& surfaces,
                                       const core::CmIntegrator& integrator, glm::uvec2 size) const {
  const scene::Viewpoint& view = **snapshot.view;
  const scene::MarchSource& source = *data_.of();
  const scene::Medium& medium = *snapshot.volumes.front().medium;
  const scene::Lights& lights = *snapshot.lights;
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
  p.medium.anisotropy = medium.anisotropy;
  p.lights = light_parameters({lights.to_sun, lights.sun_irradiance, lights.sky_radiance}, surfaces.met(),
                              integrator.light_among_surfaces != 0U && medium.emission != glm::vec3(0.0F));
  p.integrator = integrator;
  return p;
}

}  // namespace cumulet::render
