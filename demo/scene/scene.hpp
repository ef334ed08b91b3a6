#pragma once

#include <openvdb/openvdb.h>

#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <vector>

namespace cumulet::scene {

struct Settings {
  double voxels = 1.2e6;  ///< approximate number of active voxels
  std::uint32_t seed = 1;
};

/// Creates a fair-weather cumulus, about 100 m wide and 70 m high, with a flat base at y = 0. The grid `density` has a
/// maximum extinction of 1/m. More voxels add finer octaves to the same cloud. Deterministic for any number of threads.
openvdb::FloatGrid::Ptr make_cumulus(const Settings& settings);

/// Frames of an explosion on the ground at the origin: a fireball rises, rolls up into a mushroom of soot, 12 m wide,
/// and cools; debris trails smoke.
constexpr int explosion_frames = 20;
constexpr int shown_frame = 12;  ///< half fire, half soot: the frame shown in the sample scene
/// Creates a frame, starting at 1: grids `density` (soot, maximum 1), `temperature` (1: 1500 K) and `flame` (maximum
/// 1). settings.voxels: for the last frame; earlier frames have fewer. Deterministic for any number of threads.
std::vector<openvdb::FloatGrid::Ptr> make_explosion(const Settings& settings, int frame);

struct Channel {
  const char* name;
  float smallest;  ///< values up to this are set to zero
};

/// Evaluates values(world position, output with one zero per channel) on the leaf nodes of a box of voxels, in
/// parallel. skip(center, half diagonal): returns true if a leaf is empty. Returns one grid per channel; empty leaves
/// are omitted.
std::vector<openvdb::FloatGrid::Ptr> sample(const std::vector<Channel>& channels, double voxel_size,
                                            const glm::vec3& low, const glm::vec3& high,
                                            const std::function<bool(const glm::vec3&, float)>& skip,
                                            const std::function<void(const glm::vec3&, float*)>& values);

}  // namespace cumulet::scene
