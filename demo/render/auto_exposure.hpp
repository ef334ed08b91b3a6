#pragma once

#include <cumulet/cumulet.h>

#include <optional>
#include <string>
#include <vector>

#include "options.hpp"
#include "render_viewer.hpp"

namespace cumulet::demo {

/// Exposes a .png as cumulet-demo does after a load: the exposure is measured in the image, unless the options give
/// one.
class AutoExposure {
 public:
  explicit AutoExposure(const RenderOptions& options);

  /// Keeps the exposure of the scene from now on: all frames of a sequence have the same one.
  void keep() { measures_ = false; }
  /// Sets the exposure that suits the image, unless it is close to that of `display`. Does nothing for parts of an
  /// image, because all of them have the same exposure, and for debug views. display: as displayed so far. denoised:
  /// pixels of the image; empty: those of the viewer.
  void measure(const Viewer& viewer, const SceneOptions& scene, const cumulet_display_desc& display,
               const std::vector<float>& denoised);
  /// Returns the options with the measured exposure.
  [[nodiscard]] RenderOptions shown(RenderOptions options) const;
  /// Logs the measured exposure, if there is one.
  void print(const std::string& output, Progress& progress) const;

 private:
  bool measures_;
  std::optional<float> stops_;
};

}  // namespace cumulet::demo
