#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <vector>

#include "render/feature_buffers.hpp"
#include "render/picture.hpp"

namespace cumulet::render {

struct Totals {
  std::uint64_t samples = 0;
  std::uint64_t steps = 0;
  /// Root mean square over pixels of the standard error of luminance, divided by the mean luminance. Only pixels with
  /// two samples count; nullopt if there are none, or if the value is not finite.
  std::optional<double> noise;
};

/// Reads back the layers of pictures. No dispatch of the picture may be in flight. Row 0 is the top. All calls need a
/// current context and an active StateGuard.
class FilmReader {
 public:
  explicit FilmReader(gl::FunctionsPtr gl) : gl_(std::move(gl)) {}

  /// Reads width * height * 4 floats: mean radiance, with or without the background's, and alpha; (0,0) is the top
  /// left.
  void read(const Picture& picture, bool with_background, float* rgba) const;
  /// Reads the samples that hit the volume before any surface, without background; alpha is their fraction.
  void read_volume(const Picture& picture, float* rgba) const;
  /// Reads width * height * 3 floats: mean radiance of a light group. with_background: including the sky and sun that
  /// cameras see directly, if they are in the group.
  void read_light_group(const Picture& picture, std::uint32_t group, bool with_background, float* rgb) const;
  /// Reads the standard error of each pixel's luminance, background included; infinity for pixels with fewer than two
  /// samples.
  void read_error(const Picture& picture, float* errors) const;
  /// Reads an AOV from a feature buffer, values_of.count floats per pixel, after FeaturePass::find() has rendered it.
  void read_feature(const Picture& picture, const AovValues& values_of, float* values) const;
  [[nodiscard]] Totals totals(const Picture& picture) const;

 private:
  struct PixelError {
    std::uint32_t samples = 0;
    std::uint32_t steps = 0;
    double mean = 0.0;     // luminance
    double squared = 0.0;  // its squared standard error; valid with at least two samples
  };
  template <class Texel>
  [[nodiscard]] std::vector<Texel> texels(const Picture& picture, const FilmLayer& layer, GLenum format,
                                          GLenum type) const;
  [[nodiscard]] std::vector<glm::uvec2> read_counts(const Picture& picture) const;
  void read_means(const Picture& picture, const FilmLayer& sum, float* rgba) const;
  // Calls visit with each pixel's error, row by row.
  template <class Visit>
  void for_each_error(const Picture& picture, Visit&& visit) const;

  gl::FunctionsPtr gl_;
};

}  // namespace cumulet::render
