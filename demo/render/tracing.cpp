#include "tracing.hpp"

#include <chrono>
#include <csignal>
#include <cstddef>
#include <exception>
#include <file.hpp>
#include <filesystem>
#include <stdexcept>
#include <system_error>

#include "memory.hpp"
#include "time_limit.hpp"

namespace cumulet::demo {
namespace {

using Clock = std::chrono::steady_clock;

// A signal handler can only access globals.
volatile std::sig_atomic_t signaled = 0;

extern "C" void on_signal(int) { signaled = 1; }

constexpr double draw_only_ms = -1.0;  // budget of a frame that traces no samples
constexpr double budget_ms = 200.0;    // interval of progress updates, and the maximum delay of Ctrl-C

cumulet_frame_desc frame_of(const RenderOptions& options) {
  cumulet_frame_desc frame{};
  frame.struct_size = sizeof frame;
  frame.target = CUMULET_TARGET_NONE;
  frame.width = options.scene.width;
  frame.height = options.scene.height;
  frame.budget_ms = budget_ms;
  return frame;
}

void check_frame(const Viewer& viewer, const RenderOptions& options, cumulet_status status) {
  if (status == CUMULET_ERROR_OUT_OF_MEMORY) {
    throw std::runtime_error(needs_text(options) + ": " + cumulet_last_error(viewer.get()));
  }
  check(viewer, status);
}

cumulet_frame_result render_frame(const Viewer& viewer, const RenderOptions& options, double within_ms) {
  cumulet_frame_desc frame = frame_of(options);
  frame.budget_ms = within_ms;
  cumulet_frame_result result{};
  result.struct_size = sizeof result;
  check_frame(viewer, options, cumulet_render(viewer.get(), &frame, &result));
  return result;
}

/// Writes the accumulated samples to the checkpoint file.
void keep(const Viewer& viewer, const RenderOptions& options) {
  Checkpoint checkpoint{checkpoint_of(options), driver_of(viewer), {}};
  std::size_t size = 0;
  check(viewer, cumulet_read_accumulation(viewer.get(), nullptr, &size));
  checkpoint.accumulation.resize(size);
  check(viewer, cumulet_read_accumulation(viewer.get(), checkpoint.accumulation.data(), &size));
  write_checkpoint(options.checkpoint, checkpoint);
}

/// Starts the image with the samples of the checkpoint.
void resume(const Viewer& viewer, const RenderOptions& options, const Checkpoint& from, Progress& progress) {
  constexpr double min_ms = 1.0;
  cumulet_frame_result frame{};
  while (frame.width == 0 && !(frame.progress > 0.0)) {
    check_not_interrupted();
    frame = render_frame(viewer, options, min_ms);
    if ((frame.flags & CUMULET_RENDER_LOADING) != 0) wait(viewer, progress);
  }
  if (cumulet_restore_accumulation(viewer.get(), from.accumulation.data(), from.accumulation.size()) != CUMULET_OK)
    throw std::runtime_error(options.checkpoint + ": " + cumulet_last_error(viewer.get()));
  const std::string driver = driver_of(viewer);
  print_line(progress,
             options.output + ": resuming from " + options.checkpoint +
                 (driver == from.driver ? ""
                                        : ", made with another driver (" + from.driver +
                                              "); the result will not be bit-identical to an uninterrupted render"));
}

}  // namespace

void catch_signals() {
  struct sigaction action {};
  action.sa_handler = on_signal;
  action.sa_flags = static_cast<int>(SA_RESETHAND | SA_RESTART);
  for (const int signal : {SIGINT, SIGTERM}) {
    struct sigaction old {};
    // A background job of a shell, or nohup, ignores the signal; keep it ignored.
    if (sigaction(signal, nullptr, &old) == 0 && old.sa_handler == SIG_IGN) continue;
    sigaction(signal, &action, nullptr);
  }
  // With SIGXFSZ ignored, exceeding the file size limit is a write error with a cause, and does not kill the process.
  std::signal(SIGXFSZ, SIG_IGN);
}

bool interrupted() { return signaled != 0; }

void check_not_interrupted() {
  if (interrupted()) throw std::runtime_error("interrupted before the first sample: no file is written");
}

void wait(const Viewer& viewer, Progress& progress) {
  cumulet_progress state{};
  state.struct_size = sizeof state;
  for (;;) {
    const cumulet_status status = cumulet_wait(viewer.get(), 100.0);
    if (status != CUMULET_ERROR_TIMEOUT) return check(viewer, status);
    if (interrupted()) {
      cumulet_cancel(viewer.get());
      check_not_interrupted();
    }
    cumulet_get_progress(viewer.get(), &state);
    if (state.stage > CUMULET_STAGE_LOADING) progress.stage("building the grid");
  }
}

void draw_without_samples(const Viewer& viewer, const RenderOptions& options) {
  static_cast<void>(render_frame(viewer, options, draw_only_ms));
}

void warm_up(const Viewer& viewer, const RenderOptions& options, Progress& progress) {
  const cumulet_frame_desc frame = frame_of(options);
  cumulet_warm_up_result result{};
  result.struct_size = sizeof result;
  do {
    progress.stage("compiling shaders", result.progress);
    check_frame(viewer, options, cumulet_warm_up(viewer.get(), &frame, CUMULET_WARM_UP_SCENE, &result));
    // A camera-adaptive grid is built when the image size is known.
    if (result.incomplete != 0) wait(viewer, progress);
    check_not_interrupted();
  } while (result.incomplete != 0);
  progress.stage("compiling shaders", 1.0);
}

Traced trace(const Viewer& viewer, const RenderOptions& options, const std::optional<Checkpoint>& from,
             Progress& progress, const std::function<void()>& whole) {
  if (from) resume(viewer, options, *from, progress);
  const TimeLimit limit(options.time_limit);
  cumulet_frame_result frame{};
  bool began = from.has_value();
  auto kept = Clock::now();
  while (!interrupted() && (frame.flags & CUMULET_RENDER_CONVERGED) == 0) {
    // The time limit does not apply until each pixel has a sample.
    if (frame.width > 0 && limit.reached()) return Traced::late;
    frame = render_frame(viewer, options, limit.budget(budget_ms));
    if ((frame.flags & CUMULET_RENDER_LOADING) != 0) wait(viewer, progress);
    if (frame.width > 0 || frame.progress > 0.0) {
      began = true;
      progress.render(part_done(frame.progress, limit.over(), options.time_limit),
                      static_cast<double>(stats_of(viewer).samples));
    }
    if (frame.width > 0 && (frame.flags & CUMULET_RENDER_CONVERGED) == 0) whole();
    const double since = std::chrono::duration<double>(Clock::now() - kept).count();
    if (!options.checkpoint.empty() && began && since >= options.checkpoint_every) {
      try_to_keep(viewer, options, progress);
      kept = Clock::now();
    }
  }
  if (!began) check_not_interrupted();
  if ((frame.flags & CUMULET_RENDER_CONVERGED) != 0) return Traced::converged;
  if (!options.checkpoint.empty()) keep(viewer, options);
  return Traced::stopped;
}

void try_to_keep(const Viewer& viewer, const RenderOptions& options, Progress& progress) {
  try {
    keep(viewer, options);
  } catch (const std::exception& error) {
    print_line(progress, std::string("warning: the checkpoint was not written: ") + error.what());
  }
}

void forget_checkpoint(const std::string& file) {
  std::error_code ignored;  // a leftover file does no harm
  if (!file.empty()) std::filesystem::remove(file, ignored);
}

std::optional<Checkpoint> checkpoint_for(const RenderOptions& options) {
  if (options.checkpoint.empty()) return std::nullopt;
  image::check_writable(options.checkpoint);
  return read_checkpoint(options.checkpoint, checkpoint_of(options));
}

}  // namespace cumulet::demo
