#include "transform_rows.hpp"

#include <algorithm>
#include <cmath>
#include <glm/glm.hpp>
#include <glm/gtc/matrix_transform.hpp>
#include <glm/gtc/type_ptr.hpp>
#include <numbers>

namespace cumulet::demo {
namespace {

using glm::dmat4;
using glm::dvec3;

constexpr double degree = std::numbers::pi / 180.0;
constexpr double tolerance = 1e-9;

bool is_same(const ObjectMatrix& a, const ObjectMatrix& b) {
  double size = 0.0;
  for (const double one : b) size = std::max(size, std::abs(one));
  return std::ranges::equal(a, b, [&](double x, double y) { return std::abs(x - y) <= tolerance * size; });
}

bool is_uniform(const std::array<double, 3>& scale) {
  const double apart = 1e-9 * std::abs(scale[0]);
  return std::abs(scale[1] - scale[0]) <= apart && std::abs(scale[2] - scale[0]) <= apart;
}

}  // namespace

ObjectMatrix matrix_of(const Stand& stand) {
  dmat4 matrix = glm::translate(dmat4(1.0), glm::make_vec3(stand.position.data()));
  for (int axis = 2; axis >= 0; --axis) {
    dvec3 along(0.0);
    along[axis] = 1.0;
    matrix = glm::rotate(matrix, stand.degrees[static_cast<std::size_t>(axis)] * degree, along);
  }
  matrix = glm::scale(matrix, glm::make_vec3(stand.scale.data()));
  ObjectMatrix numbers{};
  std::copy_n(glm::value_ptr(matrix), numbers.size(), numbers.begin());
  return numbers;
}

std::optional<Stand> stand_of(const ObjectMatrix& numbers) {
  const dmat4 matrix = glm::make_mat4(numbers.data());
  Stand stand;
  std::array<dvec3, 3> axes{};
  for (int i = 0; i < 3; ++i) {
    const auto at = static_cast<std::size_t>(i);
    const dvec3 column(matrix[i]);
    stand.position[at] = matrix[3][i];
    stand.scale[at] = glm::length(column);
    if (!(stand.scale[at] > 0.0)) return std::nullopt;
    axes[at] = column / stand.scale[at];
  }
  // The rotation is Rz Ry Rx.
  const double sin_y = std::clamp(-axes[0].z, -1.0, 1.0);
  const bool locked = std::abs(sin_y) > 1.0 - 1e-12;  // X and Z turn about one axis
  const double x = locked ? std::atan2(-axes[2].y, axes[1].y) : std::atan2(axes[1].z, axes[2].z);
  const double z = locked ? 0.0 : std::atan2(axes[0].y, axes[0].x);
  // Adding 0 makes -0 positive.
  stand.degrees = {x / degree + 0.0, std::asin(sin_y) / degree + 0.0, z / degree + 0.0};
  if (!is_same(matrix_of(stand), numbers)) return std::nullopt;
  return stand;
}

void TransformRows::draw(SceneVolume& volume, std::size_t transform_index) {
  auto& transforms = volume.transforms;
  ObjectMatrix transform = matrix_of({});
  if (transform_index < transforms.size()) transform = transforms[transform_index];
  const auto moved = rows(transform);
  if (!moved) return;
  if (transforms.empty()) transforms.emplace_back();
  transforms[transform_index] = *moved;
}

void TransformRows::draw(ObjectMatrix& transform) {
  if (const auto moved = rows(transform == ObjectMatrix{} ? matrix_of({}) : transform)) transform = *moved;
}

std::optional<ObjectMatrix> TransformRows::rows(const ObjectMatrix& now) {
  if (last_ && !is_same(matrix_of(*last_), now)) last_.reset();
  const std::optional<Stand> known = last_ ? last_ : stand_of(now);
  Stand stand = known.value_or(Stand{{now[12], now[13], now[14]}});
  const double far = std::hypot(stand.position[0], stand.position[1], stand.position[2]);
  bool moved = ui_.numbers("Position", "X, Y and Z, in addition to the place in the file.", stand.position,
                           static_cast<float>(0.01 * std::max(1.0, far)));
  if (!known) {
    ui_.value_row("Rotation", "This transform has shear. Use the handles.");
    if (!moved) return std::nullopt;
    ObjectMatrix other = now;
    std::ranges::copy(stand.position, other.begin() + 12);
    return other;
  }
  moved |= ui_.numbers("Rotation", "Degrees about the X, Y and Z axis, in this order. Y is up.", stand.degrees, 0.5f);
  if (is_uniform(stand.scale)) {
    if (ui_.slider("Scale", "Size, relative to the file.", stand.scale[0], 0.01, 100.0, "%.3g",
                   ImGuiSliderFlags_Logarithmic)) {
      stand.scale.fill(stand.scale[0]);
      moved = true;
    }
  } else if (auto scale = stand.scale; ui_.numbers("Scale", "Size along the object's own axes.", scale, 0.01f) &&
                                       std::ranges::all_of(scale, [](double one) { return one > 0.0; })) {
    stand.scale = scale;
    moved = true;
  }
  if (!moved) return std::nullopt;
  last_ = stand;
  return matrix_of(stand);
}

}  // namespace cumulet::demo
