#pragma once

#include <imgui.h>

#include "ui.hpp"

namespace cumulet::demo {

/// Draws an icon in a square of 20 units around a center.
class Pen {
 public:
  Pen(ImDrawList& list, ImVec2 center, float unit, ImU32 color)
      : list_(list), center_(center), unit_(unit), color_(color) {}

  void line(ImVec2 from, ImVec2 to) const { list_.AddLine(at(from), at(to), color_, 1.6f * unit_); }
  void triangle(ImVec2 a, ImVec2 b, ImVec2 c) const { list_.AddTriangleFilled(at(a), at(b), at(c), color_); }
  void rectangle(ImVec2 low, ImVec2 high) const { list_.AddRect(at(low), at(high), color_, 0.0f, 0, 1.6f * unit_); }
  void bar(ImVec2 low, ImVec2 high) const { list_.AddRectFilled(at(low), at(high), color_); }
  void disk(ImVec2 middle, float radius) const { list_.AddCircleFilled(at(middle), radius * unit_, color_, 12); }
  /// Angles in radians, clockwise from the right.
  void arc(float radius, float from, float to) const {
    list_.PathArcTo(center_, radius * unit_, from, to, 24);
    list_.PathStroke(color_, 0, 1.6f * unit_);
  }

 private:
  [[nodiscard]] ImVec2 at(ImVec2 point) const { return {center_.x + point.x * unit_, center_.y + point.y * unit_}; }

  ImDrawList& list_;
  ImVec2 center_;
  float unit_;
  ImU32 color_;
};

/// A square button with an icon.
struct IconButton {
  const char* control;  // its name for replay files
  const char* tip;
  void (*draw)(const Pen& pen);
  bool active = false;  // lit, as a tool that is in use
  bool enabled = true;
};

/// Returns true if the button was clicked. side: in pixels.
bool icon_button(Ui& ui, const IconButton& button, float side);

}  // namespace cumulet::demo
