#include "scene_items.hpp"

#include <algorithm>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <glm/gtc/type_ptr.hpp>
#include <utility>

namespace cumulet::demo {
namespace {

using glm::dmat4;
using glm::dvec3;
using glm::dvec4;
using Numbers = std::array<double, 16>;

bool has(const SceneOptions& scene, const Item& item) {
  switch (item.kind) {
    case Item::Kind::volume:
      if (item.index > scene.others.size() || volume_at(scene, item.index).volume.empty()) return false;
      return item.transform_index < std::max<std::size_t>(1, volume_at(scene, item.index).transforms.size());
    case Item::Kind::model:
      return item.index < scene.models.size();
    case Item::Kind::analytic_light:
      return item.index < scene.analytic_lights.size() &&
             scene.analytic_lights[item.index].kind != CUMULET_LIGHT_DISTANT;
  }
  return false;
}

dmat4 matrix_of(const Numbers& numbers) { return numbers == Numbers{} ? dmat4(1.0) : glm::make_mat4(numbers.data()); }

Numbers numbers_of(const dmat4& matrix) {
  Numbers numbers{};
  std::copy_n(glm::value_ptr(matrix), numbers.size(), numbers.begin());
  return numbers;
}

dmat4 transform_of(const cumulet_light_desc& analytic_light) {
  dmat4 transform(1.0);
  const dvec3 down(0.0, -1.0, 0.0);
  const dvec3 shines = glm::make_vec3(analytic_light.direction);
  const dvec3 direction = glm::length(shines) > 0.0 ? glm::normalize(shines) : down;
  dvec3 tangent = glm::make_vec3(analytic_light.tangent);
  tangent -= glm::dot(tangent, direction) * direction;
  constexpr double least = 1e-9;
  // Default of cumulet_light_desc: horizontal, or +X.
  if (!(glm::length(tangent) > least)) tangent = glm::cross(-down, direction);
  if (!(glm::length(tangent) > least)) tangent = dvec3(1.0, 0.0, 0.0);
  tangent = glm::normalize(tangent);
  transform[0] = dvec4(tangent, 0.0);
  transform[1] = dvec4(glm::cross(direction, tangent), 0.0);
  transform[2] = dvec4(direction, 0.0);
  transform[3] = dvec4(glm::make_vec3(analytic_light.position), 1.0);
  return transform;
}

void set_transform(cumulet_light_desc& analytic_light, const dmat4& transform) {
  const dmat4 before = transform_of(analytic_light);
  std::copy_n(glm::value_ptr(transform[3]), 3, analytic_light.position);
  // Unchanged directions keep their exact numbers.
  if (transform[2] != before[2])
    std::copy_n(glm::value_ptr(glm::normalize(dvec3(transform[2]))), 3, analytic_light.direction);
  if (transform[0] != before[0])
    std::copy_n(glm::value_ptr(glm::normalize(dvec3(transform[0]))), 3, analytic_light.tangent);
  const auto stretched = [](double length, double by) {
    double longer = length;
    if (std::abs(by - 1.0) > 1e-9) longer *= by;
    return longer;
  };
  const double wider = glm::length(dvec3(transform[0]));
  const double higher = glm::length(dvec3(transform[1]));
  const bool is_disc = analytic_light.kind == CUMULET_LIGHT_DISK;
  analytic_light.width = stretched(analytic_light.width, is_disc ? std::sqrt(wider * higher) : wider);
  if (!is_disc) analytic_light.height = stretched(analytic_light.height, higher);
}

std::string kind_name(cumulet_light_kind kind) {
  switch (kind) {
    case CUMULET_LIGHT_POINT:
      return "Point light";
    case CUMULET_LIGHT_SPOT:
      return "Spot light";
    case CUMULET_LIGHT_DISK:
      return "Disk light";
    case CUMULET_LIGHT_RECT:
      return "Rectangle light";
    case CUMULET_LIGHT_DISTANT:
      break;
  }
  return "Distant light";
}

}  // namespace

SceneVolume& volume_at(SceneOptions& scene, std::size_t index) {
  return index == 0 ? static_cast<SceneVolume&>(scene) : scene.others[index - 1];
}

const SceneVolume& volume_at(const SceneOptions& scene, std::size_t index) {
  return index == 0 ? static_cast<const SceneVolume&>(scene) : scene.others[index - 1];
}

std::vector<Item> listed_items(const SceneOptions& scene) {
  std::vector<Item> items = items_of(scene);
  std::erase_if(items, [](const Item& item) { return item.kind == Item::Kind::analytic_light; });
  for (std::size_t i = 0; i < scene.analytic_lights.size(); ++i) items.push_back({Item::Kind::analytic_light, i, 0});
  return items;
}

std::vector<Item> items_of(const SceneOptions& scene) {
  std::vector<Item> items;
  const auto add = [&](const Item& item) {
    if (has(scene, item)) items.push_back(item);
  };
  for (std::size_t i = 0; i <= scene.others.size(); ++i) {
    const std::size_t transforms = volume_at(scene, i).transforms.size();
    for (std::size_t transform_index = 0; transform_index < std::max<std::size_t>(1, transforms); ++transform_index)
      add({Item::Kind::volume, i, transform_index});
  }
  for (std::size_t i = 0; i < scene.models.size(); ++i) add({Item::Kind::model, i, 0});
  for (std::size_t i = 0; i < scene.analytic_lights.size(); ++i) add({Item::Kind::analytic_light, i, 0});
  return items;
}

std::string title_of(const SceneOptions& scene, const Item& item) {
  const std::string number = std::to_string(item.index + 1);
  switch (item.kind) {
    case Item::Kind::volume:
      if (volume_at(scene, item.index).transforms.size() < 2) return "Volume " + number;
      return "Volume " + number + ", instance " + std::to_string(item.transform_index + 1);
    case Item::Kind::model:
      return "Model " + number;
    case Item::Kind::analytic_light:
      break;
  }
  return "Light " + number;
}

std::string row_text(const SceneOptions& scene, const Item& item) {
  switch (item.kind) {
    case Item::Kind::volume: {
      const SceneVolume& volume = volume_at(scene, item.index);
      if (volume.transforms.size() < 2) return volume.label();
      return volume.label() + ", instance " + std::to_string(item.transform_index + 1);
    }
    case Item::Kind::model:
      return scene.models[item.index].label();
    case Item::Kind::analytic_light:
      break;
  }
  return kind_name(scene.analytic_lights[item.index].kind) + " " + std::to_string(item.index + 1);
}

std::string* name_of_object(SceneOptions& scene, const Item& item) {
  switch (item.kind) {
    case Item::Kind::volume:
      return &volume_at(scene, item.index).name;
    case Item::Kind::model:
      return &scene.models[item.index].name;
    case Item::Kind::analytic_light:
      break;
  }
  return nullptr;
}

bool* visibility_of(SceneOptions& scene, const Item& item) {
  switch (item.kind) {
    case Item::Kind::volume:
      return &volume_at(scene, item.index).visible;
    case Item::Kind::model:
      return &scene.models[item.index].visible;
    case Item::Kind::analytic_light:
      break;
  }
  return nullptr;
}

void remove_item(SceneOptions& scene, const Item& item) {
  const auto erase = [&](auto& all, std::size_t index) { all.erase(all.begin() + static_cast<std::ptrdiff_t>(index)); };
  switch (item.kind) {
    case Item::Kind::volume: {
      auto& transforms = volume_at(scene, item.index).transforms;
      if (transforms.size() > 1)
        erase(transforms, item.transform_index);
      else if (item.index == 0)
        static_cast<SceneVolume&>(scene) = SceneVolume();
      else
        erase(scene.others, item.index - 1);
      return;
    }
    case Item::Kind::model:
      return erase(scene.models, item.index);
    case Item::Kind::analytic_light:
      return erase(scene.analytic_lights, item.index);
  }
}

Item duplicate_item(SceneOptions& scene, const Item& item) {
  const auto copy = [](auto& all, std::size_t index) {
    auto one = all[index];
    all.insert(all.begin() + static_cast<std::ptrdiff_t>(index) + 1, std::move(one));
  };
  Item made = item;
  switch (item.kind) {
    case Item::Kind::volume: {
      auto& transforms = volume_at(scene, item.index).transforms;
      if (transforms.size() > 1) {
        copy(transforms, item.transform_index);
        ++made.transform_index;
        return made;
      }
      SceneVolume volume = volume_at(scene, item.index);
      volume.medium.max_bounces = 0;  // the first volume's value applies to all
      // The first volume has index 0, and the others begin at 1.
      scene.others.insert(scene.others.begin() + static_cast<std::ptrdiff_t>(item.index), std::move(volume));
      break;
    }
    case Item::Kind::model:
      copy(scene.models, item.index);
      break;
    case Item::Kind::analytic_light:
      copy(scene.analytic_lights, item.index);
      break;
  }
  ++made.index;
  return made;
}

namespace {

template <class Value>
void move_within(std::vector<Value>& all, std::size_t from, std::size_t to) {
  const auto at = [&](std::size_t index) { return all.begin() + static_cast<std::ptrdiff_t>(index); };
  if (from < to)
    std::rotate(at(from), at(from + 1), at(to + 1));
  else
    std::rotate(at(to), at(from), at(from + 1));
}

void move_volume(SceneOptions& scene, std::size_t from, std::size_t to) {
  if (scene.volume.empty()) return move_within(scene.others, from - 1, to - 1);
  const auto bounces = scene.medium.max_bounces;  // the first volume's value applies to all
  SceneVolume& first = scene;
  scene.others.insert(scene.others.begin(), std::move(first));
  move_within(scene.others, from, to);
  first = std::move(scene.others.front());
  scene.others.erase(scene.others.begin());
  for (SceneVolume& other : scene.others) other.medium.max_bounces = 0;
  scene.medium.max_bounces = bounces;
}

}  // namespace

std::optional<Item> move_item(SceneOptions& scene, const Item& from, const Item& to) {
  if (from == to || from.kind != to.kind) return std::nullopt;
  switch (from.kind) {
    case Item::Kind::volume:
      if (from.index == to.index)
        move_within(volume_at(scene, from.index).transforms, from.transform_index, to.transform_index);
      else
        move_volume(scene, from.index, to.index);
      break;
    case Item::Kind::model:
      move_within(scene.models, from.index, to.index);
      break;
    case Item::Kind::analytic_light:
      move_within(scene.analytic_lights, from.index, to.index);
      break;
  }
  return Item{from.kind, to.index, from.index == to.index ? to.transform_index : from.transform_index};
}

void forget(std::optional<Item>& chosen, Item::Kind kind, std::size_t index) {
  if (!chosen || chosen->kind != kind || chosen->index < index) return;
  if (chosen->index == index)
    chosen.reset();
  else
    --chosen->index;
}

std::optional<dmat4> transform_of(const SceneOptions& scene, const Item& item) {
  if (!has(scene, item)) return std::nullopt;
  switch (item.kind) {
    case Item::Kind::volume: {
      const auto& transforms = volume_at(scene, item.index).transforms;
      return transforms.empty() ? dmat4(1.0) : matrix_of(transforms[item.transform_index]);
    }
    case Item::Kind::model:
      return matrix_of(scene.models[item.index].to_world);
    case Item::Kind::analytic_light:
      break;
  }
  return transform_of(scene.analytic_lights[item.index]);
}

void set_transform(SceneOptions& scene, const Item& item, const dmat4& transform) {
  switch (item.kind) {
    case Item::Kind::volume: {
      auto& transforms = volume_at(scene, item.index).transforms;
      if (transforms.empty()) transforms.emplace_back();
      transforms[item.transform_index] = numbers_of(transform);
      break;
    }
    case Item::Kind::model:
      scene.models[item.index].to_world = numbers_of(transform);
      break;
    case Item::Kind::analytic_light:
      set_transform(scene.analytic_lights[item.index], transform);
      break;
  }
}

void restore_transform(SceneOptions& scene, const Item& item, const SceneOptions& from) {
  switch (item.kind) {
    case Item::Kind::volume:
      volume_at(scene, item.index).transforms = volume_at(from, item.index).transforms;
      break;
    case Item::Kind::model:
      scene.models[item.index].to_world = from.models[item.index].to_world;
      break;
    case Item::Kind::analytic_light:
      scene.analytic_lights[item.index] = from.analytic_lights[item.index];
      break;
  }
}

std::optional<Box> box_of(const SceneOptions& scene, const Boxes& boxes, const Item& item) {
  const auto found = [](const auto& all, const auto& file) -> std::optional<Box> {
    const auto known = std::ranges::find_if(all, [&](const auto& one) { return one.first == file; });
    if (known == all.end()) return std::nullopt;
    return known->second;
  };
  switch (item.kind) {
    case Item::Kind::volume:
      return found(boxes.volumes, static_cast<const VolumeFile&>(volume_at(scene, item.index)));
    case Item::Kind::model:
      return found(boxes.models, scene.models[item.index].file);
    case Item::Kind::analytic_light:
      break;
  }
  const cumulet_light_desc& analytic_light = scene.analytic_lights[item.index];
  const bool is_disc = analytic_light.kind == CUMULET_LIGHT_DISK;
  if (!is_disc && analytic_light.kind != CUMULET_LIGHT_RECT) return std::nullopt;
  const dvec3 half = 0.5 * dvec3(analytic_light.width, is_disc ? analytic_light.width : analytic_light.height, 0.0);
  return Box{-half, half};
}

dvec3 pivot_of(const dmat4& transform, const std::optional<Box>& box) {
  const dvec3 middle = box ? 0.5 * (box->least + box->most) : dvec3(0.0);
  const dvec4 at = transform * dvec4(middle, 1.0);
  return {at.x, at.y, at.z};
}

}  // namespace cumulet::demo
