#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "path/path_blocks.glsl"
#include "render/film/allotment.hpp"
#include "render/pacing/dispatch_results.hpp"
#include "render/pacing/region.hpp"

namespace cumulet::render {

/// Sample counts of the pixels: minimum, maximum and total.
struct Accumulated {
  std::uint32_t least = std::numeric_limits<std::uint32_t>::max();
  std::uint32_t most = 0;
  std::uint64_t all = 0;
};

/// Pixels of an accumulation, its samples per pixel, and the condition at which it ends.
struct AccumulationSettings {
  PixelBox box;
  std::uint32_t target_samples = 1;
  std::uint32_t max_lanes = 1;
  bool previews_first = false;           // PictureOptions::preview
  std::uint32_t short_picture = 0;       // maximum samples per pixel of a pass that begins at the first sample
  std::optional<double> noise_target{};  // PictureSettings::noise_target
  bool adaptive = false;                 // pixels are sampled only as much as the noise target needs
};

/// The samples of a picture: which exist, and which come next. Free of GL.
///
/// A tile is the set of pixels that the lanes sample at a time. There are at most as many lanes as pixels; a lane whose
/// pixel is done takes another pixel (persistent threads). A dispatch runs some blocks of lanes, those that have work.
/// In a dispatch a lane runs a bounded number of rounds and keeps its path for the next dispatch.
/// Samples come in passes: each pass ends in every tile before the next begins. A picture with a lane for every pixel
/// has one pass. A picture of few samples that nothing waits for has two (AccumulationSettings::short_picture), because
/// a pass ends with its slowest pixels. Its first pass has one sample per pixel, so that it is soon complete. Each
/// pixel belongs to one lane at a time and adds its samples in order. A sample that is started again gives the same
/// result. So the image depends only on parameters and sample count, not on tiles, lanes, budgets, timing, or when
/// results of dispatches arrive.
class Accumulation {
 public:
  /// Samples per pixel at which the noise is first measured. It is measured again at each 1.41 times as many, rounded.
  /// The schedule does not depend on time, so that the same picture ends with the same samples.
  static constexpr std::uint32_t first_measured = 16;

  /// AccumulationSettings::max_lanes is at least this.
  static constexpr std::uint32_t min_lanes = 32 * CM_BLOCK_LANES;

  /// An accumulation without pixels.
  Accumulation() = default;
  /// Starts to sample the pixels.
  explicit Accumulation(const AccumulationSettings& settings);
  /// Returns an accumulation that is done.
  static Accumulation finished(const PixelBox& box);

  [[nodiscard]] const PixelBox& box() const { return settings_.box; }
  /// Samples per pixel to reach.
  [[nodiscard]] std::uint32_t target_samples() const { return settings_.target_samples; }
  [[nodiscard]] std::optional<double> noise_target() const { return settings_.noise_target; }
  [[nodiscard]] bool is_adaptive() const { return settings_.adaptive; }
  /// True if every pixel has a sample; with previews_first, nearly every pixel.
  [[nodiscard]] bool complete() const { return stage_ != Stage::incomplete; }
  /// True if every pixel has its target samples, or the noise has reached its target.
  [[nodiscard]] bool done() const { return stage_ == Stage::done; }
  /// True if some pixels may have no sample.
  [[nodiscard]] bool has_holes() const { return holes_; }
  [[nodiscard]] double progress() const;
  /// Camera paths that are known to be finished.
  [[nodiscard]] std::uint64_t samples() const { return count_ ? count_->finished : 0; }
  /// Finished camera paths with nonfinite radiance, which count as black.
  [[nodiscard]] std::uint64_t samples_not_finite() const { return count_ ? count_->not_finite : 0; }
  /// Raises the number of samples, and sets the noise target of an accumulation that has one. Sampling continues from
  /// the current state.
  void extend(std::uint32_t samples, std::optional<double> noise_target);

  /// The tile that is sampled now.
  [[nodiscard]] glm::uvec2 tile_corner() const {
    return box().first + glm::uvec2(tiles_.current % tiles_.count.x, tiles_.current / tiles_.count.x) * tiles_.size;
  }
  [[nodiscard]] glm::uvec2 tile_extent() const {
    return glm::min(tiles_.size, box().first + box().size - tile_corner());
  }
  /// Number of adaptive-sampling blocks of the tile in x and y.
  [[nodiscard]] glm::uvec2 tile_squares() const { return (tile_extent() + Allotment::edge - 1U) / Allotment::edge; }
  /// Sampled adaptive-sampling blocks of the tile: glsl/path/path_blocks.glsl.
  [[nodiscard]] const std::vector<std::uint32_t>& squares() const { return squares_; }
  /// Target samples per pixel of the current pass.
  [[nodiscard]] std::uint32_t pass_target() const { return pass_target_; }
  /// Maximum number of pixel slots of a tile (glsl/path/pixel_slots.glsl).
  [[nodiscard]] std::uint32_t slots() const;
  /// Number of lanes.
  [[nodiscard]] std::uint32_t lanes() const { return lanes_; }
  /// Limits the number of lanes of later tiles and passes, if there are fewer lanes than pixels.
  void limit_lanes(std::uint32_t lanes);
  /// Blocks of lanes of the current tile and pass. Dispatches update them, also after the tile has ended.
  [[nodiscard]] const std::shared_ptr<Blocks>& blocks() const { return blocks_; }
  /// Finished samples. Dispatches update the count, also after the picture was restarted.
  [[nodiscard]] const std::shared_ptr<SampleCount>& count() const { return count_; }
  /// The block at which the search for the next dispatch starts.
  [[nodiscard]] std::size_t next_block() const { return next_block_; }
  void set_next_block(std::size_t block) { next_block_ = block; }
  /// Starts the samples of the tile again that are not finished. The results are the same.
  void begin_tile();
  /// Ends the tile, the pass and the accumulation if the known results allow it.
  void end_tile();
  /// True if the tile's samples are done, and its error is to be measured.
  [[nodiscard]] bool awaits_error() const;
  /// Returns the place for the tile's error, which a dispatch fills in.
  std::shared_ptr<SquareErrors> expect_error();
  /// Sets the number of pixels that are known in a debug view, which has one value per pixel.
  void set_known_pixels(std::uint64_t pixels);

  /// State of the adaptive sampler, one byte per block.
  [[nodiscard]] std::span<const std::uint8_t> live_squares() const { return allotment_.saved(); }
  /// Restores the state of the adaptive sampler. go_on_from() follows.
  void restore_live_squares(std::span<const std::uint8_t> live,
                            const std::function<std::uint32_t(glm::uvec2 pixel)>& samples_of);
  /// Continues from restored samples; discards dispatches in flight. pass: target of the pass in progress, needed if
  /// sample counts do not determine it.
  void go_on_from(const Accumulated& counts, std::optional<std::uint32_t> pass);

 private:
  enum class Stage { incomplete, complete, done };
  struct Tiles {
    glm::uvec2 size{1U};
    glm::uvec2 count{1U};
    std::uint32_t current = 0;
  };
  // Expected number of samples of all pixels, with the progress and the sample count at the time of its computation.
  struct Expectation {
    double progress = 0.0;
    std::uint64_t samples = 0;
    double expected_samples = 1.0;
  };
  // Returns the target samples per pixel of the pass that follows one with target `samples`.
  [[nodiscard]] std::uint32_t pass_after(std::uint32_t samples) const;
  // True if each pixel has a lane of its own.
  [[nodiscard]] bool has_lanes_for_all() const;
  // True if the current pass ends with a measurement of the noise.
  [[nodiscard]] bool measures() const;
  // The tile's first adaptive-sampling block, among those of the picture.
  [[nodiscard]] glm::uvec2 first_square() const { return (tile_corner() - box().first) / Allotment::edge; }
  void end_pass();

  AccumulationSettings settings_;
  Tiles tiles_;
  std::uint32_t lanes_ = 0;
  std::uint32_t max_lanes_ = 0;  // of the next tile
  std::shared_ptr<Blocks> blocks_;
  std::size_t next_block_ = 0;
  std::uint32_t pass_target_ = 1;
  std::uint32_t pass_ = 0;  // number of the current pass
  std::shared_ptr<SampleCount> count_;
  Allotment allotment_;
  std::vector<std::uint32_t> squares_;
  std::shared_ptr<SquareErrors> tile_errors_;  // of the current tile, once requested
  SquareErrors errors_;                        // of the picture, as far as this pass has come, if it is measured
  std::optional<double> noise_;                // of the last pass that was measured
  Expectation expectation_;
  Stage stage_ = Stage::incomplete;
  bool holes_ = true;
};

}  // namespace cumulet::render
