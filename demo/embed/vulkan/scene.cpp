#include "scene.hpp"

#include <algorithm>

#include "composite_frag.h"
#include "composite_vert.h"
#include "scene_frag.h"
#include "scene_vert.h"

namespace vulkan_host {
namespace {

constexpr VkFormat color_format = VK_FORMAT_R8G8B8A8_SRGB;
constexpr VkFormat depth_format = VK_FORMAT_D32_SFLOAT;
constexpr std::uint32_t bytes_per_pixel = 4;  // of both
constexpr std::uint32_t vertices_per_box = 36;

struct Change {
  VkImageLayout from = VK_IMAGE_LAYOUT_UNDEFINED;  ///< UNDEFINED discards the content
  VkImageLayout to = VK_IMAGE_LAYOUT_UNDEFINED;
  VkImageAspectFlags aspect = VK_IMAGE_ASPECT_COLOR_BIT;
  std::uint32_t from_family = VK_QUEUE_FAMILY_IGNORED;
  std::uint32_t to_family = VK_QUEUE_FAMILY_IGNORED;
};

/// Waits for all earlier commands: a larger program names the stages and overlaps its frames.
void change_layout(VkCommandBuffer commands, VkImage image, const Change& change) {
  constexpr VkAccessFlags2 access = VK_ACCESS_2_MEMORY_READ_BIT | VK_ACCESS_2_MEMORY_WRITE_BIT;
  const VkImageMemoryBarrier2 barrier{.sType = VK_STRUCTURE_TYPE_IMAGE_MEMORY_BARRIER_2,
                                      .srcStageMask = VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT,
                                      .srcAccessMask = access,
                                      .dstStageMask = VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT,
                                      .dstAccessMask = access,
                                      .oldLayout = change.from,
                                      .newLayout = change.to,
                                      .srcQueueFamilyIndex = change.from_family,
                                      .dstQueueFamilyIndex = change.to_family,
                                      .image = image,
                                      .subresourceRange = {change.aspect, 0, 1, 0, 1}};
  const VkDependencyInfo dependency{
      .sType = VK_STRUCTURE_TYPE_DEPENDENCY_INFO, .imageMemoryBarrierCount = 1, .pImageMemoryBarriers = &barrier};
  vkCmdPipelineBarrier2(commands, &dependency);
}

VkBufferImageCopy whole(VkExtent2D size, VkImageAspectFlags aspect) {
  return {.imageSubresource = {aspect, 0, 0, 1}, .imageExtent = {size.width, size.height, 1}};
}

Owned<VkShaderModule> create_shader(VkDevice device, std::span<const std::uint32_t> code) {
  const VkShaderModuleCreateInfo create{
      .sType = VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO, .codeSize = code.size_bytes(), .pCode = code.data()};
  VkShaderModule shader = VK_NULL_HANDLE;
  check(vkCreateShaderModule(device, &create, nullptr, &shader), "vkCreateShaderModule");
  return {device, shader, vkDestroyShaderModule};
}

Owned<VkPipelineLayout> create_layout(VkDevice device, const VkPipelineLayoutCreateInfo& create) {
  VkPipelineLayout layout = VK_NULL_HANDLE;
  check(vkCreatePipelineLayout(device, &create, nullptr, &layout), "vkCreatePipelineLayout");
  return {device, layout, vkDestroyPipelineLayout};
}

}  // namespace

Scene::Scene(const Device& device, VkExtent2D size)
    : device_(device),
      size_(size),
      color_(device.create_image({.format = color_format,
                                  .size = size,
                                  .usage = VK_IMAGE_USAGE_COLOR_ATTACHMENT_BIT | VK_IMAGE_USAGE_TRANSFER_SRC_BIT})),
      depth_(device.create_image(
          {.format = depth_format,
           .size = size,
           .usage = VK_IMAGE_USAGE_DEPTH_STENCIL_ATTACHMENT_BIT | VK_IMAGE_USAGE_TRANSFER_SRC_BIT})),
      depth_copy_(device.create_buffer(VkDeviceSize{bytes_per_pixel} * size.width * size.height, false)),
      picture_(device.create_buffer(VkDeviceSize{bytes_per_pixel} * size.width * size.height, true)) {
  create_volume_set();
  const VkPushConstantRange box{.stageFlags = VK_SHADER_STAGE_VERTEX_BIT, .size = sizeof(Box)};
  box_layout_ = create_layout(device.get(), {.sType = VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO,
                                             .pushConstantRangeCount = 1,
                                             .pPushConstantRanges = &box});
  volume_layout_ = create_layout(device.get(), {.sType = VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO,
                                                .setLayoutCount = 1,
                                                .pSetLayouts = set_layout_.address()});
  box_pipeline_ =
      create_pipeline({.vertex = scene_vert, .fragment = scene_frag, .layout = box_layout_.get(), .depth_test = true});
  volume_pipeline_ = create_pipeline(
      {.vertex = composite_vert, .fragment = composite_frag, .layout = volume_layout_.get(), .over = true});
}

void Scene::create_volume_set() {
  VkDevice device = device_.get();
  const VkDescriptorSetLayoutBinding binding{.binding = 0,
                                             .descriptorType = VK_DESCRIPTOR_TYPE_SAMPLED_IMAGE,
                                             .descriptorCount = 1,
                                             .stageFlags = VK_SHADER_STAGE_FRAGMENT_BIT};
  const VkDescriptorSetLayoutCreateInfo layout{
      .sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO, .bindingCount = 1, .pBindings = &binding};
  VkDescriptorSetLayout created_layout = VK_NULL_HANDLE;
  check(vkCreateDescriptorSetLayout(device, &layout, nullptr, &created_layout), "vkCreateDescriptorSetLayout");
  set_layout_ = {device, created_layout, vkDestroyDescriptorSetLayout};

  const VkDescriptorPoolSize one{.type = VK_DESCRIPTOR_TYPE_SAMPLED_IMAGE, .descriptorCount = 1};
  const VkDescriptorPoolCreateInfo pool{
      .sType = VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO, .maxSets = 1, .poolSizeCount = 1, .pPoolSizes = &one};
  VkDescriptorPool created_pool = VK_NULL_HANDLE;
  check(vkCreateDescriptorPool(device, &pool, nullptr, &created_pool), "vkCreateDescriptorPool");
  pool_ = {device, created_pool, vkDestroyDescriptorPool};

  const VkDescriptorSetAllocateInfo allocation{.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO,
                                               .descriptorPool = pool_.get(),
                                               .descriptorSetCount = 1,
                                               .pSetLayouts = set_layout_.address()};
  check(vkAllocateDescriptorSets(device, &allocation, &set_), "vkAllocateDescriptorSets");
}

Owned<VkPipeline> Scene::create_pipeline(const PipelineDesc& desc) const {
  VkDevice device = device_.get();
  const Owned<VkShaderModule> vertex = create_shader(device, desc.vertex);
  const Owned<VkShaderModule> fragment = create_shader(device, desc.fragment);
  const auto stage = [](VkShaderStageFlagBits which, VkShaderModule shader) {
    return VkPipelineShaderStageCreateInfo{.sType = VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO,
                                           .stage = which,
                                           .module = shader,
                                           .pName = "main"};
  };
  const std::array stages{stage(VK_SHADER_STAGE_VERTEX_BIT, vertex.get()),
                          stage(VK_SHADER_STAGE_FRAGMENT_BIT, fragment.get())};
  const VkPipelineVertexInputStateCreateInfo no_vertices{.sType =
                                                             VK_STRUCTURE_TYPE_PIPELINE_VERTEX_INPUT_STATE_CREATE_INFO};
  const VkPipelineInputAssemblyStateCreateInfo triangles{
      .sType = VK_STRUCTURE_TYPE_PIPELINE_INPUT_ASSEMBLY_STATE_CREATE_INFO,
      .topology = VK_PRIMITIVE_TOPOLOGY_TRIANGLE_LIST};
  const VkPipelineViewportStateCreateInfo viewport{
      .sType = VK_STRUCTURE_TYPE_PIPELINE_VIEWPORT_STATE_CREATE_INFO, .viewportCount = 1, .scissorCount = 1};
  const VkPipelineRasterizationStateCreateInfo raster{
      .sType = VK_STRUCTURE_TYPE_PIPELINE_RASTERIZATION_STATE_CREATE_INFO, .lineWidth = 1.0F};
  const VkPipelineMultisampleStateCreateInfo samples{.sType = VK_STRUCTURE_TYPE_PIPELINE_MULTISAMPLE_STATE_CREATE_INFO,
                                                     .rasterizationSamples = VK_SAMPLE_COUNT_1_BIT};
  const VkBool32 depth_test = desc.depth_test ? VK_TRUE : VK_FALSE;
  const VkPipelineDepthStencilStateCreateInfo depth{.sType = VK_STRUCTURE_TYPE_PIPELINE_DEPTH_STENCIL_STATE_CREATE_INFO,
                                                    .depthTestEnable = depth_test,
                                                    .depthWriteEnable = depth_test,
                                                    .depthCompareOp = VK_COMPARE_OP_LESS};
  const VkPipelineColorBlendAttachmentState blend{
      .blendEnable = desc.over ? VK_TRUE : VK_FALSE,
      .srcColorBlendFactor = VK_BLEND_FACTOR_ONE,
      .dstColorBlendFactor = VK_BLEND_FACTOR_ONE_MINUS_SRC_ALPHA,
      .srcAlphaBlendFactor = VK_BLEND_FACTOR_ONE,
      .dstAlphaBlendFactor = VK_BLEND_FACTOR_ONE_MINUS_SRC_ALPHA,
      .colorWriteMask =
          VK_COLOR_COMPONENT_R_BIT | VK_COLOR_COMPONENT_G_BIT | VK_COLOR_COMPONENT_B_BIT | VK_COLOR_COMPONENT_A_BIT};
  const VkPipelineColorBlendStateCreateInfo blending{
      .sType = VK_STRUCTURE_TYPE_PIPELINE_COLOR_BLEND_STATE_CREATE_INFO, .attachmentCount = 1, .pAttachments = &blend};
  constexpr std::array dynamic{VK_DYNAMIC_STATE_VIEWPORT, VK_DYNAMIC_STATE_SCISSOR};
  const VkPipelineDynamicStateCreateInfo dynamic_state{.sType = VK_STRUCTURE_TYPE_PIPELINE_DYNAMIC_STATE_CREATE_INFO,
                                                       .dynamicStateCount = dynamic.size(),
                                                       .pDynamicStates = dynamic.data()};
  const VkPipelineRenderingCreateInfo formats{
      .sType = VK_STRUCTURE_TYPE_PIPELINE_RENDERING_CREATE_INFO,
      .colorAttachmentCount = 1,
      .pColorAttachmentFormats = &color_format,
      .depthAttachmentFormat = desc.depth_test ? depth_format : VK_FORMAT_UNDEFINED};
  const VkGraphicsPipelineCreateInfo create{.sType = VK_STRUCTURE_TYPE_GRAPHICS_PIPELINE_CREATE_INFO,
                                            .pNext = &formats,
                                            .stageCount = stages.size(),
                                            .pStages = stages.data(),
                                            .pVertexInputState = &no_vertices,
                                            .pInputAssemblyState = &triangles,
                                            .pViewportState = &viewport,
                                            .pRasterizationState = &raster,
                                            .pMultisampleState = &samples,
                                            .pDepthStencilState = &depth,
                                            .pColorBlendState = &blending,
                                            .pDynamicState = &dynamic_state,
                                            .layout = desc.layout};
  VkPipeline pipeline = VK_NULL_HANDLE;
  check(vkCreateGraphicsPipelines(device, VK_NULL_HANDLE, 1, &create, nullptr, &pipeline), "vkCreateGraphicsPipelines");
  return {device, pipeline, vkDestroyPipeline};
}

void Scene::set_viewport(VkCommandBuffer commands) const {
  // A negative height: +Y is up in clip space, as in the matrices that the viewer gets.
  const VkViewport viewport{.y = static_cast<float>(size_.height),
                            .width = static_cast<float>(size_.width),
                            .height = -static_cast<float>(size_.height),
                            .maxDepth = 1.0F};
  const VkRect2D scissor{.extent = size_};
  vkCmdSetViewport(commands, 0, 1, &viewport);
  vkCmdSetScissor(commands, 0, 1, &scissor);
}

void Scene::record_boxes(VkCommandBuffer commands, std::span<const Box> boxes, const SharedImage& depth,
                         const SharedImage& volume) const {
  change_layout(commands, color_.image.get(), {.to = VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL});
  change_layout(commands, depth_.image.get(),
                {.to = VK_IMAGE_LAYOUT_DEPTH_ATTACHMENT_OPTIMAL, .aspect = VK_IMAGE_ASPECT_DEPTH_BIT});
  const VkRenderingAttachmentInfo color{.sType = VK_STRUCTURE_TYPE_RENDERING_ATTACHMENT_INFO,
                                        .imageView = color_.view.get(),
                                        .imageLayout = VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL,
                                        .loadOp = VK_ATTACHMENT_LOAD_OP_CLEAR,
                                        .storeOp = VK_ATTACHMENT_STORE_OP_STORE,
                                        .clearValue = {.color = {.float32 = {0.05F, 0.07F, 0.12F, 1.0F}}}};
  const VkRenderingAttachmentInfo farthest{.sType = VK_STRUCTURE_TYPE_RENDERING_ATTACHMENT_INFO,
                                           .imageView = depth_.view.get(),
                                           .imageLayout = VK_IMAGE_LAYOUT_DEPTH_ATTACHMENT_OPTIMAL,
                                           .loadOp = VK_ATTACHMENT_LOAD_OP_CLEAR,
                                           .storeOp = VK_ATTACHMENT_STORE_OP_STORE,
                                           .clearValue = {.depthStencil = {.depth = 1.0F}}};
  const VkRenderingInfo rendering{.sType = VK_STRUCTURE_TYPE_RENDERING_INFO,
                                  .renderArea = {.extent = size_},
                                  .layerCount = 1,
                                  .colorAttachmentCount = 1,
                                  .pColorAttachments = &color,
                                  .pDepthAttachment = &farthest};
  vkCmdBeginRendering(commands, &rendering);
  set_viewport(commands);
  vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_GRAPHICS, box_pipeline_.get());
  for (const Box& box : boxes) {
    vkCmdPushConstants(commands, box_layout_.get(), VK_SHADER_STAGE_VERTEX_BIT, 0, sizeof box, &box);
    vkCmdDraw(commands, vertices_per_box, 1, 0, 0);
  }
  vkCmdEndRendering(commands);
  copy_depth(commands, depth);
  for (VkImage image : {depth.image(), volume.image()})
    change_layout(commands, image,
                  {.from = VK_IMAGE_LAYOUT_GENERAL,
                   .to = VK_IMAGE_LAYOUT_GENERAL,
                   .from_family = device_.family(),
                   .to_family = VK_QUEUE_FAMILY_EXTERNAL});
}

void Scene::copy_depth(VkCommandBuffer commands, const SharedImage& depth) const {
  change_layout(commands, depth_.image.get(),
                {.from = VK_IMAGE_LAYOUT_DEPTH_ATTACHMENT_OPTIMAL,
                 .to = VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL,
                 .aspect = VK_IMAGE_ASPECT_DEPTH_BIT});
  const VkBufferImageCopy from = whole(size_, VK_IMAGE_ASPECT_DEPTH_BIT);
  vkCmdCopyImageToBuffer(commands, depth_.image.get(), VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL, depth_copy_.buffer.get(),
                         1, &from);
  // Waits for the copy above, too.
  change_layout(commands, depth.image(), {.to = VK_IMAGE_LAYOUT_GENERAL});
  const VkBufferImageCopy to = whole(size_, VK_IMAGE_ASPECT_COLOR_BIT);
  vkCmdCopyBufferToImage(commands, depth_copy_.buffer.get(), depth.image(), VK_IMAGE_LAYOUT_GENERAL, 1, &to);
}

void Scene::record_clear(VkCommandBuffer commands, const SharedImage& volume) {
  change_layout(commands, volume.image(), {.to = VK_IMAGE_LAYOUT_GENERAL});
  const VkClearColorValue transparent{};
  const VkImageSubresourceRange all{VK_IMAGE_ASPECT_COLOR_BIT, 0, 1, 0, 1};
  vkCmdClearColorImage(commands, volume.image(), VK_IMAGE_LAYOUT_GENERAL, &transparent, 1, &all);
}

void Scene::set_volume(const SharedImage& volume) {
  const VkDescriptorImageInfo image{.imageView = volume.view(), .imageLayout = VK_IMAGE_LAYOUT_GENERAL};
  const VkWriteDescriptorSet write{.sType = VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET,
                                   .dstSet = set_,
                                   .descriptorCount = 1,
                                   .descriptorType = VK_DESCRIPTOR_TYPE_SAMPLED_IMAGE,
                                   .pImageInfo = &image};
  vkUpdateDescriptorSets(device_.get(), 1, &write, 0, nullptr);
}

void Scene::record_volume(VkCommandBuffer commands, const SharedImage& volume) {
  set_volume(volume);
  change_layout(commands, volume.image(),
                {.from = VK_IMAGE_LAYOUT_GENERAL,
                 .to = VK_IMAGE_LAYOUT_GENERAL,
                 .from_family = VK_QUEUE_FAMILY_EXTERNAL,
                 .to_family = device_.family()});
  const VkRenderingAttachmentInfo color{.sType = VK_STRUCTURE_TYPE_RENDERING_ATTACHMENT_INFO,
                                        .imageView = color_.view.get(),
                                        .imageLayout = VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL,
                                        .loadOp = VK_ATTACHMENT_LOAD_OP_LOAD,
                                        .storeOp = VK_ATTACHMENT_STORE_OP_STORE};
  const VkRenderingInfo rendering{.sType = VK_STRUCTURE_TYPE_RENDERING_INFO,
                                  .renderArea = {.extent = size_},
                                  .layerCount = 1,
                                  .colorAttachmentCount = 1,
                                  .pColorAttachments = &color};
  vkCmdBeginRendering(commands, &rendering);
  set_viewport(commands);
  vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_GRAPHICS, volume_pipeline_.get());
  vkCmdBindDescriptorSets(commands, VK_PIPELINE_BIND_POINT_GRAPHICS, volume_layout_.get(), 0, 1, &set_, 0, nullptr);
  vkCmdDraw(commands, 3, 1, 0, 0);
  vkCmdEndRendering(commands);
  change_layout(commands, color_.image.get(),
                {.from = VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL, .to = VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL});
  const VkBufferImageCopy copy = whole(size_, VK_IMAGE_ASPECT_COLOR_BIT);
  vkCmdCopyImageToBuffer(commands, color_.image.get(), VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL, picture_.buffer.get(), 1,
                         &copy);
}

std::vector<std::uint8_t> Scene::read_picture() const {
  std::vector<std::uint8_t> pixels(std::size_t{bytes_per_pixel} * size_.width * size_.height);
  void* mapped = nullptr;
  check(vkMapMemory(device_.get(), picture_.memory.get(), 0, VK_WHOLE_SIZE, 0, &mapped), "vkMapMemory");
  std::copy_n(static_cast<const std::uint8_t*>(mapped), pixels.size(), pixels.begin());
  vkUnmapMemory(device_.get(), picture_.memory.get());
  return pixels;
}

}  // namespace vulkan_host
