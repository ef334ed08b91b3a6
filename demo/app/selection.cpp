#include "selection.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <glm/glm.hpp>
#include <numbers>
#include <settings.hpp>
#include <utility>

namespace cumulet::demo {
namespace {

bool contains(const std::vector<Item>& items, const Item& item) {
  return std::ranges::find(items, item) != items.end();
}

/// Returns the item at which `item` is found after `made` was inserted. A copy is inserted behind its original.
Item shifted(Item item, const Item& made) {
  if (item.kind != made.kind) return item;
  if (made.transform_index > 0 && item.index == made.index) {
    if (item.transform_index >= made.transform_index) ++item.transform_index;
  } else if (made.transform_index == 0 && item.index >= made.index) {
    ++item.index;
  }
  return item;
}

}  // namespace

Subject subject_of(const Model& model) {
  const std::vector<Item> items = listed_items(model.scene);
  if (model.subject) {
    const Item* item = std::get_if<Item>(&*model.subject);
    if (item == nullptr || contains(items, *item)) return *model.subject;
  }
  if (!items.empty()) return items.front();
  return Part::render;
}

std::vector<Item> selected_items(const Model& model) {
  const Subject subject = subject_of(model);
  const Item* const active = std::get_if<Item>(&subject);
  if (active == nullptr) return {};
  // After another selection, as by a click in the image, the subject is alone.
  if (!contains(model.marked, *active)) return {*active};
  std::vector<Item> items = listed_items(model.scene);
  std::erase_if(items, [&](const Item& item) { return !contains(model.marked, item); });
  return items;
}

void select(Model& model, const Subject& subject) {
  model.subject = subject;
  model.marked.clear();
  model.chosen.reset();
  const Item* item = std::get_if<Item>(&subject);
  if (item != nullptr && transform_of(model.scene, *item)) model.chosen = *item;
}

void select_items(Model& model, std::vector<Item> items, const Item& subject) {
  select(model, subject);
  model.marked = std::move(items);
}

void toggle_selected(Model& model, const Item& item) {
  std::vector<Item> items = selected_items(model);
  if (!contains(items, item)) {
    items.push_back(item);
    return select_items(model, std::move(items), item);
  }
  if (items.size() < 2) return;
  std::erase(items, item);
  const Subject subject = subject_of(model);
  const Item other = subject == Subject(item) ? items.back() : std::get<Item>(subject);
  select_items(model, std::move(items), other);
}

void deselect(Model& model) {
  model.subject.reset();
  model.chosen.reset();
  model.marked.clear();
}

bool has_selection(const Model& model) { return !selected_items(model).empty(); }

bool can_hide(const Model& model) {
  return std::ranges::any_of(selected_items(model),
                             [](const Item& item) { return item.kind != Item::Kind::analytic_light; });
}

void remove_selected(Model& model) {
  std::vector<Item> items = selected_items(model);
  if (items.empty()) return;
  // From the last one, because a removal changes the indices of later objects.
  std::ranges::reverse(items);
  for (const Item& item : items) remove_item(model.scene, item);
  spell_out_defaults(model.scene);
  deselect(model);
}

void duplicate_selected(Model& model) {
  std::vector<Item> items = selected_items(model);
  if (items.empty()) return;
  const auto active = std::ranges::find(items, std::get<Item>(subject_of(model))) - items.begin();
  for (std::size_t i = 0; i < items.size(); ++i) {
    const Item made = duplicate_item(model.scene, items[i]);
    for (std::size_t later = i + 1; later < items.size(); ++later) items[later] = shifted(items[later], made);
    items[i] = made;
  }
  const Item subject = items[static_cast<std::size_t>(active)];
  select_items(model, std::move(items), subject);
}

void hide_selected(Model& model) {
  std::vector<bool*> flags;
  for (const Item& item : selected_items(model))
    if (bool* const visible = visibility_of(model.scene, item)) flags.push_back(visible);
  const bool hidden = std::ranges::none_of(flags, [](const bool* visible) { return *visible; });
  for (bool* const visible : flags) *visible = hidden;
}

bool reorder(Model& model, const Item& from, const Item& to) {
  const std::optional<Item> moved = move_item(model.scene, from, to);
  if (!moved) return false;
  spell_out_defaults(model.scene);
  select(model, *moved);
  return true;
}

namespace {

// Half of the noon sun's in W/m², because parts of the scene are nearer to the light.
constexpr double new_light_irradiance = 2.0;

/// Returns the offset of a new light from the camera's target: above it, to the right and nearer to the camera, within
/// the image.
glm::dvec3 light_offset(const cumulet_camera_desc& camera) {
  using glm::dvec3;
  constexpr double library_fovy = 40.0;
  const dvec3 back(camera.eye[0] - camera.target[0], camera.eye[1] - camera.target[1],
                   camera.eye[2] - camera.target[2]);
  const double distance = glm::length(back);
  const dvec3 backward = distance > 0.0 ? back / distance : dvec3(0.0, 0.0, 1.0);
  dvec3 up(camera.up[0], camera.up[1], camera.up[2]);
  if (up == dvec3(0.0)) up = {0.0, 1.0, 0.0};
  dvec3 right = glm::cross(up, backward);
  // A camera that looks along its up direction has no right side of its own.
  right = glm::length(right) > 1e-9 * glm::length(up) ? glm::normalize(right) : dvec3(1.0, 0.0, 0.0);
  const double fovy = (camera.fovy_degrees > 0.0 ? camera.fovy_degrees : library_fovy) * std::numbers::pi / 180.0;
  double half_height = distance > 0.0 ? distance * std::tan(0.5 * fovy) : 1.0;
  if (camera.orthographic_height > 0.0) half_height = 0.5 * camera.orthographic_height;
  // A wide view is limited by the distance, so that the light is in front of the camera.
  if (distance > 0.0) half_height = std::min(half_height, distance);
  return half_height * (0.55 * glm::normalize(glm::cross(backward, right)) + 0.4 * right + 0.4 * backward);
}

/// Returns the irradiance of a new light at the middle of the scene. The exposure makes it as bright in every image.
double irradiance_in(const SceneOptions& scene) {
  return new_light_irradiance * std::exp2(-static_cast<double>(scene.display.exposure_stops));
}

/// Returns the power of a light at this distance. A distant light's power is its irradiance.
float power_of(cumulet_light_kind kind, double distance, const SceneOptions& scene) {
  const double reach = distance > 0.0 ? distance : 1.0;
  const double sphere = 4.0 * std::numbers::pi * reach * reach;
  return static_cast<float>(irradiance_in(scene) * (kind == CUMULET_LIGHT_DISTANT ? 1.0 : sphere));
}

}  // namespace

void adapt_light(cumulet_light_desc& light, cumulet_light_kind before, const SceneOptions& scene) {
  constexpr double cone = 45.0;          // degrees
  constexpr double relative_size = 0.3;  // of an area light, to its distance
  const auto& target = scene.camera.target;
  // A distant light of a scene file has no position.
  if (before == CUMULET_LIGHT_DISTANT && light.position[0] == 0.0 && light.position[1] == 0.0 &&
      light.position[2] == 0.0) {
    glm::dvec3 direction(light.direction[0], light.direction[1], light.direction[2]);
    direction = direction == glm::dvec3(0.0) ? glm::dvec3(0.0, -1.0, 0.0) : glm::normalize(direction);
    const double reach = glm::length(light_offset(scene.camera));
    for (int i = 0; i < 3; ++i) light.position[i] = target[i] - reach * direction[i];
  }
  const double distance =
      std::hypot(light.position[0] - target[0], light.position[1] - target[1], light.position[2] - target[2]);
  const bool distant = light.kind == CUMULET_LIGHT_DISTANT;
  // W and W/m² differ by the square of the distance.
  if (distant != (before == CUMULET_LIGHT_DISTANT)) light.power = power_of(light.kind, distance, scene);
  if (light.kind == CUMULET_LIGHT_SPOT && light.angle_degrees == 0.0) light.angle_degrees = cone;
  const bool is_area = light.kind == CUMULET_LIGHT_DISK || light.kind == CUMULET_LIGHT_RECT;
  constexpr double standard = 1.0;  // of both sizes, which suits few scenes
  if (!is_area || light.width != standard || light.height != standard || !(distance > 0.0)) return;
  light.width = light.height = relative_size * distance;
}

void add_light(Model& model) {
  const cumulet_camera_desc& camera = model.scene.camera;
  const glm::dvec3 target(camera.target[0], camera.target[1], camera.target[2]);
  const glm::dvec3 offset = light_offset(camera);
  const double distance = glm::length(offset);
  cumulet_light_desc& light = model.scene.analytic_lights.emplace_back();
  light.struct_size = sizeof light;
  for (int i = 0; i < 3; ++i) {
    light.position[i] = target[i] + offset[i];
    light.direction[i] = -offset[i] / distance;
  }
  light.power = power_of(light.kind, distance, model.scene);
  settings::spell_out_zeros(light);
  select(model, Item{Item::Kind::analytic_light, model.scene.analytic_lights.size() - 1, 0});
}

}  // namespace cumulet::demo
