#pragma once

#include <optional>

#include "kelvin.hpp"
#include "ui.hpp"

namespace cumulet::demo {

/// Rows of the panel for the color of a light: a color, or a color temperature in kelvin. A scene stores the color
/// only. A color of a black body is shown as a temperature, unless the user has chosen to see its color.
class LightColorRows {
 public:
  explicit LightColorRows(Ui& ui) : ui_(ui) {}
  LightColorRows(const LightColorRows&) = delete;
  LightColorRows& operator=(const LightColorRows&) = delete;
  ~LightColorRows() = default;

  /// Returns true if the user changed the color.
  bool draw(const char* label, const char* tip, float (&rgb)[3]);

 private:
  bool temperature(Rgb& color);

  Ui& ui_;
  std::optional<Rgb> as_color_;  // color of a black body that is shown as a color
};

}  // namespace cumulet::demo
