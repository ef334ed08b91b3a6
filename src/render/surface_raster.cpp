#include "render/surface_raster.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <numeric>
#include <string>
#include <tuple>

#include "base/error.hpp"
#include "gl/bindings.hpp"
#include "light/lamps.hpp"
#include "surface/ggx_albedo.hpp"

namespace cumulet::core {
#include "gloss.glsl"
#include "jitter.glsl"
}  // namespace cumulet::core

namespace cumulet::render {

namespace {

using core::CmLamp;
using core::CmMaterial;
using core::CmSurfaceView;
using surface::AlphaMode;

/// World, from the eye, to picture coordinates x z, y z (orthographic: x, y) and view depth z.
glm::dmat3 to_view(const SurfaceView& view) {
  const glm::dmat3 basis(view.right, view.up, view.forward);
  const glm::dmat3 inverse = glm::inverse(basis);
  for (int c = 0; c < 3; ++c) {
    for (int r = 0; r < 3; ++r) {
      if (!std::isfinite(inverse[c][r])) throw Error(ErrorCode::internal, "the surfaces' view spans no space");
    }
  }
  return inverse;
}

/// Clip-space depth x + y z for depths from 1, near, to 0, far (perspective: at infinity), of what the bounds hold.
glm::dvec2 depth_of(const SurfaceView& view, const glm::dmat3& matrix, const glm::dvec3& low, const glm::dvec3& high) {
  double nearest = std::numeric_limits<double>::infinity();
  double farthest = -nearest;
  for (unsigned corner = 0; corner < 8; ++corner) {
    const glm::dvec3 p((corner & 1U) != 0 ? high.x : low.x, (corner & 2U) != 0 ? high.y : low.y,
                       (corner & 4U) != 0 ? high.z : low.z);
    const double z = (matrix * (p - view.eye)).z;
    nearest = std::min(nearest, z);
    farthest = std::max(farthest, z);
  }
  const double extent = std::max(glm::length(high - low), 1e-12);
  // Reversed floats resolve all depths alike, so that perspective's near plane may be anywhere in front of the scene.
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

}  // namespace

glm::vec2 surface_jitter(unsigned layer, unsigned layers) { return core::cm_layer_jitter(layer, layers); }

// Adds the steps of a content to an upload.
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
    to->bytes += source.material_blocks.size() + source.blended.size() * 3 * sizeof(std::uint32_t);
    if (source.blended.empty()) return;
    upload_.add([gl = gl_, to] {
      to->sorted_indices = gl::make_buffer(gl, to->source->blended.size() * 3 * sizeof(std::uint32_t), nullptr,
                                           GL_DYNAMIC_STORAGE_BIT, "creating the indices of blended triangles");
    });
  }

  /// A buffer of just these, made before the first of them is copied.
  template <class T>
  void add_buffer(gl::Object& buffer, const std::vector<T>& values, const char* what) {
    const std::size_t bytes = values.size() * sizeof(T);
    if (bytes == 0) return;
    gl::Object* const to = &buffer;
    upload_.add(
        [gl = gl_, to, bytes, what] { *to = gl::make_buffer(gl, bytes, nullptr, GL_DYNAMIC_STORAGE_BIT, what); });
    upload_.add_bytes([to] { return Upload::Place{to->name(), 0}; }, values.data(), bytes);
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

  // What a material's program is compiled for: how it covers, bits of its maps, whether it has a coat.
  static gl::ProgramKey key_of(const scene::RasterSource::Material& material) {
    return {"surface.frag",
            {"CM_ALPHA " + std::to_string(static_cast<int>(material.pass)),
             "CM_USED " + std::to_string(material.used()), material.coated ? "CM_COATED 1" : "CM_COATED 0"},
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
    throw Error(ErrorCode::internal, "a pose of another scene");
  }
  if (static_cast<std::int64_t>(input.pose->lights.size() * sizeof(CmLamp)) > limits.storage_block_bytes) {
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

void SurfaceRaster::show(std::shared_ptr<const RasterContent> content) {
  content_ = std::move(content);
  shown_ = std::make_shared<char>();
  sorted_.clear();
  sorted_view_.reset();
}

void SurfaceRaster::sort_blended(const SurfaceView& view) {
  if (!blends() || sorted_view_ == view) return;
  const std::vector<glm::vec3>& centres = *content_->centres_;
  const glm::dmat3 matrix = to_view(view);
  const glm::dvec3 row(matrix[0][2], matrix[1][2], matrix[2][2]);
  std::vector<double> z(centres.size());
  std::transform(centres.begin(), centres.end(), z.begin(),
                 [&](const glm::vec3& centre) { return glm::dot(row, glm::dvec3(centre) - view.eye); });
  std::vector<std::uint32_t> order(centres.size());
  std::iota(order.begin(), order.end(), 0U);
  std::stable_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) { return z[a] > z[b]; });
  std::vector<std::uint32_t> indices;
  indices.reserve(order.size() * 3);
  sorted_.clear();
  for (const std::uint32_t i : order) {
    const Batch& triangle = content_->scene().blended[i];
    if (sorted_.empty() || sorted_.back().draw != triangle.draw) {
      sorted_.push_back({static_cast<std::uint32_t>(indices.size()), 0, triangle.draw});
    }
    sorted_.back().count += 3;
    const auto first = content_->scene().scene->indices.begin() + triangle.first;
    indices.insert(indices.end(), first, first + 3);
  }
  gl_->NamedBufferSubData(content_->fixed_->sorted_indices.name(), 0,
                          static_cast<GLsizeiptr>(indices.size() * sizeof(std::uint32_t)), indices.data());
  sorted_view_ = view;
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
  if (into.colour && size == into.size && layers == into.layers && blended == into.blended) return;
  into = {};
  SurfaceLayers made;
  const auto depth = static_cast<int>(blended ? 2 * layers : layers);
  made.colour = gl::make_texture_2d_array(gl_, GL_RGBA16F, width, height, depth, "creating the surfaces' colour");
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
  // Around the horizon, and not beyond the poles.
  gloss_sampler_ = gl::make_sampler(gl_);
  gl_->SamplerParameteri(gloss_sampler_.name(), GL_TEXTURE_MIN_FILTER, GL_LINEAR);
  gl_->SamplerParameteri(gloss_sampler_.name(), GL_TEXTURE_MAG_FILTER, GL_LINEAR);
  gl_->SamplerParameteri(gloss_sampler_.name(), GL_TEXTURE_WRAP_S, GL_REPEAT);
  gl_->SamplerParameteri(gloss_sampler_.name(), GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
  view_block_ = gl::make_buffer(gl_, sizeof(CmSurfaceView), nullptr, GL_DYNAMIC_STORAGE_BIT, what);
}

std::uint64_t SurfaceRaster::bytes() const {
  std::uint64_t bytes = light_bytes_ + std::uint64_t{depth_test_size_.x} * depth_test_size_.y * 4;
  if (gloss_) bytes += std::uint64_t{core::CM_GLOSS_WIDTH} * core::CM_GLOSS_HEIGHT * core::CM_GLOSS_LEVELS * 16;
  if (!view_block_) return bytes;
  const std::uint64_t table = std::uint64_t(surface::GgxAlbedo::width()) * surface::GgxAlbedo::height() * 4;
  return bytes + 4 + table + sizeof(CmSurfaceView);
}

void SurfaceRaster::upload_gloss(const light::GlossPtr& gloss) {
  constexpr int width = core::CM_GLOSS_WIDTH;
  constexpr int height = core::CM_GLOSS_HEIGHT;
  constexpr int levels = core::CM_GLOSS_LEVELS;
  if (!gloss_)
    gloss_ = gl::make_texture_2d_array(gl_, GL_RGBA32F, width, height, levels, "creating what glossy surfaces see");
  // Without one the shader does not look.
  if (!gloss || uploaded_gloss_ == gloss) return;
  gl_->TextureSubImage3D(gloss_.name(), 0, 0, 0, 0, width, height, levels, GL_RGBA, GL_FLOAT, gloss->data());
  uploaded_gloss_ = gloss;
}

void SurfaceRaster::upload_view(const SurfaceView& view, const SurfaceLighting& lighting) {
  const glm::dmat3 matrix = to_view(view);
  const glm::vec3 eye(view.eye);
  const glm::dvec2 depth = content_ ? depth_of(view, matrix, content_->pose_->low, content_->pose_->high)
                                    : depth_of(view, matrix, view.eye, view.eye);
  CmSurfaceView block{};
  block.eye_high = glm::vec4(eye, 0.0F);
  block.eye_low = glm::vec4(glm::vec3(view.eye - glm::dvec3(eye)), 0.0F);
  block.to_view_x = glm::vec4(glm::vec3(matrix[0]), 0.0F);
  block.to_view_y = glm::vec4(glm::vec3(matrix[1]), 0.0F);
  block.to_view_z = glm::vec4(glm::vec3(matrix[2]), 0.0F);
  block.depth = glm::vec4(depth.x, depth.y, 0.0, view.orthographic ? 1.0 : 0.0);
  block.forward = glm::vec4(glm::vec3(glm::normalize(view.forward)), 0.0F);
  block.sun_direction = glm::vec4(lighting.sun_direction, 0.0F);
  block.sun_irradiance = glm::vec4(lighting.sun_irradiance, 0.0F);
  block.sky_radiance = glm::vec4(lighting.sky_radiance, 0.0F);
  block.sky = block_of(lighting.sky);
  block.sky_turn = glm::vec4(lighting.sky_turn, lighting.gloss_strength, 0.0F);
  const std::span<const surface::PunctualLight> lamps =
      content_ ? std::span(content_->pose_->lights) : std::span<const surface::PunctualLight>();
  light::Lamps of_host = lighting.lamps;
  for (light::Lamp& lamp : of_host) {
    // Lit from its middle alone: there a wide sun's disc is brighter than on average.
    if (lamp.kind == light::Lamp::Kind::sun) lamp.angle = 0.0;
  }
  const std::vector<CmLamp> records = light::lamp_records(of_host, lamps, view.eye);
  block.counts.x = static_cast<std::uint32_t>(records.size());
  block.counts.y = lighting.gloss && lighting.gloss_strength > 0.0F ? 1U : 0U;
  gl_->NamedBufferSubData(view_block_.name(), 0, sizeof(block), &block);

  const std::size_t bytes = std::max<std::size_t>(records.size(), 1) * sizeof(CmLamp);
  if (!light_buffer_ || light_bytes_ < bytes) {
    light_buffer_ = gl::make_buffer(gl_, bytes, nullptr, GL_DYNAMIC_STORAGE_BIT, "creating the surfaces' lights");
    light_bytes_ = bytes;
  }
  if (!records.empty()) {
    gl_->NamedBufferSubData(light_buffer_.name(), 0, static_cast<GLsizeiptr>(records.size() * sizeof(CmLamp)),
                            records.data());
  }
  gl_->BindBufferBase(GL_UNIFORM_BUFFER, core::CM_UNIFORM_SURFACE_VIEW, view_block_.name());
  gl_->BindBufferBase(GL_SHADER_STORAGE_BUFFER, core::CM_STORAGE_LAMPS, light_buffer_.name());
}

void SurfaceRaster::draw_batches(std::span<const Batch> batches, bool mirrored) const {
  const auto& gl = *gl_;
  const RasterContent::Fixed& fixed = *content_->fixed_;
  const scene::RasterSource& source = *fixed.source;
  const gl::Program* program = nullptr;
  std::optional<std::uint32_t> bound;
  const auto material_of = [&](const Batch& batch) {
    return surface::material_of(*source.scene, *content_->pose_, batch.draw);
  };
  for (std::size_t b = 0; b < batches.size();) {
    const Batch& batch = batches[b];
    const std::uint32_t index = material_of(batch);
    const scene::RasterSource::Material& material = source.materials[index];
    if (program != fixed.program_of[index]) fixed.program_of[index]->use(gl);
    program = fixed.program_of[index];
    if (bound != index) {
      for (GLuint i = 0; i < material.maps.size(); ++i) {
        const auto& map = material.maps[i];
        const GLuint unit = core::CM_UNIT_MAPS + i;
        gl.BindTextureUnit(unit, map ? fixed.shared->textures[map->texture].name() : white_.name());
        gl.BindSampler(unit, map ? fixed.shared->samplers[map->sampler].name() : 0);
      }
      gl.BindBufferRange(GL_UNIFORM_BUFFER, core::CM_UNIFORM_MATERIAL, fixed.material_block.name(),
                         static_cast<GLintptr>(scene::RasterSource::material_stride * index), sizeof(CmMaterial));
      if (material.double_sided || content_->pose_->double_sided) {
        gl.Disable(GL_CULL_FACE);
      } else {
        gl.Enable(GL_CULL_FACE);
      }
      bound = index;
    }
    // The picture stands on its head in the target, which turns the winding round.
    const std::uint8_t flipped = content_->pose_->flipped[batch.draw];
    gl.FrontFace(mirrored == (flipped != 0) ? GL_CW : GL_CCW);
    // Copies of a mesh come one after the other: one call draws them all.
    std::uint64_t count = batch.count;
    for (++b; b < batches.size(); ++b) {
      const Batch& next = batches[b];
      if (next.first != batch.first + count || count + next.count > std::numeric_limits<GLsizei>::max() ||
          content_->pose_->flipped[next.draw] != flipped || material_of(next) != index) {
        break;
      }
      count += next.count;
    }
    const std::uintptr_t offset = std::uintptr_t{batch.first} * sizeof(std::uint32_t);
    // NOLINTNEXTLINE(performance-no-int-to-ptr): so GL takes offsets
    const void* start = reinterpret_cast<const void*>(offset);
    gl.DrawElements(GL_TRIANGLES, static_cast<GLsizei>(count), GL_UNSIGNED_INT, start);
  }
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
  const bool drawable = content_ != nullptr && content_->drawable();
  if (drawable) {
    vertex_array = gl::make_vertex_array(gl_);
    const GLuint array = vertex_array.name();
    gl.VertexArrayVertexBuffer(array, 0, content_->posed_.name(), 0, sizeof(surface::PosedVertex));
    gl.VertexArrayVertexBuffer(array, 1, content_->fixed_->shared->attributes.name(), 0,
                               sizeof(surface::VertexAttributes));
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
    gl.BindVertexArray(array);
    gl.BindTextureUnit(core::CM_UNIT_GGX_ALBEDO, albedo_table_.name());
    gl.BindSampler(core::CM_UNIT_GGX_ALBEDO, table_sampler_.name());
    upload_gloss(lighting.gloss);
    gl.BindTextureUnit(core::CM_UNIT_GLOSS, gloss_.name());
    gl.BindSampler(core::CM_UNIT_GLOSS, gloss_sampler_.name());
  }
  gl.BindFramebuffer(GL_DRAW_FRAMEBUFFER, target);
  gl.ViewportIndexedf(0, 0.0F, 0.0F, static_cast<GLfloat>(size.x), static_cast<GLfloat>(size.y));
  gl.ClipControl(GL_LOWER_LEFT, GL_ZERO_TO_ONE);
  gl.Enable(GL_DEPTH_TEST);
  gl.DepthFunc(GL_GREATER);
  gl.CullFace(GL_BACK);
  // Blended ones: colours over each other, and the nearest z.
  gl.BlendEquationSeparatei(0, GL_FUNC_ADD, GL_FUNC_ADD);
  gl.BlendFuncSeparatei(0, GL_ONE, GL_ONE_MINUS_SRC_ALPHA, GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
  gl.BlendEquationSeparatei(1, GL_MIN, GL_MIN);
  for (GLuint i = 0; i < buffers.size(); ++i) gl.ColorMaski(i, GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
  const auto clear_to = [&](unsigned layer) {
    gl.NamedFramebufferTextureLayer(target, GL_COLOR_ATTACHMENT0, into.colour.name(), 0, static_cast<GLint>(layer));
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
      for (const gl::Program* program : content_->fixed_->program_of) {
        gl.ProgramUniform2f(program->name(), 0, shift.x, shift.y);
      }
      gl.VertexArrayElementBuffer(vertex_array.name(), content_->fixed_->shared->indices.name());
      draw_batches(content_->scene().solid, mirrored);
    }
    if (!into.blended) continue;
    clear_to(layers + layer);
    if (!drawable) continue;
    for (GLuint i = 0; i < buffers.size(); ++i) gl.Enablei(GL_BLEND, i);
    gl.DepthMask(GL_FALSE);
    gl.VertexArrayElementBuffer(vertex_array.name(), content_->fixed_->sorted_indices.name());
    draw_batches(sorted_, mirrored);
    for (GLuint i = 0; i < buffers.size(); ++i) gl.Disablei(GL_BLEND, i);
  }
  gl::check(gl, "drawing the surfaces");
}

}  // namespace cumulet::render
