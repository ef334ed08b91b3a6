#include "denoise/plan.hpp"

#include <algorithm>

namespace cumulet::denoise {

namespace {

constexpr std::uint32_t rounded_up(std::uint32_t value, std::uint32_t to) { return divided_up(value, to) * to; }

// A smaller kept region would spend almost all work on the surroundings.
constexpr std::uint32_t min_kept = 64;

/// Tiling along one axis of an image.
struct Cut {
  std::uint32_t whole = 0;  // size, rounded up to whole alignments
  std::uint32_t kept = 0;   // size of the part of a tile that is valid

  explicit Cut(std::uint32_t size) : whole(rounded_up(size, Network::alignment)), kept(whole) {}
  [[nodiscard]] std::uint32_t tile() const { return std::min(kept + 2 * Network::reach, whole); }
  [[nodiscard]] bool divisible() const { return kept > min_kept; }
  void divide() {
    const std::uint32_t even = rounded_up(divided_up(whole, divided_up(whole, kept) + 1), Network::alignment);
    kept = std::max(std::min(even, kept - Network::alignment), min_kept);
  }
};

/// First-fit allocator with lifetimes.
class Arena {
 public:
  std::uint32_t take(std::uint32_t size, std::size_t until) {
    std::uint32_t at = 0;
    for (const Held& held : held_) {
      if (held.begin >= at + size) break;
      at = std::max(at, held.end);
    }
    held_.insert(std::ranges::upper_bound(held_, at, {}, &Held::begin), {at, at + size, until});
    size_ = std::max(size_, at + size);
    return at;
  }
  /// Frees allocations that are last used before this step.
  void free_before(std::size_t step) {
    std::erase_if(held_, [&](const Held& held) { return held.until < step; });
  }
  [[nodiscard]] std::uint32_t size() const { return size_; }

 private:
  struct Held {
    std::uint32_t begin;
    std::uint32_t end;
    std::size_t until;
  };
  std::vector<Held> held_;  // sorted by begin
  std::uint32_t size_ = 0;
};

}  // namespace

std::uint32_t input_blocks(const Network& network) { return divided_up(network.inputs, block_channels); }

std::uint32_t result_blocks(const Convolution& convolution) {
  return rounded_up(convolution.outputs, group_channels) / block_channels;
}

std::vector<Tile> tiles_of(glm::uvec2 picture, std::uint64_t max_pixels) {
  std::array<Cut, 2> cuts{Cut(picture.x), Cut(picture.y)};
  while (std::uint64_t{cuts[0].tile()} * cuts[1].tile() > max_pixels) {
    Cut& longer = cuts[cuts[0].tile() >= cuts[1].tile() ? 0 : 1];
    Cut& shorter = cuts[cuts[0].tile() >= cuts[1].tile() ? 1 : 0];
    if (!longer.divisible() && !shorter.divisible()) break;
    (longer.divisible() ? longer : shorter).divide();
  }
  std::vector<Tile> tiles;
  for (std::uint32_t y = 0; y < cuts[1].whole; y += cuts[1].kept) {
    for (std::uint32_t x = 0; x < cuts[0].whole; x += cuts[0].kept) {
      const glm::uvec2 begin(x, y);
      const glm::uvec2 whole(cuts[0].whole, cuts[1].whole);
      Tile tile;
      tile.keep_begin = begin;
      tile.keep_end = glm::min(begin + glm::uvec2(cuts[0].kept, cuts[1].kept), picture);
      tile.begin = begin - glm::min(begin, glm::uvec2(Network::reach));
      tile.size = glm::min(begin + glm::uvec2(cuts[0].kept, cuts[1].kept) + Network::reach, whole) - tile.begin;
      tiles.push_back(tile);
    }
  }
  return tiles;
}

Memory memory_of(const Network& network, glm::uvec2 tile) {
  const auto& convolutions = network.convolutions;
  std::array<std::size_t, Network::convolution_count> last_use{};
  std::size_t last_use_of_input = 0;
  for (std::size_t i = 0; i < convolutions.size(); ++i) {
    for (const Source& source : convolutions.at(i).sources) {
      (source.convolution ? last_use.at(*source.convolution) : last_use_of_input) = i;
    }
  }
  const auto pixels = [&](unsigned level) { return (tile.x >> level) * (tile.y >> level); };
  Arena arena;
  Memory memory;
  memory.input = arena.take(input_blocks(network) * pixels(0), last_use_of_input);
  for (std::size_t i = 0; i + 1 < convolutions.size(); ++i) {
    const Convolution& convolution = convolutions.at(i);
    arena.free_before(i);
    const unsigned level = convolution.level + (convolution.pooled ? 1 : 0);
    memory.results.at(i) = arena.take(result_blocks(convolution) * pixels(level), last_use.at(i));
  }
  memory.size = arena.size();
  return memory;
}

}  // namespace cumulet::denoise
