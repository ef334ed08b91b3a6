// The inspector of a model, and the transforms of objects.

#include <imgui.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <optional>
#include <string>

#include "panel.hpp"

namespace cumulet::demo {

namespace {

using Matrix = std::array<double, 16>;

/// The transforms that the panel can edit: uniform scale, then rotation about the vertical axis, then translation.
struct Stand {
  std::array<double, 3> position{};
  double turn_degrees = 0.0;
  double scale = 1.0;
};

Matrix matrix_of(const Stand& stand) {
  const double angle = stand.turn_degrees * std::numbers::pi / 180.0;
  const double s = stand.scale * std::sin(angle);
  const double c = stand.scale * std::cos(angle);
  const auto& p = stand.position;
  return {c, 0.0, -s, 0.0, 0.0, stand.scale, 0.0, 0.0, s, 0.0, c, 0.0, p[0], p[1], p[2], 1.0};
}

/// Returns nullopt for transforms with shear, tilt or non-uniform scale.
std::optional<Stand> stand_of(const Matrix& m) {
  Stand stand{{m[12], m[13], m[14]}, std::atan2(-m[2], m[0]) * 180.0 / std::numbers::pi, m[5]};
  if (!(stand.scale > 0.0)) return std::nullopt;
  const Matrix same = matrix_of(stand);
  for (std::size_t i = 0; i < same.size(); ++i)
    if (!(std::abs(same[i] - m[i]) <= 1e-9 * stand.scale)) return std::nullopt;
  return stand;
}

}  // namespace

void Panel::stand(SceneVolume& volume, std::size_t transform_index) {
  auto& transforms = volume.transforms;
  std::optional<Matrix> transform;
  if (transform_index < transforms.size()) transform = transforms[transform_index];
  const auto moved = stand_at(transform);
  if (!moved) return;
  if (transforms.empty()) transforms.emplace_back();
  transforms[transform_index] = *moved;
}

std::optional<Matrix> Panel::stand_at(const std::optional<Matrix>& transform) {
  const Matrix now = transform.value_or(matrix_of({}));
  const std::optional<Stand> upright = stand_of(now);
  Stand stand = upright.value_or(Stand{{now[12], now[13], now[14]}});
  const double far = std::hypot(stand.position[0], stand.position[1], stand.position[2]);
  bool moved = ui_.numbers("Position", "Translation, in addition to the transform of the file.", stand.position,
                           static_cast<float>(0.01 * std::max(1.0, far)));
  if (upright) {
    moved |= ui_.slider("Rotation", "Rotation about the vertical axis, in degrees.", stand.turn_degrees, -180.0, 180.0,
                        "%.1f");
    moved |= ui_.slider("Scale", "Uniform scale.", stand.scale, 0.01, 100.0, "%.3g", ImGuiSliderFlags_Logarithmic);
  }
  if (!moved) return std::nullopt;
  if (upright) return matrix_of(stand);
  Matrix other = now;
  std::ranges::copy(stand.position, other.begin() + 12);
  return other;
}

void Panel::one_model(SceneModel& one) {
  ui_.value_row("Model", one.file);
  name_row(one.name);
  ui_.checkbox("Visible", "If off, the object is hidden and casts no shadow.", one.visible);
  ui_.checkbox("Shadow only", "Invisible to the camera, but casts shadows and appears in reflections.",
               one.shadow_only);
  ui_.checkbox("Holdout", "Leaves a hole with alpha 0 in the image.", one.holdout);
  std::optional<Matrix> transform;
  if (one.to_world != Matrix{}) transform = one.to_world;
  if (const auto moved = stand_at(transform)) one.to_world = *moved;
}

}  // namespace cumulet::demo
