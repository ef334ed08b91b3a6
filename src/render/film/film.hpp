#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <string_view>
#include <vector>

#include "gl/objects.hpp"

namespace cumulet::render {

/// A named texture of a picture: one texel per pixel, row 0 at the top. It is an array texture if it has slices.
struct FilmLayer {
  const char* name;
  GLenum format;
  unsigned pixel_bytes;  ///< sum over all slices
  unsigned slices = 0;
  bool operator==(const FilmLayer& other) const { return std::string_view(name) == other.name; }
};

/// Pixel transfer format of a layer's texels.
struct PixelTransfer {
  GLenum format;
  GLenum type;
};
[[nodiscard]] PixelTransfer transfer_of(const FilmLayer& layer);

/// The layers that pictures have, beside those of feature buffers (render/film/feature_buffers.hpp).
namespace film_layers {
/// Sums over the samples: radiance in front of the background, and alpha.
inline constexpr FilmLayer radiance{"radiance", GL_RGBA32F, 16};
/// Means over the samples of the background's radiance, already multiplied by 1 - alpha.
inline constexpr FilmLayer background{"background", GL_RGBA32F, 16};  // rgb32f is not an image format
/// Mean over the samples of the squared luminance of radiance plus background, from which the variance is computed.
inline constexpr FilmLayer moments{"moments", GL_R32F, 4};
/// Number of samples, and number of cells traversed.
inline constexpr FilmLayer counts{"counts", GL_RG32UI, 8};
/// Sums of the radiance of samples that hit the volume before any surface; alpha is their number.
inline constexpr FilmLayer volume{"volume", GL_RGBA32F, 16};
/// View depth z at half opacity, to be written to the target's depth; 0 if the volume does not reach that opacity.
inline constexpr FilmLayer depth{"depth", GL_R32F, 4};
/// Sums of radiance per light group, then of the sky and of the sun as cameras see them directly.
constexpr FilmLayer light_groups(unsigned count) { return {"light groups", GL_RGBA32F, 16 * (count + 2), count + 2}; }
}  // namespace film_layers

/// Textures of one picture that passes exchange. A layer exists from the first pass that writes it. Calls that take GL
/// need a current context and an active StateGuard.
class Film {
 public:
  /// Starts a new picture, with no layer written. Textures that the last picture requested are kept for reuse if the
  /// size is the same; others are freed.
  void begin(glm::uvec2 size);
  [[nodiscard]] glm::uvec2 size() const { return size_; }
  /// True if a pass has written the layer for this picture.
  [[nodiscard]] bool has(const FilmLayer& layer) const;
  /// Returns 0 if there is none. Its content is valid only if has() is true.
  [[nodiscard]] GLuint texture(const FilmLayer& layer) const;
  /// Allocates the layer's texture if there is none. Throws Error(out_of_memory, gl).
  void make(const gl::FunctionsPtr& gl, const FilmLayer& layer);
  void drop(const FilmLayer& layer);
  [[nodiscard]] std::uint64_t bytes() const;
  /// Binds the layer to an image unit. If it does not exist, unbinds the unit.
  void bind(const gl::Functions& gl, GLuint unit, const FilmLayer& layer, GLenum access) const;

 private:
  friend bool run(const gl::FunctionsPtr& gl, Film& film, const struct Pass& pass,
                  std::chrono::steady_clock::time_point deadline);
  struct Held {
    FilmLayer layer;
    gl::Object texture;
    bool written = false;
    bool asked = true;  // a pass of this picture requested it
  };
  [[nodiscard]] const Held* find(const FilmLayer& layer) const;

  glm::uvec2 size_{0U};
  std::vector<Held> held_;
};

/// A step that computes layers from layers. Its other inputs are captured in `work`.
struct Pass {
  const char* name;  ///< name of the debug group
  std::vector<FilmLayer> reads;
  std::vector<FilmLayer> writes;  ///< a layer that is also in `reads` is updated in place
  /// Works until about the deadline; returns whether it is done. The next call continues.
  std::function<bool(Film& film, std::chrono::steady_clock::time_point deadline)> work;
};

/// Runs a pass. Missing layers that it writes are allocated, and count as written once the pass is done. Returns
/// whether it is done. Throws Error(internal), naming the pass and the layer, if nothing has written a layer that the
/// pass reads. Throws the errors of allocation and of the pass.
bool run(const gl::FunctionsPtr& gl, Film& film, const Pass& pass, std::chrono::steady_clock::time_point deadline);

}  // namespace cumulet::render
