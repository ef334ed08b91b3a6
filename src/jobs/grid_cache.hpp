#pragma once

#include "jobs/request_cache.hpp"
#include "jobs/shared_grids.hpp"

namespace cumulet::viewer {

struct GridRequest {
  VolumeAssetPtr volume;
  BuildSettings settings;
  std::uint64_t gl_bytes = ResourceLimits::no_limit;  ///< its share of the GPU memory for volumes
  bool operator==(const GridRequest&) const = default;
};

/// Asynchronous cache of the grids of several volumes.
class GridCache : public RequestCache<GridRequest, Built> {
 public:
  explicit GridCache(const JobContext& context)
      : RequestCache(
            "building the grids of several volumes", Progress::Stage::refining,
            [log = context.log](const Request& request, Progress& progress) {
              ResourceLimits part;
              part.set_gl(request.gl_bytes);
              return shared_grid(log, request.volume, request.settings, progress, part);
            },
            context) {}
};

}  // namespace cumulet::viewer
