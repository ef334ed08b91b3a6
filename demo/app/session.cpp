#include "session.hpp"

#include <GLFW/glfw3.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <glm/gtc/type_ptr.hpp>
#include <program.hpp>
#include <settings.hpp>
#include <span>
#include <stdexcept>
#include <tuple>
#include <utility>

#include "fire.hpp"
#include "history.hpp"
#include "saved_picture.hpp"

namespace cumulet::demo {
namespace {

using settings::same;

constexpr double patience = 1.0;  // seconds to wait for the volume before surfaces are shown without it

bool same_volume(const SceneVolume& a, const SceneVolume& b) {
  const auto rest = [](const SceneVolume& volume) {
    return std::tie(volume.name, volume.visible, volume.transforms, volume.shutter, volume.ramps,
                    volume.auto_density_scale, volume.sequence);
  };
  return volume_of(a) == volume_of(b) && rest(a) == rest(b) && same(a.medium, b.medium);
}

template <class Info>
Box box_of(const Info& info) {
  return {glm::make_vec3(info.bounds_min), glm::make_vec3(info.bounds_max)};
}

/// Returns the bounding box of an existing object.
template <class Info, class Handle, class Get>
std::optional<Box> box_of(Handle* handle, Get get) {
  Info info{};
  info.struct_size = sizeof info;
  if (handle == nullptr || get(handle, &info) != CUMULET_OK) return std::nullopt;
  return box_of(info);
}

std::optional<Item> item_of(const std::optional<Instances::Indices>& indices) {
  if (!indices) return std::nullopt;
  return Item{Item::Kind::volume, indices->volume + 1, indices->transform};  // index 0 is the viewer's own volume
}

}  // namespace

bool same_camera(const cumulet_camera_desc& a, const cumulet_camera_desc& b) { return same(a, b); }

bool same_request(const DesiredState& a, const DesiredState& b) {
  const auto rest = [](const DesiredState& desired) {
    return std::tie(desired.edits, desired.fit, desired.suggest, desired.unsaid, desired.adaptive_resolution,
                    desired.held, desired.paused, desired.budget_ms, desired.width, desired.height, desired.scale);
  };
  return rest(a) == rest(b) && same(a.navigation, b.navigation) && same_scene(a.scene, b.scene);
}

Session::Session(cumulet_get_proc_fn get_proc, void* get_proc_user, std::function<void()> wake, Timeline* timeline,
                 const std::string& shader_cache, const std::string& shaders)
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
  if (timeline != nullptr) {
    desc.trace = Timeline::add;
    desc.trace_user = timeline;
  }
  const auto programs = make_programs(shader_cache, shaders);
  desc.shader_cache = programs.get();
  cumulet_viewer* viewer = nullptr;
  std::array<char, 1024> error{};
  if (cumulet_create(&desc, &viewer, error.data(), error.size()) != CUMULET_OK) throw std::runtime_error(error.data());
  viewer_.reset(viewer);
  cumulet_camera* camera = nullptr;
  if (cumulet_get_camera(viewer_.get(), &camera) != CUMULET_OK)
    throw std::runtime_error(cumulet_last_error(viewer_.get()));
  camera_.reset(camera);
  seen_.struct_size = sizeof seen_;
}

void Session::on_log(void* user, cumulet_log_level level, const char* message) {
  if (level < CUMULET_LOG_INFO) return;
  auto* shared = static_cast<Shared*>(user);
  const std::lock_guard lock(shared->mutex);
  shared->warnings.emplace_back(message);
}

void Session::on_update(void* user) { static_cast<Shared*>(user)->wake(); }

bool Session::check(cumulet_status status) {
  if (status == CUMULET_OK) return true;
  const std::string cause = cumulet_last_error(viewer_.get());
  tell(true, cause.empty() ? cumulet_status_text(status) : cause);
  return false;
}

void Session::follow(const DesiredState& desired) {
  const bool first = !known_;
  DesiredState next = desired;
  // Values that the user has not changed since are those of the viewer.
  if (!first && desired.edits.camera == desired_.edits.camera) next.scene.camera = scene_.camera;
  if (!first && desired.number == desired_.number) next.scene.medium = scene_.medium;
  const bool load = !first && desired.edits.volume != desired_.edits.volume;
  if (!first && !load) set_volume(next.scene, volume_of(scene_));
  if (!first && desired.edits.surfaces == desired_.edits.surfaces) next.scene.surfaces = scene_.surfaces;
  if (!first && desired.edits.environment == desired_.edits.environment) next.scene.environment = scene_.environment;
  desired_ = std::move(next);
  scene_.sampling.preview = desired_.adaptive_resolution ? CUMULET_PREVIEW_AUTO : CUMULET_PREVIEW_OFF;
  // Refused settings count as passed, so that the error is reported once.
  if (first) known_ = SceneOptions();
  if (first || load) {
    fit_.reset();
    if (needs_fit(scene_.camera)) {
      // Fitted again when the density scale is known, because that determines the visible extent.
      if (scene_.surface_camera < 0) fit_ = scene_.camera;
    } else if (desired_.fit) {
      fit_.emplace();
      fit_->struct_size = sizeof *fit_;
      fit_->fovy_degrees = scene_.camera.fovy_degrees;
      fit_->lens_radius = scene_.camera.lens_radius;
    }
    suggest_ = desired_.suggest;
  }
  if (load && !scene_.volume.empty()) known_->volume.clear();
  const auto give = [this](auto group, auto set) {
    if (given_.take(scene_.*group)) check(set(viewer_.get(), &(scene_.*group)));
    (*known_).*group = scene_.*group;
  };
  give(&SceneOptions::medium, cumulet_set_medium);
  follow_ramps();
  give(&SceneOptions::ground, cumulet_set_ground);  // before the light, because the sky is computed for the ground
  give(&SceneOptions::light, cumulet_set_sun_sky);
  give(&SceneOptions::environment_settings, cumulet_set_environment_settings);
  follow_environment();
  follow_analytic_lights();
  give(&SceneOptions::sampling, cumulet_set_sampling);
  give(&SceneOptions::display, cumulet_set_display);
  if (!(desired_.held && status_.busy)) give(&SceneOptions::grid, cumulet_set_grid);
  if (!same(known_->camera, scene_.camera)) set_camera();
  follow_navigation();
  follow_surfaces();
  follow_transforms();
  follow_volume();
  follow_playback();
  follow_visible();
  if (!std::ranges::equal(known_->others, scene_.others, same_volume)) follow_others();
  if (known_->models != scene_.models) follow_models();
}

void Session::follow_visible() {
  if (waiting_ || known_->visible == scene_.visible) return;
  known_->visible = scene_.visible;
  if (sequence_) {
    check(cumulet_set_sequence(viewer_.get(), scene_.visible ? sequence_.get() : nullptr));
  } else if (scene_.visible) {
    if (hidden_) check(cumulet_set_volume(viewer_.get(), hidden_.get()));
    hidden_.reset();
  } else {
    hidden_ = shown();
    check(cumulet_set_volume(viewer_.get(), nullptr));
  }
}

// Sets a flag and wakes the viewer's thread when opening is done, also after an exception.
struct Session::Opened {
  Shared* shared;
  bool Shared::*what;
  ~Opened() {
    {
      const std::lock_guard lock(shared->mutex);
      shared->*what = true;
    }
    shared->wake();
  }
};

void Session::follow_models() {
  known_->models = scene_.models;
  try {
    models_.show(viewer_.get(), scene_.models);
  } catch (const std::runtime_error& error) {
    tell(true, error.what());
  }
  if (opening_model_.made.valid() || waiting_for_surfaces_) return;  // the pending surfaces may be the same file
  const std::vector<std::string> missing = models_.missing(scene_.models);
  if (missing.empty()) return;
  opening_model_.file = missing.front();
  SurfacesPtr own;
  if (opening_model_.file == shown_surfaces_) {
    cumulet_surfaces* surfaces = nullptr;
    check(cumulet_get_surfaces(viewer_.get(), &surfaces));
    own = SurfacesPtr(surfaces, cumulet_surfaces_release);
  }
  opening_model_.made = std::async(std::launch::async, [file = opening_model_.file, own, shared = shared_.get()] {
    const Opened tell{shared, &Shared::opened_model};
    return own ? own : open_surfaces(file);
  });
}

void Session::finish_models() {
  {
    const std::lock_guard lock(shared_->mutex);
    if (!std::exchange(shared_->opened_model, false)) return;
  }
  SurfacesPtr surfaces;
  try {
    surfaces = opening_model_.made.get();
    files_.push_back({opening_model_.file, Answer::File::Fate::opened});
  } catch (const std::runtime_error& error) {
    tell(true, error.what());
    files_.push_back({opening_model_.file, Answer::File::Fate::failed});
  }
  models_.give(opening_model_.file, std::move(surfaces));
  follow_models();
}

void Session::follow_others() {
  known_->others = scene_.others;
  try {
    others_.show(viewer_.get(), scene_.others);
  } catch (const std::runtime_error& error) {
    tell(true, error.what());
  }
  if (opening_.made.valid() || waiting_) return;  // the pending volume may be the same file
  const std::vector<VolumeFile> missing = others_.missing(scene_.others);
  if (missing.empty()) return;
  opening_.file = missing.front();
  std::shared_ptr<cumulet_volume> own;
  if (opening_.file == shown_volume_)
    own = hidden_ ? std::shared_ptr<cumulet_volume>(cumulet_volume_retain(hidden_.get()), cumulet_volume_release)
                  : std::shared_ptr<cumulet_volume>(shown());
  opening_.made = std::async(std::launch::async, [file = opening_.file, own, shared = shared_.get()] {
    const Opened tell{shared, &Shared::opened};
    return own ? look_into(own) : open_volume(file, on_log, shared);
  });
}

void Session::finish_others() {
  {
    const std::lock_guard lock(shared_->mutex);
    if (!std::exchange(shared_->opened, false)) return;
  }
  OpenVolume volume;
  try {
    volume = opening_.made.get();
    files_.push_back({opening_.file.volume, Answer::File::Fate::opened});
  } catch (const std::runtime_error& error) {
    tell(true, error.what());
    files_.push_back({opening_.file.volume, Answer::File::Fate::failed});
  }
  others_.give(opening_.file, std::move(volume));
  follow_others();
}

void Session::follow_transforms() {
  if (known_->transforms == scene_.transforms && known_->shutter == scene_.shutter) return;
  known_->transforms = scene_.transforms;
  known_->shutter = scene_.shutter;
  check(set_transforms(viewer_.get(), scene_));
}

void Session::follow_ramps() {
  for (std::size_t i = 0; i < scene_.ramps.size(); ++i) {
    const settings::RampPoints& points = scene_.ramps[i];
    if (known_->ramps[i] == points) continue;
    known_->ramps[i] = points;
    check(cumulet_set_ramp(viewer_.get(), static_cast<cumulet_ramp>(i), settings::numbers_of(points), points.size()));
  }
}

void Session::follow_analytic_lights() {
  if (std::ranges::equal(known_->analytic_lights, scene_.analytic_lights, settings::same<cumulet_light_desc>)) return;
  known_->analytic_lights = scene_.analytic_lights;
  check(cumulet_set_lights(viewer_.get(), scene_.analytic_lights.data(), scene_.analytic_lights.size()));
}

void Session::follow_environment() {
  if (known_->environment == scene_.environment) return;
  known_->environment = scene_.environment;
  if (scene_.environment.empty()) {
    check(cumulet_set_environment(viewer_.get(), nullptr));
    shown_environment_.clear();
    drop_thumbnail();
    status_.thumbnail.reset();
    waiting_for_environment_ = false;
    return;
  }
  waiting_for_environment_ = check(cumulet_load_environment(viewer_.get(), scene_.environment.c_str()));
  if (waiting_for_environment_) return;
  files_.push_back({scene_.environment, Answer::File::Fate::failed});
  scene_.environment = known_->environment = shown_environment_;
}

void Session::finish_environment() {
  waiting_for_environment_ = false;
  if (load_failed(status_.work.environment_status, status_.work.environment_message, scene_.environment)) {
    scene_.environment = known_->environment = shown_environment_;
    return;
  }
  shown_environment_ = scene_.environment;
  files_.push_back({shown_environment_, Answer::File::Fate::opened});
  begin_thumbnail();
}

void Session::begin_thumbnail() {
  drop_thumbnail();
  cumulet_environment* shown = nullptr;
  if (!check(cumulet_get_environment(viewer_.get(), &shown)) || shown == nullptr) return;
  const std::shared_ptr<cumulet_environment> environment(shown, cumulet_environment_release);
  drawing_ = std::async(std::launch::async, [environment, shared = shared_.get()] {
    ThumbnailPtr made = make_thumbnail(environment.get());
    {
      const std::lock_guard lock(shared->mutex);
      shared->thumbnail = std::move(made);
    }
    shared->wake();
  });
}

void Session::drop_thumbnail() {
  drawing_ = {};  // waits for the thread
  const std::lock_guard lock(shared_->mutex);
  shared_->thumbnail.reset();
}

void Session::follow_surfaces() {
  const bool other_settings = given_.take(scene_.surface);
  if (other_settings || known_->surface_variant != scene_.surface_variant) {
    set_surfaces();
    if (known_->surface.animation != scene_.surface.animation) read_surfaces();
  }
  known_->surface = scene_.surface;
  known_->surface_variant = scene_.surface_variant;
  if (known_->surfaces == scene_.surfaces) return;
  known_->surfaces = scene_.surfaces;
  if (scene_.surfaces.empty()) {
    remove_surfaces();
    return;
  }
  waiting_for_surfaces_ = check(cumulet_load_surfaces(viewer_.get(), scene_.surfaces.c_str()));
  if (waiting_for_surfaces_) return;
  files_.push_back({scene_.surfaces, Answer::File::Fate::failed});
  scene_.surfaces = known_->surfaces = shown_surfaces_;
}

void Session::set_surfaces() {
  cumulet_surface_settings_desc settings = scene_.surface;
  try {
    // The variant of surfaces that are still loading is resolved when they are loaded.
    if (known_->surfaces == scene_.surfaces && !waiting_for_surfaces_)
      settings.variant = variant_number(scene_.surfaces, scene_.surface_variant, status_.variants);
  } catch (const std::runtime_error& error) {
    tell(true, error.what());
  }
  check(cumulet_set_surface_settings(viewer_.get(), &settings));
}

void Session::remove_surfaces() {
  check(cumulet_set_surfaces(viewer_.get(), nullptr));
  scene_.surfaces.clear();
  known_->surfaces.clear();
  shown_surfaces_.clear();
  status_.surfaces = {};
  status_.animation = {};
  status_.variants.clear();
}

void Session::finish_surfaces() {
  waiting_for_surfaces_ = false;
  if (load_failed(status_.work.surfaces_status, status_.work.surfaces_message, scene_.surfaces)) {
    scene_.surfaces = known_->surfaces = shown_surfaces_;
    return;
  }
  read_surfaces();
  const std::string refusal = animation_refusal(scene_.surfaces, scene_.surface.animation, status_.surfaces.animations);
  if (!refusal.empty()) {
    tell(true, refusal);
    files_.push_back({scene_.surfaces, Answer::File::Fate::failed});
    remove_surfaces();
    return;
  }
  shown_surfaces_ = scene_.surfaces;
  if (!scene_.surface_variant.empty()) set_surfaces();
  files_.push_back({shown_surfaces_, Answer::File::Fate::opened});
  if (scene_.surface_camera >= 0)
    check(cumulet_use_surface_camera(viewer_.get(), static_cast<std::uint32_t>(scene_.surface_camera)));
}

bool Session::has_surfaces() const {
  cumulet_surfaces* shown = nullptr;
  if (cumulet_get_surfaces(viewer_.get(), &shown) != CUMULET_OK || shown == nullptr) return false;
  cumulet_surfaces_release(shown);
  return true;
}

void Session::read_surfaces() {
  cumulet_surfaces* shown = nullptr;
  check(cumulet_get_surfaces(viewer_.get(), &shown));
  if (shown == nullptr) return;
  cumulet_surfaces_info& info = status_.surfaces;
  info = {};
  info.struct_size = sizeof info;
  check(cumulet_surfaces_get_info(shown, &info));
  cumulet_animation_info& animation = status_.animation;
  animation = {};
  animation.struct_size = sizeof animation;
  const std::uint32_t number = scene_.surface.animation;
  if (number < info.animations) check(cumulet_surfaces_get_animation(shown, number, &animation));
  status_.variants = variant_names(shown);
  cumulet_surfaces_release(shown);
}

void Session::set_camera() {
  check(cumulet_camera_set(camera_.get(), &scene_.camera));
  known_->camera = scene_.camera;
  // The library's rounding is not a camera movement.
  static_cast<void>(cumulet_camera_get(camera_.get(), &seen_));
  if (needs_fit(scene_.camera) && !needs_fit(seen_)) scene_.camera = known_->camera = seen_;
}

bool Session::begin_volume() {
  cumulet_volume_file_desc file = volume_file(scene_);
  file.suggested_density_scale = suggest_ ? 1 : 0;
  std::optional<FrameRow> row;
  std::shared_ptr<cumulet_sequence> sequence;
  try {
    row = FrameRow::of_name(scene_.volume);
    if (row) sequence = open_sequence(row->files(), file);
    if (const std::string line = row ? row->pattern().passed_over() : ""; !line.empty()) tell(false, line);
  } catch (const std::exception& error) {
    tell(true, error.what());
    return false;
  }
  if (!row) return check(cumulet_load_volume_file(viewer_.get(), &file));
  const cumulet_playback_desc playback = playback_of(scene_.sequence, *row);
  const Moment moment = scene_.sequence.frame.value_or(row->number(playback.first_frame));
  static_cast<void>(cumulet_sequence_set_playback(sequence.get(), &playback));
  static_cast<void>(cumulet_sequence_set_frame(sequence.get(), row->position_of(moment)));
  VolumePtr volume = sequence_ || !known_->visible ? nullptr : shown();
  if (!check(cumulet_set_sequence(viewer_.get(), sequence.get()))) return false;
  if (!before_) before_ = Before{sequence_, row_, std::move(volume)};
  sequence_ = std::move(sequence);
  row_ = std::move(row);
  return true;
}

void Session::restore_volume() {
  set_volume(scene_, shown_volume_);
  set_volume(*known_, shown_volume_);
  fit_.reset();
  if (!before_) return;
  Before before = *std::exchange(before_, std::nullopt);
  sequence_ = std::move(before.sequence);
  row_ = std::move(before.row);
  if (before.volume)
    check(cumulet_set_volume(viewer_.get(), before.volume.get()));
  else
    check(cumulet_set_sequence(viewer_.get(), known_->visible ? sequence_.get() : nullptr));
}

void Session::follow_playback() {
  if (!sequence_) return;
  const cumulet_playback_desc playback = playback_of(scene_.sequence, *row_);
  check(cumulet_sequence_set_playback(sequence_.get(), &playback));
}

void Session::see_sequence() {
  status_.play.reset();
  if (!sequence_ || !scene_.visible) return;
  Play play{sequence_, *row_, {}, std::vector<std::uint8_t>(row_->count()), {}};
  play.info.struct_size = sizeof play.info;
  if (cumulet_get_sequence_info(viewer_.get(), &play.info, play.states.data(), play.states.size()) != CUMULET_OK)
    return;
  std::array<char, 512> cause{};
  static_cast<void>(cumulet_get_sequence_frame(viewer_.get(), play.info.requested_frame, cause.data(), cause.size()));
  play.failure = cause.data();
  // The other sequences use the same clock.
  const cumulet_playback_desc playback = playback_of(scene_.sequence, *row_);
  others_.go_to(playback.offset_seconds +
                (play.info.requested_position - playback.first_frame) / playback.frames_per_second);
  status_.play = std::move(play);
}

void Session::follow_volume() {
  if (volume_of(*known_) == volume_of(scene_)) return;
  set_volume(*known_, volume_of(scene_));
  if (scene_.volume.empty()) {
    check(cumulet_set_volume(viewer_.get(), nullptr));
    shown_volume_ = {};
    shown_box_.reset();
    hidden_.reset();
    sequence_.reset();
    before_.reset();
    grids_.clear();
    row_.reset();
    status_.neighbours.reset();
    status_.has_volume = false;
    status_.fields = {};
    waiting_ = false;
    return;
  }
  waiting_ = begin_volume();
  if (waiting_) return;
  files_.push_back({scene_.volume, Answer::File::Fate::failed});
  restore_volume();
}

cumulet_frame_desc Session::frame() const {
  cumulet_frame_desc frame{};
  frame.struct_size = sizeof frame;
  frame.width = desired_.width;
  frame.height = desired_.height;
  frame.scale = desired_.scale;
  return frame;
}

bool Session::has_news() const {
  const cumulet_frame_result& frame = status_.frame;
  return frame.width == 0 || (frame.flags & CUMULET_RENDER_NEW_IMAGE) != 0 || drawn_width_ != desired_.width ||
         drawn_height_ != desired_.height || !same(drawn_display_, scene_.display);
}

void Session::draw(unsigned framebuffer) {
  cumulet_frame_desc frame = this->frame();
  frame.budget_ms = -1.0;
  frame.framebuffer = framebuffer;
  status_.frame = {};
  status_.frame.struct_size = sizeof status_.frame;
  check(cumulet_render(viewer_.get(), &frame, &status_.frame));
  drawn_width_ = desired_.width;
  drawn_height_ = desired_.height;
  drawn_display_ = scene_.display;
}

bool Session::cold() const {
  const bool loads = waits() || status_.compiled;
  return !warm_ && loads && !desired_.paused && status_.frame.width == 0;
}

void Session::warm_up(unsigned framebuffer) {
  cumulet_frame_desc frame = this->frame();
  frame.budget_ms = desired_.budget_ms;
  frame.framebuffer = framebuffer;
  status_.frame = {};
  status_.frame.struct_size = sizeof status_.frame;
  cumulet_warm_up_result result{};
  result.struct_size = sizeof result;
  const bool works = check(cumulet_warm_up(viewer_.get(), &frame, CUMULET_WARM_UP_SCENE, &result));
  status_.compiled.reset();
  if (works && result.incomplete != 0) status_.compiled = result.progress;
  see_work();
  // If the volume takes long to load, loaded surfaces are shown before it. After a failed load the next scene counts as
  // the first.
  const double now = glfwGetTime();
  if (!cold_since_) cold_since_ = now;
  const bool early =
      waiting_ && status_.work.stage != CUMULET_STAGE_IDLE && now - *cold_since_ > patience && has_surfaces();
  if (early) status_.compiled.reset();
  const bool loaded = status_.work.volume_status == CUMULET_OK && status_.work.surfaces_status == CUMULET_OK;
  warm_ = early || (!status_.compiled && loaded);
}

void Session::work() {
  cumulet_frame_desc frame = this->frame();
  frame.budget_ms = desired_.paused ? -1.0 : desired_.budget_ms;
  frame.target = CUMULET_TARGET_NONE;
  status_.frame = {};
  status_.frame.struct_size = sizeof status_.frame;
  check(cumulet_render(viewer_.get(), &frame, &status_.frame));
  see_work();
}

void Session::see_work() {
  status_.work = {};
  status_.work.struct_size = sizeof status_.work;
  static_cast<void>(cumulet_get_progress(viewer_.get(), &status_.work));
  status_.stats.struct_size = sizeof status_.stats;
  static_cast<void>(cumulet_get_stats(viewer_.get(), &status_.stats));
  status_.busy = status_.work.stage != CUMULET_STAGE_IDLE || status_.compiled ||
                 (status_.frame.flags & CUMULET_RENDER_LOADING) != 0;
  tell_warnings();  // reported first, because they precede the result
  see_sequence();
  see_ends();
  finish_others();
  finish_models();
  status_.loading = waiting_                      ? scene_.volume
                    : waiting_for_surfaces_       ? scene_.surfaces
                    : waiting_for_environment_    ? scene_.environment
                    : opening_.made.valid()       ? opening_.file.volume
                    : opening_model_.made.valid() ? opening_model_.file
                                                  : std::string();
  see_camera();
  see_boxes();
  status_.has_content = status_.has_volume || !shown_surfaces_.empty() || !shown_environment_.empty() ||
                        !status_.boxes.volumes.empty() || !status_.boxes.models.empty();
  follow_backdrop();
  measure_noise();
  finish_saves();
}

// The library renders no image of an empty scene. An environment alone is therefore shown around a volume without
// density.
void Session::follow_backdrop() {
  const bool others =
      status_.has_volume || !shown_surfaces_.empty() || !status_.boxes.volumes.empty() || !status_.boxes.models.empty();
  const bool wanted = !shown_environment_.empty() && !others && scene_.volume.empty() && !waits();
  if (wanted && !backdrop_) {
    backdrop_ = make_backdrop();
    check(cumulet_set_volume(viewer_.get(), backdrop_.get()));
  }
  const bool ends = backdrop_ && !wanted && (others || shown_environment_.empty()) && !waiting_;
  if (!ends) return;
  backdrop_.reset();
  if (status_.has_volume) return;  // the loaded volume has replaced it
  check(cumulet_set_volume(viewer_.get(), nullptr));
  if (others) check(cumulet_frame_all(viewer_.get()));
}

Session::VolumePtr Session::make_backdrop() {
  const float nothing = 0.0f;
  cumulet_dense_desc dense{};
  dense.struct_size = sizeof dense;
  dense.values = &nothing;
  dense.value_count = 1;
  std::ranges::fill(dense.size, 1);
  cumulet_volume* volume = nullptr;
  std::array<char, 512> error{};
  if (cumulet_volume_from_dense(&dense, &volume, error.data(), error.size()) != CUMULET_OK) tell(true, error.data());
  return VolumePtr(volume);
}

void Session::tell_warnings() {
  const std::lock_guard lock(shared_->mutex);
  for (const std::string& warning : shared_->warnings) tell(false, warning);
  shared_->warnings.clear();
}

void Session::see_ends() {
  const cumulet_progress& work = status_.work;
  if (!status_.busy) {
    // Rebuilding displayed content can fail too.
    const auto tell_news = [this](cumulet_status status, const char* message, cumulet_status told) {
      if (status != told && status != CUMULET_OK && status != CUMULET_ERROR_CANCELLED) tell(true, message);
    };
    if (waiting_for_surfaces_) {
      finish_surfaces();
      follow_models();
    } else
      tell_news(work.surfaces_status, work.surfaces_message, told_surfaces_);
    if (waiting_) {
      finish_load();
      follow_others();
    } else {
      tell_news(work.volume_status, work.volume_message, told_volume_);
    }
    if (waiting_for_environment_)
      finish_environment();
    else
      tell_news(work.environment_status, work.environment_message, told_environment_);
  }
  if (!status_.busy || work.surfaces_status == CUMULET_OK) told_surfaces_ = work.surfaces_status;
  if (!status_.busy || work.volume_status == CUMULET_OK) told_volume_ = work.volume_status;
  if (!status_.busy || work.environment_status == CUMULET_OK) told_environment_ = work.environment_status;
}

bool Session::load_failed(cumulet_status status, const char* message, const std::string& path) {
  if (status == CUMULET_OK) return false;
  if (status == CUMULET_ERROR_CANCELLED) {
    tell(false, "Cancelled: " + path);
  } else {
    tell(true, message);
    files_.push_back({path, Answer::File::Fate::failed});
  }
  return true;
}

void Session::see_camera() {
  cumulet_camera_desc now{};
  now.struct_size = sizeof now;
  if (cumulet_camera_get(camera_.get(), &now) != CUMULET_OK || same(now, seen_)) return;
  camera_moved_ = true;
  seen_ = now;
  if (now.fovy_degrees == 0.0) now.fovy_degrees = scene_.camera.fovy_degrees;
  scene_.camera = known_->camera = now;
}

void Session::see_boxes() {
  // The frames of a sequence differ in size. If the volume is not transformed, the current bounding box is known.
  if (sequence_ && scene_.transforms.empty() && status_.has_volume) shown_box_ = box_of(status_.stats);
  status_.boxes = {};
  if (shown_box_) status_.boxes.volumes.emplace_back(shown_volume_, *shown_box_);
  for (const VolumeFile& file : scene_.others)
    if (const auto box = box_of<cumulet_volume_info>(others_.volume(file), cumulet_volume_get_info))
      status_.boxes.volumes.emplace_back(file, *box);
  for (const SceneModel& model : scene_.models)
    if (const auto box = box_of<cumulet_surfaces_info>(models_.surfaces(model.file), cumulet_surfaces_get_info))
      status_.boxes.models.emplace_back(model.file, *box);
}

bool Session::more() const {
  const bool compiles =
      status_.compiled && (status_.work.stage == CUMULET_STAGE_IDLE || status_.work.stage == CUMULET_STAGE_UPLOADING);
  return !desired_.paused && (compiles || (status_.frame.flags & CUMULET_RENDER_INCOMPLETE) != 0);
}

Answer Session::answer() {
  {
    const std::lock_guard lock(shared_->mutex);
    if (shared_->thumbnail) {
      status_.thumbnail = *std::exchange(shared_->thumbnail, std::nullopt);
      drawing_ = {};
    }
  }
  Answer answer;
  answer.desired = desired_.number;
  answer.status = status_;
  answer.grids = grids_;
  answer.waiting = waits() || drawing_.valid();
  answer.camera = scene_.camera;
  answer.volume = volume_of(scene_);
  answer.surfaces = scene_.surfaces;
  answer.environment = scene_.environment;
  answer.edits = desired_.edits;
  answer.camera_moved = std::exchange(camera_moved_, false);
  answer.density_scale = std::exchange(density_scale_, std::nullopt);
  answer.look = std::exchange(look_, std::nullopt);
  answer.picked = std::exchange(picked_, std::nullopt);
  answer.notices = std::exchange(notices_, {});
  answer.files = std::exchange(files_, {});
  return answer;
}

void Session::finish_load() {
  waiting_ = false;
  if (load_failed(status_.work.volume_status, status_.work.volume_message, scene_.volume)) {
    restore_volume();
    return;
  }
  before_.reset();
  cumulet_sequence_info playing{};
  playing.struct_size = sizeof playing;
  if (cumulet_get_sequence_info(viewer_.get(), &playing, nullptr, 0) != CUMULET_OK) {
    sequence_.reset();
    row_.reset();
  }
  shown_volume_ = volume_of(scene_);
  hidden_.reset();
  known_->visible = true;
  status_.has_volume = true;
  grids_.clear();
  const auto add = [](void* user, const char* name, const char* type, const char* refusal) {
    static_cast<std::vector<GridInfo>*>(user)->push_back({name, type, refusal});
  };
  status_.grid = shown_volume_.grid_name;
  cumulet_volume_info info{};
  info.struct_size = sizeof info;
  const VolumePtr volume = shown();
  shown_box_.reset();
  if (volume && cumulet_volume_get_info(volume.get(), &info) == CUMULET_OK) {
    status_.grid = info.name;
    shown_box_ = box_of(info);
  }
  status_.fields = {};
  for (std::size_t i = 0; volume && i < status_.fields.size(); ++i) {
    cumulet_histogram_info values{};
    values.struct_size = sizeof values;
    if (cumulet_volume_get_histogram(volume.get(), static_cast<cumulet_ramp>(i), &values) == CUMULET_OK &&
        values.max_value > 0.0f)
      status_.fields[i] = {values.max_value, heights(values.histogram)};
  }
  std::array<char, 512> error{};
  // For a sequence, the grids are those of the first readable frame.
  const auto file = [&](std::uint32_t i) { return row_ ? row_->file(i) : shown_volume_.volume; };
  cumulet_status listed = CUMULET_ERROR_FILE;
  for (std::uint32_t i = 0; listed != CUMULET_OK && i < (row_ ? row_->count() : 1); ++i)
    listed = cumulet_list_grids(file(i).c_str(), add, &grids_, error.data(), error.size());
  if (listed != CUMULET_OK) tell(true, error.data());
  status_.neighbours = row_ ? std::nullopt : FrameRow::around(shown_volume_.volume);
  files_.push_back({shown_volume_.volume, Answer::File::Fate::opened});
  if (std::exchange(suggest_, false)) suggest_look();
  follow_visible();
  if (!fit_) return;
  scene_.camera = *std::exchange(fit_, std::nullopt);
  set_camera();
  static_cast<void>(cumulet_frame_all(viewer_.get()));  // fails if there is nothing to fit; then fitted later
}

void Session::input(const ViewerInput& input) {
  std::int32_t handled = 0;
  const bool taken = cumulet_input(viewer_.get(), &input.event, &handled) == CUMULET_OK && handled != 0;
  if (!taken && input.event.type == CUMULET_EVENT_KEY_DOWN) move_by_keys(input.key);
}

Session::VolumePtr Session::shown() {
  cumulet_volume* volume = nullptr;
  check(cumulet_get_volume(viewer_.get(), &volume));
  return VolumePtr(volume);
}

void Session::suggest_density() {
  const VolumePtr volume = shown();
  double scale = 0.0;
  // A volume that shows nothing at any scale keeps its scale.
  if (sequence_) {
    see_sequence();
    if (status_.play) scale = status_.play->info.suggested_density_scale;
    if (scale == 0.0) return;
  } else if (!volume || cumulet_volume_suggest_density_scale(volume.get(), &scale) != CUMULET_OK) {
    return;
  }
  density_scale_ = scale;
  // Set immediately, because the next camera fit depends on it.
  known_->medium.density_scale = scene_.medium.density_scale = scale;
  give_known_medium();
}

void Session::pick(double x, double y) {
  cumulet_pick pick{};
  pick.struct_size = sizeof pick;
  picked_ = Picked{};
  // Fails before the first image.
  if (cumulet_pick_at(viewer_.get(), x, y, &pick) != CUMULET_OK || pick.hit == 0) return;
  if (pick.hit_surface != 0 && pick.tag > 0)
    picked_->item = Item{Item::Kind::model, static_cast<std::size_t>(pick.tag) - 1, 0};
  else if (pick.hit_volume != 0 && pick.tag == 0)
    picked_->item = Item{Item::Kind::volume, 0, pick.transform_index};
  else if (pick.hit_volume != 0)
    picked_->item = item_of(others_.find_tag(pick.tag));
}

void Session::suggest_look() {
  suggest_density();
  const VolumePtr volume = shown();
  if (!volume || !desired_.unsaid) return;
  cumulet_medium_desc look = SceneOptions().medium;
  look.density_scale = known_->medium.density_scale;
  look = medium_of_fire(volume.get(), look).value_or(look);
  settings::spell_out_zeros(look);
  look_ = known_->medium = scene_.medium = look;
  give_known_medium();
}

void Session::give_known_medium() {
  if (given_.take(known_->medium)) check(cumulet_set_medium(viewer_.get(), &known_->medium));
}

void Session::move_by_keys(int key) {
  constexpr double step = 0.1;
  constexpr double closer = 0.9;
  const auto orbit = [this](double yaw, double pitch) { check(cumulet_camera_orbit(camera_.get(), yaw, pitch)); };
  const auto dolly = [this](double factor) { check(cumulet_camera_dolly(camera_.get(), factor)); };
  switch (key) {
    case GLFW_KEY_LEFT:
      return orbit(-step, 0.0);
    case GLFW_KEY_RIGHT:
      return orbit(step, 0.0);
    case GLFW_KEY_UP:
      return orbit(0.0, step);
    case GLFW_KEY_DOWN:
      return orbit(0.0, -step);
    case GLFW_KEY_EQUAL:
    case GLFW_KEY_KP_ADD:
      return dolly(closer);
    case GLFW_KEY_MINUS:
    case GLFW_KEY_KP_SUBTRACT:
      return dolly(1.0 / closer);
    default:
      return;
  }
}

void Session::execute(const Request& request) {
  if (request.type == Request::Type::suggest_density) return suggest_density();
  if (request.type == Request::Type::pick) return pick(request.x, request.y);
  if (request.type == Request::Type::frame_all) {
    if (status_.has_volume || !scene_.others.empty() || !shown_surfaces_.empty() || !scene_.models.empty())
      check(cumulet_frame_all(viewer_.get()));
    return;
  }
  if (request.type == Request::Type::forget_saves) {
    saves_.clear();
    return;
  }
  // Previews and images of another size are not saved: finish_saves() writes the first complete image.
  saves_.push_back(request);
}

void Session::finish_saves() {
  if (!saves_.empty() && is_whole(status_.frame, desired_.width, desired_.height)) {
    for (const Request& request : std::exchange(saves_, {})) save(request);
    // Resumes the turntable.
    follow_navigation();
    shared_->wake();
  }
  status_.saving = saves_.empty() ? "" : saves_.front().path;
}

void Session::save(const Request& request) {
  try {
    std::string note;
    if (request.type == Request::Type::save_exr) {
      save_exr(viewer_.get(), scene_, status_.frame, request.path);
    } else {
      note = save_png(viewer_.get(), scene_, status_.frame, request.path);
    }
    files_.push_back({request.path, Answer::File::Fate::saved});
    tell(false, "Saved " + request.path + ", " + std::to_string(status_.frame.width) + "x" +
                    std::to_string(status_.frame.height));
    if (!note.empty()) tell(false, note);
  } catch (const std::exception& error) {
    tell(true, error.what());
  }
}

void Session::follow_navigation() {
  cumulet_navigation_desc navigation = desired_.navigation;
  // A rotating camera gives only previews.
  if (!saves_.empty()) navigation.turntable_degrees_per_second = 0.0;
  if (given_.take(navigation)) check(cumulet_set_navigation(viewer_.get(), &navigation));
}

// Measures the noise once per second while the image refines.
void Session::measure_noise() {
  constexpr double period = 1.0;
  const cumulet_frame_result& frame = status_.frame;
  const std::uint64_t samples = status_.stats.samples;
  const bool refining = (frame.flags & (CUMULET_RENDER_INCOMPLETE | CUMULET_RENDER_CONVERGED)) != 0 && !desired_.held &&
                        !desired_.paused && frame.width > 0 && frame.progress > 0.0 &&
                        (frame.flags & CUMULET_RENDER_PREVIEW) == 0 && scene_.sampling.view == CUMULET_VIEW_SHADED;
  // A decreasing count means another image.
  if (samples < noise_samples_) {
    status_.noise.reset();
    noise_samples_ = 0;
  }
  const double now = glfwGetTime();
  if (!refining || now - last_noise_ < period) return;
  if (samples == noise_samples_) return;
  last_noise_ = now;
  noise_samples_ = samples;
  double noise = 0.0;
  if (!check(cumulet_measure_noise(viewer_.get(), &noise))) return;
  status_.noise = std::isfinite(noise) ? std::optional(noise) : std::nullopt;
}

}  // namespace cumulet::demo
