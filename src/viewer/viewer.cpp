#include "viewer/viewer.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <limits>
#include <numbers>
#include <numeric>
#include <utility>

#include "base/corners.hpp"
#include "base/error.hpp"
#include "base/library_thread.hpp"
#include "base/milliseconds.hpp"
#include "base/one_line.hpp"
#include "jobs/cell_budget.hpp"
#include "scene/model_table.hpp"
#include "scene/origin.hpp"
#include "scene/space.hpp"

namespace cumulet::viewer {

namespace {

using glm::dvec3;
using Clock = std::chrono::steady_clock;

// Maximum number of triangles that the camera fit visits individually.
constexpr std::size_t max_vertices = std::size_t{1} << 24U;

Bounds both(const Bounds& a, const Bounds& b) { return {glm::min(a.min, b.min), glm::max(a.max, b.max)}; }

// Box around all of these; nullopt if there are none.
std::optional<Bounds> box_of(const std::vector<Bounds>& boxes) {
  if (boxes.empty()) return std::nullopt;
  return std::accumulate(boxes.begin() + 1, boxes.end(), boxes.front(), both);
}

using Add = std::function<void(const dvec3&)>;

// Adds the vertices of a mesh, or the corners of its box.
void add_mesh(const scene::ModelSource& source, const scene::ModelMesh& mesh, const glm::dmat4& to_world, bool as_box,
              const Add& add) {
  if (as_box) {
    const auto [low, high] = scene::box_of(mesh.bvh);
    for (const dvec3& corner : corners_of(low, high)) add(dvec3(to_world * glm::dvec4(corner, 1.0)));
    return;
  }
  const auto first = source.scene->indices.begin() + 3 * std::ptrdiff_t{mesh.first_triangle};
  for (auto i = first; i != first + 3 * std::ptrdiff_t{mesh.triangle_count}; ++i)
    add(dvec3(to_world * glm::dvec4(source.pose.vertices[*i].position, 1.0)));
}

// Returns why a frame of a sequence cannot be shown.
std::optional<Error> failure_of(const SequenceFeed& feed, std::uint32_t frame) {
  if (frame >= feed.sequence().files()->count())
    throw Error(ErrorCode::invalid_argument, "the sequence has no frame " + std::to_string(frame));
  return feed.cache().failure_of(frame);
}

}  // namespace

Viewer::Viewer(Log log, std::function<void()> update, bool restore_state, Trace trace, std::shared_ptr<Sharing> sharing)
    : log_(std::move(log)),
      trace_(trace),
      update_(std::move(update)),
      restore_state_(restore_state),
      sharing_(sharing ? std::move(sharing) : std::make_shared<Sharing>()),
      jobs_({.log = log_, .notify = [this] { notify(); }, .trace = trace, .resource_limits = resource_limits_}),
      volumes_(jobs_, reported_failures_, *this, resource_limits_, log_) {
  volume::initialize_readers();
  set_medium({});
  set_light({});
  set_camera(std::make_shared<Camera>());
}

Viewer::~Viewer() {
  volumes_.close();
  dynamic_gl_.clear();
  cancel();  // all workers at once: with a thread limit, jobs wait for each other
  // Without the viewer's context its objects cannot be deleted, and in another context the names belong to other
  // objects.
  if (gl_ && !gl_->group().is_current()) context_lost();
}

// ---- the host's callback ----

void Viewer::notify() {
  if (!update_ || process_is_ending() || update_pending_.exchange(true)) return;
  const CallbackScope inside;
  update_();
}

void Viewer::touch() {
  ++settings_revision_;
  notify();
}

// ---- volumes and grid builds ----

void Viewer::sync() {
  volumes_.sync();
  settings_revision_ += volumes_.take_changes();
  settings_revision_ += models_.sync();
  sky_.sync();
}

Viewer::LiveStatus Viewer::live() { return volumes_.own_live().status(); }

Viewer::LiveStatus Viewer::live(const Instance& instance) { return volumes_.live_of(instance).status(); }

Viewer::SequenceStatus Viewer::status_of(const SequenceFeed& feed) const {
  // The displayed frame may belong to another sequence.
  return feed.status(gl_ ? frame_of(*gl_, feed.id()) : std::nullopt);
}

Viewer::SequenceStatus Viewer::sequence() { return status_of(volumes_.own_sequence()); }

std::optional<Error> Viewer::frame_failure(std::uint32_t frame) { return failure_of(volumes_.own_sequence(), frame); }

Viewer::SequenceStatus Viewer::sequence(const Instance& instance) { return status_of(volumes_.sequence_of(instance)); }

std::optional<Error> Viewer::frame_failure(const Instance& instance, std::uint32_t frame) {
  return failure_of(volumes_.sequence_of(instance), frame);
}

VolumeAssetPtr Viewer::volume() {
  sync();
  return volumes_.volume();
}

VolumeInfoPtr Viewer::volume_info() {
  sync();
  return volumes_.volume_info();
}

void Viewer::add_model(std::shared_ptr<ModelInstance> model) {
  reported_failures_.retire();
  sync();
  models_.add(std::move(model), last_id_ + 1);
  ++last_id_;
  sync();  // starts posing its surfaces
  touch();
}

void Viewer::remove_model(const ModelInstance& model) {
  reported_failures_.retire();
  sync();
  models_.remove(model);
  sync();  // drops its failures
  touch();
}

void Viewer::rebuild() {
  models_.renew_requests();
  volumes_.rebuild();
  touch();
}

void Viewer::set_limits(const Limits& limits) {
  max_gl_bytes_ = limits.gl_bytes;
  volumes_.set_limits(limits.threads, limits.memory_bytes, limits.gl_bytes);
  touch();
}

void Viewer::add_instance(std::shared_ptr<Instance> instance) {
  volumes_.add_instance(std::move(instance), last_id_ + 1);
  ++last_id_;
}

bool Viewer::is_displayed(const scene::SequenceFrame& frame, bool is_rendered) const {
  if (gl_) return is_rendered && !gl_->has_pending_frame(frame);
  return !simulated_gl_ || (is_rendered && simulated_gl_->displays_frames);
}

bool Viewer::busy() const { return jobs_.busy() || volumes_.frames_are_due(); }

void Viewer::load_surfaces(const FilePath& path) {
  reported_failures_.retire();
  sync();
  models_.load(path);
  touch();
}

void Viewer::show_surfaces(scene::ModelSourcePtr surfaces) {
  reported_failures_.retire();
  models_.cancel_surfaces(false);
  sync();
  models_.show(std::move(surfaces));
  touch();
}

void Viewer::set_surfaces(SurfaceAssetPtr surfaces) {
  reported_failures_.retire();
  models_.cancel_surfaces(surfaces != nullptr);
  sync();
  models_.set_surfaces(std::move(surfaces));
  touch();
}

SurfaceAssetPtr Viewer::surfaces_asset() {
  sync();
  return models_.asset();
}

void Viewer::set_surface_settings(const SurfaceSettings& settings) {
  const bool poses = models_.configure_load(settings);
  if (poses) sync();
  models_.set_settings(settings);
  if (poses) models_.pose_surfaces();
  touch();
}

void Viewer::use_surface_camera(std::size_t index) {
  sync();
  const scene::ModelSourcePtr& source = models_.source();
  const std::size_t count = source ? source->pose.cameras.size() : 0;
  if (index >= count) {
    throw Error(ErrorCode::invalid_argument,
                "there is no camera " + std::to_string(index) + ": the surfaces have " + std::to_string(count));
  }
  const surface::SceneCamera& seen = source->pose.cameras[index];
  const dvec3 eye(seen.to_world[3]);
  const dvec3 forward = -glm::normalize(dvec3(seen.to_world[2]));
  CameraPose pose = camera_->pose();
  pose.eye = eye;
  // The target for orbits is as far away as the middle of the scene.
  double distance = 1.0;
  if (const auto all = box()) {
    distance =
        std::max(glm::dot(0.5 * (all->min + all->max) - eye, forward), 1e-3 * glm::length(all->max - all->min) + 1e-12);
  }
  pose.target = eye + forward * distance;
  pose.up = glm::normalize(dvec3(seen.to_world[1]));
  pose.orthographic_height = seen.orthographic ? seen.height : 0.0;
  if (!seen.orthographic) pose.fovy_degrees = glm::degrees(seen.vertical_fov);
  pose.near_plane = seen.near_plane;
  pose.far_plane = seen.far_plane;
  camera_->set(pose);
}

void Viewer::wait(double timeout_ms) {
  std::optional<Clock::time_point> until;
  if (timeout_ms >= 0.0) until = deadline_after(timeout_ms);
  // One result may cause further work.
  do {
    // Stopped workers never become idle.
    if (process_is_ending()) throw Error(ErrorCode::cancelled, "the process is exiting");
    sync();
    if (!jobs_.wait(until)) throw Error(ErrorCode::timeout, "not ready in time");
    // The newest state is waited for, so it need not wait until the previous one has been displayed.
    volumes_.take_unseen_states();
    sync();
  } while (busy());
  if (const auto failure = reported_failures_.report(jobs_.status().failures, ReportedFailures::Cancelled::reported))
    throw Error(*failure);
}

Viewer::Status Viewer::status() const {
  const JobList::Status jobs = jobs_.status();
  const auto either = [&](ContentKind kind, ContentKind other) {
    return jobs.failures[kind] ? jobs.failures[kind] : jobs.failures[other];
  };
  Status status;
  status.volume_failure = either(ContentKind::volume, ContentKind::instances);
  status.surfaces_failure = either(ContentKind::surfaces, ContentKind::models);
  status.environment_failure = jobs.failures[ContentKind::environment];
  status.failure = reported_failures_.report(jobs.failures, ReportedFailures::Cancelled::reported);
  const double upload = upload_progress_.load(std::memory_order_relaxed);
  if (jobs.stage != Progress::Stage::idle) {
    status.stage = jobs.stage;
    status.fraction = jobs.fraction;
  } else if (upload < 1.0) {
    status.stage = Progress::Stage::uploading;
    status.fraction = upload;
  }
  return status;
}

// ---- settings ----

void Viewer::set_light(const Light& light) {
  sky_.set_light(light);
  touch();
}

void Viewer::set_lights(light::AnalyticLights analytic_lights) {
  analytic_lights_ = std::move(analytic_lights);
  analytic_lights_due_ = true;
  touch();
}

void Viewer::load_environment(const FilePath& path) {
  reported_failures_.retire();
  sync();
  jobs_.environments.load(path);
  touch();
}

void Viewer::set_environment(light::EnvironmentPtr environment) {
  reported_failures_.retire();
  jobs_.environments.drop_loads();
  sync();
  sky_.set_environment(std::move(environment));
  touch();
}

const light::EnvironmentPtr& Viewer::environment() {
  sync();
  return sky_.environment();
}

void Viewer::set_environment_settings(const EnvironmentSettings& settings) {
  sky_.set_environment_settings(settings);
  touch();
}

void Viewer::set_ground(const GroundSettings& settings) {
  sky_.set_ground(settings);
  touch();
}

void Viewer::set_sampling(const Sampling& sampling) {
  sync();
  sampling_ = sampling;
  volumes_.set_preview(sampling.options.preview);
  models_.set_shutter(sampling.shutter_seconds);
  volumes_.set_shutter(sampling.shutter_seconds);
  touch();
}

void Viewer::set_display(const DisplaySettings& display) {
  display_ = display;
  touch();
}

void Viewer::set_camera(std::shared_ptr<Camera> camera) {
  camera_listener_.reset();
  camera_ = std::move(camera);
  camera_listener_ = camera_->listen([this] { notify(); });
  touch();
}

void Viewer::set_previous_camera(std::shared_ptr<Camera> camera, double seconds) {
  previous_listener_.reset();
  previous_camera_ = std::move(camera);
  if (previous_camera_) previous_listener_ = previous_camera_->listen([this] { notify(); });
  previous_seconds_ = seconds;
  touch();
}

void Viewer::set_previous_transforms(std::vector<scene::InstanceTransform> transforms) {
  volumes_.set_previous_transforms(std::move(transforms));
  touch();
}

void Viewer::set_navigation(const NavigationSettings& settings) {
  navigation_.set(settings);
  touch();
}

bool Viewer::input(const InputEvent& event) {
  sync();
  const bool handled = navigation_.input(event, *camera_, frame_size_.x, frame_size_.y, subject());
  if (navigation_.moving()) notify();
  return handled;
}

void Viewer::frame_all() {
  static_cast<void>(bounds());  // throws if there is nothing to fit
  camera_->fit(*subject(), frame_size_.y > 0 ? double(frame_size_.x) / frame_size_.y : 1.0);
}

std::vector<Bounds> Viewer::boxes() const {
  std::vector<Bounds> boxes;
  volumes_.append_bounds(boxes);
  models_.append_bounds(boxes);
  return boxes;
}

std::optional<Bounds> Viewer::box() const { return box_of(boxes()); }

dvec3 Viewer::scene_origin(const std::vector<Bounds>& boxes, const std::optional<scene::Ground>& ground) const {
  std::vector<scene::Extent> things;
  things.reserve(boxes.size());
  for (const Bounds& bounds : boxes) things.push_back({bounds.min, bounds.max});
  if (!view_) return scene::origin_of_scene(things, std::nullopt);
  if (things.empty() && ground) {
    const dvec3 below(view_->eye.x, ground->height, view_->eye.z);
    things.push_back({below, below});
  }
  return scene::origin_of_scene(things, view_->eye);
}

void Viewer::remark_on_precision() {
  for (const scene::Model& model : scene_.models) {
    const surface::ScenePtr& scene = model.source->scene;
    if (scene->precision_remark.empty()) continue;
    std::erase_if(remarked_scenes_, [](const auto& remarked) { return remarked.expired(); });
    const auto is = [&](const auto& remarked) { return remarked.lock() == scene; };
    if (std::ranges::any_of(remarked_scenes_, is)) continue;
    remarked_scenes_.emplace_back(scene);
    log_.warning(scene->precision_remark);
  }
}

void Viewer::count_from(const dvec3& origin) {
  if (analytic_lights_due_ || scene_.origin != origin)
    scene_.analytic_lights.set(scene::counted_from(analytic_lights_, origin));
  analytic_lights_due_ = false;
  scene_.origin = origin;
  volumes_.count_from(scene_.volumes, origin);
}

std::optional<scene::Ground> Viewer::ground(const std::optional<Bounds>& all) const {
  const bool on_triangles = sky_.has_ground() && models_.shows_triangles();
  return sky_.ground(all, on_triangles, view_ ? std::optional(view_->eye) : std::nullopt);
}

std::optional<Subject> Viewer::subject() const {
  const auto all = box();
  if (!all) return std::nullopt;
  Subject subject(*all);
  subject.reach = [this](const dvec3& direction, std::span<const dvec3> normals) {
    return seen_reach(direction, normals);
  };
  return subject;
}

std::vector<double> Viewer::seen_reach(const dvec3& direction, std::span<const dvec3> normals) const {
  std::vector<double> reach;
  const auto add = [&](const dvec3& p) {
    reach.resize(normals.size(), std::numeric_limits<double>::lowest());
    for (std::size_t i = 0; i < normals.size(); ++i) reach[i] = std::max(reach[i], glm::dot(p, normals[i]));
  };
  volumes_.visit_reach(direction, add);
  std::size_t vertices = 0;
  for (const scene::Model& model : models_.models()) {
    for (const scene::ModelMesh& mesh : model.source->meshes) {
      for (const glm::dmat4& transform : mesh.transforms) {
        // For many instances the boxes are sufficient.
        vertices += mesh.triangle_count;
        add_mesh(*model.source, mesh, model.to_world * transform, vertices > max_vertices, add);
      }
    }
  }
  return reach;
}

Bounds Viewer::bounds() {
  sync();
  const auto all = box();
  if (!all) throw Error(ErrorCode::invalid_argument, "the scene is empty: no volume and no surfaces");
  return *all;
}

scene::SnapshotPtr Viewer::snapshot() {
  scene_.volumes = volumes_.volumes(scene_.volumes);
  const std::vector<Bounds> boxes = this->boxes();
  const std::optional<scene::Ground> ground = this->ground(box_of(boxes));
  const dvec3 origin = scene_origin(boxes, ground);
  count_from(origin);
  scene_.lights = sky_.lights();
  scene_.surroundings = sky_.surroundings();
  scene_.models = models_.models();
  for (scene::Model& model : scene_.models) model = scene::counted_from(std::move(model), origin);
  remark_on_precision();
  const auto seen = [&](const std::optional<ViewFrame>& view) {
    return scene::counted_from(view ? std::optional<scene::Viewpoint>(*view) : std::nullopt, origin);
  };
  scene_.view.set(seen(view_));
  scene_.previous.set({seen(previous_view_), previous_seconds_});
  const bool lasts = view_ && sampling_.shutter_seconds > 0.0;
  scene_.view_ends.set(
      scene::counted_from(lasts ? camera_->ends(double(frame_size_.x) / frame_size_.y, *view_) : std::nullopt, origin));
  scene_.ground.set(scene::counted_from(ground, origin));
  if (!snapshot_ || *snapshot_ != scene_) snapshot_ = std::make_shared<const scene::Snapshot>(scene_);
  return snapshot_;
}

Shot Viewer::shot() {
  Shot shot;
  shot.scene = snapshot();
  shot.size = frame_size_;
  if (view_) {
    shot.depth_a = view_->depth_a;
    shot.depth_b = view_->depth_b;
  }
  shot.view_rests = view_ == last_view_;
  shot.held = navigation_.dragging();
  shot.max_bounces = volumes_.medium().max_bounces;
  shot.sun_group = sky_.light().sun_group;
  shot.sky_group = sky_.light().sky_group;
  shot.sampling = sampling_;
  shot.surfaces = models_.settings();
  shot.display = display_;
  shot.settings = settings_revision_;
  return shot;
}

}  // namespace cumulet::viewer
