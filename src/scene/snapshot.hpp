#pragma once

#include <algorithm>
#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <optional>
#include <vector>

#include "light/distant_lights.hpp"
#include "light/environment.hpp"
#include "light/lamps.hpp"
#include "scene/march_source.hpp"
#include "scene/model_source.hpp"
#include "scene/part.hpp"
#include "scene/phase.hpp"
#include "scene/place.hpp"

namespace cumulet::scene {

/// What a volume is of.
struct Medium {
  double density_scale = 1.0;  ///< extinction a unit of the grid's value
  glm::vec3 albedo{1.0F};
  Phase phase;
  glm::vec3 emission{0.0F};
  std::uint32_t group = 0;  ///< of lights, of what it gives off
  bool holdout = false;     ///< cameras see a hole
  bool operator==(const Medium&) const = default;
};

/// What one picture is seen through, all in world space (in a snapshot, from its origin). A ray through (x, y), both -1
/// to 1, y up: perspective: from eye along forward + x right + y up; orthographic: from eye + x right + y up along
/// forward. forward has length 1 along the view axis (off-axis projections add a share of right and up to it), so that
/// the ray's parameter is the distance z from the eye's plane.
struct Viewpoint {
  glm::dvec3 eye{0.0};  // orthographic: in the near plane, from which z counts
  glm::dvec3 forward{0.0, 0.0, -1.0};
  glm::dvec3 right{1.0, 0.0, 0.0};  // scaled by half the picture's width at z = 1 (orthographic: half its width)
  glm::dvec3 up{0.0, 1.0, 0.0};     // likewise
  bool orthographic = false;
  double lens_radius = 0.0;  // 0: a pinhole, all is sharp
  double focus = 1.0;        // z of what is sharp with a lens
  bool operator==(const Viewpoint&) const = default;
};

/// What a picture is seen through as the shutter opens, and as it closes: both of one projection.
struct ViewEnds {
  Viewpoint open;
  Viewpoint close;
  bool operator==(const ViewEnds&) const = default;
};

/// A level plane that scatters evenly, met from above.
struct Ground {
  double height = 0.0;
  glm::vec3 albedo{0.0F};
  double reach = 0.0;  ///< of rays that may meet it; beyond, nobody sees whether they do
  bool operator==(const Ground&) const = default;
};

/// Which of a sequence's frames, or of a live volume's states, a source is.
struct SequenceFrame {
  std::uint64_t number = 0;
  std::uint64_t sequence = 0;  ///< another each time that one is set
  std::uint64_t taken = 0;     ///< another for each source
  double part = 0.0;           ///< of the way to the next frame
  bool operator==(const SequenceFrame&) const = default;
};

/// All that a picture is of, each once.
using SequenceFrames = std::vector<SequenceFrame>;
[[nodiscard]] inline bool holds(const SequenceFrames& frames, const SequenceFrame& frame) {
  return std::ranges::find(frames, frame) != frames.end();
}

/// A lattice in the world that its source has, which stands at its place. Units of length are those of the scene,
/// whatever a place stretches: extinction and emission are a unit there.
struct Volume {
  std::uint64_t id = 0;   ///< of those that change together: places of one volume share theirs
  MarchSourcePtr source;  ///< not null; all are of one march
  Part<Medium> medium;
  Place place;
  std::optional<SequenceFrame> frame = {};  ///< where it is a sequence's or a live volume's
  std::optional<Place> previous = {};       ///< where it stood a frame ago; none: there as well
  bool operator==(const Volume&) const = default;
};

/// Surfaces in a pose, and where they stand.
struct Model {
  std::uint64_t id = 0;                     ///< of what stays the same model, whatever it is of
  ModelSourcePtr source;                    ///< not null
  glm::dmat4 to_world{1.0};                 ///< affine, from the world that it was posed in
  bool shadow_only = false;                 ///< no camera ray meets it; others do
  std::uint32_t group = 0;                  ///< of lights, that it is in
  std::optional<glm::dmat4> previous = {};  ///< where it stood a frame ago; none: there as well
  ModelSourcePtr previous_source = {};      ///< and how it was posed; null: likewise
  bool holdout = false;                     ///< cameras see a hole
  std::optional<PlaceEnds> ends = {};       ///< nothing: it stands still
  bool operator==(const Model&) const = default;
};

/// A frame ago, for what tells of motion.
struct Previous {
  std::optional<Viewpoint> view;  ///< none: as now
  double seconds = 0.0;           ///< since then
  bool operator==(const Previous&) const = default;
};

/// All that a picture can show, as it is at one moment. Sources are values that never change: another one is another
/// pointer. What changes in place is parts.
struct Snapshot {
  glm::dvec3 origin{0.0};  ///< world; all places here count from it: scene/origin.hpp
  std::vector<Volume> volumes;
  std::vector<Model> models;  ///< likewise
  Part<light::DistantLights> lights;
  Part<light::Surroundings> surroundings;
  Part<light::Lamps> lamps;  ///< the host's; models have their own beside them
  Part<std::optional<Ground>> ground;
  Part<std::optional<Viewpoint>> view;      ///< none: nothing is to be seen
  Part<std::optional<ViewEnds>> view_ends;  ///< none: it stands still
  Part<Previous> previous;
  /// O(volumes + models).
  bool operator==(const Snapshot&) const = default;
};
using SnapshotPtr = std::shared_ptr<const Snapshot>;

}  // namespace cumulet::scene
