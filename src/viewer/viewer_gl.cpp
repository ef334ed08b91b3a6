// The parts of Viewer that need the GL context: frames and read-back.

#include <algorithm>
#include <chrono>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "base/error.hpp"
#include "base/milliseconds.hpp"
#include "base/one_line.hpp"
#include "jobs/build_grid.hpp"
#include "render/passes/display.hpp"
#include "viewer/viewer.hpp"

namespace cumulet::viewer {

namespace {

using Clock = std::chrono::steady_clock;

// Failures of the parts of a frame.
struct Failures {
  std::optional<Error> first;
  std::vector<std::string> others;

  void add(const Error& error) {
    if (first) {
      others.emplace_back(error.what());
    } else {
      first = error;
    }
  }
  // Logs all but the first failure; throws the first, if any.
  void report(const Log& log) const {
    if (!first) return;
    for (const std::string& other : others) log.warning(other);
    throw Error(*first);
  }
};

}  // namespace

// ---- the context ----

void Viewer::take_frames() {
  const Context* g = gl_.find();
  frames_ = g != nullptr ? std::optional(g->frames()) : std::nullopt;
}

void Viewer::in_context(const std::function<void(Context&)>& body) {
  const std::scoped_lock lock(context_mutex_);
  entered_ = Clock::now();
  const auto ended = [this] {
    const StateLock::Held held = hold_state();
    take_frames();
  };
  try {
    gl_.call(body);
  } catch (...) {
    ended();
    throw;
  }
  ended();
}

void Viewer::attach(GetProc get_proc, void* user) {
  const std::scoped_lock lock(context_mutex_);
  gl_.attach(get_proc, user);
  const StateLock::Held held = hold_state();
  take_frames();
  notify();
}

void Viewer::detach() {
  const std::scoped_lock lock(context_mutex_);
  gl_.detach();
  const StateLock::Held held = hold_state();
  take_frames();
}

void Viewer::context_lost() {
  const std::scoped_lock lock(context_mutex_);
  gl_.lose();
  const StateLock::Held held = hold_state();
  take_frames();
}

// ---- frames ----

Shot Viewer::shot_now() {
  const StateLock::Held held = hold_state();
  return shot();
}

DisplaySettings Viewer::display_now() const {
  const StateLock::Held held = hold_state();
  return display_;
}

void Viewer::prepare(const Frame& frame) {
  const glm::uvec2 size(static_cast<unsigned>(frame.viewport[2]), static_cast<unsigned>(frame.viewport[3]));
  stage_.prepare(size, frame.budget_ms >= 0.0, [this] {
    Context* g = gl_.find();
    return g != nullptr && !g->scene().uploading_volumes() &&
           g->progressive().newest_is_of(g->scene().data_revision(), g->scene().instances_revision());
  });
}

void Viewer::follow_upload(const Context& g) {
  upload_progress_ = g.scene().progress();
  const StateLock::Held held = hold_state();
  Built& built = stage_.volumes.built();
  if (const auto seconds = g.scene().upload_seconds(built.source)) built.seconds.upload = *seconds;
  take_cells(g);
}

void Viewer::take_cells(const Context& g) {
  stage_.volumes.for_each_grid([&](Built& built) {
    if (!built.source || !built.source->plan || built.cells != 0) return;
    const render::MarchData::Cells* cells = g.scene().cells(built.source);
    if (cells == nullptr) return;
    built.cells = cells->count;
    built.levels = g.scene().data()->grid(*built.source)->levels;
    built.limited = cells->limited;
    // Not during camera motion, which requests many grids.
    if (cells->on_cpu && !stage_.volumes.built_in_motion()) {
      const std::string& name = built.volume ? built.volume->name() : built.source->volume->name;
      log_.info(name + ": its grid is built on the CPU: " + *cells->on_cpu);
    }
    if (built.limited) log_limited(log_, built.source->plan->max_cells, built.settings.refine.max_cells);
  });
}

void Viewer::remark_on_samples(Context& g, const Shot& shot) {
  const render::Picture* picture = g.progressive().newest();
  const std::uint64_t count = picture != nullptr ? picture->samples_not_finite() : 0;
  if (count == 0 || (remarked_picture_ && (shot.sampling.options.preview || remarked_picture_ == picture->begun())))
    return;
  remarked_picture_ = picture->begun();
  log_.warning("the radiance of " + std::to_string(count) +
               " samples was not finite; they are black (see nonfinite_samples in the statistics)");
}

void Viewer::report_pending(FrameResult& result) {
  if (busy() || stage_.volumes.shows_proxy()) {
    result.loading = true;
    result.converged = false;
  }
  if (stage_.volumes.something_waits()) {
    result.more = true;
    result.converged = false;
  }
  result.failed = reported_failures_.report(jobs_.status().failures, ReportedFailures::Cancelled::left_out).has_value();
  result.more = result.more || stage_.camera.moves() || (stage_.volumes.built_for_another() && !jobs_.builder.loads());
}

Viewer::DryRun Viewer::dry_run(const Frame& frame) {
  DryRun run;
  update_.reset();
  prepare(frame);
  stage_.volumes.note_rendered();
  run.shot = shot();
  if (simulated_gl_) stage_.volumes.take_gl_bytes(simulated_gl_->bytes_beside_volumes);
  run.result.converged = true;
  report_pending(run.result);
  return run;
}

FrameResult Viewer::render(const Frame& frame) {
  const Trace::Span frame_span(trace_, "frame");
  FrameResult result;
  Failures failures;
  // Reset before anything is read, so that later changes notify again.
  update_.reset();
  in_context([&](Context& g) {
    const auto begun = entered_;  // waiting for calls of other threads does not count against the budget
    // A failure of one part does not prevent the others. It is thrown once, after drawing.
    const auto attempt = [&](const char* name, auto&& part) {
      const gl::DebugGroup group(*g.functions(), name);
      const Trace::Span span(trace_, name);
      try {
        part();
      } catch (...) {
        const Error error = caught(name);
        if (error.code() == ErrorCode::context_lost) throw;
        gl::check_reset(*g.functions());
        failures.add(error);
        gl::clear_errors(*g.functions());
      }
    };
    // This query counts against the budget: waking the driver's threads may cost the calling thread its core.
    const bool shares = g.shares_cores();
    const render::Deadline deadline = g.deadline_of(frame, begun, shares);
    if (!dynamic_gl_.empty()) attempt("cumulet: voxels on the GPU", [&] { dynamic_gl_.update(g); });
    if (g.transfers().busy()) {
      attempt("cumulet: dynamic voxels", [&] { DynamicGlBridge::follow_transfers(g, frame.budget_ms); });
    } else {
      DynamicGlBridge::follow_transfers(g, 0.0);
    }
    Shot shot;
    Context::UploadLimits limits;
    attempt("cumulet: upload", [&] {
      take_state(frame, true, shot, limits);
      if (frame.budget_ms >= 0.0) g.upload(shot, limits, deadline);
    });
    if (!shot.scene) return;  // there is no state to draw
    follow_upload(g);
    if (frame.budget_ms >= 0.0) attempt("cumulet: trace", [&] { g.trace(shot, frame, deadline); });
    attempt("cumulet: surfaces only", [&] { g.draw_surfaces_alone(shot, frame); });
    attempt("cumulet: draw", [&] { g.draw(shot, frame, result); });
    g.report(shot, frame, result);
    remark_on_samples(g, shot);
    if (shares && frame.budget_ms > 0.0) g.learn(frame, milliseconds(Clock::now() - begun));
    finish_frame(g, result);
    if (failures.first && !g.is_news(shot, *failures.first)) failures = {};
  });
  failures.report(log_);
  return result;
}

void Viewer::take_state(const Frame& frame, bool is_rendered, Shot& shot, Context::UploadLimits& limits) {
  const StateLock::Held held = hold_state();
  limits = upload_limits_;
  const auto taken = [&] {
    if (is_rendered) stage_.volumes.note_rendered();
    if (frames_) frames_->in_work = true;
    shot = this->shot();
  };
  try {
    prepare(frame);
  } catch (...) {
    taken();  // the parts that did not fail are drawn
    throw;
  }
  taken();
}

void Viewer::finish_frame(Context& g, FrameResult& result) {
  const std::uint64_t beside_volumes = g.bytes() - g.read_bytes() - g.scene().data_bytes() - g.scene().passing_bytes();
  {
    const StateLock::Held held = hold_state();
    take_frames();
    stage_.volumes.take_gl_bytes(beside_volumes);
    stage_.volumes.note_displayed(frames_->shown);
    report_pending(result);
  }
  // After the workers were asked whether they are busy: one that has just ended may have requested voxels from GL.
  if (g.transfers().busy() || dynamic_gl_.is_due(g)) {
    result.more = true;
    result.converged = false;
  }
}

WarmUp Viewer::warm_up(const Frame& frame, bool all) {
  WarmUp result;
  in_context([&](Context& g) {
    const render::Deadline deadline = deadline_after(frame.budget_ms);
    const gl::DebugGroup group(*g.functions(), "cumulet: warm-up");
    const Trace::Span span(trace_, "cumulet: warm-up");
    dynamic_gl_.update(g);
    DynamicGlBridge::follow_transfers(g, frame.budget_ms);
    Shot shot;
    Context::UploadLimits limits;
    bool waits = false;
    take_state(frame, false, shot, limits);
    g.upload(shot, limits, deadline);
    follow_upload(g);
    {
      const StateLock::Held held = hold_state();
      waits = busy();
    }
    result = g.warm_up(shot, frame, all, waits, deadline);
  });
  return result;
}

// live: by value, because the log callback may release the host's last handle.
void Viewer::set_live_gl(std::shared_ptr<Live> live, const render::GlState& state) {
  const std::vector<volume::Channel> channels = DynamicGlBridge::check(state);
  in_context([&](Context& g) { dynamic_gl_.submit(g, live, state, channels); });
  notify();
}

// ---- transmittance maps for the host's own drawing ----

MapResult Viewer::update_map(const MapRequest& request) {
  MapResult result;
  in_context([&](Context& g) {
    const render::Deadline deadline = deadline_after(request.budget_ms);
    const gl::DebugGroup group(*g.functions(), "cumulet: transmittance map");
    const Trace::Span span(trace_, "cumulet: transmittance map");
    result = g.update_map(shot_now(), request, deadline);
    const StateLock::Held held = hold_state();
    result.more = result.more || g.scene().uploading_volumes() || busy();
  });
  return result;
}

void Viewer::drop_map(std::uint32_t slot) {
  in_context([&](Context& g) { g.drop_map(slot); });
}

// ---- read-back ----

Pick Viewer::pick(double x, double y) {
  Pick pick;
  in_context([&](Context& g) { pick = g.pick(shot_now(), x, y); });
  const StateLock::Held held = hold_state();
  pick.tag = stage_.tag_of(pick.volume != 0 ? pick.volume : pick.model);
  return pick;
}

void Viewer::read_mattes(const MatteIdOf& id_of, std::uint32_t ranks, float* values, std::size_t count) {
  const auto of_tagged = [&](MatteObject object) {
    {
      const StateLock::Held held = hold_state();
      // The empty volume for surfaces has no matte.
      if (object.kind == MatteObject::Kind::volume && object.id == 0 && !stage_.volumes.shown_info()) return 0U;
      object.tag = stage_.tag_of(object.id);
    }
    return id_of(object);
  };
  in_context([&](Context& g) { g.read_mattes(shot_now(), of_tagged, ranks, values, count); });
}

void Viewer::read_aov(Aov aov, float* values, std::size_t count) {
  in_context([&](Context& g) { g.read_aov(shot_now(), aov, values, count); });
}

void Viewer::read_light_group(std::uint32_t group, float* rgb, std::size_t count) {
  in_context([&](Context& g) { g.read_light_group(display_now(), group, rgb, count); });
}

std::uint64_t Viewer::begin_read(const ReadRequest& request) {
  std::uint64_t number = 0;
  in_context([&](Context& g) {
    number = ++last_read_;
    g.begin_read(display_now(), request, number);
  });
  return number;
}

ReadState Viewer::finish_read(std::uint64_t read, float* values, std::size_t count) {
  ReadState state;
  in_context([&](Context& g) { state = g.finish_read(read, values, count); });
  return state;
}

void Viewer::cancel_read(std::uint64_t read) {
  in_context([&](Context& g) { g.cancel_read(read); });
}

void Viewer::read_linear(float* rgba, std::size_t count) {
  in_context([&](Context& g) {
    g.read_linear(display_now(), rgba, count);
    totals_ = g.totals();
  });
}

void Viewer::read_denoised(const char* network_file, const char* oidn_library, float* rgba, std::size_t count) {
  in_context([&](Context& g) {
    Denoisers by;
    if (oidn_library != nullptr && g.functions()->dispatches_in_call)
      by.library = oidn_.get(oidn_library, network_file != nullptr ? "its network" : "the fast filter", log_);
    const auto read = [&] {
      // A library needs no weights, and reads none that are missing.
      if (by.library == nullptr && network_file != nullptr) by.network = networks_.get(network_file);
      g.read_denoised(shot_now(), by, rgba, count);
    };
    try {
      read();
    } catch (const denoise::OidnError& error) {
      oidn_.drop(error, log_);
      by.library = nullptr;
      read();
    }
    totals_ = g.totals();
  });
}

void Viewer::encode_display(std::span<const float> linear, std::span<std::uint8_t> rgba) const {
  render::to_display(linear, display_now().shown(false), rgba);
}

void Viewer::read_display(std::uint8_t* rgba, std::size_t count) {
  std::vector<float> linear;
  std::size_t width = 0;
  render::PixelBox box;
  render::Display display;
  // One image and one state for all of it: other threads may render and change settings.
  in_context([&](Context& g) {
    const Shot shot = shot_now();
    const render::Picture& picture = g.readable();
    width = picture.size().x;
    box = picture.box();
    display = shot.display.shown(picture.view() != render::View::shaded);
    const std::size_t values = 4 * width * picture.size().y;
    if (rgba == nullptr || count < values)
      throw Error(ErrorCode::invalid_argument, "the image needs " + std::to_string(values) + " bytes");
    linear.resize(values);
    if (shot.display.denoise && g.can_denoise(picture)) {
      g.read_denoised(shot, {}, linear.data(), values);
    } else {
      g.read_linear(shot.display, linear.data(), values);
    }
    totals_ = g.totals();
  });
  render::to_display(linear, display, {rgba, linear.size()});
  for (std::size_t i = 0; i < linear.size() / 4; ++i) {
    if (!box.holds({i % width, i / width})) std::fill_n(rgba + 4 * i, 4, std::uint8_t{0});
  }
}

std::optional<double> Viewer::measure_noise() {
  std::optional<double> noise;
  in_context([&](Context& g) {
    totals_ = g.totals();
    noise = totals_.noise;
  });
  return noise;
}

std::size_t Viewer::accumulation_bytes() {
  std::size_t bytes = 0;
  in_context([&](Context& g) { bytes = g.accumulation_bytes(); });
  return bytes;
}

void Viewer::read_accumulation(std::span<std::byte> bytes, std::size_t* needed) {
  in_context([&](Context& g) {
    if (needed != nullptr) *needed = g.accumulation_bytes();
    g.read_accumulation(bytes);
  });
}

void Viewer::restore_accumulation(std::span<const std::byte> bytes) {
  in_context([&](Context& g) { g.restore_accumulation(bytes); });
}

const core::CmParameters& Viewer::trace_parameters() { return gl_.get().readable().parameters(); }

Stats Viewer::stats() {
  const std::scoped_lock lock(context_mutex_);
  const StateLock::Held held = hold_state();
  sync();
  Stats s;
  GridTotals totals = stage_.volumes.totals();
  Context* g = gl_.find();
  if (g != nullptr) {
    // For GPU-built grids, count those that exist.
    std::set<scene::MarchSourcePtr> there;
    for (const scene::Volume& volume : g->scene().volumes()) {
      if (!volume.source->plan || !there.insert(volume.source).second) continue;
      // A failed upload may have removed it.
      const render::MarchData::Cells* cells = g->scene().cells(volume.source);
      if (cells != nullptr) totals.add(cells->count, g->scene().data()->grid(*volume.source)->levels, cells->limited);
    }
  }
  s.cells = totals.cells;
  s.levels = totals.levels;
  s.limited = totals.limited;
  s.active_voxels = totals.active_voxels;
  s.memory_bytes = totals.memory_bytes;
  s.build_seconds = stage_.volumes.built().seconds;
  s.steps = totals_.steps;
  s.noise = totals_.noise;
  if (g != nullptr) {
    s.cell_bytes = g->scene().data_bytes();
    s.cell_viewers = g->scene().data_viewers();
    s.gl_bytes = g->bytes();
    s.strings = g->strings();
    s.trace_seconds = g->progressive().trace_seconds();
    s.pass_seconds = g->pass_seconds();
    const render::Picture* picture = g->progressive().newest();
    s.samples = picture != nullptr ? picture->samples() : 0;
    s.samples_not_finite = picture != nullptr ? picture->samples_not_finite() : 0;
  }
  return s;
}

}  // namespace cumulet::viewer
