#include "bvh_times.hpp"

#include <chrono>
#include <cmath>

#include "embree.hpp"
#include "surface/bvh.hpp"

namespace cumulet::bench {

Duel duel(int repeats, double amount, bool rate, const std::function<void()>& ours,
          const std::function<void()>& theirs) {
  const auto measure = [&](const std::function<void()>& work) {
    const auto from = std::chrono::steady_clock::now();
    work();
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - from).count();
    return rate ? amount / seconds : seconds / amount;
  };
  std::vector<double> a;
  std::vector<double> b;
  for (int i = 0; i < repeats; ++i) {
    a.push_back(measure(ours));
    if (Embree::present) b.push_back(measure(theirs));
  }
  Duel result{spread_of(a), {}, {}};
  if (!b.empty()) {
    result.theirs = spread_of(b);
    result.ratio = ratio_of(a, b);
  }
  return result;
}

std::vector<TreeMesh> tree_meshes(std::size_t triangles) {
  const auto count = static_cast<double>(triangles);
  std::vector<TreeMesh> meshes;
  meshes.push_back({"terrain", test::terrain(static_cast<int>(std::lround(std::sqrt(0.5 * count))))});
  meshes.push_back({"sphere", test::icosphere(static_cast<int>(std::lround(std::log(count / 20.0) / std::log(4.0))))});
  // The triangle size keeps the amount of overlap constant for any count.
  meshes.push_back({"soup", test::soup(triangles, static_cast<float>(1.0 / std::cbrt(count)), 1)});
  return meshes;
}

TreeTimes time_tree(const TreeMesh& tree, int repeats) {
  const Mesh& mesh = tree.mesh;
  TreeTimes times{tree.name, tree.millions(), {}, {}};
  surface::Bvh bvh;
  Embree embree;
  times.build = duel(
      repeats, tree.millions(), false, [&] { bvh = surface::Bvh::build(mesh.vertices, mesh.indices); },
      [&] { embree.build(mesh, false); });
  embree.build(mesh, true);
  times.refit = duel(
      repeats, tree.millions(), false, [&] { bvh.refit(mesh.vertices, mesh.indices); }, [&] { embree.refit(); });
  return times;
}

}  // namespace cumulet::bench
