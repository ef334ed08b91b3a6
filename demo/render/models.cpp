#include "models.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>

#include "library_call.hpp"

namespace cumulet::demo {
namespace {

/// Throws if the surfaces do not have the requested animation or material variant.
cumulet_model_desc desc_of(const SceneModel& scene, cumulet_surfaces* surfaces, std::uint64_t tag) {
  cumulet_surfaces_info info{};
  info.struct_size = sizeof info;
  check_call(cumulet_surfaces_get_info(surfaces, &info));
  const std::string refusal = animation_refusal(scene.file, scene.animation, info.animations);
  if (!refusal.empty()) throw std::runtime_error(refusal);
  cumulet_model_desc desc{};
  desc.struct_size = sizeof desc;
  desc.surfaces = surfaces;
  std::ranges::copy(scene.to_world, desc.to_world);
  set_shutter(scene.shutter, desc.to_world, desc.open_to_world, desc.close_to_world);
  desc.time = scene.time;
  desc.animation = scene.animation;
  desc.variant = variant_number(scene.file, scene.variant, variant_names(surfaces));
  desc.double_sided = scene.double_sided ? 1 : 0;
  desc.hidden = scene.visible ? 0 : 1;
  desc.group = scene.group;
  desc.shadow_only = scene.shadow_only ? 1 : 0;
  desc.holdout = scene.holdout ? 1 : 0;
  desc.tag = tag;
  return desc;
}

}  // namespace

SurfacesPtr open_surfaces(const std::string& file, cumulet_log_fn log, void* log_user) {
  cumulet_surfaces* opened = nullptr;
  check_call(cumulet_surfaces_open(file.c_str(), &opened, nullptr, 0));
  SurfacesPtr surfaces(opened, cumulet_surfaces_release);
  cumulet_surfaces_info info{};
  info.struct_size = sizeof info;
  check_call(cumulet_surfaces_get_info(opened, &info));
  std::istringstream lines(info.warnings);
  for (std::string line; std::getline(lines, line);) log(log_user, CUMULET_LOG_WARNING, line.c_str());
  return surfaces;
}

const Models::Given* Models::find(const std::string& file) const {
  const auto found = std::ranges::find(given_, file, &Given::file);
  return found == given_.end() ? nullptr : &*found;
}

std::vector<std::string> Models::missing(const std::vector<SceneModel>& models) const {
  std::vector<std::string> files;
  for (const SceneModel& model : models) {
    if (model.visible && find(model.file) == nullptr && std::ranges::find(files, model.file) == files.end())
      files.push_back(model.file);
  }
  return files;
}

cumulet_surfaces* Models::surfaces(const std::string& file) const {
  const Given* given = find(file);
  return given == nullptr ? nullptr : given->surfaces.get();
}

void Models::give(const std::string& file, SurfacesPtr surfaces) { given_.push_back({file, std::move(surfaces)}); }

void Models::show(cumulet_viewer* viewer, const std::vector<SceneModel>& models) {
  std::erase_if(given_, [&](const Given& given) {
    return std::ranges::none_of(models, [&](const SceneModel& model) { return model.file == given.file; });
  });
  std::string refusal;
  std::size_t count = 0;
  for (std::size_t i = 0; i < models.size(); ++i) {
    const SceneModel& scene = models[i];
    const Given* given = find(scene.file);
    if (given == nullptr || !given->surfaces) continue;
    if (count < shown_.size() && shown_[count].scene == scene && shown_[count].surfaces == given->surfaces) {
      ++count;
      continue;
    }
    // A refused model does not prevent the others from being shown.
    try {
      const cumulet_model_desc desc = desc_of(scene, given->surfaces.get(), i + 1);
      if (count == shown_.size()) {
        cumulet_model* made = nullptr;
        check_call(cumulet_model_create(&desc, &made, nullptr, 0), nullptr, scene.file);
        std::shared_ptr<cumulet_model> model(made, cumulet_model_release);
        check_call(cumulet_add_model(viewer, made), viewer);
        shown_.push_back({std::move(model), {}, nullptr});
      } else {
        check_call(cumulet_model_set(shown_[count].model.get(), &desc), nullptr, scene.file);
      }
    } catch (const std::runtime_error& error) {
      refusal = error.what();
      continue;
    }
    shown_[count].scene = scene;
    shown_[count].surfaces = given->surfaces;
    ++count;
  }
  while (shown_.size() > count) {
    check_call(cumulet_remove_model(viewer, shown_.back().model.get()), viewer);
    shown_.pop_back();
  }
  if (!refusal.empty()) throw std::runtime_error(refusal);
}

}  // namespace cumulet::demo
