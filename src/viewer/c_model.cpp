// Models of the C ABI. cumulet.h documents the calls.

#include <memory>
#include <utility>

#include "scene/model_table.hpp"
#include "viewer/c_handles.hpp"
#include "viewer/c_support.hpp"

namespace {

using namespace cumulet::c_abi;
using cumulet::viewer::ModelInstance;
using cumulet::viewer::ModelSettings;

void require_time(double time) { require(std::isfinite(time), "cumulet_model_desc.time is not finite"); }

// what: prefix of the message.
glm::dmat4 transform_of(std::span<const double, 16> to_world, const std::string& what = "") {
  const glm::dmat4 transform = matrix_or_identity(to_world);
  require_transform(transform, what);
  if (!cumulet::scene::can_stand(transform)) refuse(what + "to_world is singular or too large");
  return transform;
}

ModelSettings settings_of(const cumulet_model_desc* desc) {
  const cumulet_model_desc d = read_desc(desc, "cumulet_model_desc");
  const auto flag = [](int32_t value, const char* cause) { require(value == 0 || value == 1, cause); };
  flag(d.double_sided, "cumulet_model_desc.double_sided is not 0 or 1");
  flag(d.hidden, "cumulet_model_desc.hidden is not 0 or 1");
  flag(d.shadow_only, "cumulet_model_desc.shadow_only is not 0 or 1");
  require_time(d.time);
  ModelSettings settings;
  if (d.surfaces != nullptr) settings.surfaces = d.surfaces->asset;
  settings.to_world = transform_of(d.to_world, "cumulet_model_desc.");
  settings.ends = shutter_transforms_of(d.open_to_world, d.close_to_world, settings.to_world, "cumulet_model_desc.");
  if (settings.ends &&
      !(cumulet::scene::can_stand(settings.ends->open) && cumulet::scene::can_stand(settings.ends->close)))
    refuse("cumulet_model_desc.open_to_world or close_to_world is singular or too large");
  settings.choice = {d.time, d.animation, d.double_sided == 1, d.variant};
  settings.hidden = d.hidden == 1;
  settings.shadow_only = d.shadow_only == 1;
  flag(d.holdout, "cumulet_model_desc.holdout is not 0 or 1");
  settings.holdout = d.holdout == 1;
  settings.tag = d.tag;
  require(d.group < CUMULET_LIGHT_GROUPS, "cumulet_model_desc.group is not below CUMULET_LIGHT_GROUPS");
  settings.group = d.group;
  return settings;
}

}  // namespace

cumulet_status cumulet_model_create(const cumulet_model_desc* desc, cumulet_model** out, char* error,
                                    size_t error_size) {
  return make_handle(out, error, error_size, [&] { return std::make_shared<ModelInstance>(settings_of(desc)); });
}

cumulet_model* cumulet_model_retain(cumulet_model* model) { return retain(model); }

void cumulet_model_release(cumulet_model* model) { release(model); }

cumulet_status cumulet_model_set(cumulet_model* model, const cumulet_model_desc* desc) {
  return on(model, "model", [&](ModelInstance& m) {
    ModelSettings settings = settings_of(desc);
    m.edit([&](ModelSettings& old) { std::swap(old, settings); });  // the old contents are destroyed after the lock is
                                                                    // released
  });
}

cumulet_status cumulet_model_set_to_world(cumulet_model* model, const double to_world[16]) {
  return on(model, "model", [&](ModelInstance& m) {
    require(to_world != nullptr, "to_world is NULL");
    const glm::dmat4 transform = transform_of(std::span<const double, 16>(to_world, 16));
    m.edit([&](ModelSettings& settings) {
      settings.to_world = transform;
      settings.ends.reset();
    });
  });
}

cumulet_status cumulet_model_set_time(cumulet_model* model, double time) {
  return on(model, "model", [&](ModelInstance& m) {
    require_time(time);
    m.edit([&](ModelSettings& settings) { settings.choice.time = time; });
  });
}

cumulet_status cumulet_model_set_previous(cumulet_model* model, const double* to_world, const double* time) {
  return on(model, "model", [&](ModelInstance& m) {
    std::optional<glm::dmat4> transform;
    std::optional<double> moment;
    if (to_world != nullptr) transform = transform_of(std::span<const double, 16>(to_world, 16));
    if (time != nullptr) {
      require(std::isfinite(*time), "time is not finite");
      moment = *time;
    }
    m.edit([&](ModelSettings& settings) {
      settings.previous = transform;
      settings.previous_time = moment;
    });
  });
}
