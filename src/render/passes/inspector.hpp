#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <utility>

#include "render/film/picture.hpp"
#include "render/paths/trace_dispatches.hpp"
#include "render/paths/trace_programs.hpp"

namespace cumulet::render {

/// The pick result for one pixel.
struct Picked {
  float z = 0.0F;  ///< view depth of the volume at half opacity, or of a triangle; 0: neither was hit
  /// if the volume was hit: index of the volume with the highest extinction there
  std::optional<std::uint32_t> volume;
  std::optional<std::uint32_t> triangle;  ///< if a triangle was hit: its number among those of all models
};

/// Runs inspect.comp, one ray per pixel: debug views, depth, and picks. All calls need a current context and an active
/// StateGuard.
class Inspector {
 public:
  Inspector(gl::FunctionsPtr gl, TracePrograms& programs, TraceDispatches& dispatches)
      : gl_(std::move(gl)), programs_(programs), dispatches_(dispatches) {}

  /// Computes a picture of a debug view until about the deadline; returns whether it is done.
  bool trace_view(Picture& picture, const MarchData& data, const TraceInputs& trace_inputs, Deadline deadline);
  /// Computes the depth at half opacity until about the deadline; returns whether it is ready.
  bool trace_depth(Picture& picture, const MarchData& data, const TraceInputs& trace_inputs, Deadline deadline);
  Picked pick(const MarchData& data, const PictureParameters& parameters, const TraceInputs& trace_inputs,
              glm::uvec2 pixel);

 private:
  bool find_view(Picture& picture, const MarchData& data, const TraceInputs& trace_inputs, Deadline deadline);

  gl::FunctionsPtr gl_;
  TracePrograms& programs_;
  TraceDispatches& dispatches_;
  gl::Object depth_;   // depth of a pick...
  gl::Object object_;  // ...and the object that it hit
};

}  // namespace cumulet::render
