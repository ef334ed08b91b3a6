#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <vector>

#include "render/film/feature_buffers.hpp"
#include "render/film/film_values.hpp"
#include "render/film/picture.hpp"

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

  /// Reads values.count() floats.
  void read(const FilmValues& values, float* to) const;
  /// Reads an AOV from a feature buffer, values_of.count floats per pixel, after FeaturePass::find() has rendered it.
  void read_feature(const Picture& picture, const AovValues& values_of, float* values) const;
  [[nodiscard]] Totals totals(const Picture& picture) const;

 private:
  // Copies of the sources of `values`. to: memory for the one in_place(); null: none.
  class Copied {
   public:
    Copied(const gl::Functions& gl, const FilmValues& values, float* to);
    [[nodiscard]] FilmValues::Copies all() const { return copies_; }

   private:
    std::vector<std::vector<std::byte>> memory_;
    std::vector<const std::byte*> copies_;
  };

  gl::FunctionsPtr gl_;
};

/// Values on their way to main memory, without waiting: a copy in a pixel pack buffer, and a fence.
class PendingRead {
 public:
  /// Queues the copies.
  PendingRead(const gl::FunctionsPtr& gl, FilmValues values);
  [[nodiscard]] const FilmValues& values() const { return values_; }
  /// Whether the copies exist. Never waits.
  [[nodiscard]] bool ready() const { return fence_.passed(); }
  /// Writes values().count() floats. Only if it is ready.
  void take(float* to) const;
  /// GL memory.
  [[nodiscard]] std::size_t bytes() const { return bytes_; }

 private:
  FilmValues values_;
  std::size_t bytes_ = 0;
  gl::ReadBack buffer_;
  gl::Fence fence_;
};

}  // namespace cumulet::render
