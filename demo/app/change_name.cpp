#include <algorithm>
#include <filesystem>
#include <functional>
#include <settings.hpp>
#include <string>
#include <type_traits>
#include <vector>

#include "history.hpp"

// The names of undo steps.
namespace cumulet::demo {
namespace {

template <class Value>
bool differ(const Value& a, const Value& b) {
  if constexpr (std::is_array_v<Value>)
    return !std::ranges::equal(a, b);
  else
    return a != b;
}

/// Returns the label of the setting that differs, or the group's name if there are several; "" if there is none.
template <class Desc>
std::string setting_name(const Desc& before, const Desc& after, const char* group) {
  std::vector<std::string> names;
  settings::for_each<Desc>([&](const auto& setting) {
    if (!differ(before.*setting.field, after.*setting.field)) return;
    names.emplace_back(*setting.row.label != '\0' ? setting.row.label : group);
  });
  if (names.empty()) return "";
  return names.size() == 1 ? names.front() : group;
}

std::string file_name(const std::string& path) { return std::filesystem::path(path).filename().string(); }

/// Returns the name of a change of a file; "" if it is the same.
std::string opened(const std::string& before, const std::string& after, const char* kind) {
  if (before == after) return "";
  return after.empty() ? std::string("Remove ") + kind : "Open " + file_name(after);
}

/// Returns the name of a change of a number of objects; "" if it is the same.
std::string counted(std::size_t before, std::size_t after, const char* kind) {
  if (before == after) return "";
  return (after > before ? "Add " : "Remove ") + std::string(kind);
}

/// Returns true if both lists have the same objects in another order.
template <class Value, class Same>
bool reordered(const std::vector<Value>& before, const std::vector<Value>& after, Same same) {
  return !std::ranges::equal(before, after, same) && std::ranges::is_permutation(before, after, same);
}

bool reordered(const SceneOptions& before, const SceneOptions& after) {
  const auto volumes = [](const SceneOptions& scene) {
    std::vector<const SceneVolume*> all = {&scene};
    for (const SceneVolume& other : scene.others) all.push_back(&other);
    return all;
  };
  const auto same = [](const SceneVolume* a, const SceneVolume* b) {
    return static_cast<const VolumeFile&>(*a) == *b && a->name == b->name && a->visible == b->visible &&
           a->transforms == b->transforms;
  };
  return reordered(volumes(before), volumes(after), same) || reordered(before.models, after.models, std::equal_to()) ||
         reordered(before.analytic_lights, after.analytic_lights, settings::same<cumulet_light_desc>);
}

std::string moved(const SceneOptions& before, const SceneOptions& after) {
  const auto volume = [](const SceneVolume& a, const SceneVolume& b) -> std::string {
    if (a.transforms != b.transforms) return "Move " + b.label();
    if (a.visible != b.visible) return (b.visible ? "Show " : "Hide ") + b.label();
    return a.name != b.name ? "Rename " + b.label() : "";
  };
  if (std::string name = volume(before, after); !name.empty()) return name;
  for (std::size_t i = 0; i < std::min(before.others.size(), after.others.size()); ++i)
    if (std::string name = volume(before.others[i], after.others[i]); !name.empty()) return name;
  for (std::size_t i = 0; i < std::min(before.models.size(), after.models.size()); ++i)
    if (before.models[i] != after.models[i]) return after.models[i].label();
  for (std::size_t i = 0; i < std::min(before.analytic_lights.size(), after.analytic_lights.size()); ++i)
    if (!settings::same(before.analytic_lights[i], after.analytic_lights[i]))
      return setting_name(before.analytic_lights[i], after.analytic_lights[i], "Light");
  return "";
}

}  // namespace

std::string change_name(const SceneOptions& before, const SceneOptions& after) {
  const std::vector<std::string> names = {
      reordered(before, after) ? "Order" : "",
      opened(before.volume, after.volume, "volume"),
      opened(before.surfaces, after.surfaces, "model"),
      opened(before.environment, after.environment, "environment"),
      counted(before.others.size(), after.others.size(), "volume"),
      counted(before.models.size(), after.models.size(), "model"),
      counted(before.analytic_lights.size(), after.analytic_lights.size(), "light"),
      counted(before.cameras.size(), after.cameras.size(), "camera"),
      before.grid_name != after.grid_name ? "Grid name" : "",
      before.up != after.up ? "Up axis" : "",
      moved(before, after),
      setting_name(before.medium, after.medium, "Material"),
      before.ramps != after.ramps ? "Ramp" : "",
      before.color_ramps != after.color_ramps ? "Color ramp" : "",
      before.clip != after.clip ? "Clip" : "",
      setting_name(before.light, after.light, "Sun & sky"),
      setting_name(before.environment_settings, after.environment_settings, "Environment"),
      setting_name(before.ground, after.ground, "Ground"),
      setting_name(before.surface, after.surface, "Model"),
      setting_name(before.sequence.playback, after.sequence.playback, "Sequence"),
      before.sequence.first != after.sequence.first ? "First played" : "",
      before.sequence.last != after.sequence.last ? "Last played" : "",
      before.ocio != after.ocio ? "OpenColorIO view" : "",
      setting_name(before.display, after.display, "Image"),
      setting_name(before.sampling, after.sampling, "Sampling"),
      setting_name(before.grid, after.grid, "Grid"),
      settings::same(before.camera, after.camera) ? "" : "Camera"};
  const auto found = std::ranges::find_if(names, [](const std::string& name) { return !name.empty(); });
  return found != names.end() ? *found : "Change";
}

}  // namespace cumulet::demo
