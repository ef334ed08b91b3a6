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

/// The surface lighting modes that are measured.
inline constexpr std::array surface_lights{viewer::SurfaceLight::full, viewer::SurfaceLight::shadows,
                                           viewer::SurfaceLight::none};
const char* name_of(viewer::SurfaceLight light);

/// An image and its cost.
struct Run {
  double seconds = 0.0;            ///< only tracing: no compiling, building or reading back
  double processor_seconds = 0.0;  ///< of the process, while it traced
  std::uint64_t samples = 0;
  std::uint64_t steps = 0;
  std::vector<float> rgba;
  [[nodiscard]] double samples_per_second() const { return static_cast<double>(samples) / seconds; }
  [[nodiscard]] double steps_per_sample() const { return static_cast<double>(steps) / static_cast<double>(samples); }
};

/// One grid type of one asset with its own viewer, so that grid types can take turns without rebuilding.
class Subject {
 public:
  /// density_scale: of the shaded image. programs: replace the library's. The context must be current until the
  /// destruction.
  Subject(headless::Context& context, viewer::VolumeAssetPtr volume, Kind kind, const Options& options,
          double density_scale, std::shared_ptr<viewer::Sharing> programs = nullptr);

  /// Rebuilds the tetrahedral grid; not for dense and brick.
  void refine(grid::Criterion criterion, double threshold, std::uint64_t max_cells);
  /// Adds surfaces to the scene.
  void show(scene::ModelSourcePtr surfaces);
  void light_surfaces(viewer::SurfaceLight light);
  /// Traces this number of samples per pixel.
  Run shaded(std::uint32_t samples, std::uint32_t seed);
  /// Traces one ray per pixel straight through the medium: alpha is 1 - exp(-density_scale x depth).
  Run primary(double density_scale);

  [[nodiscard]] Kind kind() const { return kind_; }
  [[nodiscard]] viewer::Stats stats() { return still_.viewer().stats(); }

 private:
  Run trace(double density_scale, std::uint32_t samples, std::uint32_t seed, render::View view);

  [[nodiscard]] viewer::GridSettings grid_settings() const;

  Kind kind_;
  grid::Interpolation interpolation_;
  std::uint32_t size_;
  glm::vec3 albedo_;
  std::uint32_t max_bounces_;
  double density_scale_;
  test::Still still_;
};

/// Renders an image of the viewer's scene.
Run trace(test::Still& still, const test::Image& image);

/// The light of every measurement.
viewer::Light bench_light();

}  // namespace cumulet::bench
