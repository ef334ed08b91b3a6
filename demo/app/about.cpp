#include "about.hpp"

#include <scene_file.hpp>

namespace cumulet::demo {

std::string about_text(const std::string& renderer, const std::string& gl_version) {
  // Licenses as in third_party_notes.
  return "Cumulet " + version_text() +
         ", a viewer and path tracer for volumes. License: BSD-3-Clause.\n\n"
         "Driver: " +
         renderer + ", OpenGL " + gl_version +
         "\n\n"
         "MPL-2.0: OpenVDB, NanoVDB\n"
         "Apache-2.0: oneTBB, Open Image Denoise, Draco\n"
         "MIT: Dear ImGui, GLM, JSON for Modern C++, tinygltf, meshoptimizer, glad, stb\n"
         "BSD-3-Clause: OpenEXR, OpenColorIO, CLI11, libwebp, libjpeg-turbo\n"
         "Zlib: GLFW. libtiff license: libtiff.\n\n"
         "The folder third_party_notes has a note on each library.";
}

}  // namespace cumulet::demo
