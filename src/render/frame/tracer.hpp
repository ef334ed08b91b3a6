#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "render/film/picture.hpp"
#include "render/frame/layer_cache.hpp"
#include "render/passes/feature_pass.hpp"
#include "render/passes/inspector.hpp"
#include "render/paths/path_sampler.hpp"
#include "render/paths/trace_dispatches.hpp"
#include "render/paths/trace_programs.hpp"

namespace cumulet::render {

/// Starts pictures, and traces them by the parts of a tracer: PathSampler (samples), Inspector (debug views, depth,
/// picks), FeaturePass (feature buffers, Cryptomatte) and LayerCache (surface passes). The parts share programs and
/// dispatches. All calls need a current context and an active StateGuard.
class Tracer {
 public:
  Tracer(gl::FunctionsPtr gl, gl::ProgramsPtr programs);
  Tracer(const Tracer&) = delete;
  Tracer& operator=(const Tracer&) = delete;
  Tracer(Tracer&&) = delete;
  Tracer& operator=(Tracer&&) = delete;
  ~Tracer() = default;

  /// Returns whether the programs that begin() needs with these settings are linked. Requests them if the driver
  /// compiles in parallel, and does not wait. Throws if a program does not build.
  bool able(const MarchData& data, const PictureParameters& parameters, const TraceInputs& trace_inputs,
            const PictureSettings& settings);
  /// Starts a new picture with this many samples per pixel. If it throws, the picture is unchanged or not complete.
  void begin(Picture& picture, const MarchData& data, const PictureParameters& parameters, std::uint32_t samples,
             const TraceInputs& trace_inputs, const PictureSettings& settings);
  /// Traces until about the deadline, and may return with dispatches in flight; only calls that read wait for them.
  /// Except for the first, no dispatch is sent that would probably end after the deadline. The picture that was last
  /// started or traced continues; any other restarts its in-flight paths. until_complete: stops once every pixel has a
  /// sample, if that was not so before. Returns whether the picture is done.
  bool trace(Picture& picture, const MarchData& data, const TraceInputs& trace_inputs, Deadline deadline,
             bool until_complete = false);
  /// Waits for in-flight dispatches, so that everything known about the picture is exact.
  void settle(Picture& picture);
  /// Makes a picture of one transparent pixel over a black background, to be shown before the first picture.
  void clear(Picture& picture);
  /// Sets the background of a picture that clear() made.
  void set_background(Picture& picture, const glm::vec3& radiance);
  /// Draws the surface pass for a picture, unless another picture has the same one. begin() calls it; call it to show a
  /// picture of clear() over surfaces.
  void draw_layers(Picture& picture, const TraceInputs& trace_inputs, const PictureSettings& settings);
  /// Restores a checkpoint (render/film/checkpoint.hpp).
  void restore(Picture& picture, std::span<const std::byte> saved);

  [[nodiscard]] Inspector& inspector() { return inspector_; }
  [[nodiscard]] FeaturePass& feature_pass() { return feature_pass_; }
  /// Makes later commands of this context run after the in-flight dispatches, whichever context sent them. Does not
  /// wait.
  void order() const { dispatches_.order(); }
  /// Appends a record for every dispatch that ends, for tests.
  void set_log(std::vector<DispatchRecord>* log) { dispatches_.set_log(log); }
  /// GPU time of the trace, inspect and surface passes.
  [[nodiscard]] const PassSeconds& seconds() const { return dispatches_.seconds(); }
  /// Recent speed of the surface pass, in pixels per millisecond.
  [[nodiscard]] double raster_rate() const { return dispatches_.raster_rate(); }
  [[nodiscard]] std::uint64_t bytes() const { return sampler_.bytes() + layers_.bytes(); }

 private:
  // Looks up all programs that a picture is traced with. measures: it has a noise target.
  void find_programs(const PathFeatures& features, bool measures, const MarchData& data,
                     const TraceInputs& trace_inputs);

  gl::FunctionsPtr gl_;
  TracePrograms programs_;
  TraceDispatches dispatches_;
  LayerCache layers_;
  PathSampler sampler_;
  Inspector inspector_;
  FeaturePass feature_pass_;
};

}  // namespace cumulet::render
