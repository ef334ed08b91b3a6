#include "render/passes/denoised.hpp"

#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

#include "denoise/denoiser.hpp"
#include "gl/bindings.hpp"
#include "shader_macros.hpp"

namespace cumulet::render {

namespace {

// Size of one dispatch: it takes milliseconds on slow devices.
constexpr double step_multiply_adds = 2e9;

gl::ProgramKey guides_key(const Denoising& denoising) {
  return {"denoise_guides.comp",
          {gl::macros::background(denoising.with_background), gl::macros::known(denoising.known_light)}};
}

std::vector<glm::vec4> read(const gl::Functions& gl, const gl::Object& texture, glm::uvec2 size) {
  std::vector<glm::vec4> pixels(std::size_t{size.x} * size.y);
  gl.GetTextureImage(texture.name(), 0, GL_RGBA, GL_FLOAT, static_cast<GLsizei>(pixels.size() * sizeof(glm::vec4)),
                     pixels.data());
  return pixels;
}

/// The guides in main memory, for a library.
class LibraryGuides {
 public:
  LibraryGuides(gl::FunctionsPtr gl, glm::uvec2 size, const gl::Object& albedo, const gl::Object& normal)
      : gl_(std::move(gl)), size_(size), albedo_(read(*gl_, albedo, size)), normal_(read(*gl_, normal, size)) {}

  /// Denoises one texture into another one.
  void denoise(const denoise::OidnLibrary& library, const gl::Object& from, const gl::Object& to) const {
    const std::vector<glm::vec4> color = read(*gl_, from, size_);
    gl::check(*gl_, "reading the denoiser's input");
    std::vector<glm::vec4> result(color.size());
    library.denoise({size_, color, albedo_, normal_}, result);
    gl_->TextureSubImage2D(to.name(), 0, 0, 0, static_cast<GLsizei>(size_.x), static_cast<GLsizei>(size_.y), GL_RGBA,
                           GL_FLOAT, result.data());
    gl::check(*gl_, "uploading the denoised image");
  }

 private:
  gl::FunctionsPtr gl_;
  glm::uvec2 size_;
  std::vector<glm::vec4> albedo_;
  std::vector<glm::vec4> normal_;
};

}  // namespace

gl::Object denoised(const gl::FunctionsPtr& gl, const gl::ProgramsPtr& programs, const Picture& picture,
                    const Denoising& denoising) {
  const gl::DebugGroup group(*gl, "cumulet: denoised image");
  const glm::uvec2 size = picture.box().size;
  const glm::ivec2 first(picture.box().first);
  const auto make = [&](const char* what) {
    return gl::make_texture_2d(gl, GL_RGBA32F, static_cast<int>(size.x), static_cast<int>(size.y), what);
  };
  const gl::Object color = make("creating the denoiser's input");
  const gl::Object albedo = make("creating the denoiser's albedo");
  const gl::Object normal = make("creating the denoiser's normals");
  gl::Object result = make("creating the denoised image");
  gl::Object missing;
  if (denoising.known_light) missing = make("creating the negative residual for the denoiser");

  const Film& film = picture.film();
  const auto bind = [&](GLint unit, const FilmLayer& layer) {
    gl->BindTextureUnit(static_cast<GLuint>(unit), film.texture(layer));
  };
  const auto write = [&](GLint unit, const gl::Object& texture, GLenum access = GL_WRITE_ONLY) {
    gl->BindImageTexture(static_cast<GLuint>(unit), texture.name(), 0, GL_FALSE, 0, access, GL_RGBA32F);
  };
  const auto dispatch = [&](const gl::Program& program, const char* what) {
    program.use(*gl);
    gl->DispatchCompute((size.x + 7) / 8, (size.y + 7) / 8, 1);
    gl::memory_barrier(*gl, GL_TEXTURE_FETCH_BARRIER_BIT | GL_TEXTURE_UPDATE_BARRIER_BIT);
    gl::check(*gl, what);
  };

  const gl::Program& guides = programs->get(guides_key(denoising));
  bind(core::CM_UNIT_SUM, film_layers::radiance);
  bind(core::CM_UNIT_COUNTS, film_layers::counts);
  bind(core::CM_UNIT_BACKGROUND, film_layers::background);
  bind(core::CM_UNIT_GUIDE_ALBEDO, film_layers::albedo);
  bind(core::CM_UNIT_GUIDE_NORMAL, film_layers::normal);
  bind(core::CM_UNIT_GUIDE_TRANSMITTANCE, film_layers::transmittance);
  bind(core::CM_UNIT_GUIDE_EMISSION, film_layers::emission);
  write(core::CM_IMAGE_GUIDE_COLOR, color);
  write(core::CM_IMAGE_GUIDE_ALBEDO, albedo);
  write(core::CM_IMAGE_GUIDE_NORMAL, normal);
  if (denoising.known_light) write(core::CM_IMAGE_GUIDE_MISSING, missing);
  const glm::vec3 medium = denoising.medium_albedo;
  gl->ProgramUniform3f(guides.name(), 0, medium.x, medium.y, medium.z);
  gl->ProgramUniform2i(guides.name(), 1, first.x, first.y);
  dispatch(guides, "computing the denoiser's guides");

  std::optional<denoise::Denoiser> denoiser;
  std::optional<LibraryGuides> by_library;
  if (denoising.library != nullptr) {
    by_library.emplace(gl, size, albedo, normal);
  } else {
    denoiser.emplace(gl, programs, denoising.network, denoising.max_bytes);
  }
  const auto denoise = [&](const gl::Object& from, const gl::Object& to) {
    if (by_library) return by_library->denoise(*denoising.library, from, to);
    denoiser->begin({size, from.name(), albedo.name(), normal.name(), to.name()});
    denoiser->build();
    while (!denoiser->step(step_multiply_adds)) {
    }
  };
  denoise(color, result);
  if (!denoising.known_light) return result;
  denoise(missing, color);

  const gl::Program& known = programs->get({"denoise_known.comp", {}});
  gl->BindTextureUnit(core::CM_UNIT_DENOISE_COLOR, color.name());
  bind(core::CM_UNIT_GUIDE_TRANSMITTANCE, film_layers::transmittance);
  bind(core::CM_UNIT_GUIDE_EMISSION, film_layers::emission);
  write(core::CM_IMAGE_DENOISED, result, GL_READ_WRITE);
  gl->ProgramUniform2i(known.name(), 0, first.x, first.y);
  dispatch(known, "adding the noise-free component");
  return result;
}

}  // namespace cumulet::render
