#pragma once

#include <vulkan/vulkan.h>

#include <memory>
#include <string>

#include "compiler.hpp"

namespace cumulet::gpu_cost {

/// Mesa's RADV without a GPU: it can only compile for an AMD GPU. At most one at a time.
class NullDevice final : public Compiler {
 public:
  /// family: a value of RADV_FORCE_FAMILY. Returns null if this driver is not installed.
  static std::unique_ptr<NullDevice> open(const std::string& family);
  ~NullDevice() override;
  NullDevice(const NullDevice&) = delete;
  NullDevice& operator=(const NullDevice&) = delete;
  Cost cost(const Kernel& kernel) override;
  [[nodiscard]] const std::string& version() const override { return version_; }

 private:
  NullDevice() = default;
  Cost cost_of(VkPipeline pipeline) const;

  VkInstance instance_ = VK_NULL_HANDLE;
  VkDevice device_ = VK_NULL_HANDLE;
  bool waves_of_32_ = false;
  std::string version_;
};

}  // namespace cumulet::gpu_cost
