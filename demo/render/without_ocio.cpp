// Replaces ocio_lut.cpp in builds without OpenColorIO.

#include <stdexcept>

#include "ocio_lut.hpp"

namespace cumulet::demo {

DisplayLut bake_ocio_view(const OcioView& view, std::string* /*note*/) {
  throw std::runtime_error("--ocio " + view.config + ": this program was built without OpenColorIO (CUMULET_OCIO)");
}

}  // namespace cumulet::demo
