#pragma once

#include <string>

namespace cumulet::demo {

/// Settings with which each viewer is created.
struct ViewerSetup {
  std::string shader_cache;  // folder; empty: none
  std::string shaders;       // folder; empty: the library's
};

}  // namespace cumulet::demo
