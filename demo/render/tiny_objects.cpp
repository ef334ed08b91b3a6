#include "tiny_objects.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <filesystem>
#include <limits>
#include <matrix.hpp>
#include <memory>
#include <utility>

namespace cumulet::demo {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr Matrix identity = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};

double size_of(const PlacedBox& box) {
  return std::hypot(box.most[0] - box.least[0], box.most[1] - box.least[1], box.most[2] - box.least[2]);
}

PlacedBox empty_box(std::string name) {
  return {std::move(name), {infinity, infinity, infinity}, {-infinity, -infinity, -infinity}};
}

void add(PlacedBox& box, const std::array<double, 3>& point) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    box.least[axis] = std::min(box.least[axis], point[axis]);
    box.most[axis] = std::max(box.most[axis], point[axis]);
  }
}

/// Adds a box that is transformed. All 0: the identity.
void add(PlacedBox& box, const double (&least)[3], const double (&most)[3], const Matrix& transform) {
  const Matrix& m = transform == Matrix{} ? identity : transform;
  for (unsigned corner = 0; corner < 8; ++corner) {
    std::array<double, 3> moved{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      moved[axis] = m[12 + axis];
      for (std::size_t i = 0; i < 3; ++i)
        moved[axis] += m[4 * i + axis] * (((corner >> i) & 1U) != 0 ? most[i] : least[i]);
    }
    add(box, moved);
  }
}

void add_volume(std::vector<PlacedBox>& boxes, const SceneVolume& scene, const cumulet_volume* volume) {
  cumulet_volume_info info{};
  info.struct_size = sizeof info;
  if (volume == nullptr || cumulet_volume_get_info(volume, &info) != CUMULET_OK || info.active_voxels == 0) return;
  PlacedBox box = empty_box(scene.label());
  if (scene.transforms.empty()) add(box, info.bounds_min, info.bounds_max, identity);
  for (const Matrix& transform : scene.transforms) add(box, info.bounds_min, info.bounds_max, transform);
  boxes.push_back(std::move(box));
}

void add_surfaces(std::vector<PlacedBox>& boxes, const std::string& name, const Matrix& to_world,
                  const cumulet_surfaces* surfaces) {
  cumulet_surfaces_info info{};
  info.struct_size = sizeof info;
  if (surfaces == nullptr || cumulet_surfaces_get_info(surfaces, &info) != CUMULET_OK || info.triangles == 0) return;
  PlacedBox box = empty_box(name);
  add(box, info.bounds_min, info.bounds_max, to_world);
  boxes.push_back(std::move(box));
}

}  // namespace

std::vector<PlacedBox> placed_boxes(cumulet_viewer* viewer, const SceneOptions& scene, const Instances& others,
                                    const Models& models) {
  std::vector<PlacedBox> boxes;
  cumulet_volume* volume = nullptr;
  if (scene.is_shown() && cumulet_get_volume(viewer, &volume) == CUMULET_OK) {
    const std::shared_ptr<cumulet_volume> own(volume, cumulet_volume_release);
    add_volume(boxes, scene, volume);
  }
  for (const SceneVolume& other : scene.others)
    if (other.is_shown()) add_volume(boxes, other, others.volume(other));
  cumulet_surfaces* surfaces = nullptr;
  if (!scene.surfaces.empty() && cumulet_get_surfaces(viewer, &surfaces) == CUMULET_OK) {
    const SurfacesPtr own(surfaces, cumulet_surfaces_release);
    add_surfaces(boxes, std::filesystem::path(scene.surfaces).filename().string(), {}, surfaces);
  }
  for (const SceneModel& model : scene.models)
    if (model.visible) add_surfaces(boxes, model.label(), model.to_world, models.surfaces(model.file));
  return boxes;
}

std::vector<std::string> remarks_on_tiny(std::span<const PlacedBox> objects) {
  constexpr double hardly_visible = 100.0;
  PlacedBox all = empty_box("");
  for (const PlacedBox& object : objects) {
    add(all, object.least);
    add(all, object.most);
  }
  std::vector<std::string> remarks;
  for (const PlacedBox& object : objects) {
    const double times = size_of(all) / size_of(object);
    if (!(times > hardly_visible)) continue;
    std::array<char, 96> text{};
    std::snprintf(text.data(), text.size(),
                  " is %.0f times smaller than the scene: a view of the whole hardly shows it", times);
    remarks.push_back(object.name + text.data());
  }
  return remarks;
}

}  // namespace cumulet::demo
