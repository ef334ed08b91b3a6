#include "session.hpp"

#include <GLFW/glfw3.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <program.hpp>
#include <span>
#include <stdexcept>
#include <tuple>
#include <utility>

#include "aovs.hpp"
#include "history.hpp"

namespace cumulet::demo {
namespace {

template <class Number, std::size_t count>
bool same(const Number (&a)[count], const Number (&b)[count]) {
  return std::equal(a, a + count, b);
}

bool same(const cumulet_grid_desc& a, const cumulet_grid_desc& b) {
  const auto all = [](const cumulet_grid_desc& d) {
    return std::tie(d.march, d.cells, d.criterion, d.threshold, d.max_cells, d.camera_adaptive, d.pixel_size);
  };
  return all(a) == all(b);
}

bool same(const cumulet_medium_desc& a, const cumulet_medium_desc& b) {
  return std::tie(a.density_scale, a.anisotropy, a.max_bounces) ==
             std::tie(b.density_scale, b.anisotropy, b.max_bounces) &&
         same(a.coalbedo, b.coalbedo) && same(a.emission, b.emission);
}

bool same(const cumulet_light_desc& a, const cumulet_light_desc& b) {
  return std::tie(a.sun_azimuth_degrees, a.sun_elevation_degrees) ==
             std::tie(b.sun_azimuth_degrees, b.sun_elevation_degrees) &&
         same(a.sun_irradiance, b.sun_irradiance) && same(a.sky_radiance, b.sky_radiance);
}

bool same(const cumulet_sampling_desc& a, const cumulet_sampling_desc& b) {
  return std::tie(a.samples, a.seed, a.view, a.preview) == std::tie(b.samples, b.seed, b.view, b.preview);
}

bool same(const cumulet_display_desc& a, const cumulet_display_desc& b) {
  return std::tie(a.exposure_stops, a.tone_map, a.background) == std::tie(b.exposure_stops, b.tone_map, b.background);
}

bool same(const cumulet_surface_settings_desc& a, const cumulet_surface_settings_desc& b) {
  return std::tie(a.time, a.animation, a.light, a.indirect_roughness) ==
         std::tie(b.time, b.animation, b.light, b.indirect_roughness);
}

bool same(const cumulet_camera_desc& a, const cumulet_camera_desc& b) {
  return same(a.eye, b.eye) && same(a.target, b.target) && same(a.up, b.up) &&
         std::tie(a.fovy_degrees, a.orthographic_height, a.near_plane, a.far_plane) ==
             std::tie(b.fovy_degrees, b.orthographic_height, b.near_plane, b.far_plane);
}

bool same(const cumulet_navigation_desc& a, const cumulet_navigation_desc& b) {
  return std::tie(a.style, a.fly, a.speed, a.turntable_degrees_per_second) ==
         std::tie(b.style, b.fly, b.speed, b.turntable_degrees_per_second);
}

}  // namespace

void tell(Model& model, bool error, const std::string& text, double now) {
  constexpr double seconds = 5.0;
  constexpr std::size_t most = 3;
  const std::string line = one_line(text);
  std::erase_if(model.messages, [&](const Message& message) { return message.text == line; });
  if (model.messages.size() >= most) model.messages.erase(model.messages.begin());
  model.messages.push_back({error, line, now + seconds});
}

Session::Session(cumulet_get_proc_fn get_proc, void* get_proc_user, std::function<void()> wake)
    : shared_(std::make_unique<Shared>()) {
  shared_->wake = std::move(wake);
  cumulet_create_desc desc{};
  desc.struct_size = sizeof desc;
  desc.get_proc = get_proc;
  desc.get_proc_user = get_proc_user;
  desc.log = on_log;
  desc.log_user = shared_.get();
  desc.update = on_update;
  desc.update_user = shared_.get();
  cumulet_viewer* viewer = nullptr;
  std::array<char, 1024> error{};
  if (cumulet_create(&desc, &viewer, error.data(), error.size()) != CUMULET_OK) throw std::runtime_error(error.data());
  viewer_.reset(viewer);
  cumulet_camera* camera = nullptr;
  if (cumulet_get_camera(viewer_.get(), &camera) != CUMULET_OK)
    throw std::runtime_error(cumulet_last_error(viewer_.get()));
  camera_.reset(camera);
  seen_.struct_size = sizeof seen_;
  navigation_.struct_size = sizeof navigation_;
}

void Session::on_log(void* user, cumulet_log_level level, const char* message) {
  if (level < CUMULET_LOG_WARNING) return;
  auto* shared = static_cast<Shared*>(user);
  const std::lock_guard lock(shared->mutex);
  shared->warnings.emplace_back(message);
}

void Session::on_update(void* user) { static_cast<Shared*>(user)->wake(); }

bool Session::check(Model& model, cumulet_status status) {
  if (status == CUMULET_OK) return true;
  const std::string cause = cumulet_last_error(viewer_.get());
  tell(model, true, cause.empty() ? cumulet_status_text(status) : cause, glfwGetTime());
  return false;
}

void Session::follow(Model& model, bool held) {
  SceneOptions& scene = model.scene;
  scene.sampling.preview = model.adaptive_resolution ? CUMULET_PREVIEW_AUTO : CUMULET_PREVIEW_OFF;
  cumulet_viewer* viewer = viewer_.get();
  // What was given is known even if it was refused: the refusal is told once.
  if (!known_) {
    known_ = SceneOptions();
    known_->sampling.samples = 0;
  }
  if (!same(known_->medium, scene.medium)) check(model, cumulet_set_medium(viewer, &scene.medium));
  known_->medium = scene.medium;
  if (!same(known_->light, scene.light)) check(model, cumulet_set_light(viewer, &scene.light));
  known_->light = scene.light;
  if (!same(known_->sampling, scene.sampling)) check(model, cumulet_set_sampling(viewer, &scene.sampling));
  known_->sampling = scene.sampling;
  if (!same(known_->display, scene.display)) check(model, cumulet_set_display(viewer, &scene.display));
  known_->display = scene.display;
  if (!(held && model.status.busy)) {
    if (!same(known_->grid, scene.grid)) check(model, cumulet_set_grid(viewer, &scene.grid));
    known_->grid = scene.grid;
  }
  if (!same(known_->camera, scene.camera)) set_camera(model);
  if (!same(navigation_, model.navigation)) check(model, cumulet_set_navigation(viewer, &model.navigation));
  navigation_ = model.navigation;
  follow_surfaces(model);
  follow_volume(model);
}

void Session::follow_surfaces(Model& model) {
  SceneOptions& scene = model.scene;
  if (!same(known_->surface, scene.surface)) {
    check(model, cumulet_set_surface_settings(viewer_.get(), &scene.surface));
    if (known_->surface.animation != scene.surface.animation) read_surfaces(model);
  }
  known_->surface = scene.surface;
  if (known_->surfaces == scene.surfaces) return;
  known_->surfaces = scene.surfaces;
  if (scene.surfaces.empty()) {
    check(model, cumulet_set_surfaces(viewer_.get(), nullptr));
    shown_surfaces_.clear();
    model.status.surfaces = {};
    model.status.animation = {};
    return;
  }
  waiting_for_surfaces_ = check(model, cumulet_load_surfaces(viewer_.get(), scene.surfaces.c_str()));
  if (!waiting_for_surfaces_) scene.surfaces = known_->surfaces = shown_surfaces_;
}

void Session::finish_surfaces(Model& model) {
  waiting_for_surfaces_ = false;
  SceneOptions& scene = model.scene;
  const cumulet_progress& work = model.status.work;
  const bool failed =
      work.status != CUMULET_OK && std::string_view(static_cast<const char*>(work.message)).starts_with(scene.surfaces);
  if (failed) {
    tell(model, true, work.message, glfwGetTime());
    scene.surfaces = known_->surfaces = shown_surfaces_;
    return;
  }
  shown_surfaces_ = scene.surfaces;
  model.preferences.remember(shown_surfaces_);
  read_surfaces(model);
  if (scene.surface_camera >= 0)
    check(model, cumulet_use_surface_camera(viewer_.get(), static_cast<std::uint32_t>(scene.surface_camera)));
}

void Session::read_surfaces(Model& model) {
  cumulet_surfaces* shown = nullptr;
  check(model, cumulet_get_surfaces(viewer_.get(), &shown));
  if (shown == nullptr) return;
  cumulet_surfaces_info& info = model.status.surfaces;
  info = {};
  info.struct_size = sizeof info;
  check(model, cumulet_surfaces_get_info(shown, &info));
  cumulet_animation_info& animation = model.status.animation;
  animation = {};
  animation.struct_size = sizeof animation;
  const std::uint32_t number = model.scene.surface.animation;
  if (number < info.animations) check(model, cumulet_surfaces_get_animation(shown, number, &animation));
  cumulet_surfaces_release(shown);
}

void Session::set_camera(Model& model) {
  check(model, cumulet_camera_set(camera_.get(), &model.scene.camera));
  known_->camera = model.scene.camera;
  // What the library makes of it may differ in the last digit: that is no movement.
  static_cast<void>(cumulet_camera_get(camera_.get(), &seen_));
  if (is_unplaced(model.scene.camera) && !is_unplaced(seen_)) model.scene.camera = known_->camera = seen_;
}

void Session::follow_volume(Model& model) {
  SceneOptions& scene = model.scene;
  if (known_->volume == scene.volume && known_->grid_name == scene.grid_name) return;
  known_->volume = scene.volume;
  known_->grid_name = scene.grid_name;
  if (scene.volume.empty()) {
    check(model, cumulet_set_volume(viewer_.get(), nullptr));
    shown_volume_.clear();
    shown_grid_.clear();
    model.grids.clear();
    model.status.has_volume = false;
    waiting_ = false;
    return;
  }
  const char* grid = scene.grid_name.empty() ? nullptr : scene.grid_name.c_str();
  waiting_ = check(model, cumulet_load_volume(viewer_.get(), scene.volume.c_str(), grid));
  if (waiting_) return;
  fit_ = false;
  scene.volume = known_->volume = shown_volume_;
  scene.grid_name = known_->grid_name = shown_grid_;
}

void Session::reload() {
  if (known_) known_->volume.clear();
}

void Session::render(Model& model, const cumulet_frame_desc& frame) {
  Status& status = model.status;
  status.frame = {};
  status.frame.struct_size = sizeof status.frame;
  check(model, cumulet_render(viewer_.get(), &frame, &status.frame));
  status.work = {};
  status.work.struct_size = sizeof status.work;
  static_cast<void>(cumulet_get_progress(viewer_.get(), &status.work));
  status.stats.struct_size = sizeof status.stats;
  static_cast<void>(cumulet_get_stats(viewer_.get(), &status.stats));
  const bool was_busy = status.busy;
  status.busy = status.work.stage != CUMULET_STAGE_IDLE || (status.frame.flags & CUMULET_RENDER_LOADING) != 0;
  if (waiting_for_surfaces_ && !status.busy) finish_surfaces(model);
  if (waiting_ && !status.busy)
    finish_load(model);
  else if (was_busy && !status.busy && status.work.status != CUMULET_OK &&
           status.work.status != CUMULET_ERROR_CANCELLED)
    tell(model, true, status.work.message, glfwGetTime());

  cumulet_camera_desc now{};
  now.struct_size = sizeof now;
  camera_moved_ = cumulet_camera_get(camera_.get(), &now) == CUMULET_OK && !same(now, seen_);
  if (camera_moved_) {
    seen_ = now;
    if (now.fovy_degrees == 0.0) now.fovy_degrees = model.scene.camera.fovy_degrees;
    model.scene.camera = known_->camera = now;
  }

  const std::lock_guard lock(shared_->mutex);
  for (const std::string& warning : shared_->warnings) tell(model, false, warning, glfwGetTime());
  shared_->warnings.clear();
}

void Session::finish_load(Model& model) {
  waiting_ = false;
  SceneOptions& scene = model.scene;
  const cumulet_progress& work = model.status.work;
  if (work.status != CUMULET_OK) {
    const bool cancelled = work.status == CUMULET_ERROR_CANCELLED;
    tell(model, !cancelled, cancelled ? "Cancelled: " + scene.volume : work.message, glfwGetTime());
    scene.volume = known_->volume = shown_volume_;
    scene.grid_name = known_->grid_name = shown_grid_;
    fit_ = false;
    return;
  }
  shown_volume_ = scene.volume;
  shown_grid_ = scene.grid_name;
  model.status.has_volume = true;
  model.grids.clear();
  const auto add = [](void* user, const char* name, const char* type, const char* refusal) {
    static_cast<std::vector<GridInfo>*>(user)->push_back({name, type, refusal});
  };
  std::array<char, 512> error{};
  if (cumulet_list_grids(shown_volume_.c_str(), add, &model.grids, error.data(), error.size()) != CUMULET_OK)
    tell(model, true, error.data(), glfwGetTime());
  model.preferences.remember(shown_volume_);
  if (!fit_) return;
  fit_ = false;
  const double fovy = scene.camera.fovy_degrees;
  scene.camera = {};
  scene.camera.struct_size = sizeof scene.camera;
  scene.camera.fovy_degrees = fovy;
  set_camera(model);
}

void Session::frame_all(Model& model) {
  if (model.status.has_volume) check(model, cumulet_frame_all(viewer_.get()));
}

bool Session::input(const cumulet_event& event) {
  std::int32_t handled = 0;
  return cumulet_input(viewer_.get(), &event, &handled) == CUMULET_OK && handled != 0;
}

void Session::orbit(double yaw, double pitch) { static_cast<void>(cumulet_camera_orbit(camera_.get(), yaw, pitch)); }
void Session::dolly(double factor) { static_cast<void>(cumulet_camera_dolly(camera_.get(), factor)); }

void Session::write_exr(const Model& model, const std::string& path) {
  const std::uint32_t width = model.status.frame.width;
  const std::uint32_t height = model.status.frame.height;
  if (width == 0) throw std::runtime_error("there is no picture yet");
  std::vector<float> rgba(std::size_t{4} * width * height);
  if (cumulet_read_linear(viewer_.get(), rgba.data(), rgba.size()) != CUMULET_OK)
    throw std::runtime_error(cumulet_last_error(viewer_.get()));
  // All but the volume alone, which would cost every frame something.
  constexpr std::array aovs{CUMULET_AOV_TRANSMITTANCE, CUMULET_AOV_SURFACE_DEPTH, CUMULET_AOV_VOLUME_DEPTH,
                            CUMULET_AOV_NORMAL, CUMULET_AOV_ALBEDO};
  const bool shaded = model.scene.sampling.view == CUMULET_VIEW_SHADED;
  demo::write_exr(viewer_.get(), path, width, height, rgba, std::span(aovs).first(shaded ? aovs.size() : 0));
}

image::Image Session::read_display(const Model& model) {
  image::Image picture{model.status.frame.width, model.status.frame.height, {}};
  if (picture.width == 0) throw std::runtime_error("there is no picture yet");
  std::vector<std::uint8_t> bytes(std::size_t{4} * picture.width * picture.height);
  if (cumulet_read_display(viewer_.get(), bytes.data(), bytes.size()) != CUMULET_OK)
    throw std::runtime_error(cumulet_last_error(viewer_.get()));
  picture.rgba.resize(bytes.size());
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    const float value = static_cast<float>(bytes[i]) / 255.0f;
    picture.rgba[i] = i % 4 == 3 ? value : image::srgb_decode(value);
  }
  return picture;
}

void Session::measure_noise(Model& model) {
  double noise = 0.0;
  if (!check(model, cumulet_measure_noise(viewer_.get(), &noise))) return;
  model.status.noise = std::isfinite(noise) ? noise : 0.0;
  if (model.status.noise > 0.0) model.status.noise_percent.add(static_cast<float>(100.0 * model.status.noise));
}

}  // namespace cumulet::demo
