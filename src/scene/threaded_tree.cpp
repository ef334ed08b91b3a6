#include "scene/threaded_tree.hpp"

#include <cmath>
#include <cstdint>

#include "surface/bvh.hpp"

namespace cumulet::scene {

namespace {

using core::CmInstanceNode;
using glm::dvec3;
using glm::vec3;
using surface::Bvh;

// Builds a triangle BVH over the boxes and writes it in depth-first order with skip links, which needs no stack.
class Threaded {
 public:
  static std::vector<CmInstanceNode> nodes_of(std::span<const TreeBox> boxes) {
    // A degenerate triangle of two opposite corners has the same bounding box.
    std::vector<surface::PosedVertex> corners;
    std::vector<std::uint32_t> indices;
    std::vector<std::uint32_t> left_out;
    indices.reserve(boxes.size() * 3);
    for (const TreeBox& box : boxes) {
      const auto first = static_cast<std::uint32_t>(corners.size());
      indices.insert(indices.end(), {first, first + 1, first});
      corners.push_back({box.low, vec3(0.0F)});
      corners.push_back({box.high, vec3(0.0F)});
      left_out.push_back(box.solid ? 0U : surface::TriangleFlags::left_out);
    }
    const Bvh tree = Bvh::build(corners, indices, left_out);
    Threaded threaded(tree);
    const auto& root = tree.nodes()[0].child;
    const bool both = threaded.is_there(root[1]);
    threaded.add_inner(both ? glm::min(root[0].low, root[1].low) : root[0].low,
                       both ? glm::max(root[0].high, root[1].high) : root[0].high, [&] {
                         for (const Bvh::Node::Child& child : root) threaded.add(child);
                       });
    return std::move(threaded.nodes_);
  }

 private:
  explicit Threaded(const Bvh& tree) : tree_(tree) {}

  static std::size_t first_of(const Bvh::Node::Child& leaf) { return leaf.link & 0x1fffffffU; }
  // A tree with one leaf has no second child; an empty tree has no children.
  [[nodiscard]] bool is_there(const Bvh::Node::Child& child) const {
    return child.link < Bvh::leaf_bit || first_of(child) < tree_.records().size();
  }

  template <class Children>
  void add_inner(const vec3& low, const vec3& high, const Children& add_children) {
    const std::size_t at = nodes_.size();
    nodes_.push_back({low, 0, high, core::CM_INSTANCE_NONE});
    add_children();
    nodes_[at].skip = static_cast<std::uint32_t>(nodes_.size());
  }

  // Recursion depth is at most Bvh::max_depth.
  void add(const Bvh::Node::Child& child) {  // NOLINT(misc-no-recursion)
    if (child.link < Bvh::leaf_bit) {
      add_inner(child.low, child.high, [&] {
        for (const Bvh::Node::Child& next : tree_.nodes()[child.link].child) add(next);
      });
      return;
    }
    if (!is_there(child)) return;
    const std::size_t count = ((child.link >> 29U) & 3U) + 1;
    const auto add_leaves = [&] {
      for (const Bvh::Record& record : tree_.records().subspan(first_of(child), count)) {
        nodes_.push_back({record.v0, static_cast<std::uint32_t>(nodes_.size() + 1), record.v1, record.triangle});
      }
    };
    count == 1 ? add_leaves() : add_inner(child.low, child.high, add_leaves);
  }

  const Bvh& tree_;
  std::vector<CmInstanceNode> nodes_;
};

}  // namespace

dvec3 reach_of(const Block& block) {
  return {block.reach({1.0, 0.0, 0.0}), block.reach({0.0, 1.0, 0.0}), block.reach({0.0, 0.0, 1.0})};
}

Block block_of(const glm::dmat4& map, const dvec3& low, const dvec3& high) {
  Block block;
  block.middle = dvec3(map * glm::dvec4(0.5 * (low + high), 1.0));
  for (int axis = 0; axis < 3; ++axis)
    block.half[static_cast<std::size_t>(axis)] = 0.5 * (high[axis] - low[axis]) * dvec3(map[axis]);
  return block;
}

std::vector<CmInstanceNode> threaded_tree(std::span<const TreeBox> boxes) { return Threaded::nodes_of(boxes); }

}  // namespace cumulet::scene
