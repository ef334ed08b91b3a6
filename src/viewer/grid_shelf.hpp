#pragma once

#include "viewer/builder.hpp"
#include "viewer/shelf.hpp"

namespace cumulet::viewer {

struct GridWish {
  VolumeAssetPtr volume;
  BuildSettings settings;
  std::uint64_t gl_bytes = Allowance::no_limit;  ///< its share of the GPU memory for volumes
  bool operator==(const GridWish&) const = default;
};

/// Asynchronous cache of the grids of several volumes.
class GridShelf : public Shelf<GridWish, Built> {
 public:
  GridShelf(const Log& log, std::function<void()> notify, Trace trace = {},
            AllowancePtr allowance = std::make_shared<const Allowance>())
      : Shelf(
            "building the grids of several volumes", Progress::Stage::refining,
            [log](const Wish& wish, Progress& progress) {
              Allowance part;
              part.set_gl(wish.gl_bytes);
              return build_grid(log, wish.volume, wish.settings, progress, part);
            },
            std::move(notify), trace, std::move(allowance)) {}
};

}  // namespace cumulet::viewer
