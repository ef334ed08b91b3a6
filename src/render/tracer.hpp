#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <vector>

#include "gl/objects.hpp"
#include "render/march_data.hpp"
#include "render/parameters.hpp"

namespace cumulet::render {

enum class View { shaded = 0, cells = 1, steps = 2, density = 3 };

struct Totals {
  std::uint64_t samples = 0;
  std::uint64_t steps = 0;
};

/// Accumulates an image by bounded dispatches over tiles. All calls need the context current and a StateGuard around.
///
/// Samples come in passes that end in every tile before the next begins; within a dispatch a lane runs a bounded number
/// of steps and keeps its path for the next. Each pixel belongs to one lane at a time and adds its samples in order, so
/// the image depends on seed and sample count alone, not on tiles, budgets or timing.
class Tracer {
 public:
  explicit Tracer(gl::FunctionsPtr gl) : gl_(std::move(gl)) {}

  /// Starts anew. parameters: camera, medium, lights, image; box and march fields are filled from data.
  void begin(const MarchData& data, const core::CmParameters& parameters, View view);
  /// Traces for about budget_ms. Returns whether every pixel has its target samples.
  bool trace(const MarchData& data, double budget_ms);
  [[nodiscard]] double progress() const;
  /// width * height * 4 floats: mean radiance and alpha, (0,0) top left.
  void read(float* rgba) const;
  [[nodiscard]] Totals totals() const;
  [[nodiscard]] const core::CmParameters& parameters() const { return parameters_; }
  [[nodiscard]] std::uint32_t width() const { return parameters_.image.x; }
  [[nodiscard]] std::uint32_t height() const { return parameters_.image.y; }

 private:
  void next_tile();

  gl::FunctionsPtr gl_;
  core::CmParameters parameters_{};
  View view_ = View::shaded;
  std::vector<std::string> program_key_;
  gl::Object program_;
  gl::Object sum_;
  gl::Object counts_;
  gl::Object paths_;
  std::size_t paths_lanes_ = 0;
  gl::Object counter_;
  gl::Object uniforms_;
  glm::uvec2 tile_size_{1U};
  glm::uvec2 tiles_{1U};
  std::uint32_t tile_ = 0;
  std::uint32_t pass_target_ = 1;
  std::uint32_t pass_begin_ = 0;
  bool tile_begins_ = true;
  bool done_ = false;
  double iterations_ = 16.0;
  double unfinished_ = 1.0;
};

}  // namespace cumulet::render
