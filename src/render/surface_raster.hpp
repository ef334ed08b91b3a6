#pragma once

#include <array>
#include <glm/glm.hpp>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "gl/programs.hpp"
#include "light/environment.hpp"
#include "render/upload.hpp"
#include "scene/raster_source.hpp"
#include "scene/snapshot.hpp"
#include "surface/scene.hpp"

namespace cumulet::render {

using SurfaceView = scene::Viewpoint;

/// Beside the lights of the pose. Of a disc and a rectangle all light comes from the middle.
struct SurfaceLighting {
  glm::vec3 sun_direction{0.0F, 1.0F, 0.0F};  ///< unit, towards the sun
  glm::vec3 sun_irradiance{0.0F};             ///< on a plane that faces it
  glm::vec3 sky_radiance{0.0F};               ///< the mean over all directions
  light::Harmonics sky{};                     ///< what there is beyond it, before it is turned
  light::GlossPtr gloss;                      ///< likewise, as glossy lobes see it; null: nothing
  float gloss_strength = 1.0F;                ///< times that
  glm::vec2 sky_turn{1.0F, 0.0F};             ///< as light::turn_of() has it
  light::Lamps lamps;
  bool operator==(const SurfaceLighting&) const = default;
};

/// What the surface pass has drawn: linear colour and view depth, a layer a sub-pixel place.
struct SurfaceLayers {
  gl::Object colour;  ///< GL_TEXTURE_2D_ARRAY, rgba16f, row 0 the picture's top: radiance times coverage, coverage
  gl::Object z;       ///< GL_TEXTURE_2D_ARRAY, r32f: view depth of the nearest surface, infinity without, as HostDepth
  glm::uvec2 size{0U};
  unsigned layers = 0;   ///< of the opaque surfaces (coverage 0 or 1)
  bool blended = false;  ///< as many follow, of the BLEND surfaces in front of those: one over the other, nearest z
  [[nodiscard]] std::uint64_t bytes() const { return std::uint64_t{size.x} * size.y * layers * (blended ? 24U : 12U); }
};

/// Where in its pixel a layer is sampled: x to the right, y down the picture, from the pixel's corner, both in (0, 1).
/// Of `layers` (1 to 8) layers each column and each row of layers x layers cells has one (n rooks). See
/// glsl/jitter.glsl.
glm::vec2 surface_jitter(unsigned layer, unsigned layers);

/// A scene in a pose, as the surface pass draws it in one context.
class RasterContent {
 public:
  struct Input {
    std::shared_ptr<const scene::RasterSource> scene;
    std::shared_ptr<const surface::Pose> pose;  ///< of that scene
    std::shared_ptr<const std::vector<glm::vec3>> centres;
  };
  /// Plans how this comes to GL: it is whole when all steps are done, and they may not outlive it. What does not move
  /// is shared with `last` (may be null) where the scene is the same. Throws Error(unsupported) for an image that is
  /// larger than the driver's textures, Error(internal) for a pose of another scene.
  static std::shared_ptr<const RasterContent> plan(const gl::FunctionsPtr& gl, const gl::ProgramsPtr& programs,
                                                   const gl::Limits& limits, Upload& upload, Input input,
                                                   const RasterContent* last);

  /// Whether the scene has BLEND triangles, which have layers of their own.
  [[nodiscard]] bool blends() const { return !scene().blended.empty(); }
  /// GL memory.
  [[nodiscard]] std::uint64_t bytes() const { return fixed_->shared->bytes + fixed_->bytes + posed_bytes_; }
  [[nodiscard]] const surface::Pose& pose() const { return *pose_; }
  [[nodiscard]] bool is_of(const surface::Scene& other) const { return scene().scene.get() == &other; }

 private:
  friend class SurfaceRaster;
  /// What poses of a scene share.
  struct Shared {
    std::shared_ptr<const scene::RasterPictures> source;
    gl::Object attributes;
    gl::Object indices;
    std::vector<gl::Object> textures;
    std::vector<gl::Object> samplers;
    std::uint64_t bytes = 0;
  };
  /// What poses share that differ in vertices alone.
  struct Fixed {
    std::shared_ptr<const scene::RasterSource> source;
    std::shared_ptr<Shared> shared;
    gl::Object material_block;
    std::vector<const gl::Program*> program_of;  // a material
    std::uint64_t bytes = 0;
  };
  class Planner;

  [[nodiscard]] const scene::RasterSource& scene() const { return *fixed_->source; }
  [[nodiscard]] bool drawable() const { return static_cast<bool>(posed_); }

  std::shared_ptr<Fixed> fixed_;
  std::shared_ptr<const surface::Pose> pose_;
  std::shared_ptr<const std::vector<glm::vec3>> centres_;
  gl::Object posed_;  // vertices; none where there is no triangle
  std::uint64_t posed_bytes_ = 0;
};

using RasterContentPtr = std::shared_ptr<const RasterContent>;
using RasterContents = std::vector<RasterContentPtr>;

/// One that stands somewhere.
struct RasterItem {
  RasterContentPtr content;  ///< not null, and whole
  glm::dmat4 to_world{1.0};  ///< affine
  bool shadow_only = false;  ///< of it only lamps count
};

/// Draws glTF scenes into layers; the mean of BLEND layers over the others is the anti-aliased picture.
///
/// Materials are metallic-roughness with KHR_materials_ior, _specular, _clearcoat, _emissive_strength and _unlit, as
/// glsl/bsdf.glsl has them, normal and occlusion maps (occlusion dims the sky alone) and vertex colours. Nothing casts
/// a shadow. Where a normal map's vertices have no tangent, screen-space derivatives serve.
///
/// BLEND triangles are drawn into layers of their own, tested against the others' z, from the back to the front by the
/// view depth of their centres, those of all draws together. That is right for triangles that neither intersect nor
/// overlap in depth; ties keep the file's order. Their z is the nearest's. KHR_materials_transmission is approximated
/// as BLEND of one colour's coverage: thin, not refracted, a volume tinted as by its material's own thickness. Lobes of
/// KHR_materials_anisotropy are round, of the mean width; sheen, films and dispersion are left out.
///
/// Needs the context current and a StateGuard around; leaves any state that the guard puts back. GL 4.5 core.
class SurfaceRaster {
 public:
  explicit SurfaceRaster(gl::FunctionsPtr gl) : gl_(std::move(gl)) {}

  /// From now on draws these. O(placings).
  void show(std::vector<RasterItem> items);
  /// Renders layers 1 to 8 of size > 0, into textures that are made anew where they do not fit. Where it shows
  /// nothing they are empty. Throws Error(out_of_memory), the layers then gone or of an undefined content, and
  /// Error(internal) for a view that spans no space. O(layers (triangles + pixels)).
  void draw(const SurfaceView& view, const SurfaceLighting& lighting, glm::uvec2 size, unsigned layers,
            SurfaceLayers& into);

  /// GL memory that it holds itself, beside its content and the layers.
  [[nodiscard]] std::uint64_t bytes() const;
  /// Another with every show(): what is drawn of one and the same looks the same.
  [[nodiscard]] const std::shared_ptr<const void>& content() const { return shown_; }
  /// Whether what it shows has BLEND triangles, which have layers of their own.
  [[nodiscard]] bool blends() const;

 private:
  using Batch = scene::RasterSource::Batch;
  // Of places_: those that mirror come last.
  struct Places {
    std::uint32_t first = 0;
    std::uint32_t upright = 0;
    std::uint32_t mirrored = 0;
  };
  // A content that is drawn, and where: the draws that are posed as they stand, then each prototype's.
  struct Shown {
    RasterContentPtr content;
    std::vector<Places> sets;
    [[nodiscard]] const Places& places_of(std::uint32_t draw) const;
  };
  // A blended triangle, or several of one draw at one place.
  struct Blended {
    std::uint32_t shown = 0;
    std::uint32_t place = 0;
    Batch batch;  // of the sorted indices
  };

  void sort_blended(const SurfaceView& view);
  void make_targets(glm::uvec2 size, unsigned layers, SurfaceLayers& into);
  void make_fixtures();
  void upload_gloss(const light::GlossPtr& gloss);
  void upload_view(const SurfaceView& view, const SurfaceLighting& lighting);
  struct PlaceRecord;
  void upload_places(const SurfaceView& view);
  // Makes it anew where it is too small.
  void fill(gl::Object& buffer, std::size_t& size, const void* from, std::size_t bytes, const char* what) const;
  void add_places(Shown& shown, std::vector<glm::dmat4> places);
  // Batches of a content, each at all of its places, or at one.
  class Pen;

  gl::FunctionsPtr gl_;
  std::vector<RasterItem> items_;
  std::vector<Shown> drawn_;
  std::vector<glm::dmat4> places_;
  std::shared_ptr<const void> shown_;
  std::vector<Blended> sorted_;
  std::optional<SurfaceView> sorted_view_;

  gl::Object white_;
  gl::Object albedo_table_;
  gl::Object table_sampler_;
  gl::Object gloss_;
  light::GlossPtr uploaded_gloss_;  // null: of no content
  gl::Object gloss_sampler_;
  gl::Object view_block_;
  gl::Object light_buffer_;
  std::size_t light_bytes_ = 0;
  gl::Object place_buffer_;
  std::size_t place_bytes_ = 0;
  gl::Object sorted_indices_;  // of blended triangles
  std::size_t sorted_bytes_ = 0;

  gl::Object depth_test_;
  glm::uvec2 depth_test_size_{0U};
};

}  // namespace cumulet::render
