#include "render/film/path_features.hpp"

#include <algorithm>
#include <utility>

#include "render/scene/instance_data.hpp"
#include "render/scene/march_data.hpp"
#include "render/scene/parameters.hpp"
#include "render/scene/trace_inputs.hpp"
#include "shader_macros.hpp"

namespace cumulet::render {

namespace {

namespace macros = gl::macros;
using Macros = std::vector<std::string>;

std::string surfaces_macro_of(PathTriangles triangles) {
  return macros::surfaces(triangles == PathTriangles::emitting ? 2 : 1);
}

void add_groups(const PathFeatures& features, Macros& more) {
  if (features.light_groups > 0) more.push_back(macros::groups(1));
}

// Adds the macros that the holdouts, motion and light groups of a picture need.
void add_march(const PathFeatures& features, Macros& more) {
  // To limit the number of variants, those for motion and for clips include holdouts.
  if (features.volume_holdout || features.motion || features.grid.clipped) more.push_back(macros::holdout(1));
  add_groups(features, more);
}

void add_medium(const PathFeatures& features, Macros& more) {
  if (features.second_lobe) more.push_back(macros::second_lobe(1));
  if (features.channels) more.push_back(macros::channels(1));
}

gl::ProgramKey key(const char* name, const GridFeatures& grid, const Macros& more, bool motion = false) {
  Macros all = grid_macros(grid, motion);
  all.insert(all.end(), more.begin(), more.end());
  return {name, std::move(all)};
}

GridFeatures grid_of(const MarchData& data, const TraceInputs& trace_inputs) {
  const InstanceData* instances = trace_inputs.instances;
  return grid_features(data, instances != nullptr, instances != nullptr && instances->clips());
}

PathTriangles triangles_of(const PictureParameters& parameters, const TraceInputs& trace_inputs,
                           const PictureSettings& settings) {
  // To appear at once, the volume of a preview is lit only by sun and sky, as its surfaces are. If there is no such
  // light, the scene lights it.
  const glm::vec3 distant = parameters.lights.sun_irradiance + parameters.lights.sky_radiance;
  const bool preview = settings.layered == Layered::beneath && distant != glm::vec3(0.0F);
  const ModelInstances* models =
      settings.options.view == View::shaded && !preview ? trace_inputs.traced_models() : nullptr;
  if (models == nullptr) return PathTriangles::none;
  const bool emitting = models->lights().triangles > 0 || models->tables().extended_bsdf != 0U;
  return emitting || settings.options.light_groups > 0 ? PathTriangles::emitting : PathTriangles::hit;
}

}  // namespace

GridFeatures grid_features(const MarchData& data, bool several, bool clipped) {
  const bool wide = data.is_wide();
  // The page count is one, two or the maximum, to limit the number of programs.
  std::size_t pages = std::max<std::size_t>(data.pages(), 1);
  if (pages > 2 || wide || data.is_trilinear() || (several && data.march() == March::tet)) pages = MarchData::max_pages;
  return {data.march(), data.is_linear(), pages, wide, several, data.is_trilinear(), clipped};
}

std::vector<std::string> grid_macros(const GridFeatures& grid, bool motion) {
  const int degree = grid.trilinear ? 2 : static_cast<int>(grid.linear);
  Macros all{macros::march(grid.march), macros::linear(degree), macros::pages(grid.pages)};
  if (grid.several) all.push_back(macros::instances(1));
  if (grid.clipped) all.push_back(macros::clip(1));
  if (motion) all.push_back(macros::motion(1));
  if (grid.wide) all.push_back(macros::wide(1));
  return all;
}

PathFeatures path_features(const MarchData& data, const PictureParameters& parameters, const TraceInputs& trace_inputs,
                           const PictureSettings& settings) {
  const PictureOptions& options = settings.options;
  const bool shaded = options.view == View::shaded;
  const core::CmMedium& medium = parameters.medium;
  PathFeatures features;
  features.grid = grid_of(data, trace_inputs);
  features.view = options.view;
  features.layered = shaded && trace_inputs.raster != nullptr ? settings.layered : Layered::no;
  features.triangles = triangles_of(parameters, trace_inputs, settings);
  features.light_groups = shaded ? options.light_groups : 0;
  features.second_lobe = medium.second_weight > 0.0F;
  features.channels = medium.emits != 0U || medium.colored != 0U || medium.anisotropic != 0U;
  features.environment = trace_inputs.environment != nullptr;
  features.analytic_lights = trace_inputs.analytic_light_count() > 0;
  if (features.has_stages()) {
    features.extended_bsdf = trace_inputs.traced_models()->tables().extended_bsdf;
    features.clear_surfaces = trace_inputs.traced_models()->clear_surfaces();
  }
  features.volume_holdout = shaded && trace_inputs.volume_holdout;
  features.model_holdout = shaded && features.has_stages() && trace_inputs.model_holdout;
  features.motion = shaded && parameters.shutter.lasts != 0U;
  features.separate_volume_aov = shaded && options.separate_volume_aov;
  // Equiangular sampling is off in these cases. The separate volume AOV depends on the first hit of a path, but such
  // light may lie before a surface. The color of a surface layer is stored in the same field as the light of such an
  // NEE sample. A holdout has no light.
  features.equiangular = features.analytic_lights && parameters.equiangular && !features.separate_volume_aov &&
                         features.extended_bsdf == 0 && !features.volume_holdout && !features.model_holdout &&
                         (features.has_stages() || features.layered == Layered::no);
  // To limit the number of variants, only the most frequent kernels have others for these.
  const bool plain = shaded && !options.preview && !features.grid.several && !features.has_stages() &&
                     !features.channels && !features.analytic_lights && !features.separate_volume_aov &&
                     features.light_groups == 0 && features.layered == Layered::no;
  features.ground_or_disk = !plain || parameters.ground.reach > 0.0F || parameters.lights.sun_spread > 0.0F;
  features.shadow_catcher = !plain || (parameters.ground.reach > 0.0F && parameters.ground.catches != 0U);
  features.anisotropic = features.ground_or_disk || features.second_lobe || medium.anisotropy != 0.0F;
  return features;
}

gl::ProgramKey trace_key(const PathFeatures& features) {
  Macros more;
  if (features.has_stages()) {
    more.push_back(surfaces_macro_of(features.triangles));
    add_medium(features, more);
    if (features.environment) more.push_back(macros::environment(1));
    if (features.equiangular) more.push_back(macros::equiangular(1));
    add_march(features, more);
    return key("trace_travel.comp", features.grid, more, features.motion);
  }
  // To limit the number of variants, those for light groups include layers and lights even if there are none.
  const bool groups = features.light_groups > 0;
  if (features.layered != Layered::no || (groups && !features.equiangular)) more.push_back(macros::layers(1));
  if (features.separate_volume_aov) more.push_back(macros::aovs(1));
  if (!features.ground_or_disk) {
    more.push_back(macros::ground(0));
    more.push_back(macros::sun_disk(0));
  } else if (!features.shadow_catcher) {
    more.push_back(macros::shadow_catcher(0));
  }
  if (!features.anisotropic) more.push_back(macros::isotropic(1));
  add_medium(features, more);
  if (features.environment) more.push_back(macros::environment(1));
  if (features.analytic_lights || groups) more.push_back(macros::analytic_lights(1));
  if (features.equiangular) more.push_back(macros::equiangular(1));
  add_march(features, more);
  return key("trace.comp", features.grid, more, features.motion);
}

StageKeys stage_keys(const PathFeatures& features) {
  Macros shade{surfaces_macro_of(features.triangles)};
  if (features.channels) {
    shade.push_back(macros::channels(1));
    if (features.grid.several) shade.push_back(macros::instances(1));
    if (features.grid.clipped) shade.push_back(macros::clip(1));
  }
  if (features.environment) shade.push_back(macros::environment(1));
  if (features.equiangular) shade.push_back(macros::equiangular(1));
  if (features.model_holdout) shade.push_back(macros::holdout(1));
  Macros intersect{macros::surfaces(1)};
  if (features.extended_bsdf > 0) {
    shade.push_back(macros::extended_bsdf(features.extended_bsdf));
    // Only the light that passes through clear surfaces depends on thin films there.
    intersect.push_back(macros::extended_bsdf(features.clear_surfaces ? features.extended_bsdf : 1));
    if (features.clear_surfaces) intersect.push_back(macros::clear_surfaces(1));
  }
  Macros camera{macros::surfaces(1), macros::dense(0)};
  if (features.motion) {
    for (Macros* stage : {&shade, &intersect, &camera}) stage->push_back(macros::motion(1));
  }
  if (features.separate_volume_aov) camera.push_back(macros::aovs(1));
  if (features.environment) camera.push_back(macros::environment(1));
  for (Macros* stage : {&shade, &intersect, &camera}) add_groups(features, *stage);
  Macros begin = camera;
  begin[1] = macros::dense(1);
  return {{"trace_camera.comp", begin},
          trace_key(features),
          {"trace_intersect.comp", intersect},
          {"trace_shade.comp", shade},
          {"trace_camera.comp", camera}};
}

gl::ProgramKey noise_key() { return {"noise.comp", {}}; }

gl::ProgramKey inspect_key(const MarchData& data, const TraceInputs& trace_inputs) {
  Macros more;
  if (trace_inputs.scene != nullptr) more.push_back(macros::surfaces(1));
  return key("inspect.comp", grid_of(data, trace_inputs), more);
}

gl::ProgramKey feature_buffers_key(const MarchData& data, const TraceInputs& trace_inputs, FeatureSet set, bool emits) {
  Macros more;
  if (trace_inputs.scene != nullptr) more.push_back(macros::surfaces(1));
  if (set == FeatureSet::all || emits) more.push_back(macros::channels(1));
  if (set == FeatureSet::all) more.push_back(macros::velocity(1));
  return key("aovs.comp", grid_of(data, trace_inputs), more);
}

gl::ProgramKey mattes_key(const MarchData& data, const TraceInputs& trace_inputs, bool motion) {
  Macros more;
  if (trace_inputs.scene != nullptr) more.push_back(macros::surfaces(1));
  const GridFeatures grid = grid_of(data, trace_inputs);
  return key("cryptomatte.comp", grid, more, grid.several && motion);
}

gl::ProgramKey transmittance_key(const MarchData& data, const TraceInputs& trace_inputs) {
  return key("transmittance.comp", grid_of(data, trace_inputs), {});
}

}  // namespace cumulet::render
