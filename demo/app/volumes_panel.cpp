// The volumes section of the panel, with the scene's first volume (edited by the other sections) and the others, and
// the models section.

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

void Panel::stand(SceneVolume& volume, std::optional<std::size_t> transform_index, const std::string& number) {
  auto& transforms = volume.transforms;
  if (transforms.size() > 1) {
    ui_.value_row(("Instances" + number).c_str(), std::to_string(transforms.size()));
    if (!transform_index || *transform_index >= transforms.size()) return;
    if (const auto moved = stand_at(transforms[*transform_index], number)) transforms[*transform_index] = *moved;
    return;
  }
  std::optional<Matrix> only;
  if (!transforms.empty()) only = transforms.front();
  if (const auto moved = stand_at(only, number)) transforms.assign(1, *moved);
}

std::optional<Matrix> Panel::stand_at(const std::optional<Matrix>& transform, const std::string& number) {
  const Matrix now = transform.value_or(matrix_of({}));
  const std::optional<Stand> upright = stand_of(now);
  Stand stand = upright.value_or(Stand{{now[12], now[13], now[14]}});
  const double far = std::hypot(stand.position[0], stand.position[1], stand.position[2]);
  bool moved = ui_.numbers(("Position" + number).c_str(), "Translation, in addition to the transform of the file.",
                           stand.position, static_cast<float>(0.01 * std::max(1.0, far)));
  ImGui::BeginDisabled(!upright);
  moved |= ui_.slider(("Rotation" + number).c_str(), "Rotation about the vertical axis, in degrees.",
                      stand.turn_degrees, -180.0, 180.0, "%.1f");
  moved |= ui_.slider(("Scale" + number).c_str(), "Uniform scale.", stand.scale, 0.01, 100.0, "%.3g",
                      ImGuiSliderFlags_Logarithmic);
  ImGui::EndDisabled();
  if (!moved) return std::nullopt;
  if (upright) return matrix_of(stand);
  Matrix other = now;
  std::ranges::copy(stand.position, other.begin() + 12);
  return other;
}

void Panel::models(Model& model, std::vector<Command>& commands) {
  std::vector<SceneModel>& models = model.scene.models;
  std::optional<std::size_t> removed;
  std::optional<std::size_t> copied;
  for (std::size_t i = 0; i < models.size(); ++i) {
    SceneModel& one = models[i];
    const std::string number = " of model " + std::to_string(i + 1);
    if (i > 0) ImGui::Separator();
    ui_.value_row(("Model " + std::to_string(i + 1)).c_str(), one.label());
    std::string& typed = model_names_[i];
    if (!ImGui::IsAnyItemActive()) typed = one.name;
    if (ui_.text(("Name" + number).c_str(), "Name in the scene file. Press Enter to accept.", "name of the file",
                 typed))
      one.name = typed;
    ui_.checkbox(("Visible" + number).c_str(), "If off, the object is hidden and casts no shadow.", one.visible);
    ui_.checkbox(("Shadow only" + number).c_str(),
                 "Invisible to the camera, but casts shadows and appears in reflections.", one.shadow_only);
    ui_.checkbox(("Holdout" + number).c_str(), "Leaves a hole with alpha 0 in the image.", one.holdout);
    std::optional<Matrix> transform;
    if (one.to_world != Matrix{}) transform = one.to_world;
    if (const auto moved = stand_at(transform, number)) one.to_world = *moved;
    const float spacing = ImGui::GetStyle().ItemSpacing.x;
    const float width = (ImGui::GetContentRegionAvail().x - spacing) / 2.0f;
    const std::string plain = " model " + std::to_string(i + 1);
    if (ui_.button(("Copy" + plain).c_str(), "Duplicates this model; both share their triangles.", {width, 0.0f}))
      copied = i;
    ImGui::SameLine();
    if (ui_.button(("Remove" + plain).c_str(), "Removes it from the scene.", {width, 0.0f})) removed = i;
  }
  if (copied) {
    models.insert(models.begin() + static_cast<std::ptrdiff_t>(*copied) + 1, SceneModel(models[*copied]));
    model.chosen = Item{Item::Kind::model, *copied + 1, 0};
  }
  if (removed) {
    models.erase(models.begin() + static_cast<std::ptrdiff_t>(*removed));
    forget(model.chosen, Item::Kind::model, *removed);
  }
  if (ui_.button("Add model", "Adds another model.", {-1.0f, 0.0f})) commands.push_back({Action::add_model_dialog});
}

void Panel::volumes(Model& model, std::vector<Command>& commands) {
  const auto row = [this, &model](SceneVolume& volume, std::size_t i) {
    const std::string number = std::string(" ").append(std::to_string(i));
    if (i > 1) ImGui::Separator();
    ui_.value_row(("Volume" + number).c_str(), volume.label());
    std::string& typed = names_[i];
    if (!ImGui::IsAnyItemActive()) typed = volume.name;
    if (ui_.text(("Name" + number).c_str(), "Name in the scene file. Press Enter to accept.", "name of the file",
                 typed))
      volume.name = typed;
    ui_.checkbox(("Visible" + number).c_str(), "If off, the object is hidden and casts no shadow.", volume.visible);
    const auto& chosen = model.chosen;
    const bool is_chosen = chosen && chosen->kind == Item::Kind::volume && chosen->index + 1 == i;
    stand(volume, is_chosen ? std::optional(chosen->transform_index) : std::nullopt, number);
  };
  if (!model.scene.volume.empty()) row(model.scene, 1);

  std::vector<SceneVolume>& others = model.scene.others;
  std::optional<std::size_t> removed;
  std::optional<std::size_t> copied;
  for (std::size_t i = 0; i < others.size(); ++i) {
    SceneVolume& other = others[i];
    const std::string number = std::string(" ").append(std::to_string(i + 2));
    row(other, i + 2);
    using Desc = cumulet_medium_desc;
    settings::for_each<Desc>([&](auto setting) {
      if (!setting.is(&Desc::density_scale) && !setting.is(&Desc::coalbedo)) return;
      const std::string label = setting.row.label + number;
      setting.row.label = label.c_str();
      if (setting.is(&Desc::density_scale) && other.auto_density_scale) setting.row.zero = "auto";
      if (rows_.draw(setting, other.medium.*setting.field) && setting.is(&Desc::density_scale))
        other.auto_density_scale = false;
    });
    const float spacing = ImGui::GetStyle().ItemSpacing.x;
    const float width = (ImGui::GetContentRegionAvail().x - spacing) / 2.0f;
    if (ui_.button(("Copy volume" + number).c_str(), "Duplicates this volume; both share one grid.", {width, 0.0f}))
      copied = i;
    ImGui::SameLine();
    if (ui_.button(("Remove volume" + number).c_str(), "Removes it from the scene.", {width, 0.0f})) removed = i;
  }
  // Indices of `others` do not include the scene's first volume.
  if (copied) {
    others.insert(others.begin() + static_cast<std::ptrdiff_t>(*copied) + 1, SceneVolume(others[*copied]));
    model.chosen = Item{Item::Kind::volume, *copied + 2, 0};
  }
  if (removed) {
    others.erase(others.begin() + static_cast<std::ptrdiff_t>(*removed));
    forget(model.chosen, Item::Kind::volume, *removed + 1);
  }
  if (ui_.button("Add volume", "Adds another volume.", {-1.0f, 0.0f})) commands.push_back({Action::add_volume_dialog});
}

}  // namespace cumulet::demo
