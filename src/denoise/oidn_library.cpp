#include "denoise/oidn_library.hpp"

#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#if __has_include(<dlfcn.h>)
#include <dlfcn.h>
#endif

namespace cumulet::denoise {

namespace {

// The C interface of Open Image Denoise, which is the same in versions 1.4 to 2 except for two names.
constexpr int device_type_cpu = 1;
constexpr int error_none = 0;
constexpr int error_out_of_memory = 4;
constexpr int format_float3 = 3;
constexpr int min_version = 10400;  // the first one with the parameter cleanAux

[[maybe_unused]] constexpr std::array usual_names = {"libOpenImageDenoise.so.2", "libOpenImageDenoise.so.1"};

struct DeviceObject;
struct FilterObject;

#if __has_include(<dlfcn.h>)
void* load(const std::string& file) {
  const auto open = [](const char* name) { return dlopen(name, RTLD_NOW | RTLD_LOCAL | RTLD_NODELETE); };
  if (!file.empty()) {
    if (void* const library = open(file.c_str())) return library;
    const char* const cause = dlerror();
    throw OidnError(ErrorCode::unsupported, cause != nullptr ? cause : file + ": cannot be loaded");
  }
  std::string broken;
  for (const char* const name : usual_names) {
    if (void* const library = open(name)) return library;
    const char* const error = dlerror();
    const std::string cause = error != nullptr ? error : name;
    // The error has a path, or the name of another library, only if a file was found. Its text may be translated.
    const bool found = cause.find('/') != std::string::npos || cause.find(name) == std::string::npos;
    if (found && broken.empty()) broken = std::string(name) + " is installed but cannot be loaded: " + cause;
  }
  if (!broken.empty()) throw OidnError(ErrorCode::unsupported, broken);
  throw OidnMissing(ErrorCode::unsupported, "libOpenImageDenoise.so is not installed");
}

template <class Function>
bool find(void* library, const char* name, Function& function) {
  function = reinterpret_cast<Function>(dlsym(library, name));
  return function != nullptr;
}
#else
void* load(const std::string& file) { throw OidnError(ErrorCode::unsupported, file + ": this system has no dlopen"); }

template <class Function>
bool find(void* /*library*/, const char* /*name*/, Function& /*function*/) {
  return false;
}
#endif

bool is_finite(const glm::vec4& pixel) {
  return std::isfinite(pixel.r) && std::isfinite(pixel.g) && std::isfinite(pixel.b);
}

}  // namespace

struct OidnLibrary::Functions {
  DeviceObject* (*new_device)(int type) = nullptr;
  void (*commit_device)(DeviceObject*) = nullptr;
  void (*release_device)(DeviceObject*) = nullptr;
  int (*get_device_int)(DeviceObject*, const char* name) = nullptr;
  int (*get_device_error)(DeviceObject*, const char** message) = nullptr;
  FilterObject* (*new_filter)(DeviceObject*, const char* type) = nullptr;
  void (*set_shared_image)(FilterObject*, const char* name, void* data, int format, std::size_t width,
                           std::size_t height, std::size_t offset, std::size_t pixel_stride,
                           std::size_t row_stride) = nullptr;
  void (*set_filter_bool)(FilterObject*, const char* name, bool value) = nullptr;
  void (*commit_filter)(FilterObject*) = nullptr;
  void (*execute_filter)(FilterObject*) = nullptr;
  void (*release_filter)(FilterObject*) = nullptr;

  explicit Functions(void* library) {
    const bool known =
        find(library, "oidnNewDevice", new_device) && find(library, "oidnCommitDevice", commit_device) &&
        find(library, "oidnReleaseDevice", release_device) &&
        (find(library, "oidnGetDeviceInt", get_device_int) || find(library, "oidnGetDevice1i", get_device_int)) &&
        find(library, "oidnGetDeviceError", get_device_error) && find(library, "oidnNewFilter", new_filter) &&
        find(library, "oidnSetSharedFilterImage", set_shared_image) &&
        (find(library, "oidnSetFilterBool", set_filter_bool) || find(library, "oidnSetFilter1b", set_filter_bool)) &&
        find(library, "oidnCommitFilter", commit_filter) && find(library, "oidnExecuteFilter", execute_filter) &&
        find(library, "oidnReleaseFilter", release_filter);
    if (!known) throw OidnError(ErrorCode::unsupported, "the library is not Open Image Denoise 1.4 or later");
  }
};

struct OidnLibrary::Device {
  Functions functions;
  DeviceObject* object = nullptr;
  int version = 0;

  explicit Device(void* library) : functions(library) {
    object = functions.new_device(device_type_cpu);
    if (object == nullptr) check("Open Image Denoise has no device for this CPU");
    try {
      functions.commit_device(object);
      check("Open Image Denoise cannot use this CPU");
      version = functions.get_device_int(object, "version");
      if (version < min_version)
        throw OidnError(ErrorCode::unsupported, "the version of Open Image Denoise is older than 1.4");
    } catch (...) {
      functions.release_device(object);
      throw;
    }
  }
  ~Device() { functions.release_device(object); }
  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;

  // Throws the error of the last calls. Without a device it always throws.
  void check(const char* what) const {
    const char* message = nullptr;
    const int error = functions.get_device_error(object, &message);
    if (object != nullptr && error == error_none) return;
    std::string text = what;
    if (message != nullptr && *message != '\0') text.append(": ").append(message);
    throw OidnError(error == error_out_of_memory ? ErrorCode::out_of_memory : ErrorCode::unsupported, text);
  }
};

OidnLibrary::OidnLibrary(const std::string& file) : device_(std::make_shared<const Device>(load(file))) {}

std::string OidnLibrary::version() const {
  constexpr int part = 100;
  const int number = device_->version;
  return std::to_string(number / (part * part)) + '.' + std::to_string(number / part % part) + '.' +
         std::to_string(number % part);
}

void OidnLibrary::denoise(const OidnImage& image, std::span<glm::vec4> result) const {
  const Functions& functions = device_->functions;
  // A channel that is not finite would spread over its surroundings.
  std::vector<glm::vec4> color(image.color.begin(), image.color.end());
  for (glm::vec4& pixel : color)
    if (!is_finite(pixel)) pixel = glm::vec4(0.0F);

  const std::unique_ptr<FilterObject, void (*)(FilterObject*)> filter(functions.new_filter(device_->object, "RT"),
                                                                      functions.release_filter);
  if (filter == nullptr) device_->check("creating a filter of Open Image Denoise");
  const auto set = [&](const char* name, const void* pixels) {
    // The library takes a mutable pointer for images that it only reads too.
    functions.set_shared_image(filter.get(), name, const_cast<void*>(pixels), format_float3, image.size.x, image.size.y,
                               0, sizeof(glm::vec4), std::size_t{image.size.x} * sizeof(glm::vec4));
  };
  set("color", color.data());
  set("albedo", image.albedo.data());
  set("normal", image.normal.data());
  set("output", result.data());
  functions.set_filter_bool(filter.get(), "hdr", true);
  functions.set_filter_bool(filter.get(), "cleanAux", true);
  functions.commit_filter(filter.get());
  functions.execute_filter(filter.get());
  device_->check("denoising by Open Image Denoise");
  for (std::size_t i = 0; i < result.size(); ++i) {
    if (!is_finite(image.color[i])) result[i] = image.color[i];
    result[i].a = image.color[i].a;
  }
}

}  // namespace cumulet::denoise
