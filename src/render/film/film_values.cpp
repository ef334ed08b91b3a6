#include "render/film/film_values.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <utility>

#include "base/luminance.hpp"
#include "render/film/picture.hpp"

namespace cumulet::render {

namespace {

using Source = FilmValues::Source;
using Copies = FilmValues::Copies;

Source counts_of(const Picture& picture) {
  return {.texture = picture.film().texture(film_layers::counts),
          .format = GL_RG_INTEGER,
          .type = GL_UNSIGNED_INT,
          .texel_bytes = sizeof(glm::uvec2)};
}

// Also for colors without alpha: drivers copy four floats to a pixel pack buffer on the GPU, but wait and convert
// three.
Source rgba_of(const Picture& picture, const FilmLayer& layer) { return {.texture = picture.film().texture(layer)}; }

template <class Texel>
const Texel* texels(Copies copies, std::size_t source) {
  return reinterpret_cast<const Texel*>(copies[source]);
}

// values: may be the sums themselves.
void divide(const glm::uvec2* counts, const float* sums, std::size_t pixels, float* values) {
  for (std::size_t i = 0; i < pixels; ++i) {
    const float scale = counts[i].x > 0 ? 1.0F / static_cast<float>(counts[i].x) : 0.0F;
    for (std::size_t c = 0; c < 4; ++c) values[4 * i + c] = sums[4 * i + c] * scale;
  }
}

void make_means(Copies copies, std::size_t pixels, float* values) {
  divide(texels<glm::uvec2>(copies, 0), texels<float>(copies, 1), pixels, values);
  if (copies.size() < 3) return;
  const auto* background = texels<float>(copies, 2);
  for (std::size_t i = 0; i < pixels; ++i) {
    for (std::size_t c = 0; c < 3; ++c) values[4 * i + c] += background[4 * i + c];
  }
}

// copies: counts, then the slices to add.
void make_light_group(Copies copies, std::size_t pixels, float* values) {
  const auto* counts = texels<glm::uvec2>(copies, 0);
  for (std::size_t i = 0; i < 3 * pixels; ++i) {
    float sum = 0.0F;
    for (std::size_t slice = 1; slice < copies.size(); ++slice)
      sum += texels<float>(copies, slice)[4 * (i / 3) + i % 3];
    values[i] = sum / static_cast<float>(std::max(1U, counts[i / 3].x));
  }
}

void make_errors(Copies copies, std::size_t pixels, float* values) {
  for_each_error(copies, pixels, [&](const PixelError& error) {
    const bool known = error.samples >= 2;
    *values++ = known ? static_cast<float>(std::sqrt(error.squared)) : std::numeric_limits<float>::infinity();
  });
}

// copies: transparent, opaque.
void make_drawn(Copies copies, std::size_t pixels, float* values) {
  const auto* transparent = texels<float>(copies, 0);
  if (values != transparent) std::memcpy(values, transparent, pixels * sizeof(glm::vec4));
  if (copies.size() < 2) return;
  const auto* opaque = texels<float>(copies, 1);
  for (std::size_t i = 0; i < 4 * pixels; ++i) {
    if (i % 4 != 3) values[i] = opaque[i];
  }
}

}  // namespace

FilmValues::FilmValues(glm::uvec2 size, std::size_t channels, std::vector<Source> sources,
                       std::optional<std::size_t> in_place, Make make)
    : size_(size), channels_(channels), sources_(std::move(sources)), in_place_(in_place), make_(std::move(make)) {}

FilmValues FilmValues::means(const Picture& picture, bool with_background) {
  std::vector<Source> sources{counts_of(picture), rgba_of(picture, film_layers::radiance)};
  if (with_background) sources.push_back(rgba_of(picture, film_layers::background));
  return {picture.size(), 4, std::move(sources), 1, make_means};
}

FilmValues FilmValues::volume(const Picture& picture) {
  return {picture.size(), 4, {counts_of(picture), rgba_of(picture, film_layers::volume)}, 1, make_means};
}

FilmValues FilmValues::errors(const Picture& picture) {
  Source squares = rgba_of(picture, film_layers::moments);
  squares.format = GL_RED;
  squares.texel_bytes = sizeof(float);
  std::vector<Source> sources{counts_of(picture), rgba_of(picture, film_layers::background), squares,
                              rgba_of(picture, film_layers::radiance)};
  return {picture.size(), 1, std::move(sources), 2, make_errors};
}

FilmValues FilmValues::light_group(const Picture& picture, std::uint32_t group, bool with_background) {
  const std::uint32_t groups = picture.light_groups();
  std::vector<Source> sources{counts_of(picture)};
  const auto add = [&](std::uint32_t slice) {
    Source source = rgba_of(picture, film_layers::light_groups(groups));
    source.slice = slice;
    sources.push_back(source);
  };
  add(group);
  const core::CmIntegrator& integrator = picture.parameters().integrator;
  const auto is_of = [&](std::uint32_t other) { return group == (other < groups ? other : 0); };
  if (with_background && is_of(integrator.sky_group)) add(groups);
  if (with_background && is_of(integrator.sun_group)) add(groups + 1);
  return {picture.size(), 3, std::move(sources), std::nullopt, make_light_group};
}

FilmValues FilmValues::drawn(glm::uvec2 size, GLuint transparent, GLuint opaque) {
  std::vector<Source> sources{{.texture = transparent}};
  if (opaque != 0) sources.push_back({.texture = opaque});
  return {size, 4, std::move(sources), 0, make_drawn};
}

void copy_source(const gl::Functions& gl, const FilmValues& values, const FilmValues::Source& source, void* to) {
  // In bands of rows: GL takes sizes below 2^31 bytes.
  const glm::ivec2 size(values.size());
  const std::size_t row_bytes = std::size_t{values.size().x} * source.texel_bytes;
  const std::size_t most = std::numeric_limits<GLsizei>::max() / std::max<std::size_t>(row_bytes, 1);
  const int rows = static_cast<int>(std::clamp<std::size_t>(most, 1, std::max(values.size().y, 1U)));
  for (int y = 0; y < size.y; y += rows) {
    const int height = std::min(rows, size.y - y);
    const std::uintptr_t at = reinterpret_cast<std::uintptr_t>(to) + static_cast<std::size_t>(y) * row_bytes;
    // NOLINTNEXTLINE(performance-no-int-to-ptr): so GL takes offsets
    void* const first_row = reinterpret_cast<void*>(at);
    gl.GetTextureSubImage(source.texture, 0, 0, y, static_cast<GLint>(source.slice), size.x, height, 1, source.format,
                          source.type, static_cast<GLsizei>(static_cast<std::size_t>(height) * row_bytes), first_row);
  }
}

void for_each_error(FilmValues::Copies copies, std::size_t pixels,
                    const std::function<void(const PixelError& error)>& visit) {
  const auto* counts = texels<glm::uvec2>(copies, 0);
  const auto* background = texels<glm::vec4>(copies, 1);
  const auto* squares = texels<float>(copies, 2);
  const auto* sums = texels<glm::vec4>(copies, 3);
  for (std::size_t i = 0; i < pixels; ++i) {
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

}  // namespace cumulet::render
