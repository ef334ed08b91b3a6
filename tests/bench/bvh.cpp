// The triangle tree against Embree's over the same triangles: build, refit, rays. Prints a table of ratios.

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <functional>
#include <optional>
#include <string>
#include <thread>

#ifdef CUMULET_HAVE_EMBREE
#include <embree3/rtcore.h>
#endif

#include "support/gl_rays.hpp"
#include "support/meshes.hpp"
#include "surface/bvh_rays.hpp"

namespace {

using namespace cumulet;
using glm::vec3;
using test::GlRay;
using test::Mesh;

double seconds_of(const std::function<void()>& work) {
  const auto from = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - from).count();
}

// Calls visit(i) on all cores.
template <class Visit>
void parallel(std::size_t count, const Visit& visit) {
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count, 1024), [&](const auto& range) {
    for (std::size_t i = range.begin(); i != range.end(); ++i) visit(i);
  });
}

/// Embree, or nothing where it was not found at build time.
class Opponent {
 public:
#ifdef CUMULET_HAVE_EMBREE
  Opponent() : device_(rtcNewDevice(nullptr)) {}
  Opponent(const Opponent&) = delete;
  Opponent& operator=(const Opponent&) = delete;
  ~Opponent() {
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

// A picture's rays, then rays from what they hit into the hemisphere.
struct Rays {
  std::vector<GlRay> camera;
  std::vector<GlRay> scattered;
};
Rays rays_for(const Mesh& mesh, const surface::Bvh& bvh, int size) {
  const auto [low, high] = mesh.bounds();
  const vec3 middle = 0.5F * (low + high);
  const float extent = glm::length(high - low);
  const vec3 eye = middle + extent * vec3(0.5F, 0.6F, 0.7F);
  const vec3 forward = glm::normalize(middle - eye);
  const vec3 right = glm::normalize(glm::cross(forward, vec3(0.0F, 1.0F, 0.0F)));
  const vec3 up = glm::cross(right, forward);
  Rays rays;
  std::mt19937 engine(1);
  std::uniform_real_distribution<float> uniform(-1.0F, 1.0F);
  core::BvhRays trace{&bvh};
  // In tiles of 8 x 8, as a shader's work groups are.
  for (int i = 0; i < size * size; ++i) {
    const int tile = i / 64;
    const int x = tile % (size / 8) * 8 + i % 8;
    const int y = tile / (size / 8) * 8 + i / 8 % 8;
    const float a = 0.9F * (float(x) / float(size) - 0.5F);
    const float b = 0.9F * (float(y) / float(size) - 0.5F);
    rays.camera.push_back({eye, 0.0F, forward + a * right + b * up, 1e20F});
    core::BvhRays::CmHit hit{};
    vec3 from = middle;
    vec3 to(uniform(engine), uniform(engine), uniform(engine));
    if (trace.cm_bvh_closest(eye, rays.camera.back().d, 0.0F, 1e20F, hit)) {
      vec3 n = trace.cm_bvh_normal(hit.record);
      if (!hit.front) n = -n;
      from = trace.cm_offset_origin(trace.cm_bvh_point(hit.record, hit.barycentrics), n);
      if (glm::dot(to, n) < 0.0F) to = -to;
    }
    rays.scattered.push_back({from, 0.0F, glm::normalize(to), 1e20F});
  }
  return rays;
}

long peak_kib() {
  std::ifstream status("/proc/self/status");
  std::string word;
  long value = 0;
  while (status >> word) {
    if (word == "VmHWM:") status >> value;
  }
  return value;
}

class Table {
 public:
  explicit Table(int repeats) : repeats_(repeats) {}
  /// The median of interleaved repeats of both, per `amount`, ours over Embree's.
  void row(const char* what, const char* unit, double amount, bool rate, const std::function<void()>& ours,
           const std::function<void()>& theirs) const {
    std::vector<double> a;
    std::vector<double> b;
    for (int i = 0; i < repeats_; ++i) {
      a.push_back(seconds_of(ours) / amount);
      if (Opponent::present && theirs) b.push_back(seconds_of(theirs) / amount);
    }
    const auto median = [](std::vector<double>& v) {
      std::sort(v.begin(), v.end());
      return v[v.size() / 2];
    };
    const double our = rate ? 1.0 / median(a) : median(a);
    std::printf("| %s | %.3g %s |", what, our, unit);
    if (b.empty()) {
      std::printf(" - | - |\n");
    } else {
      const double their = rate ? 1.0 / median(b) : median(b);
      std::printf(" %.3g | %.2f |\n", their, our / their);
    }
    std::fflush(stdout);
  }

 private:
  int repeats_;
};

void compare(const char* name, const Mesh& mesh, const test::GlRays& gl, int size, int repeats) {
  const double millions = double(mesh.indices.size()) / 3e6;
  const Table table(repeats);
  surface::Bvh bvh = surface::Bvh::build(mesh.vertices, mesh.indices);
  std::printf("\n%s: %.2f million triangles, %zu nodes, depth %d, cost %.1f, %.0f MB\n\n", name, millions,
              bvh.nodes().size(), bvh.depth(), bvh.cost(),
              double(bvh.nodes().size_bytes() + bvh.records().size_bytes()) / 1e6);
  std::printf("| | ours | Embree | ours / Embree |\n|---|---|---|---|\n");
  Opponent embree;
  table.row(
      "build", "s a million", millions, false, [&] { bvh = surface::Bvh::build(mesh.vertices, mesh.indices); },
      [&] { embree.build(mesh, false); });
  embree.build(mesh, true);
  table.row(
      "refit", "s a million", millions, false, [&] { bvh.refit(mesh.vertices, mesh.indices); },
      [&] { embree.refit(); });
  embree.build(mesh, false);
  const Rays rays = rays_for(mesh, bvh, size);
  const double count = double(rays.camera.size()) / 1e6;
  std::atomic<std::size_t> sum = 0;  // so that nothing is left out
  const auto cpu = [&](const std::vector<GlRay>& all, bool any) {
    parallel(all.size(), [&](std::size_t i) {
      core::BvhRays trace{&bvh};
      core::BvhRays::CmHit hit{};
      sum += trace.cm_bvh_trace(all[i].o, all[i].d, all[i].t_min, all[i].t_max, any, hit) ? 1 : 0;
    });
  };
  for (const bool scattered : {false, true}) {
    const std::vector<GlRay>& all = scattered ? rays.scattered : rays.camera;
    const std::string kind = scattered ? "scattered" : "camera";
    table.row(("C++, nearest, " + kind).c_str(), "M rays/s", count, true, [&] { cpu(all, false); },
              [&] { sum += embree.closest(all); });
    table.row(("C++, any, " + kind).c_str(), "M rays/s", count, true, [&] { cpu(all, true); },
              [&] { sum += embree.occluded(all); });
    const test::GlRays::Scene scene = gl.upload(bvh, all);
    gl.run(scene, false);
    table.row(("shader, nearest, " + kind).c_str(), "M rays/s", count, true, [&] { gl.run(scene, false); },
              [&] { sum += embree.closest(all); });
    table.row(("shader, any, " + kind).c_str(), "M rays/s", count, true, [&] { gl.run(scene, true); },
              [&] { sum += embree.occluded(all); });
  }
  if (sum == 0) std::printf("no ray hit anything\n");
}

}  // namespace

int main(int argc, char** argv) {
  // --quick: small meshes, to see that it runs. --large: ten million triangles built, for time and memory.
  const std::string mode = argc > 1 ? argv[1] : "";
  const bool quick = mode == "--quick";
  try {
    if (mode == "--large") {
      const Mesh mesh = test::terrain(2236);
      const long before = peak_kib();
      surface::Bvh bvh;
      const double build = seconds_of([&] { bvh = surface::Bvh::build(mesh.vertices, mesh.indices); });
      const double refit = seconds_of([&] { bvh.refit(mesh.vertices, mesh.indices); });
      std::printf("%zu triangles: build %.2f s, refit %.2f s, tree %.0f MB, peak over the mesh %.0f MB, cost %.1f\n",
                  mesh.indices.size() / 3, build, refit,
                  double(bvh.nodes().size_bytes() + bvh.records().size_bytes()) / 1e6,
                  double(peak_kib() - before) / 1e3, bvh.cost());
      return 0;
    }
    auto context = headless::Context::create(headless::Backend::automatic);
    const test::GlRays gl(context, "");
    std::printf("%d threads, %s\n", tbb::this_task_arena::max_concurrency(), gl.renderer().c_str());
    const int size = quick ? 64 : 512;
    const int repeats = quick ? 1 : 5;
    compare("terrain", test::terrain(quick ? 50 : 707), gl, size, repeats);
    compare("sphere", test::icosphere(quick ? 4 : 8), gl, size, repeats);
    compare("soup", test::soup(quick ? 5000 : 1000000, quick ? 0.05F : 0.01F, 1), gl, size, repeats);
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "cumulet-bench-bvh: %s\n", error.what());
    return 1;
  }
}
