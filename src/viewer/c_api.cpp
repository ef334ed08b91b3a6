// The C ABI: checks arguments, translates descriptors, keeps exceptions in.

#include <algorithm>
#include <cmath>
#include <cstring>
#include <new>
#include <span>

#include "base/error.hpp"
#include "cumulet/cumulet.h"
#include "viewer/viewer.hpp"

struct cumulet_viewer {
  cumulet::viewer::Viewer viewer;
  std::string last_error;
};

namespace {

using cumulet::Error;
using cumulet::ErrorCode;

cumulet_status status_of(ErrorCode code) {
  switch (code) {
    case ErrorCode::invalid_argument:
      return CUMULET_ERROR_INVALID_ARGUMENT;
    case ErrorCode::unsupported:
      return CUMULET_ERROR_UNSUPPORTED;
    case ErrorCode::file:
      return CUMULET_ERROR_FILE;
    case ErrorCode::out_of_memory:
      return CUMULET_ERROR_OUT_OF_MEMORY;
    case ErrorCode::gl:
      return CUMULET_ERROR_GL;
    case ErrorCode::internal:
      break;
  }
  return CUMULET_ERROR_INTERNAL;
}

// Runs a call and turns whatever it throws into a status and a line.
template <class Call>
cumulet_status guarded(std::string& message, Call&& call) noexcept {
  try {
    try {
      call();
      return CUMULET_OK;
    } catch (const Error& error) {
      message = error.what();
      return status_of(error.code());
    } catch (const std::bad_alloc&) {
      message = "out of memory";
      return CUMULET_ERROR_OUT_OF_MEMORY;
    } catch (const std::exception& error) {
      message = std::string("internal error: ") + error.what();
      return CUMULET_ERROR_INTERNAL;
    } catch (...) {
      message = "internal error";
      return CUMULET_ERROR_INTERNAL;
    }
  } catch (...) {
    return CUMULET_ERROR_OUT_OF_MEMORY;  // not even the message could be kept
  }
}

template <class Call>
cumulet_status guarded(cumulet_viewer* viewer, Call&& call) noexcept {
  if (viewer == nullptr) return CUMULET_ERROR_INVALID_ARGUMENT;
  const cumulet_status status = guarded(viewer->last_error, std::forward<Call>(call));
  if (status == CUMULET_OK) viewer->last_error.clear();
  return status;
}

[[noreturn]] void refuse(const std::string& why) { throw Error(ErrorCode::invalid_argument, why); }

// A host built against an older header passes a shorter struct: what it lacks is zero.
template <class Desc>
Desc read_desc(const Desc* desc, const char* name) {
  if (desc == nullptr) refuse(std::string(name) + " is NULL");
  if (desc->struct_size < sizeof(size_t) || desc->struct_size > sizeof(Desc)) {
    refuse(std::string(name) + ".struct_size is " + std::to_string(desc->struct_size) + ", not sizeof(" + name + ")");
  }
  Desc copy{};
  std::memcpy(&copy, desc, desc->struct_size);
  return copy;
}

void require(bool condition, const char* what) {
  if (!condition) refuse(what);
}

// The number in an enum that a C host filled: reading it as the enum would be undefined where it is not one of its
// values.
template <class Enum>
unsigned number(const Enum& value) {
  unsigned copy = 0;
  static_assert(sizeof copy == sizeof value);
  std::memcpy(&copy, &value, sizeof copy);
  return copy;
}

bool in_range(double value, double low, double high) { return value >= low && value <= high; }  // false for NaN

template <class Values>
bool all_finite(const Values& values) {
  return std::ranges::all_of(values, [](auto value) { return std::isfinite(value); });
}

void require_colour(std::span<const float, 3> values, const char* what) {
  for (const float value : values) require(in_range(value, 0.0, 1e30), what);
}

glm::vec3 to_vec3(std::span<const float, 3> v) { return {v[0], v[1], v[2]}; }
glm::dvec3 to_dvec3(std::span<const double, 3> v) { return {v[0], v[1], v[2]}; }

}  // namespace

uint32_t cumulet_version(void) {
  return CUMULET_VERSION_MAJOR * 10000 + CUMULET_VERSION_MINOR * 100 + CUMULET_VERSION_PATCH;
}

cumulet_status cumulet_create(const cumulet_create_desc* desc, cumulet_viewer** out, char* error, size_t error_size) {
  std::string message;
  const cumulet_status status = guarded(message, [&] {
    if (out == nullptr) refuse("out is NULL");
    *out = nullptr;
    const cumulet_create_desc d = read_desc(desc, "cumulet_create_desc");
    if (d.get_proc == nullptr) refuse("cumulet_create_desc.get_proc is NULL");
    // The two level enums have the same values; the callback is wrapped by its type alone.
    const auto log = reinterpret_cast<cumulet::Log::Function>(reinterpret_cast<void (*)()>(d.log));
    *out = new cumulet_viewer{{d.get_proc, d.get_proc_user, cumulet::Log(log, d.log_user)}, {}};
  });
  if (error != nullptr && error_size > 0) {
    const size_t length = std::min(message.size(), error_size - 1);
    std::memcpy(error, message.data(), length);
    error[length] = '\0';
  }
  return status;
}

void cumulet_destroy(cumulet_viewer* viewer) { delete viewer; }

const char* cumulet_last_error(const cumulet_viewer* viewer) {
  return viewer == nullptr ? "viewer is NULL" : viewer->last_error.c_str();
}

cumulet_status cumulet_load_volume(cumulet_viewer* viewer, const char* path, const char* grid_name) {
  return guarded(viewer, [&] {
    if (path == nullptr) refuse("path is NULL");
    viewer->viewer.load_volume(path, grid_name == nullptr ? "" : grid_name);
  });
}

cumulet_status cumulet_set_grid(cumulet_viewer* viewer, const cumulet_grid_desc* desc) {
  return guarded(viewer, [&] {
    const cumulet_grid_desc d = read_desc(desc, "cumulet_grid_desc");
    require(number(d.march) <= CUMULET_MARCH_BRICK, "cumulet_grid_desc.march is unknown");
    require(number(d.cells) <= CUMULET_CELLS_CONSTANT, "cumulet_grid_desc.cells is unknown");
    require(number(d.criterion) <= CUMULET_CRITERION_RANGE_MEAN, "cumulet_grid_desc.criterion is unknown");
    require(std::isfinite(d.threshold), "cumulet_grid_desc.threshold is not finite");
    require(d.camera_adaptive == 0 || d.camera_adaptive == 1, "cumulet_grid_desc.camera_adaptive is not 0 or 1");
    require(in_range(d.pixel_size, 0.0, 1e6), "cumulet_grid_desc.pixel_size is not from 0 to 1e6");
    cumulet::viewer::GridSettings s;
    s.march = static_cast<cumulet::render::March>(d.march);
    s.refine.cells =
        d.cells == CUMULET_CELLS_LINEAR ? cumulet::grid::CellKind::linear : cumulet::grid::CellKind::constant;
    const bool deviation = d.criterion == CUMULET_CRITERION_DEVIATION;
    s.refine.criterion = deviation ? cumulet::grid::Criterion::deviation : cumulet::grid::Criterion::range_mean;
    s.refine.threshold = d.threshold != 0.0 ? d.threshold : (deviation ? 0.02 : 1.0);
    if (d.max_cells != 0) s.refine.max_cells = d.max_cells;
    s.camera_adaptive = d.camera_adaptive == 1;
    s.refine.pixel_size = d.pixel_size > 0.0 ? d.pixel_size : 1.0;
    viewer->viewer.set_grid(s);
  });
}

cumulet_status cumulet_set_medium(cumulet_viewer* viewer, const cumulet_medium_desc* desc) {
  return guarded(viewer, [&] {
    const cumulet_medium_desc d = read_desc(desc, "cumulet_medium_desc");
    require(in_range(d.density_scale, 0.0, 1e30), "cumulet_medium_desc.density_scale is not from 0 to 1e30");
    require(d.anisotropy > -1.0F && d.anisotropy < 1.0F, "cumulet_medium_desc.anisotropy is not between -1 and 1");
    for (const float c : d.coalbedo) require(in_range(c, 0.0, 1.0), "cumulet_medium_desc.coalbedo is not from 0 to 1");
    cumulet::viewer::Medium m;
    m.density_scale = d.density_scale > 0.0 ? d.density_scale : 1.0;
    m.albedo = 1.0F - to_vec3(d.coalbedo);
    m.anisotropy = d.anisotropy;
    m.max_bounces = d.max_bounces;
    viewer->viewer.set_medium(m);
  });
}

cumulet_status cumulet_set_light(cumulet_viewer* viewer, const cumulet_light_desc* desc) {
  return guarded(viewer, [&] {
    const cumulet_light_desc d = read_desc(desc, "cumulet_light_desc");
    require(std::isfinite(d.sun_azimuth_degrees), "cumulet_light_desc.sun_azimuth_degrees is not finite");
    require(in_range(d.sun_elevation_degrees, -90.0, 90.0),
            "cumulet_light_desc.sun_elevation_degrees is not from -90 to 90");
    require_colour(d.sun_irradiance, "cumulet_light_desc.sun_irradiance is negative or not finite");
    require_colour(d.sky_radiance, "cumulet_light_desc.sky_radiance is negative or not finite");
    viewer->viewer.set_light(
        {d.sun_azimuth_degrees, d.sun_elevation_degrees, to_vec3(d.sun_irradiance), to_vec3(d.sky_radiance)});
  });
}

cumulet_status cumulet_set_camera(cumulet_viewer* viewer, const cumulet_camera_desc* desc) {
  return guarded(viewer, [&] {
    const cumulet_camera_desc d = read_desc(desc, "cumulet_camera_desc");
    require(all_finite(d.eye) && all_finite(d.target) && all_finite(d.up), "cumulet_camera_desc is not finite");
    require(d.fovy_degrees == 0.0 || in_range(d.fovy_degrees, 0.01, 175.0),
            "cumulet_camera_desc.fovy_degrees is not from 0.01 to 175");
    cumulet::viewer::Camera c;
    c.eye = to_dvec3(d.eye);
    c.target = to_dvec3(d.target);
    if (to_dvec3(d.up) != glm::dvec3(0.0)) c.up = to_dvec3(d.up);
    if (d.fovy_degrees > 0.0) c.fovy_degrees = d.fovy_degrees;
    viewer->viewer.set_camera(c);
  });
}

cumulet_status cumulet_set_image(cumulet_viewer* viewer, const cumulet_image_desc* desc) {
  return guarded(viewer, [&] {
    const cumulet_image_desc d = read_desc(desc, "cumulet_image_desc");
    require(number(d.view) <= CUMULET_VIEW_DENSITY, "cumulet_image_desc.view is unknown");
    viewer->viewer.set_image(
        {d.width, d.height, d.samples == 0 ? 64 : d.samples, d.seed, static_cast<cumulet::render::View>(d.view)});
  });
}

cumulet_status cumulet_build(cumulet_viewer* viewer) {
  return guarded(viewer, [&] { viewer->viewer.build(); });
}

cumulet_status cumulet_render(cumulet_viewer* viewer, double budget_ms, uint32_t* flags, double* progress) {
  return guarded(viewer, [&] {
    require(in_range(budget_ms, 0.0, 1e9), "budget_ms is not from 0 to 1e9");
    double done = 0.0;
    const bool converged = viewer->viewer.render(budget_ms, done);
    if (flags != nullptr) *flags = converged ? CUMULET_RENDER_CONVERGED : CUMULET_RENDER_MORE;
    if (progress != nullptr) *progress = done;
  });
}

cumulet_status cumulet_read_linear(cumulet_viewer* viewer, float* rgba, size_t count) {
  return guarded(viewer, [&] { viewer->viewer.read(rgba, count); });
}

cumulet_status cumulet_get_stats(const cumulet_viewer* viewer, cumulet_stats* stats) {
  if (viewer == nullptr || stats == nullptr || stats->struct_size < sizeof(size_t) ||
      stats->struct_size > sizeof(cumulet_stats)) {
    return CUMULET_ERROR_INVALID_ARGUMENT;
  }
  std::string unused;
  return guarded(unused, [&] {
    const cumulet::viewer::Viewer& v = viewer->viewer;
    cumulet_stats s{};
    s.struct_size = stats->struct_size;
    s.cells = v.cells();
    s.levels = v.levels();
    s.cell_bytes = v.cell_bytes();
    s.active_voxels = v.active_voxels();
    const auto& seconds = v.build_seconds();
    s.build_seconds_load = seconds.load;
    s.build_seconds_statistics = seconds.statistics;
    s.build_seconds_refine = seconds.refine;
    s.build_seconds_records = seconds.records;
    s.build_seconds_upload = seconds.upload;
    s.build_seconds_total = seconds.load + seconds.statistics + seconds.refine + seconds.records + seconds.upload;
    s.trace_seconds = v.trace_seconds();
    const auto totals = v.totals();
    s.samples = totals.samples;
    s.steps = totals.steps;
    const auto bounds = v.bounds();
    for (int axis = 0; axis < 3; ++axis) {
      s.bounds_min[axis] = bounds.min[axis];
      s.bounds_max[axis] = bounds.max[axis];
    }
    const auto copy = [&](char* to, size_t size, GLenum name) {
      const std::string text = cumulet::gl::string_of(v.gl(), name).substr(0, size - 1);
      std::memcpy(to, text.c_str(), text.size() + 1);
    };
    copy(s.gl_vendor, sizeof(s.gl_vendor), GL_VENDOR);
    copy(s.gl_renderer, sizeof(s.gl_renderer), GL_RENDERER);
    copy(s.gl_version, sizeof(s.gl_version), GL_VERSION);
    std::memcpy(stats, &s, stats->struct_size);
  });
}
