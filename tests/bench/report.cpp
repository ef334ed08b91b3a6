#include "report.hpp"

#include <array>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <sstream>
#include <stdexcept>

#include "format.hpp"
#include "plot.hpp"

namespace cumulet::bench {

namespace {

constexpr const char* full_cloud = "cumulus";
constexpr double aim_target = 0.03;
constexpr double aim_dense = 5.0;
constexpr double aim_brick = 1.5;
constexpr double aim_memory = 0.25;
constexpr std::uint64_t full_cloud_voxels = 20'000'000;

std::string percent(double part) { return format("%.3g %%", 100.0 * part); }

std::string megabytes(double bytes) { return format("%.3g", bytes / 1e6); }

/// At least 3 significant digits, never an exponent.
std::string number(double value) {
  if (value >= 1e6) return format("%.2fM", value / 1e6);
  if (value >= 1e4) return format("%.1fk", value / 1e3);
  if (value >= 100.0) return format("%.0f", value);
  return format("%.3g", value);
}

std::string ratio(const Spread& s) { return format("%.2f (%.2f..%.2f)", s.median, s.min, s.max); }

bool is_tet(Kind kind) { return kind == Kind::tet_constant || kind == Kind::tet_linear; }

std::string cells_text(const TraceRow& row) { return is_tet(row.kind) ? number(static_cast<double>(row.cells)) : "-"; }

std::string image_error_text(const TraceRow& row) {
  if (!is_tet(row.kind)) return "reference";
  std::string text = format("%.2f +- %.2f %%", 100.0 * row.error.value, 100.0 * row.error.standard_error);
  return row.matched ? text : text + " (not matched)";
}

std::string conditions(const Machine& machine, const Options& options) {
  std::string text = "OpenGL: " + machine.gl_renderer + ", " + machine.gl_version + " (" + machine.context +
                     "); CPU: " + machine.cpu + format(", %u threads.\n", machine.threads);
  text += format(
      "Each asset: density scaled to a mean optical depth of %.3g, albedo %.3g, g 0, no bounce limit, sun and sky, a "
      "camera "
      "fitted to the bounds, %u x %u pixels.\n",
      options.optical_depth, static_cast<double>(options.albedo), options.size, options.size);
  text += format(
      "Rates: medians of %d interleaved repeats (tet, tet, dense, brick, tet, ...) after a warm-up; in brackets the "
      "spread of the repeats' ratios.\n",
      options.repeats);
  return text;
}

std::string error_definition(const Options& options) {
  return format(
      "Image error: root mean square difference from the voxels' shaded picture (by the brick grid, whose medium "
      "is the dense one's), relative to the mean radiance over the medium's pixels. Its square is the mean of (A1 "
      "- B1)(A2 - B2) over two independent halves of %u samples per pixel, which Monte Carlo noise does not bias; "
      "+- is its standard error. Depth and opacity error: the same of the camera rays' optical depth and of 1 - "
      "exp(-depth), which are deterministic.\n",
      options.error_samples);
}

const AssetResult* find_full_cloud(const std::vector<AssetResult>& assets) {
  for (const AssetResult& asset : assets) {
    if (asset.name == full_cloud && asset.active_voxels >= full_cloud_voxels) return &asset;
  }
  return nullptr;
}

std::string aim_line(const std::vector<AssetResult>& assets) {
  const std::string aim = format(
      "aim (sample cloud at full setting, %.2g %% image error: tet-linear at least %.2g x dense and %.2g x brick in "
      "samples/s, at most %.2g of dense's memory): ",
      100.0 * aim_target, aim_dense, aim_brick, aim_memory);
  const AssetResult* cloud = find_full_cloud(assets);
  if (cloud == nullptr) return aim + "not measured, that cloud is not among the inputs.\n";
  for (const TargetResult& target : cloud->targets) {
    if (std::abs(target.target - aim_target) > 1e-9) continue;
    const TraceRow& row = target.rows[static_cast<std::size_t>(Kind::tet_linear)];
    if (!row.matched) return aim + "not measured, no threshold matched the error.\n";
    const bool reached =
        row.to_dense.median >= aim_dense && row.to_brick.median >= aim_brick && row.bytes_of_dense <= aim_memory;
    return aim + (reached ? "reached" : "not reached") +
           format(": %.2f x dense, %.2f x brick, %.3g of the memory.\n", row.to_dense.median, row.to_brick.median,
                  row.bytes_of_dense);
  }
  return aim + "not measured, that error is not among the targets.\n";
}

std::string tracing_table(const std::vector<AssetResult>& assets, bool full) {
  std::string text =
      "| Asset | Grid type | Image error | Cells | MB | of dense | Steps/path | Samples/s | x dense | x brick |\n"
      "|---|---|---|--:|--:|--:|--:|--:|--:|--:|\n";
  for (const AssetResult& asset : assets) {
    for (const TargetResult& target : asset.targets) {
      if (!full && &target != &asset.targets.front()) continue;
      for (const TraceRow& row : target.rows) {
        text += "| " + asset.name + " | " + name_of(row.kind) + " | " + image_error_text(row) + " | " +
                cells_text(row) + " | " + megabytes(static_cast<double>(row.bytes)) + " | " +
                format("%.3g", row.bytes_of_dense) + " | " + number(row.steps_per_path) + " | " +
                number(row.samples_per_second.median) + " | " +
                (full ? ratio(row.to_dense) : format("%.2f", row.to_dense.median)) + " | " +
                (full ? ratio(row.to_brick) : format("%.2f", row.to_brick.median)) + " |\n";
      }
    }
  }
  return text;
}

std::string detail_table(const std::vector<AssetResult>& assets) {
  std::string text =
      "| Asset | Grid type | Threshold | Depth error | Opacity error | Msteps/s in paths | Steps/camera ray | Camera "
      "rays/s | x "
      "dense | x brick |\n|---|---|--:|--:|--:|--:|--:|--:|--:|--:|\n";
  for (const AssetResult& asset : assets) {
    for (const TargetResult& target : asset.targets) {
      for (const TraceRow& row : target.rows) {
        const bool tet = is_tet(row.kind);
        text += "| " + asset.name + " | " + name_of(row.kind) + " | " + (tet ? format("%.4g", row.threshold) : "-") +
                " | " + (tet ? percent(row.depth_error.depth) : "-") + " | " +
                (tet ? percent(row.depth_error.opacity) : "-") + " | " +
                format("%.1f", row.steps_per_second.median / 1e6) + " | " + number(row.steps_per_ray) + " | " +
                number(row.rays_per_second.median) + " | " + ratio(row.ray_to_dense) + " | " + ratio(row.ray_to_brick) +
                " |\n";
      }
    }
  }
  return text;
}

std::string sweep_table(const std::vector<AssetResult>& assets) {
  constexpr std::array<double, 4> errors{0.1, 0.05, 0.03, 0.01};
  std::string text =
      "| Asset | Criterion | Cells | 10 % | 5 % | 3 % | 1 % | MB at 3 % | MB at 1 % |\n"
      "|---|---|---|--:|--:|--:|--:|--:|--:|\n";
  for (const AssetResult& asset : assets) {
    for (const SweepCurve& curve : asset.curves) {
      text += "| " + asset.name + " | " + name_of(curve.criterion) + " | " +
              (curve.kind == Kind::tet_linear ? "linear" : "constant") + " |";
      const SweepPoint& finest = curve.points.back();
      const double cell_bytes = static_cast<double>(finest.bytes) / static_cast<double>(finest.cells);
      std::string bytes;
      for (const double error : errors) {
        const std::optional<double> cells = curve.cells_at(error);
        text += format(" %s |", cells ? number(*cells).c_str() : "-");
        if (error < 0.04) bytes += format(" %s |", cells ? megabytes(*cells * cell_bytes).c_str() : "-");
      }
      text += bytes + "\n";
    }
  }
  return text;
}

std::string build_table(const std::vector<AssetResult>& assets) {
  std::string text =
      "| Asset | Cells | Load | Statistics | Refine | Records | Upload | Total, s | Seconds per million cells: refine "
      "| "
      "records | upload | Peak RSS, GiB |\n|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|\n";
  for (const AssetResult& asset : assets) {
    const BuildRow& b = asset.build;
    const double million = std::max(1e-6, static_cast<double>(b.cells) / 1e6);
    text += "| " + asset.name + " | " + number(static_cast<double>(b.cells)) +
            format(" | %.3f | %.3f | %.3f | %.3f | %.3f | %.2f | %.3f | %.3f | %.3f | %.2f |\n", b.load, b.statistics,
                   b.refine, b.records, b.upload, b.total(), b.refine / million, b.records / million,
                   b.upload / million, b.peak_bytes / (1024.0 * 1024.0 * 1024.0));
  }
  return text;
}

std::string surface_text(const std::vector<AssetResult>& assets) {
  const std::size_t triangles = assets.empty() ? 0 : assets.front().surfaces.triangles;
  return "With surfaces under and in the volume (" + number(static_cast<double>(triangles)) +
         " triangles, diffuse and glossy), tet-linear, samples/s x the volume alone:\n";
}

std::string surface_table(const std::vector<AssetResult>& assets, bool full) {
  std::string text = "| Asset | Volume alone, samples/s |";
  std::string rule = "\n|---|--:|";
  for (const viewer::SurfaceLight light : surface_lights) {
    text += std::string(" With surfaces, light `") + name_of(light) + "` |";
    rule += "--:|";
  }
  text += rule + "\n";
  for (const AssetResult& asset : assets) {
    text += "| " + asset.name + " | " + number(asset.surfaces.alone.median) + " |";
    for (const SurfaceRow& row : asset.surfaces.rows) {
      text += format(" %s x |", full ? ratio(row.to_alone).c_str() : format("%.2f", row.to_alone.median).c_str());
    }
    text += "\n";
  }
  return text;
}

std::string tree_table(const std::vector<TreeTimes>& trees, bool full) {
  std::string text =
      "| Triangles | Millions | Build, s a million | x Embree | Refit, s a million | x Embree |\n"
      "|---|--:|--:|--:|--:|--:|\n";
  const auto cells = [full](const Duel& d) {
    std::string other = "-";
    if (d.ratio) other = full ? ratio(*d.ratio) : format("%.2f", d.ratio->median);
    return format(" %.3g | ", d.ours.median) + other + " |";
  };
  for (const TreeTimes& tree : trees) {
    text += "| " + tree.name + format(" | %.3g |", tree.millions) + cells(tree.build) + cells(tree.refit) + "\n";
  }
  return text;
}

std::string build_line(const std::vector<AssetResult>& assets) {
  if (assets.empty()) return "";
  const AssetResult* asset = &assets.front();
  for (const AssetResult& other : assets) {
    if (other.active_voxels > asset->active_voxels) asset = &other;
  }
  const BuildRow& b = asset->build;
  return "Build: " + number(static_cast<double>(b.cells)) + " linear cells of " + asset->name + " (" +
         number(static_cast<double>(asset->active_voxels)) +
         format(
             " active voxels) in %.1f s, of it load %.2f, statistics %.2f, refine %.2f, records %.2f, upload %.2f; "
             "peak "
             "memory %.1f GiB.\n",
             b.total(), b.load, b.statistics, b.refine, b.records, b.upload, b.peak_bytes / (1024.0 * 1024.0 * 1024.0));
}

std::string csv(const Machine& machine, const std::vector<AssetResult>& assets, const std::vector<TreeTimes>& trees) {
  std::string text = "asset,march,target,quantity,value,min,max\n";
  const auto line = [&text](const std::string& asset, const std::string& march, double target, const char* quantity,
                            double value, double min, double max) {
    text += asset + "," + march + format(",%.6g,%s,%.9g,%.9g,%.9g\n", target, quantity, value, min, max);
  };
  std::string renderer = machine.gl_renderer;
  for (char& c : renderer) {
    if (c == ',' || c == '"') c = ';';
  }
  for (const AssetResult& asset : assets) {
    for (const TargetResult& target : asset.targets) {
      for (const TraceRow& row : target.rows) {
        const auto one = [&](const char* quantity, double value) {
          line(asset.name, name_of(row.kind), target.target, quantity, value, value, value);
        };
        const auto spread = [&](const char* quantity, const Spread& s) {
          line(asset.name, name_of(row.kind), target.target, quantity, s.median, s.min, s.max);
        };
        if (is_tet(row.kind)) {
          one("cells", static_cast<double>(row.cells));
          one("threshold", row.threshold);
          line(asset.name, name_of(row.kind), target.target, "image_error", row.error.value,
               row.error.value - row.error.standard_error, row.error.value + row.error.standard_error);
          one("depth_error", row.depth_error.depth);
          one("opacity_error", row.depth_error.opacity);
        }
        one("bytes", static_cast<double>(row.bytes));
        one("steps_per_path", row.steps_per_path);
        spread("samples_per_second", row.samples_per_second);
        spread("steps_per_second", row.steps_per_second);
        spread("samples_per_second_to_dense", row.to_dense);
        spread("samples_per_second_to_brick", row.to_brick);
        one("steps_per_camera_ray", row.steps_per_ray);
        spread("camera_rays_per_second", row.rays_per_second);
        spread("camera_rays_per_second_to_dense", row.ray_to_dense);
        spread("camera_rays_per_second_to_brick", row.ray_to_brick);
      }
    }
    for (const SurfaceRow& row : asset.surfaces.rows) {
      const std::string name = std::string("tet-linear/surfaces-") + name_of(row.light);
      const double target = asset.targets.front().target;
      const auto spread = [&](const char* quantity, const Spread& s) {
        line(asset.name, name, target, quantity, s.median, s.min, s.max);
      };
      spread("samples_per_second", row.samples_per_second);
      spread("samples_per_second_to_alone", row.to_alone);
      line(asset.name, name, target, "steps_per_path", row.steps_per_path, row.steps_per_path, row.steps_per_path);
    }
    for (const SweepCurve& curve : asset.curves) {
      const std::string name = std::string(name_of(curve.kind)) + "/" + name_of(curve.criterion);
      for (const SweepPoint& p : curve.points) {
        const auto one = [&](const char* quantity, double value) {
          line(asset.name, name, p.threshold, quantity, value, value, value);
        };
        one("sweep_cells", static_cast<double>(p.cells));
        one("sweep_bytes", static_cast<double>(p.bytes));
        one("sweep_depth_error", p.error.depth);
        one("sweep_opacity_error", p.error.opacity);
      }
    }
    const BuildRow& b = asset.build;
    const auto stage = [&](const char* quantity, double value) {
      line(asset.name, "tet-linear", 0.0, quantity, value, value, value);
    };
    stage("build_cells", static_cast<double>(b.cells));
    stage("build_seconds_load", b.load);
    stage("build_seconds_statistics", b.statistics);
    stage("build_seconds_refine", b.refine);
    stage("build_seconds_packing", b.records);
    stage("build_seconds_upload", b.upload);
    stage("build_peak_bytes", b.peak_bytes);
  }
  for (const TreeTimes& tree : trees) {
    const auto spread = [&](const char* quantity, const Spread& s) {
      line(tree.name, "bvh", 0.0, quantity, s.median, s.min, s.max);
    };
    const double triangles = 1e6 * tree.millions;
    spread("triangles", {triangles, triangles, triangles});
    spread("build_seconds_a_million", tree.build.ours);
    spread("refit_seconds_a_million", tree.refit.ours);
    if (tree.build.ratio) spread("build_to_embree", *tree.build.ratio);
    if (tree.refit.ratio) spread("refit_to_embree", *tree.refit.ratio);
  }
  text +=
      "machine," + renderer + ",0,threads," + format("%u,%u,%u\n", machine.threads, machine.threads, machine.threads);
  return text;
}

void write_plots(const Options& options, const std::vector<AssetResult>& assets) {
  for (const AssetResult& asset : assets) {
    std::vector<Series> series;
    for (const SweepCurve& curve : asset.curves) {
      Series s;
      s.label = std::string(curve.kind == Kind::tet_linear ? "linear" : "constant") + ", " + name_of(curve.criterion);
      s.color = curve.kind == Kind::tet_linear ? 1 : 0;
      s.dashed = curve.criterion == grid::Criterion::range_mean;
      for (const SweepPoint& p : curve.points) {
        s.points.emplace_back(static_cast<double>(p.cells), 100.0 * p.error.depth);
      }
      series.push_back(std::move(s));
    }
    write_file(
        options.out / ("error-" + asset.name + ".svg"),
        line_plot(asset.name + ": cells against error", "cells", "optical depth error, RMS, % of the mean", series));
  }
  std::vector<std::string> bars;
  for (const Kind kind : all_kinds) bars.emplace_back(name_of(kind));
  std::vector<BarGroup> paths;
  std::vector<BarGroup> rays;
  for (const AssetResult& asset : assets) {
    for (const TargetResult& target : asset.targets) {
      BarGroup path{asset.name, {}};
      if (asset.targets.size() > 1) path.label.append(" ").append(percent(target.target));
      BarGroup ray = path;
      for (const TraceRow& row : target.rows) {
        path.values.push_back(row.samples_per_second.median);
        ray.values.push_back(row.rays_per_second.median);
      }
      paths.push_back(std::move(path));
      rays.push_back(std::move(ray));
    }
  }
  write_file(options.out / "samples-per-second.svg",
             bar_plot("Paths at matched image error", "samples per second", bars, paths));
  write_file(options.out / "rays-per-second.svg",
             bar_plot("Camera rays right through, at matched image error", "rays per second", bars, rays));
}

void update_readme(const std::filesystem::path& path, const std::string& part) {
  std::ifstream in(path, std::ios::binary);
  std::stringstream buffer;
  buffer << in.rdbuf();
  if (!in) throw std::runtime_error(path.string() + ": cannot be read");
  std::string text = buffer.str();
  const std::string begin = "<!-- bench:begin -->";
  const std::string end = "<!-- bench:end -->";
  const std::size_t from = text.find(begin);
  const std::size_t to = text.find(end);
  if (from == std::string::npos || to == std::string::npos || to < from) {
    throw std::runtime_error(path.string() + ": has no " + begin + " ... " + end);
  }
  text.replace(from + begin.size(), to - from - begin.size(), "\n" + part);
  write_file(path, text);
}

}  // namespace

void write_report(const Machine& machine, const Options& options, const std::vector<AssetResult>& assets,
                  const std::vector<TreeTimes>& trees, const std::vector<std::string>& skipped) {
  std::filesystem::create_directories(options.out);
  std::string left_out;
  for (const std::string& line : skipped) left_out += "Skipped: " + line + "\n\n";

  std::string report = "# Benchmark\n\nMade by\n\n    " + options.command + "\n\n" + left_out +
                       conditions(machine, options) + "\n" + error_definition(options) + "\n";
  for (const AssetResult& asset : assets) {
    report +=
        "- " + asset.name + format(": %d x %d x %d voxels, ", asset.voxels[0], asset.voxels[1], asset.voxels[2]) +
        number(static_cast<double>(asset.active_voxels)) +
        format(" active, in %.0f %% of the pixels; density scale %.4g", 100.0 * asset.coverage, asset.density_scale);
    for (const TargetResult& target : asset.targets) {
      report += "; " + percent(target.target) + format(": %u samples per pixel a run", target.samples);
    }
    report += "\n";
  }
  report += "\n" + aim_line(assets);
  report += "\n## Paths at matched image error\n\n" + tracing_table(assets, true) +
            "\n![samples per second](samples-per-second.svg)\n";
  report += "\n## The same grids: errors, and camera rays without scattering\n\n" + detail_table(assets) +
            "\n![camera rays per second](rays-per-second.svg)\n";
  report += "\n## Cells that an optical depth error needs\n\n" + sweep_table(assets);
  for (const AssetResult& asset : assets) report += "\n![" + asset.name + "](error-" + asset.name + ".svg)\n";
  report += "\n## What surfaces cost\n\n" + surface_text(assets) + "\n" + surface_table(assets, true);
  report += "\n## The triangle tree\n\n" + tree_table(trees, true);
  report += "\n## Build, linear cells, split until the number of cells is reached; seconds\n\n" + build_table(assets);
  write_file(options.out / "report.md", report);
  write_file(options.out / "results.csv", csv(machine, assets, trees));
  write_plots(options, assets);

  if (!options.readme.empty()) {
    std::string part = "Path tracing at a matched image error of " + percent(options.targets.front()) +
                       " against the voxels (dense march), made by\n\n    " + options.command + "\n\n" + left_out +
                       tracing_table(assets, false) + "\n" + surface_text(assets) + "\n" +
                       surface_table(assets, false) +
                       "\nThe triangle tree, beside Embree 3 on the same triangles:\n\n" + tree_table(trees, false) +
                       "\n" + build_line(assets) + "\n" + aim_line(assets) + "\n" + conditions(machine, options) +
                       "`docs/architecture/experiments.md` lists the limits of each grid type.\n";
    update_readme(options.readme, part);
  }
}

}  // namespace cumulet::bench
