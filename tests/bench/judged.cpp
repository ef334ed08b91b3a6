#include "judged.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <glm/glm.hpp>
#include <glm/gtc/noise.hpp>
#include <optional>
#include <presets.hpp>
#include <stdexcept>

namespace cumulet::bench {

namespace {

using glm::vec3;
using test::make_desc;

struct View {
  glm::dvec3 eye;
  glm::dvec3 target;
  double fovy_degrees;
};

/// Settings of a scene except its files.
struct Looks {
  cumulet_medium_desc medium = make_desc<cumulet_medium_desc>();
  cumulet_sun_sky_desc light = make_desc<cumulet_sun_sky_desc>();
  cumulet_display_desc display = make_desc<cumulet_display_desc>();
  std::optional<View> view;  ///< none: it fits
  std::vector<cumulet_light_desc> analytic_lights;
  float indirect_roughness = 0.0F;
};

void set(float (&rgb)[3], float r, float g, float b) { std::copy_n(std::array{r, g, b}.begin(), 3, rgb); }

// As in cumulet-scene's sample.json.
Looks cumulus_looks() {
  Looks looks;
  looks.medium.density_scale = 0.7;
  looks.medium.max_bounces = 16;
  looks.light.sun_azimuth_degrees = -68.0F;
  looks.light.sun_elevation_degrees = 24.0F;
  set(looks.light.sun_irradiance, 4.6F, 3.75F, 2.9F);
  set(looks.light.sky_radiance, 0.10F, 0.18F, 0.34F);
  looks.display.exposure_stops = 0.5F;
  return looks;
}

// As in its sample_explosion.json.
Looks explosion_looks() {
  Looks looks;
  looks.medium.density_scale = 9.0;
  demo::apply(demo::Preset::explosion, looks.medium);
  looks.light.sky = CUMULET_SKY_PHYSICAL;
  looks.light.ground_albedo = 0.2F;
  looks.light.sun_azimuth_degrees = 62.0F;
  looks.light.sun_elevation_degrees = 13.0F;
  looks.display.exposure_stops = 0.3F;
  looks.view = View{{4.0, 2.2, 22.0}, {0.3, 4.6, 0.0}, 33.0};
  looks.display.tone_map = CUMULET_TONE_MAP_FILMIC;
  return looks;
}

// At night: the fire is the only light.
Looks fire_looks() {
  Looks looks;
  looks.medium.density_scale = 3.0;
  demo::apply(demo::Preset::fire, looks.medium);
  set(looks.light.sky_radiance, 0.02F, 0.025F, 0.04F);
  looks.display.exposure_stops = -1.5F;
  looks.display.tone_map = CUMULET_TONE_MAP_FILMIC;
  looks.view = View{{2.5, 2.5, 11.0}, {0.2, 1.6, 0.0}, 33.0};
  return looks;
}

Looks model_looks() {
  Looks looks = cumulus_looks();
  looks.view = View{{-2.0, 4.0, 72.0}, {-24.0, 14.0, 10.0}, 40.0};
  looks.indirect_roughness = 0.4F;
  return looks;
}

Looks terrain_looks() {
  Looks looks;
  looks.light.sky = CUMULET_SKY_PHYSICAL;
  looks.light.ground_albedo = 0.2F;
  looks.light.sun_azimuth_degrees = -68.0F;
  looks.light.sun_elevation_degrees = 24.0F;
  looks.view = View{{-26.0, 30.0, 178.0}, {2.0, 6.0, 0.0}, 37.0};
  looks.indirect_roughness = 0.4F;
  return looks;
}

Looks fog_looks() {
  Looks looks;
  looks.medium.density_scale = 0.8;
  looks.medium.anisotropy = 0.3F;
  looks.view = View{{0.0, 0.0, 3.9}, {0.0, 0.0, 0.0}, 39.0};
  return looks;
}

Looks analytic_light_looks() {
  Looks looks;
  looks.medium.density_scale = 6.0;
  demo::apply(demo::Preset::smoke, looks.medium);
  set(looks.light.sky_radiance, 0.02F, 0.03F, 0.05F);
  auto analytic_light = make_desc<cumulet_light_desc>();
  analytic_light.kind = CUMULET_LIGHT_POINT;
  analytic_light.position[0] = 0.25;
  analytic_light.position[1] = 0.2;
  analytic_light.position[2] = 0.35;
  analytic_light.power = 40.0F;
  set(analytic_light.color, 1.0F, 0.75F, 0.45F);
  looks.analytic_lights = {analytic_light};
  return looks;
}

struct Recipe {
  const char* name;
  Looks (*looks)();
};
constexpr std::array recipes{Recipe{"cloud", cumulus_looks}, Recipe{"full", cumulus_looks},
                             Recipe{"fire", fire_looks},     Recipe{"explosion", explosion_looks},
                             Recipe{"model", model_looks},   Recipe{"terrain", terrain_looks},
                             Recipe{"fog", fog_looks},       Recipe{"lamp", analytic_light_looks}};

/// A volume of a cube from -1 to 1.
template <class Density>
test::VolumeRef make_cube(int side, Density&& density) {
  std::vector<float> values;
  const float step = 2.0F / static_cast<float>(side);
  for (int z = 0; z < side; ++z) {
    for (int y = 0; y < side; ++y) {
      for (int x = 0; x < side; ++x) values.push_back(density((vec3(x, y, z) + 0.5F) * step - 1.0F));
    }
  }
  auto desc = make_desc<cumulet_dense_desc>();
  desc.values = values.data();
  desc.value_count = values.size();
  for (int axis = 0; axis < 3; ++axis) {
    desc.size[axis] = side;
    desc.index_to_world[5 * axis] = step;
    desc.index_to_world[12 + axis] = 0.5 * step - 1.0;
  }
  desc.index_to_world[15] = 1.0;
  cumulet_volume* out = nullptr;
  std::array<char, 256> error{};
  if (cumulet_volume_from_dense(&desc, &out, error.data(), error.size()) != CUMULET_OK)
    throw std::runtime_error(error.data());
  return test::VolumeRef(out);
}

/// A column of smoke with frayed edges.
float smoke(const vec3& p) {
  float noise = 0.0F;
  float weight = 0.5F;
  float frequency = 1.9F;
  for (int octave = 0; octave < 4; ++octave, weight *= 0.6F, frequency *= 2.1F)
    noise += weight * glm::simplex(p * frequency + 3.1F * static_cast<float>(octave));
  const float radius = glm::length(vec3(p.x, 0.6F * p.y, p.z));
  return std::clamp(2.0F * (0.55F - radius + 0.45F * noise), 0.0F, 1.0F);
}

/// Quadrilaterals of one color.
struct Quads {
  vec3 color{0.73F};
  float radiance = 0.0F;
  std::vector<float> positions = {};

  void add(const vec3& a, const vec3& b, const vec3& c, const vec3& d) {
    for (const vec3& p : {a, b, c, a, c, d}) positions.insert(positions.end(), {p.x, p.y, p.z});
  }
  /// A rotated box on the floor.
  void add_box(const vec3& foot, const vec3& half, float degrees) {
    const float s = std::sin(glm::radians(degrees));
    const float c = std::cos(glm::radians(degrees));
    const auto corner = [&](float x, float y, float z) {
      const vec3 p = half * vec3(x, y + 1.0F, z);
      return foot + vec3(c * p.x + s * p.z, p.y, c * p.z - s * p.x);
    };
    add(corner(-1, 1, 1), corner(1, 1, 1), corner(1, 1, -1), corner(-1, 1, -1));
    add(corner(-1, -1, 1), corner(1, -1, 1), corner(1, 1, 1), corner(-1, 1, 1));
    add(corner(1, -1, -1), corner(-1, -1, -1), corner(-1, 1, -1), corner(1, 1, -1));
    add(corner(1, -1, 1), corner(1, -1, -1), corner(1, 1, -1), corner(1, 1, 1));
    add(corner(-1, -1, -1), corner(-1, -1, 1), corner(-1, 1, 1), corner(-1, 1, -1));
  }
};

/// The Cornell box from -1 to 1, open to +Z, with its two boxes and a light in the ceiling.
test::SurfacesRef cornell_box() {
  Quads white;
  white.add({-1, -1, 1}, {1, -1, 1}, {1, -1, -1}, {-1, -1, -1});
  white.add({-1, 1, -1}, {1, 1, -1}, {1, 1, 1}, {-1, 1, 1});
  white.add({-1, -1, -1}, {1, -1, -1}, {1, 1, -1}, {-1, 1, -1});
  white.add_box({-0.35F, -1.0F, -0.3F}, {0.3F, 0.6F, 0.3F}, 17.0F);
  white.add_box({0.35F, -1.0F, 0.3F}, {0.3F, 0.3F, 0.3F}, -18.0F);
  Quads red{.color = {0.63F, 0.065F, 0.05F}};
  red.add({-1, -1, 1}, {-1, -1, -1}, {-1, 1, -1}, {-1, 1, 1});
  Quads green{.color = {0.14F, 0.45F, 0.091F}};
  green.add({1, -1, -1}, {1, -1, 1}, {1, 1, 1}, {1, 1, -1});
  Quads analytic_light{.color = vec3(0.01F), .radiance = 12.0F};
  analytic_light.add({-0.25F, 0.998F, -0.25F}, {0.25F, 0.998F, -0.25F}, {0.25F, 0.998F, 0.25F},
                     {-0.25F, 0.998F, 0.25F});
  std::vector<cumulet_mesh_desc> meshes;
  for (const Quads* quads : {&white, &red, &green, &analytic_light}) {
    auto mesh = make_desc<cumulet_mesh_desc>();
    mesh.positions = quads->positions.data();
    mesh.vertex_count = quads->positions.size() / 3;
    for (int c = 0; c < 3; ++c) mesh.base_color[c] = quads->color[c];
    mesh.base_color[3] = 1.0F;
    set(mesh.emission, quads->radiance, 0.85F * quads->radiance, 0.6F * quads->radiance);
    meshes.push_back(mesh);
  }
  return test::make_surfaces(meshes);
}

const Recipe& recipe_of(const std::string& name) {
  const auto* found = std::ranges::find_if(recipes, [&](const Recipe& recipe) { return name == recipe.name; });
  if (found == recipes.end()) throw std::runtime_error(name + ": there is no such scene");
  return *found;
}

bool is_model(const std::filesystem::path& file) { return file.extension() == ".gltf" || file.extension() == ".glb"; }

}  // namespace

const std::vector<std::string>& judged_names() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> all;
    for (const Recipe& recipe : recipes) all.emplace_back(recipe.name);
    return all;
  }();
  return names;
}

std::vector<JudgedScene> judged_scenes(const Options& options, std::vector<std::string>& skipped) {
  const std::filesystem::path& usual = options.usual_dir;
  const std::filesystem::path cumulus = usual / "cumulus.vdb";
  const std::filesystem::path mountains = usual / "mountains.glb";
  std::vector<JudgedScene> all{{"cloud", cumulus, {}},
                               {"full", options.sample_dir / "cumulus.vdb", {}},
                               {"fire", usual / "explosion_0004.vdb", {}},
                               {"explosion", usual / "explosion_0012.vdb", {}},
                               {"model", cumulus, mountains},
                               {"terrain", {}, mountains},
                               {"fog", {}, {}},
                               {"lamp", {}, {}}};
  std::vector<JudgedScene> scenes;
  for (JudgedScene& scene : all) {
    if (!options.scenes.empty() && std::ranges::find(options.scenes, scene.name) == options.scenes.end()) continue;
    for (const Input& input : options.inputs) {
      if (input.name == scene.name) (is_model(input.file) ? scene.surfaces : scene.volume) = input.file;
    }
    const auto missing = [&](const std::filesystem::path& file) {
      if (file.empty() || std::filesystem::exists(file)) return false;
      skipped.push_back(scene.name + ", there is no " + file.string());
      return true;
    };
    if (!missing(scene.volume) && !missing(scene.surfaces)) scenes.push_back(std::move(scene));
  }
  return scenes;
}

Stage::Stage(headless::Context& context, const JudgedScene& scene, std::uint32_t size, cumulet_shader_cache* programs)
    : size_(size),
      gl_(test::load_gl(headless::Context::get_proc, &context)),
      target_(gl_, static_cast<int>(size), static_cast<int>(size)),
      viewer_(test::make_viewer({.get_proc = headless::Context::get_proc,
                                 .user = &context,
                                 .programs = programs,
                                 .interpolation = CUMULET_INTERPOLATION_NEAREST})) {  // as in older results
  const Looks looks = recipe_of(scene.name).looks();
  light_ = looks.light;
  display_ = looks.display;
  must(cumulet_set_medium(viewer(), &looks.medium));
  must(cumulet_set_sun_sky(viewer(), &light_));
  must(cumulet_set_display(viewer(), &display_));
  must(cumulet_set_lights(viewer(), looks.analytic_lights.data(), looks.analytic_lights.size()));
  auto surface = make_desc<cumulet_surface_settings_desc>();
  surface.indirect_roughness = looks.indirect_roughness;
  must(cumulet_set_surface_settings(viewer(), &surface));
  load(scene);
  must(cumulet_wait(viewer(), -1.0));
  cumulet_camera* camera = nullptr;
  must(cumulet_get_camera(viewer(), &camera));
  camera_.reset(camera);
  auto stand = make_desc<cumulet_camera_desc>();
  stand.eye[1] = 0.25;
  stand.eye[2] = 1.0;
  if (looks.view) {
    for (glm::length_t i = 0; i < 3; ++i) {
      stand.eye[i] = looks.view->eye[i];
      stand.target[i] = looks.view->target[i];
    }
    stand.fovy_degrees = looks.view->fovy_degrees;
  }
  must(cumulet_camera_set(camera, &stand));
  if (!looks.view) {
    // Fitting depends on the aspect ratio, which is set by a frame.
    sample(1, 0);
    converge_undrawn();
    must(cumulet_frame_all(viewer()));
  }
}

void Stage::load(const JudgedScene& scene) {
  if (!scene.surfaces.empty()) {
    must(cumulet_load_surfaces(viewer(), scene.surfaces.c_str()));
  } else if (scene.name == "fog") {
    const test::SurfacesRef box = cornell_box();
    must(cumulet_set_surfaces(viewer(), box.get()));
  }
  if (!scene.volume.empty()) {
    auto file = make_desc<cumulet_volume_file_desc>();
    file.path = scene.volume.c_str();
    must(cumulet_load_volume_file(viewer(), &file));
  } else if (scene.name == "fog") {
    // Inside the walls: fog on the walls would only cost cells.
    const test::VolumeRef fog = make_cube(32, [](const vec3& p) { return 0.6F - 0.4F * p.y; });
    must(cumulet_set_volume(viewer(), fog.get()));
  } else if (scene.name == "lamp") {
    const test::VolumeRef column = make_cube(96, smoke);
    must(cumulet_set_volume(viewer(), column.get()));
  }
}

void Stage::sample(std::uint32_t samples, std::uint32_t seed, cumulet_preview preview) {
  auto desc = make_desc<cumulet_sampling_desc>();
  desc.samples = samples;
  desc.seed = seed;
  desc.preview = preview;
  must(cumulet_set_sampling(viewer(), &desc));
}

void Stage::sample_to(double noise_target, bool adaptive, std::uint32_t seed) {
  auto desc = make_desc<cumulet_sampling_desc>();
  desc.samples = 1U << 20U;
  desc.seed = seed;
  desc.preview = CUMULET_PREVIEW_OFF;
  desc.noise_target_percent = static_cast<float>(100.0 * noise_target);
  desc.adaptive = adaptive ? 1 : 0;
  must(cumulet_set_sampling(viewer(), &desc));
}

void Stage::filter(cumulet_denoise denoise) {
  display_.denoise = denoise;
  must(cumulet_set_display(viewer(), &display_));
}

void Stage::orbit(double degrees) { must(cumulet_camera_orbit(camera_.get(), glm::radians(degrees), 0.0)); }

bool Stage::turn_sun(float degrees) {
  const bool dark = light_.sky != CUMULET_SKY_PHYSICAL &&
                    !(light_.sun_irradiance[0] + light_.sun_irradiance[1] + light_.sun_irradiance[2] > 0.0F);
  if (dark) return false;
  light_.sun_azimuth_degrees += degrees;
  must(cumulet_set_sun_sky(viewer(), &light_));
  return true;
}

double Stage::frame(double budget_ms, bool& more) {
  cumulet_frame_desc desc = target_.frame();
  desc.budget_ms = budget_ms;
  desc.blend = CUMULET_BLEND_REPLACE;
  auto result = make_desc<cumulet_frame_result>();
  const auto start = std::chrono::steady_clock::now();
  must(cumulet_render(viewer(), &desc, &result));
  gl_.Finish();
  more = (result.flags & (CUMULET_RENDER_INCOMPLETE | CUMULET_RENDER_LOADING)) != 0;
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

void Stage::converge() {
  must(cumulet_wait(viewer(), -1.0));
  for (bool more = true; more;) frame(200.0, more);
}

double Stage::converge_undrawn() {
  must(cumulet_wait(viewer(), -1.0));
  cumulet_frame_desc desc = target_.frame();
  desc.target = CUMULET_TARGET_NONE;
  desc.budget_ms = 500.0;
  auto result = make_desc<cumulet_frame_result>();
  do {
    must(cumulet_render(viewer(), &desc, &result));
    if ((result.flags & CUMULET_RENDER_LOADING) != 0) must(cumulet_wait(viewer(), -1.0));
  } while ((result.flags & CUMULET_RENDER_CONVERGED) == 0);
  auto stats = make_desc<cumulet_stats>();
  must(cumulet_get_stats(viewer(), &stats));
  return stats.trace_seconds;
}

std::vector<float> Stage::linear() {
  std::vector<float> rgba(floats());
  must(cumulet_read_linear(viewer(), rgba.data(), rgba.size()));
  return rgba;
}

std::vector<float> Stage::errors() {
  std::vector<float> errors(std::size_t{size_} * size_);
  must(cumulet_read_aov(viewer(), CUMULET_AOV_ERROR, errors.data(), errors.size()));
  return errors;
}

std::uint64_t Stage::samples_taken() {
  auto stats = make_desc<cumulet_stats>();
  must(cumulet_get_stats(viewer(), &stats));
  return stats.samples;
}

std::vector<std::uint8_t> Stage::drawn() const {
  const std::vector<std::uint8_t> upwards = target_.pixels();
  std::vector<std::uint8_t> rgba(upwards.size());
  const std::size_t row = std::size_t{4} * size_;
  for (std::size_t y = 0; y < size_; ++y) std::copy_n(&upwards[y * row], row, &rgba[(size_ - 1 - y) * row]);
  return rgba;
}

std::array<std::vector<float>, 2> Stage::reference(std::uint32_t samples) {
  std::array<std::vector<float>, 2> halves;
  for (std::uint32_t half = 0; half < 2; ++half) {
    sample(std::max(1U, samples / 2), 70001 + half);  // seeds that no evaluated image uses
    converge_undrawn();
    halves.at(half) = linear();
  }
  return halves;
}

std::vector<float> mean_of(const std::array<std::vector<float>, 2>& halves) {
  std::vector<float> mean(halves[0].size());
  for (std::size_t i = 0; i < mean.size(); ++i) mean[i] = 0.5F * (halves[0][i] + halves[1][i]);
  return mean;
}

std::vector<std::uint8_t> Stage::displayed(const std::vector<float>& linear) {
  std::vector<std::uint8_t> bytes(linear.size());
  must(cumulet_encode_display(viewer(), linear.data(), bytes.data(), bytes.size()));
  return bytes;
}

void Stage::must(cumulet_status status) const {
  if (status != CUMULET_OK) throw std::runtime_error(cumulet_last_error(viewer_.get()));
}

}  // namespace cumulet::bench
