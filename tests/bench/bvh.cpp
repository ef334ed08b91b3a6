// Compares the BVH with Embree's over the same triangles: build, refit, rays. Prints a table of ratios.

#include <tbb/task_arena.h>

#include <atomic>
#include <chrono>
#include <cstdio>
#include <fstream>
#include <random>
#include <string>

#include "bvh_times.hpp"
#include "embree.hpp"
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

// Camera rays of an image, then rays from their hit points into the hemisphere.
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
  // In tiles of 8 x 8, like a shader's work groups.
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

void print(const char* what, const char* unit, const bench::Duel& duel) {
  std::printf("| %s | %.3g %s |", what, duel.ours.median, unit);
  if (duel.ratio) {
    std::printf(" %.3g | %.2f |\n", duel.theirs->median, duel.ratio->median);
  } else {
    std::printf(" - | - |\n");
  }
  std::fflush(stdout);
}

void compare(const bench::TreeMesh& tree, const test::GlRays& gl, int size, int repeats) {
  const Mesh& mesh = tree.mesh;
  const surface::Bvh bvh = surface::Bvh::build(mesh.vertices, mesh.indices);
  std::printf("\n%s: %.2f million triangles, %zu nodes, depth %d, cost %.1f, %.0f MB\n\n", tree.name.c_str(),
              tree.millions(), bvh.nodes().size(), bvh.depth(), bvh.cost(),
              double(bvh.nodes().size_bytes() + bvh.records().size_bytes()) / 1e6);
  std::printf("| | ours | Embree | ours / Embree |\n|---|---|---|---|\n");
  const bench::TreeTimes times = bench::time_tree(tree, repeats);
  print("build", "s a million", times.build);
  print("refit", "s a million", times.refit);
  bench::Embree embree;
  embree.build(mesh, false);
  const Rays rays = rays_for(mesh, bvh, size);
  const double count = double(rays.camera.size()) / 1e6;
  std::atomic<std::size_t> sum = 0;  // prevents the compiler from removing the work
  const auto cpu = [&](const std::vector<GlRay>& all, bool any) {
    bench::parallel(all.size(), [&](std::size_t i) {
      core::BvhRays trace{&bvh};
      core::BvhRays::CmHit hit{};
      sum += trace.cm_bvh_trace(all[i].o, all[i].d, all[i].t_min, all[i].t_max, any, hit) ? 1 : 0;
    });
  };
  for (const bool scattered : {false, true}) {
    const std::vector<GlRay>& all = scattered ? rays.scattered : rays.camera;
    const std::string kind = scattered ? "scattered" : "camera";
    const auto rate = [&](const char* what, const std::function<void()>& ours, const std::function<void()>& theirs) {
      print((what + kind).c_str(), "M rays/s", bench::duel(repeats, count, true, ours, theirs));
    };
    const auto nearest = [&] { sum += embree.closest(all); };
    const auto any = [&] { sum += embree.occluded(all); };
    rate(
        "C++, nearest, ", [&] { cpu(all, false); }, nearest);
    rate(
        "C++, any, ", [&] { cpu(all, true); }, any);
    const test::GlRays::Scene scene = gl.upload(bvh, all);
    gl.run(scene, false);
    rate(
        "shader, nearest, ", [&] { gl.run(scene, false); }, nearest);
    rate(
        "shader, any, ", [&] { gl.run(scene, true); }, any);
  }
  if (sum == 0) std::printf("no ray hit anything\n");
}

}  // namespace

int main(int argc, char** argv) {
  // --quick: small meshes, to check that it runs. --large: builds ten million triangles, for time and memory.
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
    for (const bench::TreeMesh& tree : bench::tree_meshes(quick ? 5000 : 1'000'000)) compare(tree, gl, size, repeats);
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "cumulet-bench-bvh: %s\n", error.what());
    return 1;
  }
}
