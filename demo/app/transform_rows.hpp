#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include "model.hpp"
#include "ui.hpp"

namespace cumulet::demo {

/// Position, rotation and scale of an object: the scale is applied first, along the object's axes, then the rotations
/// about X, Y and Z in this order, and then the translation, as in Blender.
struct Stand {
  std::array<double, 3> position{};
  std::array<double, 3> degrees{};
  std::array<double, 3> scale{1.0, 1.0, 1.0};
};

/// Column-major.
using ObjectMatrix = std::array<double, 16>;
[[nodiscard]] ObjectMatrix matrix_of(const Stand& stand);
/// Returns nullopt for transforms with shear or a reflection, and for those that are not invertible.
[[nodiscard]] std::optional<Stand> stand_of(const ObjectMatrix& numbers);

/// Rows of the panel that edit the transform of an object.
class TransformRows {
 public:
  explicit TransformRows(Ui& ui) : ui_(ui) {}
  TransformRows(const TransformRows&) = delete;
  TransformRows& operator=(const TransformRows&) = delete;
  ~TransformRows() = default;

  void draw(SceneVolume& volume, std::size_t transform_index);
  /// transform: zeros are the identity.
  void draw(ObjectMatrix& transform);

 private:
  /// Returns the new transform if the user changed it.
  std::optional<ObjectMatrix> rows(const ObjectMatrix& now);

  Ui& ui_;
  // The numbers that were typed or dragged last: a matrix does not determine them.
  std::optional<Stand> last_;
};

}  // namespace cumulet::demo
