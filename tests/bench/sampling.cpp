#include "sampling.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "base/luminance.hpp"
#include "edited_shaders.hpp"
#include "judged.hpp"
#include "judging.hpp"
#include "measure.hpp"
#include "statistics.hpp"
#include "viewer/c_handles.hpp"

namespace cumulet::bench {

namespace {

std::vector<double> luminances(const std::vector<float>& rgba) {
  std::vector<double> result(rgba.size() / 4);
  for (std::size_t i = 0; i < result.size(); ++i)
    result[i] = luminance(glm::dvec3(rgba[4 * i], rgba[4 * i + 1], rgba[4 * i + 2]));
  return result;
}

double mean_of(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double value : values) sum += value;
  return sum / static_cast<double>(std::max<std::size_t>(1, values.size()));
}

std::vector<JudgedScene> scenes_of(const Options& options) {
  std::vector<std::string> skipped;
  std::vector<JudgedScene> scenes = judged_scenes(options, skipped);
  for (const std::string& line : skipped) progress("skipped: " + line);
  return scenes;
}

/// Measurements of images of several seeds.
struct Taken {
  std::vector<double> seconds;
  std::vector<double> samples;  ///< per pixel
  std::vector<double> squared;  ///< mean squared difference to the reference, relative to the squared mean
  std::vector<double> means;
};

void add(Stage& stage, const std::array<std::vector<double>, 2>& halves, Taken& taken) {
  taken.seconds.push_back(stage.converge_undrawn());
  const std::vector<double> bright = luminances(stage.linear());
  taken.samples.push_back(static_cast<double>(stage.samples_taken()) / static_cast<double>(bright.size()));
  const double mean = 0.5 * (mean_of(halves[0]) + mean_of(halves[1]));
  const double error = root_error(bright, halves[0], halves[1]) / mean;
  taken.squared.push_back(error * error);
  taken.means.push_back(mean_of(bright) / mean);
}

/// An image's luminances and their squared errors.
struct Measured {
  std::vector<double> bright;
  std::vector<double> squared;
};

Measured measured(Stage& stage, std::uint32_t samples, std::uint32_t seed) {
  stage.sample(samples, seed);
  stage.converge_undrawn();
  Measured result{luminances(stage.linear()), {}};
  for (const float error : stage.errors()) result.squared.push_back(double(error) * error);
  return result;
}

/// The difference of the sums over a block of pixels, in standard errors.
double apart(const Measured& a, const Measured& b, std::uint32_t size, glm::uvec2 first, glm::uvec2 last) {
  double difference = 0.0;
  double squared = 0.0;
  for (std::uint32_t y = first.y; y < last.y; ++y) {
    for (std::uint32_t x = first.x; x < last.x; ++x) {
      const std::size_t i = std::size_t{y} * size + x;
      difference += a.bright[i] - b.bright[i];
      squared += a.squared[i] + b.squared[i];
    }
  }
  return squared > 0.0 ? difference / std::sqrt(squared) : 0.0;
}

constexpr std::uint32_t square_edge = 8;

/// The root mean square of those over all blocks; 1 if differences are only noise.
double apart_by_squares(const Measured& a, const Measured& b, std::uint32_t size) {
  double sum = 0.0;
  double count = 0.0;
  for (std::uint32_t y = 0; y < size; y += square_edge) {
    for (std::uint32_t x = 0; x < size; x += square_edge) {
      const glm::uvec2 last = glm::min(glm::uvec2(x, y) + square_edge, glm::uvec2(size));
      const double z = apart(a, b, size, {x, y}, last);
      sum += z * z;
      count += z != 0.0 ? 1.0 : 0.0;
    }
  }
  return std::sqrt(sum / std::max(1.0, count));
}

double noise_of(const Measured& picture) {
  return std::sqrt(mean_of(picture.squared)) / std::max(1e-30, mean_of(picture.bright));
}

struct Technique {
  const char* name;
  std::vector<Edit> off;
  std::vector<std::string> scenes = {};  ///< that have it; empty: all
};

std::vector<Technique> techniques() {
  return {
      {"even numbers (independent ones)",
       {{"common/random.glsl", "  uvec3 seed = cm_hash3(uvec3(pixel, set, 0x2545f491u));\n",
         "  uvec3 seed = cm_hash3(uvec3(number, set, pixel));\n"
         "  if (set != 0xfffffffeu) return vec2(cm_unit_float(seed.x), cm_unit_float(seed.y));\n"}}},
      {"looks left out (all are made)",
       {{"light/light.glsl", "  if (p.start != CM_IN_MEDIUM) return 1.0f;\n",
         "  if (p.start != 0xfffffffeu) return 1.0f;\n"}}},
      {"roulette of looks' transmittance",
       {{"path/path_vertex.glsl", "#define CM_SHADOW_DEPTH 2.0f", "#define CM_SHADOW_DEPTH 40.0f"}}},
      {"roulette of dark paths",
       {{"path/path.glsl", "strongest < 0.5f &&", "strongest < 0.01f &&"}},
       {"fire", "explosion", "model", "terrain", "fog", "lamp"}},
      {"what flights find of far light (looks alone)",
       {{"path/path.glsl", "if (p.bounces > 0u) p.radiance += p.throughput * cm_far_light(p, transmittance);",
         "if (p.bounces > 0xfffffff0u) p.radiance += p.throughput * cm_far_light(p, transmittance);"},
        {"path/path.glsl",
         "    p.radiance += p.light * (transmittance / (survival * (1.0f + transmittance * p.pdf)));\n#if",
         "    p.radiance += p.light * (transmittance / survival);\n#if"}},
       {"cloud", "full", "explosion"}},
      {"looks from points of flights (equi-angular)",
       {{"path/equiangular.glsl", "  return cm_balance(pdf * pdf, collided * collided);", "  return 0.0f * collided;"}},
       {"lamp"}},
      {"light of its own by depth (by collisions)",
       {{"path/path.glsl",
         "if (CM_SURFACES == 0 && CM_INSTANCES == 0) emissive =", "if (CM_SURFACES == 9) emissive ="}},
       {"fire", "explosion"}},
      {"looks for cells that glow",
       {{"light/light.glsl", "  return cm_luminance(mean) * CM_EMISSIVE.density * CM_EMISSIVE.extent * least * least;",
         "  return 0.0f * least;"},
        {"light/light.glsl", "  light.radiance = mean * (cm_emission_at(record, cell_class, point) *",
         "  light.radiance = 0.0f * mean * (cm_emission_at(record, cell_class, point) *"}},
       {"fire", "explosion"}},
  };
}

}  // namespace

void measure_adaptive(headless::Context& context, const Options& options) {
  std::printf(
      "| Scene | Target, %% | Samples | Error, %% | Seconds | Adaptive: samples | Error, %% | Seconds | Time to the "
      "same "
      "error, x | Mean, %% of even's |\n|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|\n");
  for (const JudgedScene& scene : scenes_of(options)) {
    progress(scene.name);
    Stage stage(context, scene, options.size);
    const std::array<std::vector<float>, 2> reference = stage.reference(options.reference_samples);
    const std::array<std::vector<double>, 2> halves{luminances(reference[0]), luminances(reference[1])};
    for (const double target : options.targets) {
      std::array<Taken, 2> taken;
      for (int repeat = 0; repeat < options.repeats; ++repeat) {
        for (const bool adaptive : {false, true}) {
          stage.sample_to(target, adaptive, static_cast<std::uint32_t>(repeat));
          add(stage, halves, taken.at(adaptive ? 1 : 0));
        }
      }
      std::printf("| %s | %.3g |", scene.name.c_str(), 100.0 * target);
      for (const Taken& each : taken)
        std::printf(" %.0f | %.2f | %.1f |", mean_of(each.samples), 100.0 * std::sqrt(mean_of(each.squared)),
                    spread_of(each.seconds).median);
      const double time = ratio_of(taken[1].seconds, taken[0].seconds).median;
      std::vector<double> means = taken[1].means;
      for (std::size_t i = 0; i < means.size(); ++i) means[i] /= taken[0].means[i];
      const Estimate off = estimate_of(means);
      std::printf(" %.2f | %.3f +- %.3f |\n", time * mean_of(taken[1].squared) / mean_of(taken[0].squared),
                  100.0 * off.mean, 100.0 * off.standard_error);
      std::fflush(stdout);
    }
  }
}

void measure_techniques(headless::Context& context, const Options& options) {
  std::printf(
      "| Scene | Off | Mean, %% of that with it | +-, %% | Deviations apart | By squares | Noise, x |\n"
      "|---|---|--:|--:|--:|--:|--:|\n");
  for (const JudgedScene& scene : scenes_of(options)) {
    Stage stage(context, scene, options.size);
    const Measured with = measured(stage, options.reference_samples, 0);
    for (const Technique& technique : techniques()) {
      if (!technique.scenes.empty() && std::ranges::find(technique.scenes, scene.name) == technique.scenes.end())
        continue;
      progress(scene.name + ", off: " + technique.name);
      const EditedShaders edited(technique.off);
      cumulet_shader_cache programs{edited.programs()};
      Stage without_it(context, scene, options.size, &programs);
      const Measured without = measured(without_it, options.reference_samples, 1);
      const glm::uvec2 whole(options.size);
      const double z = apart(without, with, options.size, glm::uvec2(0U), whole);
      const double part = mean_of(without.bright) / mean_of(with.bright);
      std::printf("| %s | %s | %.3f | %.3f | %.1f | %.2f | %.2f |\n", scene.name.c_str(), technique.name, 100.0 * part,
                  100.0 * std::abs(part - 1.0) / std::max(1e-9, std::abs(z)), z,
                  apart_by_squares(without, with, options.size), noise_of(without) / noise_of(with));
      std::fflush(stdout);
    }
  }
}

}  // namespace cumulet::bench
