#pragma once

#include <cstdint>
#include <span>
#include <utility>

#include "render/film/feature_buffers.hpp"
#include "render/film/mattes.hpp"
#include "render/film/picture.hpp"
#include "render/paths/trace_dispatches.hpp"
#include "render/paths/trace_programs.hpp"

namespace cumulet::render {

/// Traces feature rays, without noise: feature buffers (aovs.comp) and Cryptomatte (cryptomatte.comp). All calls need a
/// current context and an active StateGuard.
class FeaturePass {
 public:
  FeaturePass(gl::FunctionsPtr gl, TracePrograms& programs, TraceDispatches& dispatches)
      : gl_(std::move(gl)), programs_(programs), dispatches_(dispatches) {}

  /// Renders the feature buffers of a picture until about the deadline. data, trace_inputs: those that the picture was
  /// started with. rays: minimum rays per pixel; beyond feature_rays it applies only to pixels whose rays differ.
  /// Returns whether they are ready. The next call continues.
  bool find(Picture& picture, const MarchData& data, const TraceInputs& trace_inputs, Deadline deadline,
            std::uint32_t rays, FeatureSet features = FeatureSet::guides);
  /// Returns whether the program that find() needs for guides is linked. Requests it if the driver compiles in
  /// parallel, and does not wait. Throws if it does not build.
  bool able(const Picture& picture, const MarchData& data, const TraceInputs& trace_inputs);
  /// Renders and reads Cryptomatte (glsl/features/cryptomatte.comp): width * height * ranks pairs of floats, sorted by
  /// descending coverage. A pair is an ID as a float's bits and its coverage of the pixel. ranks: 1 to
  /// max_matte_ranks. data, trace_inputs: those that the picture was started with.
  void read_mattes(const Picture& picture, const MarchData& data, const TraceInputs& trace_inputs, const MatteIds& ids,
                   std::uint32_t ranks, float* values);

 private:
  // Rays per pixel: in one dispatch, and in all.
  struct Rays {
    std::uint32_t at_once;
    std::uint32_t wanted;
  };
  // Runs the kernel in use until there are rays.wanted rays per pixel. count: rays so far. row: next row of the rays
  // that are traced now. Returns whether it is done; the next call continues.
  bool trace_rays(const PixelBox& box, core::CmParameters parameters, const TraceProgram& program, Rays rays,
                  std::uint32_t& count, std::uint32_t& row, Deadline deadline);
  bool find_buffers(Picture& picture, const MarchData& data, const TraceInputs& trace_inputs, Deadline deadline,
                    std::uint32_t rays, FeatureSet found, std::span<const FilmLayer> written);
  void upload_motion(const scene::MotionTable& motion);

  gl::FunctionsPtr gl_;
  TracePrograms& programs_;
  TraceDispatches& dispatches_;
  gl::Object motion_;  // TraceInputs::motion, for the pass in progress
};

}  // namespace cumulet::render
