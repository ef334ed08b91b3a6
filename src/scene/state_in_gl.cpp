#include "scene/state_in_gl.hpp"

#include <algorithm>
#include <limits>

#include "volume/bricks.hpp"

namespace cumulet::scene {

volume::DeviceBricksPtr StateInGl::field(volume::Channel channel) const {
  const auto found = std::ranges::find(fields, channel, &Field::channel);
  return found == fields.end() ? nullptr : found->bricks;
}

const EmissionInGl* StateInGl::emission(const Emission& settings) const {
  const auto found = std::ranges::find(emissions, settings, &EmissionInGl::settings);
  return found == emissions.end() ? nullptr : &*found;
}

bool StateInGl::emits(const Emission& settings) const {
  const auto is_there = [&](volume::Channel channel) {
    const volume::DeviceBricksPtr bricks = field(channel);
    return bricks && !bricks->origins.empty();
  };
  return (settings.burns() && is_there(volume::Channel::flame)) ||
         (settings.is_hot() && is_there(volume::Channel::temperature));
}

std::vector<volume::DeviceBricksPtr*> StateInGl::all() {
  std::vector<volume::DeviceBricksPtr*> all;
  for (Field& field : fields) all.push_back(&field.bricks);
  for (EmissionInGl& emission : emissions) {
    for (volume::DeviceBricksPtr& component : emission.components) all.push_back(&component);
  }
  return all;
}

std::vector<const volume::DeviceBricks*> StateInGl::all() const {
  std::vector<const volume::DeviceBricks*> all;
  for (const Field& field : fields) all.push_back(field.bricks.get());
  for (const EmissionInGl& emission : emissions) {
    for (const volume::DeviceBricksPtr& component : emission.components) all.push_back(component.get());
  }
  return all;
}

bool StateInGl::gone() const {
  return std::ranges::any_of(all(), [](const volume::DeviceBricks* bricks) { return bricks->gone(); });
}

volume::VolumeFrame StateInGl::frame() const {
  const auto volume_of = [&](volume::Channel channel) {
    const volume::DeviceBricksPtr bricks = field(channel);
    return bricks ? std::optional(volume::volume_on_device(bricks, name, index_to_world)) : std::nullopt;
  };
  volume::VolumeFrame frame;
  frame.density = *volume_of(volume::Channel::density);
  frame.temperature = volume_of(volume::Channel::temperature);
  frame.flame = volume_of(volume::Channel::flame);
  return frame;
}

std::optional<grid::RgbField::Components> StateInGl::components(const EmissionInGl& emission) const {
  const std::vector<glm::ivec3>& origins = emission.components[0]->origins;
  if (origins.empty()) return std::nullopt;
  grid::RgbField::Components made;
  for (std::size_t i = 0; i < made.size(); ++i) {
    volume::ScalarVolume& component = made[i];
    component = volume::volume_on_device(emission.components[i], "emission", index_to_world);
    // Whole bricks, as emission_of() has them.
    component.bounds_min = glm::ivec3(std::numeric_limits<int>::max());
    component.bounds_max = glm::ivec3(std::numeric_limits<int>::min());
    for (const glm::ivec3& origin : origins) {
      component.bounds_min = glm::min(component.bounds_min, origin);
      component.bounds_max = glm::max(component.bounds_max, origin + (volume::brick_size - 1));
    }
    component.active_voxels = origins.size() * volume::brick_voxels;
  }
  return made;
}

}  // namespace cumulet::scene
