// cumulet-render: renders an image of a volume, or images of a sequence of volumes.

#include <cumulet/cumulet.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <file.hpp>
#include <filesystem>
#include <headless.hpp>
#include <image.hpp>
#include <iostream>
#include <memory>
#include <optional>
#include <program.hpp>
#include <stdexcept>
#include <string>
#include <timeline.hpp>
#include <utility>
#include <vector>

#include "aovs.hpp"
#include "auto_exposure.hpp"
#include "checkpoint.hpp"
#include "cube_lut.hpp"
#include "default_medium.hpp"
#include "denoised.hpp"
#include "early_pictures.hpp"
#include "fire_look.hpp"
#include "first_view.hpp"
#include "frame_plan.hpp"
#include "frame_report.hpp"
#include "info.hpp"
#include "instances.hpp"
#include "memory.hpp"
#include "messages.hpp"
#include "models.hpp"
#include "ocio_lut.hpp"
#include "options.hpp"
#include "picture.hpp"
#include "progress.hpp"
#include "ramps.hpp"
#include "render_viewer.hpp"
#include "settled.hpp"
#include "stats.hpp"
#include "time_limit.hpp"
#include "tiny_objects.hpp"
#include "tracing.hpp"
#include "transforms.hpp"
#include "up_axis.hpp"

namespace {

using cumulet::demo::AutoExposure;
using cumulet::demo::check;
using cumulet::demo::check_not_interrupted;
using cumulet::demo::Checkpoint;
using cumulet::demo::EarlyPictures;
using cumulet::demo::FireLook;
using cumulet::demo::fits;
using cumulet::demo::forget_checkpoint;
using cumulet::demo::FramePlan;
using cumulet::demo::FrameState;
using cumulet::demo::interrupted;
using cumulet::demo::one_line;
using cumulet::demo::OutputFormat;
using cumulet::demo::PlannedFrame;
using cumulet::demo::print_line;
using cumulet::demo::Progress;
using cumulet::demo::RenderOptions;
using cumulet::demo::SceneOptions;
using cumulet::demo::stats_of;
using cumulet::demo::Timeline;
using cumulet::demo::Traced;
using cumulet::demo::Viewer;
using cumulet::demo::volume_of;
using cumulet::demo::wait;
using cumulet::headless::Backend;
using cumulet::headless::Context;

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

/// Returns the settings of the loaded surfaces: checks the animation and resolves the name of the material variant.
cumulet_surface_settings_desc surface_settings(const Viewer& viewer, const SceneOptions& scene) {
  cumulet_surfaces* surfaces = nullptr;
  check(viewer, cumulet_get_surfaces(viewer.get(), &surfaces));
  cumulet_surfaces_info info{};
  info.struct_size = sizeof info;
  const cumulet_status status = cumulet_surfaces_get_info(surfaces, &info);
  const std::vector<std::string> variants = cumulet::demo::variant_names(surfaces);
  cumulet_surfaces_release(surfaces);
  check(viewer, status);
  const std::string refusal =
      cumulet::demo::animation_refusal(scene.surfaces, scene.surface.animation, info.animations);
  if (!refusal.empty()) throw std::runtime_error(refusal);
  cumulet_surface_settings_desc settings = scene.surface;
  settings.variant = cumulet::demo::variant_number(scene.surfaces, scene.surface_variant, variants);
  return settings;
}

/// Fails before rendering instead of after it.
void check_memory(const Viewer& viewer, const RenderOptions& options) {
  cumulet::demo::check_memory(options, stats_of(viewer).gl_renderer, cumulet::demo::available_memory());
}

using Clock = std::chrono::steady_clock;

void print_ending(const RenderOptions& options, Traced traced, double measured, double samples, double seconds,
                  Progress& progress) {
  using cumulet::demo::Ending;
  // The margin covers the library's single-precision sums.
  const double target = 0.01 * 1.0001 * options.scene.sampling.noise_target_percent;
  const auto noise = std::isfinite(measured) ? std::optional(measured) : std::nullopt;
  Ending ending = target > 0.0 && noise && *noise <= target ? Ending::noise : Ending::samples;
  if (traced == Traced::late) ending = Ending::time;
  print_line(progress,
             options.output + ": " +
                 cumulet::demo::ending_line(ending, noise, samples, options.scene.sampling.noise_target_percent,
                                            options.time_limit, seconds));
}

/// Returns the denoiser of the options. Logs if there is no network for it.
cumulet::demo::Denoiser denoiser_of(const RenderOptions& options, Progress& progress) {
  if (options.denoise != cumulet::demo::Denoise::high) return {};
  std::string note;
  cumulet::demo::Denoiser denoiser = cumulet::demo::find_denoiser(options.denoiser, options.oidn_library, note);
  if (!note.empty()) print_line(progress, note);
  return denoiser;
}

/// Viewer and scene shared by all images: everything except the volume.
class Studio {
 public:
  explicit Studio(const RenderOptions& options)
      : fire_look_(options.default_look),
        exposure_(options),
        denoiser_(denoiser_of(options, progress_)),
        context_(
            (progress_.stage("loading " + first_file(options.scene)), Context::create(backend_of(options.backend)))),
        viewer_(cumulet::demo::create_viewer(context_, messages_, options.trace.empty() ? nullptr : &timeline_,
                                             options.shader_cache, options.shaders)) {
    check_memory(viewer_, options);
    set_scene(options);
  }

  [[nodiscard]] Progress& progress() { return progress_; }
  [[nodiscard]] const Viewer& viewer() const { return viewer_; }
  [[nodiscard]] const FireLook& fire_look() const { return fire_look_; }
  [[nodiscard]] AutoExposure& exposure() { return exposure_; }
  [[nodiscard]] double seconds() const { return seconds_since(start_); }

  /// Loads the scene's volume and everything else, and waits for it. frame: the frame of a sequence, or null. Throws
  /// the cause of a failure.
  void load(const SceneOptions& scene, const PlannedFrame* frame = nullptr) {
    const auto next = frame != nullptr ? frame->next : std::nullopt;
    if (scene.is_shown()) {
      progress_.stage("loading " + scene.volume);
      cumulet_volume_file_desc file = cumulet::demo::volume_file(scene);
      file.suggested_density_scale = scene.auto_density_scale ? 1 : 0;
      file.log = cumulet::demo::Messages::print, file.log_user = &messages_;
      if (next) {
        load_both(scene, file, *next);
      } else if (!cumulet::demo::show_by_default(viewer_, scene, file)) {
        check(viewer_, cumulet_load_volume_file(viewer_.get(), &file));
      }
    }
    wait(viewer_, progress_);
    if (frame != nullptr) {
      others_.go_to(frame->seconds);
      choose_in_surfaces(scene);
    }
    open_others(scene);
    open_models(scene);
    look_ = cumulet::demo::default_medium(viewer_, scene);
    if (look_) check(viewer_, cumulet_set_medium(viewer_.get(), &look_->medium));
    if (look_ && look_->content == cumulet::demo::Content::fire) fire_look_.take(viewer_, scene);
    wait(viewer_, progress_);
    if (others_.plays()) cumulet_cancel(viewer_.get());  // stops reading ahead in sequences
  }

  /// Logs the hints about a loaded volume. Call once.
  void remark(const SceneOptions& scene) {
    if (scene.is_shown() && scene.auto_density_scale)
      cumulet::demo::print_density_scale(viewer_, !scene.ramps[CUMULET_RAMP_DENSITY].empty(), progress_);
    if (look_) cumulet::demo::print_medium(*look_, progress_);
    fire_look_.print_light(progress_);
    if (!fits(scene.camera) || scene.surface_camera >= 0) return;
    const auto boxes = cumulet::demo::placed_boxes(viewer_.get(), scene, others_, models_);
    for (const std::string& line : cumulet::demo::remarks_on_tiny(boxes)) print_line(progress_, line);
  }

  /// Applies the settings that need the loaded surfaces: time, material variant and camera.
  void choose_in_surfaces(const SceneOptions& scene) {
    if (!scene.surfaces.empty()) {
      const cumulet_surface_settings_desc settings = surface_settings(viewer_, scene);
      check(viewer_, cumulet_set_surface_settings(viewer_.get(), &settings));
      wait(viewer_, progress_);
    }
    if (scene.surface_camera >= 0)
      check(viewer_, cumulet_use_surface_camera(viewer_.get(), static_cast<std::uint32_t>(scene.surface_camera)));
  }

  /// Renders all samples, resuming from a checkpoint if there is one.
  Traced trace(const RenderOptions& options, const std::optional<Checkpoint>& from, EarlyPictures early) {
    cumulet::demo::warm_up(viewer_, options, progress_);
    const auto start = Clock::now();
    const Traced traced = cumulet::demo::trace(viewer_, options, from, progress_, [&] {
      if (!early.due(seconds())) return;
      write_early(options);
      early.written(seconds());
    });
    traced_seconds_ = seconds_since(start);
    return traced;
  }

  /// Throws unless the traced volume is the interpolated one. The library may substitute another frame.
  void require_drawn(const PlannedFrame::Next& next) const {
    cumulet_sequence_info info{};
    info.struct_size = sizeof info;
    check(viewer_, cumulet_get_sequence_info(viewer_.get(), &info, nullptr, 0));
    const double position = static_cast<double>(next.part) / next.parts;
    if (info.is_displayed == 0 || std::abs(info.displayed_position - position) > 0.5 / next.parts)
      throw std::runtime_error(next.volume + ": the interpolated frame before it could not be built");
  }

  void write(const RenderOptions& options) {
    const std::vector<float> denoised = cumulet::demo::denoise(viewer_, options, denoiser_, progress_);
    progress_.stage("writing " + options.output);
    // The image is written last: if it exists, the other files do too.
    if (!options.stats.empty()) {
      double noise = 0.0;  // stats.noise is the last measured value, so measure now
      check(viewer_, cumulet_measure_noise(viewer_.get(), &noise));
      cumulet::demo::write_stats(options, viewer_, context_.name());
    }
    write_exposed(options, denoised);
    exposure_.print(options.output, progress_);
  }

  /// Writes a checkpoint, so that another run can continue after the time limit.
  void keep_samples(const RenderOptions& options) { cumulet::demo::try_to_keep(viewer_, options, progress_); }

  /// Logs the result of the written image. always: even without a noise target or time limit. Throws if rendering was
  /// interrupted.
  void print_result(const RenderOptions& options, Traced traced, bool always) {
    double noise = 0.0;
    if (always) check(viewer_, cumulet_measure_noise(viewer_.get(), &noise));
    const cumulet_stats stats = stats_of(viewer_);
    const cumulet_sampling_desc& sampling = options.scene.sampling;
    const cumulet::image::Windows windows =
        cumulet::demo::windows_of(sampling.region, options.scene.width, options.scene.height);
    const double pixels = static_cast<double>(windows.width) * windows.height;
    if (traced == Traced::stopped) {
      std::array<char, 128> text{};
      std::snprintf(text.data(), text.size(), "%llu of %.0f samples", static_cast<unsigned long long>(stats.samples),
                    pixels * sampling.samples);
      throw std::runtime_error(options.output + ": interrupted: contains the first " + text.data());
    }
    if (always || options.time_limit || sampling.noise_target_percent > 0.0f)
      print_ending(options, traced, stats.noise, static_cast<double>(stats.samples) / pixels, traced_seconds_,
                   progress_);
  }

  void write_trace(const RenderOptions& options) const {
    if (!options.trace.empty()) cumulet::image::replace_file(options.trace, timeline_.json());
  }

 private:
  static double seconds_since(Clock::time_point start) {
    return std::chrono::duration<double>(Clock::now() - start).count();
  }

  void write_exposed(const RenderOptions& options, const std::vector<float>& denoised) {
    const RenderOptions lit = fire_look_.shown(options);
    exposure_.measure(viewer_, lit.scene, lit.scene.display, denoised);
    cumulet::demo::write_picture(viewer_, exposure_.shown(lit), others_, denoised, progress_);
  }

  /// Writes the image so far. A failure is logged, because the disk may have space at the end.
  void write_early(const RenderOptions& options) {
    try {
      const std::vector<float> denoised = cumulet::demo::denoise(viewer_, options, denoiser_, progress_);
      write_exposed(options, denoised);
    } catch (const std::exception& error) {
      print_line(progress_, std::string("warning: the image so far was not written: ") + error.what());
    }
  }

  static const std::string& first_file(const SceneOptions& scene) {
    if (!scene.volume.empty()) return scene.volume;
    if (!scene.others.empty()) return scene.others.front().volume;
    return scene.surfaces.empty() && !scene.models.empty() ? scene.models.front().file : scene.surfaces;
  }

  void set_between(const SceneOptions& scene, const cumulet_volume_file_desc& file, const PlannedFrame::Next& next) {
    constexpr std::uint64_t what_it_takes = std::uint64_t{1} << 40U;
    cumulet_playback_desc playback = scene.sequence.playback;
    cumulet::settings::spell_out_zeros(playback);
    playback.frames_per_second /= next.frames;
    playback.first_frame = 0;
    playback.frame_count = 0;
    playback.subframes = next.parts;
    if (playback.interpolation == CUMULET_FRAME_INTERPOLATION_NONE)
      playback.interpolation = CUMULET_FRAME_INTERPOLATION_ADVECT;
    const auto sequence = cumulet::demo::open_sequence({scene.volume, next.volume}, file, what_it_takes);
    const double position = static_cast<double>(next.part) / next.parts;
    if (cumulet_sequence_set_playback(sequence.get(), &playback) != CUMULET_OK ||
        cumulet_sequence_set_frame(sequence.get(), position) != CUMULET_OK) {
      throw std::runtime_error(scene.volume + ": invalid playback settings");
    }
    check(viewer_, cumulet_set_sequence(viewer_.get(), sequence.get()));
  }

  /// Holds back the library's messages until both files are read: its warning that another frame is substituted does
  /// not apply, because this program fails instead.
  void load_both(const SceneOptions& scene, const cumulet_volume_file_desc& file, const PlannedFrame::Next& next) {
    const auto print = [this](const std::string& failure) {
      for (const std::string& line : messages_.release(failure)) print_line(progress_, line);
    };
    messages_.hold();
    try {
      set_between(scene, file, next);
      wait(viewer_, progress_);
      require_both();
    } catch (const std::runtime_error& error) {
      print(error.what());
      throw;
    }
    print("");
  }

  /// Throws if one of the two frames cannot be read. Stops reading ahead first.
  void require_both() const {
    cumulet_cancel(viewer_.get());
    for (const std::uint32_t frame : {0U, 1U}) {
      std::array<char, 1024> cause{};
      check(viewer_, cumulet_get_sequence_frame(viewer_.get(), frame, cause.data(), cause.size()));
      if (cause.front() != '\0') throw std::runtime_error(cause.data());
    }
  }

  void open_others(const SceneOptions& scene) {
    for (const cumulet::demo::VolumeFile& file : others_.missing(scene.others)) {
      progress_.stage("loading " + file.volume);
      const bool shown = scene.is_shown() && file == static_cast<const cumulet::demo::VolumeFile&>(scene);
      others_.give(file, shown ? cumulet::demo::look_into(volume_of(viewer_), file)
                               : cumulet::demo::open_volume(file, cumulet::demo::Messages::print, &messages_));
      check_not_interrupted();
    }
    others_.show(viewer_.get(), scene.others);
  }

  void open_models(const SceneOptions& scene) {
    for (const std::string& file : models_.missing(scene.models)) {
      progress_.stage("loading " + file);
      cumulet_surfaces* own = nullptr;
      if (file == scene.surfaces) check(viewer_, cumulet_get_surfaces(viewer_.get(), &own));
      models_.give(file, own != nullptr
                             ? cumulet::demo::SurfacesPtr(own, cumulet_surfaces_release)
                             : cumulet::demo::open_surfaces(file, cumulet::demo::Messages::print, &messages_));
      check_not_interrupted();
    }
    models_.show(viewer_.get(), scene.models);
  }

  void set_display_lut(const RenderOptions& options) {
    const cumulet::demo::OcioView& ocio = options.scene.ocio;
    // The other formats store linear radiance.
    if (options.format != OutputFormat::png || (options.lut.empty() && ocio.config.empty())) return;
    std::string note;
    cumulet::demo::DisplayLut lut =
        options.lut.empty() ? cumulet::demo::bake_ocio_view(ocio, &note) : cumulet::demo::read_cube_lut(options.lut);
    if (!options.lut.empty()) lut.shaper = options.lut_shaper;
    if (!note.empty()) cumulet::demo::Messages::print(&messages_, CUMULET_LOG_INFO, note.c_str());
    const cumulet_display_lut_desc desc = cumulet::demo::desc_of(lut);
    check(viewer_, cumulet_set_display_lut(viewer_.get(), &desc));
  }

  void set_scene(const RenderOptions& options) {
    const auto& scene = options.scene;
    cumulet_limits_desc limits{};
    limits.struct_size = sizeof limits;
    limits.gl_bytes = options.gpu_memory;
    check(viewer_, cumulet_set_limits(viewer_.get(), &limits));
    cumulet_sampling_desc sampling = scene.sampling;
    sampling.preview = CUMULET_PREVIEW_OFF;
    if (std::ranges::find(options.aovs, CUMULET_AOV_VOLUME) != options.aovs.end()) sampling.separate_volume_aov = 1;
    if (options.format == OutputFormat::exr)
      sampling.light_groups = static_cast<std::uint32_t>(scene.light_groups.size());
    check(viewer_, cumulet_set_grid(viewer_.get(), &scene.grid));
    check(viewer_, cumulet_set_medium(viewer_.get(), &scene.medium));
    check(viewer_, cumulet::demo::set_ramps(viewer_.get(), scene));
    const cumulet_clip_desc clip = cumulet::settings::clip_desc_of(scene.clip);
    check(viewer_, cumulet_set_clip(viewer_.get(), &clip));
    // The ground is set first, because the sky is computed for it.
    check(viewer_, cumulet_set_ground(viewer_.get(), &scene.ground));
    check(viewer_, cumulet_set_sun_sky(viewer_.get(), &scene.light));
    check(viewer_, cumulet_set_lights(viewer_.get(), scene.analytic_lights.data(), scene.analytic_lights.size()));
    check(viewer_, set_transforms(viewer_.get(), scene));
    if (!scene.environment.empty()) {
      check(viewer_, cumulet_load_environment(viewer_.get(), scene.environment.c_str()));
      check(viewer_, cumulet_set_environment_settings(viewer_.get(), &scene.environment_settings));
    }
    const double rate = scene.sequence.playback.frames_per_second;
    constexpr double usual_rate = 24.0;
    check(viewer_, cumulet_set_previous_camera(viewer_.get(), nullptr, 1.0 / (rate > 0.0 ? rate : usual_rate)));
    check(viewer_, cumulet_set_sampling(viewer_.get(), &sampling));
    cumulet_display_desc display = scene.display;
    display.denoise = CUMULET_DENOISE_OFF;  // the image is read without denoising, and denoised separately
    check(viewer_, cumulet_set_display(viewer_.get(), &display));
    set_display_lut(options);
    cumulet::demo::show_camera(viewer_, scene);
    if (!scene.models.empty()) check(viewer_, cumulet_set_surface_settings(viewer_.get(), &scene.surface));
    if (!scene.surfaces.empty()) {
      check(viewer_, cumulet_set_surface_settings(viewer_.get(), &scene.surface));
      check(viewer_, cumulet_load_surfaces(viewer_.get(), scene.surfaces.c_str()));
    }
  }

  Progress progress_;
  FireLook fire_look_;
  AutoExposure exposure_;
  Clock::time_point start_ = Clock::now();
  double traced_seconds_ = 0.0;
  cumulet::demo::Messages messages_{progress_};
  Timeline timeline_;
  // Looked up first, so that an error is logged before rendering starts.
  cumulet::demo::Denoiser denoiser_;
  std::optional<cumulet::demo::DefaultMedium> look_;  // of fire or smoke, if the scene sets no medium
  Context context_;
  Viewer viewer_;
  cumulet::demo::Instances others_;
  cumulet::demo::Models models_;
};

/// Returns when images are written before the end. Beside other files, the image says that they are complete.
EarlyPictures early_pictures(const RenderOptions& options) {
  constexpr double first_seconds = 10.0;
  const bool alone = options.checkpoint.empty() && options.stats.empty() && options.trace.empty();
  return EarlyPictures(options.format == OutputFormat::png && alone ? std::optional(first_seconds) : std::nullopt);
}

/// Places the camera if the scene has none.
void place_camera(const Viewer& viewer, const RenderOptions& options) {
  if (!fits(options.scene.camera) || options.scene.surface_camera >= 0) return;
  cumulet::demo::draw_without_samples(viewer, options);  // the library places it
  cumulet::demo::turn_to_first_view(viewer.get());
}

void render(RenderOptions options) {
  cumulet::image::check_writable(options.output);
  if (!options.stats.empty()) cumulet::image::check_writable(options.stats);
  if (!options.trace.empty()) cumulet::image::check_writable(options.trace);
  const std::optional<Checkpoint> from = cumulet::demo::checkpoint_for(options);
  cumulet::demo::catch_signals();
  Studio studio(options);
  studio.load(options.scene);
  studio.remark(options.scene);
  studio.choose_in_surfaces(options.scene);
  place_camera(studio.viewer(), options);
  if (options.whole_seconds)
    options.time_limit = cumulet::demo::sampling_seconds(*options.whole_seconds, studio.seconds());
  const Traced traced = studio.trace(options, from, early_pictures(options));
  if (traced == Traced::stopped && !options.checkpoint.empty())
    throw std::runtime_error(options.output + ": interrupted: run the same command to resume from " +
                             options.checkpoint);
  studio.write(options);
  if (traced == Traced::late && !options.checkpoint.empty()) {
    studio.keep_samples(options);
  } else {
    forget_checkpoint(options.checkpoint);
  }
  studio.write_trace(options);
  if (options.denoises_by_default && options.denoise != cumulet::demo::Denoise::off)
    print_line(studio.progress(), options.output + ": denoised (--denoise off keeps the samples)");
  studio.print_result(options, traced, true);
}

/// Returns true if none of the settings shared by a sequence's frames has to be derived from a volume.
bool is_settled(const SceneOptions& scene) {
  const bool has_camera = scene.surface_camera >= 0 || !fits(scene.camera);
  const bool heated = scene.is_shown() && scene.temperature_grid != "none" && scene.medium.temperature_scale == 0.0F;
  return has_camera && !heated && !scene.auto_density_scale && !cumulet::demo::is_below(scene.ground.mode);
}

/// Sets the settings that are derived from the loaded volume: density scale, temperature scale, ground height and
/// camera.
void settle(const Viewer& viewer, RenderOptions& options) {
  SceneOptions& scene = options.scene;
  const std::optional<cumulet::demo::DefaultMedium> look = cumulet::demo::default_medium(viewer, scene);
  if (std::exchange(scene.auto_density_scale, false)) {
    double& scale = scene.medium.density_scale;
    if (look) {
      scene.medium = look->medium;
    } else if (cumulet_volume_suggest_density_scale(volume_of(viewer).get(), &scale) != CUMULET_OK) {
      scale = 0.0;  // nothing is visible at any scale
    }
    check(viewer, cumulet_set_medium(viewer.get(), &scene.medium));
  }
  if (scene.is_shown() && scene.medium.temperature_scale == 0.0F) {
    scene.medium.temperature_scale = cumulet::demo::temperature_scale_of(volume_of(viewer).get()).value_or(0.0F);
    check(viewer, cumulet_set_medium(viewer.get(), &scene.medium));
  }
  if (cumulet::demo::is_below(scene.ground.mode)) {
    scene.ground.mode = cumulet::demo::at_height(scene.ground.mode);
    scene.ground.height = cumulet::demo::ground_below(viewer, scene);
    check(viewer, cumulet_set_ground(viewer.get(), &scene.ground));
  }
  place_camera(viewer, options);
  cumulet_camera* camera = nullptr;
  check(viewer, cumulet_get_camera(viewer.get(), &camera));
  const cumulet_status status = cumulet_camera_get(camera, &scene.camera);
  cumulet_camera_release(camera);
  check(viewer, status);
}

/// Creates a studio for the whole sequence, and sets the options shared by all frames.
std::unique_ptr<Studio> open_studio(RenderOptions& options, const FramePlan& plan) {
  const SceneOptions given = options.scene;
  const bool kept = !options.sequence_cache.empty() && !is_settled(given);
  const bool known = kept && cumulet::demo::read_settled(options, plan.analyzed_by);
  if (kept && !known) cumulet::image::check_writable(options.sequence_cache);
  auto studio = std::make_unique<Studio>(options);
  studio->exposure().keep();
  wait(studio->viewer(), studio->progress());
  studio->choose_in_surfaces(options.scene);
  if (known || is_settled(options.scene)) return studio;
  for (const std::string& volume : plan.analyzed_by) {
    SceneOptions probe = options.scene;
    probe.volume = volume;
    const std::string state = cumulet::demo::volume_state(volume);  // before: it may be replaced meanwhile
    try {
      studio->load(probe);
      static_cast<void>(
          cumulet::demo::ground_below(studio->viewer(), probe));  // throws if the volume is empty, to try the next one
    } catch (const std::runtime_error&) {
      check_not_interrupted();
      continue;  // the error is reported when that frame is rendered
    }
    studio->remark(probe);
    settle(studio->viewer(), options);
    studio->fire_look().settle(options.scene);
    if (kept) cumulet::demo::write_settled(options, given, state);
    break;
  }
  return studio;
}

/// Renders a frame: loads its volume, traces, writes.
void render_frame_of(Studio& studio, const RenderOptions& picture, const PlannedFrame& frame,
                     cumulet::demo::FrameReport& report, std::size_t index) {
  const auto start = Clock::now();
  Traced traced = Traced::stopped;
  try {
    const std::optional<Checkpoint> from = cumulet::demo::checkpoint_for(picture);
    studio.load(picture.scene, &frame);
    traced = studio.trace(picture, from, EarlyPictures(std::nullopt));
    if (frame.next && picture.scene.is_shown() && traced != Traced::stopped) studio.require_drawn(*frame.next);
  } catch (const std::runtime_error& error) {
    if (interrupted()) throw std::runtime_error(std::string(error.what()) + ": " + report.not_made(index));
    return report.say(index, FrameState::failed, error.what(), &studio.progress());
  }
  // Nothing is written: the next run would keep the incomplete image.
  if (traced == Traced::stopped) throw std::runtime_error("interrupted: " + report.not_made(index));
  try {
    studio.write(picture);
    forget_checkpoint(picture.checkpoint);
    studio.print_result(picture, traced, false);
  } catch (const std::runtime_error& error) {
    report.say(index, FrameState::failed, error.what(), &studio.progress());
    throw std::runtime_error(std::string(error.what()) + ": " + report.not_made(index));
  }
  std::array<char, 32> seconds{};
  std::snprintf(seconds.data(), seconds.size(), " in %.2f s",
                std::chrono::duration<double>(Clock::now() - start).count());
  report.say(index, FrameState::done, picture.output + seconds.data(), &studio.progress());
}

/// Renders the frames without output one after the other. A missing or corrupt volume fails only its own frame. A write
/// error ends the run, because the next frames would fail too.
void render_frames(RenderOptions options, const FramePlan& plan) {
  if (!options.trace.empty()) cumulet::image::check_writable(options.trace);
  cumulet::demo::catch_signals();
  std::signal(SIGPIPE, SIG_IGN);  // rendering continues if the reader of the status lines exits
  if (!plan.passed_over.empty()) std::fprintf(stderr, "warning: %s\n", one_line(plan.passed_over).c_str());
  std::unique_ptr<Studio> studio;
  cumulet::demo::FrameReport report(plan);
  for (std::size_t i = 0; i < plan.frames.size(); ++i) {
    const PlannedFrame& frame = plan.frames[i];
    if (!options.overwrite && cumulet::demo::is_made(frame.output)) {
      forget_checkpoint(frame.checkpoint);  // left over by a run that was killed
      report.say(i, FrameState::kept, frame.output, studio ? &studio->progress() : nullptr);
      continue;
    }
    cumulet::image::check_writable(frame.output);
    if (!frame.stats.empty()) cumulet::image::check_writable(frame.stats);
    if (!studio) studio = open_studio(options, plan);
    studio->progress().of("frame " + frame.number.text());
    RenderOptions picture = options;
    picture.scene.name = options.scene.label();  // all frames have the name of the sequence
    picture.scene.volume = frame.volume;
    picture.output = frame.output;
    picture.stats = frame.stats;
    picture.checkpoint = frame.checkpoint;
    if (frame.next) picture.scene.sequence.frame = frame.number;  // its files do not identify the frame
    if (!options.given.time) cumulet::demo::set_animation_time(picture.scene, frame.seconds);
    render_frame_of(*studio, picture, frame, report, i);
  }
  if (studio) studio->write_trace(options);
  report.end();
}

}  // namespace

int main(int argc, char** argv) {
  return cumulet::demo::run_program("cumulet-render", [&] {
    auto options = cumulet::demo::parse_render_options({argv + std::min(argc, 1), argv + argc}, std::cout);
    if (!options) return;
    const auto plan = cumulet::demo::plan_frames(*options);
    cumulet::demo::choose_up_axis(*options, plan);
    if (plan) {
      render_frames(*options, *plan);
    } else if (options->info) {
      cumulet::demo::write_info(options->scene, options->json, std::cout);
    } else {
      render(*options);
    }
  });
}
