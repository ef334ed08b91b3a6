#include "viewer/viewer.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "base/callback_scope.hpp"
#include "base/error.hpp"
#include "base/milliseconds.hpp"
#include "base/one_line.hpp"

namespace cumulet::viewer {

namespace {

using glm::dvec3;
using Clock = std::chrono::steady_clock;

// Grids that know of the medium's opacity serve until it differs by more.
constexpr double most_opacity_ratio = 2.0;

bool apart(double a, double b) { return a > most_opacity_ratio * b || b > most_opacity_ratio * a; }

bool glows(const VolumeAsset& volume) { return volume.may_emit(); }

double radians(double degrees) { return degrees * std::numbers::pi / 180.0; }

dvec3 to_sun(double azimuth_degrees, double elevation_degrees) {
  const double azimuth = radians(azimuth_degrees);
  const double elevation = radians(elevation_degrees);
  return {std::sin(azimuth) * std::cos(elevation), std::sin(elevation), std::cos(azimuth) * std::cos(elevation)};
}

}  // namespace

Viewer::Viewer(Log log, std::function<void()> update, bool restore_state, Trace trace,
               std::shared_ptr<gl::ProgramPool> programs)
    : log_(std::move(log)),
      trace_(trace),
      update_(std::move(update)),
      restore_state_(restore_state),
      programs_(programs ? std::move(programs) : std::make_shared<gl::ProgramPool>()),
      builder_(
          log_, [this] { notify(); }, trace),
      surface_builder_(
          log_, [this] { notify(); }, trace),
      environment_builder_([this] { notify(); }, trace) {
  scene_.volumes.resize(1);
  set_medium({});
  set_light({});
  set_camera(std::make_shared<Camera>());
}

Viewer::~Viewer() {
  // Without a context nothing can be deleted, and in a stranger's the names are of other objects.
  if (gl_ && !gl_->group().is_current()) context_lost();
}

// ---- the host's callback ----

void Viewer::notify() {
  if (!update_ || update_pending_.exchange(true)) return;
  const CallbackScope inside;
  update_();
}

void Viewer::touch() {
  ++settings_revision_;
  notify();
}

// ---- volumes and building ----

void Viewer::sync() {
  if (auto loaded = builder_.take_loaded()) {
    volume_ = std::move(loaded->volume);
    built_view_.reset();
    remark_on_anisotropy();
    suggested_density_scale_ = loaded->density_scale;
    if (suggested_density_scale_) grid_.build.refine.density_scale = *suggested_density_scale_;
  }
  if (auto built = builder_.take_built()) {
    // A rebuild keeps what the load took.
    if (built->volume == built_.volume) {
      if (built->seconds.load == 0.0) built->seconds.load = built_.seconds.load;
      if (built->seconds.statistics == 0.0) built->seconds.statistics = built_.seconds.statistics;
    }
    built_ = std::move(*built);
    if (suggested_density_scale_ && built_.volume == volume_) {
      medium_.density_scale = *std::exchange(suggested_density_scale_, std::nullopt);
      show_medium();
    }
  }
  if (auto surfaces = surface_builder_.take()) {
    if (surfaces->asset) surface_asset_ = std::move(surfaces->asset);
    model_source_ = std::move(surfaces->source);
  }
  if (auto read = environment_builder_.take_environment()) show_environment(std::move(*read));
  if (auto sky = environment_builder_.take_sky()) {
    if (asked_day_ == sky->day) asked_day_.reset();
    // One that was asked for before is shown where the newest is not there yet.
    if (const auto wanted = day(); wanted && !(daylight_ && daylight_->day == *wanted)) daylight_ = std::move(*sky);
    surround();
  }
}

std::optional<BuildSettings> Viewer::settings_at_once() const {
  if (grid_.camera_adaptive) return std::nullopt;
  return grid_.build;
}

BuildSettings Viewer::settings_for_view() const {
  BuildSettings settings = grid_.build;
  settings.refine.camera = refine_camera();
  return settings;
}

void Viewer::request_build(bool (*concerned)(const VolumeAsset&)) {
  if (builder_.configure_load(settings_at_once())) return;
  sync();
  const auto settings = settings_at_once();
  if (concerned != nullptr && volume_ && !concerned(*volume_)) return;
  built_view_.reset();
  if (volume_ && settings) builder_.build(volume_, *settings);
}

void Viewer::load_volume(const VolumeFile& file) {
  sync();
  suggested_density_scale_.reset();
  take_medium();
  builder_.load(file, settings_at_once());
  touch();
}

void Viewer::set_volume(VolumeAssetPtr volume) {
  if (volume) {
    builder_.cancel_loads();  // builds go on: a host may set volumes faster than they build
  } else {
    builder_.cancel();
  }
  builder_.take_loaded();  // what was read, and not shown yet, never is
  sync();
  volume_ = std::move(volume);
  suggested_density_scale_.reset();
  built_view_.reset();
  remark_on_anisotropy();
  if (!volume_) {
    built_ = {};
  } else if (!grid_.camera_adaptive) {
    take_medium();
    builder_.build(volume_, grid_.build);
  }
  touch();
}

VolumeAssetPtr Viewer::volume() {
  sync();
  return volume_;
}

void Viewer::rebuild() {
  take_medium();
  request_build();
  touch();
}

void Viewer::cancel() {
  builder_.cancel();
  surface_builder_.cancel();
  environment_builder_.cancel();
}

bool Viewer::busy() const { return builder_.busy() || surface_builder_.busy() || environment_builder_.busy(); }

void Viewer::load_surfaces(const std::string& path) {
  sync();
  surface_builder_.load(path, surface_settings_.choice);
  touch();
}

void Viewer::show_surfaces(scene::ModelSourcePtr surfaces) {
  surface_builder_.cancel();
  sync();
  surface_asset_ = std::make_shared<const SurfaceAsset>(surfaces->scene, std::string());
  model_source_ = std::move(surfaces);
  touch();
}

void Viewer::set_surfaces(SurfaceAssetPtr surfaces) {
  if (surfaces) {
    surface_builder_.cancel_loads();  // poses go on: a host may set surfaces faster than they are posed
  } else {
    surface_builder_.cancel();
  }
  sync();
  surface_asset_ = std::move(surfaces);
  if (surface_asset_) {
    surface_builder_.pose(surface_asset_, surface_settings_.choice);
  } else {
    model_source_ = nullptr;
  }
  touch();
}

SurfaceAssetPtr Viewer::surfaces_asset() {
  sync();
  return surface_asset_;
}

void Viewer::set_surface_settings(const SurfaceSettings& settings) {
  if (settings.choice != surface_settings_.choice && !surface_builder_.configure_load(settings.choice)) {
    sync();
    if (surface_asset_) surface_builder_.pose(surface_asset_, settings.choice);
  }
  surface_settings_ = settings;
  touch();
}

void Viewer::use_surface_camera(std::size_t index) {
  sync();
  const std::size_t count = model_source_ ? model_source_->pose.cameras.size() : 0;
  if (index >= count) {
    throw Error(ErrorCode::invalid_argument,
                "there is no camera " + std::to_string(index) + ": the surfaces have " + std::to_string(count));
  }
  const surface::SceneCamera& seen = model_source_->pose.cameras[index];
  const dvec3 eye(seen.to_world[3]);
  const dvec3 forward = -glm::normalize(dvec3(seen.to_world[2]));
  CameraPose pose = camera_->pose();
  pose.eye = eye;
  // What it looks at, to orbit about: as far as the middle of the scene.
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
  if (!builder_.wait(until) || !surface_builder_.wait(until) || !environment_builder_.wait(until))
    throw Error(ErrorCode::timeout, "not ready in time");
  sync();
  if (const auto failure = surface_builder_.status().failure) throw Error(*failure);
  if (const auto failure = builder_.status().failure) throw Error(*failure);
  if (const auto failure = environment_builder_.status().failure) throw Error(*failure);
}

Viewer::Status Viewer::status() const {
  const Worker::Status volume = builder_.status();
  const double upload = upload_progress_.load(std::memory_order_relaxed);
  const Worker::Status surfaces = surface_builder_.status();
  const Worker::Status environment = environment_builder_.status();
  Status status{volume.stage, volume.fraction, volume.failure, surfaces.failure, environment.failure};
  for (const Worker::Status& other : {surfaces, environment}) {
    if (status.stage != Progress::Stage::idle) break;
    status.stage = other.stage;
    status.fraction = other.fraction;
  }
  if (status.stage == Progress::Stage::idle && upload < 1.0) {
    status.stage = Progress::Stage::uploading;
    status.fraction = upload;
  }
  return status;
}

// ---- settings ----

void Viewer::set_grid(const GridSettings& settings) {
  grid_ = settings;
  take_medium();
  request_build();
  touch();
}

void Viewer::take_medium() {
  grid_.build.emission = field_emission();
  grid_.build.density_ramp = ramps_.density;
  grid_.build.refine.density_scale = density_scale_to_come();
  grid_.build.refine.anisotropy = scene::mean_cosine(medium_.phase);
  grid_.build.anisotropic = medium_.phase.may_vary();
}

scene::Emission Viewer::field_emission() const {
  scene::Emission emission = medium_.field_emission;
  emission.temperature_ramp = ramps_.temperature;
  emission.flame_ramp = ramps_.flame;
  return emission;
}

void Viewer::set_ramps(const Ramps& ramps) {
  const bool other_density = ramps.density != ramps_.density;
  const bool other_emission = ramps.temperature != ramps_.temperature || ramps.flame != ramps_.flame;
  if (!other_density && !other_emission) return;
  ramps_ = ramps;
  take_medium();
  request_build(other_density ? nullptr : glows);
  touch();
}

void Viewer::remark_on_anisotropy() {
  if (medium_.phase.may_vary()) remarked_anisotropy_.reset();
  if (!volume_ || !volume_->has_anisotropy() || medium_.phase.may_vary()) return;
  const std::string& name = (*volume_->frame().anisotropy)[0].name;
  if (remarked_anisotropy_ == name) return;
  remarked_anisotropy_ = name;
  log_.info("grid \"" + name + "\" is not shown: the Mie phase function has an anisotropy of its own");
}

void Viewer::set_medium(const Medium& medium) {
  sync();
  medium_ = medium;
  remark_on_anisotropy();
  const scene::Emission emission = field_emission();
  const bool other_emission = grid_.build.emission != emission;
  const grid::RefineSettings& refine = grid_.build.refine;
  const double density_scale = density_scale_to_come();
  const bool other_opacity = grid_.build.march == scene::March::tet &&
                             refine.criterion == grid::Criterion::transmittance &&
                             (apart(density_scale, refine.density_scale) ||
                              apart(grid::hiding(density_scale, scene::mean_cosine(medium.phase)),
                                    grid::hiding(refine.density_scale, refine.anisotropy)));
  if (other_opacity) {
    take_medium();
    request_build();
  } else if (const bool other_phase = medium.phase.may_vary() != grid_.build.anisotropic;
             other_emission || other_phase) {
    const auto varied = [](const VolumeAsset& volume) { return volume.has_anisotropy(); };
    const auto either = [](const VolumeAsset& volume) { return volume.may_emit() || volume.has_anisotropy(); };
    grid_.build.emission = emission;
    grid_.build.anisotropic = medium.phase.may_vary();
    request_build(!other_phase ? glows : other_emission ? +either : +varied);
  }
  show_medium();
  touch();
}

double Viewer::density_scale_to_come() const { return suggested_density_scale_.value_or(medium_.density_scale); }

void Viewer::show_medium() {
  scene_.volumes.front().medium.set({medium_.density_scale, medium_.albedo, medium_.phase, medium_.emission});
}

void Viewer::set_light(const Light& light) {
  light_ = light;
  surround();
  touch();
}

void Viewer::set_lamps(light::Lamps lamps) {
  scene_.lamps.set(std::move(lamps));
  touch();
}

void Viewer::load_environment(const std::string& path) {
  sync();
  environment_builder_.load(path);
  touch();
}

void Viewer::set_environment(light::EnvironmentPtr environment) {
  environment_builder_.drop_loads();
  sync();
  show_environment(std::move(environment));
  touch();
}

const light::EnvironmentPtr& Viewer::environment() {
  sync();
  return environment_;
}

void Viewer::show_environment(light::EnvironmentPtr environment) {
  if (environment && environment->replaced > 0) {
    log_.warning(one_line(environment->name) + ": " + std::to_string(environment->replaced) +
                 " pixels are in part not finite, negative or above 1e30, which counts as 0");
  }
  environment_ = std::move(environment);
  surround();
}

void Viewer::set_environment_settings(const EnvironmentSettings& settings) {
  environment_settings_ = settings;
  surround();
  touch();
}

std::optional<light::Day> Viewer::day() const {
  if (!light_.sky) return std::nullopt;
  return light::Day{*light_.sky, light_.sun_elevation_degrees, ground_.place != GroundPlace::none};
}

void Viewer::surround() {
  light::Surroundings surroundings{environment_, environment_settings_.rotation_degrees,
                                   environment_settings_.strength};
  const std::optional<light::Day> wanted = day();
  if (!wanted) {
    daylight_.reset();
    scene_.lights.set({to_sun(light_.sun_azimuth_degrees, light_.sun_elevation_degrees), light_.sun_irradiance,
                       light_.sky_radiance, light_.sun_angle_degrees});
  } else if (!(daylight_ && daylight_->day == *wanted) && asked_day_ != wanted) {
    environment_builder_.make_sky(*wanted);
    asked_day_ = wanted;
  }
  // Until it is there sun and sky stay as they were, but for what only turns them.
  if (daylight_) {
    scene_.lights.set({to_sun(light_.sun_azimuth_degrees, daylight_->day.sun_elevation_degrees),
                       daylight_->sun_irradiance, light_.sky_radiance, light_.sun_angle_degrees});
    if (!environment_)
      surroundings = {.environment = daylight_->surroundings, .rotation_degrees = light_.sun_azimuth_degrees};
  }
  scene_.surroundings.set(std::move(surroundings));
}

void Viewer::set_ground(const GroundSettings& settings) {
  ground_ = settings;
  surround();
  touch();
}

void Viewer::set_sampling(const Sampling& sampling) {
  sampling_ = sampling;
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
  static_cast<void>(bounds());  // there is something to fit
  camera_->fit(*subject(), frame_size_.y > 0 ? double(frame_size_.x) / frame_size_.y : 1.0);
}

std::optional<Bounds> Viewer::box() const {
  std::optional<Bounds> box;
  if (volume_ && !volume_->empty()) box = volume_->bounds();
  if (shows_triangles()) {
    const surface::Pose& pose = model_source_->pose;
    box = box ? Bounds{glm::min(box->min, pose.low), glm::max(box->max, pose.high)} : Bounds{pose.low, pose.high};
  }
  return box;
}

bool Viewer::shows_triangles() const { return model_source_ && model_source_->scene->triangle_count() > 0; }

std::optional<scene::Ground> Viewer::ground() const {
  const auto all = box();
  // One at a height is there whatever else is: a sequence's frame may be empty.
  if (ground_.place == GroundPlace::none || (ground_.place == GroundPlace::below && !all)) return std::nullopt;
  scene::Ground ground{ground_.height, ground_.albedo};
  // Just below a model: many stand on a floor of their own.
  if (ground_.place == GroundPlace::below)
    ground.height = all->min.y - (shows_triangles() ? 1e-4 * glm::distance(all->min, all->max) : 0.0);
  // The horizon is then a ten-thousandth below where it is.
  const double eye = view_ ? std::abs(view_->eye.y - ground.height) : 0.0;
  const double scene = all ? glm::distance(all->min, all->max) + std::abs(all->min.y - ground.height) : 0.0;
  ground.reach = 1e4 * (scene + eye);
  return ground;
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
  if (volume_) {
    for (const dvec3& p : volume_->coarse().visible(direction, medium_.density_scale)) add(p);
    // What glows shows at any density.
    if (volume_->may_emit()) {
      const Bounds& box = volume_->bounds();
      for (int i = 0; i < 8; ++i)
        add({(i & 1) != 0 ? box.max.x : box.min.x, (i & 2) != 0 ? box.max.y : box.min.y,
             (i & 4) != 0 ? box.max.z : box.min.z});
    }
  }
  if (model_source_) {
    for (const surface::PosedVertex& vertex : model_source_->pose.vertices) add(vertex.position);
  }
  return reach;
}

Bounds Viewer::bounds() {
  sync();
  const auto all = box();
  if (!all) throw Error(ErrorCode::invalid_argument, "the viewer has nothing to show: no volume, no surfaces");
  return *all;
}

grid::RefineCamera Viewer::refine_camera() const {
  const ViewFrame& view = *view_;
  grid::RefineCamera refine;
  refine.right = glm::normalize(view.right);
  refine.up = glm::normalize(view.up);
  refine.forward = glm::normalize(glm::cross(refine.up, refine.right));
  // Off axis: the frustum about the axis that holds the picture's.
  refine.tan_half_x = glm::length(view.right) + std::abs(glm::dot(view.forward, refine.right));
  refine.tan_half_y = glm::length(view.up) + std::abs(glm::dot(view.forward, refine.up));
  refine.eye = view.eye;
  refine.pixels_per_radian = frame_size_.y / (2.0 * glm::length(view.up));
  if (view.orthographic) {
    // A pinhole so far back that its rays are as good as parallel.
    const double back = 1e4 * glm::length(view.up);
    refine.eye -= back * refine.forward;
    refine.tan_half_x /= back;
    refine.tan_half_y /= back;
    refine.pixels_per_radian *= back;
  }
  return refine;
}

VolumeAssetPtr Viewer::empty_volume() {
  if (!empty_volume_) {
    volume::ScalarVolume empty;
    empty.name = "nothing";
    empty.bounds_max = glm::ivec3(0);
    const dvec3 middle = 0.5 * (model_source_->pose.low + model_source_->pose.high);
    empty.index_to_world[3] = glm::dvec4(middle, 1.0);
    empty_volume_ = std::make_shared<const VolumeAsset>(std::move(empty));
  }
  return empty_volume_;
}

scene::SnapshotPtr Viewer::snapshot() {
  scene_.volumes.front().source = built_.source;
  scene_.models.clear();
  if (model_source_) scene_.models.push_back({model_source_});
  scene_.view.set(view_ ? std::optional<scene::Viewpoint>(*view_) : std::nullopt);
  scene_.ground.set(ground());
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
  shot.max_bounces = medium_.max_bounces;
  shot.sampling = sampling_;
  shot.surfaces = surface_settings_;
  shot.display = display_;
  shot.settings = settings_revision_;
  return shot;
}

}  // namespace cumulet::viewer
