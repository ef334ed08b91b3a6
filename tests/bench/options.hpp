#pragma once

#include <cstdint>
#include <filesystem>
#include <headless.hpp>
#include <string>
#include <vector>

namespace cumulet::bench {

/// A volume to measure: a file, or a noise ball of our own.
struct Input {
  std::string name;
  std::filesystem::path file;
  std::string grid;
  int noise_size = 0;     ///< not 0: a synthetic volume of this many voxels a side
  bool optional = false;  ///< a default that may be absent
};

struct Options {
  std::vector<Input> inputs;
  std::filesystem::path out = "bench-out";
  std::filesystem::path readme;
  headless::Backend backend = headless::Backend::automatic;
  std::string command;  ///< how to run this again

  std::vector<double> targets{0.03};
  std::uint32_t size = 256;
  double optical_depth = 10.0;
  float albedo = 1.0F;
  int repeats = 5;
  double seconds_a_run = 10.0;
  std::uint32_t fewest_samples = 8;  ///< a pixel, in a timed run: with fewer, waiting for the longest path weighs most
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
  bool defaults = false;              ///< only how good grids by default are
  std::vector<double> thresholds;     ///< of those, by transmittance; empty: the default one
  std::vector<double> deviations;     ///< and by deviation
  bool costs = false;                 ///< only what channels and lights cost
  bool peers = false;                 ///< only what marches through NanoVDB grids take beside ours
  std::uint64_t block_bytes = 0;      ///< that they may take of a storage block; 0: what the driver says
  bool by_clock = false;              ///< they by the clock, not by processors' time
  bool equal_error = false;           ///< only what marches take to an error of a fire's picture
  std::string color_grid;             ///< of the volume whose channels are measured; empty: none
  std::filesystem::path environment;  ///< to measure too; empty: none
  bool denoise = false;               ///< only how good pictures of few samples are, raw and denoised
  bool settle = false;                ///< only how soon what is drawn is good after a change
  bool adaptive = false;              ///< only what adaptive sampling takes to a noise target
  bool techniques = false;            ///< only whether each technique, off, leaves means as they are
  std::vector<std::string> scenes;    ///< of those that these are judged on; empty: all
  std::filesystem::path sample_dir;   ///< what cumulet-scene --full wrote
  std::filesystem::path usual_dir;    ///< what it wrote without
  std::string oidn_weights;           ///< folder of networks; empty: where cumulet-render looks for them
  std::uint32_t reference_samples = 8192;
  std::uint32_t raw_samples = 256;    ///< up to which the raw picture is judged, at least 64
  std::uint32_t frames = 30;          ///< of an orbit; 0: none
  std::uint32_t flicker_samples = 4;  ///< of each of them
  std::uint32_t flicker_reference_samples = 256;
  double budget_ms = 10.0;          ///< a frame's, where what is drawn settles
  double surfaces_threshold = 0.0;  ///< above 0: only what surfaces cost is measured, on a grid of that threshold
};

/// The options, or the exit status that wrong usage (or --help) means; explains itself.
struct ParseResult {
  Options options;
  int status = -1;  ///< not negative: exit with it
};
ParseResult parse(int argc, char** argv);

}  // namespace cumulet::bench
