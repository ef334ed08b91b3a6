#pragma once

#include <cstdint>
#include <glm/glm.hpp>

#include "render/raster/surface_raster.hpp"
#include "render/scene/analytic_light_data.hpp"
#include "render/scene/environment_data.hpp"
#include "render/scene/instance_data.hpp"
#include "render/scene/model_data.hpp"
#include "render/scene/parameters.hpp"
#include "scene/motion.hpp"

namespace cumulet::render {

/// Trace inputs other than the volume data: host depth as of HostDepth, triangles, environment, lights, and the
/// instance table if there are several volumes.
struct TraceInputs {
  GLuint depth = 0;  // 0: none
  unsigned layers = 0;
  glm::uvec2 size{0U};
  const ModelInstances* scene = nullptr;
  bool traced = true;               // paths hit the scene's triangles; else only the surface pass draws them
  SurfaceRaster* raster = nullptr;  // the surface pass, with its view and lighting below
  SurfaceView view;
  SurfaceLighting lighting;
  const EnvironmentData* environment = nullptr;  // hit by paths that escape
  const AnalyticLightData* analytic_lights =
      nullptr;                                 // sampled by NEE: those of the scene if paths hit it, and the host's
  const InstanceData* instances = nullptr;     // set if there are several volumes; else the volume is the only one
  bool volume_holdout = false;                 // one of the volumes is a holdout
  bool model_holdout = false;                  // one of the models that paths hit is a holdout
  const scene::MotionTable* motion = nullptr;  // transforms for motion vectors; required for FeatureSet::all

  /// Returns the scene whose triangles paths hit; null: none.
  [[nodiscard]] const ModelInstances* traced_models() const { return traced ? scene : nullptr; }
  [[nodiscard]] std::uint32_t analytic_light_count() const {
    return analytic_lights == nullptr ? 0 : analytic_lights->count();
  }
};

/// Returns the parameters of kernels. The caller adds layers, light groups and dispatch.
[[nodiscard]] core::CmParameters kernel_parameters(const PictureParameters& picture, const TraceInputs& trace_inputs);
/// Sets the parameters that may have changed since the picture was started: poses of surfaces, lights, and the host's
/// depth.
[[nodiscard]] core::CmParameters with_current_inputs(core::CmParameters parameters, const TraceInputs& trace_inputs);
/// Binds the buffers and textures of the inputs.
void bind_inputs(const gl::Functions& gl, const TraceInputs& trace_inputs);

}  // namespace cumulet::render
