#pragma once
#include <vulkan/vulkan.h>

#include <array>
#include <cstdint>
#include <string>
#include <utility>

namespace vulkan_host {

/// Ends the program with a line that says the cause.
[[noreturn]] void fail(const std::string& cause);
void check(VkResult result, const char* call);

/// A Vulkan object that ends with its owner.
template <class Handle>
class Owned {
 public:
  using Destroy = void (*)(VkDevice, Handle, const VkAllocationCallbacks*);

  Owned() = default;
  Owned(VkDevice device, Handle handle, Destroy destroy) : device_(device), handle_(handle), destroy_(destroy) {}
  Owned(Owned&& other) noexcept { swap(other); }
  Owned& operator=(Owned&& other) noexcept {
    swap(other);
    return *this;
  }
  Owned(const Owned&) = delete;
  Owned& operator=(const Owned&) = delete;
  ~Owned() {
    if (handle_ != VK_NULL_HANDLE) destroy_(device_, handle_, nullptr);
  }
  [[nodiscard]] Handle get() const { return handle_; }
  [[nodiscard]] const Handle* address() const { return &handle_; }

 private:
  void swap(Owned& other) noexcept {
    std::swap(device_, other.device_);
    std::swap(handle_, other.handle_);
    std::swap(destroy_, other.destroy_);
  }

  VkDevice device_ = VK_NULL_HANDLE;
  Handle handle_ = VK_NULL_HANDLE;
  Destroy destroy_ = nullptr;
};

/// An image with its memory and a view of all of it.
struct Image {
  Owned<VkDeviceMemory> memory;
  Owned<VkImage> image;
  Owned<VkImageView> view;
  VkDeviceSize bytes = 0;  ///< of the memory
};

struct Buffer {
  Owned<VkDeviceMemory> memory;
  Owned<VkBuffer> buffer;
};

struct ImageDesc {
  VkFormat format = VK_FORMAT_UNDEFINED;
  VkExtent2D size{};
  VkImageUsageFlags usage = 0;
  bool shared = false;  ///< its memory can be exported
};

/// UUIDs of a device and its driver, by which OpenGL and Vulkan recognize each other.
struct Identity {
  std::array<std::uint8_t, VK_UUID_SIZE> device{};
  std::array<std::uint8_t, VK_UUID_SIZE> driver{};

  bool operator==(const Identity&) const = default;
};

/// A Vulkan 1.3 device that exports memory by file descriptors, with one queue.
class Device {
 public:
  Device();
  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;
  ~Device();

  [[nodiscard]] VkDevice get() const { return device_; }
  [[nodiscard]] std::uint32_t family() const { return family_; }  ///< of its queue
  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] const Identity& identity() const { return identity_; }
  [[nodiscard]] bool exports_semaphores() const { return exports_semaphores_; }

  [[nodiscard]] Image create_image(const ImageDesc& desc) const;
  /// A buffer for transfers. Its memory is mapped by the caller if `host` is true.
  [[nodiscard]] Buffer create_buffer(VkDeviceSize bytes, bool host) const;
  [[nodiscard]] Owned<VkSemaphore> create_shared_semaphore() const;
  /// File descriptors, which the caller owns.
  [[nodiscard]] int export_memory(VkDeviceMemory memory) const;
  [[nodiscard]] int export_semaphore(VkSemaphore semaphore) const;

  /// Commands to be recorded for each frame. They end with the device.
  [[nodiscard]] VkCommandBuffer create_commands() const;
  /// Begins a recording, in place of an earlier one.
  static void begin(VkCommandBuffer commands);
  /// Ends the recording and submits it. VK_NULL_HANDLE is no semaphore.
  void submit(VkCommandBuffer commands, VkSemaphore wait_for, VkSemaphore signal) const;
  void wait_idle() const;

 private:
  void choose_physical_device();
  void create_device();
  [[nodiscard]] bool has_extension(const char* name) const;
  [[nodiscard]] Owned<VkDeviceMemory> allocate(const VkMemoryRequirements& needs, VkMemoryPropertyFlags properties,
                                               const void* next) const;

  VkInstance instance_ = VK_NULL_HANDLE;
  VkPhysicalDevice physical_ = VK_NULL_HANDLE;
  VkDevice device_ = VK_NULL_HANDLE;
  VkQueue queue_ = VK_NULL_HANDLE;
  Owned<VkCommandPool> commands_;
  std::uint32_t family_ = 0;
  std::string name_;
  Identity identity_;
  bool exports_semaphores_ = false;
};

}  // namespace vulkan_host
