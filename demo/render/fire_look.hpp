#pragma once

#include <optional>

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
  void settle(SceneOptions& scene) const;
  /// Logs the light.
  void print_light(Progress& progress) const;
  /// Returns the options with the displayed look.
  [[nodiscard]] RenderOptions shown(RenderOptions options) const;

 private:
  bool by_default_;
  std::optional<SceneOptions> dusk_;  // the scene at dusk
};

/// Logs the default medium of fire or smoke.
void print_medium(const DefaultMedium& made, Progress& progress);

}  // namespace cumulet::demo
