#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

#include "base/progress.hpp"
#include "render/surface_data.hpp"
#include "viewer/bounds.hpp"

namespace cumulet::viewer {

using SurfacePtr = std::shared_ptr<const render::SurfaceSource>;

/// Which moment of which animation.
struct SurfaceMoment {
  double time = 0.0;  // seconds
  std::uint32_t animation = 0;
  bool operator==(const SurfaceMoment&) const = default;
};

/// A scene and what is made of it once, however many viewers show it. Immutable to its users; any thread.
class SurfaceAsset {
 public:
  SurfaceAsset(surface::ScenePtr scene, std::string name) : scene_(std::move(scene)), name_(std::move(name)) {}

  [[nodiscard]] const surface::Scene& scene() const { return *scene_; }
  [[nodiscard]] const std::string& name() const { return name_; }

  /// What of a pose does not depend on the moment, and the world bounds of the triangles as they rest.
  struct Rest {
    std::size_t lights = 0;
    std::size_t cameras = 0;
    Bounds bounds;
  };
  /// Poses the scene when it is first asked.
  [[nodiscard]] Rest rest() const;
  /// The scene at a moment. If a viewer holds it at that moment already, the same; if at another, a refit of that.
  /// Throws Error(cancelled).
  [[nodiscard]] SurfacePtr posed(SurfaceMoment moment, Progress& progress) const;

 private:
  surface::ScenePtr scene_;
  std::string name_;
  mutable std::mutex rest_mutex_;
  mutable std::optional<Rest> rest_;
  mutable std::mutex mutex_;
  mutable std::weak_ptr<const render::SurfaceSource> newest_;  // as long as somebody shows it
  mutable SurfaceMoment newest_moment_;
};

using SurfaceAssetPtr = std::shared_ptr<const SurfaceAsset>;

}  // namespace cumulet::viewer
