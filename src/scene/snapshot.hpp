#pragma once

#include <algorithm>
#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <optional>
#include <vector>

#include "light/analytic_lights.hpp"
#include "light/distant_lights.hpp"
#include "light/environment.hpp"
#include "scene/instance_transform.hpp"
#include "scene/march_source.hpp"
#include "scene/model_source.hpp"
#include "scene/part.hpp"
#include "scene/phase.hpp"

namespace cumulet::scene {

/// The scattering medium of a volume.
struct Medium {
  double density_scale = 1.0;  ///< extinction per unit of the grid's value
  glm::vec3 albedo{1.0F};
  Phase phase;
  glm::vec3 emission{0.0F};
  std::uint32_t group = 0;  ///< light group of its emission
  bool holdout = false;     ///< holdout: occludes and renders as transparent
  bool operator==(const Medium&) const = default;
};

/// A camera, in world space (in a snapshot, relative to its origin). For image coordinates (x, y), both -1 to 1, y up,
/// the ray is: perspective: from eye along forward + x right + y up; orthographic: from eye + x right + y up along
/// forward. forward has length 1 along the view axis, so that the ray parameter is the distance z from the eye's plane.
/// (Off-axis projections add multiples of right and up to it.)
struct Viewpoint {
  glm::dvec3 eye{0.0};  // orthographic: a point in the near plane, where z = 0
  glm::dvec3 forward{0.0, 0.0, -1.0};
  glm::dvec3 right{1.0, 0.0, 0.0};  // scaled by half the image width at z = 1 (orthographic: half its width)
  glm::dvec3 up{0.0, 1.0, 0.0};     // scaled like `right`, by the image height
  bool orthographic = false;
  double lens_radius = 0.0;  // 0: pinhole, everything is sharp
  double focus = 1.0;        // z of the focal plane with a lens
  bool operator==(const Viewpoint&) const = default;
};

/// Cameras at shutter open and close; both have the same kind of projection.
struct ViewEnds {
  Viewpoint open;
  Viewpoint close;
  bool operator==(const ViewEnds&) const = default;
};

/// Infinite horizontal ground plane, visible only from above.
struct Ground {
  double height = 0.0;
  glm::vec3 albedo{0.0F};
  double reach = 0.0;           ///< maximum ray length at which the ground is hit; farther hits are invisible
  bool shadow_catcher = false;  ///< its albedo is ignored
  bool operator==(const Ground&) const = default;
};

/// Identifies the frame of a sequence, or the update of a dynamic volume, that a source shows.
struct SequenceFrame {
  std::uint64_t number = 0;
  std::uint64_t sequence = 0;  ///< differs for each sequence that is set
  std::uint64_t taken = 0;     ///< differs for each source
  double part = 0.0;           ///< fraction of the way to the next frame
  bool operator==(const SequenceFrame&) const = default;
};

/// All frames that an image shows, each once.
using SequenceFrames = std::vector<SequenceFrame>;
[[nodiscard]] inline bool holds(const SequenceFrames& frames, const SequenceFrame& frame) {
  return std::ranges::find(frames, frame) != frames.end();
}

/// Planes that cut a volume, in the world space of its source: the part with dot(plane, (p, 1)) >= 0 for all of them is
/// shown. No normal is 0. Empty: all of it.
using ClipPlanes = std::vector<glm::dvec4>;

/// A volume instance: a source in its own world space, with a transform. Units of length are those of the scene,
/// independent of the scale of the transform: extinction and emission are per scene unit.
struct Volume {
  std::uint64_t id = 0;   ///< shared by instances of one volume, which change together
  MarchSourcePtr source;  ///< not null; all in a scene have the same grid type
  Part<Medium> medium;
  InstanceTransform transform;
  std::optional<SequenceFrame> frame = {};         ///< if it is of a sequence or a dynamic volume
  std::optional<InstanceTransform> previous = {};  ///< transform in the previous frame; empty: unchanged
  ClipPlanes clip = {};
  bool operator==(const Volume&) const = default;
};

/// A posed surface model and its transform.
struct Model {
  std::uint64_t id = 0;                        ///< identifies the model; unchanged if its source changes
  ModelSourcePtr source;                       ///< not null
  glm::dmat4 to_world{1.0};                    ///< affine, from the world space that it was posed in
  bool shadow_only = false;                    ///< camera rays do not hit it; other rays do
  std::uint32_t group = 0;                     ///< light group
  std::optional<glm::dmat4> previous = {};     ///< transform in the previous frame; empty: unchanged
  ModelSourcePtr previous_source = {};         ///< pose in the previous frame; null: unchanged
  bool holdout = false;                        ///< holdout: occludes and renders as transparent
  std::optional<ShutterTransforms> ends = {};  ///< empty: it does not move
  bool operator==(const Model&) const = default;
};

/// The previous frame, for motion vectors.
struct Previous {
  std::optional<Viewpoint> view;  ///< empty: unchanged
  double seconds = 0.0;           ///< time since the previous frame
  bool operator==(const Previous&) const = default;
};

/// Everything an image can show, at one moment. Sources are immutable: a change is a new pointer. Parts change in
/// place.
struct Snapshot {
  glm::dvec3 origin{0.0};  ///< world; all positions here are relative to it: scene/origin.hpp
  std::vector<Volume> volumes;
  std::vector<Model> models;  ///< positions relative to `origin`, too
  Part<light::DistantLights> lights;
  Part<light::Surroundings> surroundings;
  Part<light::AnalyticLights> analytic_lights;  ///< the host's lights; models have their own
  Part<std::optional<Ground>> ground;
  Part<std::optional<Viewpoint>> view;      ///< empty: nothing is rendered
  Part<std::optional<ViewEnds>> view_ends;  ///< empty: the camera does not move
  Part<Previous> previous;
  /// O(volumes + models).
  bool operator==(const Snapshot&) const = default;
};
using SnapshotPtr = std::shared_ptr<const Snapshot>;

}  // namespace cumulet::scene
