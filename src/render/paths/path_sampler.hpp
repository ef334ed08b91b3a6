#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <utility>

#include "render/film/picture.hpp"
#include "render/paths/path_kernels.hpp"
#include "render/paths/trace_dispatches.hpp"
#include "render/paths/trace_programs.hpp"

namespace cumulet::render {

/// Samples the pixels of shaded pictures by paths, in bounded dispatches over tiles. All calls need a current context
/// and an active StateGuard.
class PathSampler {
 public:
  PathSampler(gl::FunctionsPtr gl, TracePrograms& programs, TraceDispatches& dispatches)
      : gl_(gl), programs_(programs), dispatches_(dispatches), kernels_(std::move(gl)) {}

  /// Maximum number of lanes for pictures with these features.
  [[nodiscard]] std::uint32_t max_lanes(const PathFeatures& features) const;
  /// AccumulationSettings::short_picture without previews.
  [[nodiscard]] std::uint32_t short_picture() const;
  /// Allocates buffers for the paths of the accumulation. Throws on a GL error.
  void reserve(const PathFeatures& features, const Accumulation& accumulation);
  /// Looks up all programs that a picture is sampled with. measures: it has a noise target.
  void find_programs(const PathFeatures& features, bool measures);
  /// Samples until about the deadline, and may return with dispatches in flight. Parameters are those of
  /// Tracer::trace(). Returns whether the picture is done.
  bool trace(Picture& picture, const MarchData& data, const TraceInputs& trace_inputs, Deadline deadline,
             bool until_complete);
  [[nodiscard]] std::uint64_t bytes() const { return kernels_.bytes(); }

 private:
  // Programs of a picture. stages: the wavefront programs; nullopt: `program` is the megakernel.
  struct Kernels {
    const TraceProgram& program;
    std::optional<StagePrograms> stages;
  };
  StagePrograms stage_programs(const PathFeatures& features);
  bool accumulate(Picture& picture, const MarchData& data, const TraceInputs& trace_inputs, Deadline deadline,
                  bool until_complete);
  // Sends one dispatch: samples, or a measurement of the error. Returns false if nothing can be sent. aim_ms: the
  // time of the dispatch. at_least: sends a minimum even if it takes longer.
  bool send(Picture& picture, const TraceInputs& trace_inputs, const Kernels& kernels, double aim_ms, bool at_least);
  void dispatch(Picture& picture, const TraceInputs& trace_inputs, const Kernels& kernels, Dispatched what);
  // Dispatches the kernel that measures the error of a tile whose samples are done.
  void measure(Picture& picture, const TraceInputs& trace_inputs);

  gl::FunctionsPtr gl_;
  TracePrograms& programs_;
  TraceDispatches& dispatches_;
  PathKernels kernels_;
  std::weak_ptr<const Blocks> paths_of_;  // the tile whose paths the kernels hold
  gl::Object errors_;                     // errors of a tile
};

}  // namespace cumulet::render
