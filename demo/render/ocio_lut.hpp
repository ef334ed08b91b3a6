#pragma once

#include <ocio_view.hpp>
#include <string>
#include <vector>

#include "display_lut.hpp"

namespace cumulet::demo {

/// A display of a configuration and its views, in the configuration's order.
struct OcioDisplay {
  std::string name = {};
  std::vector<std::string> views = {};
  std::string default_view = {};
};

/// The displays and color spaces of a configuration.
struct OcioDisplays {
  std::string config = {};  ///< as in OcioView
  std::vector<OcioDisplay> displays = {};
  std::string default_display = {};
  std::vector<std::string> color_spaces = {};

  /// Returns the display with this name, that of the default display for "", or null.
  [[nodiscard]] const OcioDisplay* find(const std::string& name) const;
};

/// Reads displays and color spaces. Throws std::runtime_error, one line with the configuration and the cause, also if
/// there is no display.
[[nodiscard]] OcioDisplays ocio_displays(const std::string& file);

/// Bakes the view. Radiance enters as the given color space. Without one the function takes a space with a usual name
/// of linear Rec. 709, else the role aces_interchange, else a space with the name "linear". note: receives a line about
/// that choice, or nothing if the space was given. Throws std::runtime_error, one line that names the flag.
[[nodiscard]] DisplayLut bake_ocio_view(const OcioView& view, std::string* note = nullptr);

}  // namespace cumulet::demo
