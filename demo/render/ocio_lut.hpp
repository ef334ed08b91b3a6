#pragma once

#include <string>

#include "display_lut.hpp"

namespace cumulet::demo {

/// A view of an OpenColorIO configuration.
struct OcioView {
  std::string config = {};   ///< a file, or a name that OpenColorIO knows; empty: none
  std::string display = {};  ///< empty: the configuration's default
  std::string view = {};     ///< empty: the display's default
  std::string input = {};    ///< color space of linear Rec. 709 radiance; empty: found

  friend bool operator==(const OcioView&, const OcioView&) = default;
};

/// Bakes the view. Radiance enters as the given color space. Without one the function takes a space with a usual name
/// of linear Rec. 709, else the role aces_interchange, else a space with the name "linear". note: receives a line about
/// that choice, or nothing if the space was given. Throws std::runtime_error, one line that names the flag.
[[nodiscard]] DisplayLut bake_ocio_view(const OcioView& view, std::string* note = nullptr);

}  // namespace cumulet::demo
