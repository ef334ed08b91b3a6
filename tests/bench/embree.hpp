#pragma once

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <atomic>
#include <cstdint>
#include <vector>

#ifdef CUMULET_HAVE_EMBREE
#include <embree3/rtcore.h>
#endif

#include "support/gl_rays.hpp"
#include "support/meshes.hpp"

namespace cumulet::bench {

using test::GlRay;
using test::Mesh;

/// Calls visit(i) on all cores.
template <class Visit>
void parallel(std::size_t count, const Visit& visit) {
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count, 1024), [&](const auto& range) {
    for (std::size_t i = range.begin(); i != range.end(); ++i) visit(i);
  });
}

/// Embree; empty if it was not found at build time.
class Embree {
 public:
#ifdef CUMULET_HAVE_EMBREE
  Embree() : device_(rtcNewDevice(nullptr)) {}
  Embree(const Embree&) = delete;
  Embree& operator=(const Embree&) = delete;
  ~Embree() {
    if (scene_ != nullptr) rtcReleaseScene(scene_);
    rtcReleaseDevice(device_);
  }
  static constexpr bool present = true;

  void build(const Mesh& mesh, bool dynamic) {
    if (scene_ != nullptr) rtcReleaseScene(scene_);
    scene_ = rtcNewScene(device_);
    rtcSetSceneFlags(scene_,
                     static_cast<RTCSceneFlags>(RTC_SCENE_FLAG_ROBUST | (dynamic ? RTC_SCENE_FLAG_DYNAMIC : 0)));
    geometry_ = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
    rtcSetGeometryBuildQuality(geometry_, dynamic ? RTC_BUILD_QUALITY_REFIT : RTC_BUILD_QUALITY_MEDIUM);
    rtcSetSharedGeometryBuffer(geometry_, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, mesh.vertices.data(), 0,
                               sizeof(surface::PosedVertex), mesh.vertices.size());
    rtcSetSharedGeometryBuffer(geometry_, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, mesh.indices.data(), 0,
                               3 * sizeof(std::uint32_t), mesh.indices.size() / 3);
    rtcCommitGeometry(geometry_);
    rtcAttachGeometry(scene_, geometry_);
    rtcReleaseGeometry(geometry_);
    rtcCommitScene(scene_);
  }
  void refit() {
    rtcUpdateGeometryBuffer(geometry_, RTC_BUFFER_TYPE_VERTEX, 0);
    rtcCommitGeometry(geometry_);
    rtcCommitScene(scene_);
  }
  [[nodiscard]] std::size_t closest(const std::vector<GlRay>& rays) const {
    std::atomic<std::size_t> hits = 0;
    parallel(rays.size(), [&](std::size_t i) {
      RTCIntersectContext context;
      rtcInitIntersectContext(&context);
      RTCRayHit ray{};
      ray.ray = ray_of(rays[i]);
      ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
      rtcIntersect1(scene_, &context, &ray);
      hits += ray.hit.geomID != RTC_INVALID_GEOMETRY_ID ? 1 : 0;
    });
    return hits;
  }
  [[nodiscard]] std::size_t occluded(const std::vector<GlRay>& rays) const {
    std::atomic<std::size_t> hits = 0;
    parallel(rays.size(), [&](std::size_t i) {
      RTCIntersectContext context;
      rtcInitIntersectContext(&context);
      RTCRay ray = ray_of(rays[i]);
      rtcOccluded1(scene_, &context, &ray);
      hits += ray.tfar < 0.0F ? 1 : 0;
    });
    return hits;
  }

 private:
  static RTCRay ray_of(const GlRay& r) {
    RTCRay ray{};
    ray.org_x = r.o.x;
    ray.org_y = r.o.y;
    ray.org_z = r.o.z;
    ray.tnear = r.t_min;
    ray.dir_x = r.d.x;
    ray.dir_y = r.d.y;
    ray.dir_z = r.d.z;
    ray.tfar = r.t_max;
    ray.mask = 0xffffffffU;
    return ray;
  }
  RTCDevice device_;
  RTCScene scene_ = nullptr;
  RTCGeometry geometry_ = nullptr;
#else
  static constexpr bool present = false;
  void build(const Mesh&, bool) {}
  void refit() {}
  static std::size_t closest(const std::vector<GlRay>&) { return 0; }
  static std::size_t occluded(const std::vector<GlRay>&) { return 0; }
#endif
};

}  // namespace cumulet::bench
