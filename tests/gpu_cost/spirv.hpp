#pragma once

#include <vulkan/vulkan.h>

#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace cumulet::gpu_cost {

struct Descriptor {
  VkDescriptorType type;
  std::uint32_t count;
};

/// A shader stage for Vulkan, and the data that a pipeline layout needs.
struct Module {
  std::vector<std::uint32_t> words;
  std::map<std::uint32_t, Descriptor> bindings;  // of set 0
  std::vector<std::uint32_t> inputs;             // locations
  std::vector<std::uint32_t> outputs;
};

/// Compiles OpenGL's GLSL with glslangValidator. extension: comp, vert or frag. Throws std::runtime_error with its
/// messages.
Module compile(const std::string& source, const std::string& extension);

}  // namespace cumulet::gpu_cost
