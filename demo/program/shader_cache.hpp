#pragma once

#include <cumulet/cumulet.h>

#include <array>
#include <memory>
#include <stdexcept>
#include <string>

namespace cumulet::demo {

struct ReleasePrograms {
  void operator()(cumulet_programs* programs) const { cumulet_programs_release(programs); }
};

/// Creates the shader programs with a cache in `folder` ("": no cache) and the sources in `shaders` ("": those of the
/// library). Throws std::runtime_error.
inline std::unique_ptr<cumulet_programs, ReleasePrograms> make_programs(const std::string& folder,
                                                                        const std::string& shaders) {
  cumulet_programs_desc desc{};
  desc.struct_size = sizeof desc;
  desc.folder = folder.c_str();
  desc.shaders = shaders.c_str();
  cumulet_programs* programs = nullptr;
  std::array<char, 1024> error{};
  if (cumulet_programs_create(&desc, &programs, error.data(), error.size()) != CUMULET_OK)
    throw std::runtime_error(error.data());
  return std::unique_ptr<cumulet_programs, ReleasePrograms>(programs);
}

}  // namespace cumulet::demo
