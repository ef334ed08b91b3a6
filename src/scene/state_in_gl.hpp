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

/// Voxelwise products of a volume's fields. They are the GL counterparts of the functions in scene/channels.hpp. An
/// Emission is the product of emission_of() with these settings, Scattering that of scattering_of().
struct Scattering {
  bool operator==(const Scattering&) const = default;
};
/// The product of forward_of().
struct Forward {
  bool colored = false;  ///< whether the volume has a color
  bool operator==(const Forward&) const = default;
};
/// The product of momentum_of().
struct Momentum {
  float fastest = 0.0F;  ///< the speed that values are relative to
  bool operator==(const Momentum&) const = default;
};
using Product = std::variant<Emission, Scattering, Forward, Momentum>;
/// Returns the fields that a product is made of. Except for emission, the first is density, whose bricks the product
/// has. The order is that of glsl/grid/brick_products.comp.
std::vector<volume::Channel> fields_of(const Product& product);

/// A product in GL; equal to the one in main memory except for rounding.
struct ProductInGl {
  Product what;
  /// One or three components with the same bricks in the same order, as floats. No brick is 0 in all components.
  std::vector<volume::DeviceBricksPtr> components;
};

/// A volume whose bricks are GPU-resident: density, which may be empty, and other fields.
struct StateInGl {
  struct Field {
    volume::Channel channel;
    volume::DeviceBricksPtr bricks;
  };
  std::string name;
  std::vector<Field> fields;  ///< all on one lattice
  glm::dmat4 index_to_world{1.0};
  std::vector<ProductInGl> products;  ///< the products that have been made

  /// Returns null if there is no such field.
  [[nodiscard]] volume::DeviceBricksPtr field(volume::Channel channel) const;
  /// Returns null if it was not made.
  [[nodiscard]] const ProductInGl* product(const Product& what) const;
  /// Returns all products that volumes need of it for these emission settings, as far as the fields show. O(bricks of
  /// velocity).
  [[nodiscard]] std::vector<Product> wanted(const std::vector<Emission>& settings) const;
  /// Whether all products of wanted() have been made. O(1).
  [[nodiscard]] bool has_wanted(const std::vector<Emission>& settings) const;
  /// Returns the settings of one of its emission products, or null if there is none.
  [[nodiscard]] const Emission* some_emission() const;
  /// Returns all bricks that are in GL.
  [[nodiscard]] std::vector<volume::DeviceBricksPtr*> all();
  [[nodiscard]] std::vector<const volume::DeviceBricks*> all() const;
  /// Whether any of them was lost with its context.
  [[nodiscard]] bool gone() const;
  /// Whether it may emit with these settings, according to its fields.
  [[nodiscard]] bool emits(const Emission& settings) const;
  /// Returns the volume fields; their voxels are not in main memory. For signed fields, only the magnitude is present.
  [[nodiscard]] volume::VolumeFrame frame() const;
  // The products in the form of grid channels; nullopt if they were not made.
  [[nodiscard]] std::optional<grid::RgbField::Components> emission(const Emission& settings) const;
  [[nodiscard]] std::optional<grid::RgbField::Components> scattering() const;
  [[nodiscard]] std::optional<volume::ScalarVolume> forward() const;
  [[nodiscard]] std::optional<grid::MomentumField::Values> momentum() const;

 private:
  // Kinds of scattering data; all false if there is no density.
  struct Scatters {
    bool colored = false;
    bool anisotropic = false;
    bool moves = false;
  };
  [[nodiscard]] Scatters scatters() const;
  // Returns a product of this kind; null if there is none.
  template <class Kind>
  [[nodiscard]] const ProductInGl* made() const;
  // Returns nullopt if there is no such field.
  [[nodiscard]] std::optional<volume::ScalarVolume> volume_of(volume::Channel channel) const;
  [[nodiscard]] std::optional<volume::Velocity> velocity() const;
  // Returns a field on the lattice without voxels.
  [[nodiscard]] volume::ScalarVolume none() const;
};
using StateInGlPtr = std::shared_ptr<const StateInGl>;

}  // namespace cumulet::scene
