#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "render/film/picture.hpp"
#include "render/film/picture_settings.hpp"
#include "render/pacing/upload.hpp"
#include "render/paths/trace_dispatches.hpp"
#include "render/raster/surface_raster.hpp"
#include "render/scene/trace_inputs.hpp"

namespace cumulet::render {

/// Draws the surface passes of pictures. Pictures with equal inputs share one. All calls need a current context and an
/// active StateGuard.
class LayerCache {
 public:
  LayerCache(gl::FunctionsPtr gl, TraceDispatches& dispatches) : gl_(std::move(gl)), dispatches_(dispatches) {}

  /// Draws the surface pass for a picture, unless another picture has the same one.
  void draw(Picture& picture, const TraceInputs& trace_inputs, const PictureSettings& settings);
  /// Frees the surface passes that no picture has.
  void drop_unused();
  /// Returns whether the surface pass is done, on drivers where a dispatch that reads it would wait for it.
  bool ready(Deadline deadline);

  [[nodiscard]] std::uint64_t bytes() const;

 private:
  /// Inputs of a surface pass; equal inputs give equal layers.
  struct LayersOf {
    std::shared_ptr<const void> content;
    SurfaceView view;
    SurfaceLighting lighting;
    glm::uvec2 size{0U};
    unsigned layers = 0;
    bool operator==(const LayersOf&) const = default;
  };
  struct DrawnLayers {
    LayersOf of;
    SurfaceLayers layers;
  };
  // Draws the layers, and measures the time if not too many passes are in flight.
  void draw_measured(const TraceInputs& trace_inputs, glm::uvec2 size, unsigned layers, SurfaceLayers& drawn);

  gl::FunctionsPtr gl_;
  TraceDispatches& dispatches_;
  std::vector<std::shared_ptr<DrawnLayers>> drawn_;  // shared by pictures
};

}  // namespace cumulet::render
