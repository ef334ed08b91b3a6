// The viewer of the C ABI: checks arguments, converts descriptors and catches exceptions.

#include <array>
#include <limits>

#include "base/library_thread.hpp"
#include "base/murmur_hash.hpp"
#include "render/film/mattes.hpp"
#include "settings/aov_table.hpp"
#include "viewer/c_lights.hpp"
#include "viewer/c_settings.hpp"
#include "viewer/c_viewer.hpp"

namespace {

using namespace cumulet::c_abi;
namespace core = cumulet::viewer;
namespace render = cumulet::render;

constexpr double unknown_noise = std::numeric_limits<double>::infinity();

void require_bool(std::int32_t value, const char* what) { require(value == 0 || value == 1, what); }

std::vector<cumulet::scene::InstanceTransform> transforms_of(const double* to_world, uint32_t count) {
  const std::span<const double> values = array_of(to_world, count, 16, "transforms");
  std::vector<cumulet::scene::InstanceTransform> transforms(count);
  for (size_t i = 0; i < count; ++i) {
    transforms[i].to_world = matrix_or_identity(values.subspan(16 * i).first<16>());
    require_transform(transforms[i].to_world, "transform " + std::to_string(i) + ": ");
  }
  return transforms;
}

// Default format of the viewer's own target texture.
GLenum format_for(render::ColorEncoding encoding) {
  if (encoding == render::ColorEncoding::hdr) return GL_RGBA16F;
  return encoding == render::ColorEncoding::srgb_framebuffer ? GL_SRGB8_ALPHA8 : GL_RGBA8;
}

void require_format(const core::Frame& f) {
  const bool is_float = f.format == GL_RGBA16F || f.format == GL_RGBA32F;
  require(f.format == GL_RGBA8 || f.format == GL_SRGB8_ALPHA8 || is_float,
          "cumulet_frame_desc.format is not GL_RGBA8, GL_SRGB8_ALPHA8, GL_RGBA16F or GL_RGBA32F");
  require(f.encoding != render::ColorEncoding::hdr || is_float,
          "cumulet_frame_desc.format clamps CUMULET_COLOR_HDR: it needs GL_RGBA16F or GL_RGBA32F");
  require(f.encoding != render::ColorEncoding::srgb_framebuffer || f.format == GL_SRGB8_ALPHA8,
          "cumulet_frame_desc.format has no sRGB encoding: CUMULET_COLOR_SRGB_FRAMEBUFFER needs GL_SRGB8_ALPHA8");
}

core::Frame read_frame(const cumulet_frame_desc* desc) {
  const cumulet_frame_desc d = read_desc(desc, "cumulet_frame_desc");
  require(std::isfinite(d.budget_ms) && d.budget_ms <= 1e9, "cumulet_frame_desc.budget_ms is above 1e9 or not finite");
  require(number(d.target) <= CUMULET_TARGET_NONE, "cumulet_frame_desc.target is unknown");
  require(number(d.color) <= CUMULET_COLOR_HDR, "cumulet_frame_desc.color is unknown");
  require(number(d.blend) <= CUMULET_BLEND_REPLACE, "cumulet_frame_desc.blend is unknown");
  require(number(d.depth_source) <= CUMULET_DEPTH_SOURCE_FRAMEBUFFER, "cumulet_frame_desc.depth_source is unknown");
  require(d.width <= 16384 && d.height <= 16384, "cumulet_frame_desc.width or height is above 16384");
  require_bool(d.flip_y, "cumulet_frame_desc.flip_y is not 0 or 1");
  require_bool(d.write_depth, "cumulet_frame_desc.write_depth is not 0 or 1");
  require_bool(d.depth_flip_y, "cumulet_frame_desc.depth_flip_y is not 0 or 1");
  require_bool(d.depth_unchanged, "cumulet_frame_desc.depth_unchanged is not 0 or 1");
  require(d.scale == 0.0 || in_range(d.scale, 0.1, 16.0), "cumulet_frame_desc.scale is not from 0.1 to 16");
  core::Frame f;
  f.budget_ms = d.budget_ms == 0.0 ? 10.0 : d.budget_ms;
  f.target = static_cast<core::Target>(d.target);
  f.framebuffer = d.framebuffer;
  f.size = {d.width, d.height};
  const auto& v = d.viewport;
  if (v[0] == 0 && v[1] == 0 && v[2] == 0 && v[3] == 0) {
    f.viewport = {0, 0, d.width, d.height};
  } else {
    const auto fits = [](std::int32_t first, std::int32_t count, std::uint32_t whole) {
      return first >= 0 && count >= 0 && std::int64_t{first} + count <= std::int64_t{whole};
    };
    require(fits(v[0], v[2], d.width) && fits(v[1], v[3], d.height),
            "cumulet_frame_desc.viewport is not inside the target");
    f.viewport = {v[0], v[1], v[2], v[3]};
  }
  f.flip_y = d.flip_y == 1;
  f.encoding = static_cast<render::ColorEncoding>(d.color);
  f.format = d.format != 0 ? d.format : format_for(f.encoding);
  if (f.target == core::Target::texture) require_format(f);
  f.blend_over = d.blend == CUMULET_BLEND_OVER;
  f.write_depth = d.write_depth == 1;
  f.depth_source = static_cast<render::DepthSource>(d.depth_source);
  f.depth_name = d.depth_name;
  f.depth_flip_y = d.depth_flip_y == 1;
  f.depth_unchanged = d.depth_unchanged == 1;
  return f;
}

}  // namespace

const char* cumulet_status_text(cumulet_status status) {
  switch (static_cast<int>(number(status))) {
    case CUMULET_OK:
      return "done";
    case CUMULET_ERROR_INVALID_ARGUMENT:
      return "invalid argument";
    case CUMULET_ERROR_UNSUPPORTED:
      return "not supported by this OpenGL context";
    case CUMULET_ERROR_FILE:
      return "unreadable or unsuitable file";
    case CUMULET_ERROR_OUT_OF_MEMORY:
      return "out of memory";
    case CUMULET_ERROR_GL:
      return "OpenGL error";
    case CUMULET_ERROR_INTERNAL:
      return "internal error";
    case CUMULET_ERROR_CANCELLED:
      return "cancelled";
    case CUMULET_ERROR_CONTEXT_LOST:
      return "the OpenGL context is lost";
    case CUMULET_ERROR_DETACHED:
      return "not attached to an OpenGL context";
    case CUMULET_ERROR_TIMEOUT:
      return "not ready in time";
    default:
      return "unknown status";
  }
}

uint32_t cumulet_version(void) {
  return CUMULET_VERSION_MAJOR * 10000 + CUMULET_VERSION_MINOR * 100 + CUMULET_VERSION_PATCH;
}

cumulet_status cumulet_create(const cumulet_create_desc* desc, cumulet_viewer** out, char* error, size_t error_size) {
  if (out != nullptr) *out = nullptr;
  return cumulet::c_abi::guarded(error, error_size, [&] {
    if (out == nullptr) refuse("out is NULL");
    const cumulet_create_desc d = read_desc(desc, "cumulet_create_desc");
    require(number(d.gl_state) <= CUMULET_GL_STATE_HOST_RESETS, "cumulet_create_desc.gl_state is unknown");
    cumulet::Log log = cumulet::c_abi::log_of(d.log, d.log_user);
    std::function<void()> update;
    if (d.update != nullptr) {
      update = [call = d.update, user = d.update_user] {
        const core::WorkerPool::InCallback waits;
        call(user);
      };
    }
    auto viewer = std::make_unique<cumulet_viewer>();
    viewer->viewer = std::make_unique<core::Viewer>(
        std::move(log), std::move(update), d.gl_state == CUMULET_GL_STATE_RESTORE,
        cumulet::Trace(d.trace, d.trace_user), d.shader_cache == nullptr ? nullptr : d.shader_cache->asset);
    cumulet_grid_desc grid{};
    cumulet::settings::spell_out_zeros(grid);
    viewer->viewer->set_grid(core::GridSettings::of(grid));
    if (d.get_proc != nullptr) viewer->viewer->attach(d.get_proc, d.get_proc_user);
    *out = viewer.release();
  });
}

cumulet_status cumulet_shader_cache_create(const cumulet_shader_cache_desc* desc, cumulet_shader_cache** out,
                                           char* error, size_t error_size) {
  return cumulet::c_abi::make_handle(out, error, error_size, [&] {
    const cumulet_shader_cache_desc d = read_desc(desc, "cumulet_shader_cache_desc");
    const bool kept = d.folder != nullptr && *d.folder != '\0';
    std::shared_ptr<cumulet::gl::ShaderFolder> shaders;
    if (d.shaders != nullptr && *d.shaders != '\0') shaders = std::make_shared<cumulet::gl::ShaderFolder>(d.shaders);
    return std::make_shared<cumulet::viewer::Sharing>(
        kept ? std::make_shared<cumulet::gl::ProgramFiles>(d.folder) : nullptr, std::move(shaders));
  });
}

cumulet_shader_cache* cumulet_shader_cache_retain(cumulet_shader_cache* cache) { return cumulet::c_abi::retain(cache); }

void cumulet_shader_cache_release(cumulet_shader_cache* cache) { cumulet::c_abi::release(cache); }

void cumulet_destroy(cumulet_viewer* viewer) {
  if (viewer == nullptr || cumulet::CallbackScope::inside() || viewer->process != getpid()) return;
  const cumulet::HostCall host_call;
  delete viewer;
}

const char* cumulet_last_error(const cumulet_viewer* viewer) {
  if (cumulet::CallbackScope::inside()) return inside_callback;
  return viewer == nullptr ? cumulet::c_abi::thread_line() : viewer->last_errors.get();
}

cumulet_status cumulet_attach(cumulet_viewer* viewer, cumulet_get_proc_fn get_proc, void* get_proc_user) {
  return guarded(viewer, [&](core::Viewer& v) {
    require(get_proc != nullptr, "get_proc is NULL");
    v.attach(get_proc, get_proc_user);
  });
}

cumulet_status cumulet_detach(cumulet_viewer* viewer) {
  return guarded(viewer, [](core::Viewer& v) { v.detach(); });
}

cumulet_status cumulet_context_lost(cumulet_viewer* viewer) {
  return guarded(viewer, [](core::Viewer& v) { v.context_lost(); });
}

// ---- volumes ----

cumulet_status cumulet_load_volume(cumulet_viewer* viewer, const char* path, const char* grid_name) {
  return with_state(viewer, [&](core::Viewer& v) {
    require(path != nullptr && *path != '\0', "path is NULL or empty");
    v.load_volume({path, {.density = grid_name == nullptr ? "" : grid_name}});
  });
}

cumulet_status cumulet_load_volume_file(cumulet_viewer* viewer, const cumulet_volume_file_desc* desc) {
  return with_state(viewer, [&](core::Viewer& v) { v.load_volume(to_volume_file(desc)); });
}

cumulet_status cumulet_set_volume(cumulet_viewer* viewer, cumulet_volume* volume) {
  return with_state(viewer, [&](core::Viewer& v) {
    v.set_volume(volume == nullptr ? nullptr : volume->asset);
    viewer->volume.keep(volume);
  });
}

cumulet_status cumulet_set_sequence(cumulet_viewer* viewer, cumulet_sequence* sequence) {
  return with_state(viewer, [&](core::Viewer& v) { v.set_sequence(sequence == nullptr ? nullptr : sequence->asset); });
}

namespace {

void tell_live(const core::Viewer::LiveStatus& status, cumulet_dynamic_volume_info* info) {
  cumulet_dynamic_volume_info out{};
  out.submitted_update = status.handed;
  out.ready_update = status.ready;
  out.displayed_update = status.drawn;
  out.ready_count = status.ready_count;
  out.displayed_count = status.displayed_count;
  write_desc(info, out, "cumulet_dynamic_volume_info");
}

void tell_sequence(const core::Viewer::SequenceStatus& status, cumulet_sequence_info* info, uint8_t* states,
                   size_t count) {
  const auto& frames = status.frames.frames;
  if (states != nullptr && count < frames.size())
    refuse("the sequence has " + std::to_string(frames.size()) + " frames");
  cumulet_sequence_info out{};
  out.frames = static_cast<uint32_t>(frames.size());
  out.ready_frames = static_cast<uint32_t>(std::ranges::count(frames, core::FrameCache::State::ready));
  out.failed_frames = static_cast<uint32_t>(std::ranges::count(frames, core::FrameCache::State::failed));
  out.requested_frame = status.asked;
  out.displayed_frame = static_cast<uint32_t>(status.drawn.value_or(0.0));
  out.is_displayed = status.drawn ? 1 : 0;
  out.bytes = status.frames.bytes;
  out.suggested_density_scale = status.density_scale.value_or(0.0);
  out.requested_position = status.requested_position;
  out.displayed_position = status.drawn.value_or(0.0);
  write_desc(info, out, "cumulet_sequence_info");
  if (states == nullptr) return;
  std::ranges::transform(frames, states, [](core::FrameCache::State state) { return static_cast<uint8_t>(state); });
}

}  // namespace

cumulet_status cumulet_get_sequence_info(cumulet_viewer* viewer, cumulet_sequence_info* info, uint8_t* states,
                                         size_t count) {
  return with_state(viewer, [&](core::Viewer& v) {
    read_desc(info, "cumulet_sequence_info");
    tell_sequence(v.sequence(), info, states, count);
  });
}

cumulet_status cumulet_get_sequence_frame(cumulet_viewer* viewer, uint32_t frame, char* cause, size_t size) {
  return with_state(viewer, [&](core::Viewer& v) {
    require(cause != nullptr && size > 0, "the buffer for the cause is NULL or empty");
    const std::optional<cumulet::Error> failure = v.frame_failure(frame);
    copy_text(failure ? failure->what() : "", cause, size);
  });
}

cumulet_status cumulet_get_instance_sequence_info(cumulet_viewer* viewer, cumulet_instance* instance,
                                                  cumulet_sequence_info* info, uint8_t* states, size_t count) {
  return with_state(viewer, [&](core::Viewer& v) {
    require(instance != nullptr, "the instance is NULL");
    read_desc(info, "cumulet_sequence_info");
    tell_sequence(v.sequence(*instance->asset), info, states, count);
  });
}

cumulet_status cumulet_get_instance_sequence_frame(cumulet_viewer* viewer, cumulet_instance* instance, uint32_t frame,
                                                   char* cause, size_t size) {
  return with_state(viewer, [&](core::Viewer& v) {
    require(instance != nullptr, "the instance is NULL");
    require(cause != nullptr && size > 0, "the buffer for the cause is NULL or empty");
    const std::optional<cumulet::Error> failure = v.frame_failure(*instance->asset, frame);
    copy_text(failure ? failure->what() : "", cause, size);
  });
}

cumulet_status cumulet_set_dynamic_volume(cumulet_viewer* viewer, cumulet_dynamic_volume* live) {
  return with_state(viewer, [&](core::Viewer& v) { v.set_live(live == nullptr ? nullptr : live->asset); });
}

cumulet_status cumulet_get_dynamic_volume_info(cumulet_viewer* viewer, cumulet_dynamic_volume_info* info) {
  return with_state(viewer, [&](core::Viewer& v) {
    read_desc(info, "cumulet_dynamic_volume_info");
    tell_live(v.live(), info);
  });
}

cumulet_status cumulet_get_instance_dynamic_volume_info(cumulet_viewer* viewer, cumulet_instance* instance,
                                                        cumulet_dynamic_volume_info* info) {
  return with_state(viewer, [&](core::Viewer& v) {
    require(instance != nullptr, "the instance is NULL");
    read_desc(info, "cumulet_dynamic_volume_info");
    tell_live(v.live(*instance->asset), info);
  });
}

cumulet_status cumulet_set_limits(cumulet_viewer* viewer, const cumulet_limits_desc* desc) {
  return with_state(viewer, [&](core::Viewer& v) {
    const cumulet_limits_desc d = read_desc(desc, "cumulet_limits_desc");
    require(d.threads <= 1024, "cumulet_limits_desc.threads is above 1024");
    core::Viewer::Limits limits;
    limits.threads = d.threads;
    if (d.memory_bytes != 0) limits.memory_bytes = d.memory_bytes;
    if (d.gl_bytes != 0) limits.gl_bytes = d.gl_bytes;
    v.set_limits(limits);
  });
}

cumulet_status cumulet_set_volume_transforms(cumulet_viewer* viewer, const double* to_world, uint32_t count) {
  return with_state(viewer, [&](core::Viewer& v) {
    std::vector<cumulet::scene::InstanceTransform> transforms = transforms_of(to_world, count);
    if (transforms.empty()) transforms.emplace_back();
    v.set_transforms(transforms);
  });
}

cumulet_status cumulet_set_previous_volume_transforms(cumulet_viewer* viewer, const double* to_world, uint32_t count) {
  return with_state(viewer, [&](core::Viewer& v) { v.set_previous_transforms(transforms_of(to_world, count)); });
}

cumulet_status cumulet_set_volume_shutter_transforms(cumulet_viewer* viewer, const double* open, const double* close,
                                                     uint32_t count) {
  return with_state(viewer, [&](core::Viewer& v) {
    std::vector<cumulet::scene::InstanceTransform> transforms = v.transforms();
    const bool ends = open != nullptr || close != nullptr;
    require(!ends || count == transforms.size(),
            "the number of shutter transforms differs from the number of volume transforms");
    constexpr std::array<double, 16> as_it_is{};
    const auto at = [&](const double* matrices, size_t i) {
      return matrices != nullptr ? std::span<const double, 16>(matrices + 16 * i, 16)
                                 : std::span<const double, 16>(as_it_is);
    };
    for (size_t i = 0; i < transforms.size(); ++i) {
      transforms[i].ends = shutter_transforms_of(at(open, i), at(close, i), transforms[i].to_world,
                                                 "transform " + std::to_string(i) + ": ");
    }
    v.set_transforms(transforms);
  });
}

cumulet_status cumulet_get_volume(cumulet_viewer* viewer, cumulet_volume** out) {
  return with_state(viewer, [&](core::Viewer& v) {
    require(out != nullptr, "out is NULL");
    *out = nullptr;
    const auto volume = v.volume();
    if (!volume || !volume->volume().on_device) *out = viewer->volume.of(volume);
  });
}

cumulet_status cumulet_add_model(cumulet_viewer* viewer, cumulet_model* model) {
  return with_state(viewer, [&](core::Viewer& v) {
    require(model != nullptr, "the model is NULL");
    v.add_model(model->asset);
  });
}

cumulet_status cumulet_remove_model(cumulet_viewer* viewer, cumulet_model* model) {
  return with_state(viewer, [&](core::Viewer& v) {
    require(model != nullptr, "the model is NULL");
    v.remove_model(*model->asset);
  });
}

cumulet_status cumulet_add_instance(cumulet_viewer* viewer, cumulet_instance* instance) {
  return with_state(viewer, [&](core::Viewer& v) {
    require(instance != nullptr, "the instance is NULL");
    v.add_instance(instance->asset);
  });
}

cumulet_status cumulet_remove_instance(cumulet_viewer* viewer, cumulet_instance* instance) {
  return with_state(viewer, [&](core::Viewer& v) {
    require(instance != nullptr, "the instance is NULL");
    v.remove_instance(*instance->asset);
  });
}

void cumulet_cancel(cumulet_viewer* viewer) {
  const cumulet::HostCall host_call;
  if (viewer != nullptr && viewer->process == getpid()) viewer->viewer->cancel();
}

cumulet_status cumulet_get_progress(cumulet_viewer* viewer, cumulet_progress* progress) {
  if (viewer == nullptr || viewer->process != getpid()) return CUMULET_ERROR_INVALID_ARGUMENT;
  const cumulet::HostCall host_call;
  std::string unused;  // the last error stays
  return cumulet::c_abi::guarded(unused, [&] {
    const auto status = viewer->viewer->status();
    cumulet_progress p{};
    p.stage = static_cast<cumulet_stage>(status.stage);
    p.fraction = status.fraction;
    const auto report = [](const std::optional<cumulet::Error>& failure, cumulet_status& code, auto& message) {
      code = failure ? status_of(failure->code()) : CUMULET_OK;
      copy_text(failure ? failure->what() : "", message, sizeof message);
    };
    report(status.failure, p.status, p.message);
    report(status.volume_failure, p.volume_status, p.volume_message);
    report(status.surfaces_failure, p.surfaces_status, p.surfaces_message);
    report(status.environment_failure, p.environment_status, p.environment_message);
    write_desc(progress, p, "cumulet_progress");
  });
}

cumulet_status cumulet_wait(cumulet_viewer* viewer, double timeout_ms) {
  return guarded(viewer, [&](core::Viewer& v) {
    require(!std::isnan(timeout_ms), "timeout_ms is not a number");
    v.wait(timeout_ms);
  });
}

cumulet_status cumulet_rebuild(cumulet_viewer* viewer) {
  return with_state(viewer, [](core::Viewer& v) { v.rebuild(); });
}

// ---- settings ----

cumulet_status cumulet_set_grid(cumulet_viewer* viewer, const cumulet_grid_desc* desc) {
  return with_state(viewer, [&](core::Viewer& v) { v.set_grid(core::GridSettings::of(read_settings(desc))); });
}

cumulet_status cumulet_set_medium(cumulet_viewer* viewer, const cumulet_medium_desc* desc) {
  return with_state(viewer, [&](core::Viewer& v) { v.set_medium(core::Medium::of(read_settings(desc))); });
}

cumulet_status cumulet_set_sun_sky(cumulet_viewer* viewer, const cumulet_sun_sky_desc* desc) {
  return with_state(viewer, [&](core::Viewer& v) { v.set_light(core::Light::of(read_settings(desc))); });
}

cumulet_status cumulet_set_lights(cumulet_viewer* viewer, const cumulet_light_desc* lights, uint64_t count) {
  return with_state(viewer, [&](core::Viewer& v) { v.set_lights(cumulet::c_abi::analytic_lights_of(lights, count)); });
}

cumulet_status cumulet_load_environment(cumulet_viewer* viewer, const char* path) {
  return with_state(viewer, [&](core::Viewer& v) {
    require(path != nullptr && *path != '\0', "path is NULL or empty");
    v.load_environment(path);
  });
}

cumulet_status cumulet_set_environment(cumulet_viewer* viewer, cumulet_environment* environment) {
  return with_state(viewer, [&](core::Viewer& v) {
    v.set_environment(environment == nullptr ? nullptr : environment->asset);
    viewer->environment.keep(environment);
  });
}

cumulet_status cumulet_get_environment(cumulet_viewer* viewer, cumulet_environment** out) {
  return with_state(viewer, [&](core::Viewer& v) {
    require(out != nullptr, "out is NULL");
    *out = nullptr;
    *out = viewer->environment.of(v.environment());
  });
}

cumulet_status cumulet_set_environment_settings(cumulet_viewer* viewer, const cumulet_environment_settings_desc* desc) {
  return with_state(
      viewer, [&](core::Viewer& v) { v.set_environment_settings(core::EnvironmentSettings::of(read_settings(desc))); });
}

cumulet_status cumulet_set_ground(cumulet_viewer* viewer, const cumulet_ground_desc* desc) {
  return with_state(viewer, [&](core::Viewer& v) { v.set_ground(core::GroundSettings::of(read_settings(desc))); });
}

cumulet_status cumulet_load_surfaces(cumulet_viewer* viewer, const char* path) {
  return with_state(viewer, [&](core::Viewer& v) {
    require(path != nullptr && *path != '\0', "path is NULL or empty");
    v.load_surfaces(path);
  });
}

cumulet_status cumulet_set_surfaces(cumulet_viewer* viewer, cumulet_surfaces* surfaces) {
  return with_state(viewer, [&](core::Viewer& v) {
    v.set_surfaces(surfaces == nullptr ? nullptr : surfaces->asset);
    viewer->surfaces.keep(surfaces);
  });
}

cumulet_status cumulet_get_surfaces(cumulet_viewer* viewer, cumulet_surfaces** out) {
  return with_state(viewer, [&](core::Viewer& v) {
    require(out != nullptr, "out is NULL");
    *out = nullptr;
    *out = viewer->surfaces.of(v.surfaces_asset());
  });
}

cumulet_status cumulet_set_surface_settings(cumulet_viewer* viewer, const cumulet_surface_settings_desc* desc) {
  return with_state(viewer,
                    [&](core::Viewer& v) { v.set_surface_settings(core::SurfaceSettings::of(read_settings(desc))); });
}

cumulet_status cumulet_use_surface_camera(cumulet_viewer* viewer, uint32_t index) {
  return with_state(viewer, [&](core::Viewer& v) { v.use_surface_camera(index); });
}

cumulet_status cumulet_set_sampling(cumulet_viewer* viewer, const cumulet_sampling_desc* desc) {
  return with_state(viewer, [&](core::Viewer& v) { v.set_sampling(core::Sampling::of(read_settings(desc))); });
}

cumulet_status cumulet_region_pixels(const float region[4], uint32_t width, uint32_t height, uint32_t pixels[4]) {
  if (region == nullptr || pixels == nullptr || width == 0 || height == 0 || width > 16384 || height > 16384)
    return CUMULET_ERROR_INVALID_ARGUMENT;
  if (!std::all_of(region, region + 4, [](float value) { return in_range(value, 0.0, 1.0); }))
    return CUMULET_ERROR_INVALID_ARGUMENT;
  const render::Region of{{region[0], region[1]}, {region[2], region[3]}};
  const render::PixelBox box = of.pixels({width, height});
  for (int axis = 0; axis < 2; ++axis) {
    pixels[axis] = box.first[axis];
    pixels[2 + axis] = box.size[axis];
  }
  return CUMULET_OK;
}

// ---- camera and input ----

cumulet_status cumulet_set_previous_camera(cumulet_viewer* viewer, cumulet_camera* camera, double seconds) {
  return with_state(viewer, [&](core::Viewer& v) {
    require(in_range(seconds, -1e9, 1e9), "seconds is not from -1e9 to 1e9");
    v.set_previous_camera(camera != nullptr ? camera->asset : nullptr, seconds);
  });
}

cumulet_status cumulet_set_camera(cumulet_viewer* viewer, cumulet_camera* camera) {
  return with_state(viewer, [&](core::Viewer& v) {
    require(camera != nullptr, "camera is NULL");
    v.set_camera(camera->asset);
  });
}

cumulet_status cumulet_get_camera(cumulet_viewer* viewer, cumulet_camera** out) {
  return with_state(viewer, [&](core::Viewer& v) {
    require(out != nullptr, "out is NULL");
    *out = nullptr;
    *out = new cumulet_camera{v.camera()};
  });
}

cumulet_status cumulet_frame_all(cumulet_viewer* viewer) {
  return with_state(viewer, [](core::Viewer& v) { v.frame_all(); });
}

cumulet_status cumulet_set_navigation(cumulet_viewer* viewer, const cumulet_navigation_desc* desc) {
  return with_state(viewer, [&](core::Viewer& v) {
    const cumulet_navigation_desc d = read_settings(desc);
    v.set_navigation(
        {static_cast<core::NavigationStyle>(d.style), d.fly == 1, d.speed, d.turntable_degrees_per_second});
  });
}

cumulet_status cumulet_input(cumulet_viewer* viewer, const cumulet_event* event, int32_t* handled) {
  return with_state(viewer, [&](core::Viewer& v) {
    const cumulet_event e = read_desc(event, "cumulet_event");
    require(number(e.type) <= CUMULET_EVENT_FOCUS_LOST, "cumulet_event.type is unknown");
    require(number(e.button) <= CUMULET_BUTTON_RIGHT, "cumulet_event.button is unknown");
    require(in_range(e.x, -1e9, 1e9) && in_range(e.y, -1e9, 1e9) && in_range(e.wheel, -1e4, 1e4),
            "cumulet_event's position or wheel is out of range");
    core::InputEvent i;
    i.type = static_cast<core::InputEvent::Type>(e.type);
    i.x = e.x;
    i.y = e.y;
    i.wheel = e.wheel;
    i.button = static_cast<int>(e.button);
    i.key = e.key;
    i.modifiers = e.modifiers;
    const bool used = v.input(i);
    if (handled != nullptr) *handled = used ? 1 : 0;
  });
}

// ---- frames ----

cumulet_status cumulet_render(cumulet_viewer* viewer, const cumulet_frame_desc* frame, cumulet_frame_result* result) {
  return guarded(viewer, [&](core::Viewer& v) {
    const core::Frame f = read_frame(frame);
    if (result != nullptr) read_desc(result, "cumulet_frame_result");
    const core::FrameResult r = v.render(f);
    if (result == nullptr) return;
    cumulet_frame_result out{};
    const auto flag = [&out](bool set, std::uint32_t bit) { out.flags |= set ? bit : 0U; };
    flag(r.more, CUMULET_RENDER_INCOMPLETE);
    flag(r.converged, CUMULET_RENDER_CONVERGED);
    flag(r.loading, CUMULET_RENDER_LOADING);
    flag(r.failed, CUMULET_RENDER_FAILED);
    flag(r.preview, CUMULET_RENDER_PREVIEW);
    flag(r.undrawn, CUMULET_RENDER_NEW_IMAGE);
    flag(r.denoised, CUMULET_RENDER_DENOISED);
    out.progress = r.progress;
    out.width = r.size.x;
    out.height = r.size.y;
    out.texture = r.texture;
    out.depth_texture = r.depth_texture;
    write_desc(result, out, "cumulet_frame_result");
  });
}

cumulet_status cumulet_warm_up(cumulet_viewer* viewer, const cumulet_frame_desc* frame, cumulet_warm_up_scope scope,
                               cumulet_warm_up_result* result) {
  return guarded(viewer, [&](core::Viewer& v) {
    const core::Frame f = read_frame(frame);
    require(f.budget_ms >= 0.0, "cumulet_frame_desc.budget_ms is negative");
    require(number(scope) <= CUMULET_WARM_UP_ALL, "the scope is unknown");
    if (result != nullptr) read_desc(result, "cumulet_warm_up_result");
    const core::WarmUp done = v.warm_up(f, number(scope) == CUMULET_WARM_UP_ALL);
    if (result == nullptr) return;
    cumulet_warm_up_result out{};
    out.incomplete = done.more ? 1 : 0;
    out.progress = done.progress;
    write_desc(result, out, "cumulet_warm_up_result");
  });
}

cumulet_status cumulet_pick_at(cumulet_viewer* viewer, double x, double y, cumulet_pick* pick) {
  return guarded(viewer, [&](core::Viewer& v) {
    read_desc(pick, "cumulet_pick");
    require(std::isfinite(x) && std::isfinite(y), "x or y is not finite");
    const core::Pick p = v.pick(x, y);
    cumulet_pick out{};
    out.hit = p.hit ? 1 : 0;
    for (int axis = 0; axis < 3; ++axis) out.position[axis] = p.position[axis];
    out.distance = p.distance;
    out.hit_volume = p.transform_index ? 1 : 0;
    out.transform_index = p.transform_index.value_or(0);
    out.tag = p.tag;
    if (p.surface) {
      out.hit_surface = 1;
      out.material = p.surface->material;
      copy_text(p.surface->material_name, out.material_name, sizeof out.material_name);
      for (int axis = 0; axis < 3; ++axis) out.normal[axis] = p.surface->normal[axis];
    }
    write_desc(pick, out, "cumulet_pick");
  });
}

cumulet_status cumulet_get_bounds(cumulet_viewer* viewer, double box_min[3], double box_max[3]) {
  return with_state(viewer, [&](core::Viewer& v) {
    require(box_min != nullptr && box_max != nullptr, "box_min or box_max is NULL");
    const core::Bounds box = v.bounds();
    for (int axis = 0; axis < 3; ++axis) {
      box_min[axis] = box.min[axis];
      box_max[axis] = box.max[axis];
    }
  });
}

cumulet_status cumulet_read_linear(cumulet_viewer* viewer, float* rgba, size_t count) {
  return guarded(viewer, [&](core::Viewer& v) {
    require(rgba != nullptr, "rgba is NULL");
    v.read_linear(rgba, count);
  });
}

cumulet_status cumulet_read_display(cumulet_viewer* viewer, uint8_t* rgba, size_t count) {
  return guarded(viewer, [&](core::Viewer& v) {
    require(rgba != nullptr, "rgba is NULL");
    v.read_display(rgba, count);
  });
}

cumulet_status cumulet_read_denoised(cumulet_viewer* viewer, const cumulet_denoise_desc* desc, float* rgba,
                                     size_t count) {
  return guarded(viewer, [&](core::Viewer& v) {
    const cumulet_denoise_desc d = read_desc(desc, "cumulet_denoise_desc");
    require(d.network == nullptr || *d.network != '\0', "network is empty");
    require(rgba != nullptr, "rgba is NULL");
    v.read_denoised(d.network, d.oidn_library, rgba, count);
  });
}

cumulet_status cumulet_encode_display(cumulet_viewer* viewer, const float* linear, uint8_t* rgba, size_t count) {
  return guarded(viewer, [&](core::Viewer& v) {
    require(linear != nullptr && rgba != nullptr, "linear or rgba is NULL");
    require(count % 4 == 0, "count is not a multiple of 4");
    v.encode_display({linear, count}, {rgba, count});
  });
}

cumulet_status cumulet_read_aov(cumulet_viewer* viewer, cumulet_aov aov, float* values, size_t count) {
  return guarded(viewer, [&](core::Viewer& v) {
    require(number(aov) < cumulet::settings::aovs.size(), "the AOV is unknown");
    require(values != nullptr, "values is NULL");
    v.read_aov(static_cast<core::Aov>(aov), values, count);
  });
}

cumulet_status cumulet_read_light_group(cumulet_viewer* viewer, uint32_t group, float* rgb, size_t count) {
  return guarded(viewer, [&](core::Viewer& v) {
    require(rgb != nullptr, "rgb is NULL");
    v.read_light_group(group, rgb, count);
  });
}

cumulet_status cumulet_read_cryptomatte(cumulet_viewer* viewer, cumulet_object_name_fn name, void* user, uint32_t ranks,
                                        float* values, size_t count) {
  return guarded(viewer, [&](core::Viewer& v) {
    require(name != nullptr, "name is NULL");
    require(ranks >= 1 && ranks <= render::max_matte_ranks, "ranks is not from 1 to 16");
    require(values != nullptr, "values is NULL");
    const auto id_of = [&](const core::MatteObject& object) {
      const cumulet::CallbackScope inside;
      const char* text = name(user, static_cast<cumulet_object_kind>(object.kind), object.tag, object.transform_index);
      return text == nullptr || *text == '\0' ? 0U : cumulet::cryptomatte_id(text);
    };
    v.read_mattes(id_of, ranks, values, count);
  });
}

uint32_t cumulet_cryptomatte_id(const char* name) { return name == nullptr ? 0 : cumulet::cryptomatte_id(name); }

cumulet_status cumulet_measure_noise(cumulet_viewer* viewer, double* noise) {
  return guarded(viewer, [&](core::Viewer& v) {
    require(noise != nullptr, "noise is NULL");
    *noise = v.measure_noise().value_or(unknown_noise);
  });
}

cumulet_status cumulet_read_accumulation(cumulet_viewer* viewer, void* bytes, size_t* size) {
  return guarded(viewer, [&](core::Viewer& v) {
    require(size != nullptr, "size is NULL");
    if (bytes == nullptr) {
      *size = v.accumulation_bytes();
    } else {
      v.read_accumulation({static_cast<std::byte*>(bytes), *size}, size);
    }
  });
}

cumulet_status cumulet_restore_accumulation(cumulet_viewer* viewer, const void* bytes, size_t size) {
  return guarded(viewer, [&](core::Viewer& v) {
    require(bytes != nullptr, "bytes is NULL");
    v.restore_accumulation({static_cast<const std::byte*>(bytes), size});
  });
}

cumulet_status cumulet_get_stats(cumulet_viewer* viewer, cumulet_stats* stats) {
  return guarded(viewer, [&](core::Viewer& v) {
    read_desc(stats, "cumulet_stats");
    const core::Stats had = v.stats();
    cumulet_stats s{};
    s.cells = had.cells;
    s.levels = had.levels;
    s.limited = had.limited ? 1 : 0;
    s.cell_bytes = had.cell_bytes;
    s.gl_bytes = had.gl_bytes;
    s.memory_bytes = had.memory_bytes;
    s.active_voxels = had.active_voxels;
    const auto& seconds = had.build_seconds;
    s.build_seconds_load = seconds.load;
    s.build_seconds_statistics = seconds.statistics;
    s.build_seconds_refine = seconds.refine;
    s.build_seconds_packing = seconds.records;
    s.build_seconds_upload = seconds.upload;
    s.build_seconds_total = seconds.load + seconds.statistics + seconds.refine + seconds.records + seconds.upload;
    s.trace_seconds = had.trace_seconds;
    s.pass_seconds_upload = had.pass_seconds.upload;
    s.pass_seconds_host_depth = had.pass_seconds.host_depth;
    s.pass_seconds_surfaces = had.pass_seconds.surfaces;
    s.pass_seconds_trace = had.pass_seconds.trace;
    s.pass_seconds_inspect = had.pass_seconds.inspect;
    s.pass_seconds_display = had.pass_seconds.display;
    s.samples = had.samples;
    s.steps = had.steps;
    s.noise = had.noise.value_or(unknown_noise);
    s.nonfinite_samples = had.samples_not_finite;
    s.cell_viewers = had.cell_viewers;
    const core::StateLock::Held held = v.hold_state();
    if (const auto volume_info = v.volume_info()) {
      const core::Bounds bounds = v.bounds_of(*volume_info);
      for (int axis = 0; axis < 3; ++axis) {
        s.bounds_min[axis] = bounds.min[axis];
        s.bounds_max[axis] = bounds.max[axis];
      }
    }
    copy_text(had.strings.vendor, s.gl_vendor, sizeof s.gl_vendor);
    copy_text(had.strings.renderer, s.gl_renderer, sizeof s.gl_renderer);
    copy_text(had.strings.version, s.gl_version, sizeof s.gl_version);
    write_desc(stats, s, "cumulet_stats");
  });
}
