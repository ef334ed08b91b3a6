#pragma once

#include <cumulet/cumulet.h>

#include <functional>
#include <optional>
#include <string>

#include "checkpoint.hpp"
#include "options.hpp"
#include "progress.hpp"
#include "render_viewer.hpp"

// Loading, compiling and tracing, until a signal interrupts them.

namespace cumulet::demo {

/// The first Ctrl-C requests an orderly end, the second kills the process.
void catch_signals();
/// Returns true after the first Ctrl-C.
[[nodiscard]] bool interrupted();
/// Throws std::runtime_error if a signal has interrupted the program.
void check_not_interrupted();

/// Waits until the library's worker thread is done. Throws its error.
void wait(const Viewer& viewer, Progress& progress);
/// Draws a frame that traces no samples. The library places the camera if the scene has none.
void draw_without_samples(const Viewer& viewer, const RenderOptions& options);
/// Compiles shaders and builds grids before the first sample, so that the samples' times contain nothing else.
void warm_up(const Viewer& viewer, const RenderOptions& options, Progress& progress);

enum class Traced { converged, late, stopped };

/// Renders until the image has all samples, the time limit is reached, or a signal interrupts it. from: samples to
/// resume from. whole: called after each frame that leaves every pixel with a sample.
[[nodiscard]] Traced trace(const Viewer& viewer, const RenderOptions& options, const std::optional<Checkpoint>& from,
                           Progress& progress, const std::function<void()>& whole);

/// Writes a checkpoint. A failure is logged and rendering continues, because the disk may have space the next time.
void try_to_keep(const Viewer& viewer, const RenderOptions& options, Progress& progress);
/// Deletes the checkpoint of an image that has been written.
void forget_checkpoint(const std::string& file);
/// Reads the checkpoint to resume from, if there is one. Throws if it belongs to another image or if the file cannot be
/// written.
[[nodiscard]] std::optional<Checkpoint> checkpoint_for(const RenderOptions& options);

}  // namespace cumulet::demo
