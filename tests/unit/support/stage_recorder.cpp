#include "support/stage_recorder.hpp"

#include <algorithm>
#include <cctype>
#include <chrono>
#include <set>
#include <stdexcept>
#include <thread>

namespace cumulet::test {

namespace {

using namespace std::chrono_literals;

constexpr double max_wait_ms = 300'000.0;
constexpr const char* next_line = "\n      ";

// Polls until the condition is true. Throws after a minute.
template <class Condition>
void wait_until(const char* what, Condition&& condition) {
  const auto until = std::chrono::steady_clock::now() + 60s;
  while (!condition()) {
    if (std::chrono::steady_clock::now() > until) throw std::runtime_error(std::string("waited in vain for ") + what);
    std::this_thread::sleep_for(1ms);
  }
}

template <class Request>
std::string list_of(StageText& texts, const std::vector<Request>& requests) {
  std::string list;
  for (const Request& request : requests) list.append(list.empty() ? "" : next_line).append(texts.request(request));
  return list;
}

}  // namespace

void Gate::hold(const std::string& part) {
  const std::scoped_lock lock(mutex_);
  part_ = part;
  held_ = false;
}

void Gate::pass(const std::string& text) {
  std::unique_lock lock(mutex_);
  if (!part_ || text.find(*part_) == std::string::npos) return;
  held_ = true;
  changed_.notify_all();
  changed_.wait(lock, [this, before = releases_] { return releases_ != before; });
}

void Gate::wait_until_held() {
  std::unique_lock lock(mutex_);
  if (!changed_.wait_for(lock, 60s, [this] { return held_; }))
    throw std::runtime_error("no job was held at: " + part_.value_or("nothing"));
}

void Gate::release() {
  const std::scoped_lock lock(mutex_);
  part_.reset();
  held_ = false;
  ++releases_;
  changed_.notify_all();
}

StageRecorder::StageRecorder()
    : last_{{"states", "follow no dynamic volume"}},
      viewer_(std::make_unique<viewer::Viewer>(
          Log([this](LogLevel level, const char* message) { hear(level, message); }), [this] { ++updates_; }, true,
          Trace(&StageRecorder::end_of_work, this))) {
  viewer_->set_job_log(this);
}

StageRecorder::~StageRecorder() {
  gate_.release();
  viewer_->set_job_log(nullptr);
}

// ---- steps ----

void StageRecorder::call(const std::string& name, const std::function<void()>& function) {
  begin(name);
  attempt(function);
  end();
}

void StageRecorder::load(const std::string& name, const std::function<void(viewer::VolumeFile&)>& change) {
  viewer::VolumeFile file{.path = path(name), .grids = {}};
  if (change) change(file);
  call("load " + name, [&] { viewer_->load_volume(file); });
}

void StageRecorder::look(const glm::dvec3& eye, const glm::dvec3& target) {
  call("look from " + text_of(eye) + " to " + text_of(target), [&] {
    viewer::CameraPose pose;
    pose.eye = eye;
    pose.target = target;
    viewer_->camera()->set(pose);
  });
}

void StageRecorder::wait() {
  begin("wait");
  attempt([&] { viewer_->wait(max_wait_ms); });
  end(Workers::waited);
}

void StageRecorder::settle() {
  begin("settle");
  wait_until("the end of jobs", [&] { return viewer_->status().stage == Progress::Stage::idle; });
  end(Workers::waited);
}

void StageRecorder::settle_frames(std::size_t count, const viewer::Instance* instance) {
  begin("settle frames");
  wait_until("frames", [&] {
    const auto states = sequence_status(instance).frames.frames;
    const auto waiting = std::ranges::count(states, viewer::FrameCache::State::waiting);
    return states.size() - static_cast<std::size_t>(waiting) >= count;
  });
  end(Workers::waited);
}

void StageRecorder::held() {
  begin("held");
  gate_.wait_until_held();
  write_status();
  end(Workers::waited);
}

void StageRecorder::frame(const glm::uvec2& size, double budget_ms) {
  begin("frame " + std::to_string(size.x) + " x " + std::to_string(size.y) +
        (budget_ms < 0.0 ? ", nothing is traced" : ""));
  viewer::Frame frame;
  frame.target = viewer::Target::none;
  frame.size = size;
  frame.viewport = {0, 0, static_cast<int>(size.x), static_cast<int>(size.y)};
  frame.budget_ms = budget_ms;
  attempt([&] {
    const viewer::Viewer::DryRun run = viewer_->dry_run(frame);
    std::string flags;
    for (const auto& [is_set, name] :
         {std::pair{run.result.loading, " loading"}, std::pair{run.result.more, " more"},
          std::pair{run.result.converged, " converged"}, std::pair{run.result.failed, " failed"}})
      flags += is_set ? name : "";
    write("flags:" + flags);
    write_scene(run.shot.scene);
    for (const auto& [name, text] : texts_of(run.shot)) {
      std::string& last = shot_[name];
      if (last == text) continue;
      last = text;
      // How often settings were touched does not matter.
      write(name == "settings" ? "settings changed" : name + ": " + text);
    }
  });
  end();
}

void StageRecorder::status() {
  begin("status");
  write_status();
  end();
}

void StageRecorder::contents() {
  begin("contents");
  write(texts_.volume(viewer_->volume()));
  attempt([&] {
    const viewer::Bounds bounds = viewer_->bounds();
    write("bounds " + text_of(bounds.min) + " " + text_of(bounds.max));
  });
  write("environment " + texts_.environment(viewer_->environment()));
  end();
}

void StageRecorder::sequence(const viewer::Instance* instance) {
  begin("sequence");
  attempt([&] { write_sequence(sequence_status(instance)); });
  end();
}

void StageRecorder::frames(const viewer::Instance* instance) {
  begin("frames");
  attempt([&] {
    const viewer::Viewer::SequenceStatus status = sequence_status(instance);
    write_sequence(status);
    std::string states;
    for (const viewer::FrameCache::State state : status.frames.frames)
      states += "WRF"[static_cast<std::size_t>(state)];  // waiting, ready, failed
    write("frames " + states);
  });
  end();
}

void StageRecorder::frame_failure(std::uint32_t frame, const viewer::Instance* instance) {
  begin("failure of frame " + std::to_string(frame));
  attempt([&] {
    const std::optional<Error> failure =
        instance != nullptr ? viewer_->frame_failure(*instance, frame) : viewer_->frame_failure(frame);
    write(failure ? text_of(*failure) : "none");
  });
  end();
}

void StageRecorder::states(const viewer::Instance* instance) {
  begin("states");
  attempt([&] {
    const viewer::Viewer::LiveStatus status = instance != nullptr ? viewer_->live(*instance) : viewer_->live();
    write("submitted " + std::to_string(status.handed) + ", ready " + std::to_string(status.ready) + ", taken " +
          std::to_string(status.ready_count));
  });
  end();
}

void StageRecorder::updates() {
  begin("updates");
  write(std::to_string(updates_.exchange(0)) + " update callbacks");
  end();
}

void StageRecorder::wait_for_update() {
  wait_until("an update callback", [&] { return updates_ > 0; });
  updates();
}

// ---- requests ----

void StageRecorder::load_volume(const viewer::VolumeFile& file, const std::optional<viewer::BuildSettings>& settings,
                                const std::optional<viewer::BuildSettings>& proxy) {
  add("volume", "load " + file.path.given() + ": " + texts_.settings(settings) + (proxy ? ", with a proxy" : ""));
}

void StageRecorder::configure_volume(const std::optional<viewer::BuildSettings>& settings) {
  add("volume", "configure " + texts_.settings(settings));
}

void StageRecorder::build_volume(const viewer::VolumeAssetPtr& volume, const viewer::BuildSettings& settings,
                                 const scene::GridPlanPtr& before) {
  add("volume", "build " + texts_.volume(volume) + ": " + texts_.settings(settings) +
                    (before ? " after " + texts_.plan(before) : ""));
}

void StageRecorder::load_surfaces(const FilePath& path, const viewer::SurfaceChoice& choice) {
  add("surfaces", "load " + path.given() + ": " + text_of(choice));
}

void StageRecorder::configure_surfaces(const viewer::SurfaceChoice& choice) {
  add("surfaces", "configure " + text_of(choice));
}

void StageRecorder::pose_surfaces(const viewer::SurfaceAssetPtr& asset, const viewer::SurfaceChoice& choice) {
  add("surfaces", "pose " + texts_.asset(asset) + ": " + text_of(choice));
}

void StageRecorder::load_environment(const FilePath& path) { add("environment", "load " + path.given()); }

void StageRecorder::make_sky(const light::Day& day) { add("environment", "sky " + text_of(day)); }

void StageRecorder::request(const std::vector<viewer::GridRequest>& requests) {
  if (!requests.empty()) replace("grids", list_of(texts_, requests));
}

void StageRecorder::request(const std::vector<viewer::PoseRequest>& requests) {
  if (!requests.empty()) replace("poses", list_of(texts_, requests));
}

void StageRecorder::request(Player player, const viewer::FrameRequest& request) {
  replace("frames" + texts_.player(player), texts_.request(request));
}

void StageRecorder::follow_states(Player player, const std::shared_ptr<viewer::Live>& live,
                                  const std::optional<viewer::BuildSettings>& settings) {
  replace("states" + texts_.player(player),
          "follow " + texts_.live(live) + (live ? next_line + texts_.settings(settings) : ""));
}

void StageRecorder::configure_states(Player player, const std::optional<viewer::BuildSettings>& settings) {
  replace("states" + texts_.player(player), "configure " + texts_.settings(settings));
}

void StageRecorder::call(const char* worker, Player player, const char* function) {
  const std::string name = worker;
  const bool is_grids = name.starts_with("building the grids");
  const bool is_poses = name.starts_with("posing");
  add((is_grids ? "grids" : is_poses ? "poses" : name) + texts_.player(player), function);
}

// ---- callbacks ----

void StageRecorder::hear(LogLevel level, const std::string& message) {
  {
    const std::scoped_lock lock(heard_mutex_);
    auto& heard = std::this_thread::get_id() == host_ ? heard_ : heard_of_workers_;
    heard.push_back((level == LogLevel::warning ? "warning: "
                     : level == LogLevel::info  ? "info: "
                                                : "message: ") +
                    clean(message));
  }
  gate_.pass(message);
}

void StageRecorder::end_of_work(void* user, const char* name, double /*begin*/, double /*end*/) {
  static_cast<StageRecorder*>(user)->gate_.pass("ended " + std::string(name) + ".");
}

// ---- text ----

void StageRecorder::add(const std::string& worker, const std::string& text) {
  last_[worker] = text;
  requests_.emplace_back(worker, text);
}

void StageRecorder::replace(const std::string& worker, const std::string& text) {
  if (last_[worker] != text) add(worker, text);
}

void StageRecorder::begin(const std::string& name) { text_ += "# " + clean(name) + "\n"; }

void StageRecorder::write(const std::string& line) { text_ += "  " + clean(line) + "\n"; }

void StageRecorder::end(Workers workers) {
  if (workers == Workers::waited)
    std::ranges::stable_sort(requests_, {}, [](const auto& request) { return request.first; });
  for (const auto& [worker, text] : requests_) write("-> " + worker + ": " + text);
  requests_.clear();
  std::set<std::string> messages;
  {
    const std::scoped_lock lock(heard_mutex_);
    const auto take = [&](std::vector<std::string>& heard) {
      messages.insert(heard.begin(), heard.end());
      heard.clear();
    };
    take(heard_);
    if (workers == Workers::waited) take(heard_of_workers_);
  }
  for (const std::string& message : messages) write(message);
}

void StageRecorder::attempt(const std::function<void()>& function) {
  try {
    function();
  } catch (const Error& error) {
    write("throws " + text_of(error));
  }
}

void StageRecorder::write_status() {
  const viewer::Viewer::Status status = viewer_->status();
  write("status: " + text_of(status.stage));
  const auto failure = [&](const char* name, const std::optional<Error>& error) {
    if (error) write(std::string(name) + " failure: " + text_of(*error));
  };
  failure("volume", status.volume_failure);
  failure("surfaces", status.surfaces_failure);
  failure("environment", status.environment_failure);
  failure("reported", status.failure);
}

void StageRecorder::write_scene(const scene::SnapshotPtr& scene) {
  if (scene == scene_) {
    write("same scene");
    return;
  }
  for (const std::string& line : texts_.scene(*scene, scene_.get())) write(line);
  scene_ = scene;
}

viewer::Viewer::SequenceStatus StageRecorder::sequence_status(const viewer::Instance* instance) {
  return instance != nullptr ? viewer_->sequence(*instance) : viewer_->sequence();
}

void StageRecorder::write_sequence(const viewer::Viewer::SequenceStatus& status) {
  write("requested frame " + std::to_string(status.asked) + ", position " + text_of(status.requested_position) +
        (status.density_scale ? ", density scale " + text_of(*status.density_scale) : ""));
}

std::string StageRecorder::clean(std::string text) const {
  const std::string folder = folder_.path().string();
  for (auto at = text.find(folder); at != std::string::npos; at = text.find(folder, at))
    text.replace(at, folder.size(), "FOLDER");
  const std::string unit = " bytes";
  for (auto at = text.find(unit); at != std::string::npos; at = text.find(unit, at + 1)) {
    auto first = at;
    while (first > 0 && std::isdigit(static_cast<unsigned char>(text[first - 1])) != 0) --first;
    text.replace(first, at - first, "N");
    at = first + 1;
  }
  return text;
}

}  // namespace cumulet::test
