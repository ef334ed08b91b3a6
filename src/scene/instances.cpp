#include "scene/instances.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <glm/gtc/matrix_transform.hpp>
#include <limits>
#include <string>

#include "base/error.hpp"
#include "base/origin.hpp"
#include "light/alias_table.hpp"
#include "scene/space.hpp"
#include "scene/threaded_tree.hpp"

namespace cumulet::scene {

namespace {

using core::CmInstance;
using core::CmInstanceNode;
using glm::dvec3;
using glm::vec3;

// Whether products of such values stay finite in shaders.
bool is_sound(const vec3& v) { return core::cm_is_within(v, 1e15F); }

bool is_sound(const core::CmSpace& s) {
  return is_sound(s.to_cube_x) && is_sound(s.to_cube_y) && is_sound(s.to_cube_z) && is_sound(s.from_cube_x) &&
         is_sound(s.from_cube_y) && is_sound(s.from_cube_z) && is_sound(s.cube_origin);
}

bool is_solid(const core::CmGrid& grid) { return glm::all(glm::lessThan(grid.box_min, grid.box_max)); }

// Separating-axis test. The axes normal to two edges, of the same block or of different ones, are sufficient. Blocks
// that touch do not overlap.
bool overlap(const Block& a, const Block& b) {
  constexpr double inside = 1.0 - 1e-6;  // tolerance of float rounding
  const dvec3 between = b.middle - a.middle;
  const auto apart = [&](const dvec3& axis) {
    const double reach = a.reach(axis) + b.reach(axis);
    return reach > 0.0 && std::abs(glm::dot(axis, between)) >= inside * reach;
  };
  for (std::size_t i = 0; i < 3; ++i) {
    if (apart(glm::cross(a.half[i], a.half[(i + 1) % 3])) || apart(glm::cross(b.half[i], b.half[(i + 1) % 3])))
      return false;
    for (std::size_t j = 0; j < 3; ++j) {
      if (apart(glm::cross(a.half[i], b.half[j]))) return false;
    }
  }
  return true;
}

// Whether the box of another instance overlaps this one.
bool overlaps_another(const InstanceTable& table, const std::vector<Block>& blocks, const CmInstanceNode& leaf) {
  for (std::size_t i = 0; i < table.nodes.size();) {
    const CmInstanceNode& node = table.nodes[i];
    const bool near =
        glm::all(glm::lessThanEqual(node.low, leaf.high)) && glm::all(glm::lessThanEqual(leaf.low, node.high));
    if (near && node.instance != core::CM_INSTANCE_NONE && node.instance != leaf.instance) {
      // For a moving instance, the test uses its swept bounding box.
      const std::uint32_t flags = table.records[node.instance].flags | table.records[leaf.instance].flags;
      if ((flags & core::CM_INSTANCE_MOVES) != 0 || overlap(blocks[node.instance], blocks[leaf.instance])) return true;
    }
    i = near ? i + 1 : node.skip;
  }
  return false;
}

// Sets the probability with which next-event estimation samples the emissive cells of each instance.
void set_emissive(InstanceTable& table, const std::vector<InstanceEmissive>& emissive) {
  double square = 0.0;  // sum of the integrals of L^2 of the instances: length^3 = power^2 / square
  std::vector<double> power;
  for (const InstanceEmissive& of : emissive) {
    power.push_back(of.power);
    table.emissive_power += of.power;
    if (of.power > 0.0) square += of.power / of.length * (of.power / of.length) / of.length;
  }
  if (!(table.emissive_power > 1e-30)) {  // its inverse does not fit in a float
    table.emissive_power = 0.0;
    return;
  }
  table.emissive_length = std::cbrt(table.emissive_power / square * table.emissive_power);
  const std::vector<light::Alias> aliases = light::alias_table(std::move(power), table.emissive_power);
  for (std::size_t i = 0; i < aliases.size(); ++i) {
    CmInstance& record = table.records[i];
    record.alias = aliases[i].stays;
    record.alias_other = aliases[i].other;
    record.emissive = emissive[i].looks;
    if (emissive[i].power > 0.0) record.emissive.density = static_cast<float>(1.0 / table.emissive_power);
  }
}

// Appends the clip records of an instance, and returns CmInstance::clip.
std::uint32_t append_clip(std::vector<CmInstanceNode>& nodes, const ClipPlanes& planes,
                          const glm::dmat4& cube_to_world) {
  if (planes.empty()) return 0;
  const auto first = static_cast<std::uint32_t>(nodes.size());
  // A plane that keeps everything fills the last record.
  const auto put = [](const glm::dvec4& plane, vec3& normal, std::uint32_t& offset) {
    constexpr double most = 1e30;
    const double length = glm::length(dvec3(plane));
    normal = length > 0.0 ? vec3(dvec3(plane) / length) : vec3(0.0F);
    const double distance = length > 0.0 ? plane.w / length : 1.0;
    offset = std::bit_cast<std::uint32_t>(static_cast<float>(std::clamp(distance, -most, most)));
  };
  for (std::size_t i = 0; i < planes.size(); i += 2) {
    CmInstanceNode& record = nodes.emplace_back();
    put(planes[i] * cube_to_world, record.low, record.skip);
    put(i + 1 < planes.size() ? planes[i + 1] * cube_to_world : glm::dvec4(0.0), record.high, record.instance);
  }
  return first << 3U | static_cast<std::uint32_t>(nodes.size() - first);
}

}  // namespace

dvec3 origin_of(std::span<const Instance> instances) {
  dvec3 low(std::numeric_limits<double>::infinity());
  dvec3 high(-low);
  for (const Instance& instance : instances) {
    if (!is_solid(instance.grid)) continue;
    const Block block = block_of(instance.transform * instance.source->cube.to_world, dvec3(instance.grid.box_min),
                                 dvec3(instance.grid.box_max));
    const dvec3 reach = reach_of(block);
    low = glm::min(low, block.middle - reach);
    high = glm::max(high, block.middle + reach);
  }
  if (!(low.x <= high.x)) return dvec3(0.0);                // no instance has a volume
  return origin_near(low, high, glm::distance(low, high));  // the grid step is the size of the scene
}

InstanceTable make_instances(std::span<const Instance> instances, const dvec3& origin) {
  InstanceTable table;
  const std::size_t count = instances.size();
  const bool moves = std::ranges::any_of(instances, [](const Instance& i) { return i.ends.has_value(); });
  if (moves) table.ends.resize(2 * count);
  std::vector<Block> blocks;
  std::vector<InstanceEmissive> emissive;
  std::vector<TreeBox> boxes;
  const auto refuse = [&](ErrorCode code, const char* cause) {
    throw Error(code, "instance " + std::to_string(table.records.size()) + ": " + cause);
  };
  for (const Instance& instance : instances) {
    const grid::Cube& cube = instance.source->cube;
    const auto stand = [&](const glm::dmat4& transform, CmInstance& record) {
      const glm::dmat4 to_scene = glm::translate(glm::dmat4(1.0), -origin) * transform * cube.to_world;
      record.space = space_of(to_scene, instance.grid.box_min, instance.grid.box_max);
      if (!is_sound(record.space))
        refuse(ErrorCode::invalid_argument, "its transform is not finite, is singular, or is too large");
      return block_of(to_scene, dvec3(instance.grid.box_min), dvec3(instance.grid.box_max));
    };
    CmInstance record{};
    const Block& block = blocks.emplace_back(stand(instance.transform, record));
    record.grid = instance.grid;
    record.medium = instance.medium;
    record.flags = (instance.hidden_from_camera ? 0U : core::CM_INSTANCE_SEEN) |
                   (instance.medium.emits != 0 ? core::CM_INSTANCE_EMITS : 0U) |
                   (instance.ends ? core::CM_INSTANCE_MOVES : 0U);
    emissive.push_back(emissive_of(instance.emissive, cube.to_world, instance.transform));
    dvec3 low = block.middle - reach_of(block);
    dvec3 high = block.middle + reach_of(block);
    if (instance.ends) {
      // Corners move on straight lines, so positions in between are within the bounds of both ends.
      const std::size_t at = table.records.size();
      for (const Block& end :
           {stand(instance.ends->open, table.ends[at]), stand(instance.ends->close, table.ends[count + at])}) {
        low = glm::min(low, end.middle - reach_of(end));
        high = glm::max(high, end.middle + reach_of(end));
      }
    }
    const dvec3 most = glm::max(glm::abs(low), glm::abs(high));
    const double size = std::max({most.x, most.y, most.z});
    if (!(size < farthest)) refuse(ErrorCode::unsupported, "it extends 1e12 or more from the scene");
    // Enlarged for rounding, so that it holds every ray point that the instance's own box counts as inside.
    boxes.push_back({vec3(low - 2e-6 * size), vec3(high + 2e-6 * size), is_solid(instance.grid)});
    table.records.push_back(record);
  }
  table.nodes = threaded_tree(boxes);
  for (const CmInstanceNode& node : table.nodes) {
    if (node.instance != core::CM_INSTANCE_NONE && overlaps_another(table, blocks, node))
      table.records[node.instance].flags |= core::CM_INSTANCE_OVERLAPS;
  }
  for (std::size_t i = 0; i < count; ++i)
    table.records[i].clip = append_clip(table.nodes, instances[i].clip, instances[i].source->cube.to_world);
  set_emissive(table, emissive);
  return table;
}

}  // namespace cumulet::scene
