#pragma once

#include <functional>
#include <glm/glm.hpp>

#include "render/frame/progressive.hpp"
#include "render/passes/compositor.hpp"

namespace cumulet::render {

/// Shader warm-up: renders a picture of few pixels as frames do, and draws it invisibly. Afterwards each program that
/// frames need has been used once, so that the driver has nothing left to compile. All calls need a current context and
/// an active StateGuard.
class ShaderWarmUp {
 public:
  ShaderWarmUp(gl::FunctionsPtr gl, gl::ProgramsPtr programs)
      : gl_(gl), progressive_(gl, programs), compositor_(std::move(gl), std::move(programs)) {}

  /// Continues until about the deadline, but uses at least one program. draw: is called with each picture, and must
  /// call draw() for it. Returns whether all is done.
  bool advance(PictureRequest request, const MarchData& data, const TraceInputs& trace_inputs, Deadline deadline,
               const std::function<void(const Picture&)>& draw);
  /// True if something could not be drawn since begin() because a program was still compiling.
  [[nodiscard]] bool lags() const { return lags_; }
  /// Call it at the start of each call of the host.
  void begin() { lags_ = false; }
  /// The picture that frames draw before there is one.
  [[nodiscard]] Picture& empty() { return empty_; }
  [[nodiscard]] Tracer& tracer() { return progressive_.tracer(); }
  /// Draws invisibly with all programs that drawing such a picture may need.
  void draw(PictureTextures picture, const Display& display, FrameTarget target);

 private:
  gl::FunctionsPtr gl_;
  Progressive progressive_;
  Compositor compositor_;
  Picture empty_;
  bool lags_ = false;
  bool picked_ = false;
};

}  // namespace cumulet::render
