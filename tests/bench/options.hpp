#pragma once

#include <cstdint>
#include <filesystem>
#include <headless.hpp>
#include <string>
#include <vector>

#include "grid/cube.hpp"

namespace cumulet::bench {

/// A volume to measure: a file, or a generated noise ball.
struct Input {
  std::string name;
  std::filesystem::path file;
  std::string grid;
  int noise_size = 0;     ///< not 0: a synthetic volume with this number of voxels per side
  bool optional = false;  ///< a default that may be missing
};

/// A folder of shaders that is measured on our cells.
struct ShaderVariant {
  std::string name;
  std::filesystem::path folder;
  bool constant_cells = false;
};

struct Options {
  std::vector<Input> inputs;
  std::vector<ShaderVariant> variants;  ///< compared with NanoVDB grids and ours
  std::filesystem::path out = "bench-out";
  std::filesystem::path readme;
  headless::Backend backend = headless::Backend::automatic;
  std::string command;  ///< how to run this again

  std::vector<double> targets{0.03};
  std::uint32_t size = 256;
  double optical_depth = 10.0;
  std::vector<grid::Interpolation> interpolations{grid::Interpolation::nearest};  ///< more than one: only for peers
  float albedo = 1.0F;
  int repeats = 5;
  double seconds_a_run = 10.0;
  std::uint32_t fewest_samples = 8;  ///< per pixel in a timed run; with fewer, waiting for the longest path dominates
  std::uint32_t error_samples = 24;
  std::uint32_t error_parts = 2;
  std::uint32_t max_bounces = 0;  ///< 0: no limit
  int evaluations = 6;
  double sweep_factor = 2.0;
  std::uint64_t sweep_cells = 2'000'000;
  std::uint64_t max_cells = 5'400'000;
  std::uint64_t build_cells = 5'000'000;
  std::size_t tree_triangles = 1'000'000;
  bool quick = false;
  bool defaults = false;              ///< only the quality of default grids
  std::vector<double> thresholds;     ///< of those, by transmittance; empty: the default one
  std::vector<double> deviations;     ///< and by deviation
  bool costs = false;                 ///< only the cost of channels and lights
  bool peers = false;                 ///< only NanoVDB grids compared with ours
  std::uint64_t block_bytes = 0;      ///< limit of a storage block for those; 0: the driver's
  bool by_clock = false;              ///< those by wall time instead of CPU time
  bool equal_error = false;           ///< only the time to an error of a fire's image
  std::string color_grid;             ///< of the volume whose channels are measured; empty: none
  std::filesystem::path environment;  ///< measured in addition; empty: none
  bool denoise = false;               ///< only the quality of images of few samples, noisy and denoised
  bool settle = false;                ///< only the convergence of displayed images after a change
  bool adaptive = false;              ///< only adaptive sampling to a noise target
  bool techniques = false;            ///< only the effect of disabled techniques on means
  std::vector<std::string> scenes;    ///< names of the scenes for those; empty: all
  std::filesystem::path sample_dir;   ///< written by cumulet-scene --full
  std::filesystem::path usual_dir;    ///< written by cumulet-scene without --full
  std::string oidn_weights;           ///< folder of networks; empty: the default folder of cumulet-render
  std::uint32_t reference_samples = 8192;
  std::uint32_t raw_samples = 256;    ///< largest sample count of noisy images, at least 64
  std::uint32_t frames = 30;          ///< of an orbit; 0: none
  std::uint32_t flicker_samples = 4;  ///< of each of them
  std::uint32_t flicker_reference_samples = 256;
  double budget_ms = 10.0;          ///< per frame, for convergence after a change
  double surfaces_threshold = 0.0;  ///< above 0: only the cost of surfaces is measured, on a grid of this threshold
};

/// The options, or the exit status for wrong usage or --help. The parser prints the explanation.
struct ParseResult {
  Options options;
  int status = -1;  ///< not negative: exit with it
};
/// scenes: the names that --scene accepts.
ParseResult parse(int argc, char** argv, const std::vector<std::string>& scenes);

}  // namespace cumulet::bench
