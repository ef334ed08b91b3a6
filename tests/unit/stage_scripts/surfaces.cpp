// Scripts: surfaces, models, lights, environments and the ground.

#include <cmath>
#include <limits>
#include <utility>

#include "light/environment.hpp"
#include "stage_scripts/scripts.hpp"

namespace cumulet::test {

namespace {

using ModelPtr = std::shared_ptr<viewer::ModelInstance>;

viewer::SurfaceSettings settings_at(double time) {
  viewer::SurfaceSettings settings;
  settings.choice.time = time;
  return settings;
}

// Changes the settings of the viewer's own surfaces.
void set(StageRecorder& r, const std::string& name, const viewer::SurfaceSettings& settings) {
  r.call(name, [&] { r.viewer().set_surface_settings(settings); });
}

void set_and_show(StageRecorder& r, const std::string& name, const viewer::SurfaceSettings& settings) {
  set(r, name, settings);
  r.wait();
  r.frame();
}

void set_surfaces(StageRecorder& r, const viewer::SurfaceAssetPtr& surfaces) {
  r.call(surfaces ? "set the surfaces" : "remove the surfaces", [&] { r.viewer().set_surfaces(surfaces); });
}

void load(StageRecorder& r, const std::string& name) {
  r.call("load " + name, [&] { r.viewer().load_surfaces(r.path(name)); });
}

void set_shutter(StageRecorder& r, double seconds) {
  r.call("shutter of " + text_of(seconds) + " s", [&] {
    viewer::Sampling sampling;
    sampling.shutter_seconds = seconds;
    r.viewer().set_sampling(sampling);
  });
}

viewer::SurfaceAssetPtr moving_surfaces() { return surfaces_of(std::make_shared<const MovingScene>()); }

// ---- surfaces ----

void surfaces_loaded(StageRecorder& r) {
  write_model(r.path("a.gltf"));
  load(r, "a.gltf");
  r.wait();
  r.status();
  r.frame();
  r.contents();
  set_and_show(r, "at 1 s", settings_at(1.0));
  set_and_show(r, "at 1 s again", settings_at(1.0));
  viewer::SurfaceSettings settings = settings_at(1.0);
  settings.choice.animation = 7;
  set_and_show(r, "an animation that does not exist", settings);
  r.call("use its camera", [&] { r.viewer().use_surface_camera(0); });
  r.frame();
  r.call("use a camera that does not exist", [&] { r.viewer().use_surface_camera(3); });
  r.frame();
}

void surfaces_load_fails(StageRecorder& r) {
  set_surfaces(r, moving_surfaces());
  r.wait();
  r.frame();
  load(r, "missing.gltf");
  r.wait();
  r.status();
  r.frame();
  write_text(r.path("broken.gltf"), "no scene");
  load(r, "broken.gltf");
  r.wait();
  r.frame();
  set_surfaces(r, moving_surfaces());
  r.wait();
  r.status();
  r.frame();
}

void surfaces_replaced_while_reading(StageRecorder& r) {
  write_model(r.path("slow.gltf"), true);
  write_model(r.path("b.gltf"));
  write_model(r.path("c.gltf"));
  r.hold(unknown_extension);
  load(r, "slow.gltf");
  r.held();
  load(r, "b.gltf");
  load(r, "c.gltf");
  r.frame();
  r.release();
  r.wait();
  r.frame();
}

void surfaces_configured_while_reading(StageRecorder& r) {
  write_model(r.path("slow.gltf"), true);
  r.hold(unknown_extension);
  load(r, "slow.gltf");
  r.held();
  set(r, "at 1 s", settings_at(1.0));
  set_shutter(r, 0.5);
  r.release();
  r.wait();
  r.frame();
}

void surfaces_cancelled_while_reading(StageRecorder& r) {
  write_model(r.path("slow.gltf"), true);
  r.hold(unknown_extension);
  load(r, "slow.gltf");
  r.held();
  r.call("cancel", [&] { r.viewer().cancel(); });
  r.release();
  r.wait();
  r.status();
  r.frame();
  r.hold(unknown_extension);
  load(r, "slow.gltf");
  r.held();
  set_surfaces(r, moving_surfaces());
  r.release();
  r.wait();
  r.status();
  r.frame();
}

// A pose that was begun is finished, and then the newest is made.
void surfaces_posed_again_while_posing(StageRecorder& r) {
  r.hold("pose at 0.");
  set_surfaces(r, surfaces_of(std::make_shared<const GatedScene>(r.gate())));
  r.held();
  set(r, "at 1 s", settings_at(1.0));
  set(r, "at 2 s", settings_at(2.0));
  r.frame();
  r.release();
  r.wait();
  r.frame();
}

void surfaces_removed_while_posing(StageRecorder& r) {
  r.hold("pose at 0.");
  set_surfaces(r, surfaces_of(std::make_shared<const GatedScene>(r.gate())));
  r.held();
  set_surfaces(r, nullptr);
  r.frame();
  r.release();
  r.wait();
  r.status();
  r.frame();
}

void surfaces_shown_at_once(StageRecorder& r) {
  r.call("show surfaces", [&] { r.viewer().show_surfaces(source_of(std::make_shared<const MovingScene>())); });
  r.frame();
  r.frame();
  set_surfaces(r, nullptr);
  r.frame();
}

// Without a volume, surfaces are in an empty one.
void surfaces_and_volumes(StageRecorder& r) {
  set_surfaces(r, moving_surfaces());
  r.wait();
  r.frame();
  r.call("set a volume", [&] { r.viewer().set_volume(cloud(16, 1)); });
  r.wait();
  r.frame();
  r.call("remove the volume", [&] { r.viewer().set_volume(nullptr); });
  r.wait();
  r.frame();
  const auto instance = std::make_shared<viewer::Instance>(viewer::InstanceSettings{.volume = cloud(16, 2, "a")});
  r.call("add an instance", [&] { r.viewer().add_instance(instance); });
  r.wait();
  r.frame();
  r.call("remove the instance", [&] { r.viewer().remove_instance(*instance); });
  r.wait();
  r.frame();
  set_surfaces(r, nullptr);
  r.wait();
  r.frame();
}

void settings_of_surfaces(StageRecorder& r) {
  const auto scene = std::make_shared<MovingScene>();
  scene->variants.push_back({"other", {0}});
  set_surfaces(r, surfaces_of<MovingScene>(scene));
  r.wait();
  r.frame();
  viewer::SurfaceSettings settings;
  settings.choice.double_sided = true;
  set_and_show(r, "double-sided", settings);
  settings.choice.variant = 1;
  set_and_show(r, "variant", settings);
  settings.choice.variant = 9;
  set_and_show(r, "a variant that does not exist", settings);
  settings.light = viewer::SurfaceLight::shadows;
  settings.indirect_roughness = 0.25F;
  set_and_show(r, "lighting", settings);
  settings.group = 2;
  set_and_show(r, "group", settings);
  settings.holdout = true;
  set_and_show(r, "holdout", settings);
}

void shutter_of_surfaces(StageRecorder& r) {
  set_surfaces(r, moving_surfaces());
  set(r, "at 2 s", settings_at(2.0));
  r.wait();
  r.frame();
  set_shutter(r, 0.5);
  r.wait();
  r.frame();
  set_and_show(r, "at 3 s", settings_at(3.0));
  set_shutter(r, 0.0);
  r.wait();
  r.frame();
}

void pose_fails(StageRecorder& r) {
  set_surfaces(r, moving_surfaces());
  r.wait();
  r.frame();
  set_and_show(r, "at -1 s", settings_at(-1.0));
  r.status();
  set_and_show(r, "at 1 s", settings_at(1.0));
  r.status();
}

// ---- models ----

ModelPtr model_of(viewer::SurfaceAssetPtr surfaces, double time = 0.0, const glm::dmat4& to_world = glm::dmat4(1.0)) {
  viewer::ModelSettings settings;
  settings.surfaces = std::move(surfaces);
  settings.choice.time = time;
  settings.to_world = to_world;
  return std::make_shared<viewer::ModelInstance>(settings);
}

void add(StageRecorder& r, const std::string& name, const ModelPtr& model) {
  r.call("add " + name, [&] { r.viewer().add_model(model); });
}

void remove(StageRecorder& r, const std::string& name, const ModelPtr& model) {
  r.call("remove " + name, [&] { r.viewer().remove_model(*model); });
}

void edit(StageRecorder& r, const std::string& name, const ModelPtr& model,
          const std::function<void(viewer::ModelSettings&)>& change) {
  r.call(name, [&] { model->edit(change); });
  r.wait();
  r.frame();
}

void models_added_and_removed(StageRecorder& r) {
  const viewer::SurfaceAssetPtr surfaces = moving_surfaces();
  const ModelPtr a = model_of(surfaces);
  const ModelPtr b = model_of(surfaces, 0.0, moved(5.0));
  const ModelPtr c = model_of(surfaces, 1.0, moved(10.0));
  const ModelPtr d = model_of(nullptr);
  add(r, "a", a);
  add(r, "b with the same pose", b);
  add(r, "c", c);
  add(r, "d without surfaces", d);
  r.wait();
  r.frame();
  r.contents();
  remove(r, "a", a);
  r.wait();
  r.frame();
  edit(r, "d shows other surfaces", d, [](auto& settings) { settings.surfaces = moving_surfaces(); });
  remove(r, "b", b);
  remove(r, "c", c);
  remove(r, "d", d);
  r.wait();
  r.frame();
}

void model_settings(StageRecorder& r) {
  const ModelPtr a = model_of(moving_surfaces(), 2.0);
  add(r, "a", a);
  r.wait();
  r.frame();
  edit(r, "nothing", a, [](auto& /*settings*/) {});
  edit(r, "moved", a, [](auto& settings) { settings.to_world = moved(1.0); });
  edit(r, "previous transform", a, [](auto& settings) { settings.previous = moved(0.5); });
  edit(r, "previous time", a, [](auto& settings) { settings.previous_time = 1.0; });
  edit(r, "next time", a, [](auto& settings) {
    settings.previous_time = settings.choice.time;
    settings.choice.time = 3.0;
  });
  edit(r, "shadow only", a, [](auto& settings) { settings.shadow_only = true; });
  edit(r, "group", a, [](auto& settings) { settings.group = 4; });
  edit(r, "holdout", a, [](auto& settings) { settings.holdout = true; });
  edit(r, "hidden", a, [](auto& settings) { settings.hidden = true; });
  edit(r, "visible", a, [](auto& settings) { settings.hidden = false; });
  edit(r, "motion", a, [](auto& settings) { settings.ends = scene::ShutterTransforms{moved(0.0), moved(2.0)}; });
  set_shutter(r, 0.5);
  r.wait();
  r.frame();
  edit(r, "other surfaces", a, [](auto& settings) { settings.surfaces = moving_surfaces(); });
  edit(r, "no surfaces", a, [](auto& settings) { settings.surfaces = nullptr; });
}

void model_changes_while_posing(StageRecorder& r) {
  const ModelPtr a = model_of(surfaces_of(std::make_shared<const GatedScene>(r.gate())));
  r.hold("pose at 0.");
  add(r, "a", a);
  r.held();
  for (const double time : {1.0, 2.0}) {
    r.call("at " + text_of(time) + " s", [&] { a->edit([&](auto& settings) { settings.choice.time = time; }); });
    r.frame();
  }
  r.release();
  r.wait();
  r.frame();
}

void model_fails(StageRecorder& r) {
  const ModelPtr a = model_of(moving_surfaces(), -1.0);
  const ModelPtr b = model_of(moving_surfaces());
  add(r, "a", a);
  add(r, "b", b);
  r.wait();
  r.status();
  r.frame();
  edit(r, "a at 1 s", a, [](auto& settings) { settings.choice.time = 1.0; });
  r.status();
  edit(r, "a at -1 s", a, [](auto& settings) { settings.choice.time = -1.0; });
  r.call("rebuild", [&] { r.viewer().rebuild(); });
  r.wait();
  remove(r, "a", a);
  r.wait();
  r.status();
  r.frame();
}

void models_beside_surfaces(StageRecorder& r) {
  set_surfaces(r, moving_surfaces());
  add(r, "a", model_of(moving_surfaces(), 0.0, moved(5.0)));
  r.wait();
  r.frame();
  r.call("set a volume", [&] { r.viewer().set_volume(cloud(16, 1)); });
  r.wait();
  r.frame();
  set_surfaces(r, nullptr);
  r.wait();
  r.frame();
}

// ---- lights ----

void sun_and_sky(StageRecorder& r) {
  viewer::Light light{30.0F, 60.0F, glm::vec3(3.0F), glm::vec3(0.25F)};
  r.call("set the light", [&] { r.viewer().set_light(light); });
  r.frame();
  r.call("set it again", [&] { r.viewer().set_light(light); });
  r.frame();
  light.sun_azimuth_degrees = 120.0F;
  light.sun_angle_degrees = 0.5F;
  r.call("turn the sun", [&] { r.viewer().set_light(light); });
  r.frame();
  light.sun_group = 1;
  light.sky_group = 2;
  r.call("groups", [&] { r.viewer().set_light(light); });
  r.frame();
}

void physical_sky(StageRecorder& r) {
  viewer::Light light{30.0F, 20.0F};
  light.sky = light::SkyModel{};
  const auto set = [&](const char* name) { r.call(name, [&] { r.viewer().set_light(light); }); };
  const auto show = [&] {
    r.wait();
    r.frame();
  };
  set("physical sky");
  show();
  light.sun_azimuth_degrees = 90.0F;
  set("other azimuth");
  show();
  light.sun_elevation_degrees = 25.0F;
  set("higher");
  light.sun_elevation_degrees = 30.0F;
  set("even higher");
  light.sky->turbidity = 5.0;
  set("hazy");
  show();
  r.call("ground", [&] { r.viewer().set_ground({viewer::GroundMode::at_height, -1.0}); });
  show();
  r.call("environment", [&] {
    r.viewer().set_environment(light::make_environment({4, 2, std::vector<glm::vec3>(8, glm::vec3(0.5F))}, "by hand"));
  });
  show();
  r.call("no environment", [&] { r.viewer().set_environment(nullptr); });
  show();
  light.sky.reset();
  set("constant sky");
  show();
}

void environment(StageRecorder& r) {
  write_radiance(r.path("a.hdr"), 16);
  const auto load_environment = [&](const std::string& name) {
    r.call("load " + name, [&] { r.viewer().load_environment(r.path(name)); });
    r.wait();
    r.status();
    r.frame();
  };
  load_environment("a.hdr");
  r.contents();
  r.call("turn it", [&] { r.viewer().set_environment_settings({45.0F, 2.0F}); });
  r.frame();
  load_environment("missing.hdr");
  r.call("set an environment with remarks", [&] {
    std::vector<glm::vec3> values(8, glm::vec3(0.5F));
    values[3].y = std::numeric_limits<float>::quiet_NaN();
    r.viewer().set_environment(light::make_environment({4, 2, values, {"one", "two"}}, "by hand"));
  });
  r.status();
  r.frame();
  r.call("remove it", [&] { r.viewer().set_environment(nullptr); });
  r.frame();
}

// The first load has its result, but its job has not ended.
void environment_replaced(StageRecorder& r) {
  write_radiance(r.path("a.hdr"), 16);
  write_radiance(r.path("b.hdr"), 32);
  const auto load_environment = [&](const std::string& name) {
    r.call("load " + name, [&] { r.viewer().load_environment(r.path(name)); });
  };
  r.hold("ended " + r.path("a.hdr") + ".");
  load_environment("a.hdr");
  r.held();
  load_environment("b.hdr");
  r.frame();
  r.release();
  r.wait();
  r.frame();
  r.hold("ended " + r.path("a.hdr") + ".");
  load_environment("a.hdr");
  r.held();
  r.call("remove it", [&] { r.viewer().set_environment(nullptr); });
  r.frame();
  r.release();
  r.wait();
  r.frame();
}

void analytic_lights(StageRecorder& r) {
  using Kind = light::AnalyticLight::Kind;
  light::AnalyticLights lights(2);
  lights[0].position = {1.0, 2.0, 3.0};
  lights[0].power = glm::vec3(10.0F);
  lights[1].kind = Kind::rectangle;
  lights[1].width = 2.0;
  lights[1].power = glm::vec3(5.0F);
  lights[1].group = 1;
  const auto set = [&](const char* name) { r.call(name, [&] { r.viewer().set_lights(lights); }); };
  set("two lights");
  r.frame();
  set("the same again");
  r.frame();
  lights[0].kind = Kind::spot;
  lights[0].angle = 0.5;
  set("a spot");
  r.frame();
  // Positions are relative to the origin of a scene that is far away.
  r.call("a volume", [&] { r.viewer().set_volume(cloud(16, 1)); });
  r.wait();
  r.frame();
  r.call("far away", [&] { r.viewer().set_transforms({{moved(1e7)}}); });
  r.frame();
  lights.clear();
  set("no lights");
  r.frame();
}

void ground(StageRecorder& r) {
  const auto set = [&](const char* name, const viewer::GroundSettings& settings) {
    r.call(name, [&] { r.viewer().set_ground(settings); });
    r.frame();
  };
  set("below nothing", {viewer::GroundMode::below});
  set("at a height", {viewer::GroundMode::at_height, 2.0});
  r.call("set a volume", [&] { r.viewer().set_volume(cloud(16, 1)); });
  r.wait();
  r.frame();
  set("below the volume", {viewer::GroundMode::below});
  set_surfaces(r, moving_surfaces());
  r.wait();
  r.frame();
  set("brighter", {viewer::GroundMode::below, 0.0, glm::vec3(0.75F)});
  set("none", {});
}

}  // namespace

std::vector<StageScript> surface_scripts() {
  return {{"surfaces_loaded", surfaces_loaded},
          {"surfaces_load_fails", surfaces_load_fails},
          {"surfaces_replaced_while_reading", surfaces_replaced_while_reading},
          {"surfaces_configured_while_reading", surfaces_configured_while_reading},
          {"surfaces_cancelled_while_reading", surfaces_cancelled_while_reading},
          {"surfaces_posed_again_while_posing", surfaces_posed_again_while_posing},
          {"surfaces_removed_while_posing", surfaces_removed_while_posing},
          {"surfaces_shown_at_once", surfaces_shown_at_once},
          {"surfaces_and_volumes", surfaces_and_volumes},
          {"settings_of_surfaces", settings_of_surfaces},
          {"shutter_of_surfaces", shutter_of_surfaces},
          {"pose_fails", pose_fails},
          {"models_added_and_removed", models_added_and_removed},
          {"model_settings", model_settings},
          {"model_changes_while_posing", model_changes_while_posing},
          {"model_fails", model_fails},
          {"models_beside_surfaces", models_beside_surfaces}};
}

std::vector<StageScript> light_scripts() {
  return {{"sun_and_sky", sun_and_sky},         {"physical_sky", physical_sky},
          {"environment", environment},         {"environment_replaced", environment_replaced},
          {"analytic_lights", analytic_lights}, {"ground", ground}};
}

}  // namespace cumulet::test
