#include "volume/device_bricks.hpp"

#include <algorithm>
#include <limits>
#include <numeric>
#include <utility>

#include "base/error.hpp"

namespace cumulet::volume {

std::optional<std::uint32_t> DeviceBricks::find(const glm::ivec3& origin) const {
  const auto found = std::ranges::lower_bound(origins, origin, lexicographic);
  if (found == origins.end() || *found != origin) return std::nullopt;
  return static_cast<std::uint32_t>(found - origins.begin());
}

bool DeviceBricks::are_halves() const {
  return std::ranges::all_of(memories, [](const DeviceMemoryPtr& memory) { return memory->halves; });
}

bool DeviceBricks::gone() const {
  return std::ranges::any_of(memories, [](const DeviceMemoryPtr& memory) { return memory->gone.load(); });
}

void DeviceBricks::ask_for_values() const {
  if (gone())
    throw Error(ErrorCode::unsupported, "the volume's voxels were lost with their OpenGL context; set a new state");
  if (wanted) wanted->ask();
}

bool DeviceBricks::scattered() const {
  constexpr std::size_t max_memories = 16;
  constexpr std::size_t few = 1024;
  std::size_t held = 0;
  for (const DeviceMemoryPtr& memory : memories) held += memory->bricks();
  return memories.size() > max_memories || held > 2 * origins.size() + few;
}

std::uint64_t DeviceBricks::bytes() const {
  std::uint64_t bytes = origins.size() * (sizeof(glm::ivec3) + sizeof(Location));
  for (const DeviceMemoryPtr& memory : memories) bytes += memory->bricks() * sizeof(BrickSummary);
  return bytes;
}

void DeviceBricks::fill_means(std::size_t brick, BrickValues::Brick& values) const {
  const BrickSummary& s = summary(brick);
  for (unsigned v = 0; v < values.size(); ++v) values[v] = s.blocks[block_of_voxel(v)] / 8.0F;
}

void DeviceBricks::drop_empty() {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < origins.size(); ++i) {
    const std::uint64_t huge = huge_voxels_of(summary(i));
    if (summary(i).voxels == huge << CM_BRICK_HUGE_SHIFT) {
      huge_voxels += huge;
      emptied.push_back(origins[i]);
      continue;
    }
    origins[kept] = origins[i];
    locations[kept++] = locations[i];
  }
  origins.resize(kept);
  locations.resize(kept);
}

void DeviceBricks::tidy() {
  std::vector<std::size_t> order(origins.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::sort(order, [&](std::size_t a, std::size_t b) { return lexicographic(origins[a], origins[b]); });
  DeviceBricks made;
  made.wanted = wanted;
  made.huge_voxels = huge_voxels;
  constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();
  std::vector<std::uint32_t> kept(memories.size(), none);
  for (const std::size_t i : order) {
    Location location = locations[i];
    std::uint32_t& memory = kept[location.memory];
    if (memory == none) {
      memory = static_cast<std::uint32_t>(made.memories.size());
      made.memories.push_back(memories[location.memory]);
    }
    location.memory = memory;
    made.origins.push_back(origins[i]);
    made.locations.push_back(location);
  }
  *this = std::move(made);
}

DeviceBricks DeviceBricks::with(const DeviceBricks& other) const {
  std::vector<glm::ivec3> replaced = other.origins;
  replaced.insert(replaced.end(), other.emptied.begin(), other.emptied.end());
  std::ranges::sort(replaced, lexicographic);
  DeviceBricks made;
  made.wanted = wanted;
  made.huge_voxels = other.huge_voxels;
  made.memories = memories;
  for (std::size_t i = 0; i < origins.size(); ++i) {
    if (std::ranges::binary_search(replaced, origins[i], lexicographic)) continue;
    made.origins.push_back(origins[i]);
    made.locations.push_back(locations[i]);
  }
  const auto first = static_cast<std::uint32_t>(made.memories.size());
  made.memories.insert(made.memories.end(), other.memories.begin(), other.memories.end());
  made.origins.insert(made.origins.end(), other.origins.begin(), other.origins.end());
  for (const Location& location : other.locations) made.locations.push_back({first + location.memory, location.brick});
  made.tidy();
  return made;
}

}  // namespace cumulet::volume
