#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "error.hpp"
#include "statistics.hpp"
#include "subject.hpp"

namespace cumulet::bench {

/// One grid type at one target error.
struct TraceRow {
  Kind kind = Kind::dense;
  std::uint64_t cells = 0;
  std::uint64_t bytes = 0;
  double bytes_of_dense = 1.0;
  double threshold = 0.0;
  bool matched = true;
  ImageError error;
  DepthError depth_error;
  double steps_per_path = 0.0;
  Spread samples_per_second;
  Spread steps_per_second;
  Spread to_dense;  ///< samples/s relative to the dense grid's
  Spread to_brick;
  // Camera rays straight through, without scattering.
  Spread rays_per_second;
  double steps_per_ray = 0.0;
  Spread ray_to_dense;
  Spread ray_to_brick;
};

struct TargetResult {
  double target = 0.0;
  std::uint32_t samples = 0;  ///< per pixel, in each timed run
  std::array<TraceRow, 4> rows;
};

/// The matched linear grid with surfaces in it.
struct SurfaceRow {
  viewer::SurfaceLight light = viewer::SurfaceLight::full;
  double steps_per_path = 0.0;  ///< in the volume
  Spread samples_per_second;
  Spread to_alone;  ///< samples/s relative to those of the volume only
};

struct SurfaceResult {
  std::size_t triangles = 0;
  std::uint32_t samples = 0;  ///< per pixel, in each timed run
  Spread alone;               ///< samples/s
  std::array<SurfaceRow, surface_lights.size()> rows;
};

struct SweepPoint {
  double threshold = 0.0;
  std::uint64_t cells = 0;
  std::uint64_t bytes = 0;
  DepthError error;
};

struct SweepCurve {
  grid::Criterion criterion = grid::Criterion::deviation;
  Kind kind = Kind::tet_linear;
  std::vector<SweepPoint> points;  ///< coarse to fine
  /// Number of cells at a depth error, interpolated log-log between points; nullopt outside of them.
  [[nodiscard]] std::optional<double> cells_at(double error) const;
  /// The threshold at a depth error, interpolated log-log; outside, that of the nearest point.
  [[nodiscard]] double threshold_at(double error) const;
};

struct BuildRow {
  std::uint64_t cells = 0;
  double load = 0.0;
  double statistics = 0.0;
  double refine = 0.0;
  double records = 0.0;
  double upload = 0.0;
  double peak_bytes = 0.0;
  [[nodiscard]] double total() const { return load + statistics + refine + records + upload; }
};

struct AssetResult {
  std::string name;
  std::array<int, 3> voxels{};
  std::uint64_t active_voxels = 0;
  double density_scale = 1.0;
  double coverage = 0.0;  ///< fraction of pixels that show the medium
  std::vector<TargetResult> targets;
  SurfaceResult surfaces;  ///< at the first target
  std::vector<SweepCurve> curves;
  BuildRow build;
};

const char* name_of(grid::Criterion criterion);

}  // namespace cumulet::bench
