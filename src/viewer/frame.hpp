#pragma once

#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <optional>
#include <string>

#include "gl/api.hpp"
#include "render/film/feature_buffers.hpp"
#include "render/passes/display.hpp"
#include "render/raster/host_depth.hpp"
#include "scene/snapshot.hpp"

namespace cumulet::viewer {

enum class Target { framebuffer = 0, texture = 1, none = 2 };

/// cumulet_frame_desc, checked.
struct Frame {
  double budget_ms = 10.0;  // negative: trace nothing
  Target target = Target::framebuffer;
  GLuint framebuffer = 0;
  glm::uvec2 size{0U};
  glm::ivec4 viewport{0};  // not zero if `size` is not
  bool flip_y = false;
  GLenum format = GL_RGBA8;
  render::ColorEncoding encoding = render::ColorEncoding::srgb;
  bool blend_over = true;
  bool write_depth = false;
  render::DepthSource depth_source = render::DepthSource::none;
  GLuint depth_name = 0;
  bool depth_flip_y = false;
  bool depth_unchanged = false;
};

struct FrameResult {
  bool more = false;
  bool converged = false;
  bool loading = false;
  bool failed = false;
  bool preview = false;
  bool undrawn = false;
  bool denoised = false;
  double progress = 0.0;
  glm::uvec2 size{0U};
  GLuint texture = 0;
  GLuint depth_texture = 0;
};

/// The frames of sequences and states of dynamic volumes in a context, as known outside of calls that use it.
struct FramesInContext {
  scene::SequenceFrames shown;
  scene::SequenceFrames uploaded;
  bool picture_pending = false;  ///< an image of the uploaded ones will be shown
  bool uploading = false;
  bool in_work = false;  ///< a call that will change this is running
  /// Returns true if this frame, which was uploaded last or is being uploaded, has not been displayed yet and will be.
  [[nodiscard]] bool is_pending(const scene::SequenceFrame& frame) const {
    if (scene::holds(shown, frame)) return false;
    return in_work || (scene::holds(uploaded, frame) ? picture_pending : uploading);
  }
};

/// Progress of cumulet_warm_up.
struct WarmUp {
  bool more = false;
  double progress = 0.0;
};

struct Pick {
  bool hit = false;
  glm::dvec3 position{0.0};
  double distance = 0.0;
  std::optional<std::uint32_t> transform_index;  // if a volume was hit: index of its instance transform
  std::uint64_t volume = 0;                      // its scene::Volume::id
  std::uint64_t model = 0;                       // if a surface was hit: its scene::Model::id
  std::uint64_t tag = 0;                         // tag of the instance or model
  struct Surface {
    glm::dvec3 normal{0.0};  // unit, towards the ray's origin
    std::uint32_t material = 0;
    std::string material_name;
  };
  std::optional<Surface> surface;  // if a surface was hit
};

/// cumulet_map_light.
enum class MapLight { sun = 0, direction = 1, point = 2 };

/// cumulet_transmittance_map_desc, checked.
struct MapRequest {
  std::uint32_t slot = 0;
  MapLight light = MapLight::sun;
  glm::dvec3 towards{0.0};   // for a direction, not zero
  glm::dvec3 position{0.0};  // for a point
  std::uint32_t size = 256;
  std::uint32_t slices = 32;
  double budget_ms = 2.0;
};

/// Result of cumulet_update_transmittance_map.
struct MapResult {
  GLuint texture = 0;
  std::uint32_t size = 0;
  std::uint32_t slices = 0;
  bool more = false;
  glm::dmat4 to_map{1.0};
  glm::dvec2 range{0.0};
};

/// An object with an ID matte: cumulet_object_kind and the other arguments of a cumulet_object_name_fn.
struct MatteObject {
  enum class Kind { volume = 0, surfaces = 1, ground = 2 };
  Kind kind = Kind::volume;
  std::uint64_t id = 0;  // of the viewer's instances and models; its own objects have 0
  std::uint32_t transform_index = 0;
  std::uint64_t tag = 0;  // set by the host
};
/// Returns the object's matte ID; 0: it is in no matte.
using MatteIdOf = std::function<std::uint32_t(const MatteObject&)>;

using render::Aov;

/// cumulet_read_desc, checked.
struct ReadRequest {
  enum class Source { linear = 0, aov = 1, light_group = 2 };
  Source source = Source::linear;
  Aov aov = Aov::beauty;
  std::uint32_t light_group = 0;
};

/// State of a read that was begun.
struct ReadState {
  bool ready = false;
  glm::uvec2 size{0U};
  std::uint32_t channels = 0;
};

}  // namespace cumulet::viewer
