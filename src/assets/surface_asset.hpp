#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

#include "assets/bounds.hpp"
#include "base/progress.hpp"
#include "scene/model_source.hpp"

namespace cumulet::viewer {

/// Selects the state of an asset that a viewer shows.
struct SurfaceChoice {
  double time = 0.0;  // seconds
  std::uint32_t animation = 0;
  bool double_sided = false;     // for all of its materials
  std::uint32_t variant = 0;     // 0: none, else the scene's, from 1; a missing variant counts as none
  double shutter_seconds = 0.0;  // shutter interval, centered at `time`
  bool operator==(const SurfaceChoice&) const = default;
};

/// A scene and data derived from it, shared by all viewers that show it. Immutable for its users; thread-safe.
class SurfaceAsset {
 public:
  /// warnings: of reading the scene, one per line.
  SurfaceAsset(surface::ScenePtr scene, std::string name, std::string warnings = {})
      : scene_(std::move(scene)), name_(std::move(name)), warnings_(std::move(warnings)) {}

  [[nodiscard]] const surface::Scene& scene() const { return *scene_; }
  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] const std::string& warnings() const { return warnings_; }

  /// Time-independent data of poses, and the world bounds of the triangles at rest.
  struct Rest {
    std::size_t lights = 0;
    std::size_t cameras = 0;
    Bounds bounds;
  };
  /// Poses the scene on the first call.
  [[nodiscard]] Rest rest() const;
  /// Returns the scene in the chosen state. If a viewer holds a source for the same choice, returns that one; for
  /// another choice, refits a copy of it. Throws Error(cancelled).
  [[nodiscard]] scene::ModelSourcePtr posed(SurfaceChoice choice, Progress& progress) const;

 private:
  surface::ScenePtr scene_;
  std::string name_;
  std::string warnings_;
  mutable std::mutex rest_mutex_;
  mutable std::optional<Rest> rest_;
  mutable std::mutex mutex_;
  mutable std::weak_ptr<const scene::ModelSource> newest_;  // valid while a viewer shows it
  mutable SurfaceChoice newest_choice_;
};

using SurfaceAssetPtr = std::shared_ptr<const SurfaceAsset>;

}  // namespace cumulet::viewer
