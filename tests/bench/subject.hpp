#pragma once

#include <array>
#include <cstdint>
#include <headless.hpp>
#include <vector>

#include "options.hpp"
#include "support/still.hpp"

namespace cumulet::bench {

enum class Kind { tet_constant = 0, tet_linear = 1, dense = 2, brick = 3 };
inline constexpr std::array<Kind, 4> all_kinds{Kind::tet_constant, Kind::tet_linear, Kind::dense, Kind::brick};
const char* name_of(Kind kind);

/// The settings of surfaces that are measured.
inline constexpr std::array surface_lights{viewer::SurfaceLight::full, viewer::SurfaceLight::shadows,
                                           viewer::SurfaceLight::none};
const char* name_of(viewer::SurfaceLight light);

/// A picture and what it cost.
struct Run {
  double seconds = 0.0;            ///< tracing alone: not compiling, building, reading back
  double processor_seconds = 0.0;  ///< of the process, while it traced
  std::uint64_t samples = 0;
  std::uint64_t steps = 0;
  std::vector<float> rgba;
  [[nodiscard]] double samples_per_second() const { return static_cast<double>(samples) / seconds; }
  [[nodiscard]] double steps_per_sample() const { return static_cast<double>(steps) / static_cast<double>(samples); }
};

/// One march of one asset: a viewer of its own, so that marches can take turns without rebuilding anything.
class Subject {
 public:
  /// density_scale: of the shaded picture. programs: others than the library's. The context must be current, now and
  /// until the end.
  Subject(headless::Context& context, viewer::VolumeAssetPtr volume, Kind kind, const Options& options,
          double density_scale, std::shared_ptr<viewer::Sharing> programs = nullptr);

  /// Makes the tetrahedral grid anew; not for dense and brick.
  void refine(grid::Criterion criterion, double threshold, std::uint64_t max_cells);
  /// Surfaces in the picture from now on.
  void show(scene::ModelSourcePtr surfaces);
  void light_surfaces(viewer::SurfaceLight light);
  /// Traces samples a pixel.
  Run shaded(std::uint32_t samples, std::uint32_t seed);
  /// One ray a pixel right through the medium: alpha is 1 - exp(-density_scale x depth).
  Run primary(double density_scale);

  [[nodiscard]] Kind kind() const { return kind_; }
  [[nodiscard]] viewer::Stats stats() { return still_.viewer().stats(); }

 private:
  Run trace(double density_scale, std::uint32_t samples, std::uint32_t seed, render::View view);

  Kind kind_;
  std::uint32_t size_;
  glm::vec3 albedo_;
  std::uint32_t max_bounces_;
  double density_scale_;
  test::Still still_;
};

/// A picture of what the viewer has.
Run trace(test::Still& still, const test::Image& image);

/// The light of every measurement.
viewer::Light bench_light();

}  // namespace cumulet::bench
