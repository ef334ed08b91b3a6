#pragma once

#include <string_view>

namespace cumulet::gl {

/// The source of glsl/NAME with its includes resolved, embedded at build time; empty if there is none.
std::string_view shader_source(std::string_view name);

}  // namespace cumulet::gl
