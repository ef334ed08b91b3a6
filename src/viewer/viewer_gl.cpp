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

void Viewer::attach(GetProc get_proc, void* user) {
  gl_.attach(get_proc, user);
  notify();
}

// ---- frames ----

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

void Viewer::remark_on_samples(Context& g) {
  const render::Picture* picture = g.progressive().newest();
  const std::uint64_t count = picture != nullptr ? picture->samples_not_finite() : 0;
  if (count == 0 || (remarked_picture_ && (sampling_.options.preview || remarked_picture_ == picture->begun()))) return;
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
  const auto begun = Clock::now();
  const Trace::Span frame_span(trace_, "frame");
  FrameResult result;
  Failures failures;
  // Reset before anything is read, so that later changes notify again.
  update_.reset();
  gl_.call([&](Context& g) {
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
      if (frame.budget_ms >= 0.0) g.upload(shot(), upload_limits_, deadline);
    });
    stage_.volumes.note_rendered();
    follow_upload(g);
    const Shot shot = this->shot();
    if (frame.budget_ms >= 0.0) attempt("cumulet: trace", [&] { g.trace(shot, frame, deadline); });
    attempt("cumulet: surfaces only", [&] { g.draw_surfaces_alone(shot, frame); });
    attempt("cumulet: draw", [&] { g.draw(shot, frame, result); });
    g.report(shot, frame, result);
    remark_on_samples(g);
    stage_.volumes.take_gl_bytes(g.bytes() - g.scene().data_bytes() - g.scene().passing_bytes());
    if (shares && frame.budget_ms > 0.0) g.learn(frame, milliseconds(Clock::now() - begun));
    stage_.volumes.note_displayed(g.shown_frames());
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
  gl_.call([&](Context& g) {
    const gl::DebugGroup group(*g.functions(), "cumulet: warm-up");
    const Trace::Span span(trace_, "cumulet: warm-up");
    dynamic_gl_.update(g);
    DynamicGlBridge::follow_transfers(g, frame.budget_ms);
    prepare(frame);
    g.upload(shot(), upload_limits_, deadline);
    follow_upload(g);
    result = g.warm_up(shot(), frame, all, busy(), deadline);
  });
  return result;
}

// live: by value, because the log callback may release the host's last handle.
void Viewer::set_live_gl(std::shared_ptr<Live> live, const render::GlState& state) {
  const std::vector<volume::Channel> channels = DynamicGlBridge::check(state);
  gl_.call([&](Context& g) { dynamic_gl_.submit(g, live, state, channels); });
  notify();
}

// ---- transmittance maps for the host's own drawing ----

MapResult Viewer::update_map(const MapRequest& request) {
  MapResult result;
  const render::Deadline deadline = deadline_after(request.budget_ms);
  gl_.call([&](Context& g) {
    const gl::DebugGroup group(*g.functions(), "cumulet: transmittance map");
    const Trace::Span span(trace_, "cumulet: transmittance map");
    result = g.update_map(shot(), request, deadline);
  });
  result.more = result.more || gl_.get().scene().uploading_volumes() || busy();
  return result;
}

void Viewer::drop_map(std::uint32_t slot) {
  gl_.call([&](Context& g) { g.drop_map(slot); });
}

// ---- read-back ----

Pick Viewer::pick(double x, double y) {
  Pick pick;
  gl_.call([&](Context& g) { pick = g.pick(shot(), x, y); });
  pick.tag = stage_.tag_of(pick.volume != 0 ? pick.volume : pick.model);
  return pick;
}

void Viewer::read_mattes(const MatteIdOf& id_of, std::uint32_t ranks, float* values, std::size_t count) {
  const auto of_tagged = [&](MatteObject object) {
    // The empty volume for surfaces has no matte.
    if (object.kind == MatteObject::Kind::volume && object.id == 0 && !stage_.volumes.shown_info()) return 0U;
    object.tag = stage_.tag_of(object.id);
    return id_of(object);
  };
  gl_.call([&](Context& g) { g.read_mattes(shot(), of_tagged, ranks, values, count); });
}

void Viewer::read_aov(Aov aov, float* values, std::size_t count) {
  gl_.call([&](Context& g) { g.read_aov(shot(), aov, values, count); });
}

void Viewer::read_light_group(std::uint32_t group, float* rgb, std::size_t count) {
  gl_.call([&](Context& g) { g.read_light_group(display_, group, rgb, count); });
}

void Viewer::read_linear(float* rgba, std::size_t count) {
  gl_.call([&](Context& g) {
    g.read_linear(display_, rgba, count);
    totals_ = g.totals();
  });
}

void Viewer::read_denoised(const char* network_file, float* rgba, std::size_t count) {
  gl_.call([&](Context& g) {
    const denoise::NetworkPtr network = network_file != nullptr ? networks_.get(network_file) : nullptr;
    g.read_denoised(shot(), network, rgba, count);
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
  gl_.call([&](Context& g) {
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
  gl_.call([&](Context& g) { totals_ = g.totals(); });
  return totals_.noise;
}

std::size_t Viewer::accumulation_bytes() {
  std::size_t bytes = 0;
  gl_.call([&](Context& g) { bytes = g.accumulation_bytes(); });
  return bytes;
}

void Viewer::read_accumulation(std::span<std::byte> bytes) {
  gl_.call([&](Context& g) { g.read_accumulation(bytes); });
}

void Viewer::restore_accumulation(std::span<const std::byte> bytes) {
  gl_.call([&](Context& g) { g.restore_accumulation(bytes); });
}

const core::CmParameters& Viewer::trace_parameters() { return gl_.get().readable().parameters(); }

Stats Viewer::stats() {
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
