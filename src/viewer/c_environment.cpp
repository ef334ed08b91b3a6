// Environments of the C ABI.

#include <vector>

#include "light/environment.hpp"
#include "light/environment_file.hpp"
#include "viewer/c_handles.hpp"
#include "viewer/c_stream.hpp"
#include "viewer/c_support.hpp"

using namespace cumulet;
using namespace cumulet::c_abi;

cumulet_status cumulet_environment_open(const char* path, cumulet_environment** out, char* error, size_t error_size) {
  return make_handle(out, error, error_size, [&] {
    require(path != nullptr && *path != '\0', "path is NULL or empty");
    return light::open_environment(path);
  });
}

cumulet_status cumulet_environment_from_memory(const void* bytes, size_t size, const char* name,
                                               cumulet_environment** out, char* error, size_t error_size) {
  return make_handle(out, error, error_size, [&] {
    const std::string what = name_or(name, "memory");
    MemorySource content(array_of(static_cast<const std::byte*>(bytes), size, 1, what + ": bytes"));
    return light::read_environment_content(content, what);
  });
}

cumulet_status cumulet_environment_from_stream(const cumulet_stream_desc* stream, const char* name,
                                               cumulet_environment** out, char* error, size_t error_size) {
  return make_handle(out, error, error_size, [&] {
    HostStream content(stream);
    return light::read_environment_content(content, name_or(name, "stream"));
  });
}

cumulet_status cumulet_environment_from_pixels(const cumulet_environment_desc* desc, cumulet_environment** out,
                                               char* error, size_t error_size) {
  return make_handle(out, error, error_size, [&] {
    const cumulet_environment_desc d = read_desc(desc, "cumulet_environment_desc");
    const std::string name = name_or(d.name, "environment");
    const auto values = array_of(d.values, d.value_count, 1, name + ": values");
    if (d.value_count != std::uint64_t{3} * d.width * d.height)
      refuse(name + ": value_count is not 3 x width x height");
    light::EnvironmentPixels pixels{d.width, d.height, {}};
    pixels.values.reserve(values.size() / 3);
    for (size_t i = 0; i < values.size(); i += 3) pixels.values.emplace_back(values[i], values[i + 1], values[i + 2]);
    return light::make_environment(pixels, name);
  });
}

cumulet_environment* cumulet_environment_retain(cumulet_environment* environment) { return retain(environment); }

void cumulet_environment_release(cumulet_environment* environment) { release(environment); }

cumulet_status cumulet_environment_get_info(const cumulet_environment* environment, cumulet_environment_info* info) {
  return guarded(nullptr, 0, [&] {
    require(environment != nullptr, "environment is NULL");
    read_desc(info, "cumulet_environment_info");
    const light::Environment& asset = *environment->asset;
    cumulet_environment_info out{};
    copy_text(asset.name, out.name, sizeof out.name);
    out.width = asset.width;
    out.height = asset.height;
    out.replaced_pixels = asset.replaced;
    for (int c = 0; c < 3; ++c) out.mean_radiance[c] = asset.mean[c];
    write_desc(info, out, "cumulet_environment_info");
  });
}

cumulet_status cumulet_environment_get_pixels(const cumulet_environment* environment, uint32_t width, uint32_t height,
                                              float* rgb, uint64_t count) {
  return guarded(nullptr, 0, [&] {
    require(environment != nullptr, "environment is NULL");
    require(rgb != nullptr, "rgb is NULL");
    constexpr uint32_t most = light::Environment::max_side;
    require(width >= 1 && height >= 1 && width <= most && height <= most, "width or height is not from 1 to 16384");
    require(count >= std::uint64_t{3} * width * height, "count is less than 3 x width x height");
    for (const glm::vec3& pixel : light::pixels_of(*environment->asset, width, height)) {
      for (int c = 0; c < 3; ++c) *rgb++ = pixel[c];
    }
  });
}
