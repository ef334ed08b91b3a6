#pragma once

#include <string>

namespace cumulet::demo {

/// Returns the text of the window "About": the version, the OpenGL driver, and the libraries with their licenses.
[[nodiscard]] std::string about_text(const std::string& renderer, const std::string& gl_version);

}  // namespace cumulet::demo
