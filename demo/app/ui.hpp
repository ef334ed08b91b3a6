#pragma once

#include <imgui.h>

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "ramp_edit.hpp"
#include "replay.hpp"

namespace cumulet::demo {

/// One entry of a list to choose from.
struct Choice {
  const char* text;
  int value;
  const char* tip;
};

/// The demo's controls on top of Dear ImGui: a label on the left, the control on the right, a tooltip for both, and
/// the place of each remembered by its label, for replay files. Needs a current ImGui context.
class Ui {
 public:
  /// Between ImGui's new frame and the first control. scale: of everything; time: seconds.
  void begin(float scale, double time);

  /// A length that looks the same on every screen.
  [[nodiscard]] float px(float length) const { return length * scale_; }

  bool section(const char* label, bool open);
  static void heading(const char* text);
  bool button(const char* label, const char* tip, ImVec2 size = {});
  bool checkbox(const char* label, const char* tip, bool& value);
  bool slider(const char* label, const char* tip, float& value, float least, float most, const char* format,
              ImGuiSliderFlags flags = 0);
  bool slider(const char* label, const char* tip, double& value, double least, double most, const char* format,
              ImGuiSliderFlags flags = 0);
  bool slider(const char* label, const char* tip, std::int32_t& value, std::int32_t least, std::int32_t most,
              const char* format, ImGuiSliderFlags flags = 0);
  bool slider(const char* label, const char* tip, std::uint32_t& value, std::uint32_t least, std::uint32_t most,
              const char* format, ImGuiSliderFlags flags = 0);
  bool slider(const char* label, const char* tip, std::uint64_t& value, std::uint64_t least, std::uint64_t most,
              const char* format, ImGuiSliderFlags flags = 0);
  bool integer(const char* label, const char* tip, std::uint32_t& value);
  /// Dragged or typed; speed: a pixel.
  bool numbers(const char* label, const char* tip, std::span<double> values, float speed);
  /// True once something else is chosen.
  bool choose(const char* label, const char* tip, const std::vector<Choice>& choices, int& value);
  /// A linear colour, edited as it looks.
  bool colour(const char* label, const char* tip, float (&rgb)[3]);
  /// True when Enter was pressed in it.
  bool text(const char* label, const char* tip, const char* hint, std::string& value, float room_right = 0.0f);
  /// The sun's direction: see sun_dial.hpp. camera_azimuth: where the camera stands, marked on the rim.
  bool sun_dial(const char* label, const char* tip, float& azimuth, float& elevation, float camera_azimuth);
  /// An environment's picture, turned by dragging: see environment_view.hpp. ahead: where the camera looks, marked.
  bool environment(const char* label, const char* tip, unsigned texture, float& rotation_degrees, double ahead_degrees);
  /// A ramp's curve over a histogram, whose bars have these heights, from 0 to 1, and take equal steps from 0 to reach.
  bool curve(const char* label, const char* tip, settings::RampPoints& points, RampView& view,
             const std::vector<float>& heights, float reach);
  /// A line of numbers over time, the newest on the right, with the last one and the unit in words.
  void plot(const char* label, const char* tip, const std::vector<float>& values, const std::string& latest);
  /// A name and a value.
  void fact(const char* label, const std::string& value);

  /// The last control was this one: remembers its place, shows its tooltip. For controls that ImGui draws directly.
  void remember(const char* label, const char* tip);

  /// One control of the frame under way.
  struct Control {
    Rectangle place;
    bool in_view = false;
    bool has_tip = false;
  };
  using Controls = std::map<std::string, Control, std::less<>>;
  [[nodiscard]] const Controls& controls() const { return drawn_; }
  /// Where a control was drawn in the last frame, if it was in view.
  [[nodiscard]] std::optional<Rectangle> find(const std::string& label) const;
  /// Scrolls to the control when it is drawn next.
  void bring_into_view(const std::string& label) { wanted_ = label; }

 private:
  void begin_row(const char* label) const;
  template <class Number>
  bool slide(const char* label, const char* tip, ImGuiDataType type, Number& value, Number least, Number most,
             const char* format, ImGuiSliderFlags flags);

  float scale_ = 1.0f;
  double time_ = 0.0;
  Controls last_;
  Controls drawn_;
  std::string wanted_;
  std::string hovered_;
  double hovered_since_ = 0.0;
  bool hovered_now_ = false;
};

/// A line, or as much of its end as fits the width: of a path, what tells it from others.
[[nodiscard]] std::string end_of(const std::string& text, float width);

/// A quiet dark theme. Fonts: a system's DejaVu Sans if there is one, else ImGui's own, each at this scale.
void apply_theme(float scale);
void load_fonts(float scale);

/// "1.24 M", three digits; "12.3 MB".
[[nodiscard]] std::string short_count(double count);
[[nodiscard]] std::string short_bytes(double bytes);

}  // namespace cumulet::demo
