#include "measure.hpp"

#include <malloc.h>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <memory>

#include "surfaces.hpp"

namespace cumulet::bench {

namespace {

constexpr double first_deviation = 1.6;
constexpr double first_range_mean = 1048576.0;  // for sparse volumes with a few large voxels, max / mean is large
constexpr double finest_error = 0.007;
constexpr double image_to_depth_error = 1.5;  // where the search for an image error begins

std::string text(const char* format, double a, double b = 0.0, double c = 0.0) {
  std::array<char, 160> buffer{};
  std::snprintf(buffer.data(), buffer.size(), format, a, b, c);
  return buffer.data();
}

// Linux: the high-water mark of resident memory, and its reset. 0 if /proc does not have it.
void reset_peak() {
  malloc_trim(0);
  std::ofstream("/proc/self/clear_refs") << "5";
}

double peak_bytes() {
  std::ifstream status("/proc/self/status");
  std::string word;
  while (status >> word) {
    if (word == "VmHWM:") {
      double kib = 0.0;
      status >> kib;
      return kib * 1024.0;
    }
  }
  return 0.0;
}

BuildRow measure_build(headless::Context& context, const Asset& asset, const Options& options, double density_scale) {
  reset_peak();
  // A copy whose statistics are not computed yet.
  const auto volume = std::make_shared<const viewer::VolumeAsset>(asset.volume->volume());
  Subject subject(context, volume, Kind::tet_linear, options, density_scale);
  subject.refine(grid::Criterion::deviation, 1e-6, options.build_cells);
  const viewer::Stats stats = subject.stats();
  const viewer::BuildSeconds& seconds = stats.build_seconds;
  BuildRow row;
  row.cells = stats.cells;
  row.load = asset.load_seconds;
  row.statistics = seconds.statistics;
  row.refine = seconds.refine;
  row.records = seconds.records;
  row.upload = seconds.upload;
  // The asset's own copy of the voxels is the benchmark's, not the viewer's.
  row.peak_bytes = std::max(0.0, peak_bytes() - static_cast<double>(asset.volume->volume().brick_values.bytes()));
  return row;
}

SweepCurve sweep(Subject& subject, grid::Criterion criterion, const DepthReference& reference, const Options& options) {
  SweepCurve curve;
  curve.criterion = criterion;
  curve.kind = subject.kind();
  const bool deviation = criterion == grid::Criterion::deviation;
  const double factor = deviation ? options.sweep_factor : 2.0 * options.sweep_factor;
  double threshold = deviation ? first_deviation : first_range_mean;
  for (int i = 0; i < 16; ++i, threshold /= factor) {
    subject.refine(criterion, threshold, 2 * options.sweep_cells);
    SweepPoint point;
    point.threshold = threshold;
    point.cells = subject.stats().cells;
    point.bytes = subject.stats().cell_bytes;
    const bool limited = point.cells + 1000 > 2 * options.sweep_cells;
    if (limited && !curve.points.empty()) break;
    point.error = reference.error_of(subject);
    const bool same = !curve.points.empty() && curve.points.back().cells == point.cells;
    if (!same) curve.points.push_back(point);
    if (point.cells > options.sweep_cells || point.error.depth < finest_error) break;
  }
  return curve;
}

/// y at x on a straight line in logarithms through (x_0, y_0) and (x_1, y_1).
double log_between(double x_0, double x_1, double x, double y_0, double y_1) {
  const double part = std::log(x_0 / x) / std::log(x_0 / x_1);
  return std::isfinite(part) ? y_0 * std::pow(y_1 / y_0, part) : y_1;
}

struct Match {
  double threshold = 0.0;
  ImageError error;
};

/// The threshold whose image error is the target: a secant search in logarithms, kept inside the interval that brackets
/// the target.
Match match(Subject& subject, const ImageReference& reference, double target, double guess, const Options& options) {
  struct Point {
    double threshold, error;
  };
  std::optional<Point> low, high;  // errors below and above the target
  Match best;
  double best_distance = 1e30;
  double threshold = guess;
  for (int i = 0; i < options.evaluations; ++i) {
    subject.refine(grid::Criterion::deviation, threshold, options.max_cells);
    const ImageError error = reference.error_of(subject);
    const double value = std::max(error.value, 0.25 * target);
    progress("    " + std::string(name_of(subject.kind())) +
             text(": threshold %.4g, image error %.2f +- %.2f %%", threshold, 100.0 * error.value,
                  100.0 * error.standard_error));
    const double distance = std::abs(std::log(value / target));
    if (distance < best_distance) {
      best_distance = distance;
      best = {threshold, error};
    }
    if (distance < 0.05) break;
    (value < target ? low : high) = Point{threshold, value};
    if (low && high) {
      const double part = std::log(target / low->error) / std::log(high->error / low->error);
      threshold = low->threshold *
                  std::pow(high->threshold / low->threshold, std::isfinite(part) ? std::clamp(part, 0.1, 0.9) : 0.5);
    } else {
      threshold *= std::clamp(target / value, 0.25, 4.0);
    }
  }
  subject.refine(grid::Criterion::deviation, best.threshold, options.max_cells);
  return best;
}

/// Runs the subjects in turn until all have their repeats.
template <class Measure>
std::vector<std::vector<Run>> take_turns(std::size_t subjects, int repeats, Measure measure_one) {
  std::vector<std::vector<Run>> runs(subjects);
  for (int repeat = 0; repeat < repeats; ++repeat) {
    for (std::size_t i = 0; i < subjects; ++i) {
      Run run = measure_one(i, static_cast<std::uint32_t>(repeat));
      run.rgba.clear();
      runs[i].push_back(std::move(run));
    }
  }
  return runs;
}

double density_scale_of(const Asset& asset, const Options& options) {
  return options.optical_depth / std::max(asset.mean_optical_depth, 1e-30);
}

/// The number of samples per pixel for the intended duration of a run, if one sample takes this many seconds.
std::uint32_t samples_within(const Options& options, double seconds) {
  const double samples = options.seconds_a_run / std::max(seconds, 1e-3);
  return static_cast<std::uint32_t>(std::clamp(samples, static_cast<double>(options.fewest_samples), 16.0));
}

std::vector<double> rates(const std::vector<Run>& runs) {
  std::vector<double> result;
  for (const Run& run : runs) result.push_back(run.samples_per_second());
  return result;
}

/// Cost of surfaces: a grid with the threshold of `alone`, with surfaces, in turn with the volume only.
SurfaceResult measure_surfaces(headless::Context& context, const Asset& asset, const Options& options, Subject& alone,
                               double threshold, double density_scale) {
  const scene::ModelSourcePtr surfaces = surfaces_in(asset.volume->bounds());
  Subject with(context, asset.volume, alone.kind(), options, density_scale);
  with.refine(grid::Criterion::deviation, threshold, options.max_cells);
  with.show(surfaces);
  const auto run = [&](std::size_t i, std::uint32_t samples, std::uint32_t seed) {
    if (i == 0) return alone.shaded(samples, seed);
    with.light_surfaces(surface_lights[i - 1]);
    return with.shaded(samples, seed);
  };
  const std::size_t subjects = 1 + surface_lights.size();
  double slowest = 1e-3;
  for (std::size_t i = 0; i < subjects; ++i) slowest = std::max(slowest, run(i, 1, 1).seconds);
  SurfaceResult result;
  result.triangles = surfaces->scene->triangle_count();
  result.samples = samples_within(options, slowest);
  const auto runs = take_turns(subjects, options.repeats, [&](std::size_t i, std::uint32_t repeat) {
    return run(i, result.samples, 2000 + repeat);
  });
  result.alone = spread_of(rates(runs[0]));
  for (std::size_t i = 0; i < surface_lights.size(); ++i) {
    SurfaceRow& row = result.rows[i];
    row.light = surface_lights[i];
    row.samples_per_second = spread_of(rates(runs[i + 1]));
    row.to_alone = ratio_of(rates(runs[i + 1]), rates(runs[0]));
    row.steps_per_path = runs[i + 1].front().steps_per_sample();
    progress(std::string("    surfaces, ") + name_of(row.light) +
             text(": %.0f samples/s, %.2f x the volume alone", row.samples_per_second.median, row.to_alone.median));
  }
  return result;
}

}  // namespace

void progress(const std::string& line) {
  static const auto start = std::chrono::steady_clock::now();
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  std::fprintf(stderr, "[%6.1f s] %s\n", seconds, line.c_str());
}

std::optional<double> SweepCurve::cells_at(double error) const {
  for (std::size_t i = 1; i < points.size(); ++i) {
    const SweepPoint& a = points[i - 1];
    const SweepPoint& b = points[i];
    if (a.error.depth < error || b.error.depth > error) continue;
    return log_between(a.error.depth, b.error.depth, error, static_cast<double>(a.cells), static_cast<double>(b.cells));
  }
  return std::nullopt;
}

double SweepCurve::threshold_at(double error) const {
  if (points.front().error.depth <= error) return points.front().threshold;
  for (std::size_t i = 1; i < points.size(); ++i) {
    const SweepPoint& a = points[i - 1];
    const SweepPoint& b = points[i];
    if (b.error.depth > error) continue;
    return log_between(a.error.depth, b.error.depth, error, a.threshold, b.threshold);
  }
  return points.back().threshold;
}

const char* name_of(grid::Criterion criterion) {
  switch (criterion) {
    case grid::Criterion::deviation:
      return "deviation";
    case grid::Criterion::range_mean:
      return "range-mean";
    case grid::Criterion::transmittance:
      break;
  }
  return "transmittance";
}

AssetResult measure(headless::Context& context, const Asset& asset, const Options& options) {
  AssetResult result;
  result.name = asset.name;
  const glm::ivec3 voxels = asset.volume->volume().bounds_max - asset.volume->volume().bounds_min + 1;
  result.voxels = {voxels.x, voxels.y, voxels.z};
  result.active_voxels = asset.volume->volume().active_voxels;
  const double density_scale = density_scale_of(asset, options);
  result.density_scale = density_scale;

  progress("  build");
  result.build = measure_build(context, asset, options, density_scale);

  std::array<std::unique_ptr<Subject>, 4> subjects;
  for (std::size_t i = 0; i < 4; ++i) {
    subjects[i] = std::make_unique<Subject>(context, asset.volume, all_kinds[i], options, density_scale);
  }
  Subject& dense = *subjects[2];

  progress("  cells against error");
  {
    const DepthReference reference(dense, density_scale, options.optical_depth);
    for (const grid::Criterion criterion : {grid::Criterion::deviation, grid::Criterion::range_mean}) {
      for (std::size_t i = 0; i < 2; ++i) {
        result.curves.push_back(sweep(*subjects[i], criterion, reference, options));
        const SweepPoint& last = result.curves.back().points.back();
        progress(std::string("    ") + name_of(criterion) + ", " + name_of(all_kinds[i]) +
                 text(": down to %.2f %% with %.0f cells", 100.0 * last.error.depth, static_cast<double>(last.cells)));
      }
    }
  }

  progress("  the reference picture");
  const ImageReference image_reference(*subjects[3], options.error_samples, options.error_parts);
  result.coverage = image_reference.coverage();
  const DepthReference depth_reference(dense, density_scale, options.optical_depth);
  for (const double target : options.targets) {
    TargetResult table;
    table.target = target;
    progress(text("  thresholds for an image error of %.2g %%", 100.0 * target));
    for (std::size_t i = 0; i < 4; ++i) {
      TraceRow& row = table.rows[i];
      row.kind = all_kinds[i];
      if (i < 2) {
        const double guess = result.curves[i].threshold_at(image_to_depth_error * target);
        const Match found = match(*subjects[i], image_reference, target, guess, options);
        row.threshold = found.threshold;
        row.error = found.error;
        row.matched = std::abs(found.error.value - target) < std::max(0.1 * target, found.error.standard_error);
        row.depth_error = depth_reference.error_of(*subjects[i]);
      }
    }

    progress("  paths");
    for (std::size_t i = 0; i < 4; ++i) {
      const Run warm = subjects[i]->shaded(1, 1);
      if (i == 2) table.samples = samples_within(options, warm.seconds);
    }
    const auto runs = take_turns(4, options.repeats, [&](std::size_t i, std::uint32_t repeat) {
      return subjects[i]->shaded(table.samples, 1000 + repeat);
    });

    progress("  camera rays");
    for (const auto& subject : subjects) subject->primary(density_scale);
    const auto rays = take_turns(4, 2 * options.repeats + 1,
                                 [&](std::size_t i, std::uint32_t) { return subjects[i]->primary(density_scale); });

    for (std::size_t i = 0; i < 4; ++i) {
      TraceRow& row = table.rows[i];
      row.cells = subjects[i]->stats().cells;
      row.bytes = subjects[i]->stats().cell_bytes;
      row.bytes_of_dense = static_cast<double>(row.bytes) / static_cast<double>(dense.stats().cell_bytes);
      row.samples_per_second = spread_of(rates(runs[i]));
      row.to_dense = ratio_of(rates(runs[i]), rates(runs[2]));
      row.to_brick = ratio_of(rates(runs[i]), rates(runs[3]));
      row.rays_per_second = spread_of(rates(rays[i]));
      row.ray_to_dense = ratio_of(rates(rays[i]), rates(rays[2]));
      row.ray_to_brick = ratio_of(rates(rays[i]), rates(rays[3]));
      row.steps_per_ray = rays[i].front().steps_per_sample();
      std::vector<double> steps;
      std::vector<double> steps_a_second;
      for (const Run& run : runs[i]) {
        steps.push_back(run.steps_per_sample());
        steps_a_second.push_back(static_cast<double>(run.steps) / run.seconds);
      }
      row.steps_per_path = spread_of(steps).median;
      row.steps_per_second = spread_of(steps_a_second);
      progress(std::string("    ") + name_of(row.kind) +
               text(": %.0f samples/s, %.2f x dense, %.2f x brick", row.samples_per_second.median, row.to_dense.median,
                    row.to_brick.median));
    }
    result.targets.push_back(std::move(table));
    if (result.targets.size() > 1) continue;
    progress("  surfaces");
    const auto linear = static_cast<std::size_t>(Kind::tet_linear);
    result.surfaces = measure_surfaces(context, asset, options, *subjects[linear],
                                       result.targets.front().rows[linear].threshold, density_scale);
  }
  return result;
}

void measure_surfaces_alone(headless::Context& context, const Asset& asset, const Options& options) {
  const double density_scale = density_scale_of(asset, options);
  Subject alone(context, asset.volume, Kind::tet_linear, options, density_scale);
  alone.refine(grid::Criterion::deviation, options.surfaces_threshold, options.max_cells);
  const SurfaceResult result =
      measure_surfaces(context, asset, options, alone, options.surfaces_threshold, density_scale);
  progress(text("    %.0f cells, %.0f triangles, the volume alone %.0f samples/s",
                static_cast<double>(alone.stats().cells), static_cast<double>(result.triangles), result.alone.median));
}

std::vector<TreeTimes> measure_trees(const Options& options) {
  std::vector<TreeTimes> trees;
  for (const TreeMesh& mesh : tree_meshes(options.tree_triangles)) {
    trees.push_back(time_tree(mesh, options.repeats));
    const TreeTimes& tree = trees.back();
    progress("  " + tree.name +
             text(": %.2f million triangles, build %.3f s a million, refit %.3f", tree.millions, tree.build.ours.median,
                  tree.refit.ours.median));
  }
  return trees;
}

}  // namespace cumulet::bench
