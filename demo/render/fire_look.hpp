#pragma once

#include <optional>
#include <vector>

#include "default_medium.hpp"
#include "options.hpp"
#include "render_viewer.hpp"

namespace cumulet::demo {

/// Returns the default medium of fire or smoke if the scene sets no medium; else nullopt.
[[nodiscard]] std::optional<DefaultMedium> default_medium(const Viewer& viewer, const SceneOptions& scene);

/// Dusk light, tone map and exposure for images of a burning volume.
class FireLook {
 public:
  /// by_default: neither light, exposure nor tone map is given.
  explicit FireLook(bool by_default) : by_default_(by_default) {}

  /// Sets dusk for the viewer of a burning volume if the scene has the default look.
  void take(const Viewer& viewer, const SceneOptions& scene);
  /// Gives the scene of a sequence the light and display of take(). All its frames then have the exposure of dusk.
  void settle(SceneOptions& scene);
  /// Sets the exposure that suits the image, unless it is close to that of dusk. Does nothing unless take() has set
  /// dusk for a whole .png. denoised: pixels of the image; empty: those of the viewer.
  void expose(const Viewer& viewer, const RenderOptions& options, const std::vector<float>& denoised);
  /// Logs the light and, if expose() has changed it, the exposure.
  void print_light(Progress& progress) const;
  void print_exposure(const std::string& output, Progress& progress) const;
  /// Returns the options with the displayed look.
  [[nodiscard]] RenderOptions shown(RenderOptions options) const;

 private:
  bool by_default_;
  bool has_one_image_ = true;
  std::optional<SceneOptions> dusk_;  // the scene at dusk
};

/// Logs the default medium of fire or smoke.
void print_medium(const DefaultMedium& made, Progress& progress);

}  // namespace cumulet::demo
