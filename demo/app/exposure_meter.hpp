#pragma once

#include <cumulet/cumulet.h>

#include <cstdint>
#include <optional>
#include <suitable_exposure.hpp>

namespace cumulet::demo {

/// A measured exposure; nullopt if the image is black.
struct Metered {
  std::optional<float> stops;
};

/// Measures the exposure that suits a viewer's image, without waiting for the GPU. All calls from the thread that has
/// the viewer's GL context.
class ExposureMeter {
 public:
  /// Requests a measurement. It replaces a previous one.
  void request() {
    turns_ = settle;
    fresh_ = false;
  }
  /// Returns true while the viewer's values are being copied, which more frames or calls of follow() must await.
  [[nodiscard]] bool reads() const { return read_ != 0; }
  /// Call once per frame. complete: the image shows the whole scene. flags: CUMULET_RENDER_* bits of the frame. curve:
  /// of the display. Returns the requested measurement once, of an image that has the settings of the request.
  [[nodiscard]] std::optional<Metered> follow(cumulet_viewer* viewer, bool complete, std::uint32_t flags,
                                              image::Curve curve);

 private:
  // Complete frames with the new settings until the measured one.
  static constexpr int settle = 4;

  std::optional<int> turns_;  // complete frames until the read begins; nullopt: nothing was requested
  bool fresh_ = false;        // there has been an image since the request; before, frames show an older one
  std::uint64_t read_ = 0;    // number of the read; 0: none
};

}  // namespace cumulet::demo
