#include "selection.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
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
    const bool exists = item != nullptr ? contains(items, *item)
                                        : *model.subject != Subject(Part::surfaces) || !model.scene.surfaces.empty();
    if (exists) return *model.subject;
  }
  if (!items.empty()) return items.front();
  return model.scene.surfaces.empty() ? Part::render : Part::surfaces;
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

bool can_remove(const Model& model) { return can_duplicate(model) || subject_of(model) == Subject(Part::surfaces); }

bool can_duplicate(const Model& model) { return !selected_items(model).empty(); }

bool can_hide(const Model& model) {
  return std::ranges::any_of(selected_items(model),
                             [](const Item& item) { return item.kind != Item::Kind::analytic_light; });
}

void remove_selected(Model& model) {
  if (!can_remove(model)) return;
  std::vector<Item> items = selected_items(model);
  if (items.empty()) model.scene.surfaces.clear();
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

}  // namespace

void add_light(Model& model) {
  const cumulet_camera_desc& camera = model.scene.camera;
  const double distance =
      std::hypot(camera.eye[0] - camera.target[0], camera.eye[1] - camera.target[1], camera.eye[2] - camera.target[2]);
  const double above = distance > 0.0 ? 0.5 * distance : 1.0;
  cumulet_light_desc& light = model.scene.analytic_lights.emplace_back();
  light.struct_size = sizeof light;
  std::copy(camera.target, camera.target + 3, light.position);
  light.position[1] += above;
  light.direction[1] = -1.0;
  const double irradiance = new_light_irradiance * std::exp2(-static_cast<double>(model.scene.display.exposure_stops));
  light.power = static_cast<float>(irradiance * 4.0 * std::numbers::pi * above * above);
  settings::spell_out_zeros(light);
  select(model, Item{Item::Kind::analytic_light, model.scene.analytic_lights.size() - 1, 0});
}

}  // namespace cumulet::demo
