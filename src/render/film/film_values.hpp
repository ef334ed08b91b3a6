#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <optional>
#include <span>
#include <vector>

#include "render/film/film.hpp"

namespace cumulet::render {

class Picture;

/// Values per pixel that follow from texels of textures, for example mean radiance from sums and counts. It says which
/// textures are copied, and makes the values of the copies, also when the picture no longer exists.
class FilmValues {
 public:
  struct Source {
    GLuint texture = 0;
    GLenum format = GL_RGBA;
    GLenum type = GL_FLOAT;
    std::size_t texel_bytes = 16;
    std::uint32_t slice = 0;  ///< of an array texture
  };
  /// Copies of the sources, in their order.
  using Copies = std::span<const std::byte* const>;

  /// 4 floats: mean radiance, with or without the background's, and alpha.
  static FilmValues means(const Picture& picture, bool with_background);
  /// 4 floats: the samples that hit the volume before any surface, without background; alpha is their fraction.
  static FilmValues volume(const Picture& picture);
  /// 1 float: standard error of the pixel's luminance, background included; infinity with fewer than two samples.
  static FilmValues errors(const Picture& picture);
  /// 3 floats: mean radiance of a light group. with_background: including the sky and sun that cameras see directly, if
  /// they are in the group.
  static FilmValues light_group(const Picture& picture, std::uint32_t group, bool with_background);
  /// 4 floats: those of a drawn image. opaque: the same image before its background, of which radiance is taken; 0:
  /// none.
  static FilmValues drawn(glm::uvec2 size, GLuint transparent, GLuint opaque);

  [[nodiscard]] glm::uvec2 size() const { return size_; }
  [[nodiscard]] std::size_t pixels() const { return std::size_t{size_.x} * size_.y; }
  /// Floats per pixel.
  [[nodiscard]] std::size_t channels() const { return channels_; }
  [[nodiscard]] std::size_t count() const { return pixels() * channels_; }
  [[nodiscard]] const std::vector<Source>& sources() const { return sources_; }
  [[nodiscard]] std::size_t bytes_of(const Source& source) const { return pixels() * source.texel_bytes; }
  /// Number of the source with the format of the values, whose copy may be in the memory for the values; nullopt: none.
  [[nodiscard]] std::optional<std::size_t> in_place() const { return in_place_; }
  /// Writes count() floats.
  void make(Copies copies, float* values) const { make_(copies, pixels(), values); }

 private:
  using Make = std::function<void(Copies copies, std::size_t pixels, float* values)>;
  FilmValues(glm::uvec2 size, std::size_t channels, std::vector<Source> sources, std::optional<std::size_t> in_place,
             Make make);

  glm::uvec2 size_;
  std::size_t channels_;
  std::vector<Source> sources_;
  std::optional<std::size_t> in_place_;
  Make make_;
};

/// Queues a copy of a source to `to`, or to that offset in the bound pixel pack buffer.
void copy_source(const gl::Functions& gl, const FilmValues& values, const FilmValues::Source& source, void* to);

/// A pixel's samples.
struct PixelError {
  std::uint32_t samples = 0;
  std::uint32_t steps = 0;
  double mean = 0.0;     // luminance
  double squared = 0.0;  // its squared standard error; valid with at least two samples
};
/// Calls visit with each pixel, row by row. copies: of the sources of FilmValues::errors().
void for_each_error(FilmValues::Copies copies, std::size_t pixels,
                    const std::function<void(const PixelError& error)>& visit);

}  // namespace cumulet::render
