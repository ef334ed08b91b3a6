#include "peers.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "error.hpp"
#include "measure.hpp"
#include "peer_shaders.hpp"
#include "statistics.hpp"
#include "turns.hpp"

namespace cumulet::bench {

namespace {

constexpr std::array usual_thresholds{2.4, 1.2, 0.6, 0.3, 0.15};  // by transmittance, coarse to fine
constexpr double megabyte = 1e6;

/// A grid type in the table.
struct Entry {
  std::string name;
  std::unique_ptr<EditedShaders> shaders;    ///< only for NanoVDB and edited shaders
  std::shared_ptr<viewer::Sharing> variant;  ///< only for shaders of a folder
  std::unique_ptr<BoundGrid> grid;           ///< the NanoVDB grid
  std::unique_ptr<Subject> subject;
  double bytes = 0.0;
  double threshold = 0.0;           ///< of its refinement
  std::size_t tets = 0;             ///< the tetrahedral grid with this interpolation
  std::optional<ImageError> error;  ///< nullopt for exact ones
  std::vector<Run> runs;
};

Entry ours(headless::Context& context, const Asset& asset, Kind kind, const Options& options, double density_scale) {
  Entry entry;
  entry.name = name_of(kind);
  entry.subject = std::make_unique<Subject>(context, asset.volume, kind, options, density_scale);
  return entry;
}

Entry peer(headless::Context& context, const Asset& asset, NanoType type, Look look, const Options& options,
           double density_scale) {
  Entry entry;
  entry.name = std::string("HDDA, ") + (look == Look::ratio ? "ratio" : "delta") +
               (type == NanoType::fp16 ? ", Fp16" : ", float");
  const std::vector<std::uint32_t> words = make_nano_grid(asset.volume->volume(), type, options.interpolations.front());
  entry.bytes = static_cast<double>(words.size() * sizeof(std::uint32_t));
  entry.shaders = peer_shaders(type, look);
  entry.grid = std::make_unique<BoundGrid>(gl::load_functions(headless::Context::get_proc, &context), words,
                                           options.block_bytes);
  entry.subject =
      std::make_unique<Subject>(context, asset.volume, Kind::dense, options, density_scale, entry.shaders->programs());
  return entry;
}

/// Measures the same cells without clear cones. Rays continue to the bounds, which shows the savings by clear cones.
Entry to_the_box(headless::Context& context, const Asset& asset, const Entry& tets, const Options& options,
                 double density_scale) {
  const std::array edits{
      Edit{"traversal/march_tet.glsl", "cm_record_is_clear(data, ray.cone) ? CM_NONE : link", "link"}};
  Entry entry;
  entry.name = tets.name + ", on to the box";
  entry.shaders = std::make_unique<EditedShaders>(edits);
  entry.subject = std::make_unique<Subject>(context, asset.volume, Kind::tet_linear, options, density_scale,
                                            entry.shaders->programs());
  entry.subject->refine(grid::Criterion::transmittance, tets.threshold, options.max_cells);
  return entry;
}

/// Measures shaders of a folder on a grid of the same threshold.
Entry variant_of(headless::Context& context, const Asset& asset, const Entry& tets, const ShaderVariant& variant,
                 const Options& options, double density_scale) {
  Entry entry;
  entry.name = variant.name;
  entry.variant = std::make_shared<viewer::Sharing>(nullptr, std::make_shared<gl::ShaderFolder>(variant.folder));
  const Kind kind = variant.constant_cells ? Kind::tet_constant : Kind::tet_linear;
  entry.subject = std::make_unique<Subject>(context, asset.volume, kind, options, density_scale, entry.variant);
  entry.subject->refine(grid::Criterion::transmittance, tets.threshold, options.max_cells);
  return entry;
}

/// Refines the tetrahedral grid until its image error is within the target, from coarse to fine. Keeps the finest if
/// none is.
void fit(Entry& tets, const ImageReference& reference, const Options& options) {
  std::vector<double> thresholds = options.thresholds;
  if (thresholds.empty()) thresholds.assign(usual_thresholds.begin(), usual_thresholds.end());
  std::ranges::sort(thresholds, std::greater{});
  for (const double threshold : thresholds) {
    tets.threshold = threshold;
    tets.subject->refine(grid::Criterion::transmittance, threshold, options.max_cells);
    tets.error = reference.error_of(*tets.subject);
    std::array<char, 120> line{};
    std::snprintf(line.data(), line.size(), "  threshold %g: %llu cells, error %.2f +- %.2f %%", threshold,
                  static_cast<unsigned long long>(tets.subject->stats().cells), 100.0 * tets.error->value,
                  100.0 * tets.error->standard_error);
    progress(line.data());
    if (tets.error->value <= options.targets.front()) return;
  }
}

Run run(const Entry& entry, std::uint32_t samples, std::uint32_t seed, bool by_clock) {
  if (entry.grid) entry.grid->bind();
  Run run = entry.subject->shaded(samples, seed);
  if (!by_clock) run.seconds = run.processor_seconds;  // other programs run beside this one
  return run;
}

void print(const std::vector<Entry>& entries, const Options& options) {
  const std::vector<std::size_t> pixels = pixels_of(entries.front().runs);
  std::vector<Cost> costs;
  for (const Entry& entry : entries) costs.push_back(cost_of(entry.runs, pixels, options.fewest_samples));
  std::printf(
      "| Grid type | Cells | MB | Steps per path | A step, ns | Samples/s, x dense | Noise of a sample, %% | Error, "
      "%% | Time to equal variance, x tet |\n|---|--:|--:|--:|--:|--:|--:|--:|--:|\n");
  for (std::size_t i = 0; i < entries.size(); ++i) {
    const Entry& entry = entries[i];
    const Cost& cost = costs[i];
    const Cost& tets = costs[entry.tets];
    const double time = ratio_of(cost.sample, tets.sample).median * cost.variance / tets.variance;
    std::printf("| %s | ", entry.name.c_str());
    if (entry.error) std::printf("%llu", static_cast<unsigned long long>(entry.subject->stats().cells));
    std::printf(" | %.2f | %.1f | %.1f | %.2f | %.0f | ", entry.bytes / megabyte, cost.steps,
                1e9 * spread_of(cost.step).median, ratio_of(costs.front().sample, cost.sample).median,
                100.0 * std::sqrt(cost.variance));
    if (entry.error) std::printf("%.2f (%.2f)", 100.0 * entry.error->value, 100.0 * entry.error->standard_error);
    std::printf(" | %.2f |\n", time);
  }
}

/// Makes the grid types with one interpolation. Refines the tetrahedral grid to the target.
std::vector<Entry> entries_of(headless::Context& context, const Asset& asset, const Options& options,
                              double density_scale) {
  const bool linear = options.interpolations.front() == grid::Interpolation::linear;
  std::vector<Entry> entries;
  for (const Kind kind : {Kind::dense, Kind::brick, Kind::tet_linear})
    entries.push_back(ours(context, asset, kind, options, density_scale));
  {
    const ImageReference reference(*entries[1].subject, options.error_samples, options.error_parts);
    fit(entries[2], reference, options);
  }
  entries.push_back(to_the_box(context, asset, entries[2], options, density_scale));
  for (const ShaderVariant& variant : options.variants)
    entries.push_back(variant_of(context, asset, entries[2], variant, options, density_scale));
  for (Entry& entry : entries) {
    entry.subject->shaded(1, 1);
    entry.bytes = static_cast<double>(entry.subject->stats().cell_bytes);
  }
  for (const auto& [type, look] :
       {std::pair(NanoType::float32, Look::delta), {NanoType::float32, Look::ratio}, {NanoType::fp16, Look::ratio}}) {
    if (!linear || type == NanoType::float32)
      entries.push_back(peer(context, asset, type, look, options, density_scale));
  }
  for (Entry& entry : entries) entry.name += linear ? ", interpolated" : "";
  return entries;
}

}  // namespace

void measure_peers(headless::Context& context, const Asset& asset, const Options& options) {
  const double density_scale = asset.density_scale(options.optical_depth);
  std::vector<Entry> entries;
  for (const grid::Interpolation interpolation : options.interpolations) {
    Options of_one = options;
    of_one.interpolations = {interpolation};
    const std::size_t tets = entries.size() + 2;  // after dense and bricks
    for (Entry& entry : entries_of(context, asset, of_one, density_scale)) {
      entry.tets = tets;
      entries.push_back(std::move(entry));
    }
  }
  for (const Entry& entry : entries) run(entry, 1, 1, options.by_clock);  // compiles
  progress("  turns");
  for (int repeat = 0; repeat < options.repeats; ++repeat) {
    for (Entry& entry : entries)
      entry.runs.push_back(
          run(entry, options.fewest_samples, 1000 + static_cast<std::uint32_t>(repeat), options.by_clock));
  }
  const double fpn = static_cast<double>(make_nano_grid(asset.volume->volume(), NanoType::fpn).size()) * 4.0;
  std::printf("\n%s: %llu active voxels, mean optical depth %g, %u x %u pixels, %d x %u samples; FpN: %.2f MB\n\n",
              asset.name.c_str(), static_cast<unsigned long long>(asset.volume->volume().active_voxels),
              options.optical_depth, options.size, options.size, options.repeats, options.fewest_samples,
              fpn / megabyte);
  print(entries, options);
  std::fflush(stdout);
}

}  // namespace cumulet::bench
