#include "stats.hpp"

#include <sys/resource.h>

#include <cmath>
#include <cstdint>
#include <file.hpp>
#include <nlohmann/json.hpp>
#include <settings.hpp>

#include "metadata.hpp"

namespace cumulet::demo {
namespace {

using Json = nlohmann::ordered_json;

}  // namespace

void write_stats(const RenderOptions& options, const Viewer& viewer, const char* backend) {
  const cumulet_stats stats = stats_of(viewer);
  cumulet_interpolation interpolation{};
  check(viewer, cumulet_get_interpolation(viewer.get(), &interpolation));
  cumulet_grid_desc grid = options.scene.grid;
  settings::spell_out_zeros(grid);
  const bool tet = grid.type == CUMULET_GRID_TETRAHEDRAL;
  Json json;
  if (tet) {
    json["cells"] = stats.cells;
    json["levels"] = stats.levels;
  }
  json["cell_bytes"] = stats.cell_bytes;
  json["active_voxels"] = stats.active_voxels;
  Json& build = json["build_seconds"];
  build["total"] = stats.build_seconds_total;
  const auto add_stage = [&build](const char* name, double seconds) {
    if (seconds > 0.0) build[name] = seconds;
  };
  add_stage("load", stats.build_seconds_load);
  add_stage("statistics", stats.build_seconds_statistics);
  add_stage("refine", stats.build_seconds_refine);
  add_stage("packing", stats.build_seconds_packing);
  add_stage("upload", stats.build_seconds_upload);
  json["trace_seconds"] = stats.trace_seconds;
  Json& passes = json["pass_seconds"];
  passes["upload"] = stats.pass_seconds_upload;
  passes["host_depth"] = stats.pass_seconds_host_depth;
  passes["surfaces"] = stats.pass_seconds_surfaces;
  passes["trace"] = stats.pass_seconds_trace;
  passes["inspect"] = stats.pass_seconds_inspect;
  passes["display"] = stats.pass_seconds_display;
  json["samples"] = stats.samples;
  json["nonfinite_samples"] = stats.nonfinite_samples;
  if (options.scene.sampling.view == CUMULET_VIEW_SHADED)
    json["noise"] = std::isfinite(stats.noise) ? Json(stats.noise) : Json();  // null: unknown
  if (stats.trace_seconds > 0.0) json["samples_per_second"] = static_cast<double>(stats.samples) / stats.trace_seconds;
  if (stats.samples > 0)
    json["mean_steps_per_path"] = static_cast<double>(stats.steps) / static_cast<double>(stats.samples);
  rusage usage{};
  if (getrusage(RUSAGE_SELF, &usage) == 0)
    json["peak_rss_bytes"] = static_cast<std::uint64_t>(usage.ru_maxrss) * 1024;  // Linux counts in KiB
  json["gl"] = {{"vendor", stats.gl_vendor}, {"renderer", stats.gl_renderer}, {"version", stats.gl_version}};
  json["backend"] = backend;
  json["grid_type"] = grid_type_name(grid.type);
  json["interpolation"] = interpolation_name(interpolation);
  if (tet) json["cells_mode"] = cells_name(grid.cells);
  // A driver's name may have any encoding: invalid UTF-8 is replaced instead of throwing.
  image::replace_file(options.stats, json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n");
}

}  // namespace cumulet::demo
