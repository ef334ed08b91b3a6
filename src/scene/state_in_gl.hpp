#pragma once

#include <array>
#include <glm/glm.hpp>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "scene/channels.hpp"
#include "volume/device_bricks.hpp"
#include "volume/frame.hpp"
#include "volume/memory.hpp"

namespace cumulet::scene {

/// What of a volume gives off light by these settings, as emission_of() has it, but in GL and but for roundings.
struct EmissionInGl {
  Emission settings;
  /// Red, green and blue: the same bricks in the same order, none of them black, as floats.
  std::array<volume::DeviceBricksPtr, 3> components;
};

/// A volume whose bricks are in GL: density, which may be nothing, and what burns.
struct StateInGl {
  struct Field {
    volume::Channel channel;
    volume::DeviceBricksPtr bricks;
  };
  std::string name;
  std::vector<Field> fields;  ///< one lattice has them all
  glm::dmat4 index_to_world{1.0};
  std::vector<EmissionInGl> emissions;  ///< those that were found

  /// Null: it has no such field.
  [[nodiscard]] volume::DeviceBricksPtr field(volume::Channel channel) const;
  /// Null: it was not found.
  [[nodiscard]] const EmissionInGl* emission(const Emission& settings) const;
  /// All that is in GL.
  [[nodiscard]] std::vector<volume::DeviceBricksPtr*> all();
  [[nodiscard]] std::vector<const volume::DeviceBricks*> all() const;
  /// Whether any of it went with its context.
  [[nodiscard]] bool gone() const;
  /// Whether any of it gives off light by these settings, as far as they tell.
  [[nodiscard]] bool emits(const Emission& settings) const;
  /// What volumes are made of; their voxels are not in main memory.
  [[nodiscard]] volume::VolumeFrame frame() const;
  [[nodiscard]] std::optional<grid::RgbField::Components> components(const EmissionInGl& emission) const;
};
using StateInGlPtr = std::shared_ptr<const StateInGl>;

}  // namespace cumulet::scene
