#include "render/frame/shader_warm_up.hpp"

#include <bit>
#include <utility>

namespace cumulet::render {

namespace {

// Returns an edge length that is enough for a picture of each kind. Drivers may compile separate variants for textures
// whose edges are powers of two, so that property is kept.
std::uint32_t edge_like(std::uint32_t edge) { return std::has_single_bit(edge) ? 16 : 24; }
// With this budget, pictures of this size start at an eighth of the resolution.
constexpr double coarse_ms = 0.05;

}  // namespace

bool ShaderWarmUp::advance(PictureRequest request, const MarchData& data, const TraceInputs& trace_inputs,
                           Deadline deadline, const std::function<void(const Picture&)>& draw) {
  const glm::uvec2 size = request.content.size;
  request.content.size = request.parameters.view.size = {edge_like(size.x), edge_like(size.y)};
  request.samples = request.noise_target ? Picture::first_measured + 1 : 1;  // enough that the noise is measured
  request.held = false;
  const auto now = [] { return std::chrono::steady_clock::now(); };
  do {
    // The deadline is now, so that one picture is made at a time and each is drawn.
    progressive_.advance(request, data, trace_inputs, now(), coarse_ms);
    if (progressive_.shown() != nullptr) draw(*progressive_.shown());
    if (!progressive_.more() && !lags_) {
      if (!std::exchange(picked_, true))
        tracer().inspector().pick(data, request.parameters, trace_inputs, glm::uvec2(0U));
      return true;
    }
  } while (now() < deadline);
  return false;
}

void ShaderWarmUp::draw(PictureTextures picture, const Display& display, FrameTarget target) {
  picture.revision.reset();
  picture.may_lag = false;
  target.wait = Wait::never;
  target.filter_ms = coarse_ms;
  target.is_hidden = true;
  const glm::ivec4 whole = target.viewport;
  const glm::ivec4 same(0, 0, glm::ivec2(picture.size));
  for (const bool holes : {false, true}) {
    picture.holes = holes;
    if (holes) ++picture.picture;  // a later picture, for the denoiser's history
    for (const glm::ivec4& viewport : {whole, same}) {
      target.viewport = viewport;
      compositor_.draw(picture, display, target);
      lags_ = lags_ || compositor_.lags() || compositor_.denoising();
    }
  }
}

}  // namespace cumulet::render
