#pragma once

#include <array>
#include <glm/glm.hpp>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "gl/programs.hpp"
#include "light/environment.hpp"
#include "render/pacing/upload.hpp"
#include "scene/raster_source.hpp"
#include "scene/snapshot.hpp"
#include "surface/scene.hpp"

namespace cumulet::render {

using SurfaceView = scene::Viewpoint;

/// Lights of the surface pass in addition to those of the pose. Disk and rectangle lights emit from their center.
struct SurfaceLighting {
  glm::vec3 sun_direction{0.0F, 1.0F, 0.0F};  ///< unit, towards the sun
  glm::vec3 sun_irradiance{0.0F};             ///< on a plane that faces it
  glm::vec3 sky_radiance{0.0F};               ///< the mean over all directions
  light::Harmonics sky{};                     ///< difference to the mean, before rotation
  light::PrefilteredEnvironmentPtr
      prefiltered;                    ///< environment prefiltered for glossy reflection, before rotation; null: none
  float prefiltered_strength = 1.0F;  ///< factor on its radiance
  glm::vec2 sky_turn{1.0F, 0.0F};     ///< rotation, as light::turn_of()
  light::AnalyticLights analytic_lights;
  bool operator==(const SurfaceLighting&) const = default;
};

/// Result of the surface pass: linear color and view depth, one layer per sub-pixel position.
struct SurfaceLayers {
  gl::Object color;  ///< GL_TEXTURE_2D_ARRAY, rgba16f, row 0 the picture's top: radiance times coverage, coverage
  gl::Object z;      ///< GL_TEXTURE_2D_ARRAY, r32f: view depth of the nearest surface, infinity without, as HostDepth
  glm::uvec2 size{0U};
  unsigned layers = 0;  ///< of the opaque surfaces (coverage 0 or 1)
  /// as many layers follow for BLEND surfaces in front of the opaque ones: blended color, nearest z
  bool blended = false;
  [[nodiscard]] std::uint64_t bytes() const { return std::uint64_t{size.x} * size.y * layers * (blended ? 24U : 12U); }
};

/// Returns the sample position of a layer, relative to the pixel's corner: x to the right, y down the picture, both in
/// (0, 1). `layers` (1 to 8) positions form an n-rooks pattern: each column and each row of layers x layers cells has
/// one. See glsl/surface/jitter.glsl.
glm::vec2 surface_jitter(unsigned layer, unsigned layers);

/// A scene in a pose, uploaded for the surface pass of one context.
class RasterContent {
 public:
  struct Input {
    std::shared_ptr<const scene::RasterSource> scene;
    std::shared_ptr<const surface::Pose> pose;  ///< of that scene
    std::shared_ptr<const std::vector<glm::vec3>> centres;
  };
  /// Plans the upload steps. The content is complete when all steps are done; the steps must not outlive it. Data that
  /// do not move are shared with `last` (may be null) if the scene is the same. Throws Error(unsupported) if an image
  /// is larger than the driver's textures or there are too many lights, Error(internal) for a pose of another scene.
  static std::shared_ptr<const RasterContent> plan(const gl::FunctionsPtr& gl, const gl::ProgramsPtr& programs,
                                                   const gl::Limits& limits, Upload& upload, Input input,
                                                   const RasterContent* last);

  /// True if the scene has BLEND triangles, which have layers of their own.
  [[nodiscard]] bool blends() const { return !scene().blended.empty(); }
  /// GL memory.
  [[nodiscard]] std::uint64_t bytes() const { return fixed_->shared->bytes + fixed_->bytes + posed_bytes_; }
  [[nodiscard]] const surface::Pose& pose() const { return *pose_; }
  [[nodiscard]] bool is_of(const surface::Scene& other) const { return scene().scene.get() == &other; }

 private:
  friend class SurfaceRaster;
  /// Data that poses of a scene share.
  struct Shared {
    std::shared_ptr<const scene::RasterPictures> source;
    gl::Object attributes;
    gl::Object indices;
    std::vector<gl::Object> textures;
    std::vector<gl::Object> samplers;
    std::uint64_t bytes = 0;
  };
  /// Data shared by poses that differ only in vertices.
  struct Fixed {
    std::shared_ptr<const scene::RasterSource> source;
    std::shared_ptr<Shared> shared;
    gl::Object material_block;
    std::vector<const gl::Program*> program_of;  // per material
    std::uint64_t bytes = 0;
  };
  class Planner;

  [[nodiscard]] const scene::RasterSource& scene() const { return *fixed_->source; }
  [[nodiscard]] bool drawable() const { return static_cast<bool>(posed_); }

  std::shared_ptr<Fixed> fixed_;
  std::shared_ptr<const surface::Pose> pose_;
  std::shared_ptr<const std::vector<glm::vec3>> centres_;
  gl::Object posed_;  // vertices; none if there are no triangles
  std::uint64_t posed_bytes_ = 0;
};

using RasterContentPtr = std::shared_ptr<const RasterContent>;
using RasterContents = std::vector<RasterContentPtr>;

/// A content with its instance transform.
struct RasterItem {
  RasterContentPtr content;  ///< not null, and complete
  glm::dmat4 to_world{1.0};  ///< affine
  bool shadow_only = false;  ///< only its lights count
};

/// Rasterizes glTF scenes into layers. The anti-aliased picture is the mean of the opaque layers with the BLEND layers
/// composited over them.
///
/// Materials are metallic-roughness with KHR_materials_ior, _specular, _clearcoat, _emissive_strength and _unlit, as in
/// glsl/surface/bsdf.glsl. Normal maps, occlusion maps (which dim only the sky) and vertex colors are supported. There
/// are no shadows. If the vertices of a normal map have no tangents, screen-space derivatives are used.
///
/// BLEND triangles are drawn into layers of their own, tested against the opaque z. They are sorted back to front by
/// the view depth of their centers, over all draws. The order is correct for triangles that neither intersect nor
/// overlap in depth; ties keep the file's order. Their z is the nearest's. KHR_materials_transmission is approximated
/// as BLEND of one color's coverage: thin, not refracted, with a volume tinted by its material's own thickness.
/// KHR_materials_anisotropy is approximated by round lobes of the mean width; sheen, iridescence and dispersion are
/// left out.
///
/// Needs a current context and an active StateGuard; leaves any state that the guard restores. GL 4.5 core.
class SurfaceRaster {
 public:
  explicit SurfaceRaster(gl::FunctionsPtr gl) : gl_(std::move(gl)) {}

  /// Sets the items to draw. O(instances).
  void show(std::vector<RasterItem> items);
  /// Renders 1 to 8 layers of a size > 0, into textures that are reallocated if they do not fit. Without drawable items
  /// the layers are empty. Throws Error(out_of_memory), with the layers then freed or undefined, and Error(internal)
  /// for a degenerate view. O(layers (triangles + pixels)).
  void draw(const SurfaceView& view, const SurfaceLighting& lighting, glm::uvec2 size, unsigned layers,
            SurfaceLayers& into);

  /// GL memory of this object, without contents and layers.
  [[nodiscard]] std::uint64_t bytes() const;
  /// Identity that changes with every show(): equal ones look the same.
  [[nodiscard]] const std::shared_ptr<const void>& content() const { return shown_; }
  /// True if a drawn scene has BLEND triangles, which have layers of their own.
  [[nodiscard]] bool blends() const;

 private:
  using Batch = scene::RasterSource::Batch;
  // A range of transforms_: upright transforms, then mirroring ones.
  struct TransformRange {
    std::uint32_t first = 0;
    std::uint32_t upright = 0;
    std::uint32_t mirrored = 0;
  };
  // A drawn content with its instance transforms: one set for the draws that are not instanced, then one per prototype.
  struct Shown {
    RasterContentPtr content;
    std::vector<TransformRange> sets;
    [[nodiscard]] const TransformRange& transform_range(std::uint32_t draw) const;
  };
  // Blended triangles of one draw with one instance transform.
  struct Blended {
    std::uint32_t shown = 0;
    std::uint32_t transform = 0;
    Batch batch;  // a range of sorted_indices_
  };

  void sort_blended(const SurfaceView& view);
  void make_targets(glm::uvec2 size, unsigned layers, SurfaceLayers& into);
  void make_fixtures();
  void upload_prefiltered(const light::PrefilteredEnvironmentPtr& prefiltered);
  void upload_view(const SurfaceView& view, const SurfaceLighting& lighting);
  struct TransformRecord;
  void upload_transforms(const SurfaceView& view);
  // Uploads data to a buffer, which is reallocated if it is too small.
  void fill(gl::Object& buffer, std::size_t& size, const void* from, std::size_t bytes, const char* what) const;
  void add_transforms(Shown& shown, std::vector<glm::dmat4> transforms);
  // Uploads and binds the inputs of the draws, except the contents' own. Returns the vertex array.
  [[nodiscard]] gl::Object bind_inputs(const SurfaceView& view, const SurfaceLighting& lighting);
  // Draws batches of a content, with all of their instance transforms or with one.
  class Pen;

  gl::FunctionsPtr gl_;
  std::vector<RasterItem> items_;
  std::vector<Shown> drawn_;
  std::vector<glm::dmat4> transforms_;
  std::shared_ptr<const void> shown_;
  std::vector<Blended> sorted_;
  std::optional<SurfaceView> sorted_view_;

  gl::Object white_;
  gl::Object albedo_table_;
  gl::Object table_sampler_;
  gl::Object prefiltered_;
  light::PrefilteredEnvironmentPtr uploaded_prefiltered_;  // null: prefiltered_ has no content
  gl::Object prefiltered_sampler_;
  gl::Object view_block_;
  gl::Object light_buffer_;
  std::size_t light_bytes_ = 0;
  gl::Object transform_buffer_;
  std::size_t transform_bytes_ = 0;
  gl::Object sorted_indices_;  // of blended triangles
  std::size_t sorted_bytes_ = 0;

  gl::Object depth_test_;
  glm::uvec2 depth_test_size_{0U};
};

}  // namespace cumulet::render
