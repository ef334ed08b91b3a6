#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

#include "base/progress.hpp"
#include "scene/model_source.hpp"
#include "viewer/bounds.hpp"

namespace cumulet::viewer {

/// What of an asset a viewer shows.
struct SurfaceChoice {
  double time = 0.0;  // seconds
  std::uint32_t animation = 0;
  bool double_sided = false;     // all of its materials
  std::uint32_t variant = 0;     // 0: none, else the scene's, from 1; one that is not there: none
  double shutter_seconds = 0.0;  // of the animation, around that time
  bool operator==(const SurfaceChoice&) const = default;
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
  /// The scene as chosen. If a viewer holds just that already, the same; if another choice, a refit of it.
  /// Throws Error(cancelled).
  [[nodiscard]] scene::ModelSourcePtr posed(SurfaceChoice choice, Progress& progress) const;

 private:
  surface::ScenePtr scene_;
  std::string name_;
  mutable std::mutex rest_mutex_;
  mutable std::optional<Rest> rest_;
  mutable std::mutex mutex_;
  mutable std::weak_ptr<const scene::ModelSource> newest_;  // as long as somebody shows it
  mutable SurfaceChoice newest_choice_;
};

using SurfaceAssetPtr = std::shared_ptr<const SurfaceAsset>;

}  // namespace cumulet::viewer
