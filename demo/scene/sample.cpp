#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <memory>

#include "scene.hpp"

namespace cumulet::scene {

std::vector<openvdb::FloatGrid::Ptr> sample(const std::vector<Channel>& channels, double voxel_size,
                                            const glm::vec3& low, const glm::vec3& high,
                                            const std::function<bool(const glm::vec3&, float)>& skip,
                                            const std::function<void(const glm::vec3&, float*)>& values) {
  using Leaf = openvdb::FloatTree::LeafNodeType;
  const auto leaf_size = static_cast<float>(8.0 * voxel_size);
  const glm::ivec3 first(glm::floor(low / leaf_size));
  const glm::ivec3 count = glm::ivec3(glm::ceil(high / leaf_size)) - first;
  const std::size_t total = std::size_t(count.x) * std::size_t(count.y) * std::size_t(count.z);
  std::vector<std::vector<std::unique_ptr<Leaf>>> leaves(total);
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, total, 64), [&](const auto& range) {
    std::vector<float> found(channels.size());
    for (std::size_t i = range.begin(); i != range.end(); ++i) {
      const glm::ivec3 leaf =
          first + glm::ivec3(i % std::size_t(count.x), (i / std::size_t(count.x)) % std::size_t(count.y),
                             i / (std::size_t(count.x) * std::size_t(count.y)));
      const glm::vec3 centre = (glm::vec3(leaf) + 0.5F) * leaf_size;
      if (skip(centre, 0.87F * leaf_size)) continue;
      for (std::size_t c = 0; c < channels.size(); ++c) {
        leaves[i].push_back(std::make_unique<Leaf>(openvdb::Coord(leaf.x * 8, leaf.y * 8, leaf.z * 8), 0.0F, false));
      }
      for (unsigned v = 0; v < 512; ++v) {
        const glm::ivec3 voxel = leaf * 8 + glm::ivec3(v / 64, (v / 8) % 8, v % 8);
        std::fill(found.begin(), found.end(), 0.0F);
        values((glm::vec3(voxel) + 0.5F) * static_cast<float>(voxel_size), found.data());
        for (std::size_t c = 0; c < channels.size(); ++c) {
          if (found[c] > channels[c].smallest) leaves[i][c]->setValueOn(v, found[c]);
        }
      }
    }
  });
  auto transform = openvdb::math::Transform::createLinearTransform(voxel_size);
  transform->postTranslate(openvdb::Vec3d(0.5 * voxel_size));
  std::vector<openvdb::FloatGrid::Ptr> grids;
  for (std::size_t c = 0; c < channels.size(); ++c) {
    auto grid = openvdb::FloatGrid::create(0.0F);
    for (std::vector<std::unique_ptr<Leaf>>& leaf : leaves) {
      if (!leaf.empty() && !leaf[c]->isEmpty()) grid->tree().addLeaf(leaf[c].release());
    }
    grid->setName(channels[c].name);
    grid->setGridClass(openvdb::GRID_FOG_VOLUME);
    grid->setSaveFloatAsHalf(true);
    grid->setTransform(transform->copy());
    grids.push_back(grid);
  }
  return grids;
}

}  // namespace cumulet::scene
