#pragma once

#include "jobs/builder.hpp"
#include "jobs/environment_builder.hpp"
#include "jobs/frame_cache.hpp"
#include "jobs/grid_cache.hpp"
#include "jobs/job_list.hpp"
#include "jobs/live_builder.hpp"
#include "jobs/pose_cache.hpp"
#include "jobs/surface_builder.hpp"

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
