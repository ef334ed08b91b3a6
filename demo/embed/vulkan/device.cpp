#include "device.hpp"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <optional>
#include <vector>

namespace vulkan_host {

void fail(const std::string& cause) {
  std::fprintf(stderr, "cumulet-embed-vulkan: %s\n", cause.c_str());
  std::exit(1);
}

void check(VkResult result, const char* call) {
  if (result != VK_SUCCESS) fail(std::string(call) + ": error " + std::to_string(result));
}

namespace {

std::optional<std::uint32_t> graphics_family(VkPhysicalDevice device) {
  std::uint32_t count = 0;
  vkGetPhysicalDeviceQueueFamilyProperties(device, &count, nullptr);
  std::vector<VkQueueFamilyProperties> families(count);
  vkGetPhysicalDeviceQueueFamilyProperties(device, &count, families.data());
  for (std::uint32_t i = 0; i < count; ++i)
    if ((families[i].queueFlags & VK_QUEUE_GRAPHICS_BIT) != 0) return i;
  return std::nullopt;
}

int preference(VkPhysicalDeviceType type) {
  switch (type) {
    case VK_PHYSICAL_DEVICE_TYPE_DISCRETE_GPU:
      return 3;
    case VK_PHYSICAL_DEVICE_TYPE_INTEGRATED_GPU:
      return 2;
    case VK_PHYSICAL_DEVICE_TYPE_VIRTUAL_GPU:
      return 1;
    default:
      return 0;
  }
}

}  // namespace

Device::Device() {
  const VkApplicationInfo application{.sType = VK_STRUCTURE_TYPE_APPLICATION_INFO,
                                      .pApplicationName = "cumulet-embed-vulkan",
                                      .apiVersion = VK_API_VERSION_1_3};
  const VkInstanceCreateInfo create{.sType = VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO, .pApplicationInfo = &application};
  check(vkCreateInstance(&create, nullptr, &instance_), "vkCreateInstance");
  choose_physical_device();
  create_device();
}

Device::~Device() {
  commands_ = {};
  vkDestroyDevice(device_, nullptr);
  vkDestroyInstance(instance_, nullptr);
}

bool Device::has_extension(const char* name) const {
  std::uint32_t count = 0;
  vkEnumerateDeviceExtensionProperties(physical_, nullptr, &count, nullptr);
  std::vector<VkExtensionProperties> extensions(count);
  vkEnumerateDeviceExtensionProperties(physical_, nullptr, &count, extensions.data());
  return std::any_of(extensions.begin(), extensions.end(),
                     [name](const auto& extension) { return std::strcmp(extension.extensionName, name) == 0; });
}

void Device::choose_physical_device() {
  std::uint32_t count = 0;
  vkEnumeratePhysicalDevices(instance_, &count, nullptr);
  std::vector<VkPhysicalDevice> devices(count);
  vkEnumeratePhysicalDevices(instance_, &count, devices.data());
  int best = -1;
  for (VkPhysicalDevice candidate : devices) {
    VkPhysicalDeviceProperties properties;
    vkGetPhysicalDeviceProperties(candidate, &properties);
    const auto family = graphics_family(candidate);
    if (properties.apiVersion < VK_API_VERSION_1_3 || !family || preference(properties.deviceType) <= best) continue;
    best = preference(properties.deviceType);
    physical_ = candidate;
    family_ = *family;
  }
  if (physical_ == VK_NULL_HANDLE) fail("no Vulkan 1.3 device");

  VkPhysicalDeviceIDProperties ids{.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_ID_PROPERTIES};
  VkPhysicalDeviceProperties2 properties{.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2, .pNext = &ids};
  vkGetPhysicalDeviceProperties2(physical_, &properties);
  name_ = properties.properties.deviceName;
  std::copy_n(ids.deviceUUID, VK_UUID_SIZE, identity_.device.begin());
  std::copy_n(ids.driverUUID, VK_UUID_SIZE, identity_.driver.begin());
}

void Device::create_device() {
  if (!has_extension(VK_KHR_EXTERNAL_MEMORY_FD_EXTENSION_NAME)) fail(name_ + " cannot export memory");
  std::vector<const char*> extensions{VK_KHR_EXTERNAL_MEMORY_FD_EXTENSION_NAME};
  const VkPhysicalDeviceExternalSemaphoreInfo kind{.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_EXTERNAL_SEMAPHORE_INFO,
                                                   .handleType = VK_EXTERNAL_SEMAPHORE_HANDLE_TYPE_OPAQUE_FD_BIT};
  VkExternalSemaphoreProperties semaphores{.sType = VK_STRUCTURE_TYPE_EXTERNAL_SEMAPHORE_PROPERTIES};
  vkGetPhysicalDeviceExternalSemaphoreProperties(physical_, &kind, &semaphores);
  exports_semaphores_ = has_extension(VK_KHR_EXTERNAL_SEMAPHORE_FD_EXTENSION_NAME) &&
                        (semaphores.externalSemaphoreFeatures & VK_EXTERNAL_SEMAPHORE_FEATURE_EXPORTABLE_BIT) != 0;
  if (exports_semaphores_) extensions.push_back(VK_KHR_EXTERNAL_SEMAPHORE_FD_EXTENSION_NAME);

  const float priority = 1.0F;
  const VkDeviceQueueCreateInfo queue{.sType = VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO,
                                      .queueFamilyIndex = family_,
                                      .queueCount = 1,
                                      .pQueuePriorities = &priority};
  const VkPhysicalDeviceVulkan13Features features{.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_3_FEATURES,
                                                  .synchronization2 = VK_TRUE,
                                                  .dynamicRendering = VK_TRUE};
  const VkDeviceCreateInfo create{.sType = VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO,
                                  .pNext = &features,
                                  .queueCreateInfoCount = 1,
                                  .pQueueCreateInfos = &queue,
                                  .enabledExtensionCount = static_cast<std::uint32_t>(extensions.size()),
                                  .ppEnabledExtensionNames = extensions.data()};
  check(vkCreateDevice(physical_, &create, nullptr, &device_), "vkCreateDevice");
  vkGetDeviceQueue(device_, family_, 0, &queue_);
  const VkCommandPoolCreateInfo pool{.sType = VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO,
                                     .flags = VK_COMMAND_POOL_CREATE_RESET_COMMAND_BUFFER_BIT,
                                     .queueFamilyIndex = family_};
  VkCommandPool created = VK_NULL_HANDLE;
  check(vkCreateCommandPool(device_, &pool, nullptr, &created), "vkCreateCommandPool");
  commands_ = {device_, created, vkDestroyCommandPool};
}

Owned<VkDeviceMemory> Device::allocate(const VkMemoryRequirements& needs, VkMemoryPropertyFlags properties,
                                       const void* next) const {
  VkPhysicalDeviceMemoryProperties types;
  vkGetPhysicalDeviceMemoryProperties(physical_, &types);
  for (std::uint32_t i = 0; i < types.memoryTypeCount; ++i) {
    if ((needs.memoryTypeBits & 1U << i) == 0 || (types.memoryTypes[i].propertyFlags & properties) != properties)
      continue;
    const VkMemoryAllocateInfo info{.sType = VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO,
                                    .pNext = next,
                                    .allocationSize = needs.size,
                                    .memoryTypeIndex = i};
    VkDeviceMemory memory = VK_NULL_HANDLE;
    check(vkAllocateMemory(device_, &info, nullptr, &memory), "vkAllocateMemory");
    return {device_, memory, vkFreeMemory};
  }
  fail("no type of memory fits");
}

Image Device::create_image(const ImageDesc& desc) const {
  const VkExternalMemoryImageCreateInfo external{.sType = VK_STRUCTURE_TYPE_EXTERNAL_MEMORY_IMAGE_CREATE_INFO,
                                                 .handleTypes = VK_EXTERNAL_MEMORY_HANDLE_TYPE_OPAQUE_FD_BIT};
  const VkImageCreateInfo create{.sType = VK_STRUCTURE_TYPE_IMAGE_CREATE_INFO,
                                 .pNext = desc.shared ? &external : nullptr,
                                 .imageType = VK_IMAGE_TYPE_2D,
                                 .format = desc.format,
                                 .extent = {desc.size.width, desc.size.height, 1},
                                 .mipLevels = 1,
                                 .arrayLayers = 1,
                                 .samples = VK_SAMPLE_COUNT_1_BIT,
                                 .tiling = VK_IMAGE_TILING_OPTIMAL,
                                 .usage = desc.usage};
  Image made;
  VkImage image = VK_NULL_HANDLE;
  check(vkCreateImage(device_, &create, nullptr, &image), "vkCreateImage");
  made.image = {device_, image, vkDestroyImage};

  VkMemoryRequirements needs;
  vkGetImageMemoryRequirements(device_, image, &needs);
  made.bytes = needs.size;
  const VkMemoryDedicatedAllocateInfo dedicated{.sType = VK_STRUCTURE_TYPE_MEMORY_DEDICATED_ALLOCATE_INFO,
                                                .image = image};
  const VkExportMemoryAllocateInfo exported{.sType = VK_STRUCTURE_TYPE_EXPORT_MEMORY_ALLOCATE_INFO,
                                            .pNext = &dedicated,
                                            .handleTypes = VK_EXTERNAL_MEMORY_HANDLE_TYPE_OPAQUE_FD_BIT};
  made.memory = allocate(needs, VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT, desc.shared ? &exported : nullptr);
  check(vkBindImageMemory(device_, image, made.memory.get(), 0), "vkBindImageMemory");

  const VkImageAspectFlags aspect =
      desc.format == VK_FORMAT_D32_SFLOAT ? VK_IMAGE_ASPECT_DEPTH_BIT : VK_IMAGE_ASPECT_COLOR_BIT;
  const VkImageViewCreateInfo view{.sType = VK_STRUCTURE_TYPE_IMAGE_VIEW_CREATE_INFO,
                                   .image = image,
                                   .viewType = VK_IMAGE_VIEW_TYPE_2D,
                                   .format = desc.format,
                                   .subresourceRange = {aspect, 0, 1, 0, 1}};
  VkImageView created = VK_NULL_HANDLE;
  check(vkCreateImageView(device_, &view, nullptr, &created), "vkCreateImageView");
  made.view = {device_, created, vkDestroyImageView};
  return made;
}

Buffer Device::create_buffer(VkDeviceSize bytes, bool host) const {
  const VkBufferCreateInfo create{.sType = VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO,
                                  .size = bytes,
                                  .usage = VK_BUFFER_USAGE_TRANSFER_SRC_BIT | VK_BUFFER_USAGE_TRANSFER_DST_BIT};
  Buffer made;
  VkBuffer buffer = VK_NULL_HANDLE;
  check(vkCreateBuffer(device_, &create, nullptr, &buffer), "vkCreateBuffer");
  made.buffer = {device_, buffer, vkDestroyBuffer};
  VkMemoryRequirements needs;
  vkGetBufferMemoryRequirements(device_, buffer, &needs);
  made.memory = allocate(needs,
                         host ? VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT
                              : VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT,
                         nullptr);
  check(vkBindBufferMemory(device_, buffer, made.memory.get(), 0), "vkBindBufferMemory");
  return made;
}

Owned<VkSemaphore> Device::create_shared_semaphore() const {
  const VkExportSemaphoreCreateInfo exported{.sType = VK_STRUCTURE_TYPE_EXPORT_SEMAPHORE_CREATE_INFO,
                                             .handleTypes = VK_EXTERNAL_SEMAPHORE_HANDLE_TYPE_OPAQUE_FD_BIT};
  const VkSemaphoreCreateInfo create{.sType = VK_STRUCTURE_TYPE_SEMAPHORE_CREATE_INFO, .pNext = &exported};
  VkSemaphore semaphore = VK_NULL_HANDLE;
  check(vkCreateSemaphore(device_, &create, nullptr, &semaphore), "vkCreateSemaphore");
  return {device_, semaphore, vkDestroySemaphore};
}

int Device::export_memory(VkDeviceMemory memory) const {
  const auto get = reinterpret_cast<PFN_vkGetMemoryFdKHR>(vkGetDeviceProcAddr(device_, "vkGetMemoryFdKHR"));
  const VkMemoryGetFdInfoKHR info{.sType = VK_STRUCTURE_TYPE_MEMORY_GET_FD_INFO_KHR,
                                  .memory = memory,
                                  .handleType = VK_EXTERNAL_MEMORY_HANDLE_TYPE_OPAQUE_FD_BIT};
  int descriptor = -1;
  check(get(device_, &info, &descriptor), "vkGetMemoryFdKHR");
  return descriptor;
}

int Device::export_semaphore(VkSemaphore semaphore) const {
  const auto get = reinterpret_cast<PFN_vkGetSemaphoreFdKHR>(vkGetDeviceProcAddr(device_, "vkGetSemaphoreFdKHR"));
  const VkSemaphoreGetFdInfoKHR info{.sType = VK_STRUCTURE_TYPE_SEMAPHORE_GET_FD_INFO_KHR,
                                     .semaphore = semaphore,
                                     .handleType = VK_EXTERNAL_SEMAPHORE_HANDLE_TYPE_OPAQUE_FD_BIT};
  int descriptor = -1;
  check(get(device_, &info, &descriptor), "vkGetSemaphoreFdKHR");
  return descriptor;
}

VkCommandBuffer Device::create_commands() const {
  const VkCommandBufferAllocateInfo allocation{.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO,
                                               .commandPool = commands_.get(),
                                               .level = VK_COMMAND_BUFFER_LEVEL_PRIMARY,
                                               .commandBufferCount = 1};
  VkCommandBuffer commands = VK_NULL_HANDLE;
  check(vkAllocateCommandBuffers(device_, &allocation, &commands), "vkAllocateCommandBuffers");
  return commands;
}

void Device::begin(VkCommandBuffer commands) {
  const VkCommandBufferBeginInfo begin{.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO,
                                       .flags = VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT};
  check(vkBeginCommandBuffer(commands, &begin), "vkBeginCommandBuffer");
}

void Device::submit(VkCommandBuffer commands, VkSemaphore wait_for, VkSemaphore signal) const {
  check(vkEndCommandBuffer(commands), "vkEndCommandBuffer");
  const auto semaphore = [](VkSemaphore used) {
    return VkSemaphoreSubmitInfo{.sType = VK_STRUCTURE_TYPE_SEMAPHORE_SUBMIT_INFO,
                                 .semaphore = used,
                                 .stageMask = VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT};
  };
  const VkSemaphoreSubmitInfo before = semaphore(wait_for);
  const VkSemaphoreSubmitInfo after = semaphore(signal);
  const VkCommandBufferSubmitInfo buffer{.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_SUBMIT_INFO,
                                         .commandBuffer = commands};
  const VkSubmitInfo2 submission{.sType = VK_STRUCTURE_TYPE_SUBMIT_INFO_2,
                                 .waitSemaphoreInfoCount = wait_for == VK_NULL_HANDLE ? 0U : 1U,
                                 .pWaitSemaphoreInfos = &before,
                                 .commandBufferInfoCount = 1,
                                 .pCommandBufferInfos = &buffer,
                                 .signalSemaphoreInfoCount = signal == VK_NULL_HANDLE ? 0U : 1U,
                                 .pSignalSemaphoreInfos = &after};
  check(vkQueueSubmit2(queue_, 1, &submission, VK_NULL_HANDLE), "vkQueueSubmit2");
}

void Device::wait_idle() const { check(vkQueueWaitIdle(queue_), "vkQueueWaitIdle"); }

}  // namespace vulkan_host
