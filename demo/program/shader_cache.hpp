#pragma once

#include <cumulet/cumulet.h>

#include <array>
#include <memory>
#include <stdexcept>
#include <string>

namespace cumulet::demo {

struct ReleasePrograms {
  void operator()(cumulet_shader_cache* programs) const { cumulet_shader_cache_release(programs); }
};

/// Creates the shader programs with a cache in `folder` ("": no cache) and the sources in `shaders` ("": those of the
/// library). Throws std::runtime_error.
inline std::unique_ptr<cumulet_shader_cache, ReleasePrograms> make_programs(const std::string& folder,
                                                                            const std::string& shaders) {
  cumulet_shader_cache_desc desc{};
  desc.struct_size = sizeof desc;
  desc.folder = folder.c_str();
  desc.shaders = shaders.c_str();
  cumulet_shader_cache* programs = nullptr;
  std::array<char, 1024> error{};
  if (cumulet_shader_cache_create(&desc, &programs, error.data(), error.size()) != CUMULET_OK)
    throw std::runtime_error(error.data());
  return std::unique_ptr<cumulet_shader_cache, ReleasePrograms>(programs);
}

}  // namespace cumulet::demo
