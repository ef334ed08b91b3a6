#pragma once

#include <ocio_lut.hpp>
#include <string>

namespace cumulet::demo {

/// What each viewer of the program is created with.
struct ViewerSetup {
  std::string shader_cache;  // folder; empty: none
  std::string shaders;       // folder; empty: the library's
  OcioView ocio;
};

}  // namespace cumulet::demo
