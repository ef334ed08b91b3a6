#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "device.hpp"
#include "sharing.hpp"

namespace vulkan_host {

/// A box of the opaque scene.
struct Box {
  std::array<float, 16> to_clip{};  ///< from the cube between (-1, -1, -1) and (1, 1, 1); column-major
  std::array<float, 4> color{};
};

/// The drawing by Vulkan: opaque boxes, their depth as an image for the viewer, and the viewer's image over the boxes.
class Scene {
 public:
  Scene(const Device& device, VkExtent2D size);

  /// Records the boxes and the copy of their depth, and gives both shared images to OpenGL.
  void record_boxes(VkCommandBuffer commands, std::span<const Box> boxes, const SharedImage& depth,
                    const SharedImage& volume) const;
  /// Records the transparent black of an image in which the viewer has drawn nothing.
  static void record_clear(VkCommandBuffer commands, const SharedImage& volume);
  /// Takes the viewer's image from OpenGL, and records its drawing and the copy of the picture to main memory.
  void record_volume(VkCommandBuffer commands, const SharedImage& volume);
  /// The picture as sRGB, four bytes per pixel, row 0 at the top. The commands must have been executed.
  [[nodiscard]] std::vector<std::uint8_t> read_picture() const;

 private:
  struct PipelineDesc {
    std::span<const std::uint32_t> vertex, fragment;
    VkPipelineLayout layout = VK_NULL_HANDLE;
    bool depth_test = false;  ///< writes depth as well
    bool over = false;        ///< blends premultiplied color over the picture
  };
  [[nodiscard]] Owned<VkPipeline> create_pipeline(const PipelineDesc& desc) const;
  void create_volume_set();
  void set_volume(const SharedImage& volume);
  void set_viewport(VkCommandBuffer commands) const;
  void copy_depth(VkCommandBuffer commands, const SharedImage& depth) const;

  const Device& device_;
  VkExtent2D size_;
  Image color_, depth_;
  Buffer depth_copy_, picture_;
  Owned<VkDescriptorSetLayout> set_layout_;
  Owned<VkDescriptorPool> pool_;
  VkDescriptorSet set_ = VK_NULL_HANDLE;
  Owned<VkPipelineLayout> box_layout_, volume_layout_;
  Owned<VkPipeline> box_pipeline_, volume_pipeline_;
};

}  // namespace vulkan_host
