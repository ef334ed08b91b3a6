#pragma once

#include "viewer/builder.hpp"
#include "viewer/shelf.hpp"

namespace cumulet::viewer {

struct GridWish {
  VolumeAssetPtr volume;
  BuildSettings settings;
  bool operator==(const GridWish&) const = default;
};

/// Grids of several volumes.
class GridShelf : public Shelf<GridWish, Built> {
 public:
  GridShelf(const Log& log, std::function<void()> notify, Trace trace = {},
            AllowancePtr allowance = std::make_shared<const Allowance>())
      : Shelf(
            "building the grids of several volumes", Progress::Stage::refining,
            [log](const Wish& wish, Progress& progress) {
              return build_grid(log, wish.volume, wish.settings, progress);
            },
            std::move(notify), trace, std::move(allowance)) {}
};

}  // namespace cumulet::viewer
