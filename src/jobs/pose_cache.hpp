#pragma once

#include "assets/surface_asset.hpp"
#include "jobs/request_cache.hpp"

namespace cumulet::viewer {

struct PoseRequest {
  SurfaceAssetPtr surfaces;
  SurfaceChoice choice;
  bool operator==(const PoseRequest&) const = default;
};

/// Asynchronous cache of the poses of several models.
class PoseCache : public RequestCache<PoseRequest, scene::ModelSourcePtr> {
 public:
  explicit PoseCache(const JobContext& context)
      : RequestCache(
            "posing several models", Progress::Stage::loading,
            [](const Request& request, Progress& progress) {
              return request.surfaces->posed(request.choice, progress);
            },
            context) {}
};

}  // namespace cumulet::viewer
