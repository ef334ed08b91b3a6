// A library with the C interface of Open Image Denoise that oidn_library_test loads. Its filter adds one to green and
// writes the albedo's red to blue, so that the test sees which images it has received. It refuses images whose first
// normal has an x above 2, and all images while FAKE_OIDN_FAILS is set. The macro selects the version.

#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <map>
#include <string>

namespace {

int live_devices = 0;
int live_filters = 0;
std::string error_text;
int error_code = 0;

struct Image {
  char* data;
  std::size_t width;
  std::size_t height;
  std::size_t pixel_stride;
  std::size_t row_stride;

  [[nodiscard]] float* pixel(std::size_t x, std::size_t y) const {
    return reinterpret_cast<float*>(data + y * row_stride + x * pixel_stride);
  }
};

void fail(const char* text) {
  error_code = 2;
  error_text = text;
}

}  // namespace

extern "C" {

struct FakeDevice {
  bool committed;
};

struct FakeFilter {
  std::map<std::string, Image> images;
  std::map<std::string, bool> switches;
  bool committed;
};

FakeDevice* oidnNewDevice(int type) {
  if (type != 1) return nullptr;
  ++live_devices;
  return new FakeDevice{false};
}
void oidnCommitDevice(FakeDevice* device) { device->committed = true; }
void oidnReleaseDevice(FakeDevice* device) {
  --live_devices;
  delete device;
}
int oidnGetDeviceError(FakeDevice* /*device*/, const char** message) {
  const int code = error_code;
  error_code = 0;
  *message = error_text.c_str();
  return code;
}
FakeFilter* oidnNewFilter(FakeDevice* device, const char* type) {
  if (!device->committed || std::strcmp(type, "RT") != 0) {
    fail("the device or the type is wrong");
    return nullptr;
  }
  ++live_filters;
  return new FakeFilter{{}, {}, false};
}
void oidnReleaseFilter(FakeFilter* filter) {
  --live_filters;
  delete filter;
}
void oidnSetSharedFilterImage(FakeFilter* filter, const char* name, void* data, int format, std::size_t width,
                              std::size_t height, std::size_t offset, std::size_t pixel_stride,
                              std::size_t row_stride) {
  if (format != 3) return fail("the format is not FLOAT3");
  filter->images[name] = {static_cast<char*>(data) + offset, width, height, pixel_stride, row_stride};
}
void oidnCommitFilter(FakeFilter* filter) { filter->committed = true; }
void oidnExecuteFilter(FakeFilter* filter) {
  if (!filter->committed || filter->images.size() != 4) return fail("the filter is not complete");
  if (!filter->switches["hdr"] || !filter->switches["cleanAux"]) return fail("the switches are wrong");
  if (std::getenv("FAKE_OIDN_FAILS") != nullptr) return fail("no memory");
  const Image& color = filter->images["color"];
  const Image& result = filter->images["output"];
  if (filter->images["normal"].pixel(0, 0)[0] > 2.0F) return fail("the normals are wrong");
  for (std::size_t y = 0; y < color.height; ++y) {
    for (std::size_t x = 0; x < color.width; ++x) {
      const float* from = color.pixel(x, y);
      float* to = result.pixel(x, y);
      to[0] = from[0];
      to[1] = from[1] + 1.0F;
      to[2] = filter->images["albedo"].pixel(x, y)[0];
    }
  }
}

#if FAKE_OIDN_VERSION >= 20000
int oidnGetDeviceInt(FakeDevice*, const char* name) {
  return std::strcmp(name, "version") == 0 ? FAKE_OIDN_VERSION : 0;
}
void oidnSetFilterBool(FakeFilter* filter, const char* name, bool value) { filter->switches[name] = value; }
#else
int oidnGetDevice1i(FakeDevice*, const char* name) { return std::strcmp(name, "version") == 0 ? FAKE_OIDN_VERSION : 0; }
void oidnSetFilter1b(FakeFilter* filter, const char* name, bool value) { filter->switches[name] = value; }
#endif

/// Returns the number of objects that were not released.
int fake_oidn_objects() { return live_devices + live_filters; }
}
