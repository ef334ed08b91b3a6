// The parts of Viewer that need the GL context: frames and read-back.

#include <algorithm>
#include <chrono>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "base/error.hpp"
#include "base/milliseconds.hpp"
#include "base/one_line.hpp"
#include "denoise/tza.hpp"
#include "gl/compatibility_state.hpp"
#include "gl/state_guard.hpp"
#include "jobs/build_grid.hpp"
#include "render/display.hpp"
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

Context& Viewer::gl() const {
  if (!gl_) throw Error(ErrorCode::detached, "the viewer is not attached to a GL context");
  return *gl_;
}

void Viewer::attach(GetProc get_proc, void* user) {
  if (gl_) throw Error(ErrorCode::invalid_argument, "the viewer is already attached to a GL context");
  auto functions = gl::load_functions(get_proc, user);
  gl::clear_errors(*functions);
  gl::require_rendering(*functions);
  Commons commons = sharing_->of_current(*functions);
  gl_ = std::make_unique<Context>(std::move(functions), std::move(commons));
  notify();
}

void Viewer::detach() {
  if (!gl_) return;
  const gl::FunctionsPtr functions = gl_->functions();
  if (gl::was_reset(*functions)) {
    context_lost();
    return;
  }
  gl_->group().require();
  gl_.reset();
  gl::clear_errors(*functions);
}

void Viewer::context_lost() {
  if (!gl_) return;
  gl_->functions()->abandoned = true;
  const Commons commons = gl_->commons();
  gl_.reset();
  // Another viewer may be attached to another context of the share group.
  if (commons.memories.use_count() > 1) return;
  commons.programs->abandon();
  commons.memories->abandon();
}

template <class Body>
void Viewer::with_gl(Body&& body) {
  Context& g = gl();
  const gl::FunctionsPtr functions = g.functions();
  try {
    gl::clear_errors(*functions);
    gl::check_reset(*functions);
    g.group().require();  // before anything that could not be undone
    gl::require_rendering(*functions);
    const gl::Programs::Turn turn(g.programs(), log_);
    const gl::StateGuard guard(*functions, restore_state_);
    g.find_out_dispatches();
    g.programs()->refresh();
    body(g);
  } catch (const Error& error) {
    // In a lost context every call may fail, so check for loss after any error.
    const bool lost = error.code() == ErrorCode::context_lost || gl::was_reset(*functions);
    if (lost) context_lost();
    if (lost && error.code() != ErrorCode::context_lost) throw Error(ErrorCode::context_lost, gl::reset_message);
    throw;
  }
  gl::clear_errors(*functions);
}

// ---- frames ----

void Viewer::prepare(const Frame& frame) {
  sync();
  const auto now = Clock::now();
  const double since = std::chrono::duration<double>(now - last_frame_time_).count();
  last_frame_time_ = now;
  const auto box = this->box();
  navigation_.advance(std::min(since, 0.25), *camera_, box);

  // Without a scene the last image is dropped too. Models without triangles still count as a scene, lit by the sky
  // only.
  const bool scene = volumes_.is_shown() || models_.shows_models();
  if (!scene) volumes_.drop_grid();
  if (models_.shows_models()) volumes_.show_nothing(box);

  frame_size_ = {static_cast<unsigned>(frame.viewport[2]), static_cast<unsigned>(frame.viewport[3])};
  view_.reset();
  volumes_.set_view(view_, frame_size_);
  // Without a scene the camera may still wait for its bounds.
  if (frame_size_.x > 0 && frame_size_.y > 0 && scene)
    view_ = camera_->view(double(frame_size_.x) / frame_size_.y, subject());
  volumes_.set_view(view_, frame_size_);
  previous_view_.reset();
  if (view_ && previous_camera_)
    previous_view_ = previous_camera_->view(double(frame_size_.x) / frame_size_.y, subject());
  volumes_.send_due_requests();
  settings_revision_ += volumes_.take_changes();
  if (frame.budget_ms < 0.0) return;

  last_view_ = std::exchange(traced_view_, view_);
  volumes_.request_for_view(view_ == last_view_, [this] {
    return gl_ && !gl_->scene().uploading_volumes() &&
           gl_->progressive().newest_is_of(gl_->scene().data_revision(), gl_->scene().instances_revision());
  });
  settings_revision_ += volumes_.take_changes();
}

void Viewer::follow_upload(const Context& g) {
  upload_progress_ = g.scene().progress();
  Built& built = volumes_.built();
  if (const auto seconds = g.scene().upload_seconds(built.source)) built.seconds.upload = *seconds;
  take_cells(g);
}

void Viewer::take_cells(const Context& g) {
  volumes_.for_each_grid([&](Built& built) {
    if (!built.source || !built.source->plan || built.cells != 0) return;
    const render::MarchData::Cells* cells = g.scene().cells(built.source);
    if (cells == nullptr) return;
    built.cells = cells->count;
    built.levels = g.scene().data()->grid(*built.source)->levels;
    built.limited = cells->limited;
    // Not during camera motion, which requests many grids.
    if (cells->on_cpu && !volumes_.built_in_motion()) {
      const std::string& name = built.volume ? built.volume->name() : built.source->volume->name;
      log_.info(name + ": its grid is built on the CPU: " + *cells->on_cpu);
    }
    if (built.limited) log_limited(log_, built.source->plan->max_cells, built.settings.refine.max_cells);
  });
}

std::optional<scene::SequenceFrame> Viewer::frame_of(const Context& g, std::uint64_t sequence) {
  const scene::SequenceFrames shown = g.shown_frames();
  const auto found = std::ranges::find(shown, sequence, &scene::SequenceFrame::sequence);
  return found == shown.end() ? std::nullopt : std::optional(*found);
}

void Viewer::note_displayed(const Context& g, const VolumeFeedPtr& feed) {
  DynamicFeed* live = as_dynamic(feed);
  if (live == nullptr) return;
  if (const auto shown = frame_of(g, live->id())) live->note_displayed(*shown);
}

void Viewer::remark_on_samples(Context& g) {
  const render::Picture* picture = g.progressive().newest();
  const std::uint64_t count = picture != nullptr ? picture->samples_not_finite() : 0;
  if (count == 0 || (remarked_picture_ && (sampling_.options.preview || remarked_picture_ == picture->begun()))) return;
  remarked_picture_ = picture->begun();
  log_.warning("the radiance of " + std::to_string(count) +
               " samples was not finite; they are black (see nonfinite_samples in the statistics)");
}

void Viewer::report_pending(FrameResult& result) {
  if (busy() || volumes_.shows_proxy()) {
    result.loading = true;
    result.converged = false;
  }
  if (volumes_.something_waits()) {
    result.more = true;
    result.converged = false;
  }
  result.failed = reported_failures_.report(jobs_.status().failures, ReportedFailures::Cancelled::left_out).has_value();
  result.more = result.more || navigation_.moving() || (volumes_.built_for_another() && !jobs_.builder.loads());
}

Viewer::DryRun Viewer::dry_run(const Frame& frame) {
  DryRun run;
  update_pending_ = false;
  prepare(frame);
  volumes_.note_rendered();
  run.shot = shot();
  if (simulated_gl_) volumes_.take_gl_bytes(simulated_gl_->bytes_beside_volumes);
  run.result.converged = true;
  report_pending(run.result);
  return run;
}

FrameResult Viewer::render(const Frame& frame) {
  const auto begun = Clock::now();
  const Trace::Span frame_span(trace_, "frame");
  FrameResult result;
  Failures failures;
  // Reset before anything is read, so that later changes notify again.
  update_pending_ = false;
  with_gl([&](Context& g) {
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
    attempt("cumulet: upload", [&] {
      prepare(frame);
      if (frame.budget_ms >= 0.0) g.upload(shot(), {page_texels_, max_gl_bytes_}, deadline);
    });
    volumes_.note_rendered();
    follow_upload(g);
    const Shot shot = this->shot();
    if (frame.budget_ms >= 0.0) attempt("cumulet: trace", [&] { g.trace(shot, frame, deadline); });
    attempt("cumulet: surfaces only", [&] { g.draw_surfaces_alone(shot, frame); });
    attempt("cumulet: draw", [&] { g.draw(shot, frame, result); });
    g.report(shot, frame, result);
    remark_on_samples(g);
    volumes_.take_gl_bytes(g.bytes() - g.scene().data_bytes() - g.scene().passing_bytes());
    if (shares && frame.budget_ms > 0.0) g.learn(frame, milliseconds(Clock::now() - begun));
    note_displayed(g, volumes_.feed());
    for (const VolumeFeedPtr& feed : volumes_.feeds()) note_displayed(g, feed);
    report_pending(result);
    if (g.transfers().busy() || dynamic_gl_.is_due(g)) {
      result.more = true;
      result.converged = false;
    }
    if (failures.first && !g.is_news(shot, *failures.first)) failures = {};
  });
  failures.report(log_);
  return result;
}

WarmUp Viewer::warm_up(const Frame& frame, bool all) {
  WarmUp result;
  const render::Deadline deadline = deadline_after(frame.budget_ms);
  with_gl([&](Context& g) {
    const gl::DebugGroup group(*g.functions(), "cumulet: warm-up");
    const Trace::Span span(trace_, "cumulet: warm-up");
    dynamic_gl_.update(g);
    DynamicGlBridge::follow_transfers(g, frame.budget_ms);
    prepare(frame);
    g.upload(shot(), {page_texels_, max_gl_bytes_}, deadline);
    follow_upload(g);
    result = g.warm_up(shot(), frame, all, busy(), deadline);
  });
  return result;
}

// live: by value, because the log callback may release the host's last handle.
void Viewer::set_live_gl(std::shared_ptr<Live> live, const render::GlState& state) {
  const std::vector<volume::Channel> channels = DynamicGlBridge::check(state);
  with_gl([&](Context& g) { dynamic_gl_.submit(g, live, state, channels); });
  notify();
}

// ---- transmittance maps for the host's own drawing ----

MapResult Viewer::update_map(const MapRequest& request) {
  MapResult result;
  const render::Deadline deadline = deadline_after(request.budget_ms);
  with_gl([&](Context& g) {
    const gl::DebugGroup group(*g.functions(), "cumulet: transmittance map");
    const Trace::Span span(trace_, "cumulet: transmittance map");
    result = g.update_map(shot(), request, deadline);
  });
  result.more = result.more || gl().scene().uploading_volumes() || busy();
  return result;
}

void Viewer::drop_map(std::uint32_t slot) {
  with_gl([&](Context& g) { g.drop_map(slot); });
}

// ---- read-back ----

Pick Viewer::pick(double x, double y) {
  Pick pick;
  with_gl([&](Context& g) { pick = g.pick(shot(), x, y); });
  pick.tag = tag_of(pick.volume != 0 ? pick.volume : pick.model);
  return pick;
}

std::uint64_t Viewer::tag_of(std::uint64_t id) const {
  if (const auto tag = volumes_.tag_of(id)) return *tag;
  return models_.tag_of(id).value_or(0);
}

void Viewer::read_mattes(const MatteIdOf& id_of, std::uint32_t ranks, float* values, std::size_t count) {
  const auto of_tagged = [&](MatteObject object) {
    // The empty volume for surfaces has no matte.
    if (object.kind == MatteObject::Kind::volume && object.id == 0 && !volumes_.shown_info()) return 0U;
    object.tag = tag_of(object.id);
    return id_of(object);
  };
  with_gl([&](Context& g) { g.read_mattes(shot(), of_tagged, ranks, values, count); });
}

void Viewer::read_aov(Aov aov, float* values, std::size_t count) {
  with_gl([&](Context& g) { g.read_aov(shot(), aov, values, count); });
}

void Viewer::read_light_group(std::uint32_t group, float* rgb, std::size_t count) {
  with_gl([&](Context& g) { g.read_light_group(display_, group, rgb, count); });
}

void Viewer::read_linear(float* rgba, std::size_t count) {
  with_gl([&](Context& g) {
    g.read_linear(display_, rgba, count);
    totals_ = g.totals();
  });
}

void Viewer::read_denoised(const char* network_file, float* rgba, std::size_t count) {
  with_gl([&](Context& g) {
    if (network_file != nullptr) {
      const FilePath file(network_file);
      if (network_ == nullptr || denoiser_file_ != file.absolute()) {
        network_ = denoise::make_network(denoise::read_tza(file), network_file);
        denoiser_file_ = file.absolute();
      }
    }
    g.read_denoised(shot(), network_file != nullptr ? network_ : nullptr, rgba, count);
    totals_ = g.totals();
  });
}

void Viewer::encode_display(std::span<const float> linear, std::span<std::uint8_t> rgba) const {
  render::to_display(linear, display_.shown(false), rgba);
}

void Viewer::read_display(std::uint8_t* rgba, std::size_t count) {
  std::size_t pixels = 0;
  std::size_t width = 0;
  render::PixelBox box;
  bool legend = false;
  bool filtered = false;
  with_gl([&](Context& g) {
    const render::Picture& picture = g.readable();
    width = picture.size().x;
    box = picture.box();
    pixels = std::size_t{picture.size().x} * picture.size().y;
    legend = picture.view() != render::View::shaded;
    filtered = display_.denoise && g.can_denoise(picture);
  });
  if (rgba == nullptr || count < pixels * 4)
    throw Error(ErrorCode::invalid_argument, "the image needs " + std::to_string(pixels * 4) + " bytes");
  std::vector<float> linear(pixels * 4);
  if (filtered) {
    read_denoised(nullptr, linear.data(), linear.size());
  } else {
    read_linear(linear.data(), linear.size());
  }
  render::to_display(linear, display_.shown(legend), {rgba, pixels * 4});
  for (std::size_t i = 0; i < pixels; ++i) {
    if (!box.holds({i % width, i / width})) std::fill_n(rgba + 4 * i, 4, std::uint8_t{0});
  }
}

std::optional<double> Viewer::measure_noise() {
  with_gl([&](Context& g) { totals_ = g.totals(); });
  return totals_.noise;
}

std::size_t Viewer::accumulation_bytes() {
  std::size_t bytes = 0;
  with_gl([&](Context& g) { bytes = g.accumulation_bytes(); });
  return bytes;
}

void Viewer::read_accumulation(std::span<std::byte> bytes) {
  with_gl([&](Context& g) { g.read_accumulation(bytes); });
}

void Viewer::restore_accumulation(std::span<const std::byte> bytes) {
  with_gl([&](Context& g) { g.restore_accumulation(bytes); });
}

const core::CmParameters& Viewer::trace_parameters() { return gl().readable().parameters(); }

Stats Viewer::stats() {
  sync();
  Stats s;
  GridTotals totals = volumes_.totals();
  if (gl_) {
    // For GPU-built grids, count those that exist.
    std::set<scene::MarchSourcePtr> there;
    for (const scene::Volume& volume : gl_->scene().volumes()) {
      if (!volume.source->plan || !there.insert(volume.source).second) continue;
      // A failed upload may have removed it.
      const render::MarchData::Cells* cells = gl_->scene().cells(volume.source);
      if (cells != nullptr) totals.add(cells->count, gl_->scene().data()->grid(*volume.source)->levels, cells->limited);
    }
  }
  s.cells = totals.cells;
  s.levels = totals.levels;
  s.limited = totals.limited;
  s.active_voxels = totals.active_voxels;
  s.memory_bytes = totals.memory_bytes;
  s.build_seconds = volumes_.built().seconds;
  s.steps = totals_.steps;
  s.noise = totals_.noise;
  if (gl_) {
    s.cell_bytes = gl_->scene().data_bytes();
    s.gl_bytes = gl_->bytes();
    s.strings = gl_->strings();
    s.trace_seconds = gl_->progressive().trace_seconds();
    s.pass_seconds = gl_->pass_seconds();
    const render::Picture* picture = gl_->progressive().newest();
    s.samples = picture != nullptr ? picture->samples() : 0;
    s.samples_not_finite = picture != nullptr ? picture->samples_not_finite() : 0;
  }
  return s;
}

}  // namespace cumulet::viewer
