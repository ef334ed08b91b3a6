#pragma once

#include <cumulet/cumulet.h>

#include <cstdint>
#include <optional>

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
  void request() { turns_ = settle; }
  /// Returns true while the viewer's values are being copied, which more frames or calls of follow() must await.
  [[nodiscard]] bool reads() const { return read_ != 0; }
  /// Call once per frame. complete: the image shows the whole scene, with at least one sample per pixel. Returns the
  /// requested measurement once.
  [[nodiscard]] std::optional<Metered> follow(cumulet_viewer* viewer, bool complete);

 private:
  // Complete frames between a request and the measured one, because frames first show the image before a change.
  static constexpr int settle = 4;

  std::optional<int> turns_;  // complete frames until the read begins; nullopt: nothing was requested
  std::uint64_t read_ = 0;    // number of the read; 0: none
};

}  // namespace cumulet::demo
