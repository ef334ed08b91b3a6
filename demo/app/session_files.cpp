#include <algorithm>
#include <array>
#include <cstdint>
#include <exception>
#include <future>
#include <glm/gtc/type_ptr.hpp>
#include <memory>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "session.hpp"

// The files of a session: volumes, models, surfaces and the environment.
namespace cumulet::demo {
namespace {

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

ModelFile model_file(const std::string& file, const cumulet_surfaces* surfaces) {
  ModelFile made{file, {}, variant_names(surfaces)};
  cumulet_animation_info info{};
  info.struct_size = sizeof info;
  for (std::uint32_t i = 0; cumulet_surfaces_get_animation(surfaces, i, &info) == CUMULET_OK; ++i)
    made.animations.push_back({info.name, info.duration});
  return made;
}

/// Reads files that are open now, and drops those that the models do not name.
void follow_files(std::vector<ModelFile>& files, const std::vector<SceneModel>& models, const Models& open) {
  std::erase_if(files, [&](const ModelFile& file) { return open.surfaces(file.file) == nullptr; });
  for (const SceneModel& model : models) {
    const cumulet_surfaces* surfaces = open.surfaces(model.file);
    if (surfaces != nullptr && std::ranges::find(files, model.file, &ModelFile::file) == files.end())
      files.push_back(model_file(model.file, surfaces));
  }
}

}  // namespace

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

void Session::follow_visible() {
  if (volume_.loading || known_->visible == scene_.visible) return;
  known_->visible = scene_.visible;
  if (playing_.sequence) {
    check(cumulet_set_sequence(viewer_.get(), scene_.visible ? playing_.sequence.get() : nullptr));
  } else if (scene_.visible) {
    if (hidden_) check(cumulet_set_volume(viewer_.get(), hidden_.get()));
    hidden_.reset();
  } else {
    hidden_ = shown();
    check(cumulet_set_volume(viewer_.get(), nullptr));
  }
}

void Session::follow_volume() {
  if (!volume_.take(scene_)) return;
  if (scene_.volume.empty()) {
    check(cumulet_set_volume(viewer_.get(), nullptr));
    volume_.shown = {};
    shown_box_.reset();
    hidden_.reset();
    playing_.sequence.reset();
    before_.reset();
    grids_.clear();
    playing_.row.reset();
    status_.neighbours.reset();
    status_.has_volume = false;
    status_.fields = {};
    volume_.loading = false;
    return;
  }
  volume_.loading = begin_volume();
  if (volume_.loading) return;
  events_.files.push_back({scene_.volume, Answer::File::Fate::failed});
  restore_volume();
}

bool Session::begin_volume() {
  cumulet_volume_file_desc file = volume_file(scene_);
  file.suggested_density_scale = first_view_.suggest ? 1 : 0;
  std::optional<FrameRow> row;
  std::shared_ptr<cumulet_sequence> sequence;
  try {
    row = FrameRow::of_name(scene_.volume);
    if (row) sequence = open_sequence(row->files(), file);
    if (const std::string line = row ? row->pattern().passed_over() : ""; !line.empty()) add_notice(false, line);
  } catch (const std::exception& error) {
    add_notice(true, error.what());
    return false;
  }
  if (!row) return check(cumulet_load_volume_file(viewer_.get(), &file));
  const cumulet_playback_desc playback = playback_of(scene_.sequence, *row);
  const Moment moment = scene_.sequence.frame.value_or(row->number(playback.first_frame));
  static_cast<void>(cumulet_sequence_set_playback(sequence.get(), &playback));
  static_cast<void>(cumulet_sequence_set_frame(sequence.get(), row->position_of(moment)));
  VolumePtr volume = playing_.sequence || !known_->visible ? nullptr : shown();
  if (!check(cumulet_set_sequence(viewer_.get(), sequence.get()))) return false;
  if (!before_) before_ = Before{playing_, std::move(volume)};
  playing_ = {std::move(sequence), std::move(row)};
  return true;
}

void Session::restore_volume() {
  volume_.restore(scene_);
  first_view_.fit.reset();
  if (!before_) return;
  Before before = *std::exchange(before_, std::nullopt);
  playing_ = std::move(before.playing);
  if (before.volume)
    check(cumulet_set_volume(viewer_.get(), before.volume.get()));
  else
    check(cumulet_set_sequence(viewer_.get(), known_->visible ? playing_.sequence.get() : nullptr));
}

void Session::finish_load() {
  volume_.loading = false;
  if (load_failed(status_.work.volume_status, status_.work.volume_message, scene_.volume)) {
    restore_volume();
    return;
  }
  before_.reset();
  cumulet_sequence_info playing{};
  playing.struct_size = sizeof playing;
  if (cumulet_get_sequence_info(viewer_.get(), &playing, nullptr, 0) != CUMULET_OK) {
    playing_ = {};
  }
  volume_.shown = volume_of(scene_);
  hidden_.reset();
  known_->visible = true;
  status_.has_volume = true;
  grids_.clear();
  const auto add = [](void* user, const char* name, const char* type, const char* refusal) {
    static_cast<std::vector<GridInfo>*>(user)->push_back({name, type, refusal});
  };
  status_.grid = volume_.shown.grid_name;
  cumulet_volume_info info{};
  info.struct_size = sizeof info;
  const VolumePtr volume = shown();
  shown_box_.reset();
  if (volume && cumulet_volume_get_info(volume.get(), &info) == CUMULET_OK) {
    status_.grid = info.name;
    shown_box_ = box_of(info);
  }
  status_.fields = volume ? fields_of(*volume) : Fields();
  std::array<char, 512> error{};
  // For a sequence, the grids are those of the first readable frame.
  const auto file = [&](std::uint32_t i) { return playing_.row ? playing_.row->file(i) : volume_.shown.volume; };
  cumulet_status listed = CUMULET_ERROR_FILE;
  for (std::uint32_t i = 0; listed != CUMULET_OK && i < (playing_.row ? playing_.row->count() : 1); ++i)
    listed = cumulet_list_grids(file(i).c_str(), add, &grids_, error.data(), error.size());
  if (listed != CUMULET_OK) add_notice(true, error.data());
  status_.neighbours = playing_.row ? std::nullopt : FrameRow::around(volume_.shown.volume);
  events_.files.push_back({volume_.shown.volume, Answer::File::Fate::opened});
  if (std::exchange(first_view_.suggest, false)) suggest_look();
  follow_visible();
  if (!first_view_.fit) return;
  scene_.camera = *std::exchange(first_view_.fit, std::nullopt);
  set_camera();
  static_cast<void>(cumulet_frame_all(viewer_.get()));  // fails if there is nothing to fit; then fitted later
}

void Session::follow_others() {
  known_->others = scene_.others;
  std::erase_if(status_.others, [this](const OtherVolume& other) {
    return std::ranges::none_of(scene_.others, [&](const VolumeFile& file) { return file == other.file; });
  });
  try {
    others_.show(viewer_.get(), scene_.others);
  } catch (const std::runtime_error& error) {
    add_notice(true, error.what());
  }
  if (opening_.made.valid() || volume_.loading) return;  // the pending volume may be the same file
  const std::vector<VolumeFile> missing = others_.missing(scene_.others);
  if (missing.empty()) return;
  opening_.file = missing.front();
  std::shared_ptr<cumulet_volume> own;
  if (opening_.file == volume_.shown)
    own = hidden_ ? std::shared_ptr<cumulet_volume>(cumulet_volume_retain(hidden_.get()), cumulet_volume_release)
                  : std::shared_ptr<cumulet_volume>(shown());
  opening_.made = std::async(std::launch::async, [file = opening_.file, own, shared = shared_.get()] {
    const Opened opened{shared, &Shared::opened};
    OtherVolume made{file, {}, {}};
    const auto see = [&made](const cumulet_volume& volume) { made.fields = fields_of(volume); };
    if (own) see(*own);
    made.open = own ? look_into(own, file) : open_volume(file, on_log, shared, see);
    return made;
  });
}

void Session::finish_others() {
  {
    const std::lock_guard lock(shared_->mutex);
    if (!std::exchange(shared_->opened, false)) return;
  }
  OpenVolume volume;
  try {
    OtherVolume made = opening_.made.get();
    volume = made.open;
    made.open.volume.reset();
    status_.others.push_back(std::move(made));
    events_.files.push_back({opening_.file.volume, Answer::File::Fate::opened});
  } catch (const std::runtime_error& error) {
    add_notice(true, error.what());
    events_.files.push_back({opening_.file.volume, Answer::File::Fate::failed});
  }
  others_.give(opening_.file, std::move(volume));
  follow_others();
}

void Session::follow_models() {
  known_->models = scene_.models;
  try {
    models_.show(viewer_.get(), scene_.models);
  } catch (const std::runtime_error& error) {
    add_notice(true, error.what());
  }
  follow_files(status_.model_files, scene_.models, models_);
  if (opening_model_.made.valid() || surfaces_.loading) return;  // the pending surfaces may be the same file
  const std::vector<std::string> missing = models_.missing(scene_.models);
  if (missing.empty()) return;
  opening_model_.file = missing.front();
  SurfacesPtr own;
  if (opening_model_.file == surfaces_.shown) {
    cumulet_surfaces* surfaces = nullptr;
    check(cumulet_get_surfaces(viewer_.get(), &surfaces));
    own = SurfacesPtr(surfaces, cumulet_surfaces_release);
  }
  opening_model_.made = std::async(std::launch::async, [file = opening_model_.file, own, shared = shared_.get()] {
    const Opened opened{shared, &Shared::opened_model};
    return own ? own : open_surfaces(file, on_log, shared);
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
    events_.files.push_back({opening_model_.file, Answer::File::Fate::opened});
  } catch (const std::runtime_error& error) {
    add_notice(true, error.what());
    events_.files.push_back({opening_model_.file, Answer::File::Fate::failed});
  }
  models_.give(opening_model_.file, std::move(surfaces));
  follow_models();
}

void Session::follow_surfaces() {
  const bool other_settings = given_.take(scene_.surface);
  if (other_settings || known_->surface_variant != scene_.surface_variant) set_surfaces();
  known_->surface = scene_.surface;
  known_->surface_variant = scene_.surface_variant;
  if (!surfaces_.take(scene_.surfaces)) return;
  if (scene_.surfaces.empty()) {
    remove_surfaces();
    return;
  }
  surfaces_.loading = check(cumulet_load_surfaces(viewer_.get(), scene_.surfaces.c_str()));
  if (surfaces_.loading) return;
  events_.files.push_back({scene_.surfaces, Answer::File::Fate::failed});
  surfaces_.restore(scene_.surfaces);
}

void Session::set_surfaces() {
  cumulet_surface_settings_desc settings = scene_.surface;
  try {
    // The variant of surfaces that are still loading is resolved when they are loaded.
    if (surfaces_.passed == scene_.surfaces && !surfaces_.loading)
      settings.variant = variant_number(scene_.surfaces, scene_.surface_variant, status_.surfaces_file.variants);
  } catch (const std::runtime_error& error) {
    add_notice(true, error.what());
  }
  check(cumulet_set_surface_settings(viewer_.get(), &settings));
}

void Session::remove_surfaces() {
  check(cumulet_set_surfaces(viewer_.get(), nullptr));
  scene_.surfaces.clear();
  surfaces_.passed.clear();
  surfaces_.shown.clear();
  status_.surfaces = {};
  status_.surfaces_file = {};
}

void Session::finish_surfaces() {
  surfaces_.loading = false;
  if (load_failed(status_.work.surfaces_status, status_.work.surfaces_message, scene_.surfaces)) {
    surfaces_.restore(scene_.surfaces);
    return;
  }
  read_surfaces();
  const std::string refusal = animation_refusal(scene_.surfaces, scene_.surface.animation, status_.surfaces.animations);
  if (!refusal.empty()) {
    add_notice(true, refusal);
    events_.files.push_back({scene_.surfaces, Answer::File::Fate::failed});
    remove_surfaces();
    return;
  }
  surfaces_.shown = scene_.surfaces;
  if (!scene_.surface_variant.empty()) set_surfaces();
  events_.files.push_back({surfaces_.shown, Answer::File::Fate::opened});
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
  status_.surfaces_file = model_file(scene_.surfaces, shown);
  cumulet_surfaces_release(shown);
}

void Session::follow_environment() {
  if (!environment_.take(scene_.environment)) return;
  if (scene_.environment.empty()) {
    check(cumulet_set_environment(viewer_.get(), nullptr));
    environment_.shown.clear();
    drop_thumbnail();
    status_.thumbnail.reset();
    environment_.loading = false;
    return;
  }
  environment_.loading = check(cumulet_load_environment(viewer_.get(), scene_.environment.c_str()));
  if (environment_.loading) return;
  events_.files.push_back({scene_.environment, Answer::File::Fate::failed});
  environment_.restore(scene_.environment);
}

void Session::finish_environment() {
  environment_.loading = false;
  if (load_failed(status_.work.environment_status, status_.work.environment_message, scene_.environment)) {
    environment_.restore(scene_.environment);
    return;
  }
  environment_.shown = scene_.environment;
  events_.files.push_back({environment_.shown, Answer::File::Fate::opened});
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

void Session::see_ends() {
  const cumulet_progress& work = status_.work;
  if (!status_.busy) {
    // Rebuilding displayed content can fail too.
    const auto add_news = [this](const auto& file, cumulet_status status, const char* message) {
      if (file.is_news(status)) add_notice(true, message);
    };
    if (surfaces_.loading) {
      finish_surfaces();
      follow_models();
    } else
      add_news(surfaces_, work.surfaces_status, work.surfaces_message);
    if (volume_.loading) {
      finish_load();
      follow_others();
    } else {
      add_news(volume_, work.volume_status, work.volume_message);
    }
    if (environment_.loading)
      finish_environment();
    else
      add_news(environment_, work.environment_status, work.environment_message);
  }
  surfaces_.see(work.surfaces_status, status_.busy);
  volume_.see(work.volume_status, status_.busy);
  environment_.see(work.environment_status, status_.busy);
}

bool Session::load_failed(cumulet_status status, const char* message, const std::string& path) {
  if (status == CUMULET_OK) return false;
  if (status == CUMULET_ERROR_CANCELLED) {
    add_notice(false, "Cancelled: " + path);
  } else {
    add_notice(true, message);
    events_.files.push_back({path, Answer::File::Fate::failed});
  }
  return true;
}

void Session::see_boxes() {
  // The frames of a sequence differ in size. If the volume is not transformed, the current bounding box is known.
  if (playing_.sequence && scene_.transforms.empty() && status_.has_volume) shown_box_ = box_of(status_.stats);
  status_.boxes = {};
  if (shown_box_) status_.boxes.volumes.emplace_back(volume_.shown, *shown_box_);
  for (const VolumeFile& file : scene_.others)
    if (const auto box = box_of<cumulet_volume_info>(others_.volume(file), cumulet_volume_get_info))
      status_.boxes.volumes.emplace_back(file, *box);
  for (const SceneModel& model : scene_.models)
    if (const auto box = box_of<cumulet_surfaces_info>(models_.surfaces(model.file), cumulet_surfaces_get_info))
      status_.boxes.models.emplace_back(model.file, *box);
}

}  // namespace cumulet::demo
