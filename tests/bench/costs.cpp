#include "costs.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <functional>
#include <memory>
#include <numbers>

#include "asset.hpp"
#include "edited_shaders.hpp"
#include "light/environment_file.hpp"
#include "measure.hpp"
#include "settings/settings.hpp"
#include "statistics.hpp"
#include "subject.hpp"
#include "support/surfaces.hpp"
#include "turns.hpp"
#include "volume/frame_import.hpp"

namespace cumulet::bench {

namespace {

using glm::dvec3;
using glm::vec3;

/// A row of a table: a scene with its own viewer, so that rows can take turns without rebuilding.
struct Row {
  std::string name;
  std::unique_ptr<test::Still> still;
  std::vector<Run> runs = {};
};

/// Renders all rows in turn. Returns the cost of each.
std::vector<Cost> take_turns(std::vector<Row>& rows, const Options& options) {
  for (Row& row : rows) {
    trace(*row.still, {options.size, options.size, 1, 999});  // compiles, builds, uploads
    progress("  " + row.name);
  }
  for (int repeat = 0; repeat < options.repeats; ++repeat) {
    for (Row& row : rows) {
      const auto seed = static_cast<std::uint32_t>(repeat);
      row.runs.push_back(trace(*row.still, {options.size, options.size, options.fewest_samples, seed}));
    }
  }
  const std::vector<std::size_t> pixels = pixels_of(rows.front().runs);
  std::vector<Cost> costs;
  for (const Row& row : rows) costs.push_back(cost_of(row.runs, pixels, options.fewest_samples));
  return costs;
}

void print_costs(const char* title, std::vector<Row>& rows, const Options& options) {
  const std::vector<Cost> costs = take_turns(rows, options);
  std::printf(
      "\n| %s | Cells | Steps per path | A step, x | A sample, x | Noise of a sample, %% | Time to the same "
      "noise, x |\n|---|--:|--:|--:|--:|--:|--:|\n",
      title);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const double sample = ratio_of(costs[i].sample, costs[0].sample).median;
    std::printf("| %s | %.0fk | %.0f | %.2f | %.2f | %.0f | %.2f |\n", rows[i].name.c_str(),
                1e-3 * static_cast<double>(rows[i].still->viewer().stats().cells), costs[i].steps,
                ratio_of(costs[i].step, costs[0].step).median, sample, 100.0 * std::sqrt(costs[i].variance),
                sample * costs[i].variance / costs[0].variance);
  }
  std::fflush(stdout);
}

enum class Burns { no, temperature, flame, both };

/// The demo's preset "explosion", which is designed for an extinction of 9 per unit.
viewer::Medium medium_of(double density_scale, Burns burns) {
  viewer::Medium medium;
  medium.density_scale = density_scale;
  medium.albedo = {0.32F, 0.3F, 0.28F};
  medium.max_bounces = 12;
  medium.field_emission.flame_strength = burns == Burns::flame || burns == Burns::both ? density_scale : 0.0;
  medium.field_emission.flame_color = {1.0F, 0.3F, 0.05F};
  medium.field_emission.blackbody =
      burns == Burns::temperature || burns == Burns::both ? 4.0 / 3.0 * density_scale : 0.0;
  return medium;
}

class Rows {
 public:
  Rows(headless::Context& context, double density_scale) : context_(context), density_scale_(density_scale) {}

  test::Still& add(std::string name, const viewer::VolumeAssetPtr& volume, Burns burns, const viewer::Light& light,
                   std::shared_ptr<viewer::Sharing> programs = nullptr) {
    Row& row = rows_.emplace_back(Row{
        std::move(name), std::make_unique<test::Still>(context_, headless::Context::get_proc, std::move(programs))});
    row.still->viewer().camera()->frame(volume->bounds(), 1.0);
    row.still->set_volume(volume);
    row.still->set_medium(medium_of(density_scale_, burns));
    row.still->set_light(light);
    set_grid(*row.still, scene::March::tet, settings::default_threshold(CUMULET_CRITERION_TRANSMITTANCE));
    return *row.still;
  }
  static void set_grid(test::Still& still, scene::March march, double threshold) {
    viewer::GridSettings grid;
    grid.build.march = march;
    grid.build.refine.criterion = grid::Criterion::transmittance;
    grid.build.refine.threshold = threshold;
    still.set_grid(grid);
  }
  [[nodiscard]] std::vector<Row>& get() { return rows_; }

 private:
  headless::Context& context_;
  double density_scale_;
  std::vector<Row> rows_;
};

viewer::Light light_of(float sun, float sky, float angle = 0.0F) {
  viewer::Light light = bench_light();
  light.sun_irradiance *= sun;
  light.sky_radiance *= sky;
  light.sun_angle_degrees = angle;
  return light;
}

viewer::Light clear_day() {
  viewer::Light light = light_of(0.0F, 0.0F, settings::default_sun_angle(CUMULET_SKY_PHYSICAL));
  light.sky = light::SkyModel{};
  return light;
}

viewer::VolumeAssetPtr read(const Input& input, const std::string& color) {
  return std::make_shared<const viewer::VolumeAsset>(
      volume::import_frame(input.file, {.density = input.grid, .color = color}, Log()));
}

/// Position of the lights: above and to the side, directed at the center.
struct Position {
  dvec3 at;
  dvec3 direction;
  double distance;
};
Position beside(const viewer::Bounds& bounds) {
  const double size = glm::length(bounds.max - bounds.min);
  const dvec3 direction = glm::normalize(dvec3(-1.0, -1.5, -0.7));
  return {0.5 * (bounds.min + bounds.max) - direction * size, direction, size};
}

scene::ModelSourcePtr emitter_at(const Position& position, double side, float radiance) {
  const auto scene = std::make_shared<test::StillScene>();
  surface::Material material = test::diffuse(vec3(0.0F));
  material.emission = vec3(radiance);
  const dvec3 across = glm::normalize(glm::cross(dvec3(0.0, 1.0, 0.0), position.direction)) * (0.5 * side);
  const dvec3 along = glm::normalize(glm::cross(position.direction, across)) * (0.5 * side);
  const auto corner = [&](double u, double v) { return vec3(position.at + u * across + v * along); };
  scene->add_quad({corner(-1, -1), corner(1, -1), corner(1, 1), corner(-1, 1)}, scene->add(material));
  return test::source_of(scene);
}

// Disables the emission that scattered rays accumulate along their path, and adds it only at collisions (emission
// divided by extinction).
constexpr Edit no_way = {"path/free_flight.glsl", "      emitted += cm_emitted(emission, p.t, min(t_1, t_end));\n", ""};
constexpr Edit where_they_collide = {"path/free_flight.glsl",
                                     "    emitted += cm_emitted(emission, p.t, p.t + min(way, left));\n",
                                     "    float there = max(0.0f, emission.at_0 + emission.slope * (p.t + way));\n"
                                     "    if (way < left) emitted += emission.mean * (there / max(cm_segment_at(e, way "
                                     "/ max(span, 1e-30f)), 1e-30f));\n"};
// Disables NEE of emissive cells: if there is no other light, or among other lights.
constexpr Edit no_looks_alone = {"path/path.glsl", "arrived && cm.lights.any != 0u;",
                                 "arrived && cm.lights.any != 0u && cm.lights.cell_probability < 1.0f;"};
constexpr Edit no_looks = {"light/light.glsl", "LIGHT(CM_LIGHT_CELL, cm.lights.cell_probability,",
                           "LIGHT(CM_LIGHT_CELL, min(0.0f, cm.lights.cell_probability),"};
constexpr Edit flights_have_all = {"path/free_flight.glsl", "cm.lights.cell_probability * cm_nee_probability(",
                                   "0.0f * cm_nee_probability("};
// Disables Russian roulette of shadow rays.
constexpr Edit all_looks = {"light/light.glsl", "  if (p.start != CM_IN_MEDIUM) return 1.0f;\n",
                            "  if (p.steps >= 0u) return 1.0f;\n"};

// Samples all lights with equal probability.
constexpr Edit any_analytic_light = {
    "light/light.glsl", "  if (pick.y > cm_analytic_light(i).stays) i = cm_analytic_light(i).other;\n", ""};
constexpr Edit all_alike = {"light/light.glsl", "  light.pdf = analytic_light.probability;\n",
                            "  light.pdf = 1.0f / float(max(cm.analytic_lights.count, 1u));\n"};

/// Lights as on a film set: a key light at the side, one with a tenth of its power opposite, and fourteen like the key
/// light far away.
light::AnalyticLights sixteen_analytic_lights(const viewer::Bounds& bounds, const Position& position, float power) {
  light::AnalyticLights analytic_lights;
  const auto add = [&](const dvec3& at, float share) {
    light::AnalyticLight analytic_light;
    analytic_light.position = at;
    analytic_light.power = vec3(share * power);
    analytic_lights.push_back(analytic_light);
  };
  const dvec3 middle = 0.5 * (bounds.min + bounds.max);
  add(position.at, 1.0F);
  add(2.0 * middle - position.at, 0.1F);
  for (int i = 0; i < 14; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / 14.0;
    add(middle + 10.0 * position.distance * dvec3(std::cos(angle), 0.3, std::sin(angle)), 1.0F);
  }
  return analytic_lights;
}

/// A hot core in a ball of smoke, for which NEE of cells is designed.
viewer::VolumeAssetPtr small_fire() {
  constexpr int side = 48;
  const auto field = [](const std::function<float(float)>& value) {
    volume::ScalarVolume v;
    v.index_to_world = glm::dmat4(1.0);
    v.bounds_min = glm::ivec3(0);
    v.bounds_max = glm::ivec3(side - 1);
    for (int x = 0; x < side; x += 8) {
      for (int y = 0; y < side; y += 8) {
        for (int z = 0; z < side; z += 8) {
          v.brick_origins.emplace_back(x, y, z);
          for (int i = 0; i < volume::brick_voxels; ++i) {
            const glm::ivec3 p = glm::ivec3(x, y, z) + glm::ivec3(i / 64, (i / 8) % 8, i % 8);
            const float here = value(glm::distance(vec3(p), vec3(0.5F * (side - 1))));
            v.brick_values.as_floats().push_back(here);
            v.active_voxels += here > 0.0F ? 1 : 0;
            v.max_value = std::max(v.max_value, here);
          }
        }
      }
    }
    return v;
  };
  volume::VolumeFrame frame{.density = field([](float r) { return r < 23.0F ? 1.0F : 0.0F; })};
  frame.flame = field([](float r) { return r < 3.0F ? 1.0F : 0.0F; });
  return std::make_shared<const viewer::VolumeAsset>(std::move(frame));
}

}  // namespace

void measure_costs(headless::Context& context, const Input& input, const Options& options) {
  const Asset asset = load_asset(input, true);
  const double density_scale = asset.density_scale(options.optical_depth);
  const bool made = input.file.empty();  // "@noise": has only density
  const viewer::VolumeAssetPtr plain = made ? asset.volume : read(input, "none");
  const viewer::Light daylight = light_of(1.0F, 1.0F);
  {
    Rows rows(context, density_scale);
    rows.add("density", plain, Burns::no, daylight);
    if (plain->may_emit()) {
      rows.add("+ temperature", plain, Burns::temperature, daylight);
      rows.add("+ flame", plain, Burns::flame, daylight);
      rows.add("+ temperature and flame", plain, Burns::both, daylight);
    }
    if (!options.color_grid.empty() && !made) {
      const viewer::VolumeAssetPtr colored = read(input, options.color_grid);
      rows.add("+ colour", colored, Burns::no, daylight);
      rows.add("+ all", colored, Burns::both, daylight);
    }
    print_costs("Channels", rows.get(), options);
  }
  {
    const Position position = beside(plain->bounds());
    const double side = 0.5 * position.distance;
    const auto power = static_cast<float>(10.0 * position.distance * position.distance);
    light::AnalyticLight analytic_light;
    analytic_light.position = position.at;
    analytic_light.direction = position.direction;
    analytic_light.across = glm::normalize(glm::cross(dvec3(0.0, 1.0, 0.0), position.direction));
    analytic_light.power = vec3(power);
    analytic_light.width = analytic_light.height = side;
    analytic_light.angle = std::numbers::pi / 4.0;
    const viewer::Light dark = light_of(0.0F, 0.0F);
    Rows rows(context, density_scale);
    const auto lit = [&](const char* name, light::AnalyticLight::Kind kind, const dvec3& at) {
      analytic_light.kind = kind;
      analytic_light.position = at;
      rows.add(name, plain, Burns::no, dark).viewer().set_lights({analytic_light});
    };
    rows.add("constant sky", plain, Burns::no, light_of(0.0F, 1.0F));
    rows.add("sun", plain, Burns::no, light_of(1.0F, 0.0F));
    rows.add("sun of 5 degrees", plain, Burns::no, light_of(1.0F, 0.0F, 5.0F));
    rows.add("sun and sky", plain, Burns::no, daylight);
    rows.add("physical sky", plain, Burns::no, clear_day());
    if (!options.environment.empty()) {
      const std::string name = options.environment.string();
      rows.add("environment", plain, Burns::no, dark)
          .viewer()
          .set_environment(light::make_environment(light::read_environment(name), name));
    }
    lit("point beside it", light::AnalyticLight::Kind::point, position.at);
    lit("spot", light::AnalyticLight::Kind::spot, position.at);
    lit("disc", light::AnalyticLight::Kind::disc, position.at);
    lit("rectangle", light::AnalyticLight::Kind::rectangle, position.at);
    lit("point in it", light::AnalyticLight::Kind::point, position.at + position.direction * position.distance);
    rows.add("two triangles like the rectangle", plain, Burns::no, dark)
        .viewer()
        .show_surfaces(emitter_at(position, side, power / static_cast<float>(4.0 * side * side)));
    if (plain->may_emit()) rows.add("its own fire", plain, Burns::both, dark);
    print_costs("Light", rows.get(), options);

    const EditedShaders all(std::array{all_looks});
    Rows looks(context, density_scale);
    looks.add("all made", plain, Burns::no, daylight, all.programs());
    looks.add("those with information", plain, Burns::no, daylight);
    print_costs("Looks for sun and sky", looks.get(), options);

    const EditedShaders alike(std::array{any_analytic_light, all_alike});
    const light::AnalyticLights sixteen = sixteen_analytic_lights(plain->bounds(), position, power);
    Rows many(context, density_scale);
    many.add("by what arrives", plain, Burns::no, dark).viewer().set_lights(sixteen);
    many.add("each alike", plain, Burns::no, dark, alike.programs()).viewer().set_lights(sixteen);
    print_costs("Sixteen lamps", many.get(), options);
  }
  const EditedShaders without_looks(std::array{no_looks_alone, no_looks, flights_have_all});
  const EditedShaders at_collisions(std::array{no_way, where_they_collide});
  const EditedShaders neither(std::array{no_looks_alone, no_looks, flights_have_all, no_way, where_they_collide});
  const viewer::VolumeAssetPtr small = small_fire();
  const viewer::Light dark = light_of(0.0F, 0.0F);
  for (const auto& [title, scale] :
       {std::pair("A small fire in thick smoke", 0.1), {"A small fire in thin smoke", 0.01}}) {
    Rows rows(context, scale);
    rows.add("along flights, and looks", small, Burns::flame, dark);
    rows.add("along flights, no looks", small, Burns::flame, dark, without_looks.programs());
    rows.add("where flights collide, and looks", small, Burns::flame, dark, at_collisions.programs());
    rows.add("where flights collide, no looks", small, Burns::flame, dark, neither.programs());
    Rows::set_grid(rows.add("along flights through bricks", small, Burns::flame, dark), scene::March::brick, 0);
    print_costs(title, rows.get(), options);
  }
}

void measure_equal_error(headless::Context& context, const Input& input, const Options& options) {
  const Asset asset = load_asset(input, true);
  const double density_scale = asset.density_scale(options.optical_depth);
  Rows rows(context, density_scale);
  const auto add = [&](const std::string& name, scene::March march, double threshold) {
    Rows::set_grid(rows.add(name, asset.volume, Burns::both, clear_day()), march, threshold);
  };
  add("dense", scene::March::dense, 0.0);
  add("brick", scene::March::brick, 0.0);
  for (const double threshold : options.thresholds) {
    std::array<char, 32> name{};
    std::snprintf(name.data(), name.size(), "tet %g", threshold);
    add(name.data(), scene::March::tet, threshold);
  }
  if (options.thresholds.empty())
    add("tet", scene::March::tet, settings::default_threshold(CUMULET_CRITERION_TRANSMITTANCE));
  const std::vector<Cost> costs = take_turns(rows.get(), options);
  std::printf("\n%s: %u x %u pixels, %d x %u samples, density scale %.3g\n\n", asset.name.c_str(), options.size,
              options.size, options.repeats, options.fewest_samples, density_scale);
  std::printf(
      "| Grid type | Cells | Steps per path | A step, ns | Samples/s, x dense | x brick | Noise of a sample, %% | "
      "Grid's error, %% |");
  for (const double target : options.targets)
    std::printf(" To %g %%: time, x dense | x brick | steps, x dense |", 100.0 * target);
  std::printf("\n|---|--:|--:|--:|--:|--:|--:|--:|");
  for (std::size_t i = 0; i < options.targets.size(); ++i) std::printf("--:|--:|--:|");
  std::printf("\n");
  const Cost& dense = costs[0];
  const Cost& brick = costs[1];
  const double mean = 0.5 * (mean_of(dense.halves[0]) + mean_of(dense.halves[1]));
  for (std::size_t i = 0; i < costs.size(); ++i) {
    const Cost& cost = costs[i];
    // Products of two independent halves, so that noise does not bias their mean.
    std::vector<double> products;
    std::vector<double> squares;
    for (std::size_t k = 0; k < dense.halves[0].size(); ++k) {
      products.push_back((cost.halves[0][k] - dense.halves[0][k]) * (cost.halves[1][k] - dense.halves[1][k]) /
                         (mean * mean));
      squares.push_back(products.back() * products.back());
    }
    const bool voxels = i < 2;
    const double square = voxels ? 0.0 : mean_of(products);
    const double deviation = std::sqrt(mean_of(squares) / static_cast<double>(squares.size()));
    const double x_dense = ratio_of(dense.sample, cost.sample).median;
    const double x_brick = ratio_of(brick.sample, cost.sample).median;
    std::printf("| %s | %.0fk | %.1f | %.1f | %.2f | %.2f | %.0f |", rows.get()[i].name.c_str(),
                1e-3 * static_cast<double>(rows.get()[i].still->viewer().stats().cells), cost.steps,
                1e9 * spread_of(cost.step).median, x_dense, x_brick, 100.0 * std::sqrt(cost.variance));
    if (voxels) {
      std::printf(" reference |");
    } else if (square > deviation) {
      std::printf(" %.1f +- %.1f |", 100.0 * std::sqrt(square), 50.0 * deviation / std::sqrt(square));
    } else {
      std::printf(" below %.1f |", 100.0 * std::sqrt(std::max(square, 0.0) + 2.0 * deviation));
    }
    for (const double target : options.targets) {
      // The number of samples for which variance and squared grid error add up to the squared target.
      const double left = target * target - std::max(square, 0.0);
      if (!(left > 0.0)) {
        std::printf(" never | never | never |");
        continue;
      }
      const auto gain = [&](const Cost& other, double each) {
        return each * other.variance / cost.variance * left / (target * target);
      };
      std::printf(" %.2f | %.2f | %.2f |", gain(dense, x_dense), gain(brick, x_brick),
                  gain(dense, dense.steps / cost.steps));
    }
    std::printf("\n");
  }
}

}  // namespace cumulet::bench
