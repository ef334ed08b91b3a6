#include "render/denoised.hpp"

#include "denoise/denoiser.hpp"
#include "gl/bindings.hpp"

namespace cumulet::render {

namespace {

// Of a dispatch: milliseconds on slow devices.
constexpr double step_multiply_adds = 2e9;

}  // namespace

gl::Object denoised(const gl::FunctionsPtr& gl, const gl::ProgramsPtr& programs, const Picture& picture,
                    const Denoising& denoising) {
  const gl::DebugGroup group(*gl, "cumulet: denoised picture");
  const glm::uvec2 size = picture.box().size;
  const auto make = [&](const char* what) {
    return gl::make_texture_2d(gl, GL_RGBA32F, static_cast<int>(size.x), static_cast<int>(size.y), what);
  };
  const gl::Object colour = make("creating the picture to denoise");
  const gl::Object albedo = make("creating the denoiser's albedo");
  const gl::Object normal = make("creating the denoiser's normals");
  gl::Object result = make("creating the denoised picture");

  const gl::Program& program =
      programs->get({"denoise_guides.comp", {denoising.with_background ? "CM_BACKGROUND 1" : "CM_BACKGROUND 0"}});
  const Film& film = picture.film();
  const auto read = [&](GLint unit, const FilmLayer& layer) {
    gl->BindTextureUnit(static_cast<GLuint>(unit), film.texture(layer));
  };
  read(core::CM_UNIT_SUM, film_layers::radiance);
  read(core::CM_UNIT_COUNTS, film_layers::counts);
  read(core::CM_UNIT_BACKGROUND, film_layers::background);
  read(core::CM_UNIT_GUIDE_ALBEDO, film_layers::albedo);
  read(core::CM_UNIT_GUIDE_NORMAL, film_layers::normal);
  read(core::CM_UNIT_GUIDE_TRANSMITTANCE, film_layers::transmittance);
  const auto write = [&](GLint unit, const gl::Object& texture) {
    gl->BindImageTexture(static_cast<GLuint>(unit), texture.name(), 0, GL_FALSE, 0, GL_WRITE_ONLY, GL_RGBA32F);
  };
  write(core::CM_IMAGE_GUIDE_COLOUR, colour);
  write(core::CM_IMAGE_GUIDE_ALBEDO, albedo);
  write(core::CM_IMAGE_GUIDE_NORMAL, normal);
  const glm::vec3 medium = denoising.medium_albedo;
  const glm::ivec2 first(picture.box().first);
  gl->ProgramUniform3f(program.name(), 0, medium.x, medium.y, medium.z);
  gl->ProgramUniform2i(program.name(), 1, first.x, first.y);
  program.use(*gl);
  gl->DispatchCompute((size.x + 7) / 8, (size.y + 7) / 8, 1);
  gl::memory_barrier(*gl, GL_TEXTURE_FETCH_BARRIER_BIT);
  gl::check(*gl, "making the denoiser's guides");

  denoise::Denoiser denoiser(gl, programs, denoising.network, denoising.most_bytes);
  denoiser.begin({size, colour.name(), albedo.name(), normal.name(), result.name()});
  denoiser.build();
  while (!denoiser.step(step_multiply_adds)) {
  }
  return result;
}

}  // namespace cumulet::render
