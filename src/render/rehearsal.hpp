#pragma once

#include <functional>
#include <glm/glm.hpp>

#include "render/compositor.hpp"
#include "render/progressive.hpp"

namespace cumulet::render {

/// A picture of few pixels, made as the frames' pictures are and drawn where nothing can be seen: afterwards each
/// program that these reach was used once, so that the driver has nothing to compile for them any more. All calls need
/// the context current and a StateGuard around.
class Rehearsal {
 public:
  Rehearsal(gl::FunctionsPtr gl, gl::ProgramsPtr programs)
      : gl_(gl), progressive_(gl, programs), compositor_(std::move(gl), std::move(programs)) {}

  /// Works on it until about the deadline, one program at least. draw is told each picture, to call draw() with it.
  /// Returns whether all is done.
  bool advance(PictureWish wish, const MarchData& data, const Obstacles& obstacles, Deadline deadline,
               const std::function<void(const Picture&)>& draw);
  /// Whether something could not be drawn since begin(), the driver being at its program.
  [[nodiscard]] bool lags() const { return lags_; }
  /// A call of the host's.
  void begin() { lags_ = false; }
  /// What frames draw before there is a picture.
  [[nodiscard]] Picture& empty() { return empty_; }
  [[nodiscard]] Tracer& tracer() { return progressive_.tracer(); }
  /// Draws nothing, with all programs that drawing such a picture may need.
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
