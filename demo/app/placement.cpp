#include "placement.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <glm/gtc/matrix_transform.hpp>
#include <string>
#include <tiny_objects.hpp>
#include <utility>
#include <vector>

#include "app.hpp"
#include "selection.hpp"

namespace cumulet::demo {
namespace {

using glm::dvec3;

double size_of(const Box& box) { return glm::distance(box.least, box.most); }

/// Returns the nearest number with one significant digit: 1, 2 or 5 times a power of ten.
double round_scale(double scale) {
  const double power = std::pow(10.0, std::floor(std::log10(scale)));
  const double digits = scale / power;
  return power * (digits < 1.5 ? 1.0 : digits < 3.5 ? 2.0 : digits < 7.5 ? 5.0 : 10.0);
}

/// Returns the distance between two boxes; 0 if they touch.
double gap_between(const Box& a, const Box& b) {
  return glm::length(glm::max(glm::max(a.least - b.most, b.least - a.most), dvec3(0.0)));
}

void add(std::optional<Box>& all, const Box& box, const glm::dmat4& transform) {
  for (int corner = 0; corner < 8; ++corner) {
    const dvec3 at((corner & 1) != 0 ? box.most.x : box.least.x, (corner & 2) != 0 ? box.most.y : box.least.y,
                   (corner & 4) != 0 ? box.most.z : box.least.z);
    const dvec3 moved(transform * glm::dvec4(at, 1.0));
    if (!all) all = Box{moved, moved};
    all->least = glm::min(all->least, moved);
    all->most = glm::max(all->most, moved);
  }
}

bool is_visible(const SceneOptions& scene, const Item& item) {
  return item.kind == Item::Kind::model ? scene.models[item.index].visible : volume_at(scene, item.index).is_shown();
}

std::optional<Box> box_of_surfaces(const Model& model) {
  const cumulet_surfaces_info& surfaces = model.status.surfaces;
  if (model.scene.surfaces.empty() || surfaces.triangles == 0) return std::nullopt;
  const auto& low = surfaces.bounds_min;
  const auto& high = surfaces.bounds_max;
  return Box{{low[0], low[1], low[2]}, {high[0], high[1], high[2]}};
}

/// Returns the box of all objects except one.
std::optional<Box> box_of_items(const Model& model, const std::optional<Item>& except) {
  std::optional<Box> all;
  for (const Item& other : items_of(model.scene)) {
    if (other == except || other.kind == Item::Kind::analytic_light) continue;
    const auto box = box_of(model.scene, model.status.boxes, other);
    const auto transform = transform_of(model.scene, other);
    if (box && transform) add(all, *box, *transform);
  }
  return all;
}

}  // namespace

std::optional<Box> box_of_others(const Model& model, const Item& item) { return box_of_items(model, item); }

std::optional<Placement> place_in(const Box& scene, const Box& object, const dvec3& eye) {
  constexpr double max_ratio = 30.0;  // of sizes
  constexpr double max_gap = 3.0;     // relative to the larger size
  constexpr double wanted = 0.3;      // size relative to the scene's
  const double scene_size = size_of(scene);
  const double size = size_of(object);
  if (!(scene_size > 0.0 && size > 0.0)) return std::nullopt;
  const double ratio = size / scene_size;
  const bool other_size = ratio < 1.0 / max_ratio || ratio > max_ratio;
  const bool far = gap_between(scene, object) > max_gap * std::max(size, scene_size);
  if (!other_size && !far) return std::nullopt;
  Placement placement;
  if (other_size) placement.scale = round_scale(wanted / ratio);
  const dvec3 middle = 0.5 * (scene.least + scene.most);
  const dvec3 half = 0.5 * (scene.most - scene.least);
  const dvec3 object_half = 0.5 * placement.scale * (object.most - object.least);
  dvec3 toward = eye - middle;
  toward.y = 0.0;
  toward = glm::length(toward) > 1e-9 * scene_size ? glm::normalize(toward) : dvec3(0.0, 0.0, 1.0);
  // Reach of both boxes along the direction to the camera.
  const double reach = glm::dot(glm::abs(toward), half + object_half);
  dvec3 place = middle + toward * reach;
  place.y = scene.least.y + object_half.y;
  const dvec3 object_middle = 0.5 * (object.least + object.most);
  placement.transform = glm::translate(glm::dmat4(1.0), place - placement.scale * object_middle);
  placement.transform = glm::scale(placement.transform, dvec3(placement.scale));
  return placement;
}

bool place(Model& model, const Item& item, const Box& box, const Box& others, double now) {
  const auto& eye = model.scene.camera.eye;
  const auto placement = place_in(others, box, {eye[0], eye[1], eye[2]});
  if (!placement) return false;
  set_transform(model.scene, item, placement->transform);
  const double ratio = size_of(box) / size_of(others);
  std::array<char, 96> text{};
  if (placement->scale == 1.0)
    std::snprintf(text.data(), text.size(), " is far from the scene: moved into view");
  else if (ratio < 1.0)
    std::snprintf(text.data(), text.size(), " is %.0f times smaller than the scene: scaled by %g", 1.0 / ratio,
                  placement->scale);
  else
    std::snprintf(text.data(), text.size(), " is %.0f times larger than the scene: scaled by %g", ratio,
                  placement->scale);
  const bool is_model = item.kind == Item::Kind::model;
  show_message(model, false, row_text(model.scene, item) + text.data(), now,
               MessageButton{"Own place",
                             "Restores the size and the place of the file.",
                             {Action::keep_place, is_model ? "model" : "volume", static_cast<int>(item.index)}});
  return true;
}

bool adopt_surfaces(Model& model, bool in_view, double now) {
  SceneOptions& scene = model.scene;
  if (scene.surfaces.empty()) return false;
  const auto box = box_of_surfaces(model);
  const auto others = box_of_items(model, std::nullopt);
  const cumulet_surface_settings_desc& settings = scene.surface;
  // The surfaces of a scene file are its first model.
  const std::size_t index = in_view ? scene.models.size() : 0;
  if (index < scene.models.size()) deselect(model);
  scene.models.insert(scene.models.begin() + static_cast<std::ptrdiff_t>(index),
                      {.file = std::exchange(scene.surfaces, ""),
                       .holdout = settings.holdout != 0,
                       .time = settings.time,
                       .animation = settings.animation,
                       .variant = std::exchange(scene.surface_variant, ""),
                       .double_sided = settings.double_sided != 0,
                       .group = settings.group});
  scene.surface = shared_settings(settings);
  scene.surface_camera = -1;  // the scene's camera has its pose
  const Item item{Item::Kind::model, index, 0};
  return in_view && box && others && place(model, item, *box, *others, now);
}

bool remark_on_tiny(Model& model, double now) {
  const SceneOptions& scene = model.scene;
  std::vector<PlacedBox> boxes;
  const auto add_box = [&](const std::string& name, const Box& box, const glm::dmat4& transform) {
    std::optional<Box> moved;
    add(moved, box, transform);
    boxes.push_back(
        {name, {moved->least.x, moved->least.y, moved->least.z}, {moved->most.x, moved->most.y, moved->most.z}});
  };
  for (const Item& item : items_of(scene)) {
    if (item.kind == Item::Kind::analytic_light || !is_visible(scene, item)) continue;
    const auto box = box_of(scene, model.status.boxes, item);
    if (!box) return false;
    add_box(row_text(scene, item), *box, transform_of(scene, item).value_or(glm::dmat4(1.0)));
  }
  for (const std::string& remark : remarks_on_tiny(boxes)) show_message(model, false, remark, now);
  return true;
}

void App::take_added(const Item& item) {
  select(model_, item);
  loading_.added.push_back(item);
}

void App::drop_failed(const std::string& file) {
  const auto& scene = model_.scene;
  const auto is_of = [&](const Item& item) {
    return item.kind == Item::Kind::model ? scene.models[item.index].file == file
                                          : volume_at(scene, item.index).volume == file;
  };
  for (bool found = true; found;) {
    const auto failed = std::ranges::find_if(loading_.added, is_of);
    found = failed != loading_.added.end();
    if (!found) break;
    const Item item = *failed;
    loading_.added.erase(failed);
    remove_item(model_.scene, item);
    for (Item& later : loading_.added)
      if (later.kind == item.kind && later.index > item.index) --later.index;
    deselect(model_);
  }
}

void App::place_added() {
  if (!model_.scene.surfaces.empty()) {
    const bool opened = std::exchange(loading_.surfaces, false);
    // The program has placed the camera by the file's own place.
    if (adopt_surfaces(model_, opened, now_) && loading_.starting && loading_.fit_all)
      request({Request::Type::frame_all});
    if (loading_.starting)
      history_.emplace(model_.scene);
    else if (opened)
      select(model_, Item{Item::Kind::model, model_.scene.models.size() - 1, 0});
  }
  for (const Item& item : std::exchange(loading_.added, {})) {
    if (!transform_of(model_.scene, item)) continue;
    const auto box = box_of(model_.scene, model_.status.boxes, item);
    if (!box) {
      loading_.added.push_back(item);
      continue;
    }
    if (const auto others = box_of_others(model_, item)) place(model_, item, *box, *others, now_);
  }
  if (loading_.remark && remark_on_tiny(model_, now_)) loading_.remark = false;
}

}  // namespace cumulet::demo
