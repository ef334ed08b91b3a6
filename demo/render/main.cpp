// cumulet-render: one volume, one picture.

#include <cumulet/cumulet.h>
#include <sys/resource.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <cstdio>
#include <exception>
#include <file.hpp>
#include <headless.hpp>
#include <image.hpp>
#include <iostream>
#include <memory>
#include <new>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>

#include "options.hpp"
#include "progress.hpp"

namespace {

using cumulet::demo::OutputFormat;
using cumulet::demo::Progress;
using cumulet::demo::RenderOptions;
using cumulet::headless::Backend;
using cumulet::headless::Context;
using Json = nlohmann::ordered_json;

// A signal handler can reach nothing but a global.
volatile std::sig_atomic_t interrupted = 0;

extern "C" void on_signal(int) { interrupted = 1; }

/// The first Ctrl-C asks us to finish, the second ends us.
void catch_signals() {
  struct sigaction action {};
  action.sa_handler = on_signal;
  action.sa_flags = static_cast<int>(SA_RESETHAND | SA_RESTART);
  for (const int signal : {SIGINT, SIGTERM}) {
    struct sigaction old {};
    // A shell's background job, or nohup's, ignores the signal: it shall stay ignored.
    if (sigaction(signal, nullptr, &old) == 0 && old.sa_handler == SIG_IGN) continue;
    sigaction(signal, &action, nullptr);
  }
  // A file that outgrows its limit is a failed write with a cause, not the end of the process.
  std::signal(SIGXFSZ, SIG_IGN);
}

std::string one_line(std::string text) {
  for (char& c : text)
    if (c == '\n' || c == '\r') c = ' ';
  return text;
}

void print_log(void* user, cumulet_log_level level, const char* message) {
  if (level < CUMULET_LOG_WARNING) return;
  static_cast<Progress*>(user)->clear();
  std::fprintf(stderr, "%s: %s\n", level == CUMULET_LOG_WARNING ? "warning" : "error", one_line(message).c_str());
}

struct DestroyViewer {
  void operator()(cumulet_viewer* viewer) const { cumulet_destroy(viewer); }
};
using Viewer = std::unique_ptr<cumulet_viewer, DestroyViewer>;

Viewer create_viewer(Context& context, Progress& progress) {
  cumulet_create_desc desc{};
  desc.struct_size = sizeof desc;
  desc.get_proc = Context::get_proc;
  desc.get_proc_user = &context;
  desc.log = print_log;
  desc.log_user = &progress;
  cumulet_viewer* viewer = nullptr;
  std::array<char, 1024> error{};
  if (cumulet_create(&desc, &viewer, error.data(), error.size()) != CUMULET_OK)
    throw std::runtime_error(std::string(context.name()) + ": " + error.data());
  return Viewer(viewer);
}

void check(const Viewer& viewer, cumulet_status status) {
  if (status == CUMULET_OK) return;
  const std::string cause = cumulet_last_error(viewer.get());
  throw std::runtime_error(cause.empty() ? "status " + std::to_string(status) : cause);
}

void check_not_interrupted() {
  if (interrupted) throw std::runtime_error("interrupted before the first sample: nothing is written");
}

Backend backend_of(cumulet::demo::BackendChoice choice) {
  switch (choice) {
    case cumulet::demo::BackendChoice::egl:
      return Backend::egl;
    case cumulet::demo::BackendChoice::osmesa:
      return Backend::osmesa;
    case cumulet::demo::BackendChoice::automatic:
      break;
  }
  return Backend::automatic;
}

const char* march_name(cumulet_march march) {
  switch (march) {
    case CUMULET_MARCH_DENSE:
      return "dense";
    case CUMULET_MARCH_BRICK:
      return "brick";
    case CUMULET_MARCH_TET:
      break;
  }
  return "tet";
}

cumulet_stats stats_of(const Viewer& viewer) {
  cumulet_stats stats{};
  stats.struct_size = sizeof stats;
  check(viewer, cumulet_get_stats(viewer.get(), &stats));
  return stats;
}

void write_picture(const Viewer& viewer, const RenderOptions& options) {
  cumulet::image::Image image{options.scene.image.width, options.scene.image.height, {}};
  image.rgba.resize(std::size_t{4} * image.width * image.height);
  check(viewer, cumulet_read_linear(viewer.get(), image.rgba.data(), image.rgba.size()));
  switch (options.format) {
    case OutputFormat::png: {
      cumulet::image::PngOptions png;
      png.exposure_stops = options.exposure_stops;
      // The other views' colours are a legend, not light.
      if (options.scene.image.view != CUMULET_VIEW_SHADED) png.tone_mapping = cumulet::image::ToneMapping::none;
      cumulet::image::write_png(options.output, image, png);
      break;
    }
    case OutputFormat::exr:
      cumulet::image::write_exr(options.output, image);
      break;
    case OutputFormat::pfm:
      cumulet::image::write_pfm(options.output, image);
      break;
  }
}

/// The names and units are scripted against: design.md, section 6. What does not apply is left out.
void write_stats(const RenderOptions& options, const cumulet_stats& stats, const char* backend) {
  const bool tet = options.scene.grid.march == CUMULET_MARCH_TET;
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
  add_stage("records", stats.build_seconds_records);
  add_stage("upload", stats.build_seconds_upload);
  json["trace_seconds"] = stats.trace_seconds;
  json["samples"] = stats.samples;
  if (stats.trace_seconds > 0.0) json["samples_per_second"] = static_cast<double>(stats.samples) / stats.trace_seconds;
  if (stats.samples > 0)
    json["mean_steps_per_path"] = static_cast<double>(stats.steps) / static_cast<double>(stats.samples);
  rusage usage{};
  if (getrusage(RUSAGE_SELF, &usage) == 0)
    json["peak_rss_bytes"] = static_cast<std::uint64_t>(usage.ru_maxrss) * 1024;  // Linux counts in KiB
  json["gl"] = {{"vendor", stats.gl_vendor}, {"renderer", stats.gl_renderer}, {"version", stats.gl_version}};
  json["backend"] = backend;
  json["march"] = march_name(options.scene.grid.march);
  if (tet) json["cells_mode"] = options.scene.grid.cells == CUMULET_CELLS_CONSTANT ? "constant" : "linear";
  // A driver's name may be in any encoding: what is not UTF-8 is replaced, not thrown at.
  cumulet::image::replace_file(options.stats, json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n");
}

void render(const RenderOptions& options) {
  // Hours of samples should not end at a folder that is not there.
  cumulet::image::check_writable(options.output);
  if (!options.stats.empty()) cumulet::image::check_writable(options.stats);
  catch_signals();

  Progress progress;
  progress.stage("loading " + options.scene.volume);
  Context context = Context::create(backend_of(options.backend));
  const Viewer viewer = create_viewer(context, progress);
  const char* grid_name = options.scene.grid_name.empty() ? nullptr : options.scene.grid_name.c_str();
  check(viewer, cumulet_load_volume(viewer.get(), options.scene.volume.c_str(), grid_name));
  check_not_interrupted();
  check(viewer, cumulet_set_grid(viewer.get(), &options.scene.grid));
  check(viewer, cumulet_set_medium(viewer.get(), &options.scene.medium));
  check(viewer, cumulet_set_light(viewer.get(), &options.scene.light));
  check(viewer, cumulet_set_camera(viewer.get(), &options.scene.camera));
  check(viewer, cumulet_set_image(viewer.get(), &options.scene.image));

  progress.stage("building the grid");
  check(viewer, cumulet_build(viewer.get()));
  check_not_interrupted();

  const auto& image = options.scene.image;
  const double total = static_cast<double>(image.width) * image.height * image.samples;
  constexpr double budget_ms = 200.0;  // how often the bar moves, and how long Ctrl-C may take
  std::uint32_t flags = 0;
  double part = 0.0;
  progress.render(part, total);
  while (!interrupted && (flags & CUMULET_RENDER_CONVERGED) == 0) {
    check(viewer, cumulet_render(viewer.get(), budget_ms, &flags, &part));
    progress.render(part, total);
  }
  const bool complete = (flags & CUMULET_RENDER_CONVERGED) != 0;
  if (!complete && part <= 0.0) check_not_interrupted();

  progress.stage("writing " + options.output);
  write_picture(viewer, options);
  const cumulet_stats stats = stats_of(viewer);
  if (!options.stats.empty()) write_stats(options, stats, context.name());
  if (!complete) {
    std::array<char, 128> text{};
    std::snprintf(text.data(), text.size(), "%llu of %.0f samples", static_cast<unsigned long long>(stats.samples),
                  total);
    throw std::runtime_error(options.output + ": interrupted: holds the first " + text.data());
  }
}

int fail(const std::string& message, int status) {
  std::fprintf(stderr, "cumulet-render: %s\n", one_line(message).c_str());
  return status;
}

}  // namespace

int main(int argc, char** argv) try {
  const auto options = cumulet::demo::parse_render_options({argv + std::min(argc, 1), argv + argc}, std::cout);
  if (options) render(*options);
  std::cout.flush();
  return std::cout.good() ? 0 : fail("standard output: cannot be written", 1);
} catch (const cumulet::demo::UsageError& error) {
  return fail(std::string(error.what()) + " (see --help)", 2);
} catch (const std::bad_alloc&) {
  return fail("out of memory", 1);
} catch (const std::exception& error) {
  return fail(error.what(), 1);
}
