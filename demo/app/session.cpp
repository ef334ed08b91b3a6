#include "session.hpp"

#include <GLFW/glfw3.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <first_view.hpp>
#include <program.hpp>
#include <ramps.hpp>
#include <settings.hpp>
#include <span>
#include <stdexcept>
#include <tuple>
#include <utility>

#include "default_medium.hpp"
#include "history.hpp"
#include "ocio_text.hpp"
#include "saved_picture.hpp"

namespace cumulet::demo {
namespace {

using settings::same;

constexpr double patience = 1.0;  // seconds to wait for the volume before surfaces are shown without it

bool same_volume(const SceneVolume& a, const SceneVolume& b) {
  const auto rest = [](const SceneVolume& volume) {
    return std::tie(volume.name, volume.visible, volume.transforms, volume.shutter, volume.ramps, volume.color_ramps,
                    volume.clip, volume.auto_density_scale, volume.albedo_given, volume.sequence);
  };
  return volume_of(a) == volume_of(b) && rest(a) == rest(b) && same(a.medium, b.medium);
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
                 const ViewerSetup& setup)
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
  const auto programs = make_programs(setup.shader_cache, setup.shaders);
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
  add_notice(true, cause.empty() ? cumulet_status_text(status) : cause);
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
    first_view_.fit.reset();
    if (needs_fit(scene_.camera)) {
      // Fitted again when the density scale is known, because that determines the visible extent.
      if (scene_.surface_camera < 0) first_view_.fit = scene_.camera;
    } else if (desired_.fit) {
      first_view_.fit.emplace();
      first_view_.fit->struct_size = sizeof *first_view_.fit;
      first_view_.fit->fovy_degrees = scene_.camera.fovy_degrees;
      first_view_.fit->lens_radius = scene_.camera.lens_radius;
    }
    first_view_.suggest = desired_.suggest;
  }
  if (load && !scene_.volume.empty()) volume_.passed.volume.clear();
  const auto give = [this](auto group, auto set) {
    if (given_.take(scene_.*group)) check(set(viewer_.get(), &(scene_.*group)));
    (*known_).*group = scene_.*group;
  };
  give(&SceneOptions::medium, cumulet_set_medium);
  follow_ramps();
  follow_clip();
  give(&SceneOptions::ground, cumulet_set_ground);  // before the light, because the sky is computed for the ground
  give(&SceneOptions::light, cumulet_set_sun_sky);
  give(&SceneOptions::environment_settings, cumulet_set_environment_settings);
  follow_environment();
  follow_analytic_lights();
  give(&SceneOptions::sampling, cumulet_set_sampling);
  give(&SceneOptions::display, cumulet_set_display);
  follow_ocio();
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

void Session::follow_transforms() {
  if (known_->transforms == scene_.transforms && known_->shutter == scene_.shutter) return;
  known_->transforms = scene_.transforms;
  known_->shutter = scene_.shutter;
  check(set_transforms(viewer_.get(), scene_));
}

void Session::follow_ramps() {
  if (known_->ramps == scene_.ramps && known_->color_ramps == scene_.color_ramps) return;
  known_->ramps = scene_.ramps;
  known_->color_ramps = scene_.color_ramps;
  check(set_ramps(viewer_.get(), scene_));
}

void Session::follow_ocio() {
  const OcioView& view = scene_.ocio;
  if (std::exchange(known_->ocio, view) == view) return;
  if (!status_.ocio || status_.ocio->config != view.config) status_.ocio.reset();
  DisplayLut lut;
  if (!view.config.empty()) {
    try {
      if (!status_.ocio) status_.ocio = std::make_shared<const OcioDisplays>(ocio_displays(view.config));
      std::string note;
      lut = bake_ocio_view(view, &note);
      if (!note.empty()) add_notice(false, ocio_text(note));
    } catch (const std::exception& error) {
      add_notice(true, ocio_text(error.what()) + ". The tone map is used");
    }
  }
  const cumulet_display_lut_desc desc = desc_of(lut);
  check(cumulet_set_display_lut(viewer_.get(), lut.values.empty() ? nullptr : &desc));
}

void Session::follow_clip() {
  if (known_->clip == scene_.clip) return;
  known_->clip = scene_.clip;
  const cumulet_clip_desc clip = settings::clip_desc_of(scene_.clip);
  check(cumulet_set_clip(viewer_.get(), &clip));
}

void Session::follow_analytic_lights() {
  if (std::ranges::equal(known_->analytic_lights, scene_.analytic_lights, settings::same<cumulet_light_desc>)) return;
  known_->analytic_lights = scene_.analytic_lights;
  check(cumulet_set_lights(viewer_.get(), scene_.analytic_lights.data(), scene_.analytic_lights.size()));
}

void Session::set_camera() {
  check(cumulet_camera_set(camera_.get(), &scene_.camera));
  known_->camera = scene_.camera;
  // The library's rounding is not a camera movement.
  static_cast<void>(cumulet_camera_get(camera_.get(), &seen_));
  if (needs_fit(scene_.camera) && !needs_fit(seen_)) scene_.camera = known_->camera = seen_;
}

void Session::follow_playback() {
  if (!playing_.sequence) return;
  const cumulet_playback_desc playback = playback_of(scene_.sequence, *playing_.row);
  check(cumulet_sequence_set_playback(playing_.sequence.get(), &playback));
}

void Session::see_sequence() {
  status_.play.reset();
  if (!playing_.sequence || !scene_.visible) return;
  Play play{playing_.sequence, *playing_.row, {}, std::vector<std::uint8_t>(playing_.row->count()), {}};
  play.info.struct_size = sizeof play.info;
  if (cumulet_get_sequence_info(viewer_.get(), &play.info, play.states.data(), play.states.size()) != CUMULET_OK)
    return;
  std::array<char, 512> cause{};
  static_cast<void>(cumulet_get_sequence_frame(viewer_.get(), play.info.requested_frame, cause.data(), cause.size()));
  play.failure = cause.data();
  // The other sequences use the same clock.
  const cumulet_playback_desc playback = playback_of(scene_.sequence, *playing_.row);
  others_.go_to(playback.offset_seconds +
                (play.info.requested_position - playback.first_frame) / playback.frames_per_second);
  status_.play = std::move(play);
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
  return frame.width == 0 || (frame.flags & CUMULET_RENDER_NEW_IMAGE) != 0 || drawn_.width != desired_.width ||
         drawn_.height != desired_.height || !same(drawn_.display, scene_.display) || drawn_.ocio != scene_.ocio;
}

void Session::draw(unsigned framebuffer) {
  cumulet_frame_desc frame = this->frame();
  frame.budget_ms = -1.0;
  frame.framebuffer = framebuffer;
  status_.frame = {};
  status_.frame.struct_size = sizeof status_.frame;
  check(cumulet_render(viewer_.get(), &frame, &status_.frame));
  drawn_.width = desired_.width;
  drawn_.height = desired_.height;
  drawn_.display = scene_.display;
  drawn_.ocio = scene_.ocio;
}

std::string Session::write(const PictureFile& file) {
  return write_picture_file(viewer_.get(), scene_, others_, status_.frame, file);
}

bool Session::cold() const {
  const bool loads = waits() || status_.compiled;
  return !warm_up_.done && loads && !desired_.paused && status_.frame.width == 0;
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
  if (!warm_up_.since) warm_up_.since = now;
  const bool early =
      volume_.loading && status_.work.stage != CUMULET_STAGE_IDLE && now - *warm_up_.since > patience && has_surfaces();
  if (early) status_.compiled.reset();
  const bool loaded = status_.work.volume_status == CUMULET_OK && status_.work.surfaces_status == CUMULET_OK;
  warm_up_.done = early || (!status_.compiled && loaded);
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
  add_warnings();  // reported first, because they precede the result
  see_sequence();
  see_ends();
  finish_others();
  finish_models();
  status_.loading = volume_.loading               ? scene_.volume
                    : surfaces_.loading           ? scene_.surfaces
                    : environment_.loading        ? scene_.environment
                    : opening_.made.valid()       ? opening_.file.volume
                    : opening_model_.made.valid() ? opening_model_.file
                                                  : std::string();
  see_camera();
  see_boxes();
  status_.has_content = status_.has_volume || !surfaces_.shown.empty() || !environment_.shown.empty() ||
                        !status_.boxes.volumes.empty() || !status_.boxes.models.empty();
  follow_backdrop();
  measure_noise();
  measure_exposure();
  finish_saves();
}

// The library renders no image of an empty scene. An environment alone is therefore shown around a volume without
// density.
void Session::follow_backdrop() {
  const bool others =
      status_.has_volume || !surfaces_.shown.empty() || !status_.boxes.volumes.empty() || !status_.boxes.models.empty();
  const bool wanted = !environment_.shown.empty() && !others && scene_.volume.empty() && !waits();
  if (wanted && !backdrop_) {
    backdrop_ = make_backdrop();
    check(cumulet_set_volume(viewer_.get(), backdrop_.get()));
  }
  const bool ends = backdrop_ && !wanted && (others || environment_.shown.empty()) && !volume_.loading;
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
  if (cumulet_volume_from_dense(&dense, &volume, error.data(), error.size()) != CUMULET_OK)
    add_notice(true, error.data());
  return VolumePtr(volume);
}

void Session::add_warnings() {
  const std::lock_guard lock(shared_->mutex);
  for (const std::string& warning : shared_->warnings) add_notice(false, warning);
  shared_->warnings.clear();
}

void Session::see_camera() {
  cumulet_camera_desc now{};
  now.struct_size = sizeof now;
  if (cumulet_camera_get(camera_.get(), &now) != CUMULET_OK || same(now, seen_)) return;
  // The library has placed the camera.
  if (needs_fit(seen_) && scene_.surface_camera < 0) {
    turn_to_first_view(viewer_.get());
    static_cast<void>(cumulet_camera_get(camera_.get(), &now));
  }
  events_.camera_moved = true;
  seen_ = now;
  if (now.fovy_degrees == 0.0) now.fovy_degrees = scene_.camera.fovy_degrees;
  scene_.camera = known_->camera = now;
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
  static_cast<AnswerEvents&>(answer) = std::exchange(events_, {});
  return answer;
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
  if (playing_.sequence) {
    see_sequence();
    if (status_.play) scale = status_.play->info.suggested_density_scale;
    if (scale == 0.0) return;
  } else if (!volume || cumulet_volume_suggest_density_scale(volume.get(), &scale) != CUMULET_OK) {
    return;
  }
  events_.density_scale = scale;
  // Set immediately, because the next camera fit depends on it.
  known_->medium.density_scale = scene_.medium.density_scale = scale;
  give_known_medium();
}

void Session::pick(double x, double y) {
  cumulet_pick pick{};
  pick.struct_size = sizeof pick;
  events_.picked = Picked{};
  // Fails before the first image.
  if (cumulet_pick_at(viewer_.get(), x, y, &pick) != CUMULET_OK || pick.hit == 0) return;
  if (pick.hit_surface != 0 && pick.tag > 0)
    events_.picked->item = Item{Item::Kind::model, static_cast<std::size_t>(pick.tag) - 1, 0};
  else if (pick.hit_volume != 0 && pick.tag == 0)
    events_.picked->item = Item{Item::Kind::volume, 0, pick.transform_index};
  else if (pick.hit_volume != 0)
    events_.picked->item = item_of(others_.find_tag(pick.tag));
}

void Session::suggest_look() {
  suggest_density();
  const VolumePtr volume = shown();
  if (!volume || !desired_.unsaid) return;
  SceneVolume plain;
  static_cast<VolumeFile&>(plain) = volume_of(scene_);
  plain.albedo_given = scene_.albedo_given;
  plain.medium.density_scale = known_->medium.density_scale;
  events_.look = default_medium(volume.get(), plain);
  settings::spell_out_zeros(events_.look->medium);
  known_->medium = scene_.medium = events_.look->medium;
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
  if (request.type == Request::Type::meter_exposure) return meter_.request();
  if (request.type == Request::Type::pick) return pick(request.x, request.y);
  if (request.type == Request::Type::frame_all) {
    if (status_.has_volume || !scene_.others.empty() || !surfaces_.shown.empty() || !scene_.models.empty())
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
    events_.files.push_back({request.path, Answer::File::Fate::saved});
    add_notice(false, "Saved " + request.path + ", " + std::to_string(status_.frame.width) + "x" +
                          std::to_string(status_.frame.height));
    if (!note.empty()) add_notice(false, note);
  } catch (const std::exception& error) {
    add_notice(true, error.what());
  }
}

void Session::follow_navigation() {
  cumulet_navigation_desc navigation = desired_.navigation;
  // A rotating camera gives only previews.
  if (!saves_.empty()) navigation.turntable_degrees_per_second = 0.0;
  if (given_.take(navigation)) check(cumulet_set_navigation(viewer_.get(), &navigation));
}

void Session::measure_exposure() {
  const cumulet_frame_result& frame = status_.frame;
  // Previews light surfaces without shadows.
  const bool preview =
      (frame.flags & CUMULET_RENDER_PREVIEW) != 0 && (!surfaces_.shown.empty() || !scene_.models.empty());
  const bool complete = !waits() && !status_.busy && !preview && frame.width > 0 && frame.progress > 0.0 &&
                        scene_.sampling.view == CUMULET_VIEW_SHADED;
  const image::Curve curve =
      scene_.display.tone_map == CUMULET_TONE_MAP_FILMIC ? image::Curve::filmic : image::Curve::neutral;
  if (auto metered = meter_.follow(viewer_.get(), complete, frame.flags, curve)) events_.metered = *metered;
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
  if (samples < noise_.samples) {
    status_.noise.reset();
    noise_.samples = 0;
  }
  const double now = glfwGetTime();
  if (!refining || now - noise_.measured_at < period) return;
  if (samples == noise_.samples) return;
  noise_.measured_at = now;
  noise_.samples = samples;
  double noise = 0.0;
  if (!check(cumulet_measure_noise(viewer_.get(), &noise))) return;
  status_.noise = std::isfinite(noise) ? std::optional(noise) : std::nullopt;
}

}  // namespace cumulet::demo
