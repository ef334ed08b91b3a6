#pragma once

#include <openvdb/openvdb.h>

#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <vector>

namespace cumulet::scene {

struct Settings {
  double voxels = 1.2e6;  ///< about how many active voxels
  std::uint32_t seed = 1;
};

/// A fair-weather cumulus, about 100 m wide and 70 m high, flat base at y = 0: grid `density`, extinction 1/m of at
/// most 1. More voxels bring finer octaves of the same cloud. Deterministic for any number of threads.
openvdb::FloatGrid::Ptr make_cumulus(const Settings& settings);

/// A fire, 4 m wide and 8 m high: grids `density` (smoke, 1/m) and `temperature` (kelvin).
std::vector<openvdb::FloatGrid::Ptr> make_fire(const Settings& settings);

/// Evaluates value(world position) on the leaves of a box of voxels, in parallel; skip(centre, half diagonal) says that
/// a leaf is empty. Values under `smallest` are zero, empty leaves are left out.
openvdb::FloatGrid::Ptr sample(const char* name, double voxel_size, const glm::vec3& low, const glm::vec3& high,
                               float smallest, const std::function<bool(const glm::vec3&, float)>& skip,
                               const std::function<float(const glm::vec3&)>& value);

}  // namespace cumulet::scene
