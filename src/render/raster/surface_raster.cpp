#include "render/raster/surface_raster.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <string>
#include <tuple>

#include "base/corners.hpp"
#include "base/error.hpp"
#include "gl/bindings.hpp"
#include "light/analytic_lights.hpp"
#include "scene/model_table.hpp"
#include "shader_macros.hpp"
#include "surface/ggx_albedo.hpp"

namespace cumulet::core {
#include "light/prefiltered.glsl"
#include "surface/jitter.glsl"
}  // namespace cumulet::core

namespace cumulet::render {

namespace {

using core::CmAnalyticLight;
using core::CmMaterial;
using core::CmSurfaceView;
using surface::AlphaMode;

/// Returns the matrix from world, relative to the eye, to picture coordinates x z, y z (orthographic: x, y) and view
/// depth z.
glm::dmat3 to_view(const SurfaceView& view) {
  const glm::dmat3 basis(view.right, view.up, view.forward);
  const glm::dmat3 inverse = glm::inverse(basis);
  for (int c = 0; c < 3; ++c) {
    for (int r = 0; r < 3; ++r) {
      if (!std::isfinite(inverse[c][r]))
        throw Error(ErrorCode::internal, "the view matrix of the surfaces is singular");
    }
  }
  return inverse;
}

/// Returns the coefficients (x, y) of clip-space depth x + y z for content in the bounds. The depth is 1 at the near
/// plane and 0 at the far one (perspective: at infinity).
glm::dvec2 depth_of(const SurfaceView& view, const glm::dmat3& matrix, const glm::dvec3& low, const glm::dvec3& high) {
  double nearest = std::numeric_limits<double>::infinity();
  double farthest = -nearest;
  for (const glm::dvec3& p : corners_of(low, high)) {
    const double z = (matrix * (p - view.eye)).z;
    nearest = std::min(nearest, z);
    farthest = std::max(farthest, z);
  }
  const double extent = std::max(glm::length(high - low), 1e-12);
  // Reversed floating-point depth has the same relative precision everywhere, so the near plane of a perspective may be
  // anywhere in front of the scene.
  if (!view.orthographic) return {nearest > 0.0 ? std::max(0.5 * nearest, 1e-30) : 1e-7 * extent, 0.0};
  const double margin = 0.01 * extent;
  const double near = std::max(0.0, nearest - margin);
  const double far = std::max(farthest, near) + margin;
  return {far / (far - near), -1.0 / (far - near)};
}

core::CmHarmonics block_of(const light::Harmonics& harmonics) {
  const auto at = [&](std::size_t i) { return glm::vec4(harmonics.at(i), 0.0F); };
  return {at(0), at(1), at(2), at(3), at(4), at(5), at(6), at(7)};
}

GLint wrap_of(surface::Wrap wrap) {
  switch (wrap) {
    case surface::Wrap::mirrored:
      return GL_MIRRORED_REPEAT;
    case surface::Wrap::clamp:
      return GL_CLAMP_TO_EDGE;
    default:
      return GL_REPEAT;
  }
}

GLint minify_of(const surface::Sampler& sampler) {
  const bool linear = sampler.minify == surface::Filter::linear;
  if (!sampler.mipmaps) return linear ? GL_LINEAR : GL_NEAREST;
  const bool between = sampler.between_mipmaps == surface::Filter::linear;
  if (linear) return between ? GL_LINEAR_MIPMAP_LINEAR : GL_LINEAR_MIPMAP_NEAREST;
  return between ? GL_NEAREST_MIPMAP_LINEAR : GL_NEAREST_MIPMAP_NEAREST;
}

gl::Object make_scene_sampler(const gl::FunctionsPtr& gl, const surface::Sampler& sampler) {
  gl::Object object = gl::make_sampler(gl);
  gl->SamplerParameteri(object.name(), GL_TEXTURE_WRAP_S, wrap_of(sampler.wrap_s));
  gl->SamplerParameteri(object.name(), GL_TEXTURE_WRAP_T, wrap_of(sampler.wrap_t));
  gl->SamplerParameteri(object.name(), GL_TEXTURE_MIN_FILTER, minify_of(sampler));
  gl->SamplerParameteri(object.name(), GL_TEXTURE_MAG_FILTER,
                        sampler.magnify == surface::Filter::linear ? GL_LINEAR : GL_NEAREST);
  return object;
}

struct Bounds {
  glm::dvec3 low;
  glm::dvec3 high;
};

// Bounds of the drawn items.
std::optional<Bounds> bounds_of(std::span<const RasterItem> items) {
  std::optional<Bounds> all;
  for (const RasterItem& item : items) {
    if (item.shadow_only) continue;
    const surface::Pose& pose = item.content->pose();
    const scene::Block block = scene::block_of(item.to_world, pose.low, pose.high);
    const glm::dvec3 reach = scene::reach_of(block);
    const Bounds own{block.middle - reach, block.middle + reach};
    all = all ? Bounds{glm::min(all->low, own.low), glm::max(all->high, own.high)} : own;
  }
  return all;
}

}  // namespace

glm::vec2 surface_jitter(unsigned layer, unsigned layers) { return core::cm_layer_jitter(layer, layers); }

// Plans the upload steps of a content.
class RasterContent::Planner {
 public:
  Planner(const gl::FunctionsPtr& gl, const gl::ProgramsPtr& programs, const gl::Limits& limits, Upload& upload)
      : gl_(gl), programs_(programs), limits_(limits), upload_(upload) {}

  void share(const std::shared_ptr<Shared>& shared) {
    const surface::Scene& scene = *shared->source->scene;
    Shared* const to = shared.get();
    to->textures.resize(to->source->textures.size());
    for (std::size_t i = 0; i < to->textures.size(); ++i) add_texture(*to, i);
    upload_.add([gl = gl_, to] {
      for (const surface::Sampler& sampler : to->source->samplers) {
        to->samplers.push_back(make_scene_sampler(gl, sampler));
      }
    });
    if (scene.attributes.empty() || scene.indices.empty()) return;
    static_assert(sizeof(surface::VertexAttributes) == 32 && sizeof(surface::PosedVertex) == 40);
    add_buffer(to->attributes, scene.attributes, "uploading the scene's vertices");
    add_buffer(to->indices, scene.indices, "uploading the scene's indices");
    to->bytes +=
        scene.attributes.size() * sizeof(surface::VertexAttributes) + scene.indices.size() * sizeof(std::uint32_t);
  }

  void fix(const std::shared_ptr<Fixed>& fixed) {
    const scene::RasterSource& source = *fixed->source;
    Fixed* const to = fixed.get();
    to->program_of.resize(source.materials.size());
    for (std::size_t i = 0; i < source.materials.size(); ++i) {
      upload_.add([programs = programs_, to, i] { programs->ask(key_of(to->source->materials[i])); });
    }
    for (std::size_t i = 0; i < source.materials.size(); ++i) {
      upload_.add_until([programs = programs_, to, i] {
        to->program_of[i] = &programs->ask(key_of(to->source->materials[i]));
        return to->program_of[i]->usable();
      });
    }
    add_buffer(to->material_block, source.material_blocks, "uploading the scene's materials");
    to->bytes += source.material_blocks.size();
  }

  /// Adds a buffer of exactly these values, allocated by the first step.
  template <class T>
  void add_buffer(gl::Object& buffer, const std::vector<T>& values, const char* what) {
    const std::size_t bytes = values.size() * sizeof(T);
    if (bytes == 0) return;
    gl::Object* const to = &buffer;
    upload_.add(
        [gl = gl_, to, bytes, what] { *to = gl::make_buffer(gl, bytes, nullptr, GL_DYNAMIC_STORAGE_BIT, what); });
    upload_.add_bytes([to] { return Upload::Location{to->name(), 0}; }, values.data(), bytes);
  }

 private:
  void add_texture(Shared& to, std::size_t i) {
    const scene::RasterPictures::Texture& texture = to.source->textures[i];
    const surface::Image& image = to.source->scene->images.at(texture.image);
    const auto most = static_cast<std::uint32_t>(limits_.texture_size_2d);
    if (image.width > most || image.height > most) {
      throw Error(ErrorCode::unsupported, "image \"" + image.name + "\" is " + std::to_string(image.width) + "x" +
                                              std::to_string(image.height) + "; the GL driver's largest texture is " +
                                              std::to_string(most));
    }
    upload_.add([gl = gl_, &to, i] { to.textures[i] = make_texture(gl, *to.source, i); });
    const auto name = [&to, i] { return to.textures[i].name(); };
    glm::uvec2 size(image.width, image.height);
    upload_.add_image(name, {glm::uvec2(0U), size, 0, std::nullopt}, image.rgba.data());
    to.bytes += image.rgba.size();
    for (std::size_t level = 0; level < texture.smaller.size(); ++level) {
      size = glm::max(size / 2U, glm::uvec2(1U));
      upload_.add_image(name, {glm::uvec2(0U), size, static_cast<int>(level) + 1, std::nullopt},
                        texture.smaller[level].data());
      to.bytes += texture.smaller[level].size();
    }
  }

  static gl::Object make_texture(const gl::FunctionsPtr& gl, const scene::RasterPictures& source, std::size_t i) {
    const scene::RasterPictures::Texture& texture = source.textures[i];
    const surface::Image& image = source.scene->images[texture.image];
    GLuint name = 0;
    gl->CreateTextures(GL_TEXTURE_2D, 1, &name);
    gl::Object made(gl, gl::Object::Kind::texture, name);
    gl->TextureStorage2D(name, static_cast<GLsizei>(texture.smaller.size() + 1),
                         texture.srgb ? GL_SRGB8_ALPHA8 : GL_RGBA8, static_cast<GLsizei>(image.width),
                         static_cast<GLsizei>(image.height));
    gl::label(*gl, gl::Object::Kind::texture, name, "a texture of the scene");
    gl::check(*gl, "creating a texture of the scene");
    return made;
  }

  // Returns the program key of a material: its alpha mode, bits of the maps that it uses, and whether it has a
  // clearcoat.
  static gl::ProgramKey key_of(const scene::RasterSource::Material& material) {
    return {"surface.frag",
            {gl::macros::alpha(material.pass), gl::macros::used(material.used()), gl::macros::coated(material.coated)},
            "surface.vert"};
  }

  const gl::FunctionsPtr& gl_;
  const gl::ProgramsPtr& programs_;
  const gl::Limits& limits_;
  Upload& upload_;
};

std::shared_ptr<const RasterContent> RasterContent::plan(const gl::FunctionsPtr& gl, const gl::ProgramsPtr& programs,
                                                         const gl::Limits& limits, Upload& upload, Input input,
                                                         const RasterContent* last) {
  if (input.pose->vertices.size() != input.scene->scene->attributes.size()) {
    throw Error(ErrorCode::internal, "the pose belongs to another scene");
  }
  if (static_cast<std::int64_t>(input.pose->lights.size() * sizeof(CmAnalyticLight)) > limits.storage_block_bytes) {
    throw Error(ErrorCode::unsupported, std::to_string(input.pose->lights.size()) +
                                            " lights are more than this driver's GL_MAX_SHADER_STORAGE_BLOCK_SIZE, " +
                                            std::to_string(limits.storage_block_bytes) + ", holds");
  }
  const auto content = std::make_shared<RasterContent>();
  Planner planner(gl, programs, limits, upload);
  if (last != nullptr && last->fixed_->source == input.scene) {
    content->fixed_ = last->fixed_;
  } else {
    content->fixed_ = std::make_shared<Fixed>();
    content->fixed_->source = std::move(input.scene);
    const auto& pictures = content->fixed_->source->pictures;
    if (last != nullptr && last->fixed_->shared->source == pictures) {
      content->fixed_->shared = last->fixed_->shared;
    } else {
      content->fixed_->shared = std::make_shared<Shared>();
      content->fixed_->shared->source = pictures;
      planner.share(content->fixed_->shared);
    }
    planner.fix(content->fixed_);
  }
  content->pose_ = std::move(input.pose);
  content->centres_ = std::move(input.centres);
  if (!content->scene().scene->indices.empty()) {
    planner.add_buffer(content->posed_, content->pose_->vertices, "uploading the scene's posed vertices");
    content->posed_bytes_ = content->pose_->vertices.size() * sizeof(surface::PosedVertex);
  }
  return content;
}

const SurfaceRaster::TransformRange& SurfaceRaster::Shown::transform_range(std::uint32_t draw) const {
  const std::vector<surface::Prototype>& prototypes = content->scene().scene->prototypes;
  const auto after = std::ranges::upper_bound(prototypes, draw, {}, &surface::Prototype::first_draw);
  return sets[static_cast<std::size_t>(after - prototypes.begin())];
}

bool SurfaceRaster::blends() const {
  return std::ranges::any_of(drawn_, [](const Shown& shown) { return shown.content->blends(); });
}

void SurfaceRaster::add_transforms(Shown& shown, std::vector<glm::dmat4> transforms) {
  const auto volume = [](const glm::dmat4& transform) { return glm::determinant(glm::dmat3(transform)); };
  std::erase_if(transforms, [&](const glm::dmat4& transform) { return !(std::abs(volume(transform)) > 0.0); });
  const auto mirrored =
      std::stable_partition(transforms.begin(), transforms.end(), [&](const glm::dmat4& p) { return volume(p) > 0.0; });
  const auto count = static_cast<std::uint32_t>(transforms.end() - mirrored);
  shown.sets.push_back(
      {static_cast<std::uint32_t>(transforms_.size()), static_cast<std::uint32_t>(transforms.size()) - count, count});
  transforms_.insert(transforms_.end(), transforms.begin(), transforms.end());
}

void SurfaceRaster::show(std::vector<RasterItem> items) {
  items_ = std::move(items);
  shown_ = std::make_shared<char>();
  drawn_.clear();
  transforms_.clear();
  sorted_.clear();
  sorted_view_.reset();
  for (const RasterItem& item : items_) {
    const auto is = [&](const Shown& shown) { return shown.content == item.content; };
    if (item.shadow_only || !item.content->drawable() || std::ranges::any_of(drawn_, is)) continue;
    drawn_.push_back({item.content, {}});
  }
  for (Shown& shown : drawn_) {
    std::vector<glm::dmat4> whole;
    std::vector<glm::dmat4> own;
    for (const RasterItem& item : items_) {
      if (item.shadow_only || item.content != shown.content) continue;
      whole.push_back(item.to_world);
      own.push_back(surface::from_origin(item.to_world, shown.content->pose()));
    }
    add_transforms(shown, std::move(own));
    for (const std::vector<glm::dmat4>& transforms : shown.content->pose().prototype_transforms) {
      std::vector<glm::dmat4> all;
      for (const glm::dmat4& to_world : whole) {
        for (const glm::dmat4& transform : transforms) all.push_back(to_world * transform);
      }
      add_transforms(shown, std::move(all));
    }
  }
}

void SurfaceRaster::sort_blended(const SurfaceView& view) {
  if (!blends() || sorted_view_ == view) return;
  const glm::dmat3 matrix = to_view(view);
  const glm::dvec3 row(matrix[0][2], matrix[1][2], matrix[2][2]);
  struct Triangle {
    double z;
    std::uint32_t shown;
    std::uint32_t transform;
    std::uint32_t number;  // index among the content's blended triangles
  };
  std::vector<Triangle> order;
  for (std::uint32_t i = 0; i < drawn_.size(); ++i) {
    const RasterContent& content = *drawn_[i].content;
    for (std::uint32_t t = 0; t < content.scene().blended.size(); ++t) {
      const TransformRange& range = drawn_[i].transform_range(content.scene().blended[t].draw);
      const glm::dvec4 centre((*content.centres_)[t], 1.0);
      for (std::uint32_t p = range.first; p < range.first + range.upright + range.mirrored; ++p)
        order.push_back({glm::dot(row, glm::dvec3(transforms_[p] * centre) - view.eye), i, p, t});
    }
  }
  std::ranges::stable_sort(order, std::ranges::greater{}, &Triangle::z);
  std::vector<std::uint32_t> indices;
  indices.reserve(order.size() * 3);
  sorted_.clear();
  for (const Triangle& triangle : order) {
    const scene::RasterSource& source = drawn_[triangle.shown].content->scene();
    const Batch& batch = source.blended[triangle.number];
    if (sorted_.empty() || sorted_.back().batch.draw != batch.draw || sorted_.back().shown != triangle.shown ||
        sorted_.back().transform != triangle.transform) {
      sorted_.push_back(
          {triangle.shown, triangle.transform, {static_cast<std::uint32_t>(indices.size()), 0, batch.draw}});
    }
    sorted_.back().batch.count += 3;
    const auto first = source.scene->indices.begin() + batch.first;
    indices.insert(indices.end(), first, first + 3);
  }
  fill(sorted_indices_, sorted_bytes_, indices.data(), indices.size() * sizeof(std::uint32_t),
       "creating the indices of blended triangles");
  sorted_view_ = view;
}

void SurfaceRaster::fill(gl::Object& buffer, std::size_t& size, const void* from, std::size_t bytes,
                         const char* what) const {
  if (!buffer || size < bytes) {
    buffer = {};
    buffer = gl::make_buffer(gl_, std::max<std::size_t>(bytes, 16), nullptr, GL_DYNAMIC_STORAGE_BIT, what);
    size = bytes;
  }
  if (bytes > 0) gl_->NamedBufferSubData(buffer.name(), 0, static_cast<GLsizeiptr>(bytes), from);
}

// An instance transform: its columns, and its origin relative to the eye as the sum of two floats, for precision.
struct SurfaceRaster::TransformRecord {
  glm::vec3 x;
  glm::vec3 y;
  glm::vec3 z;
  glm::vec3 high;
  glm::vec3 low;
};

void SurfaceRaster::upload_transforms(const SurfaceView& view) {
  std::vector<TransformRecord> records;
  records.reserve(transforms_.size());
  for (const glm::dmat4& transform : transforms_) {
    const glm::dvec3 from_eye = glm::dvec3(transform[3]) - view.eye;
    const glm::vec3 high(from_eye);
    records.push_back({glm::vec3(transform[0]), glm::vec3(transform[1]), glm::vec3(transform[2]), high,
                       glm::vec3(from_eye - glm::dvec3(high))});
  }
  fill(transform_buffer_, transform_bytes_, records.data(), records.size() * sizeof(TransformRecord),
       "creating the surfaces' transforms");
}

void SurfaceRaster::make_targets(glm::uvec2 size, unsigned layers, SurfaceLayers& into) {
  const auto width = static_cast<int>(size.x);
  const auto height = static_cast<int>(size.y);
  const bool blended = blends();
  if (!depth_test_ || size != depth_test_size_) {
    depth_test_ = {};
    depth_test_ = gl::make_texture_2d(gl_, GL_DEPTH_COMPONENT32F, width, height, "creating the surfaces' depth test");
    depth_test_size_ = size;
  }
  if (into.color && size == into.size && layers == into.layers && blended == into.blended) return;
  into = {};
  SurfaceLayers made;
  const auto depth = static_cast<int>(blended ? 2 * layers : layers);
  made.color = gl::make_texture_2d_array(gl_, GL_RGBA16F, width, height, depth, "creating the surfaces' color");
  made.z = gl::make_texture_2d_array(gl_, GL_R32F, width, height, depth, "creating the surfaces' depth");
  made.size = size;
  made.layers = layers;
  made.blended = blended;
  into = std::move(made);
}

void SurfaceRaster::make_fixtures() {
  if (view_block_) return;
  constexpr const char* what = "creating the surface pass";
  white_ = gl::make_texture_2d(gl_, GL_RGBA8, 1, 1, what);
  const std::array<std::uint8_t, 4> texel{255, 255, 255, 255};
  gl_->TextureSubImage2D(white_.name(), 0, 0, 0, 1, 1, GL_RGBA, GL_UNSIGNED_BYTE, texel.data());
  const int width = surface::GgxAlbedo::width();
  const int height = surface::GgxAlbedo::height();
  albedo_table_ = gl::make_texture_2d(gl_, GL_RG16F, width, height, what);
  gl_->TextureSubImage2D(albedo_table_.name(), 0, 0, 0, width, height, GL_RG, GL_FLOAT,
                         surface::GgxAlbedo::table().texels().data());
  table_sampler_ = gl::make_sampler(gl_);
  gl_->SamplerParameteri(table_sampler_.name(), GL_TEXTURE_MIN_FILTER, GL_LINEAR);
  gl_->SamplerParameteri(table_sampler_.name(), GL_TEXTURE_MAG_FILTER, GL_LINEAR);
  gl_->SamplerParameteri(table_sampler_.name(), GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
  gl_->SamplerParameteri(table_sampler_.name(), GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
  // The texture wraps around the horizon, and is clamped at the poles.
  prefiltered_sampler_ = gl::make_sampler(gl_);
  gl_->SamplerParameteri(prefiltered_sampler_.name(), GL_TEXTURE_MIN_FILTER, GL_LINEAR);
  gl_->SamplerParameteri(prefiltered_sampler_.name(), GL_TEXTURE_MAG_FILTER, GL_LINEAR);
  gl_->SamplerParameteri(prefiltered_sampler_.name(), GL_TEXTURE_WRAP_S, GL_REPEAT);
  gl_->SamplerParameteri(prefiltered_sampler_.name(), GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
  view_block_ = gl::make_buffer(gl_, sizeof(CmSurfaceView), nullptr, GL_DYNAMIC_STORAGE_BIT, what);
}

std::uint64_t SurfaceRaster::bytes() const {
  std::uint64_t bytes =
      light_bytes_ + transform_bytes_ + sorted_bytes_ + std::uint64_t{depth_test_size_.x} * depth_test_size_.y * 4;
  if (prefiltered_)
    bytes += std::uint64_t{core::CM_PREFILTERED_WIDTH} * core::CM_PREFILTERED_HEIGHT * core::CM_PREFILTERED_LEVELS * 16;
  if (!view_block_) return bytes;
  const std::uint64_t table = std::uint64_t(surface::GgxAlbedo::width()) * surface::GgxAlbedo::height() * 4;
  return bytes + 4 + table + sizeof(CmSurfaceView);
}

void SurfaceRaster::upload_prefiltered(const light::PrefilteredEnvironmentPtr& prefiltered) {
  constexpr int width = core::CM_PREFILTERED_WIDTH;
  constexpr int height = core::CM_PREFILTERED_HEIGHT;
  constexpr int levels = core::CM_PREFILTERED_LEVELS;
  if (!prefiltered_)
    prefiltered_ =
        gl::make_texture_2d_array(gl_, GL_RGBA32F, width, height, levels, "creating the prefiltered environment map");
  // Without a prefiltered environment the shader does not read it.
  if (!prefiltered || uploaded_prefiltered_ == prefiltered) return;
  gl_->TextureSubImage3D(prefiltered_.name(), 0, 0, 0, 0, width, height, levels, GL_RGBA, GL_FLOAT,
                         prefiltered->data());
  uploaded_prefiltered_ = prefiltered;
}

void SurfaceRaster::upload_view(const SurfaceView& view, const SurfaceLighting& lighting) {
  const glm::dmat3 matrix = to_view(view);
  const std::optional<Bounds> bounds = bounds_of(items_);
  const glm::dvec2 depth =
      bounds ? depth_of(view, matrix, bounds->low, bounds->high) : depth_of(view, matrix, view.eye, view.eye);
  CmSurfaceView block{};
  block.to_view_x = glm::vec4(glm::vec3(matrix[0]), 0.0F);
  block.to_view_y = glm::vec4(glm::vec3(matrix[1]), 0.0F);
  block.to_view_z = glm::vec4(glm::vec3(matrix[2]), 0.0F);
  block.clip = view.orthographic ? glm::vec4(depth, 1.0, 0.0) : glm::vec4(depth, 0.0, 1.0);
  block.forward = glm::vec4(glm::vec3(glm::normalize(view.forward)), 0.0F);
  block.sun_direction = glm::vec4(lighting.sun_direction, 0.0F);
  block.sun_irradiance = glm::vec4(lighting.sun_irradiance, 0.0F);
  block.sky_radiance = glm::vec4(lighting.sky_radiance, 0.0F);
  block.sky = block_of(lighting.sky);
  block.sky_turn = glm::vec4(lighting.sky_turn, lighting.prefiltered_strength, 0.0F);
  std::vector<surface::PunctualLight> analytic_lights;
  for (const RasterItem& item : items_) {
    const surface::Pose& pose = item.content->pose();
    for (const surface::PunctualLight& analytic_light : pose.lights)
      analytic_lights.push_back(scene::transformed(analytic_light, surface::from_origin(item.to_world, pose)));
  }
  light::AnalyticLights of_host = lighting.analytic_lights;
  for (light::AnalyticLight& analytic_light : of_host) {
    // Only the center of the disk is used, and a wide sun's center is brighter than its mean.
    if (analytic_light.kind == light::AnalyticLight::Kind::sun) analytic_light.angle = 0.0;
  }
  const std::vector<CmAnalyticLight> records = light::analytic_light_records(of_host, analytic_lights, view.eye);
  block.counts.x = static_cast<std::uint32_t>(records.size());
  block.counts.y = lighting.prefiltered && lighting.prefiltered_strength > 0.0F ? 1U : 0U;
  block.counts.z = view.orthographic ? 1U : 0U;
  gl_->NamedBufferSubData(view_block_.name(), 0, sizeof(block), &block);

  fill(light_buffer_, light_bytes_, records.data(), records.size() * sizeof(CmAnalyticLight),
       "creating the surfaces' lights");
  gl_->BindBufferBase(GL_UNIFORM_BUFFER, core::CM_UNIFORM_SURFACE_VIEW, view_block_.name());
  gl_->BindBufferBase(GL_SHADER_STORAGE_BUFFER, core::CM_STORAGE_ANALYTIC_LIGHTS, light_buffer_.name());
}

// Draws batches, and skips redundant binds.
class SurfaceRaster::Pen {
 public:
  Pen(const SurfaceRaster& raster, GLuint vertex_array, bool mirrored)
      : raster_(raster), gl_(*raster.gl_), array_(vertex_array), mirrored_(mirrored) {}

  /// Draws the batches of the content's own indices, each with all of its instance transforms.
  void solid(const Shown& shown) {
    const RasterContent& content = *shown.content;
    const std::vector<Batch>& batches = content.scene().solid;
    take(content, content.fixed_->shared->indices.name());
    for (std::size_t b = 0; b < batches.size();) {
      const Batch& batch = batches[b];
      const TransformRange& range = shown.transform_range(batch.draw);
      const std::uint8_t flipped = content.pose().flipped[batch.draw];
      const std::uint32_t material = material_of(content, batch);
      // Copies of a mesh are adjacent, so that one call draws them all.
      std::uint64_t count = batch.count;
      for (++b; b < batches.size(); ++b) {
        const Batch& next = batches[b];
        if (next.first != batch.first + count || count + next.count > std::numeric_limits<GLsizei>::max() ||
            &shown.transform_range(next.draw) != &range || content.pose().flipped[next.draw] != flipped ||
            material_of(content, next) != material) {
          break;
        }
        count += next.count;
      }
      draw(content, {batch.first, static_cast<std::uint32_t>(count), batch.draw}, range.first, range.upright, false);
      draw(content, {batch.first, static_cast<std::uint32_t>(count), batch.draw}, range.first + range.upright,
           range.mirrored, true);
    }
  }

  /// Draws a range of the sorted indices.
  void blended(const Blended& what) {
    const Shown& shown = raster_.drawn_[what.shown];
    take(*shown.content, raster_.sorted_indices_.name());
    const TransformRange& range = shown.transform_range(what.batch.draw);
    draw(*shown.content, what.batch, what.transform, 1, what.transform >= range.first + range.upright);
  }

 private:
  [[nodiscard]] static std::uint32_t material_of(const RasterContent& content, const Batch& batch) {
    return surface::material_of(*content.scene().scene, content.pose(), batch.draw);
  }

  void take(const RasterContent& content, GLuint indices) {
    if (&content != content_) {
      gl_.VertexArrayVertexBuffer(array_, 0, content.posed_.name(), 0, sizeof(surface::PosedVertex));
      gl_.VertexArrayVertexBuffer(array_, 1, content.fixed_->shared->attributes.name(), 0,
                                  sizeof(surface::VertexAttributes));
      program_ = nullptr;
      material_ = nullptr;
    }
    if (indices != indices_) gl_.VertexArrayElementBuffer(array_, indices);
    content_ = &content;
    indices_ = indices;
  }

  void draw(const RasterContent& content, const Batch& batch, std::uint32_t first_transform, std::uint32_t transforms,
            bool in_mirror) {
    if (transforms == 0) return;
    const RasterContent::Fixed& fixed = *content.fixed_;
    const std::uint32_t index = material_of(content, batch);
    const scene::RasterSource::Material& material = content.scene().materials[index];
    if (program_ != fixed.program_of[index]) fixed.program_of[index]->use(gl_);
    program_ = fixed.program_of[index];
    if (material_ != &material) {
      for (GLuint i = 0; i < material.maps.size(); ++i) {
        const auto& map = material.maps[i];
        const GLuint unit = core::CM_UNIT_MAPS + i;
        gl_.BindTextureUnit(unit, map ? fixed.shared->textures[map->texture].name() : raster_.white_.name());
        gl_.BindSampler(unit, map ? fixed.shared->samplers[map->sampler].name() : 0);
      }
      gl_.BindBufferRange(GL_UNIFORM_BUFFER, core::CM_UNIFORM_MATERIAL, fixed.material_block.name(),
                          static_cast<GLintptr>(scene::RasterSource::material_stride * index), sizeof(CmMaterial));
      if (material.double_sided || content.pose().double_sided) {
        gl_.Disable(GL_CULL_FACE);
      } else {
        gl_.Enable(GL_CULL_FACE);
      }
      material_ = &material;
    }
    // The picture is upside down in the target, which reverses the winding.
    const bool flipped = (content.pose().flipped[batch.draw] != 0) != in_mirror;
    gl_.FrontFace(mirrored_ == flipped ? GL_CW : GL_CCW);
    const std::uintptr_t offset = std::uintptr_t{batch.first} * sizeof(std::uint32_t);
    // NOLINTNEXTLINE(performance-no-int-to-ptr): so GL takes offsets
    const void* start = reinterpret_cast<const void*>(offset);
    gl_.DrawElementsInstancedBaseInstance(GL_TRIANGLES, static_cast<GLsizei>(batch.count), GL_UNSIGNED_INT, start,
                                          static_cast<GLsizei>(transforms), first_transform);
  }

  const SurfaceRaster& raster_;
  const gl::Functions& gl_;
  GLuint array_;
  bool mirrored_;  // the picture is mirrored
  const RasterContent* content_ = nullptr;
  GLuint indices_ = 0;
  const gl::Program* program_ = nullptr;
  const scene::RasterSource::Material* material_ = nullptr;
};

namespace {

// Sets the viewport, and the state of depth tests, culling and blending.
void set_state(const gl::Functions& gl, glm::uvec2 size) {
  gl.ViewportIndexedf(0, 0.0F, 0.0F, static_cast<GLfloat>(size.x), static_cast<GLfloat>(size.y));
  gl.ClipControl(GL_LOWER_LEFT, GL_ZERO_TO_ONE);
  gl.Enable(GL_DEPTH_TEST);
  gl.DepthFunc(GL_GREATER);
  gl.CullFace(GL_BACK);
  // For blended surfaces: colors are blended over each other, and z is the nearest.
  gl.BlendEquationSeparatei(0, GL_FUNC_ADD, GL_FUNC_ADD);
  gl.BlendFuncSeparatei(0, GL_ONE, GL_ONE_MINUS_SRC_ALPHA, GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
  gl.BlendEquationSeparatei(1, GL_MIN, GL_MIN);
}

}  // namespace

gl::Object SurfaceRaster::bind_inputs(const SurfaceView& view, const SurfaceLighting& lighting) {
  const auto& gl = *gl_;
  upload_transforms(view);
  gl::Object vertex_array = gl::make_vertex_array(gl_);
  const GLuint array = vertex_array.name();
  gl.VertexArrayVertexBuffer(array, 2, transform_buffer_.name(), 0, sizeof(TransformRecord));
  gl.VertexArrayBindingDivisor(array, 2, 1);
  const auto attribute = [&](GLuint location, GLint components, GLuint offset, GLuint binding) {
    gl.EnableVertexArrayAttrib(array, location);
    gl.VertexArrayAttribFormat(array, location, components, GL_FLOAT, GL_FALSE, offset);
    gl.VertexArrayAttribBinding(array, location, binding);
  };
  attribute(0, 3, offsetof(surface::PosedVertex, position), 0);
  attribute(1, 3, offsetof(surface::PosedVertex, normal), 0);
  attribute(2, 4, offsetof(surface::PosedVertex, tangent), 0);
  attribute(3, 4, offsetof(surface::VertexAttributes, uv), 1);
  attribute(4, 4, offsetof(surface::VertexAttributes, color), 1);
  attribute(5, 3, offsetof(TransformRecord, x), 2);
  attribute(6, 3, offsetof(TransformRecord, y), 2);
  attribute(7, 3, offsetof(TransformRecord, z), 2);
  attribute(8, 3, offsetof(TransformRecord, high), 2);
  attribute(9, 3, offsetof(TransformRecord, low), 2);
  gl.BindVertexArray(array);
  gl.BindTextureUnit(core::CM_UNIT_GGX_ALBEDO, albedo_table_.name());
  gl.BindSampler(core::CM_UNIT_GGX_ALBEDO, table_sampler_.name());
  upload_prefiltered(lighting.prefiltered);
  gl.BindTextureUnit(core::CM_UNIT_PREFILTERED, prefiltered_.name());
  gl.BindSampler(core::CM_UNIT_PREFILTERED, prefiltered_sampler_.name());
  return vertex_array;
}

void SurfaceRaster::draw(const SurfaceView& view, const SurfaceLighting& lighting, glm::uvec2 size, unsigned layers,
                         SurfaceLayers& into) {
  const auto& gl = *gl_;
  const gl::DebugGroup group(gl, "cumulet: surfaces");
  layers = std::clamp(layers, 1U, 8U);
  make_fixtures();
  make_targets(size, layers, into);
  upload_view(view, lighting);
  sort_blended(view);

  const gl::Object framebuffer = gl::make_framebuffer(gl_);
  const GLuint target = framebuffer.name();
  gl.NamedFramebufferTexture(target, GL_DEPTH_ATTACHMENT, depth_test_.name(), 0);
  const std::array<GLenum, 2> buffers{GL_COLOR_ATTACHMENT0, GL_COLOR_ATTACHMENT1};
  gl.NamedFramebufferDrawBuffers(target, 2, buffers.data());
  gl::Object vertex_array;
  const bool drawable = !drawn_.empty();
  if (drawable) vertex_array = bind_inputs(view, lighting);
  gl.BindFramebuffer(GL_DRAW_FRAMEBUFFER, target);
  set_state(gl, size);
  for (GLuint i = 0; i < buffers.size(); ++i) gl.ColorMaski(i, GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
  const auto clear_to = [&](unsigned layer) {
    gl.NamedFramebufferTextureLayer(target, GL_COLOR_ATTACHMENT0, into.color.name(), 0, static_cast<GLint>(layer));
    gl.NamedFramebufferTextureLayer(target, GL_COLOR_ATTACHMENT1, into.z.name(), 0, static_cast<GLint>(layer));
    const glm::vec4 black(0.0F);
    const glm::vec4 nowhere(std::numeric_limits<float>::infinity());
    gl.ClearNamedFramebufferfv(target, GL_COLOR, 0, &black.x);
    gl.ClearNamedFramebufferfv(target, GL_COLOR, 1, &nowhere.x);
  };
  const bool mirrored = glm::dot(glm::cross(view.right, view.up), view.forward) > 0.0;
  for (unsigned layer = 0; layer < layers; ++layer) {
    clear_to(layer);
    gl.DepthMask(GL_TRUE);
    const float far = 0.0F;
    gl.ClearNamedFramebufferfv(target, GL_DEPTH, 0, &far);
    const glm::vec2 shift = (glm::vec2(0.5F) - surface_jitter(layer, layers)) * 2.0F / glm::vec2(size);
    if (drawable) {
      for (const Shown& shown : drawn_) {
        for (const gl::Program* program : shown.content->fixed_->program_of)
          gl.ProgramUniform2f(program->name(), 0, shift.x, shift.y);
      }
      Pen pen(*this, vertex_array.name(), mirrored);
      for (const Shown& shown : drawn_) pen.solid(shown);
    }
    if (!into.blended) continue;
    clear_to(layers + layer);
    if (!drawable) continue;
    for (GLuint i = 0; i < buffers.size(); ++i) gl.Enablei(GL_BLEND, i);
    gl.DepthMask(GL_FALSE);
    Pen pen(*this, vertex_array.name(), mirrored);
    for (const Blended& what : sorted_) pen.blended(what);
    for (GLuint i = 0; i < buffers.size(); ++i) gl.Disablei(GL_BLEND, i);
  }
  gl::check(gl, "drawing the surfaces");
}

}  // namespace cumulet::render
