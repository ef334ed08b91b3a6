// Instances of the C ABI. cumulet.h documents the calls.

#include <array>
#include <memory>

#include "viewer/c_clip.hpp"
#include "viewer/c_handles.hpp"
#include "viewer/c_ramp.hpp"
#include "viewer/c_settings.hpp"
#include "viewer/c_support.hpp"

namespace {

using namespace cumulet::c_abi;
using cumulet::viewer::Instance;
using cumulet::viewer::InstanceSettings;
using cumulet::viewer::Medium;

// Everything except the ramps, the color ramps and the clip.
InstanceSettings settings_of(const cumulet_instance_desc* desc) {
  const cumulet_instance_desc d = read_desc(desc, "cumulet_instance_desc");
  require(d.hidden == 0 || d.hidden == 1, "cumulet_instance_desc.hidden is not 0 or 1");
  InstanceSettings settings;
  require((d.volume != nullptr) + (d.sequence != nullptr) + (d.dynamic_volume != nullptr) <= 1,
          "cumulet_instance_desc has more than one of volume, sequence and dynamic_volume");
  if (d.volume != nullptr) settings.volume = d.volume->asset;
  if (d.sequence != nullptr) settings.sequence = d.sequence->asset;
  if (d.dynamic_volume != nullptr) settings.live = d.dynamic_volume->asset;
  settings.to_world = matrix_or_identity(d.to_world);
  require_transform(settings.to_world, "cumulet_instance_desc.");
  settings.ends = shutter_transforms_of(d.open_to_world, d.close_to_world, settings.to_world, "cumulet_instance_desc.");
  cumulet_medium_desc medium{};
  medium.struct_size = sizeof medium;
  settings.medium = Medium::of(read_settings(d.medium == nullptr ? &medium : d.medium));
  settings.hidden = d.hidden != 0;
  settings.tag = d.tag;
  return settings;
}

}  // namespace

cumulet_status cumulet_instance_create(const cumulet_instance_desc* desc, cumulet_instance** out, char* error,
                                       size_t error_size) {
  return make_handle(out, error, error_size, [&] { return std::make_shared<Instance>(settings_of(desc)); });
}

cumulet_instance* cumulet_instance_retain(cumulet_instance* instance) { return retain(instance); }

void cumulet_instance_release(cumulet_instance* instance) { release(instance); }

cumulet_status cumulet_instance_set(cumulet_instance* instance, const cumulet_instance_desc* desc) {
  return on(instance, "instance", [&](Instance& i) {
    InstanceSettings settings = settings_of(desc);
    i.edit([&](InstanceSettings& old) {
      settings.ramps = std::move(old.ramps);
      settings.clip = std::move(old.clip);
      std::swap(old, settings);  // the old contents are destroyed after the lock is released
    });
  });
}

cumulet_status cumulet_instance_set_to_world(cumulet_instance* instance, const double to_world[16]) {
  return on(instance, "instance", [&](Instance& i) {
    require(to_world != nullptr, "to_world is NULL");
    const glm::dmat4 transform = matrix_or_identity(std::span<const double, 16>(to_world, 16));
    require_transform(transform);
    i.edit([&](InstanceSettings& settings) {
      settings.to_world = transform;
      settings.ends.reset();
    });
  });
}

cumulet_status cumulet_instance_set_ramp(cumulet_instance* instance, cumulet_ramp ramp, const float* points,
                                         uint64_t count) {
  return on(instance, "instance", [&](Instance& i) {
    auto read = read_ramp(ramp, points, count);
    i.edit([&](InstanceSettings& settings) { std::swap(settings.ramps.*read.target, read.ramp); });
  });
}

cumulet_status cumulet_instance_set_color_ramp(cumulet_instance* instance, cumulet_ramp ramp, const float* stops,
                                               uint64_t count) {
  return on(instance, "instance", [&](Instance& i) {
    auto read = read_color_ramp(ramp, stops, count);
    i.edit([&](InstanceSettings& settings) { std::swap(settings.ramps.*read.target, read.ramp); });
  });
}

cumulet_status cumulet_instance_set_clip(cumulet_instance* instance, const cumulet_clip_desc* desc) {
  return on(instance, "instance", [&](Instance& i) {
    cumulet::scene::ClipPlanes planes = clip_planes_of(desc);
    i.edit([&](InstanceSettings& settings) { std::swap(settings.clip, planes); });
  });
}

cumulet_status cumulet_instance_set_previous(cumulet_instance* instance, const double* to_world) {
  return on(instance, "instance", [&](Instance& i) {
    std::optional<cumulet::scene::InstanceTransform> transform;
    if (to_world != nullptr) {
      transform.emplace(
          cumulet::scene::InstanceTransform{matrix_or_identity(std::span<const double, 16>(to_world, 16))});
      require_transform(transform->to_world);
    }
    i.edit([&](InstanceSettings& settings) { settings.previous = transform; });
  });
}
