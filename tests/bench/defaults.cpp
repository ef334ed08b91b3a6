#include "defaults.hpp"

#include <array>
#include <cstdio>

#include "error.hpp"
#include "measure.hpp"
#include "settings/settings.hpp"
#include "statistics.hpp"
#include "subject.hpp"

namespace cumulet::bench {

namespace {

struct Grid {
  grid::Criterion criterion;
  double threshold;
};

}  // namespace

std::string defaults_head() {
  return "| Asset | Criterion | Threshold | Cells | Image error, % | Samples/s, tet : brick |\n"
         "|---|---|--:|--:|--:|--:|\n";
}

std::string measure_defaults(headless::Context& context, const Asset& asset, const Options& options) {
  const double density_scale = asset.density_scale(options.optical_depth);
  Subject voxels(context, asset.volume, Kind::brick, options, density_scale);
  const ImageReference reference(voxels, options.error_samples, options.error_parts);
  progress("    reference");
  std::vector<Grid> grids;
  const double usual = settings::default_threshold(CUMULET_CRITERION_TRANSMITTANCE);
  if (options.thresholds.empty()) grids.push_back({grid::Criterion::transmittance, usual});
  for (const double threshold : options.thresholds) grids.push_back({grid::Criterion::transmittance, threshold});
  for (const double threshold : options.deviations) grids.push_back({grid::Criterion::deviation, threshold});
  std::string rows;
  for (const Grid& made : grids) {
    Subject tets(context, asset.volume, Kind::tet_linear, options, density_scale);
    tets.refine(made.criterion, made.threshold, options.max_cells);
    const ImageError error = reference.error_of(tets);
    std::vector<double> tet_rates;
    std::vector<double> voxel_rates;
    for (int repeat = 0; repeat < options.repeats; ++repeat) {
      const auto seed = static_cast<std::uint32_t>(1000 + repeat);
      tet_rates.push_back(tets.shaded(options.fewest_samples, seed).samples_per_second());
      voxel_rates.push_back(voxels.shaded(options.fewest_samples, seed).samples_per_second());
    }
    std::array<char, 200> row{};
    std::snprintf(row.data(), row.size(), "| %s | %s | %g | %llu | %.2f (%.2f) | %.2f |\n", asset.name.c_str(),
                  name_of(made.criterion), made.threshold, static_cast<unsigned long long>(tets.stats().cells),
                  100.0 * error.value, 100.0 * error.standard_error, ratio_of(tet_rates, voxel_rates).median);
    progress(row.data());
    rows += row.data();
  }
  return rows;
}

}  // namespace cumulet::bench
