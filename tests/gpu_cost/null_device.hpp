#pragma once

#include <vulkan/vulkan.h>

#include <memory>
#include <string>

#include "cost.hpp"
#include "kernels.hpp"

namespace cumulet::gpu_cost {

/// Mesa's RADV without a GPU: it can only compile for an AMD GPU. At most one at a time.
class NullDevice {
 public:
  /// family: a value of RADV_FORCE_FAMILY. Returns null if this driver is not installed.
  static std::unique_ptr<NullDevice> open(const std::string& family);
  ~NullDevice();
  NullDevice(const NullDevice&) = delete;
  NullDevice& operator=(const NullDevice&) = delete;
  /// Throws std::runtime_error if the kernel cannot be compiled.
  Cost cost(const Kernel& kernel);
  /// "Mesa 22.3.6". Other versions generate other code.
  [[nodiscard]] const std::string& version() const { return version_; }

 private:
  NullDevice() = default;
  Cost cost_of(VkPipeline pipeline) const;

  VkInstance instance_ = VK_NULL_HANDLE;
  VkDevice device_ = VK_NULL_HANDLE;
  bool waves_of_32_ = false;
  std::string version_;
};

}  // namespace cumulet::gpu_cost
