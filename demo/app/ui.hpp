#pragma once

#include <imgui.h>

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "color_ramp_edit.hpp"
#include "ramp_edit.hpp"
#include "replay.hpp"

struct ImGuiWindow;

namespace cumulet::demo {

/// Name of the panel's window.
inline constexpr const char* panel_name = "Settings";

/// An entry of a choice.
struct Choice {
  const char* text;
  int value;
  const char* tip;
};

/// Controls of the demo, based on Dear ImGui. Each has a tooltip and a label, on the left of the control or, in a
/// narrow panel, above it. Positions are stored by label, for replay files. Needs a current ImGui context.
class Ui {
 public:
  /// Call between ImGui::NewFrame and the first control. scale: user interface scale; time: seconds.
  void begin(float scale, double time);

  /// Converts a length at scale 1 to pixels.
  [[nodiscard]] float px(float length) const { return length * scale_; }

  /// control: its name for replay files; null: the label.
  bool section(const char* label, bool open, const char* control = nullptr);
  /// Draws a section with its content, if it is open.
  template <class Content>
  void group(const char* label, bool open, const char* control, const Content& content) {
    if (section(label, open, control)) content();
  }
  static void heading(const char* text);
  bool button(const char* label, const char* tip, ImVec2 size = {});
  /// Returns the width of each of two buttons that fill a row; -1 if a label needs more, so that each gets its own row.
  static float width_beside(const char* label, const char* other);
  bool checkbox(const char* label, const char* tip, bool& value);
  /// Draws a slider. A double click or Ctrl+click types a number, and a drag with Shift is fine. typed: range of typed
  /// numbers; nullopt: the slider's range.
  bool slider(const char* label, const char* tip, float& value, float least, float most, const char* format,
              ImGuiSliderFlags flags = 0, const std::optional<settings::Range>& typed = std::nullopt);
  bool slider(const char* label, const char* tip, double& value, double least, double most, const char* format,
              ImGuiSliderFlags flags = 0, const std::optional<settings::Range>& typed = std::nullopt);
  bool slider(const char* label, const char* tip, std::int32_t& value, std::int32_t least, std::int32_t most,
              const char* format, ImGuiSliderFlags flags = 0,
              const std::optional<settings::Range>& typed = std::nullopt);
  bool slider(const char* label, const char* tip, std::uint32_t& value, std::uint32_t least, std::uint32_t most,
              const char* format, ImGuiSliderFlags flags = 0,
              const std::optional<settings::Range>& typed = std::nullopt);
  bool slider(const char* label, const char* tip, std::uint64_t& value, std::uint64_t least, std::uint64_t most,
              const char* format, ImGuiSliderFlags flags = 0,
              const std::optional<settings::Range>& typed = std::nullopt);
  bool integer(const char* label, const char* tip, std::uint32_t& value);
  /// Draws numbers that can be dragged or typed. speed: change per pixel.
  bool numbers(const char* label, const char* tip, std::span<double> values, float speed);
  /// Draws an entry of a list. Returns true if it was clicked. Unlike ImGui's, it shows all of a text with "##", such
  /// as the pattern of a sequence. index: unique in the list.
  static bool entry(const std::string& text, std::size_t index, bool chosen, ImGuiSelectableFlags flags = 0);
  /// Returns true if the user chose another entry.
  bool choose(const char* label, const char* tip, const std::vector<Choice>& choices, int& value);
  /// Edits a linear color. It is displayed in sRGB.
  bool color(const char* label, const char* tip, float (&rgb)[3]);
  /// Returns true if the user pressed Enter.
  bool text(const char* label, const char* tip, const char* hint, std::string& value, float room_right = 0.0f);
  /// Edits the sun's direction: see sun_dial.hpp. camera_azimuth: direction of the camera, marked on the rim.
  bool sun_dial(const char* label, const char* tip, float& azimuth, float& elevation, float camera_azimuth);
  /// Shows an environment that can be rotated by dragging: see environment_view.hpp. ahead_degrees: viewing direction,
  /// which is marked.
  bool environment(const char* label, const char* tip, unsigned texture, float& rotation_degrees, double ahead_degrees);
  /// Edits a ramp's curve over a histogram. heights: bars with heights from 0 to 1 and equal widths from 0 to `reach`.
  bool curve(const char* label, const char* tip, settings::RampPoints& points, RampView& view,
             const std::vector<float>& heights, float reach);
  /// Edits the stops of a color ramp on a bar of its colors. A click adds a stop, a drag moves it, and a right click,
  /// the Delete key or a drag off the bar removes it.
  bool gradient(const char* label, const char* tip, settings::ColorStops& stops, ColorRampView& view);
  /// Returns true if the control under the mouse uses the Delete key itself.
  [[nodiscard]] bool takes_delete() const { return takes_delete_; }
  /// Plots values over time, newest on the right. latest: the last value with its unit.
  void plot(const char* label, const char* tip, const std::vector<float>& values, const std::string& latest);
  /// Shows a name and a value.
  void value_row(const char* label, const std::string& value);

  /// Marks the last control with a dot if its value is not the default. Returns true if the user resets it by a right
  /// click.
  [[nodiscard]] bool resets(bool differs) const;

  /// Returns lines about typed numbers that were refused since the last call, because a limit excludes them.
  [[nodiscard]] std::vector<std::string> take_refusals() { return std::exchange(refusals_, {}); }
  /// Returns true if the last click of a slider may become a double click, which types its value.
  [[nodiscard]] bool may_become_double_click() const { return pressed_ && time_ < pressed_->until; }

  /// Stores the position of the last control and shows its tooltip. Call it for controls that are drawn directly with
  /// ImGui.
  void remember(const char* label, const char* tip);

  /// A control of the current frame.
  struct Control {
    Rectangle rectangle;
    bool in_view = false;
    bool has_tip = false;
  };
  using Controls = std::map<std::string, Control, std::less<>>;
  [[nodiscard]] const Controls& controls() const { return drawn_; }
  /// Returns the rectangle of a control in the last frame, if it was in view.
  [[nodiscard]] std::optional<Rectangle> find(const std::string& label) const;
  /// Scrolls to the control when it is drawn next.
  void bring_into_view(const std::string& label) { wanted_ = label; }

 private:
  /// Returns true if the labels are above their controls.
  [[nodiscard]] bool is_narrow() const;
  void begin_row(const char* label) const;
  // Places the next tooltip beside or below a dialog, if there is room.
  void place_tip_beside(const ImGuiWindow& dialog, float y) const;
  void draw_dial(ImVec2 centre, float radius, bool lit, float azimuth, float elevation, float camera_azimuth) const;
  struct CurveArea;
  // near: index of the point under the mouse.
  void draw_curve(const CurveArea& area, const settings::RampPoints& points, const RampView& view,
                  std::optional<std::size_t> near, const std::vector<float>& heights, float reach) const;
  struct GradientArea;
  void draw_gradient(const GradientArea& area, const settings::ColorStops& stops, const ColorRampView& view,
                     std::optional<std::size_t> near) const;
  // Returns the number that a slider takes: within its range, or within the limits of typed numbers.
  template <class Number>
  Number within_limits(const char* label, bool typing, Number number, Number least, Number most,
                       const std::optional<settings::Range>& typed);
  template <class Number>
  void draw_fill(ImVec2 corner, ImVec2 end, ImGuiDataType type, Number value, Number least, Number most,
                 const char* format, ImGuiSliderFlags flags, bool lit, bool held) const;
  template <class Number>
  bool slide(const char* label, const char* tip, ImGuiDataType type, Number& value, Number least, Number most,
             const char* given_format, ImGuiSliderFlags flags, const std::optional<settings::Range>& typed);

  // The slider that was pressed last.
  struct Pressed {
    std::string label;
    double value;   // before the click, which a double click restores
    double until;   // time until which a second click is a double click
    float pointer;  // horizontal position for the slider; it moves slowly while Shift is held
  };
  struct PointerSwap;
  struct Refused {
    std::string label;
    std::string text;
  };

  float scale_ = 1.0f;
  double time_ = 0.0;
  std::optional<Pressed> pressed_;
  std::optional<Refused> refused_;  // of a number that is being typed
  std::vector<std::string> refusals_;
  Controls last_;
  Controls drawn_;
  std::string wanted_;
  std::string hovered_;
  double hovered_since_ = 0.0;
  bool hovered_now_ = false;
  bool takes_delete_ = false;
};

/// Returns the text, or as much of its end as fits the width: the end of a path is the distinctive part.
[[nodiscard]] std::string end_of(const std::string& text, float width);

/// Sets a dark theme and loads fonts for the scale: the system's DejaVu Sans if it exists, else ImGui's default font.
void apply_theme(float scale);
void load_fonts(float scale);
/// Returns the font of the program's name.
[[nodiscard]] ImFont* title_font();

/// Returns a format of printf in which %g does not write this number with an exponent, unless it is very large or
/// small.
[[nodiscard]] std::string plain_format(const std::string& format, double value);

/// Formats numbers with three digits: "1.24 M", "12.3 MB".
[[nodiscard]] std::string short_count(double count);
[[nodiscard]] std::string short_bytes(double bytes);

}  // namespace cumulet::demo
