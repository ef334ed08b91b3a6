#pragma once

#include <string>

#include "render_queue.hpp"
#include "viewer_setup.hpp"
#include "window.hpp"

namespace cumulet::demo {

/// Renders pictures in the background, with a viewer and a GL context of its own. All functions from the window's
/// thread.
class PictureRenderer {
 public:
  explicit PictureRenderer(ViewerSetup setup);

  /// Adds a job to the queue. The first one creates the context, for which the window must exist. Throws
  /// std::runtime_error, one line, if the driver refuses that.
  void add(PictureJob job);
  [[nodiscard]] RenderQueue& queue() { return queue_; }
  [[nodiscard]] const RenderQueue& queue() const { return queue_; }

 private:
  [[nodiscard]] std::string render(const PictureJob& job, const PictureWatch& watch) const;

  ViewerSetup setup_;
  Window::Context context_;
  RenderQueue queue_;  // its thread uses the context
};

}  // namespace cumulet::demo
