#include "render/film_reader.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "base/luminance.hpp"

namespace cumulet::render {

template <class Texel>
std::vector<Texel> FilmReader::texels(const Picture& picture, const FilmLayer& layer, GLenum format,
                                      GLenum type) const {
  std::vector<Texel> texels(std::size_t{picture.size().x} * picture.size().y);
  gl_->GetTextureImage(picture.film().texture(layer), 0, format, type,
                       static_cast<GLsizei>(texels.size() * sizeof(Texel)), texels.data());
  gl::check(*gl_, "reading back the image");
  return texels;
}

void FilmReader::read(const Picture& picture, bool with_background, float* rgba) const {
  read_means(picture, film_layers::radiance, rgba);
  if (!with_background) return;
  const auto background = texels<glm::vec3>(picture, film_layers::background, GL_RGB, GL_FLOAT);
  for (std::size_t i = 0; i < background.size(); ++i) {
    for (int c = 0; c < 3; ++c) rgba[4 * i + static_cast<std::size_t>(c)] += background[i][c];
  }
}

std::vector<glm::uvec2> FilmReader::read_counts(const Picture& picture) const {
  return texels<glm::uvec2>(picture, film_layers::counts, GL_RG_INTEGER, GL_UNSIGNED_INT);
}

void FilmReader::read_means(const Picture& picture, const FilmLayer& sum, float* rgba) const {
  const std::vector<glm::uvec2> counts = read_counts(picture);
  gl_->GetTextureImage(picture.film().texture(sum), 0, GL_RGBA, GL_FLOAT, static_cast<GLsizei>(counts.size() * 16),
                       rgba);
  gl::check(*gl_, "reading back the image");
  for (std::size_t i = 0; i < counts.size(); ++i) {
    const float scale = counts[i].x > 0 ? 1.0F / static_cast<float>(counts[i].x) : 0.0F;
    for (std::size_t c = 0; c < 4; ++c) rgba[4 * i + c] *= scale;
  }
}

void FilmReader::read_light_group(const Picture& picture, std::uint32_t group, bool with_background, float* rgb) const {
  const std::vector<glm::uvec2> counts = read_counts(picture);
  const glm::ivec2 size(picture.size());
  const std::uint32_t groups = picture.light_groups();
  const GLuint layer = picture.film().texture(film_layers::light_groups(groups));
  std::vector<glm::vec3> sums(counts.size(), glm::vec3(0.0F));
  std::vector<glm::vec3> slice(counts.size());
  const auto add = [&](std::uint32_t number) {
    gl_->GetTextureSubImage(layer, 0, 0, 0, static_cast<GLint>(number), size.x, size.y, 1, GL_RGB, GL_FLOAT,
                            static_cast<GLsizei>(slice.size() * sizeof(glm::vec3)), slice.data());
    for (std::size_t i = 0; i < sums.size(); ++i) sums[i] += slice[i];
  };
  add(group);
  const core::CmIntegrator& integrator = picture.parameters().integrator;
  const auto is_of = [&](std::uint32_t other) { return group == (other < groups ? other : 0); };
  if (with_background && is_of(integrator.sky_group)) add(groups);
  if (with_background && is_of(integrator.sun_group)) add(groups + 1);
  gl::check(*gl_, "reading back a light group");
  for (std::size_t i = 0; i < sums.size(); ++i) {
    const glm::vec3 mean = sums[i] / static_cast<float>(std::max(1U, counts[i].x));
    std::memcpy(rgb + 3 * i, &mean, sizeof mean);
  }
}

void FilmReader::read_volume(const Picture& picture, float* rgba) const {
  read_means(picture, film_layers::volume, rgba);
}

void FilmReader::read_feature(const Picture& picture, const AovValues& values_of, float* values) const {
  if (values_of.first == 0 && (values_of.count == 1 || values_of.count == 3)) {
    const std::size_t floats = std::size_t{picture.size().x} * picture.size().y * values_of.count;
    gl_->GetTextureImage(picture.film().texture(values_of.layer), 0, values_of.count == 1 ? GL_RED : GL_RGB, GL_FLOAT,
                         static_cast<GLsizei>(floats * sizeof(float)), values);
    gl::check(*gl_, "reading the feature buffers");
    return;
  }
  for (const glm::vec4& texel : texels<glm::vec4>(picture, values_of.layer, GL_RGBA, GL_FLOAT)) {
    for (std::size_t i = 0; i < values_of.count; ++i) *values++ = texel[static_cast<int>(values_of.first + i)];
  }
}

template <class Visit>
void FilmReader::for_each_error(const Picture& picture, Visit&& visit) const {
  const std::vector<glm::uvec2> counts = read_counts(picture);
  const auto background = texels<glm::vec3>(picture, film_layers::background, GL_RGB, GL_FLOAT);
  const auto squares = texels<float>(picture, film_layers::moments, GL_RED, GL_FLOAT);
  const auto sums = texels<glm::vec4>(picture, film_layers::radiance, GL_RGBA, GL_FLOAT);
  for (std::size_t i = 0; i < counts.size(); ++i) {
    PixelError error;
    error.samples = counts[i].x;
    error.steps = counts[i].y;
    const double n = counts[i].x;
    if (n >= 2.0) {
      error.mean = luminance(glm::dvec3(sums[i]) / n + glm::dvec3(background[i]));
      error.squared = std::max(0.0, double(squares[i]) - error.mean * error.mean) / (n - 1.0);
    }
    visit(error);
  }
}

void FilmReader::read_error(const Picture& picture, float* errors) const {
  for_each_error(picture, [&](const PixelError& error) {
    const bool known = error.samples >= 2;
    *errors++ = known ? static_cast<float>(std::sqrt(error.squared)) : std::numeric_limits<float>::infinity();
  });
}

Totals FilmReader::totals(const Picture& picture) const {
  if (!picture.film().has(film_layers::counts)) return {};
  Totals totals;
  ErrorSums sums;
  for_each_error(picture, [&](const PixelError& pixel) {
    totals.samples += pixel.samples;
    totals.steps += pixel.steps;
    if (pixel.samples < 2) return;
    sums += {pixel.squared, pixel.mean, 1.0};
  });
  totals.noise = sums.noise();
  return totals;
}

}  // namespace cumulet::render
