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
#include "base/shared_code.hpp"
#include "gl/bindings.hpp"
#include "render/punctual.hpp"
#include "surface/ggx_albedo.hpp"

namespace cumulet::core {
#include "jitter.glsl"
#include "surface_parameters.glsl"
}  // namespace cumulet::core

namespace cumulet::render {

namespace {

using core::CmLight;
using core::CmMaterial;
using core::CmSurfaceView;
using surface::AlphaMode;

std::size_t padded(std::size_t bytes, std::size_t alignment) { return (bytes + alignment - 1) / alignment * alignment; }

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

gl::Object make_scene_texture(const gl::FunctionsPtr& gl, const surface::Image& image, bool srgb, GLint most) {
  const auto width = static_cast<GLsizei>(image.width);
  const auto height = static_cast<GLsizei>(image.height);
  if (image.width > static_cast<std::uint32_t>(most) || image.height > static_cast<std::uint32_t>(most)) {
    throw Error(ErrorCode::unsupported, "image \"" + image.name + "\" is " + std::to_string(image.width) + "x" +
                                            std::to_string(image.height) + "; the GL driver's largest texture is " +
                                            std::to_string(most));
  }
  GLsizei levels = 1;
  while (std::max(width, height) >> levels > 0) ++levels;
  GLuint name = 0;
  gl->CreateTextures(GL_TEXTURE_2D, 1, &name);
  gl::Object texture(gl, gl::Object::Kind::texture, name);
  gl->TextureStorage2D(name, levels, srgb ? GL_SRGB8_ALPHA8 : GL_RGBA8, width, height);
  gl->TextureSubImage2D(name, 0, 0, 0, width, height, GL_RGBA, GL_UNSIGNED_BYTE, image.rgba.data());
  gl->GenerateTextureMipmap(name);
  gl::check(*gl, "uploading a texture of the scene");
  return texture;
}

std::array<const surface::TextureUse*, core::CM_MAPS> uses_of(const surface::Material& m) {
  return {&m.base_color_texture,     &m.metallic_roughness_texture, &m.normal_texture,
          &m.occlusion_texture,      &m.emission_texture,           &m.specular_texture,
          &m.specular_color_texture, &m.clearcoat_texture,          &m.clearcoat_roughness_texture,
          &m.transmission_texture};
}

bool is_colour(int map) {
  return map == core::CM_MAP_BASE_COLOR || map == core::CM_MAP_EMISSION || map == core::CM_MAP_SPECULAR_COLOR;
}

CmMaterial block_of(const surface::Material& m) {
  CmMaterial block{};
  block.base_color = m.base_color;
  block.emission = glm::vec4(m.emission, m.alpha_cutoff);
  block.reflection = glm::vec4(m.metallic, m.roughness, m.normal_scale, m.occlusion_strength);
  const float r = m.ior > 0.0F ? (m.ior - 1.0F) / (m.ior + 1.0F) : 1.0F;
  block.specular = glm::vec4(m.specular_color * (r * r), m.specular);
  block.coat = glm::vec4(m.clearcoat, m.clearcoat_roughness, m.transmission, 0.0F);
  block.flags.z = m.unlit ? 1U : 0U;
  const auto uses = uses_of(m);
  for (std::size_t map = 0; map < uses.size(); ++map) {
    const surface::TextureUse& use = *uses[map];
    if (use.uv_set == 1) block.flags.y |= 1U << map;
    for (int row = 0; row < 2; ++row) {
      block.uv_rows[2 * map + static_cast<std::size_t>(row)] =
          glm::vec4(use.transform[0][row], use.transform[1][row], use.transform[2][row], 0.0F);
    }
  }
  return block;
}

}  // namespace

glm::vec2 surface_jitter(unsigned layer, unsigned layers) { return core::cm_layer_jitter(layer, layers); }

void SurfaceRaster::upload_textures(Assets& assets) const {
  const surface::Scene& scene = *assets.scene;
  GLint most = 0;
  gl_->GetIntegerv(GL_MAX_TEXTURE_SIZE, &most);
  // An image that serves as colour and as data becomes two textures.
  std::map<std::pair<std::uint32_t, bool>, GLuint> made;
  std::map<std::tuple<GLint, GLint, GLint, surface::Filter>, GLuint> samplers;
  const auto texture_of = [&](std::uint32_t image, bool srgb) {
    GLuint& name = made[{image, srgb}];
    if (name == 0) {
      assets.textures.push_back(make_scene_texture(gl_, scene.images.at(image), srgb, most));
      assets.bytes += scene.images.at(image).rgba.size() * 4 / 3;  // with its smaller levels
      name = assets.textures.back().name();
    }
    return name;
  };
  const auto sampler_of = [&](const surface::Sampler& sampler) {
    GLuint& name = samplers[{wrap_of(sampler.wrap_s), wrap_of(sampler.wrap_t), minify_of(sampler), sampler.magnify}];
    if (name == 0) {
      assets.samplers.push_back(make_scene_sampler(gl_, sampler));
      name = assets.samplers.back().name();
    }
    return name;
  };
  for (const surface::Material& material : scene.materials) {
    Material& result = assets.materials.emplace_back();
    // What transmits is drawn as what blends.
    result.pass = material.transmission > 0.0F && !material.unlit ? AlphaMode::blend : material.alpha_mode;
    result.double_sided = material.double_sided;
    const auto uses = uses_of(material);
    for (std::size_t map = 0; map < uses.size(); ++map) {
      if (uses[map]->texture < 0) continue;
      const surface::Texture& texture = scene.textures.at(static_cast<std::size_t>(uses[map]->texture));
      result.maps[map] = {texture_of(texture.image, is_colour(static_cast<int>(map))), sampler_of(texture.sampler)};
    }
  }
}

void SurfaceRaster::make_programs(Assets& assets) const {
  for (std::size_t i = 0; i < assets.materials.size(); ++i) {
    const surface::Material& material = assets.scene->materials[i];
    std::uint32_t used = 0;
    const auto uses = uses_of(material);
    for (std::size_t map = 0; map < uses.size(); ++map) used |= uses[map]->texture >= 0 ? 1U << map : 0U;
    const bool coated = material.clearcoat > 0.0F;
    const gl::Program& program =
        programs_->get({"surface.frag",
                        {"CM_ALPHA " + std::to_string(static_cast<int>(assets.materials[i].pass)),
                         "CM_USED " + std::to_string(used), coated ? "CM_COATED 1" : "CM_COATED 0"},
                        "surface.vert"});
    assets.materials[i].program = &program;
    if (std::ranges::find(assets.programs, &program) == assets.programs.end()) assets.programs.push_back(&program);
  }
}

void SurfaceRaster::upload_materials(Assets& assets) const {
  GLint alignment = 1;
  gl_->GetIntegerv(GL_UNIFORM_BUFFER_OFFSET_ALIGNMENT, &alignment);
  const std::size_t stride = padded(sizeof(CmMaterial), static_cast<std::size_t>(std::max(alignment, 1)));
  std::vector<std::byte> bytes(stride * assets.scene->materials.size());
  for (std::size_t i = 0; i < assets.scene->materials.size(); ++i) {
    const CmMaterial block = block_of(assets.scene->materials[i]);
    std::memcpy(bytes.data() + i * stride, &block, sizeof(block));
  }
  assets.material_stride = static_cast<GLintptr>(stride);
  if (!bytes.empty()) {
    assets.material_block = gl::make_buffer(gl_, bytes.size(), bytes.data(), 0, "uploading the scene's materials");
  }
}

void SurfaceRaster::prepare_draws(Assets& assets) const {
  const std::vector<surface::Draw>& draws = assets.scene->draws;
  for (std::uint32_t i = 0; i < draws.size(); ++i) {
    const surface::Draw& draw = draws[i];
    if (draw.index_count == 0) continue;
    if (assets.materials.at(draw.material).pass != AlphaMode::blend) {
      assets.solid.push_back({draw.first_index, draw.index_count, i});
      continue;
    }
    for (std::uint32_t t = 0; t < draw.index_count; t += 3) assets.blended.push_back({draw.first_index + t, 3, i});
  }
  std::stable_sort(assets.solid.begin(), assets.solid.end(), [&](const Batch& a, const Batch& b) {
    const auto key = [&](const Batch& batch) {
      const std::uint32_t material = draws[batch.draw].material;
      return std::pair(assets.materials[material].pass, material);
    };
    return key(a) < key(b);
  });
  if (!assets.blended.empty()) {
    assets.sorted_indices = gl::make_buffer(gl_, assets.blended.size() * 3 * sizeof(std::uint32_t), nullptr,
                                            GL_DYNAMIC_STORAGE_BIT, "creating the indices of blended triangles");
  }
}

void SurfaceRaster::set_scene(surface::ScenePtr scene) {
  Assets assets;
  assets.scene = std::move(scene);
  if (assets.scene != nullptr) {
    const surface::Scene& s = *assets.scene;
    upload_textures(assets);
    make_programs(assets);
    upload_materials(assets);
    prepare_draws(assets);
    if (!s.attributes.empty() && !s.indices.empty()) {
      static_assert(sizeof(surface::VertexAttributes) == 32 && sizeof(surface::PosedVertex) == 40);
      assets.attributes = gl::make_buffer(gl_, s.attributes.size() * sizeof(surface::VertexAttributes),
                                          s.attributes.data(), 0, "uploading the scene's vertices");
      assets.indices = gl::make_buffer(gl_, s.indices.size() * sizeof(std::uint32_t), s.indices.data(), 0,
                                       "uploading the scene's indices");
      assets.posed = gl::make_buffer(gl_, s.attributes.size() * sizeof(surface::PosedVertex), nullptr,
                                     GL_DYNAMIC_STORAGE_BIT, "creating the scene's posed vertices");
      assets.bytes += s.attributes.size() * (sizeof(surface::VertexAttributes) + sizeof(surface::PosedVertex)) +
                      (s.indices.size() + assets.blended.size() * 3) * sizeof(std::uint32_t);
    }
  }
  assets_ = std::move(assets);
  content_ = std::make_shared<char>();
  posed_ = false;
  flipped_.clear();
  lights_.clear();
  centres_.clear();
  sorted_.clear();
  sorted_view_.reset();
}

void SurfaceRaster::set_pose(const surface::Pose& pose) {
  const surface::Scene* scene = assets_.scene.get();
  if (scene == nullptr || pose.vertices.size() != scene->attributes.size()) {
    throw Error(ErrorCode::internal, "a pose of another scene");
  }
  content_ = std::make_shared<char>();
  std::vector<glm::vec3> centres;
  centres.reserve(assets_.blended.size());
  for (const Batch& triangle : assets_.blended) {
    glm::vec3 centre(0.0F);
    for (std::uint32_t i = 0; i < 3; ++i) {
      centre += pose.vertices[scene->indices[triangle.first + i]].position * (1.0F / 3.0F);
    }
    centres.push_back(centre);
  }
  flipped_ = pose.flipped;
  flipped_.resize(scene->draws.size(), 0);
  double_sided_ = pose.double_sided;
  lights_ = pose.lights;
  low_ = pose.low;
  high_ = pose.high;
  centres_ = std::move(centres);
  sorted_view_.reset();
  if (assets_.posed) {
    gl_->NamedBufferSubData(assets_.posed.name(), 0,
                            static_cast<GLsizeiptr>(pose.vertices.size() * sizeof(surface::PosedVertex)),
                            pose.vertices.data());
    gl::check(*gl_, "uploading the scene's posed vertices");
  }
  posed_ = static_cast<bool>(assets_.posed);
}

void SurfaceRaster::sort_blended(const SurfaceView& view) {
  if (assets_.blended.empty() || sorted_view_ == view) return;
  const glm::dmat3 matrix = to_view(view);
  const glm::dvec3 row(matrix[0][2], matrix[1][2], matrix[2][2]);
  std::vector<double> z(centres_.size());
  std::transform(centres_.begin(), centres_.end(), z.begin(),
                 [&](const glm::vec3& centre) { return glm::dot(row, glm::dvec3(centre) - view.eye); });
  std::vector<std::uint32_t> order(centres_.size());
  std::iota(order.begin(), order.end(), 0U);
  std::stable_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) { return z[a] > z[b]; });
  std::vector<std::uint32_t> indices;
  indices.reserve(order.size() * 3);
  sorted_.clear();
  for (const std::uint32_t i : order) {
    const Batch& triangle = assets_.blended[i];
    if (sorted_.empty() || sorted_.back().draw != triangle.draw) {
      sorted_.push_back({static_cast<std::uint32_t>(indices.size()), 0, triangle.draw});
    }
    sorted_.back().count += 3;
    const auto first = assets_.scene->indices.begin() + triangle.first;
    indices.insert(indices.end(), first, first + 3);
  }
  gl_->NamedBufferSubData(assets_.sorted_indices.name(), 0,
                          static_cast<GLsizeiptr>(indices.size() * sizeof(std::uint32_t)), indices.data());
  sorted_view_ = view;
}

void SurfaceRaster::make_targets(glm::uvec2 size, unsigned layers, SurfaceLayers& into) {
  const auto width = static_cast<int>(size.x);
  const auto height = static_cast<int>(size.y);
  const bool blended = !assets_.blended.empty();
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
  view_block_ = gl::make_buffer(gl_, sizeof(CmSurfaceView), nullptr, GL_DYNAMIC_STORAGE_BIT, what);
}

void SurfaceRaster::upload_view(const SurfaceView& view, const SurfaceLighting& lighting) {
  const glm::dmat3 matrix = to_view(view);
  const glm::vec3 eye(view.eye);
  const glm::dvec2 depth = depth_of(view, matrix, low_, high_);
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
  block.counts.x = static_cast<std::uint32_t>(lights_.size());
  gl_->NamedBufferSubData(view_block_.name(), 0, sizeof(block), &block);

  const std::size_t bytes = std::max<std::size_t>(lights_.size(), 1) * sizeof(CmLight);
  if (!light_buffer_ || light_bytes_ < bytes) {
    light_buffer_ = gl::make_buffer(gl_, bytes, nullptr, GL_DYNAMIC_STORAGE_BIT, "creating the surfaces' lights");
    light_bytes_ = bytes;
  }
  std::vector<CmLight> lights;
  lights.reserve(lights_.size());
  for (const surface::PunctualLight& light : lights_) lights.push_back(punctual_light(light, view.eye));
  if (!lights.empty()) {
    gl_->NamedBufferSubData(light_buffer_.name(), 0, static_cast<GLsizeiptr>(lights.size() * sizeof(CmLight)),
                            lights.data());
  }
  gl_->BindBufferBase(GL_UNIFORM_BUFFER, core::CM_UNIFORM_SURFACE_VIEW, view_block_.name());
  gl_->BindBufferBase(GL_SHADER_STORAGE_BUFFER, core::CM_STORAGE_LAMPS, light_buffer_.name());
}

void SurfaceRaster::draw_batches(std::span<const Batch> batches, bool mirrored) const {
  const auto& gl = *gl_;
  const gl::Program* program = nullptr;
  std::optional<std::uint32_t> bound;
  for (const Batch& batch : batches) {
    const std::uint32_t index = assets_.scene->draws[batch.draw].material;
    const Material& material = assets_.materials[index];
    if (program != material.program) material.program->use(gl);
    program = material.program;
    if (bound != index) {
      for (GLuint i = 0; i < material.maps.size(); ++i) {
        const Map& map = material.maps[i];
        const GLuint unit = core::CM_UNIT_MAPS + i;
        gl.BindTextureUnit(unit, map.texture != 0 ? map.texture : white_.name());
        gl.BindSampler(unit, map.sampler);
      }
      gl.BindBufferRange(GL_UNIFORM_BUFFER, core::CM_UNIFORM_MATERIAL, assets_.material_block.name(),
                         assets_.material_stride * static_cast<GLintptr>(index), sizeof(CmMaterial));
      if (material.double_sided || double_sided_) {
        gl.Disable(GL_CULL_FACE);
      } else {
        gl.Enable(GL_CULL_FACE);
      }
      bound = index;
    }
    // The picture stands on its head in the target, which turns the winding round.
    gl.FrontFace(mirrored == (flipped_[batch.draw] != 0) ? GL_CW : GL_CCW);
    const std::uintptr_t offset = std::uintptr_t{batch.first} * sizeof(std::uint32_t);
    // NOLINTNEXTLINE(performance-no-int-to-ptr): so GL takes offsets
    const void* start = reinterpret_cast<const void*>(offset);
    gl.DrawElements(GL_TRIANGLES, static_cast<GLsizei>(batch.count), GL_UNSIGNED_INT, start);
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
  if (posed_) {
    vertex_array = gl::make_vertex_array(gl_);
    const GLuint array = vertex_array.name();
    gl.VertexArrayVertexBuffer(array, 0, assets_.posed.name(), 0, sizeof(surface::PosedVertex));
    gl.VertexArrayVertexBuffer(array, 1, assets_.attributes.name(), 0, sizeof(surface::VertexAttributes));
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
    for (const gl::Program* program : assets_.programs) gl.ProgramUniform2f(program->name(), 0, shift.x, shift.y);
    if (posed_) {
      gl.VertexArrayElementBuffer(vertex_array.name(), assets_.indices.name());
      draw_batches(assets_.solid, mirrored);
    }
    if (!into.blended) continue;
    clear_to(layers + layer);
    if (!posed_) continue;
    for (GLuint i = 0; i < buffers.size(); ++i) gl.Enablei(GL_BLEND, i);
    gl.DepthMask(GL_FALSE);
    gl.VertexArrayElementBuffer(vertex_array.name(), assets_.sorted_indices.name());
    draw_batches(sorted_, mirrored);
    for (GLuint i = 0; i < buffers.size(); ++i) gl.Disablei(GL_BLEND, i);
  }
  gl::check(gl, "drawing the surfaces");
}

}  // namespace cumulet::render
