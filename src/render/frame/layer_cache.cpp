#include "render/frame/layer_cache.hpp"

#include <algorithm>
#include <utility>

#include "gl/state_guard.hpp"
#include "render/pacing/dispatch_pacer.hpp"

namespace cumulet::render {

void LayerCache::drop_unused() {
  std::erase_if(drawn_, [](const auto& drawn) { return drawn.use_count() == 1; });
}

std::uint64_t LayerCache::bytes() const {
  std::uint64_t bytes = 0;
  for (const auto& drawn : drawn_) bytes += drawn->layers.bytes();
  return bytes;
}

void LayerCache::draw(Picture& picture, const TraceInputs& trace_inputs, const PictureSettings& settings) {
  // The surface pass changes GL state; later code in the frame relies on the known state.
  struct Known {
    const gl::Functions& gl;
    explicit Known(const gl::Functions& functions) : gl(functions) {}
    ~Known() {
      if (gl.guard != nullptr) gl.guard->set_known();
    }
    Known(const Known&) = delete;
    Known& operator=(const Known&) = delete;
  };
  const Known known(*gl_);
  picture.drop_layers();
  const LayersOf wanted{trace_inputs.raster->content(), trace_inputs.view, trace_inputs.lighting, settings.layer_size,
                        settings.layers};
  const auto found = std::ranges::find_if(drawn_, [&](const auto& drawn) { return drawn->of == wanted; });
  if (found != drawn_.end()) {
    picture.set_layers({*found, &(*found)->layers}, settings.layered);
    return;
  }
  const auto spare = std::ranges::find_if(drawn_, [](const auto& drawn) { return drawn.use_count() == 1; });
  const auto made = spare != drawn_.end() ? *spare : std::make_shared<DrawnLayers>();
  made->of = {};
  std::erase(drawn_, made);
  drop_unused();
  draw_measured(trace_inputs, wanted.size, wanted.layers, made->layers);
  made->of = wanted;
  drawn_.push_back(made);
  picture.set_layers({made, &made->layers}, settings.layered);
}

void LayerCache::draw_measured(const TraceInputs& trace_inputs, glm::uvec2 size, unsigned layers,
                               SurfaceLayers& drawn) {
  dispatches_.collect();
  InFlightDispatches& draws = dispatches_.draws();
  const bool measured = !draws.full();
  if (measured) draws.begin(InFlightDispatches::Kind::draws);
  try {
    trace_inputs.raster->draw(trace_inputs.view, trace_inputs.lighting, size, layers, drawn);
  } catch (...) {
    if (measured) draws.give_up();
    throw;
  }
  if (!measured) return;
  Dispatched what;
  what.lanes = double(size.x) * size.y * layers;
  what.max_ms = what.lanes / dispatches_.raster_rate();
  draws.end(std::move(what), 0, 0);
}

bool LayerCache::ready(Deadline deadline) {
  if (!gl_->dispatches_in_call) return true;  // the device orders them
  const DispatchPacer pacer(deadline);
  for (dispatches_.collect(); !dispatches_.draws().empty(); dispatches_.collect()) {
    if (!pacer.wait(dispatches_.draws())) return false;
  }
  return true;
}

}  // namespace cumulet::render
