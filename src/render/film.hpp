#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <string_view>
#include <vector>

#include "gl/objects.hpp"

namespace cumulet::render {

/// A texture of a picture, by its name: a texel a pixel, row 0 the top; an array where it has slices.
struct FilmLayer {
  const char* name;
  GLenum format;
  unsigned pixel_bytes;  ///< of all slices together
  unsigned slices = 0;
  bool operator==(const FilmLayer& other) const { return std::string_view(name) == other.name; }
};

/// The layers that pictures have. glsl/aovs.comp says more of those that it writes.
namespace film_layers {
/// Sums over the samples: radiance in front of the background, and alpha.
inline constexpr FilmLayer radiance{"radiance", GL_RGBA32F, 16};
/// Means over the samples of the background's radiance, which alpha is already taken off.
inline constexpr FilmLayer background{"background", GL_RGBA32F, 16};  // rgb32f is no image format
/// Means over the samples of the squared luminance of both, of which the variance is made.
inline constexpr FilmLayer moments{"moments", GL_R32F, 4};
/// Samples, and cells marched.
inline constexpr FilmLayer counts{"counts", GL_RG32UI, 8};
/// As radiance, of the samples that met the volume before any surface; alpha is their number.
inline constexpr FilmLayer volume{"volume", GL_RGBA32F, 16};
/// View depth z at half opacity, to be written as depth; 0 where the volume is not so opaque.
inline constexpr FilmLayer depth{"depth", GL_R32F, 4};
inline constexpr FilmLayer normal{"normal", GL_RGBA32F, 16};
inline constexpr FilmLayer albedo{"albedo", GL_RGBA32F, 16};
/// Of the volume; the share of a pixel that surfaces cover; how many rays facts are of, and how they spread.
inline constexpr FilmLayer transmittance{"transmittance", GL_RGBA32F, 16};
inline constexpr FilmLayer surface_z{"surface z", GL_R32F, 4};
/// Of half opacity; the share of a pixel that the ground covers.
inline constexpr FilmLayer volume_z{"volume z", GL_RG32F, 8};
inline constexpr FilmLayer emission{"emission", GL_RGBA32F, 16};
inline constexpr FilmLayer velocity{"velocity", GL_RGBA32F, 16};
/// Of what is solid, or else the background; and of the volume.
inline constexpr FilmLayer motion{"motion", GL_RGBA32F, 16};
/// As radiance, of so many groups of lights; then of what cameras see of the sky and of the sun.
constexpr FilmLayer light_groups(unsigned count) { return {"light groups", GL_RGBA32F, 16 * (count + 2), count + 2}; }
}  // namespace film_layers

/// What passes leave for each other, of one picture. Layers are there from the first pass that writes them on.
/// Calls that take GL need the context current and a StateGuard around.
class Film {
 public:
  /// A picture anew: nothing is written. Textures of the same size that the last one asked for wait to be
  /// written again, others go.
  void begin(glm::uvec2 size);
  [[nodiscard]] glm::uvec2 size() const { return size_; }
  /// Whether a pass has written it, of this picture.
  [[nodiscard]] bool has(const FilmLayer& layer) const;
  /// 0: there is none. Its content counts where has() says so.
  [[nodiscard]] GLuint texture(const FilmLayer& layer) const;
  /// Throws Error(out_of_memory, gl).
  void make(const gl::FunctionsPtr& gl, const FilmLayer& layer);
  void drop(const FilmLayer& layer);
  [[nodiscard]] std::uint64_t bytes() const;
  /// Binds it for a pass that works on it; without it, nothing that fits.
  void bind(const gl::Functions& gl, GLuint unit, const FilmLayer& layer, GLenum access) const;

 private:
  friend bool run(const gl::FunctionsPtr& gl, Film& film, const struct Pass& pass,
                  std::chrono::steady_clock::time_point deadline);
  struct Held {
    FilmLayer layer;
    gl::Object texture;
    bool written = false;
    bool asked = true;  // for, by a pass of this picture
  };
  [[nodiscard]] const Held* find(const FilmLayer& layer) const;

  glm::uvec2 size_{0U};
  std::vector<Held> held_;
};

/// A step that makes layers of layers. What it needs beside the film it has from whoever makes it.
struct Pass {
  const char* name;  ///< a debug group's
  std::vector<FilmLayer> reads;
  std::vector<FilmLayer> writes;  ///< and goes on with, where they are read as well
  /// Works until about the deadline; returns whether it is done. Goes on in the next call.
  std::function<bool(Film& film, std::chrono::steady_clock::time_point deadline)> work;
};

/// Runs a pass. The layers that it writes are made where there are none, and count as written once it is done; returns
/// whether it is. Throws Error(internal) that names the pass and a layer which it reads and nothing has written, and
/// what making layers and the pass throw.
bool run(const gl::FunctionsPtr& gl, Film& film, const Pass& pass, std::chrono::steady_clock::time_point deadline);

}  // namespace cumulet::render
