#pragma once

#include "viewer/builder.hpp"
#include "viewer/environment_builder.hpp"
#include "viewer/frame_cache.hpp"
#include "viewer/grid_cache.hpp"
#include "viewer/job_list.hpp"
#include "viewer/live_builder.hpp"
#include "viewer/pose_cache.hpp"
#include "viewer/surface_builder.hpp"

namespace cumulet::viewer {

/// A viewer's own sources of jobs. Each line adds one. If several of one kind of content fail, the first is reported.
struct Jobs : JobList {
  using JobList::JobList;

  Builder& builder = add<Builder>(ContentKind::volume);
  SurfaceBuilder& surfaces = add<SurfaceBuilder>(ContentKind::surfaces);
  EnvironmentBuilder& environments = add<EnvironmentBuilder>(ContentKind::environment);
  GridCache& grids = add<GridCache>(ContentKind::instances);
  PoseCache& poses = add<PoseCache>(ContentKind::models);
  FrameCache& frames = add<FrameCache>(ContentKind::volume);    ///< of the viewer's own sequence
  LiveBuilder& states = add<LiveBuilder>(ContentKind::volume);  ///< of the viewer's own dynamic volume
};

}  // namespace cumulet::viewer
