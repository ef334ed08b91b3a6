#pragma once

#include "viewer/shelf.hpp"
#include "viewer/surface_asset.hpp"

namespace cumulet::viewer {

struct PoseWish {
  SurfaceAssetPtr surfaces;
  SurfaceChoice choice;
  bool operator==(const PoseWish&) const = default;
};

/// Asynchronous cache of the poses of several models.
class PoseShelf : public Shelf<PoseWish, scene::ModelSourcePtr> {
 public:
  explicit PoseShelf(std::function<void()> notify, Trace trace = {},
                     AllowancePtr allowance = std::make_shared<const Allowance>())
      : Shelf(
            "posing several models", Progress::Stage::loading,
            [](const Wish& wish, Progress& progress) { return wish.surfaces->posed(wish.choice, progress); },
            std::move(notify), trace, std::move(allowance)) {}
};

}  // namespace cumulet::viewer
