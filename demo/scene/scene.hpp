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

/// An explosion on the ground at the origin: a fireball that rises, rolls up into a mushroom of soot, 12 m wide, and
/// cools; smoking debris.
constexpr int explosion_frames = 20;
constexpr int shown_frame = 12;  ///< half burning, half soot: the one for a picture
/// One of its frames, from 1: grids `density` (soot, at most 1), `temperature` (1: 1500 K) and `flame` (at most 1).
/// settings.voxels: of the last frame; earlier ones have fewer. Deterministic for any number of threads.
std::vector<openvdb::FloatGrid::Ptr> make_explosion(const Settings& settings, int frame);

struct Channel {
  const char* name;
  float smallest;  ///< values up to it are zero
};

/// Evaluates values(world position, one zero a channel to write to) on the leaves of a box of voxels, in parallel;
/// skip(centre, half diagonal) says that a leaf is empty. One grid a channel, empty leaves left out.
std::vector<openvdb::FloatGrid::Ptr> sample(const std::vector<Channel>& channels, double voxel_size,
                                            const glm::vec3& low, const glm::vec3& high,
                                            const std::function<bool(const glm::vec3&, float)>& skip,
                                            const std::function<void(const glm::vec3&, float*)>& values);

}  // namespace cumulet::scene
