#include "viewer/viewer.hpp"

#include <chrono>
#include <string>
#include <utility>

#include "base/error.hpp"
#include "base/library_thread.hpp"
#include "base/milliseconds.hpp"

namespace cumulet::viewer {

namespace {

// Returns why a frame of a sequence cannot be shown.
std::optional<Error> failure_of(const SequenceFeed& feed, std::uint32_t frame) {
  if (frame >= feed.sequence().files()->count())
    throw Error(ErrorCode::invalid_argument, "the sequence has no frame " + std::to_string(frame));
  return feed.cache().failure_of(frame);
}

}  // namespace

Viewer::Viewer(Log log, std::function<void()> update, bool restore_state, Trace trace, std::shared_ptr<Sharing> sharing)
    : update_(std::move(update)),
      state_(std::move(log), [this] { update_.call(); }),
      log_(state_.log()),
      trace_(trace),
      gl_(log_, restore_state, std::move(sharing)),
      jobs_({.log = log_, .notify = [this] { notify(); }, .trace = trace, .resource_limits = resource_limits_}),
      stage_(jobs_, reported_failures_, *this, resource_limits_, log_) {
  volume::initialize_readers();
  set_medium({});
  set_light({});
  set_camera(std::make_shared<Camera>());
}

Viewer::~Viewer() {
  stage_.volumes.close();
  dynamic_gl_.clear();
  cancel();  // all workers at once: with a thread limit, jobs wait for each other
  gl_.lose_unless_current();
}

void Viewer::touch() {
  stage_.note_change();
  notify();
}

bool Viewer::is_displayed(const scene::SequenceFrame& frame, bool is_rendered) const {
  if (frames_) return is_rendered && !frames_->is_pending(frame);
  return !simulated_gl_ || (is_rendered && simulated_gl_->displays_frames);
}

// ---- sequences ----

Viewer::SequenceStatus Viewer::status_of(const SequenceFeed& feed) const {
  // The displayed frame may belong to another sequence.
  return feed.status(frames_ ? feed.find_in(frames_->shown) : std::nullopt);
}

Viewer::SequenceStatus Viewer::sequence() { return status_of(stage_.volumes.own_sequence()); }

std::optional<Error> Viewer::frame_failure(std::uint32_t frame) {
  return failure_of(stage_.volumes.own_sequence(), frame);
}

Viewer::SequenceStatus Viewer::sequence(const Instance& instance) {
  return status_of(stage_.volumes.sequence_of(instance));
}

std::optional<Error> Viewer::frame_failure(const Instance& instance, std::uint32_t frame) {
  return failure_of(stage_.volumes.sequence_of(instance), frame);
}

VolumeAssetPtr Viewer::volume() {
  sync();
  return stage_.volumes.volume();
}

VolumeInfoPtr Viewer::volume_info() {
  sync();
  return stage_.volumes.volume_info();
}

std::optional<grid::Interpolation> Viewer::interpolation() {
  sync();
  return stage_.volumes.interpolation();
}

// ---- jobs ----

void Viewer::set_limits(const Limits& limits) {
  upload_limits_.max_bytes = limits.gl_bytes;
  stage_.volumes.set_limits(limits.threads, limits.memory_bytes, limits.gl_bytes);
  touch();
}

void Viewer::wait(double timeout_ms) {
  std::optional<std::chrono::steady_clock::time_point> until;
  if (timeout_ms >= 0.0) until = deadline_after(timeout_ms);
  // One result may cause further work.
  const auto settled = [this] {
    const StateLock::Held held = hold_state();
    // The newest state is waited for, so it need not wait until the previous one has been displayed.
    stage_.volumes.take_unseen_states();
    sync();
    return !busy();
  };
  {
    const StateLock::Held held = hold_state();
    sync();
  }
  do {
    // Stopped workers never become idle.
    if (process_is_ending()) throw Error(ErrorCode::cancelled, "the process is exiting");
    if (!jobs_.wait(until)) throw Error(ErrorCode::timeout, "not ready in time");
  } while (!settled());
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

void Viewer::set_sampling(const Sampling& sampling) {
  sync();
  sampling_ = sampling;
  stage_.set_sampling(sampling.shutter_seconds, sampling.options.preview);
}

void Viewer::set_display(const DisplaySettings& display) {
  render::DisplayLutPtr lut = std::move(display_.lut);
  display_ = display;
  display_.lut = std::move(lut);
  stage_.sky.set_background(!display.transparent && !display.backdrop);
  touch();
}

void Viewer::set_display_lut(render::DisplayLutPtr lut) {
  display_.lut = std::move(lut);
  touch();
}

Shot Viewer::shot() {
  Shot shot;
  shot.scene = stage_.snapshot();
  shot.size = stage_.camera.size();
  if (const auto& view = stage_.camera.view()) {
    shot.depth_a = view->depth_a;
    shot.depth_b = view->depth_b;
  }
  shot.view_rests = stage_.camera.rests();
  shot.held = stage_.camera.is_dragged();
  shot.max_bounces = stage_.volumes.medium().max_bounces;
  shot.sun_group = stage_.sky.light().sun_group;
  shot.sky_group = stage_.sky.light().sky_group;
  shot.sampling = sampling_;
  shot.surfaces = stage_.models.settings();
  shot.display = display_;
  shot.settings = stage_.revision();
  return shot;
}

}  // namespace cumulet::viewer
