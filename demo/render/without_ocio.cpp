// Replaces ocio_lut.cpp in builds without OpenColorIO.

#include <stdexcept>

#include "ocio_lut.hpp"

namespace cumulet::demo {

namespace {

[[noreturn]] void refuse(const std::string& config) {
  throw std::runtime_error("--ocio " + config + ": this program was built without OpenColorIO (CUMULET_OCIO)");
}

}  // namespace

// NOLINTNEXTLINE(readability-convert-member-functions-to-static): as declared for builds with OpenColorIO
const OcioDisplay* OcioDisplays::find(const std::string& /*name*/) const { return nullptr; }

OcioDisplays ocio_displays(const std::string& file) { refuse(file); }

DisplayLut bake_ocio_view(const OcioView& view, std::string* /*note*/) { refuse(view.config); }

}  // namespace cumulet::demo
