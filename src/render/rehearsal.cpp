#include "render/rehearsal.hpp"

#include <bit>
#include <utility>

namespace cumulet::render {

namespace {

// Pixels along an edge: enough for a picture of each kind. Drivers may compile anew for textures whose edges are powers
// of two, where others are not.
std::uint32_t edge_like(std::uint32_t edge) { return std::has_single_bit(edge) ? 16 : 24; }
// A budget that pictures of this size begin at their eighth by.
constexpr double coarse_ms = 0.05;

}  // namespace

bool Rehearsal::advance(PictureWish wish, const MarchData& data, const Obstacles& obstacles, Deadline deadline,
                        const std::function<void(const Picture&)>& draw) {
  const glm::uvec2 size = wish.content.size;
  wish.content.size = wish.parameters.view.size = {edge_like(size.x), edge_like(size.y)};
  wish.samples = wish.noise_target ? Picture::first_measured + 1 : 1;  // with a look at the noise
  wish.held = false;
  const auto now = [] { return std::chrono::steady_clock::now(); };
  do {
    progressive_.advance(wish, data, obstacles, now(), coarse_ms);  // a picture at a time, so that each is drawn
    if (progressive_.shown() != nullptr) draw(*progressive_.shown());
    if (!progressive_.more() && !lags_) {
      if (!std::exchange(picked_, true)) tracer().pick(data, wish.parameters, obstacles, glm::uvec2(0U));
      return true;
    }
  } while (now() < deadline);
  return false;
}

void Rehearsal::draw(PictureTextures picture, const Display& display, FrameTarget target) {
  picture.revision.reset();
  picture.may_lag = false;
  target.wait = Wait::never;
  target.filter_ms = coarse_ms;
  target.is_hidden = true;
  const glm::ivec4 whole = target.viewport;
  const glm::ivec4 same(0, 0, glm::ivec2(picture.size));
  for (const bool holes : {false, true}) {
    picture.holes = holes;
    if (holes) ++picture.picture;  // one that follows, where a filter remembers
    for (const glm::ivec4& viewport : {whole, same}) {
      target.viewport = viewport;
      compositor_.draw(picture, display, target);
      lags_ = lags_ || compositor_.lags() || compositor_.denoising();
    }
  }
}

}  // namespace cumulet::render
