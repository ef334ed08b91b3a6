#include "render/scene/gpu_scene.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>
#include <glm/gtc/matrix_transform.hpp>
#include <glm/gtc/quaternion.hpp>
#include <iterator>
#include <limits>
#include <span>
#include <utility>

#include "base/corners.hpp"
#include "base/error.hpp"
#include "light/light_table.hpp"
#include "scene/origin.hpp"
#include "scene/space.hpp"

namespace cumulet::render {

namespace {

using Clock = std::chrono::steady_clock;

// extent: the length of the diagonal of all volumes' bounds in the world.
core::CmMedium medium_of(const scene::Medium& medium, const scene::MarchSource& source, double extent) {
  core::CmMedium m{};
  m.albedo = medium.albedo;
  const double extinction = medium.density_scale * source.value_unit * std::max(source.max_value, 1e-30F);
  m.extinction = static_cast<float>(std::min({1e30, extinction, scene::max_extinction(extent)}));
  m.source = medium.emission;
  m.group = medium.group;
  m.holdout = medium.holdout ? 1U : 0U;
  m.anisotropy = medium.phase.anisotropy;
  m.second_anisotropy = medium.phase.second_anisotropy;
  m.second_bend = medium.phase.second_bend;
  m.second_weight = medium.phase.second_weight;
  m.emits = source.emits() ? 1U : 0U;
  m.colored = source.colored() ? 1U : 0U;
  m.anisotropic = source.anisotropic() && medium.phase.may_vary() ? 1U : 0U;
  m.changes = source.changes() ? 1U : 0U;
  return m;
}

core::CmView view_of(const scene::Viewpoint& view, const glm::vec3& eye, glm::uvec2 size) {
  core::CmView v{};
  v.eye = eye;
  v.orthographic = view.orthographic ? 1U : 0U;
  v.forward = glm::vec3(view.forward);
  v.right = glm::vec3(view.right);
  v.up = glm::vec3(view.up);
  if (view.lens_radius > 0.0) {
    v.inverse_focus = static_cast<float>(1.0 / view.focus);
    v.lens_right = static_cast<float>(view.lens_radius / glm::length(view.right));
    v.lens_up = static_cast<float>(view.lens_radius / glm::length(view.up));
  }
  v.size = size;
  return v;
}

// Returns orthonormal axes. The third points towards the viewer, or away from it if the view is mirrored.
glm::dmat3 axes_of(const scene::Viewpoint& view) {
  const glm::dvec3 right = glm::normalize(view.right);
  const glm::dvec3 up = glm::normalize(view.up - right * glm::dot(right, view.up));
  return {right, up, glm::cross(right, up)};
}

// eye_of: converts an eye position to the space of rays.
core::CmShutter shutter_of(const scene::ViewEnds& ends, const std::function<glm::vec3(const glm::dvec3&)>& eye_of,
                           glm::uvec2 size) {
  core::CmShutter shutter{};
  const glm::dmat3 turn = axes_of(ends.close) * glm::transpose(axes_of(ends.open));
  glm::dquat q = glm::quat_cast(turn);
  if (q.w < 0.0) q = -q;  // the shorter rotation
  const glm::dvec3 along(q.x, q.y, q.z);
  const double sine = glm::length(along);
  shutter.axis = sine > 0.0 ? glm::vec3(along / sine) : glm::vec3(0.0F, 0.0F, 1.0F);
  shutter.angle = static_cast<float>(2.0 * std::atan2(sine, q.w));
  scene::Viewpoint close = ends.close;
  const glm::dmat3 back = sine > 0.0 ? glm::transpose(turn) : glm::dmat3(1.0);
  close.forward = back * close.forward;
  close.right = back * close.right;
  close.up = back * close.up;
  shutter.open = view_of(ends.open, eye_of(ends.open.eye), size);
  shutter.close = view_of(close, eye_of(close.eye), size);
  return shutter;
}

// irradiance: of sun and sky on a horizontal plane. Without any, a shadow catcher shows the background, which is black.
core::CmGround ground_of(const scene::Ground& ground, const glm::vec3& irradiance) {
  core::CmGround p{ground.albedo, static_cast<float>(ground.height), static_cast<float>(ground.reach), 0};
  if (!ground.shadow_catcher) return p;
  for (int i = 0; i < 3; ++i) p.albedo[i] = irradiance[i] > 0.0F ? std::numbers::pi_v<float> / irradiance[i] : 0.0F;
  p.catches = 1;
  if (p.albedo == glm::vec3(0.0F)) p.reach = 0.0F;
  return p;
}

bool moves(const scene::Volume& volume) { return volume.transform.ends || volume.source->changes(); }

bool is_clipped(const scene::Volume& volume) { return !volume.clip.empty(); }

bool is_hole(const scene::Volume& volume) { return (*volume.medium).holdout; }

// Returns each source once.
MarchUpload::Sources sources_of(const std::vector<scene::Volume>& volumes) {
  MarchUpload::Sources sources;
  for (const scene::Volume& volume : volumes) {
    // Usually it is the source of the previous volume.
    if (!sources.empty() && sources.back() == volume.source) continue;
    if (std::ranges::find(sources, volume.source) == sources.end()) sources.push_back(volume.source);
  }
  return sources;
}

}  // namespace

void GpuScene::update(const scene::Snapshot& snapshot, const Wanted& wanted, Deadline deadline) {
  const MarchUpload::Sources sources = sources_of(snapshot.volumes);
  marches_->collect();
  if (data_) marches_->use(*data_);
  if (sources.empty()) drop_data();
  update_environment(*snapshot.surroundings, wanted, deadline);
  update_models(snapshot, wanted, deadline);
  if (!sources.empty()) update_data(sources, snapshot, wanted, deadline);
  find_present(snapshot);
  update_instances(snapshot, wanted);
  update_analytic_lights(snapshot, wanted);
}

void GpuScene::find_present(const scene::Snapshot& snapshot) {
  present_.clear();
  if (!data_) return;
  for (const scene::Volume& volume : snapshot.volumes) {
    scene::Volume& present = present_.emplace_back(volume);
    if (data()->grid(*volume.source) != nullptr) continue;
    const auto was = std::ranges::find(data_of_, volume.id, &scene::Volume::id);
    if (was == data_of_.end()) {
      present_.pop_back();
    } else {
      present.source = was->source;
      present.frame = was->frame;
    }
  }
  if (present_.empty()) present_ = came_with_data(snapshot);
}

std::vector<scene::Volume> GpuScene::came_with_data(const scene::Snapshot& snapshot) const {
  std::vector<scene::Volume> volumes = data_of_;
  for (scene::Volume& volume : volumes) volume = scene::counted_from(std::move(volume), snapshot.origin - data_origin_);
  return volumes;
}

bool GpuScene::models_move() const { return model_instances_ && !model_instances_->table().ends.empty(); }

void GpuScene::update_instances(const scene::Snapshot& snapshot, const Wanted& wanted) {
  // If anything moves, a single volume also uses an instance table, so that fewer programs are needed. Holdouts and
  // clips exist only in instance tables.
  const auto stands_alone = [&] {
    return present_.size() < 2 && std::ranges::none_of(present_, is_hole) && std::ranges::none_of(present_, moves) &&
           std::ranges::none_of(present_, is_clipped) && !snapshot.view_ends->has_value() && !models_move();
  };
  if (present_.empty() || stands_alone()) {
    if (instances_) {
      data_revision_.advance();
      instances_revision_.advance();
    }
    instances_.clear();
    return;
  }
  InstancesOf of{present_, data_revision_};
  if (!instances_.wants(of, wanted.settings)) return;
  std::vector<scene::Instance> instances;
  const double extent = this->extent();
  for (const scene::Volume& volume : present_) {
    const core::CmGrid& grid = *data()->grid(*volume.source);
    instances.push_back({.source = volume.source,
                         .transform = volume.transform.to_world,
                         .grid = grid,
                         .medium = medium_of(*volume.medium, *volume.source, extent),
                         .ends = volume.transform.ends,
                         .emissive = *data()->emissive(*volume.source),
                         .clip = volume.clip});
  }
  const bool of_other_data = instances_ && instances_.of().data != data_revision_;
  const auto same = [](const scene::Volume& a, const scene::Volume& b) { return a.id == b.id && a.source == b.source; };
  const bool same_list = instances_ && !of_other_data && std::ranges::equal(instances_.of().volumes, present_, same);
  try {
    // Rays are relative to the frame's origin: in-flight paths can continue if it does not change.
    const glm::dvec3 origin = scene::origin_of(instances);
    const bool keeps = same_list && instances_->origin() == origin;
    InstanceData made = InstanceData::make(gl_, limits_, instances, origin);
    if (!keeps) data_revision_.advance();
    of.data = data_revision_;
    instances_revision_.advance();
    instances_.put(of, std::move(made));
  } catch (const Error&) {
    instances_.fail(of, wanted.settings);
    // The existing table refers to offsets in the old data.
    if (of_other_data) {
      static_cast<void>(instances_.take());
      instances_revision_.advance();
    }
    throw;
  }
}

std::vector<scene::Model> GpuScene::present_models(const scene::Snapshot& snapshot) const {
  std::vector<scene::Model> present;
  if (!model_) return present;
  const auto is_here = [&](const scene::ModelSourcePtr& source) {
    return std::ranges::find(model_.of(), source) != model_.of().end();
  };
  const std::vector<scene::Model>& before =
      model_instances_ && model_instances_.of().data == *model_ ? model_instances_.of().models : models_of_;
  for (const scene::Model& model : snapshot.models) {
    scene::Model shown = model;
    if (!is_here(model.source)) {
      const auto was = std::ranges::find(before, model.id, &scene::Model::id);
      if (was == before.end() || !is_here(was->source)) continue;
      shown.source = was->source;
    }
    if (shown.previous_source && !is_here(shown.previous_source)) shown.previous_source = nullptr;
    present.push_back(std::move(shown));
  }
  return present;
}

void GpuScene::update_models(const scene::Snapshot& snapshot, const Wanted& wanted, Deadline deadline) {
  ModelData::Sources sources;
  for (const scene::Model& model : snapshot.models) {
    for (const scene::ModelSourcePtr& source : {model.source, model.previous_source}) {
      if (source && std::ranges::find(sources, source) == sources.end()) sources.push_back(source);
    }
  }
  if (sources.empty()) {
    if (!model_.empty()) model_revision_.advance();
    model_instances_.clear();
    model_.clear();
    models_of_.clear();
    model_upload_.reset();
  }
  if (sources.empty() || !wanted.raster) show_raster(sources, {});
  if (sources.empty()) return;
  std::optional<Error> failure;
  try {
    upload_models(sources, snapshot.models, wanted, deadline);
  } catch (const Error& error) {
    failure = error;
  }
  make_model_instances(present_models(snapshot), wanted);
  if (failure) throw Error(*failure);
}

void GpuScene::upload_models(const ModelData::Sources& sources, const std::vector<scene::Model>& models,
                             const Wanted& wanted, Deadline deadline) {
  // As with volumes, an upload in progress is finished first. Path-traced and rasterized models are replaced together;
  // otherwise a picture would show two poses.
  for (;;) {
    if (!model_upload_) {
      const bool paths = model_.wants(sources, wanted.settings);
      const bool raster = wanted.raster && raster_.wants(sources, wanted.settings);
      if (!paths && !raster) return;
      const ModelParts parts = !raster ? ModelParts::paths : (paths ? ModelParts::both : ModelParts::raster);
      model_upload_ = ModelsUnderWay{sources, models, wanted.settings, parts, nullptr};
    }
    ModelsUnderWay& upload = *model_upload_;
    try {
      if (!upload.work) {
        upload.work = std::make_unique<ModelUpload>(gl_, programs_, limits_, heap_, upload.of, upload.parts,
                                                    model_ ? *model_ : nullptr, raster_ ? *raster_ : RasterContents{});
      }
      if (!upload.work->advance(deadline)) return;
      finish_models();
    } catch (const Error&) {
      // The data were uploaded, but the instance table failed.
      if (!model_upload_) throw;
      if (upload.work && upload.work->done()) {
        finish_models();
      } else {
        model_.fail(upload.of, upload.settings);
        raster_.fail(upload.of, upload.settings);
        model_upload_.reset();
      }
      throw;
    }
  }
}

void GpuScene::finish_models() {
  const ModelsUnderWay upload = *std::exchange(model_upload_, std::nullopt);
  model_revision_.advance();
  if (auto data = upload.work->take_data()) {
    model_.put(upload.of, std::move(data));
    models_of_ = upload.models;
  }
  if (upload.parts != ModelParts::paths) {
    RasterContents raster = upload.work->take_raster();
    const bool failed = raster.empty();
    show_raster(upload.of, std::move(raster));  // if the raster data failed, rays hit the triangles
    if (failed) raster_.fail(upload.of, upload.settings);
  }
  // This is last because it may throw.
  if (upload.parts != ModelParts::raster) make_model_instances(upload.models, {.settings = upload.settings});
}

void GpuScene::make_model_instances(std::vector<scene::Model> models, const Wanted& wanted) {
  if (!model_) return;
  ModelInstancesOf of{std::move(models), *model_};
  if (!model_instances_.wants(of, wanted.settings)) return;
  try {
    model_instances_.put(of, ModelInstances::make(gl_, limits_, of.models, of.data, model_instances_.get()));
  } catch (const Error&) {
    model_instances_.fail(of, wanted.settings);
    throw;
  }
  model_revision_.advance();
  update_raster();
}

void GpuScene::show_raster(const ModelData::Sources& of, RasterContents contents) {
  if (contents.empty() && raster_.empty()) return;
  raster_.clear();
  if (!contents.empty()) raster_.put(of, std::move(contents));
  update_raster();
}

void GpuScene::update_raster() {
  std::vector<RasterItem> items;
  if (raster_ && model_instances_) {
    for (const scene::Model& model : model_instances_.of().models) {
      const auto source = std::ranges::find(raster_.of(), model.source);
      if (source == raster_.of().end()) continue;
      items.push_back({(*raster_)[static_cast<std::size_t>(source - raster_.of().begin())], model.to_world,
                       model.shadow_only || model.holdout});
    }
  }
  surface_pass_.show(std::move(items));
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

light::Lit GpuScene::ball_of(const scene::Volume& volume) const {
  const glm::dmat4 to_world = volume.transform.to_world * volume.source->cube.to_world;
  const core::CmGrid& grid = *data()->grid(*volume.source);
  return {glm::dvec3(to_world * glm::dvec4(0.5 * glm::dvec3(grid.box_min + grid.box_max), 1.0)),
          0.5 * glm::length(glm::dmat3(to_world) * glm::dvec3(grid.box_max - grid.box_min))};
}

std::vector<glm::dvec3> GpuScene::corners() const {
  std::vector<glm::dvec3> corners;
  corners.reserve(8 * present_.size());
  for (const scene::Volume& volume : present_) {
    const glm::dmat4 to_world = volume.transform.to_world * volume.source->cube.to_world;
    const core::CmGrid& grid = *data()->grid(*volume.source);
    for (const glm::dvec3& corner : corners_of(grid.box_min, grid.box_max))
      corners.emplace_back(to_world * glm::dvec4(corner, 1.0));
  }
  return corners;
}

double GpuScene::extent() const {
  glm::dvec3 low(std::numeric_limits<double>::infinity());
  glm::dvec3 high(-low);
  for (const glm::dvec3& corner : corners()) {
    low = glm::min(low, corner);
    high = glm::max(high, corner);
  }
  return low.x <= high.x ? glm::length(high - low) : 0.0;
}

double GpuScene::optical_depth() const {
  const double radius = lit()[0].radius;
  double depth = 0.0;
  for (const scene::Volume& volume : present_) {
    const double own =
        volume.medium->density_scale * volume.source->optical_depth * scene::mean_stretch(volume.transform.to_world);
    depth += own * std::pow(ball_of(volume).radius / radius, 2.0);
  }
  return depth;
}

std::array<light::Lit, 2> GpuScene::lit() const {
  std::array<light::Lit, 2> lit;
  if (instances_) {
    const glm::dvec3 low(instances_->space().box_min);
    const glm::dvec3 high(instances_->space().box_max);
    lit[0] = {instances_->origin() + 0.5 * (low + high), 0.5 * glm::length(high - low)};
  } else if (!present_.empty()) {
    lit[0] = ball_of(present_.front());
  }
  if (model_instances_) {
    const scene::ModelTable& table = model_instances_->table();
    lit[1] = {0.5 * (table.low + table.high), 0.5 * glm::length(table.high - table.low)};
  }
  return lit;
}

void GpuScene::update_analytic_lights(const scene::Snapshot& snapshot, const Wanted& wanted) {
  const auto make = [&](Slot<AnalyticLightData, AnalyticLightsOf>& analytic_lights, const ModelInstances* models) {
    const auto of_scene =
        models != nullptr ? std::span(models->table().analytic_lights) : std::span<const surface::PunctualLight>();
    const auto groups =
        models != nullptr ? std::span(models->table().analytic_light_groups) : std::span<const std::uint32_t>();
    AnalyticLightsOf of{snapshot.analytic_lights, {}, {}};
    // If there are no lights, the bounds of lit objects do not matter.
    if (!of_scene.empty()) of.models = models->models();
    if (!of_scene.empty() || !snapshot.analytic_lights->empty()) of.lit = lit();
    if (!analytic_lights.wants(of, wanted.settings)) return;
    analytic_lights.make(of, wanted.settings, [&] {
      return AnalyticLightData::make(gl_, limits_, *snapshot.analytic_lights, of_scene, groups, of.lit);
    });
  };
  if (model_instances_) {
    make(host_analytic_lights_, nullptr);
  } else {
    host_analytic_lights_.clear();
  }
  make(analytic_lights_, model_instances_.get());
}

GpuScene::~GpuScene() {
  if (gl_->abandoned) {
    std::optional<MarchData> unfinished;
    if (upload_ && upload_->work) unfinished = upload_->work->take();
    marches_->leave(heap_, std::move(unfinished));
    return;
  }
  upload_.reset();
  clear_data();
}

void GpuScene::clear_data() {
  if (data_) marches_->release(*data_);
  data_.clear();
  data_of_.clear();
  marches_->collect();
}

void GpuScene::drop_data() {
  if (data_) data_revision_.advance();
  upload_.reset();
  clear_data();
  grids_.clear();
  took_ = {};  // frees main memory, too
}

void GpuScene::update_data(const MarchUpload::Sources& sources, const scene::Snapshot& snapshot, const Wanted& wanted,
                           Deadline deadline) {
  // An upload in progress is finished even if there is a newer request, which is processed next. If each request
  // restarted it, an upload that takes longer than a build would never end.
  while (upload_ || data_.wants(sources, wanted.settings)) {
    const auto begun = Clock::now();
    if (!upload_) {
      upload_ = VolumeUnderWay{sources, snapshot.volumes, snapshot.origin, wanted.settings};
      took_ = {sources, 0.0};
    }
    const MarchUpload::Sources of = upload_->of;
    try {
      if (MarchDataPtr shared = marches_->find(of, wanted.page_texels)) {
        upload_->work.reset();
        grids_.stop();
        if (make_room(shared->bytes(), true, wanted, deadline)) put_data(std::move(shared), snapshot);
        continue;
      }
      if (!upload_->announcement) {
        if (marches_->is_coming(of, wanted.page_texels, upload_->wait)) break;
        upload_->announcement = marches_->begin(of, wanted.page_texels);
      }
      ++upload_->announcement->steps;
      if (!upload_->work && !plan_upload(wanted, deadline)) break;
      const bool done = upload_->work->advance(deadline);
      upload_->announcement->progress = upload_->work->progress();
      took_.seconds += std::chrono::duration<double>(Clock::now() - begun).count();
      if (!done) break;
      put_data(marches_->add(upload_->work->take()), snapshot);
    } catch (...) {
      data_.fail(of, upload_->settings);
      upload_.reset();
      grids_.clear_built();
      throw;
    }
  }
}

void GpuScene::put_data(MarchDataPtr data, const scene::Snapshot& snapshot) {
  if (data_) marches_->release(*data_);
  data_.put(upload_->of, std::move(data));
  grids_.clear_built();
  data_of_ = std::move(upload_->volumes);
  data_origin_ = upload_->origin;
  present_ = came_with_data(snapshot);  // in case the following steps fail
  upload_.reset();
  data_revision_.advance();
  marches_->collect();
}

bool GpuScene::plan_upload(const Wanted& wanted, Deadline deadline) {
  while (build_grids(upload_->of, wanted.max_bytes, deadline)) {
    auto work =
        std::make_unique<MarchUpload>(gl_, limits_, heap_, upload_->of, data(), wanted.page_texels, &grids_.built());
    if (!make_room(work->bytes(), false, wanted, deadline)) continue;
    upload_->work = std::move(work);
    return true;
  }
  return false;
}

bool GpuScene::make_room(std::uint64_t bytes, bool complete, const Wanted& wanted, Deadline deadline) {
  const auto fits_beside = [&](std::uint64_t held) {
    held -= std::min(heap_.free_bytes(), bytes);
    return bytes <= wanted.max_bytes - std::min(wanted.max_bytes, held);
  };
  // Lattices are only needed for later views, so they are freed first.
  if (!fits_beside(data_bytes() + other_bytes())) grids_.advance({}, {}, wanted.max_bytes, deadline);
  // If the new cells do not fit beside the old ones, the old ones are freed first. They are kept if they include some
  // of the new grids, because those would have to be made again. Exception: if the memory in use exceeds the limit by
  // itself, grids in main memory are uploaded again from there.
  const std::uint64_t held = data_bytes() + other_bytes();
  const auto is_kept = [&](const scene::MarchSourcePtr& source) {
    return data()->grid(*source) != nullptr && (source->plan || held <= wanted.max_bytes);
  };
  const MarchUpload::Sources& of = upload_->of;
  if (data_ && of.front()->march == scene::March::tet && !fits_beside(held) && fits_beside(other_bytes()) &&
      (complete || std::ranges::none_of(of, is_kept))) {
    clear_data();
    data_revision_.advance();
    return false;
  }
  require_room(bytes, wanted.max_bytes);
  return true;
}

bool GpuScene::build_grids(const MarchUpload::Sources& of, std::uint64_t max_bytes, Deadline deadline) {
  const auto begun = Clock::now();
  // Grids that are uploaded are copied.
  MarchUpload::Sources missing;
  std::ranges::copy_if(of, std::back_inserter(missing),
                       [&](const scene::MarchSourcePtr& source) { return !data_ || data()->grid(*source) == nullptr; });
  const std::uint64_t others = data_bytes() + other_bytes() - grids_.bytes();
  const bool done = grids_.advance(missing, of, max_bytes - std::min(max_bytes, others), deadline);
  if (!done) took_.seconds += std::chrono::duration<double>(Clock::now() - begun).count();
  return done;
}

void GpuScene::require_room(std::uint64_t bytes, std::uint64_t max_bytes) const {
  // The old data stay until the new ones are complete. Free space of the heap's pages can be used.
  const std::uint64_t held = data_bytes() + other_bytes() - std::min(heap_.free_bytes(), bytes);
  const std::uint64_t room = max_bytes - std::min(max_bytes, held);
  if (bytes <= room) return;
  throw Error(ErrorCode::out_of_memory, "uploading the volume needs " + std::to_string(bytes) +
                                            " bytes of GPU memory; " + std::to_string(room) +
                                            " are left within the limit");
}

double GpuScene::progress() const {
  if (upload_ && upload_->work) return upload_->work->progress();
  if (upload_ && !upload_->announcement) return upload_->wait.progress;
  if (upload_) return grids_.progress();
  if (model_upload_ && model_upload_->work) return model_upload_->work->progress();
  return environment_upload_ && environment_upload_->work ? environment_upload_->work->progress() : 1.0;
}

std::optional<double> GpuScene::upload_seconds(const scene::MarchSourcePtr& of) const {
  if (std::ranges::find(took_.of, of) == took_.of.end()) return std::nullopt;
  return took_.seconds;
}

std::uint64_t GpuScene::other_bytes() const {
  std::uint64_t raster = 0;
  if (raster_) {
    for (const RasterContentPtr& content : *raster_) raster += content->bytes();
  }
  return (model_ ? (*model_)->bytes() : 0) + (model_instances_ ? model_instances_->bytes() : 0) + raster +
         (environment_ ? environment_->bytes() : 0) + (instances_ ? instances_->bytes() : 0) + surface_pass_.bytes() +
         grids_.bytes() + heap_.free_bytes();
}

light::Surroundings GpuScene::surroundings(const scene::Snapshot& snapshot) const {
  // If the snapshot's environment is not uploaded yet, its rotation and strength do not apply to the previous one.
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

TraceInputs GpuScene::trace_inputs(const scene::Snapshot& snapshot, bool traced) {
  TraceInputs trace_inputs;
  trace_inputs.scene = model_instances_.get();
  trace_inputs.raster = raster_ ? &surface_pass_ : nullptr;
  trace_inputs.traced = traced || trace_inputs.raster == nullptr;
  if (*snapshot.view) trace_inputs.view = **snapshot.view;
  const light::DistantLights lights = this->lights(snapshot);
  const light::Surroundings around = sky_surroundings(snapshot);
  trace_inputs.lighting = {.sun_direction = glm::vec3(lights.to_sun),
                           .sun_irradiance = lights.sun_irradiance,
                           .sky_radiance = lights.sky_radiance,
                           .sky = light::harmonics_of(around),
                           .prefiltered = around.environment ? around.environment->prefiltered : nullptr,
                           .prefiltered_strength = around.strength,
                           .sky_turn = light::turn_of(around),
                           .analytic_lights = *snapshot.analytic_lights};
  trace_inputs.environment = environment_.get();
  // Selection probabilities are normalized over a whole table, so there is one table per case.
  trace_inputs.analytic_lights = !model_instances_ || trace_inputs.traced_models() != nullptr
                                     ? analytic_lights_.get()
                                     : host_analytic_lights_.get();
  trace_inputs.instances = instances_.get();
  trace_inputs.volume_holdout = instances_ && std::ranges::any_of(present_, is_hole);
  trace_inputs.model_holdout = trace_inputs.traced_models() != nullptr &&
                               std::ranges::any_of(model_instances_->models(), &scene::Model::holdout);
  return trace_inputs;
}

scene::MotionTable GpuScene::motion(const scene::Snapshot& snapshot) const {
  const scene::Volume& first = present_.front();
  const glm::dmat4 ray_to_world = instances_ ? glm::translate(glm::dmat4(1.0), instances_->origin())
                                             : first.transform.to_world * first.source->cube.to_world;
  if (!model_instances_) return scene::make_motion(snapshot, ray_to_world, present_, {}, nullptr, {});
  const ModelData& data = *model_instances_.of().data;
  return scene::make_motion(
      snapshot, ray_to_world, present_, model_instances_->models(), &model_instances_->table(),
      [&](const scene::ModelSource& source) { return data.words_of(source).first + source.vertices; });
}

PictureParameters GpuScene::parameters(const scene::Snapshot& snapshot, const TraceInputs& trace_inputs,
                                       const core::CmIntegrator& integrator, glm::uvec2 size) const {
  const scene::Viewpoint& view = **snapshot.view;
  PictureParameters p;
  std::function<glm::vec3(const glm::dvec3&)> eye_of;
  light::MediumLight own;
  if (instances_) {
    p.space = instances_->space();
    eye_of = [origin = instances_->origin()](const glm::dvec3& eye) { return glm::vec3(eye - origin); };
    own.power = instances_->emissive_power();
    own.length = instances_->emissive_length();
    p.medium = instances_->medium();
  } else {
    const scene::Volume& volume = present_.front();
    const scene::MarchSource& source = *volume.source;
    p.grid = *data()->grid(source);
    // Where several volumes were refused, this one is drawn as if it were the only one.
    p.medium = medium_of(*volume.medium, source, 2.0 * ball_of(volume).radius);
    const glm::dmat4& transform = volume.transform.to_world;
    const glm::dmat4 to_world = transform * source.cube.to_world;
    p.space = scene::space_of(to_world, p.grid.box_min, p.grid.box_max);
    eye_of = [to_cube = glm::inverse(to_world)](const glm::dvec3& eye) {
      return glm::vec3(to_cube * glm::dvec4(eye, 1.0));
    };
    const scene::InstanceEmissive emissive =
        scene::emissive_of(*data()->emissive(source), source.cube.to_world, transform);
    p.emissive = emissive.looks;
    own.power = emissive.power;
    own.length = emissive.length;
  }
  p.view = view_of(view, eye_of(view.eye), size);
  const std::optional<scene::ViewEnds>& ends = *snapshot.view_ends;
  if (instances_ && (ends || instances_->moves() || models_move())) {
    p.shutter = shutter_of(ends ? *ends : scene::ViewEnds{view, view}, eye_of, size);
    p.shutter.lasts = 1U;
  }
  own.radius = lit()[0].radius;
  own.aimed = integrator.light_among_surfaces != 0U && (p.medium.emits != 0U || p.medium.source != glm::vec3(0.0F));
  const ModelInstances* models = trace_inputs.traced_models();
  light::SceneLights near = models != nullptr ? models->lights() : light::SceneLights{};
  light::add_analytic_lights(near, *snapshot.analytic_lights);
  near.analytic_lights_arrive = trace_inputs.analytic_lights != nullptr ? trace_inputs.analytic_lights->arrives() : 0.0;
  const std::optional<double> nearest =
      trace_inputs.analytic_lights != nullptr ? trace_inputs.analytic_lights->nearest() : std::nullopt;
  p.equiangular = nearest && light::suits_equiangular(nearest, optical_depth());
  const light::LightTable table(lights(snapshot), surroundings(snapshot), near, own);
  p.lights = table.parameters();
  if (environment_) p.environment = environment_->parameters();
  if (const std::optional<scene::Ground>& ground = *snapshot.ground)
    p.ground = ground_of(*ground, light::level_irradiance(lights(snapshot), sky_surroundings(snapshot)));
  p.integrator = integrator;
  return p;
}

}  // namespace cumulet::render
