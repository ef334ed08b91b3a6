#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "gl/programs.hpp"
#include "render/film/feature_buffers.hpp"
#include "render/film/picture_settings.hpp"
#include "scene/march_source.hpp"

namespace cumulet::render {

class MarchData;
struct PictureParameters;
struct TraceInputs;

/// How paths treat triangles.
enum class PathTriangles {
  none,     // paths hit no triangles
  hit,      // paths hit triangles
  emitting  // NEE samples emissive triangles as well
};

/// The properties of volume data that decide which programs traverse it.
struct GridFeatures {
  scene::March march = scene::March::tet;
  bool linear = false;     // density varies in cells: linear in tetrahedra, trilinear between voxels; else constant
  std::size_t pages = 1;   // of cell records, as the programs have them: one, two or MarchData::max_pages
  bool wide = false;       // cells have the wide format
  bool several = false;    // several volumes
  bool trilinear = false;  // density is trilinear in the finest tetrahedra
  bool clipped = false;    // several: some are clipped
};

/// several: the volumes have an instance table (InstanceData). clipped: some of them are clipped.
GridFeatures grid_features(const MarchData& data, bool several, bool clipped = false);
/// Returns the macros that select this grid type in a shader. motion: something moves while the shutter is open.
std::vector<std::string> grid_macros(const GridFeatures& grid, bool motion = false);

/// The properties of a picture that decide which programs trace it.
struct PathFeatures {
  GridFeatures grid;
  View view = View::shaded;
  Layered layered = Layered::no;
  PathTriangles triangles = PathTriangles::none;
  std::uint32_t light_groups = 0;
  bool second_lobe = false;         // the medium's phase function has two lobes
  bool channels = false;            // cells carry more than density
  bool environment = false;         // paths that escape hit an environment
  bool analytic_lights = false;     // there are lights to sample
  bool equiangular = false;         // NEE samples lights from points on the ray, too
  std::uint32_t extended_bsdf = 0;  // CM_EXTENDED_BSDF of the materials
  bool clear_surfaces = false;      // rays may pass straight on through some triangles
  bool volume_holdout = false;
  bool model_holdout = false;
  bool motion = false;  // something moves while the shutter is open
  bool separate_volume_aov = false;
  // In pictures with previews these do not depend on the scene, so that changes of it need no other program.
  bool ground_or_disk = true;  // there is a ground, or the sun is a disk
  bool shadow_catcher = true;  // the ground may be a shadow catcher
  bool anisotropic = true;     // the phase function has more than one value

  /// True if paths run in wavefront stages; else in one kernel.
  [[nodiscard]] bool has_stages() const { return triangles != PathTriangles::none; }
};

/// Returns the features of a picture with these settings.
PathFeatures path_features(const MarchData& data, const PictureParameters& parameters, const TraceInputs& trace_inputs,
                           const PictureSettings& settings);

/// Programs of the wavefront stages, as StagePrograms.
struct StageKeys {
  gl::ProgramKey begin;
  gl::ProgramKey travel;
  gl::ProgramKey intersect;
  gl::ProgramKey shade;
  gl::ProgramKey camera;
};

/// Returns the megakernel, or the wavefront stage whose cost estimate covers all stages.
gl::ProgramKey trace_key(const PathFeatures& features);
StageKeys stage_keys(const PathFeatures& features);
/// Returns the kernel that measures the error of a tile whose samples are done.
gl::ProgramKey noise_key();
/// Returns inspect.comp: depth, picks and debug views.
gl::ProgramKey inspect_key(const MarchData& data, const TraceInputs& trace_inputs);
/// Returns aovs.comp. emits: the medium emits light.
gl::ProgramKey feature_buffers_key(const MarchData& data, const TraceInputs& trace_inputs, FeatureSet set, bool emits);
/// Returns cryptomatte.comp. motion: something moves while the shutter is open.
gl::ProgramKey mattes_key(const MarchData& data, const TraceInputs& trace_inputs, bool motion);
/// Returns transmittance.comp.
gl::ProgramKey transmittance_key(const MarchData& data, const TraceInputs& trace_inputs);

}  // namespace cumulet::render
