#pragma once

#include <array>
#include <glm/glm.hpp>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "gl/programs.hpp"
#include "scene/snapshot.hpp"
#include "surface/scene.hpp"

namespace cumulet::render {

using SurfaceView = scene::Viewpoint;

/// Beside the lights of the pose.
struct SurfaceLighting {
  glm::vec3 sun_direction{0.0F, 1.0F, 0.0F};  ///< unit, towards the sun
  glm::vec3 sun_irradiance{0.0F};             ///< on a plane that faces it
  glm::vec3 sky_radiance{0.0F};               ///< the same from everywhere
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

/// Draws a glTF scene into layers; the mean of BLEND layers over the others is the anti-aliased picture.
///
/// Materials are metallic-roughness with KHR_materials_ior, _specular, _clearcoat, _emissive_strength and _unlit, as
/// glsl/bsdf.glsl has them, normal and occlusion maps (occlusion dims the sky alone) and vertex colours. Nothing casts
/// a shadow. Where a normal map's vertices have no tangent, screen-space derivatives serve.
///
/// BLEND triangles are drawn into layers of their own, tested against the others' z, from the back to the front by the
/// view depth of their centres, those of all draws together. That is right for triangles that neither intersect nor
/// overlap in depth; ties keep the file's order. Their z is the nearest's. KHR_materials_transmission is approximated
/// as BLEND of one colour's coverage: thin, not refracted.
///
/// Needs the context current and a StateGuard around; leaves any state that the guard puts back. GL 4.5 core.
class SurfaceRaster {
 public:
  SurfaceRaster(gl::FunctionsPtr gl, gl::ProgramsPtr programs) : gl_(std::move(gl)), programs_(std::move(programs)) {}

  /// Uploads what does not move; null: no surfaces. The pose is gone then. Throws Error(out_of_memory), or
  /// Error(unsupported) for an image that is larger than the driver's textures, and keeps what was.
  void set_scene(surface::ScenePtr scene);
  /// Uploads what moves. The pose is of the scene. Throws Error(out_of_memory); Error(internal) for one that is not.
  void set_pose(const surface::Pose& pose);
  /// Renders layers 1 to 8 of size > 0, into textures that are made anew where they do not fit. Without scene or pose
  /// they are empty. Throws Error(out_of_memory), the layers then gone or of an undefined content, and Error(internal)
  /// for a view that spans no space. O(layers (triangles + pixels)).
  void draw(const SurfaceView& view, const SurfaceLighting& lighting, glm::uvec2 size, unsigned layers,
            SurfaceLayers& into);

  /// Another with every scene and every pose: what is drawn of one and the same looks the same.
  [[nodiscard]] const std::shared_ptr<const void>& content() const { return content_; }
  /// Whether the scene has BLEND triangles, which have layers of their own.
  [[nodiscard]] bool blends() const { return !assets_.blended.empty(); }
  /// GL memory of the scene, without layers.
  [[nodiscard]] std::uint64_t bytes() const { return assets_.bytes; }

 private:
  /// A range of indices with one state.
  struct Batch {
    std::uint32_t first = 0;
    std::uint32_t count = 0;
    std::uint32_t draw = 0;
  };
  /// One use of a texture: names are into Assets.
  struct Map {
    GLuint texture = 0;
    GLuint sampler = 0;
  };
  struct Material {
    std::array<Map, 10> maps{};
    surface::AlphaMode pass = surface::AlphaMode::opaque;
    bool double_sided = false;
    const gl::Program* program = nullptr;
  };
  struct Assets {
    surface::ScenePtr scene;
    gl::Object attributes;
    gl::Object indices;
    gl::Object material_block;
    GLintptr material_stride = 0;
    std::vector<gl::Object> textures;
    std::vector<gl::Object> samplers;
    std::vector<Material> materials;
    std::vector<const gl::Program*> programs;  // of the materials, each once
    std::vector<Batch> solid;                  // OPAQUE, then MASK
    std::vector<Batch> blended;                // a triangle each
    gl::Object posed;                          // vertices
    gl::Object sorted_indices;                 // of blended triangles
    std::uint64_t bytes = 0;
  };

  void upload_textures(Assets& assets) const;
  void make_programs(Assets& assets) const;
  void upload_materials(Assets& assets) const;
  void prepare_draws(Assets& assets) const;
  void sort_blended(const SurfaceView& view);
  void make_targets(glm::uvec2 size, unsigned layers, SurfaceLayers& into);
  void make_fixtures();
  void upload_view(const SurfaceView& view, const SurfaceLighting& lighting);
  void draw_batches(std::span<const Batch> batches, bool mirrored) const;

  gl::FunctionsPtr gl_;
  gl::ProgramsPtr programs_;
  Assets assets_;
  std::shared_ptr<const void> content_;
  bool posed_ = false;
  bool double_sided_ = false;  // all materials of the pose
  std::vector<std::uint8_t> flipped_;
  std::vector<surface::PunctualLight> lights_;
  glm::dvec3 low_{0.0};
  glm::dvec3 high_{0.0};
  std::vector<glm::vec3> centres_;  // of blended triangles
  std::vector<Batch> sorted_;       // of blended triangles, into sorted_indices
  std::optional<SurfaceView> sorted_view_;

  gl::Object white_;
  gl::Object albedo_table_;
  gl::Object table_sampler_;
  gl::Object view_block_;
  gl::Object light_buffer_;
  std::size_t light_bytes_ = 0;

  gl::Object depth_test_;
  glm::uvec2 depth_test_size_{0U};
};

}  // namespace cumulet::render
