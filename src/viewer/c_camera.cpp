// Camera handles of the C ABI. cumulet.h documents the calls.

#include <glm/gtc/type_ptr.hpp>
#include <memory>
#include <optional>

#include "assets/camera.hpp"
#include "viewer/c_handles.hpp"
#include "viewer/c_support.hpp"

namespace {

using namespace cumulet::c_abi;
using cumulet::viewer::Camera;
using cumulet::viewer::CameraPose;
using cumulet::viewer::ClipDepth;
using cumulet::viewer::DepthConvention;

constexpr double farthest = 1e30;

bool within_range(std::span<const double, 3> v) {
  return std::ranges::all_of(v, [](double x) { return in_range(x, -farthest, farthest); });
}

CameraPose pose_of(const cumulet_camera_desc* desc) {
  const cumulet_camera_desc d = read_desc(desc, "cumulet_camera_desc");
  require(within_range(d.eye) && within_range(d.target), "cumulet_camera_desc.eye or target is not from -1e30 to 1e30");
  require(all_finite(d.up), "cumulet_camera_desc.up is not finite");
  require(d.fovy_degrees == 0.0 || in_range(d.fovy_degrees, 0.01, 175.0),
          "cumulet_camera_desc.fovy_degrees is not from 0.01 to 175");
  require(d.orthographic_height == 0.0 || in_range(d.orthographic_height, 1.0 / farthest, farthest),
          "cumulet_camera_desc.orthographic_height is not from 1e-30 to 1e30");
  require(number(d.depth) <= CUMULET_DEPTH_REVERSED, "cumulet_camera_desc.depth is unknown");
  const bool orthographic = d.orthographic_height > 0.0;
  require(in_range(d.near_plane, orthographic ? -farthest : 0.0, farthest),
          "cumulet_camera_desc.near_plane is negative, or not within 1e30");
  const double near = d.near_plane == 0.0 && !orthographic ? 0.1 : d.near_plane;
  const bool infinite = !orthographic && d.far_plane > farthest;
  require(d.far_plane == 0.0 || infinite || (d.far_plane > near && d.far_plane <= farthest),
          "cumulet_camera_desc.far_plane is not beyond the near plane");
  require(in_range(d.lens_radius, 0.0, farthest), "cumulet_camera_desc.lens_radius is not from 0 to 1e30");
  require(in_range(d.focus_distance, 0.0, farthest), "cumulet_camera_desc.focus_distance is not from 0 to 1e30");
  CameraPose pose;
  pose.lens_radius = d.lens_radius;
  pose.focus_distance = d.focus_distance;
  pose.eye = to_dvec3(d.eye);
  pose.target = to_dvec3(d.target);
  const glm::dvec3 look = pose.target - pose.eye;
  require(look == glm::dvec3(0.0) || glm::length(look) > 1.0 / farthest,
          "cumulet_camera_desc.eye and target are too close to each other");
  const double up = std::max({std::abs(d.up[0]), std::abs(d.up[1]), std::abs(d.up[2])});
  if (up > 0.0) pose.up = to_dvec3(d.up) / up;
  if (d.fovy_degrees > 0.0) pose.fovy_degrees = d.fovy_degrees;
  pose.orthographic_height = d.orthographic_height;
  pose.near_plane = d.near_plane;
  pose.far_plane = infinite ? 0.0 : d.far_plane;
  pose.depth = static_cast<DepthConvention>(number(d.depth));
  return pose;
}

ClipDepth clip_of(const cumulet_clip_space& clip) {
  require(number(clip) <= CUMULET_CLIP_ZERO_TO_ONE, "clip is unknown");
  return static_cast<ClipDepth>(number(clip));
}

void copy(const glm::dvec3& from, std::span<double, 3> to) {
  for (int i = 0; i < 3; ++i) to[static_cast<size_t>(i)] = from[i];
}

}  // namespace

cumulet_status cumulet_camera_create(const cumulet_camera_desc* desc, cumulet_camera** out) {
  if (out != nullptr) *out = nullptr;
  return guarded(nullptr, 0, [&] {
    require(out != nullptr, "out is NULL");
    auto handle = std::make_unique<cumulet_camera>();
    handle->asset = std::make_shared<Camera>(pose_of(desc));
    *out = handle.release();
  });
}

void cumulet_camera_release(cumulet_camera* camera) { delete camera; }

cumulet_status cumulet_camera_set(cumulet_camera* camera, const cumulet_camera_desc* desc) {
  return on(camera, "camera", [&](Camera& c) { c.set(pose_of(desc)); });
}

cumulet_status cumulet_camera_get(const cumulet_camera* camera, cumulet_camera_desc* desc) {
  return on(camera, "camera", [&](const Camera& c) {
    const CameraPose pose = c.pose();
    cumulet_camera_desc d{};
    copy(pose.eye, d.eye);
    copy(pose.target, d.target);
    copy(pose.up, d.up);
    d.fovy_degrees = pose.fovy_degrees;
    d.orthographic_height = pose.orthographic_height;
    d.near_plane = pose.near_plane;
    d.far_plane = pose.far_plane;
    d.depth = static_cast<cumulet_depth_convention>(pose.depth);
    d.lens_radius = pose.lens_radius;
    d.focus_distance = pose.focus_distance;
    write_desc(desc, d, "cumulet_camera_desc");
  });
}

cumulet_status cumulet_camera_set_matrices(cumulet_camera* camera, const double view[16], const double projection[16],
                                           cumulet_clip_space clip) {
  return on(camera, "camera", [&](Camera& c) {
    require(view != nullptr && projection != nullptr, "view or projection is NULL");
    c.set_matrices(glm::make_mat4(view), glm::make_mat4(projection), clip_of(clip));
  });
}

cumulet_status cumulet_camera_set_shutter(cumulet_camera* camera, const cumulet_camera_desc* open,
                                          const cumulet_camera_desc* close) {
  return on(camera, "camera", [&](Camera& c) {
    const auto end = [](const cumulet_camera_desc* desc) {
      return desc != nullptr ? std::optional(pose_of(desc)) : std::nullopt;
    };
    c.set_shutter(end(open), end(close));
  });
}

cumulet_status cumulet_camera_get_matrices(const cumulet_camera* camera, double aspect, cumulet_clip_space clip,
                                           double view[16], double projection[16]) {
  return on(camera, "camera", [&](const Camera& c) {
    require(view != nullptr && projection != nullptr, "view or projection is NULL");
    require(in_range(aspect, 1e-6, 1e6), "the aspect ratio is not from 1e-6 to 1e6");
    glm::dmat4 v;
    glm::dmat4 p;
    c.matrices(aspect, clip_of(clip), v, p);
    std::copy_n(glm::value_ptr(v), 16, view);
    std::copy_n(glm::value_ptr(p), 16, projection);
  });
}

cumulet_status cumulet_camera_orbit(cumulet_camera* camera, double yaw, double pitch) {
  return on(camera, "camera", [&](Camera& c) {
    require(std::isfinite(yaw) && std::isfinite(pitch), "yaw or pitch is not finite");
    c.orbit(yaw, pitch);
  });
}

cumulet_status cumulet_camera_look(cumulet_camera* camera, double yaw, double pitch) {
  return on(camera, "camera", [&](Camera& c) {
    require(std::isfinite(yaw) && std::isfinite(pitch), "yaw or pitch is not finite");
    c.look(yaw, pitch);
  });
}

cumulet_status cumulet_camera_roll(cumulet_camera* camera, double angle) {
  return on(camera, "camera", [&](Camera& c) {
    require(std::isfinite(angle), "the angle is not finite");
    c.roll(angle);
  });
}

cumulet_status cumulet_camera_pan(cumulet_camera* camera, double right, double up) {
  return on(camera, "camera", [&](Camera& c) {
    require(std::isfinite(right) && std::isfinite(up), "right or up is not finite");
    c.pan(right, up);
  });
}

cumulet_status cumulet_camera_dolly(cumulet_camera* camera, double factor) {
  return on(camera, "camera", [&](Camera& c) {
    require(std::isfinite(factor) && factor > 0.0, "the factor is not greater than 0");
    c.dolly(factor);
  });
}

cumulet_status cumulet_camera_fly(cumulet_camera* camera, double right, double up, double forward) {
  return on(camera, "camera", [&](Camera& c) {
    require(std::isfinite(right) && std::isfinite(up) && std::isfinite(forward), "right, up or forward is not finite");
    c.fly(right, up, forward);
  });
}

cumulet_status cumulet_camera_frame(cumulet_camera* camera, const double box_min[3], const double box_max[3],
                                    double aspect) {
  return on(camera, "camera", [&](Camera& c) {
    require(box_min != nullptr && box_max != nullptr, "box_min or box_max is NULL");
    require(in_range(aspect, 1e-6, 1e6), "the aspect ratio is not from 1e-6 to 1e6");
    const std::span<const double, 3> low(box_min, 3);
    const std::span<const double, 3> high(box_max, 3);
    require(within_range(low) && within_range(high), "the box is not from -1e30 to 1e30");
    require(glm::all(glm::lessThanEqual(to_dvec3(low), to_dvec3(high))), "box_min is greater than box_max");
    c.frame({to_dvec3(low), to_dvec3(high)}, aspect);
  });
}
