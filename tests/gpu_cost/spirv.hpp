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

/// A stage as Vulkan takes it, and what a pipeline's layout must know of it.
struct Module {
  std::vector<std::uint32_t> words;
  std::map<std::uint32_t, Descriptor> bindings;  // of set 0
  std::vector<std::uint32_t> inputs;             // locations
  std::vector<std::uint32_t> outputs;
};

/// OpenGL's GLSL by glslangValidator. extension: comp, vert or frag. Throws std::runtime_error with its messages.
Module compile(const std::string& source, const std::string& extension);

}  // namespace cumulet::gpu_cost
