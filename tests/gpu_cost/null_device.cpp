#include "null_device.hpp"

#include <array>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <functional>
#include <map>
#include <stdexcept>
#include <vector>

#include "spirv.hpp"

namespace cumulet::gpu_cost {

namespace {

template <typename T>
T make(VkStructureType type) {
  T value{};
  value.sType = type;
  return value;
}

void check(VkResult result, const char* what) {
  if (result != VK_SUCCESS) throw std::runtime_error(std::string(what) + ": Vulkan error " + std::to_string(result));
}

// Destroys the created objects in all cases.
struct Cleaner {
  std::vector<std::function<void()>> steps;
  ~Cleaner() {
    for (auto step = steps.rbegin(); step != steps.rend(); ++step) (*step)();
  }
};

VkShaderModule make_module(VkDevice device, const Module& module, Cleaner& cleaner) {
  auto info = make<VkShaderModuleCreateInfo>(VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO);
  info.codeSize = module.words.size() * 4;
  info.pCode = module.words.data();
  VkShaderModule made = VK_NULL_HANDLE;
  check(vkCreateShaderModule(device, &info, nullptr, &made), "a shader module");
  cleaner.steps.emplace_back([=] { vkDestroyShaderModule(device, made, nullptr); });
  return made;
}

VkPipelineLayout make_layout(VkDevice device, const std::vector<const Module*>& modules, Cleaner& cleaner) {
  std::map<std::uint32_t, Descriptor> all;
  for (const Module* module : modules) all.insert(module->bindings.begin(), module->bindings.end());
  std::vector<VkDescriptorSetLayoutBinding> bindings;
  for (const auto& [number, descriptor] : all) {
    bindings.push_back({number, descriptor.type, descriptor.count, VK_SHADER_STAGE_ALL, nullptr});
  }
  auto set_info = make<VkDescriptorSetLayoutCreateInfo>(VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO);
  set_info.bindingCount = static_cast<std::uint32_t>(bindings.size());
  set_info.pBindings = bindings.data();
  VkDescriptorSetLayout set = VK_NULL_HANDLE;
  check(vkCreateDescriptorSetLayout(device, &set_info, nullptr, &set), "a set's layout");
  cleaner.steps.emplace_back([=] { vkDestroyDescriptorSetLayout(device, set, nullptr); });
  auto info = make<VkPipelineLayoutCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO);
  info.setLayoutCount = 1;
  info.pSetLayouts = &set;
  VkPipelineLayout layout = VK_NULL_HANDLE;
  check(vkCreatePipelineLayout(device, &info, nullptr, &layout), "a pipeline's layout");
  cleaner.steps.emplace_back([=] { vkDestroyPipelineLayout(device, layout, nullptr); });
  return layout;
}

VkPipelineShaderStageCreateInfo stage_of(VkShaderModule module, VkShaderStageFlagBits stage) {
  auto info = make<VkPipelineShaderStageCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO);
  info.stage = stage;
  info.module = module;
  info.pName = "main";
  return info;
}

VkPipeline make_compute(VkDevice device, const Kernel& kernel, Cleaner& cleaner) {
  const Module module = compile(kernel.compute, "comp");
  auto info = make<VkComputePipelineCreateInfo>(VK_STRUCTURE_TYPE_COMPUTE_PIPELINE_CREATE_INFO);
  info.flags = VK_PIPELINE_CREATE_CAPTURE_STATISTICS_BIT_KHR;
  info.stage = stage_of(make_module(device, module, cleaner), VK_SHADER_STAGE_COMPUTE_BIT);
  info.layout = make_layout(device, {&module}, cleaner);
  VkPipeline pipeline = VK_NULL_HANDLE;
  check(vkCreateComputePipelines(device, VK_NULL_HANDLE, 1, &info, nullptr, &pipeline), "a compute pipeline");
  return pipeline;
}

// A pipeline of triangles with a float target per output of the fragment shader, and a depth attachment.
VkPipeline make_graphics(VkDevice device, const Kernel& kernel, Cleaner& cleaner) {
  const Module vertex = compile(kernel.vertex, "vert");
  const Module fragment = compile(kernel.fragment, "frag");
  const std::array stages{stage_of(make_module(device, vertex, cleaner), VK_SHADER_STAGE_VERTEX_BIT),
                          stage_of(make_module(device, fragment, cleaner), VK_SHADER_STAGE_FRAGMENT_BIT)};
  const VkVertexInputBindingDescription buffer{0, 16U * 16U, VK_VERTEX_INPUT_RATE_VERTEX};
  std::vector<VkVertexInputAttributeDescription> attributes;
  for (const std::uint32_t location : vertex.inputs) {
    attributes.push_back({location, 0, VK_FORMAT_R32G32B32A32_SFLOAT, 16U * location});
  }
  auto input = make<VkPipelineVertexInputStateCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_VERTEX_INPUT_STATE_CREATE_INFO);
  input.vertexBindingDescriptionCount = attributes.empty() ? 0 : 1;
  input.pVertexBindingDescriptions = &buffer;
  input.vertexAttributeDescriptionCount = static_cast<std::uint32_t>(attributes.size());
  input.pVertexAttributeDescriptions = attributes.data();
  auto assembly =
      make<VkPipelineInputAssemblyStateCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_INPUT_ASSEMBLY_STATE_CREATE_INFO);
  assembly.topology = VK_PRIMITIVE_TOPOLOGY_TRIANGLE_LIST;
  const VkViewport viewport{0, 0, 256, 256, 0, 1};
  const VkRect2D scissor{{0, 0}, {256, 256}};
  auto view = make<VkPipelineViewportStateCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_VIEWPORT_STATE_CREATE_INFO);
  view.viewportCount = view.scissorCount = 1;
  view.pViewports = &viewport;
  view.pScissors = &scissor;
  auto raster =
      make<VkPipelineRasterizationStateCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_RASTERIZATION_STATE_CREATE_INFO);
  raster.lineWidth = 1;
  auto samples = make<VkPipelineMultisampleStateCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_MULTISAMPLE_STATE_CREATE_INFO);
  samples.rasterizationSamples = VK_SAMPLE_COUNT_1_BIT;
  auto depth = make<VkPipelineDepthStencilStateCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_DEPTH_STENCIL_STATE_CREATE_INFO);
  depth.depthTestEnable = depth.depthWriteEnable = VK_TRUE;
  VkPipelineColorBlendAttachmentState blended{};
  blended.colorWriteMask = 0xf;
  const std::vector<VkPipelineColorBlendAttachmentState> targets(fragment.outputs.size(), blended);
  auto blend = make<VkPipelineColorBlendStateCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_COLOR_BLEND_STATE_CREATE_INFO);
  blend.attachmentCount = static_cast<std::uint32_t>(targets.size());
  blend.pAttachments = targets.data();
  const std::vector<VkFormat> formats(targets.size(), VK_FORMAT_R32G32B32A32_SFLOAT);
  auto rendering = make<VkPipelineRenderingCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_RENDERING_CREATE_INFO);
  rendering.colorAttachmentCount = blend.attachmentCount;
  rendering.pColorAttachmentFormats = formats.data();
  rendering.depthAttachmentFormat = VK_FORMAT_D32_SFLOAT;
  auto info = make<VkGraphicsPipelineCreateInfo>(VK_STRUCTURE_TYPE_GRAPHICS_PIPELINE_CREATE_INFO);
  info.pNext = &rendering;
  info.flags = VK_PIPELINE_CREATE_CAPTURE_STATISTICS_BIT_KHR;
  info.stageCount = static_cast<std::uint32_t>(stages.size());
  info.pStages = stages.data();
  info.pVertexInputState = &input;
  info.pInputAssemblyState = &assembly;
  info.pViewportState = &view;
  info.pRasterizationState = &raster;
  info.pMultisampleState = &samples;
  info.pDepthStencilState = &depth;
  info.pColorBlendState = &blend;
  info.layout = make_layout(device, {&vertex, &fragment}, cleaner);
  VkPipeline pipeline = VK_NULL_HANDLE;
  check(vkCreateGraphicsPipelines(device, VK_NULL_HANDLE, 1, &info, nullptr, &pipeline), "a graphics pipeline");
  return pipeline;
}

template <typename F>
F function(VkDevice device, const char* name) {
  return reinterpret_cast<F>(vkGetDeviceProcAddr(device, name));
}

}  // namespace

std::unique_ptr<NullDevice> NullDevice::open(const std::string& family) {
  if (!std::filesystem::exists(CUMULET_RADV_ICD)) return nullptr;
  setenv("RADV_FORCE_FAMILY", family.c_str(), 1);
  setenv("VK_ICD_FILENAMES", CUMULET_RADV_ICD, 1);
  setenv("VK_DRIVER_FILES", CUMULET_RADV_ICD, 1);
  setenv("MESA_SHADER_CACHE_DISABLE", "true", 1);
  setenv("RADV_DEBUG", "nocache", 1);
  std::unique_ptr<NullDevice> made(new NullDevice);
  auto app = make<VkApplicationInfo>(VK_STRUCTURE_TYPE_APPLICATION_INFO);
  app.apiVersion = VK_API_VERSION_1_3;
  auto info = make<VkInstanceCreateInfo>(VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO);
  info.pApplicationInfo = &app;
  if (vkCreateInstance(&info, nullptr, &made->instance_) != VK_SUCCESS) return nullptr;
  std::uint32_t count = 1;
  VkPhysicalDevice physical = VK_NULL_HANDLE;
  const VkResult found = vkEnumeratePhysicalDevices(made->instance_, &count, &physical);
  if ((found != VK_SUCCESS && found != VK_INCOMPLETE) || count == 0) return nullptr;
  auto driver = make<VkPhysicalDeviceDriverProperties>(VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_DRIVER_PROPERTIES);
  auto properties = make<VkPhysicalDeviceProperties2>(VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2);
  properties.pNext = &driver;
  vkGetPhysicalDeviceProperties2(physical, &properties);
  made->version_ = static_cast<const char*>(driver.driverInfo);
  const char* name = static_cast<const char*>(properties.properties.deviceName);
  if (std::strstr(name, "Null hardware") == nullptr) return nullptr;
  made->waves_of_32_ = std::strstr(name, "NAVI") != nullptr || std::strstr(name, "GFX1") != nullptr;

  auto statistics = make<VkPhysicalDevicePipelineExecutablePropertiesFeaturesKHR>(
      VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PIPELINE_EXECUTABLE_PROPERTIES_FEATURES_KHR);
  statistics.pipelineExecutableInfo = VK_TRUE;
  auto rendering =
      make<VkPhysicalDeviceDynamicRenderingFeatures>(VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_DYNAMIC_RENDERING_FEATURES);
  rendering.dynamicRendering = VK_TRUE;
  rendering.pNext = &statistics;
  const float priority = 1;
  auto queue = make<VkDeviceQueueCreateInfo>(VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO);
  queue.queueCount = 1;
  queue.pQueuePriorities = &priority;
  const char* extension = VK_KHR_PIPELINE_EXECUTABLE_PROPERTIES_EXTENSION_NAME;
  auto device = make<VkDeviceCreateInfo>(VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO);
  device.pNext = &rendering;
  device.queueCreateInfoCount = 1;
  device.pQueueCreateInfos = &queue;
  device.enabledExtensionCount = 1;
  device.ppEnabledExtensionNames = &extension;
  check(vkCreateDevice(physical, &device, nullptr, &made->device_), "the null device");
  return made;
}

NullDevice::~NullDevice() {
  if (device_ != VK_NULL_HANDLE) vkDestroyDevice(device_, nullptr);
  if (instance_ != VK_NULL_HANDLE) vkDestroyInstance(instance_, nullptr);
}

Cost NullDevice::cost(const Kernel& kernel) {
  Cleaner cleaner;
  VkPipeline pipeline =
      kernel.compute.empty() ? make_graphics(device_, kernel, cleaner) : make_compute(device_, kernel, cleaner);
  cleaner.steps.emplace_back([=, this] { vkDestroyPipeline(device_, pipeline, nullptr); });
  return cost_of(pipeline);
}

Cost NullDevice::cost_of(VkPipeline pipeline) const {
  const auto get_executables =
      function<PFN_vkGetPipelineExecutablePropertiesKHR>(device_, "vkGetPipelineExecutablePropertiesKHR");
  const auto get_statistics =
      function<PFN_vkGetPipelineExecutableStatisticsKHR>(device_, "vkGetPipelineExecutableStatisticsKHR");
  auto info = make<VkPipelineInfoKHR>(VK_STRUCTURE_TYPE_PIPELINE_INFO_KHR);
  info.pipeline = pipeline;
  std::uint32_t count = 0;
  check(get_executables(device_, &info, &count, nullptr), "executables");
  std::vector<VkPipelineExecutablePropertiesKHR> executables(
      count, make<VkPipelineExecutablePropertiesKHR>(VK_STRUCTURE_TYPE_PIPELINE_EXECUTABLE_PROPERTIES_KHR));
  check(get_executables(device_, &info, &count, executables.data()), "executables");
  for (std::uint32_t i = 0; i < count; ++i) {
    if ((executables[i].stages & (VK_SHADER_STAGE_COMPUTE_BIT | VK_SHADER_STAGE_FRAGMENT_BIT)) == 0) continue;
    auto which = make<VkPipelineExecutableInfoKHR>(VK_STRUCTURE_TYPE_PIPELINE_EXECUTABLE_INFO_KHR);
    which.pipeline = pipeline;
    which.executableIndex = i;
    std::uint32_t number = 0;
    check(get_statistics(device_, &which, &number, nullptr), "statistics");
    std::vector<VkPipelineExecutableStatisticKHR> statistics(
        number, make<VkPipelineExecutableStatisticKHR>(VK_STRUCTURE_TYPE_PIPELINE_EXECUTABLE_STATISTIC_KHR));
    check(get_statistics(device_, &which, &number, statistics.data()), "statistics");
    std::map<std::string, std::uint32_t> values;
    for (const VkPipelineExecutableStatisticKHR& s : statistics) {
      values[static_cast<const char*>(s.name)] = static_cast<std::uint32_t>(s.value.u64);
    }
    Cost cost;
    cost.registers = values.at("VGPRs");
    cost.spilled = values.at("Spilled VGPRs");
    cost.spilled_scalars = values.at("Spilled SGPRs");
    cost.scratch_bytes = values.at("Scratch size");
    cost.shared_bytes = values.at("LDS size");
    cost.code_bytes = values.at("Code size");
    // RDNA's registers are counted for waves of 32, but our work groups run as waves of 64.
    cost.waves = values.at("Subgroups per SIMD") * (waves_of_32_ ? 32U : 64U) / executables[i].subgroupSize;
    return cost;
  }
  throw std::runtime_error("the driver reports nothing about the pipeline");
}

}  // namespace cumulet::gpu_cost
