// cumulet-render: one volume, one picture.

#include <cumulet/cumulet.h>
#include <sys/resource.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <file.hpp>
#include <headless.hpp>
#include <image.hpp>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <program.hpp>
#include <shader_cache.hpp>
#include <stdexcept>
#include <string>
#include <timeline.hpp>

#include "aovs.hpp"
#include "denoised.hpp"
#include "info.hpp"
#include "memory.hpp"
#include "metadata.hpp"
#include "options.hpp"
#include "progress.hpp"

namespace {

using cumulet::demo::one_line;
using cumulet::demo::OutputFormat;
using cumulet::demo::Progress;
using cumulet::demo::RenderOptions;
using cumulet::demo::Timeline;
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

void print_log(void* user, cumulet_log_level level, const char* message) {
  if (level < CUMULET_LOG_WARNING) return;
  static_cast<Progress*>(user)->clear();
  std::fprintf(stderr, "%s: %s\n", level == CUMULET_LOG_WARNING ? "warning" : "error", one_line(message).c_str());
}

struct DestroyViewer {
  void operator()(cumulet_viewer* viewer) const { cumulet_destroy(viewer); }
};
using Viewer = std::unique_ptr<cumulet_viewer, DestroyViewer>;

Viewer create_viewer(Context& context, Progress& progress, Timeline* timeline, const std::string& shader_cache) {
  cumulet_create_desc desc{};
  desc.struct_size = sizeof desc;
  desc.get_proc = Context::get_proc;
  desc.get_proc_user = &context;
  desc.log = print_log;
  desc.log_user = &progress;
  if (timeline != nullptr) {
    desc.trace = Timeline::add;
    desc.trace_user = timeline;
  }
  const auto programs = cumulet::demo::make_programs(shader_cache, {});
  desc.programs = programs.get();
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

void check_not_interrupted() {
  if (interrupted) throw std::runtime_error("interrupted before the first sample: nothing is written");
}

void set_camera(const Viewer& viewer, const cumulet_camera_desc& desc) {
  cumulet_camera* camera = nullptr;
  check(viewer, cumulet_get_camera(viewer.get(), &camera));
  const cumulet_status status = cumulet_camera_set(camera, &desc);
  cumulet_camera_release(camera);
  if (status != CUMULET_OK) throw std::runtime_error("the camera is not usable");
}

/// Until the library's worker is done. Throws its error.
void wait(const Viewer& viewer, Progress& progress) {
  cumulet_progress state{};
  state.struct_size = sizeof state;
  for (;;) {
    const cumulet_status status = cumulet_wait(viewer.get(), 100.0);
    if (status != CUMULET_ERROR_TIMEOUT) return check(viewer, status);
    if (interrupted) {
      cumulet_cancel(viewer.get());
      check_not_interrupted();
    }
    cumulet_get_progress(viewer.get(), &state);
    if (state.stage > CUMULET_STAGE_LOADING) progress.stage("building the grid");
  }
}

void tell(Progress& progress, const std::string& line) {
  progress.clear();
  std::fprintf(stderr, "%s\n", one_line(line).c_str());
}

/// The scale that suits the volume, whatever it is seen from: it was loaded with that.
void tell_density_scale(const Viewer& viewer, bool ramped, Progress& progress) {
  cumulet_volume* volume = nullptr;
  check(viewer, cumulet_get_volume(viewer.get(), &volume));
  double scale = 0.0;
  const cumulet_status status = cumulet_volume_suggest_density_scale(volume, &scale);
  cumulet_volume_release(volume);
  if (status != CUMULET_OK) return;  // nothing to see at any scale
  std::array<char, 32> digits{};
  std::snprintf(digits.data(), digits.size(), "%g", scale);
  tell(progress, std::string("density scale ") + digits.data() + ", for a mean optical depth of 8" +
                     (ramped ? " before the ramp" : "") + " (--density-scale)");
}

cumulet_stats stats_of(const Viewer& viewer) {
  cumulet_stats stats{};
  stats.struct_size = sizeof stats;
  check(viewer, cumulet_get_stats(viewer.get(), &stats));
  return stats;
}

constexpr double budget_ms = 200.0;  // how often the bar moves, and how long Ctrl-C may take

/// Of the time limit, from when it is made on.
class Limit {
 public:
  explicit Limit(const std::optional<double>& seconds) : seconds_(seconds) {}
  [[nodiscard]] double over() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  }
  [[nodiscard]] bool reached() const { return seconds_ && over() >= *seconds_; }
  /// A frame's, so that it ends in time.
  [[nodiscard]] double budget() const {
    return seconds_ ? std::clamp(1e3 * (*seconds_ - over()), least_ms, budget_ms) : budget_ms;
  }

 private:
  static constexpr double least_ms = 5.0;
  std::optional<double> seconds_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

cumulet_frame_desc frame_of(const RenderOptions& options) {
  cumulet_frame_desc frame{};
  frame.struct_size = sizeof frame;
  frame.target = CUMULET_TARGET_NONE;
  frame.width = options.scene.width;
  frame.height = options.scene.height;
  frame.budget_ms = budget_ms;
  return frame;
}

void check_frame(const Viewer& viewer, const RenderOptions& options, cumulet_status status) {
  if (status == CUMULET_ERROR_OUT_OF_MEMORY) {
    throw std::runtime_error(cumulet::demo::needs_text(options) + ": " + cumulet_last_error(viewer.get()));
  }
  check(viewer, status);
}

cumulet_frame_result render_frame(const Viewer& viewer, const RenderOptions& options, double within_ms) {
  cumulet_frame_desc frame = frame_of(options);
  frame.budget_ms = within_ms;
  cumulet_frame_result result{};
  result.struct_size = sizeof result;
  check_frame(viewer, options, cumulet_render(viewer.get(), &frame, &result));
  return result;
}

/// All that the samples need is there before the first of them, so that their times are theirs alone.
void warm_up(const Viewer& viewer, const RenderOptions& options, Progress& progress) {
  const cumulet_frame_desc frame = frame_of(options);
  cumulet_warm_up_result result{};
  result.struct_size = sizeof result;
  do {
    progress.stage("compiling shaders", result.progress);
    check_frame(viewer, options, cumulet_warm_up(viewer.get(), &frame, CUMULET_WARM_UP_SCENE, &result));
    // A camera-adaptive grid is built once the size is known.
    if (result.more != 0) wait(viewer, progress);
    check_not_interrupted();
  } while (result.more != 0);
  progress.stage("compiling shaders", 1.0);
}

void check_animation(const Viewer& viewer, const RenderOptions& options) {
  cumulet_surfaces* surfaces = nullptr;
  check(viewer, cumulet_get_surfaces(viewer.get(), &surfaces));
  cumulet_surfaces_info info{};
  info.struct_size = sizeof info;
  const cumulet_status status = cumulet_surfaces_get_info(surfaces, &info);
  cumulet_surfaces_release(surfaces);
  check(viewer, status);
  const std::string refusal = cumulet::demo::animation_refusal(options.scene, info.animations);
  if (!refusal.empty()) throw std::runtime_error(refusal);
}

/// Better at once than after the samples.
void check_memory(const Viewer& viewer, const RenderOptions& options) {
  cumulet::demo::check_memory(options, stats_of(viewer).gl_renderer, cumulet::demo::available_memory());
}

/// Empty where that is not asked for, or cannot be after all, which is told: hours of samples are worth a picture with
/// noise.
std::vector<float> denoise(const Viewer& viewer, const RenderOptions& options, const std::string& network,
                           Progress& progress) {
  if (options.denoise == cumulet::demo::Denoise::off) return {};
  progress.stage("denoising");
  try {
    return cumulet::demo::denoised(viewer.get(), network, std::size_t{4} * options.scene.width * options.scene.height);
  } catch (const std::exception& error) {
    tell(progress, std::string("not denoised: ") + error.what());
    return {};
  }
}

void write_picture(const Viewer& viewer, const RenderOptions& options, const std::vector<float>& denoised) {
  cumulet::image::Image image{options.scene.width, options.scene.height, {}};
  const std::size_t count = std::size_t{4} * image.width * image.height;
  if (options.format == OutputFormat::png) {
    std::vector<std::uint8_t> bytes(count);
    check(viewer, denoised.empty() ? cumulet_read_display(viewer.get(), bytes.data(), bytes.size())
                                   : cumulet_encode_display(viewer.get(), denoised.data(), bytes.data(), bytes.size()));
    cumulet::image::write_png(options.output, image.width, image.height, bytes);
    return;
  }
  if (options.format == OutputFormat::pfm && !denoised.empty()) {
    image.rgba = denoised;
    cumulet::image::write_pfm(options.output, image);
    return;
  }
  image.rgba.resize(count);
  check(viewer, cumulet_read_linear(viewer.get(), image.rgba.data(), image.rgba.size()));
  if (options.format == OutputFormat::exr) {
    cumulet::demo::write_exr(viewer.get(), options.output, image.width, image.height, {image.rgba, denoised},
                             options.aovs,
                             cumulet::demo::metadata_of(viewer.get(), options.scene, image.width, image.height));
  } else {
    cumulet::image::write_pfm(options.output, image);
  }
}

/// The names and units are scripted against: keys are added, never renamed. What does not apply is left out.
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
  Json& passes = json["pass_seconds"];
  passes["upload"] = stats.pass_seconds_upload;
  passes["host_depth"] = stats.pass_seconds_host_depth;
  passes["surfaces"] = stats.pass_seconds_surfaces;
  passes["trace"] = stats.pass_seconds_trace;
  passes["inspect"] = stats.pass_seconds_inspect;
  passes["display"] = stats.pass_seconds_display;
  json["samples"] = stats.samples;
  if (options.scene.sampling.view == CUMULET_VIEW_SHADED) json["noise"] = stats.noise;
  if (stats.trace_seconds > 0.0) json["samples_per_second"] = static_cast<double>(stats.samples) / stats.trace_seconds;
  if (stats.samples > 0)
    json["mean_steps_per_path"] = static_cast<double>(stats.steps) / static_cast<double>(stats.samples);
  rusage usage{};
  if (getrusage(RUSAGE_SELF, &usage) == 0)
    json["peak_rss_bytes"] = static_cast<std::uint64_t>(usage.ru_maxrss) * 1024;  // Linux counts in KiB
  json["gl"] = {{"vendor", stats.gl_vendor}, {"renderer", stats.gl_renderer}, {"version", stats.gl_version}};
  json["backend"] = backend;
  json["march"] = cumulet::demo::march_name(options.scene.grid.march);
  if (tet) json["cells_mode"] = options.scene.grid.cells == CUMULET_CELLS_CONSTANT ? "constant" : "linear";
  // A driver's name may be in any encoding: what is not UTF-8 is replaced, not thrown at.
  cumulet::image::replace_file(options.stats, json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n");
}

enum class Traced { converged, late, stopped };

/// Until the picture has all it shall have, its time is up, or somebody stops it.
Traced trace(const Viewer& viewer, const RenderOptions& options, Progress& progress) {
  const Limit limit(options.time_limit);
  cumulet_frame_result frame{};
  bool began = false;
  while (!interrupted && (frame.flags & CUMULET_RENDER_CONVERGED) == 0) {
    // A picture with holes is none: it goes on to each pixel's first sample.
    if (frame.width > 0 && limit.reached()) return Traced::late;
    frame = render_frame(viewer, options, limit.budget());
    if ((frame.flags & CUMULET_RENDER_LOADING) != 0) wait(viewer, progress);
    if (frame.width > 0 || frame.progress > 0.0) {
      began = true;
      progress.render(cumulet::demo::part_done(frame.progress, limit.over(), options.time_limit),
                      static_cast<double>(stats_of(viewer).samples));
    }
  }
  if (!began) check_not_interrupted();
  return (frame.flags & CUMULET_RENDER_CONVERGED) != 0 ? Traced::converged : Traced::stopped;
}

void tell_ending(const RenderOptions& options, Traced traced, double noise, double samples, Progress& progress) {
  using cumulet::demo::Ending;
  // The library's sums are in single precision. Of one sample a pixel no noise is known.
  const double target = 0.01 * 1.0001 * options.scene.sampling.noise_target_percent;
  Ending ending = target > 0.0 && samples >= 2.0 && noise <= target ? Ending::noise : Ending::samples;
  if (traced == Traced::late) ending = Ending::time;
  tell(progress, options.output + ": " +
                     cumulet::demo::ending_line(ending, noise, samples, options.scene.sampling.noise_target_percent,
                                                options.time_limit));
}

/// The network to denoise by; "": none is asked for, or there is none, which is told.
std::string network_of(const RenderOptions& options, Progress& progress) {
  if (options.denoise != cumulet::demo::Denoise::high) return "";
  try {
    return cumulet::demo::find_network(options.denoiser);
  } catch (const std::exception& error) {
    tell(progress, std::string("denoised by --denoise fast: ") + error.what());
    return "";
  }
}

void render(const RenderOptions& options) {
  cumulet::image::check_writable(options.output);
  if (!options.stats.empty()) cumulet::image::check_writable(options.stats);
  if (!options.trace.empty()) cumulet::image::check_writable(options.trace);
  catch_signals();

  Progress progress;
  // At once, not after hours of samples.
  const std::string network = network_of(options, progress);
  progress.stage("loading " + (options.scene.volume.empty() ? options.scene.surfaces : options.scene.volume));
  Context context = Context::create(backend_of(options.backend));
  Timeline timeline;
  const Viewer viewer =
      create_viewer(context, progress, options.trace.empty() ? nullptr : &timeline, options.shader_cache);
  check_memory(viewer, options);
  const auto& scene = options.scene;
  cumulet_sampling_desc sampling = scene.sampling;
  sampling.preview = CUMULET_PREVIEW_OFF;
  if (std::ranges::find(options.aovs, CUMULET_AOV_VOLUME) != options.aovs.end()) sampling.volume_alone = 1;
  check(viewer, cumulet_set_grid(viewer.get(), &scene.grid));
  check(viewer, cumulet_set_medium(viewer.get(), &scene.medium));
  for (std::size_t i = 0; i < scene.ramps.size(); ++i) {
    const auto& points = scene.ramps[i];
    check(viewer, cumulet_set_ramp(viewer.get(), static_cast<cumulet_ramp>(i), cumulet::settings::numbers_of(points),
                                   points.size()));
  }
  // A sky is computed for the ground that there is.
  check(viewer, cumulet_set_ground(viewer.get(), &scene.ground));
  check(viewer, cumulet_set_light(viewer.get(), &scene.light));
  check(viewer, cumulet_set_lamps(viewer.get(), scene.lamps.data(), scene.lamps.size()));
  if (!scene.environment.empty()) {
    check(viewer, cumulet_load_environment(viewer.get(), scene.environment.c_str()));
    check(viewer, cumulet_set_environment_settings(viewer.get(), &scene.environment_settings));
  }
  check(viewer, cumulet_set_sampling(viewer.get(), &sampling));
  cumulet_display_desc display = scene.display;
  display.denoise = CUMULET_DENOISE_OFF;  // what is read is read as it is, and denoised beside that
  check(viewer, cumulet_set_display(viewer.get(), &display));
  set_camera(viewer, scene.camera);
  if (!scene.surfaces.empty()) {
    check(viewer, cumulet_set_surface_settings(viewer.get(), &scene.surface));
    check(viewer, cumulet_load_surfaces(viewer.get(), scene.surfaces.c_str()));
  }
  if (!scene.volume.empty()) {
    cumulet_volume_file_desc file = cumulet::demo::volume_file(scene);
    file.suggested_density_scale = scene.auto_density_scale ? 1 : 0;
    check(viewer, cumulet_load_volume_file(viewer.get(), &file));
  }
  wait(viewer, progress);
  if (const auto hint = cumulet::demo::up_hint(scene)) tell(progress, *hint);
  if (!scene.volume.empty() && scene.auto_density_scale)
    tell_density_scale(viewer, !scene.ramps[CUMULET_RAMP_DENSITY].empty(), progress);
  if (!scene.surfaces.empty()) check_animation(viewer, options);
  if (scene.surface_camera >= 0)
    check(viewer, cumulet_use_surface_camera(viewer.get(), static_cast<std::uint32_t>(scene.surface_camera)));

  warm_up(viewer, options, progress);
  const Traced traced = trace(viewer, options, progress);

  const std::vector<float> denoised = denoise(viewer, options, network, progress);
  progress.stage("writing " + options.output);
  write_picture(viewer, options, denoised);
  const cumulet_stats stats = stats_of(viewer);  // of the picture that was read back
  if (!options.stats.empty()) write_stats(options, stats, context.name());
  if (!options.trace.empty()) cumulet::image::replace_file(options.trace, timeline.json());
  const double pixels = static_cast<double>(scene.width) * scene.height;
  if (traced == Traced::stopped) {
    std::array<char, 128> text{};
    std::snprintf(text.data(), text.size(), "%llu of %.0f samples", static_cast<unsigned long long>(stats.samples),
                  pixels * sampling.samples);
    throw std::runtime_error(options.output + ": interrupted: holds the first " + text.data());
  }
  if (options.time_limit || sampling.noise_target_percent > 0.0f)
    tell_ending(options, traced, stats.noise, static_cast<double>(stats.samples) / pixels, progress);
}

}  // namespace

int main(int argc, char** argv) {
  return cumulet::demo::run_program("cumulet-render", [&] {
    const auto options = cumulet::demo::parse_render_options({argv + std::min(argc, 1), argv + argc}, std::cout);
    if (!options) return;
    if (options->info) {
      cumulet::demo::write_info(options->scene, options->json, std::cout);
    } else {
      render(*options);
    }
  });
}
