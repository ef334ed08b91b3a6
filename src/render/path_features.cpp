#include "render/path_features.hpp"

#include <span>
#include <string>
#include <utility>
#include <vector>

#include "render/march_data.hpp"
#include "render/parameters.hpp"
#include "render/trace_inputs.hpp"

namespace cumulet::render {

namespace {

using Macros = std::vector<std::string>;

constexpr const char* surfaces_macro = "CM_SURFACES 1";
constexpr const char* channels_macro = "CM_CHANNELS 1";
constexpr const char* environment_macro = "CM_ENVIRONMENT 1";
constexpr const char* equiangular_macro = "CM_EQUIANGULAR 1";
constexpr const char* extended_bsdf_macro = "CM_EXTENDED_BSDF 1";
constexpr const char* groups_macro = "CM_GROUPS 1";
constexpr const char* holdout_macro = "CM_HOLDOUT 1";

const char* surfaces_macro_of(PathTriangles triangles) {
  return triangles == PathTriangles::emitting ? "CM_SURFACES 2" : surfaces_macro;
}

void add_groups(const PathFeatures& features, Macros& macros) {
  if (features.light_groups > 0) macros.emplace_back(groups_macro);
}

// Adds the macros that the holdouts, motion and light groups of a picture need.
void add_march(const PathFeatures& features, Macros& macros) {
  // To limit the number of variants, those for motion include holdouts.
  if (features.volume_holdout || features.motion) macros.emplace_back(holdout_macro);
  add_groups(features, macros);
}

void add_medium(const PathFeatures& features, Macros& macros) {
  if (features.second_lobe) macros.emplace_back("CM_SECOND_LOBE 1");
  if (features.channels) macros.emplace_back(channels_macro);
}

gl::ProgramKey key(const char* name, Macros macros, std::span<const std::string> more) {
  macros.insert(macros.end(), more.begin(), more.end());
  return {name, std::move(macros)};
}

PathTriangles triangles_of(const PictureParameters& parameters, const TraceInputs& trace_inputs,
                           const PictureSettings& settings) {
  // To appear at once, the volume of a preview is lit only by sun and sky, as its surfaces are. If there is no such
  // light, the scene lights it.
  const glm::vec3 distant = parameters.lights.sun_irradiance + parameters.lights.sky_radiance;
  const bool preview = settings.layered == Layered::beneath && distant != glm::vec3(0.0F);
  const ModelInstances* models = settings.view == View::shaded && !preview ? trace_inputs.traced_models() : nullptr;
  if (models == nullptr) return PathTriangles::none;
  const bool emitting = models->lights().triangles > 0 || models->tables().extended_bsdf != 0U;
  return emitting || settings.light_groups > 0 ? PathTriangles::emitting : PathTriangles::hit;
}

}  // namespace

PathFeatures path_features(const PictureParameters& parameters, const TraceInputs& trace_inputs,
                           const PictureSettings& settings) {
  const bool shaded = settings.view == View::shaded;
  const core::CmMedium& medium = parameters.medium;
  PathFeatures features;
  features.view = settings.view;
  features.layered = shaded && trace_inputs.raster != nullptr ? settings.layered : Layered::no;
  features.triangles = triangles_of(parameters, trace_inputs, settings);
  features.light_groups = shaded ? settings.light_groups : 0;
  features.second_lobe = medium.second_weight > 0.0F;
  features.channels = medium.emits != 0U || medium.colored != 0U || medium.anisotropic != 0U;
  features.environment = trace_inputs.environment != nullptr;
  features.analytic_lights = trace_inputs.analytic_light_count() > 0;
  features.several = trace_inputs.instances != nullptr;
  features.extended_bsdf = features.has_stages() && trace_inputs.traced_models()->tables().extended_bsdf != 0U;
  features.volume_holdout = shaded && trace_inputs.volume_holdout;
  features.model_holdout = shaded && features.has_stages() && trace_inputs.model_holdout;
  features.motion = shaded && parameters.shutter.lasts != 0U;
  features.separate_volume_aov = shaded && settings.separate_volume_aov;
  // Equiangular sampling is off in these cases. The separate volume AOV depends on the first hit of a path, but such
  // light may lie before a surface. The color of a surface layer is stored in the same field as the light of such an
  // NEE sample. A holdout has no light.
  features.equiangular = features.analytic_lights && parameters.equiangular && !features.separate_volume_aov &&
                         !features.extended_bsdf && !features.volume_holdout && !features.model_holdout &&
                         (features.has_stages() || features.layered == Layered::no);
  return features;
}

gl::ProgramKey trace_key(const PathFeatures& features, const MarchData& data) {
  Macros more;
  if (features.has_stages()) {
    more.emplace_back(surfaces_macro_of(features.triangles));
    add_medium(features, more);
    if (features.environment) more.emplace_back(environment_macro);
    if (features.equiangular) more.emplace_back(equiangular_macro);
    add_march(features, more);
    return key("trace_travel.comp", data.defines(features.several, features.motion), more);
  }
  // To limit the number of variants, those for light groups include layers and lights even if there are none.
  const bool groups = features.light_groups > 0;
  if (features.layered != Layered::no || (groups && !features.equiangular)) more.emplace_back("CM_LAYERS 1");
  if (features.separate_volume_aov) more.emplace_back("CM_AOVS 1");
  add_medium(features, more);
  if (features.environment) more.emplace_back(environment_macro);
  if (features.analytic_lights || groups) more.emplace_back("CM_ANALYTIC_LIGHTS 1");
  if (features.equiangular) more.emplace_back(equiangular_macro);
  add_march(features, more);
  return key("trace.comp", data.defines(features.several, features.motion), more);
}

StageKeys stage_keys(const PathFeatures& features, const MarchData& data) {
  Macros shade{surfaces_macro_of(features.triangles)};
  if (features.channels) {
    shade.emplace_back(channels_macro);
    if (features.several) shade.emplace_back("CM_INSTANCES 1");
  }
  if (features.environment) shade.emplace_back(environment_macro);
  if (features.equiangular) shade.emplace_back(equiangular_macro);
  if (features.model_holdout) shade.emplace_back(holdout_macro);
  Macros intersect{surfaces_macro};
  if (features.extended_bsdf) {
    shade.emplace_back(extended_bsdf_macro);
    intersect.emplace_back(extended_bsdf_macro);
  }
  Macros camera{surfaces_macro, "CM_DENSE 0"};
  if (features.motion) {
    for (Macros* macros : {&shade, &intersect, &camera}) macros->emplace_back("CM_MOTION 1");
  }
  if (features.separate_volume_aov) camera.emplace_back("CM_AOVS 1");
  if (features.environment) camera.emplace_back(environment_macro);
  for (Macros* macros : {&shade, &intersect, &camera}) add_groups(features, *macros);
  Macros begin = camera;
  begin[1] = "CM_DENSE 1";
  return {{"trace_camera.comp", begin},
          trace_key(features, data),
          {"trace_intersect.comp", intersect},
          {"trace_shade.comp", shade},
          {"trace_camera.comp", camera}};
}

gl::ProgramKey noise_key() { return {"noise.comp", {}}; }

gl::ProgramKey inspect_key(const MarchData& data, const TraceInputs& trace_inputs) {
  Macros more;
  if (trace_inputs.scene != nullptr) more.emplace_back(surfaces_macro);
  return key("inspect.comp", data.defines(trace_inputs.instances != nullptr), more);
}

gl::ProgramKey feature_buffers_key(const MarchData& data, const TraceInputs& trace_inputs, FeatureSet set, bool emits) {
  Macros more;
  if (trace_inputs.scene != nullptr) more.emplace_back(surfaces_macro);
  if (set == FeatureSet::all || emits) more.emplace_back(channels_macro);
  if (set == FeatureSet::all) more.emplace_back("CM_VELOCITY 1");
  return key("aovs.comp", data.defines(trace_inputs.instances != nullptr), more);
}

gl::ProgramKey mattes_key(const MarchData& data, const TraceInputs& trace_inputs, bool motion) {
  Macros more;
  if (trace_inputs.scene != nullptr) more.emplace_back(surfaces_macro);
  const bool several = trace_inputs.instances != nullptr;
  return key("cryptomatte.comp", data.defines(several, several && motion), more);
}

}  // namespace cumulet::render
