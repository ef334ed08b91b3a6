#pragma once

#include <array>
#include <glm/glm.hpp>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "scene/channels.hpp"
#include "volume/device_bricks.hpp"
#include "volume/frame.hpp"
#include "volume/memory.hpp"

namespace cumulet::scene {

/// What is made of a volume's fields, voxel by voxel, as the functions of these names make it in main memory
/// (scene/channels.hpp): its light by these settings is an Emission, and there is scattering_of(), ...
struct Scattering {
  bool operator==(const Scattering&) const = default;
};
/// ... forward_of(), ...
struct Forward {
  bool coloured = false;  ///< of what has a colour
  bool operator==(const Forward&) const = default;
};
/// ... and momentum_of().
struct Momentum {
  float fastest = 0.0F;  ///< what it is in units of
  bool operator==(const Momentum&) const = default;
};
using Product = std::variant<Emission, Scattering, Forward, Momentum>;
/// Which fields it is made of. But for light the first is density, of whose bricks it is, and they are in the order
/// that glsl/brick_products.comp has them in.
std::vector<volume::Channel> fields_of(const Product& product);

/// The same in GL, but for roundings.
struct ProductInGl {
  Product what;
  /// One or three: the same bricks in the same order, of which none is 0 in all of them, as floats.
  std::vector<volume::DeviceBricksPtr> components;
};

/// A volume whose bricks are in GL: density, which may be nothing, and what is beside it.
struct StateInGl {
  struct Field {
    volume::Channel channel;
    volume::DeviceBricksPtr bricks;
  };
  std::string name;
  std::vector<Field> fields;  ///< one lattice has them all
  glm::dmat4 index_to_world{1.0};
  std::vector<ProductInGl> products;  ///< those that were made

  /// Null: it has no such field.
  [[nodiscard]] volume::DeviceBricksPtr field(volume::Channel channel) const;
  /// Null: it was not made.
  [[nodiscard]] const ProductInGl* product(const Product& what) const;
  /// All that volumes need of it where its light is wanted by these settings, as far as the fields tell. O(bricks of
  /// velocity).
  [[nodiscard]] std::vector<Product> wanted(const std::vector<Emission>& settings) const;
  /// Whether it has all of that. O(1).
  [[nodiscard]] bool has_wanted(const std::vector<Emission>& settings) const;
  /// Light that was found of it, if any was: by which settings.
  [[nodiscard]] const Emission* some_emission() const;
  /// All that is in GL.
  [[nodiscard]] std::vector<volume::DeviceBricksPtr*> all();
  [[nodiscard]] std::vector<const volume::DeviceBricks*> all() const;
  /// Whether any of it went with its context.
  [[nodiscard]] bool gone() const;
  /// Whether any of it gives off light by these settings, as far as they tell.
  [[nodiscard]] bool emits(const Emission& settings) const;
  /// What volumes are made of; their voxels are not in main memory. Of what has a sign there is the magnitude.
  [[nodiscard]] volume::VolumeFrame frame() const;
  // What was made, as channels have it; nothing where it was not.
  [[nodiscard]] std::optional<grid::RgbField::Components> emission(const Emission& settings) const;
  [[nodiscard]] std::optional<grid::RgbField::Components> scattering() const;
  [[nodiscard]] std::optional<volume::ScalarVolume> forward() const;
  [[nodiscard]] std::optional<grid::MomentumField::Values> momentum() const;

 private:
  // Of its density, where there is any.
  struct Scatters {
    bool coloured = false;
    bool anisotropic = false;
    bool moves = false;
  };
  [[nodiscard]] Scatters scatters() const;
  // Of a kind of product that was made; null: none.
  template <class Kind>
  [[nodiscard]] const ProductInGl* made() const;
  // Nothing: it has no such field.
  [[nodiscard]] std::optional<volume::ScalarVolume> volume_of(volume::Channel channel) const;
  [[nodiscard]] std::optional<volume::Velocity> velocity() const;
  // Of its lattice, without a voxel.
  [[nodiscard]] volume::ScalarVolume none() const;
};
using StateInGlPtr = std::shared_ptr<const StateInGl>;

}  // namespace cumulet::scene
