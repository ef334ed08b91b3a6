#include "surface/triangles.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "surface/posable_scene.hpp"
#include "surface/precision.hpp"

namespace cumulet::surface {

namespace detail {

namespace {

// Reads a vector of a host's array.
template <int N>
glm::vec<N, float> vector_at(std::span<const float> values, std::size_t i) {
  glm::vec<N, float> v;
  for (int c = 0; c < N; ++c) v[c] = values[N * i + static_cast<std::size_t>(c)];
  return v;
}

void require_finite(std::span<const float> values, const std::string& what) {
  if (!std::ranges::all_of(values, [](float value) { return std::isfinite(value); })) malformed(what + " not finite");
}

void check_mesh(const TriangleMesh& mesh) {
  const std::size_t count = mesh.positions.size() / 3;
  if (mesh.positions.size() % 3 != 0) malformed("positions do not have 3 values per vertex");
  if (count > std::numeric_limits<std::uint32_t>::max()) malformed("has more than 2^32 vertices");
  if (!mesh.normals.empty() && mesh.normals.size() != 3 * count) malformed("normals do not have 3 values per vertex");
  if (!mesh.colors.empty() && mesh.colors.size() != 4 * count) malformed("colors do not have 4 values per vertex");
  if (!mesh.velocities.empty() && mesh.velocities.size() != 3 * count)
    malformed("velocities do not have 3 values per vertex");
  require_finite(mesh.positions, "positions are");
  require_finite(mesh.normals, "normals are");
  if (!std::ranges::all_of(mesh.velocities, [](float v) { return std::abs(v) < 1e18F; })) {
    malformed("velocities are not finite, or too large");
  }
  if (!std::ranges::all_of(mesh.colors, [](float c) { return c >= 0.0F && c <= 1.0F; })) {
    malformed("a color is not from 0 to 1");
  }
  if (mesh.indices.size() > std::numeric_limits<std::uint32_t>::max()) malformed("has more than 2^32 indices");
  if (mesh.indices.empty() ? count % 3 != 0 : mesh.indices.size() % 3 != 0) {
    malformed(mesh.indices.empty() ? "without indices, the number of vertices is not a multiple of 3"
                                   : "the number of indices is not a multiple of 3");
  }
  for (const std::uint32_t index : mesh.indices) {
    if (index >= count) {
      malformed("index " + std::to_string(index) + " is out of range, of " + std::to_string(count) + " vertices");
    }
  }
  for (int n = 0; n < 16; ++n) {
    const double value = mesh.to_world[n / 4][n % 4];
    if (!(std::abs(value) < 1e18)) malformed("to_world is not finite, or too large");
    if (n % 4 == 3 && value != (n == 15 ? 1.0 : 0.0)) malformed("to_world is not affine");
  }
}

MeshPart part_of(const TriangleMesh& mesh) {
  MeshPart part;
  std::vector<std::uint32_t> indices(mesh.indices.begin(), mesh.indices.end());
  if (indices.empty()) {
    indices.resize(mesh.positions.size() / 3);
    std::iota(indices.begin(), indices.end(), 0U);
  }
  part.indices = triangles(indices, TINYGLTF_MODE_TRIANGLES);
  part.flat = mesh.normals.empty();
  const std::vector<std::uint32_t> which = own_vertices(part, mesh.positions.size() / 3);
  part.attributes.resize(which.size());
  for (std::size_t i = 0; i < which.size(); ++i) {
    part.positions.push_back(vector_at<3>(mesh.positions, which[i]));
    if (!part.flat) part.normals.push_back(vector_at<3>(mesh.normals, which[i]));
    if (!mesh.velocities.empty()) part.velocities.push_back(vector_at<3>(mesh.velocities, which[i]));
    if (!mesh.colors.empty()) part.attributes[i].color = vector_at<4>(mesh.colors, which[i]);
  }
  if (!part.flat) make_unit(part);
  return part;
}

}  // namespace

}  // namespace detail

ScenePtr import_triangles(std::span<const TriangleMesh> meshes, const std::string& name) {
  std::string what = name;
  try {
    auto scene = std::make_shared<detail::PosableScene>();
    for (std::size_t i = 0; i < meshes.size(); ++i) {
      what = name + ": " + detail::numbered("mesh", i);
      detail::check_mesh(meshes[i]);
      detail::MeshPart part = detail::part_of(meshes[i]);
      part.material = static_cast<std::uint32_t>(i);
      scene->materials.push_back(meshes[i].material);
      scene->parts.push_back(std::move(part));
      const auto node = static_cast<std::uint32_t>(i);
      scene->rig.nodes.emplace_back().matrix = meshes[i].to_world;
      scene->rig.order.push_back(node);
      scene->rig.displayed.push_back(node);
      scene->add_instance(i, node, -1);
    }
    what = name;
    const auto count = static_cast<std::uint32_t>(meshes.size());
    scene->counts = {count, count, count, 0};
    if (scene->materials.empty()) scene->materials.emplace_back();
    scene->finish();
    detail::PrecisionRemark remark;
    for (std::size_t i = 0; i < scene->parts.size(); ++i)
      remark.add(detail::numbered("mesh", i), scene->parts[i].low, scene->parts[i].high);
    scene->precision_remark = remark.text(name);
    return scene;
  } catch (const Error& error) {
    throw Error(ErrorCode::invalid_argument, cumulet::one_line(what + ": " + error.what()));
  }
}

}  // namespace cumulet::surface
