#include "render/film/accumulation.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

namespace cumulet::render {

namespace {

constexpr std::uint32_t tile_edge = 1024;
constexpr std::uint32_t block_lanes = CM_BLOCK_LANES;
static_assert(tile_edge / Allotment::edge * (tile_edge / Allotment::edge) <= CM_MAX_SQUARES);
static_assert(CM_MAX_SQUARES <= 1U << CM_SQUARE_ROWS);
static_assert(tile_edge <= CM_BAND_ROWS * CM_BANDS);
constexpr double preview_rest = 0.03;  // fraction of a tile's pixels
static_assert(Accumulation::min_lanes > preview_rest * tile_edge * tile_edge,
              "the paths that have not started must exceed the remainder");
constexpr std::uint32_t longest_pass = 64;
constexpr std::uint32_t max_samples = 1U << 31U;
constexpr double nearly_done = 0.99;

// Returns the next number of samples per pixel at which a picture with a noise target is measured.
std::uint32_t look_after(std::uint32_t samples) {
  double count = Accumulation::first_measured;
  while (std::round(count) <= double(samples) && count < double(max_samples)) count *= std::numbers::sqrt2;
  return static_cast<std::uint32_t>(std::min(std::round(count), double(max_samples)));
}

}  // namespace

Accumulation::Accumulation(const AccumulationSettings& settings)
    : settings_(settings), count_(std::make_shared<SampleCount>()) {
  tiles_.size = glm::min(box().size, glm::uvec2(tile_edge));
  tiles_.count = (box().size + tiles_.size - 1U) / tiles_.size;
  const glm::uvec2 squares = tile_squares();
  lanes_ = std::min(CM_SQUARE_PIXELS * squares.x * squares.y, settings.max_lanes);
  max_lanes_ = lanes_;
  pass_target_ = pass_after(0);
  allotment_.begin(box().size);
  expectation_.expected_samples = allotment_.expected(target_samples());
  begin_tile();
}

Accumulation Accumulation::finished(const PixelBox& box) {
  Accumulation finished;
  finished.settings_.box = box;
  finished.stage_ = Stage::done;
  finished.holes_ = false;
  return finished;
}

double Accumulation::progress() const {
  if (done()) return 1.0;
  const Expectation& last = expectation_;
  const double wanted = last.expected_samples - static_cast<double>(last.samples);
  const double part = wanted > 0.0 ? static_cast<double>(samples() - last.samples) / wanted : 0.0;
  // It is not known when the noise will be low enough.
  return last.progress + (1.0 - last.progress) * std::min(noise_target() ? nearly_done : 1.0, part);
}

std::uint32_t Accumulation::pass_after(std::uint32_t samples) const {
  std::uint32_t next = samples;
  if (samples == 0 && settings_.previews_first) {
    next = 1;  // the first image is shown at once
  } else if (!settings_.noise_target) {
    // The pass size doubles, so that waiting for slow pixels at a pass's end costs little. If each pixel has a lane,
    // there is one pass: some lanes start their next samples while others are at their first.
    const bool is_rest = has_lanes_for_all() || (samples > 0 && settings_.target_samples <= settings_.short_picture);
    next = is_rest ? settings_.target_samples : samples + std::clamp(samples, 1U, longest_pass);
  } else if (samples < first_measured) {
    const bool is_rest = has_lanes_for_all() || (samples > 0 && first_measured <= settings_.short_picture);
    next = is_rest ? first_measured : std::max(1U, 2 * samples);
  } else {
    next = look_after(samples);
  }
  return std::min(next, settings_.target_samples);
}

bool Accumulation::has_lanes_for_all() const {
  const glm::uvec2 squares = tile_squares();
  return tiles_.count == glm::uvec2(1U) && lanes_ >= CM_SQUARE_PIXELS * squares.x * squares.y;
}

std::uint32_t Accumulation::slots() const {
  const glm::uvec2 squares = (tiles_.size + Allotment::edge - 1U) / Allotment::edge;
  return CM_SQUARE_PIXELS * squares.x * squares.y;
}

bool Accumulation::measures() const {
  // The last pass is measured, too. Whether more samples would have been enough must not depend on when they are
  // requested.
  return settings_.noise_target && pass_target_ >= first_measured && look_after(pass_target_ - 1) == pass_target_;
}

bool Accumulation::awaits_error() const {
  return !done() && measures() && !tile_errors_ &&
         std::ranges::all_of(*blocks_, [](const Block& block) { return block.unfinished == 0; });
}

void Accumulation::extend(std::uint32_t samples, std::optional<double> noise_target) {
  const bool more = samples > settings_.target_samples;
  const bool retargeted = settings_.adaptive && noise_target != settings_.noise_target;
  settings_.noise_target = noise_target;
  settings_.target_samples = std::max(settings_.target_samples, samples);
  const bool reached = settings_.noise_target && noise_ && *noise_ <= *settings_.noise_target;
  if (done() ? reached || (pass_target_ >= settings_.target_samples && !retargeted) : !more && !retargeted) return;
  // The sampler's decisions were for another target.
  if (retargeted) allotment_.begin(box().size);
  // Lanes that are finished start again. The current samples of others start again as well, with the same result.
  if (done() || retargeted || (has_lanes_for_all() && !settings_.noise_target)) {
    tiles_.current = 0;
    errors_.clear();
    if (done() || !settings_.noise_target) pass_target_ = pass_after(pass_target_);
    begin_tile();
  }
  expectation_ = {.expected_samples = allotment_.expected(target_samples())};
  if (done()) stage_ = Stage::complete;
}

void Accumulation::go_on_from(const Accumulated& counts, std::optional<std::uint32_t> pass) {
  tiles_.current = 0;
  errors_.clear();
  noise_.reset();
  count_ = std::make_shared<SampleCount>(SampleCount{counts.all});
  expectation_ = {.expected_samples = allotment_.expected(target_samples())};
  // Finds the pass in progress, because the noise is measured at its end: the first pass whose target is at least the
  // minimum sample count. If all pixels have exactly that many samples, its end may not have been measured.
  pass_target_ = pass.value_or(pass_after(0));
  const auto is_over = [&] {
    return !pass && (pass_target_ < counts.least || (pass_target_ == counts.least && counts.most > counts.least));
  };
  while (is_over() && pass_target_ < settings_.target_samples) pass_target_ = pass_after(pass_target_);
  const bool whole = counts.least > 0;
  pass_ = whole ? 2 : 0;
  stage_ = whole ? Stage::complete : Stage::incomplete;
  holes_ = !whole;
  begin_tile();
}

void Accumulation::limit_lanes(std::uint32_t lanes) {
  if (has_lanes_for_all()) return;
  max_lanes_ = std::min(lanes_, std::max(min_lanes, lanes / block_lanes * block_lanes));
}

void Accumulation::begin_tile() {
  lanes_ = max_lanes_;
  // In-flight dispatches update the blocks that they were sent for, which are not read any more.
  blocks_ = std::make_shared<Blocks>();
  squares_.clear();
  tile_errors_.reset();
  next_block_ = 0;
  const glm::uvec2 squares = tile_squares();
  std::vector<std::uint32_t> pixels;  // of each sampled block
  for (std::uint32_t y = 0; y < squares.y; ++y) {
    for (std::uint32_t x = 0; x < squares.x; ++x) {
      const glm::uvec2 square = first_square() + glm::uvec2(x, y);
      const std::uint32_t live = allotment_.live(square);
      if (live == 0) continue;
      squares_.push_back((y * squares.x + x) | live << CM_SQUARE_ROWS);
      pixels.push_back(allotment_.live_pixels(square));
    }
  }
  constexpr std::size_t squares_a_block = block_lanes / CM_SQUARE_PIXELS;
  const std::size_t begun = std::min(squares_.size(), std::size_t{lanes_ / CM_SQUARE_PIXELS});
  const bool more = begun < squares_.size();  // than lanes: each lane starts with a pixel
  for (std::size_t first = 0; first < begun; first += squares_a_block) {
    const std::size_t end = std::min(begun, first + squares_a_block);
    const auto lanes = more ? static_cast<std::uint32_t>((end - first) * CM_SQUARE_PIXELS)
                            : std::accumulate(pixels.begin() + static_cast<std::ptrdiff_t>(first),
                                              pixels.begin() + static_cast<std::ptrdiff_t>(end), 0U);
    // If pixels may be unsampled, all are assumed to be, until the blocks report.
    blocks_->push_back({.unfinished = lanes, .empty = holes_ ? lanes : 0});
  }
}

void Accumulation::end_tile() {
  if (done()) return;
  std::uint64_t unfinished = 0;
  std::uint64_t empty = 0;
  for (const Block& block : *blocks_) {
    unfinished += block.unfinished;
    empty += block.empty;
  }
  const glm::uvec2 extent = tile_extent();
  const auto rest =
      settings_.previews_first && !complete() ? static_cast<std::uint64_t>(preview_rest * extent.x * extent.y) : 0;
  const bool all_begun = has_lanes_for_all();
  if (all_begun && empty <= rest) stage_ = Stage::complete;
  holes_ = all_begun ? empty > 0 : settings_.previews_first && pass_ < 2;
  // With PictureOptions::preview, the first pass leaves its last few pixels to the second.
  const bool first_pass = pass_target_ == 1 && settings_.target_samples > 1;
  if (unfinished > (first_pass ? rest : 0)) return;
  if (measures()) {
    if (!tile_errors_ || tile_errors_->empty()) return;
    const glm::uvec2 squares = tile_squares();
    errors_.resize(allotment_.saved().size());
    for (std::uint32_t y = 0; y < squares.y; ++y) {
      const glm::uvec2 first = first_square() + glm::uvec2(0U, y);
      std::copy_n(tile_errors_->begin() + std::size_t{y} * squares.x, squares.x,
                  errors_.begin() + std::size_t{first.y} * allotment_.squares().x + first.x);
    }
  }
  if (++tiles_.current == tiles_.count.x * tiles_.count.y) end_pass();
  if (!done()) begin_tile();
}

void Accumulation::end_pass() {
  tiles_.current = 0;
  stage_ = Stage::complete;
  ++pass_;
  ErrorSums error;
  for (const SquareError& square : errors_)
    error += {square.squared[0] + square.squared[1], square.brightness, square.pixels};
  // If a noise target was set within the pass, only some tiles have been measured.
  if (measures() && error.pixels == static_cast<double>(box().area())) {
    noise_ = error.noise();
    expectation_.progress = progress();
    expectation_.samples = samples();
    // The noise falls with the root of the samples; 5 % are added because it is an estimate. If the noise is unknown,
    // no target is reached.
    const double ratio = noise_.value_or(std::numeric_limits<double>::infinity()) / *settings_.noise_target;
    const double needed = 1.05 * ratio * ratio * pass_target_;
    const double each =
        needed < settings_.target_samples ? pass_after(static_cast<std::uint32_t>(needed)) : settings_.target_samples;
    if (noise_ && *noise_ <= *settings_.noise_target) {
      stage_ = Stage::done;
    } else if (settings_.adaptive) {
      allotment_.decide(errors_, *settings_.noise_target, pass_target_);
    }
    expectation_.expected_samples =
        settings_.adaptive ? allotment_.expected(settings_.target_samples) : each * static_cast<double>(box().area());
  }
  errors_.clear();
  if (pass_target_ >= settings_.target_samples) {
    stage_ = Stage::done;
  } else if (!done()) {
    pass_target_ = pass_after(pass_target_);
  }
}

std::shared_ptr<SquareErrors> Accumulation::expect_error() {
  tile_errors_ = std::make_shared<SquareErrors>();
  return tile_errors_;
}

void Accumulation::set_known_pixels(std::uint64_t pixels) {
  count_->finished = pixels;
  const bool all = pixels >= box().area();
  stage_ = all ? Stage::done : Stage::incomplete;
  holes_ = !all;
}

void Accumulation::restore_live_squares(std::span<const std::uint8_t> live,
                                        const std::function<std::uint32_t(glm::uvec2 pixel)>& samples_of) {
  allotment_.restore(live, samples_of);
}

}  // namespace cumulet::render
