#include "ui.hpp"

#include <imgui_internal.h>
#include <imgui_stdlib.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <image.hpp>
#include <iterator>
#include <program.hpp>
#include <system_error>
#include <type_traits>
#include <utility>

#include "sun_dial.hpp"

namespace cumulet::demo {
namespace {

constexpr float font_size = 15.0f;
constexpr float title_size = 36.0f;
constexpr float tip_delay = 0.5f;

ImU32 color_of(ImGuiCol index, float alpha = 1.0f) { return ImGui::GetColorU32(index, alpha); }

std::string in_words(double value, const char* const* units, std::size_t count, const char* space) {
  std::size_t unit = 0;
  while (value >= 999.5 && unit + 1 < count) {
    value /= 1000.0;
    ++unit;
  }
  std::array<char, 48> text{};
  const bool whole = unit == 0 && value == std::floor(value);
  const char* format = whole || value >= 99.95 ? "%.0f%s%s" : value >= 9.995 ? "%.1f%s%s" : "%.2f%s%s";
  std::snprintf(text.data(), text.size(), format, value, units[unit][0] == '\0' ? "" : space, units[unit]);
  return text.data();
}

}  // namespace

std::string end_of(const std::string& text, float width) {
  if (ImGui::CalcTextSize(text.c_str()).x <= width) return text;
  std::size_t first = 0;
  std::string shown;
  do {
    do ++first;
    while (first < text.size() && continues_character(text[first]));
    shown = "..." + text.substr(first);
  } while (first < text.size() && ImGui::CalcTextSize(shown.c_str()).x > width);
  return shown;
}

std::string short_count(double count) {
  constexpr std::array units = {"", "k", "M", "G", "T"};
  return in_words(count, units.data(), units.size(), " ");
}

std::string short_bytes(double bytes) {
  constexpr std::array units = {"B", "kB", "MB", "GB", "TB"};
  return in_words(bytes, units.data(), units.size(), " ");
}

std::string plain_format(const std::string& format, double value) {
  constexpr double least = 1e4;
  constexpr double most = 1e12;
  const double size = std::abs(value);
  const std::size_t begin = format.find('%');
  const std::size_t end = begin == std::string::npos ? begin : format.find_first_not_of("%.0123456789", begin);
  if (end == std::string::npos || format[end] != 'g' || !(size >= least && size < most)) return format;
  return format.substr(0, begin) + "%.0f" + format.substr(end + 1);
}

void Ui::begin(float scale, double time) {
  scale_ = scale;
  time_ = time;
  last_ = std::move(drawn_);
  drawn_.clear();
  if (!hovered_now_) hovered_.clear();
  hovered_now_ = false;
  takes_delete_ = false;
}

std::optional<Rectangle> Ui::find(const std::string& label) const {
  const auto control = last_.find(label);
  if (control == last_.end() || !control->second.in_view) return std::nullopt;
  return control->second.rectangle;
}

void Ui::place_tip_beside(const ImGuiWindow& dialog, float y) const {
  const ImVec2 end(dialog.Pos.x + dialog.Size.x, dialog.Pos.y + dialog.Size.y);
  const ImVec2 screen = ImGui::GetIO().DisplaySize;
  if (end.x + px(200.0f) < screen.x)
    ImGui::SetNextWindowPos({end.x + px(4.0f), y});
  else if (end.y + px(60.0f) < screen.y)
    ImGui::SetNextWindowPos({dialog.Pos.x, end.y + px(4.0f)});
}

void Ui::remember(const char* label, const char* tip) {
  const ImVec2 least = ImGui::GetItemRectMin();
  const ImVec2 most = ImGui::GetItemRectMax();
  const ImVec2 centre((least.x + most.x) * 0.5f, (least.y + most.y) * 0.5f);
  // A control is in view if its center can be clicked.
  Control& control = drawn_[label];
  control.rectangle = {least.x, least.y, most.x - least.x, most.y - least.y};
  control.in_view = ImGui::GetCurrentWindow()->ClipRect.Contains(centre);
  if (wanted_ == label) {
    if (!control.in_view) ImGui::SetScrollHereY(0.5f);
    wanted_.clear();
  }
  control.has_tip = tip != nullptr && tip[0] != '\0';
  if (!control.has_tip || !ImGui::IsItemHovered(ImGuiHoveredFlags_AllowWhenDisabled)) return;
  hovered_now_ = true;
  if (hovered_ != label) {
    hovered_ = label;
    hovered_since_ = time_;
  }
  if (time_ - hovered_since_ < static_cast<double>(tip_delay) || ImGui::IsItemActive()) return;
  // Beside the panel or the dialog, so that it does not cover the next rows.
  const ImGuiWindow& root = *ImGui::GetCurrentWindow()->RootWindow;
  float wrap = px(300.0f);
  if (&root == ImGui::FindWindowByName(panel_name)) {
    ImGui::SetNextWindowPos({root.Pos.x - px(8.0f), least.y}, ImGuiCond_Always, {1.0f, 0.0f});
    wrap = std::min(wrap, root.Pos.x - px(8.0f) - 2.0f * ImGui::GetStyle().WindowPadding.x);
  } else if ((root.Flags & ImGuiWindowFlags_Modal) != 0) {
    place_tip_beside(root, least.y);
  }
  ImGui::BeginTooltip();
  ImGui::PushTextWrapPos(std::max(wrap, px(60.0f)));
  ImGui::TextUnformatted(tip);
  ImGui::PopTextWrapPos();
  ImGui::EndTooltip();
}

bool Ui::resets(bool differs) const {
  if (!differs) return false;
  const ImVec2 corner = ImGui::GetItemRectMin();
  const float middle = corner.y + 0.5f * ImGui::GetFrameHeight();
  ImVec2 dot(corner.x - px(8.0f), middle);
  // Below its label, the control begins at the edge.
  if (dot.x < ImGui::GetCurrentWindow()->ClipRect.Min.x) dot = {corner.x + px(5.0f), corner.y + px(5.0f)};
  ImGui::GetWindowDrawList()->AddCircleFilled(dot, px(2.0f), color_of(ImGuiCol_CheckMark), 12);
  return ImGui::IsItemHovered() && ImGui::IsMouseClicked(ImGuiMouseButton_Right);
}

bool Ui::section(const char* label, bool open, const char* control) {
  const bool is_open = ImGui::CollapsingHeader(label, open ? ImGuiTreeNodeFlags_DefaultOpen : 0);
  remember(control != nullptr ? control : label, nullptr);
  return is_open;
}

void Ui::heading(const char* text) {
  ImGui::PushStyleColor(ImGuiCol_Text, ImGui::GetStyleColorVec4(ImGuiCol_TextDisabled));
  ImGui::TextUnformatted(text);
  ImGui::PopStyleColor();
}

bool Ui::is_narrow() const { return ImGui::GetContentRegionAvail().x < px(232.0f); }

void Ui::begin_row(const char* label) const {
  const bool narrow = is_narrow();
  if (!narrow) ImGui::AlignTextToFramePadding();
  ImGui::TextUnformatted(label, ImGui::FindRenderedTextEnd(label));
  if (!narrow) ImGui::SameLine(px(132.0f));
  ImGui::SetNextItemWidth(-1.0f);
}

float Ui::width_beside(const char* label, const char* other) {
  const ImGuiStyle& style = ImGui::GetStyle();
  const float width = (ImGui::GetContentRegionAvail().x - style.ItemSpacing.x) / 2.0f;
  const auto needs = [&](const char* text) {
    return ImGui::CalcTextSize(text, nullptr, true).x + 2.0f * style.FramePadding.x;
  };
  return std::max(needs(label), needs(other)) <= width ? width : -1.0f;
}

bool Ui::button(const char* label, const char* tip, ImVec2 size) {
  const bool pressed = ImGui::Button(label, size);
  remember(label, tip);
  return pressed;
}

bool Ui::checkbox(const char* label, const char* tip, bool& value) {
  if (is_narrow()) {
    ImGui::AlignTextToFramePadding();
    ImGui::TextUnformatted(label, ImGui::FindRenderedTextEnd(label));
    ImGui::SameLine(ImGui::GetWindowContentRegionMax().x - ImGui::GetFrameHeight());
  } else {
    begin_row(label);
  }
  const bool changed = ImGui::Checkbox((std::string("##") + label).c_str(), &value);
  remember(label, tip);
  return changed;
}

/// Presents another pointer and other keys to a control of ImGui during its lifetime.
struct Ui::PointerSwap {
  ImGuiIO& io = ImGui::GetIO();
  ImVec2 pointer = io.MousePos;
  bool ctrl = io.KeyCtrl;
  bool shift = io.KeyShift;
  bool alt = io.KeyAlt;

  PointerSwap() = default;
  PointerSwap(const PointerSwap&) = delete;
  PointerSwap& operator=(const PointerSwap&) = delete;
  ~PointerSwap() {
    io.MousePos = pointer;
    io.KeyCtrl = ctrl;
    io.KeyShift = shift;
    io.KeyAlt = alt;
  }
};

namespace {

template <class Number>
std::string text_of(Number number) {
  if constexpr (std::is_floating_point_v<Number>)
    return settings::number_text(number);
  else
    return std::to_string(number);
}

}  // namespace

template <class Number>
Number Ui::within_limits(const char* label, bool typing, Number number, Number least, Number most,
                         const std::optional<settings::Range>& typed) {
  refused_.reset();
  if (number >= least && number <= most) return number;
  if constexpr (std::is_floating_point_v<Number>)
    if (!std::isfinite(number)) return std::isnan(number) || number < Number{} ? least : most;
  if (!typing) return std::clamp(number, least, most);
  const auto given = static_cast<double>(number);
  const settings::Range range =
      typed.value_or(settings::Range{static_cast<double>(least), static_cast<double>(most), false});
  if (range.holds(given)) return number;
  const Number limit =
      range.open ? (given > 0.0 ? most : least) : static_cast<Number>(std::clamp(given, range.least, range.most));
  const std::string line = std::string(label) + ": " + text_of(number) + " " + range.refusal();
  refused_ = Refused{label, line + "; set to " + text_of(limit)};
  return limit;
}

/// Draws the frame of a slider, filled from the left up to a value. ImGui's grab would cover digits of the value.
template <class Number>
void Ui::draw_fill(ImVec2 corner, ImVec2 end, ImGuiDataType type, Number value, Number least, Number most,
                   const char* format, ImGuiSliderFlags flags, bool lit, bool held) const {
  // An id that is never active: only the place of the grab is computed.
  ImRect grab;
  ImGuiLastItemData& last = ImGui::GetCurrentContext()->LastItemData;
  const ImGuiItemFlags kept = std::exchange(last.InFlags, 0);  // ImGui looks at the item before, which may be disabled
  ImGui::SliderBehavior({corner, end}, ImGui::GetID("fill"), type, &value, &least, &most, format, flags, &grab);
  last.InFlags = kept;
  constexpr float padding = 2.0f;  // ImGui's, around the grab
  const float usable = std::max(end.x - corner.x - 2.0f * padding - grab.GetWidth(), 1.0f);
  const float part = std::clamp((grab.Min.x - corner.x - padding) / usable, 0.0f, 1.0f);
  const float x = corner.x + part * (end.x - corner.x);
  ImDrawList& draw = *ImGui::GetWindowDrawList();
  const float rounding = ImGui::GetStyle().FrameRounding;
  draw.AddRectFilled(corner, end,
                     color_of(held  ? ImGuiCol_FrameBgActive
                              : lit ? ImGuiCol_FrameBgHovered
                                    : ImGuiCol_FrameBg),
                     rounding);
  draw.PushClipRect(corner, {x, end.y}, true);
  draw.AddRectFilled(corner, end, color_of(ImGuiCol_SliderGrab, 0.55f), rounding);
  draw.PopClipRect();
  const float edge = std::clamp(x, corner.x + px(1.0f), end.x - px(1.0f));
  draw.AddRectFilled({edge - px(1.0f), corner.y + px(2.0f)}, {edge + px(1.0f), end.y - px(2.0f)},
                     color_of(lit || held ? ImGuiCol_CheckMark : ImGuiCol_SliderGrabActive));
}

template <class Number>
bool Ui::slide(const char* label, const char* tip, ImGuiDataType type, Number& value, Number least, Number most,
               const char* given_format, ImGuiSliderFlags flags, const std::optional<settings::Range>& typed) {
  constexpr float fine = 0.1f;  // speed of a drag with Shift
  const std::string shown_format = plain_format(given_format, static_cast<double>(value));
  const char* const format = shown_format.c_str();
  begin_row(label);
  const std::string id = std::string("##") + label;
  const bool typing = ImGui::TempInputIsActive(ImGui::GetID(id.c_str()));
  const bool dragged =
      !typing && ImGui::GetActiveID() == ImGui::GetID(id.c_str()) && pressed_ && pressed_->label == label;
  const ImVec2 corner = ImGui::GetCursorScreenPos();
  const ImVec2 end(corner.x + ImGui::CalcItemWidth(), corner.y + ImGui::GetFrameHeight());
  const bool enabled = (ImGui::GetCurrentContext()->CurrentItemFlags & ImGuiItemFlags_Disabled) == 0;
  const bool over = enabled && ImGui::IsWindowHovered() && ImGui::IsMouseHoveringRect(corner, end);
  const bool again = over && pressed_ && pressed_->label == label && ImGui::IsMouseDoubleClicked(ImGuiMouseButton_Left);
  const Number before = again ? static_cast<Number>(pressed_->value) : value;
  Number edited = before;
  bool changed = false;
  {
    PointerSwap swap;
    // A double click is Ctrl+click for ImGui.
    if (again) swap.io.KeyCtrl = true;
    if (dragged) {
      pressed_->pointer += swap.io.MouseDelta.x * (swap.io.KeyShift ? fine : 1.0f);
      swap.io.MousePos.x = pressed_->pointer;
    }
    const bool bare = !typing && !again;
    if (bare) {
      draw_fill(corner, end, type, edited, least, most, format, flags, over, dragged);
      for (const ImGuiCol color : {ImGuiCol_FrameBg, ImGuiCol_FrameBgHovered, ImGuiCol_FrameBgActive,
                                   ImGuiCol_SliderGrab, ImGuiCol_SliderGrabActive})
        ImGui::PushStyleColor(color, 0U);
    }
    changed = ImGui::SliderScalar(id.c_str(), type, &edited, &least, &most, format, flags);
    if (bare) ImGui::PopStyleColor(5);
  }
  if (over && !typing && !again && ImGui::IsMouseClicked(ImGuiMouseButton_Left))
    pressed_ = Pressed{label, static_cast<double>(value),
                       time_ + static_cast<double>(ImGui::GetIO().MouseDoubleClickTime), ImGui::GetIO().MousePos.x};
  remember(label, tip);
  if (again && before != value) {
    value = before;
    return true;
  }
  if (changed) edited = within_limits(label, typing, edited, least, most, typed);
  // Each digit that is typed changes the number, and only the last one counts.
  if (refused_ && refused_->label == label && !ImGui::TempInputIsActive(ImGui::GetID(id.c_str())))
    refusals_.push_back(std::exchange(refused_, std::nullopt)->text);
  if (!changed || edited == value) return false;
  value = edited;
  return true;
}

bool Ui::slider(const char* label, const char* tip, float& value, float least, float most, const char* format,
                ImGuiSliderFlags flags, const std::optional<settings::Range>& typed) {
  return slide(label, tip, ImGuiDataType_Float, value, least, most, format, flags, typed);
}

bool Ui::slider(const char* label, const char* tip, double& value, double least, double most, const char* format,
                ImGuiSliderFlags flags, const std::optional<settings::Range>& typed) {
  return slide(label, tip, ImGuiDataType_Double, value, least, most, format, flags, typed);
}

bool Ui::slider(const char* label, const char* tip, std::int32_t& value, std::int32_t least, std::int32_t most,
                const char* format, ImGuiSliderFlags flags, const std::optional<settings::Range>& typed) {
  return slide(label, tip, ImGuiDataType_S32, value, least, most, format, flags, typed);
}

bool Ui::slider(const char* label, const char* tip, std::uint32_t& value, std::uint32_t least, std::uint32_t most,
                const char* format, ImGuiSliderFlags flags, const std::optional<settings::Range>& typed) {
  return slide(label, tip, ImGuiDataType_U32, value, least, most, format, flags, typed);
}

bool Ui::slider(const char* label, const char* tip, std::uint64_t& value, std::uint64_t least, std::uint64_t most,
                const char* format, ImGuiSliderFlags flags, const std::optional<settings::Range>& typed) {
  return slide(label, tip, ImGuiDataType_U64, value, least, most, format, flags, typed);
}

bool Ui::integer(const char* label, const char* tip, std::uint32_t& value) {
  begin_row(label);
  const std::uint32_t step = 1;
  const bool changed =
      ImGui::InputScalar((std::string("##") + label).c_str(), ImGuiDataType_U32, &value, &step, nullptr, "%u");
  remember(label, tip);
  return changed;
}

bool Ui::numbers(const char* label, const char* tip, std::span<double> values, float speed) {
  begin_row(label);
  std::vector<double> edited(values.begin(), values.end());
  bool changed = false;
  {
    // ImGui drags slowly with Alt, and fast with Shift.
    PointerSwap swap;
    swap.io.KeyAlt = std::exchange(swap.io.KeyShift, false);
    changed = ImGui::DragScalarN((std::string("##") + label).c_str(), ImGuiDataType_Double, edited.data(),
                                 static_cast<int>(edited.size()), speed, nullptr, nullptr, "%.5g");
  }
  remember(label, tip);
  if (!changed || !std::ranges::all_of(edited, [](double one) { return std::isfinite(one); })) return false;
  std::ranges::copy(edited, values.begin());
  return true;
}

bool Ui::entry(const std::string& text, std::size_t index, bool chosen, ImGuiSelectableFlags flags) {
  const ImVec2 corner = ImGui::GetCursorScreenPos();
  // The chosen entry keeps its color below the pointer.
  if (chosen) ImGui::PushStyleColor(ImGuiCol_HeaderHovered, ImGui::GetStyleColorVec4(ImGuiCol_Header));
  const bool clicked = ImGui::Selectable(("##" + std::to_string(index)).c_str(), chosen, flags);
  if (chosen) ImGui::PopStyleColor();
  ImGui::GetWindowDrawList()->AddText(corner, ImGui::GetColorU32(ImGuiCol_Text), text.c_str());
  return clicked;
}

bool Ui::choose(const char* label, const char* tip, const std::vector<Choice>& choices, int& value) {
  begin_row(label);
  const auto now = std::find_if(choices.begin(), choices.end(), [&](const Choice& c) { return c.value == value; });
  const char* const shown = now != choices.end() ? now->text : choices.empty() ? "" : "Choose";
  ImDrawList& draw = *ImGui::GetWindowDrawList();
  const ImU32 color = ImGui::GetColorU32(ImGuiCol_Text);
  const ImVec2 corner = ImGui::GetCursorScreenPos();
  const float height = ImGui::GetFrameHeight();
  const ImVec2 end(corner.x + ImGui::CalcItemWidth() - height, corner.y + height);  // without the arrow
  const bool open = ImGui::BeginCombo((std::string("##") + label).c_str(), "", ImGuiComboFlags_HeightLarge);
  remember(label, tip);
  // ImGui's preview would end before "##".
  const ImVec2 padding = ImGui::GetStyle().FramePadding;
  const ImVec4 clip(corner.x, corner.y, end.x, end.y);
  draw.AddText(nullptr, 0.0f, {corner.x + padding.x, corner.y + padding.y}, color, shown, nullptr, 0.0f, &clip);
  if (!open) return false;
  bool changed = false;
  for (std::size_t i = 0; i < choices.size(); ++i) {
    const Choice& choice = choices[i];
    const bool chosen = choice.value == value;
    if (entry(choice.text, i, chosen) && !chosen) {
      value = choice.value;
      changed = true;
    }
    remember((std::string(label) + "/" + choice.text).c_str(), choice.tip);
    if (chosen) ImGui::SetItemDefaultFocus();
  }
  ImGui::EndCombo();
  return changed;
}

bool Ui::color(const char* label, const char* tip, float (&rgb)[3]) {
  begin_row(label);
  float shown[3];
  for (std::size_t i = 0; i < 3; ++i) shown[i] = image::srgb_encode(std::clamp(rgb[i], 0.0f, 1.0f));
  const bool changed =
      ImGui::ColorEdit3((std::string("##") + label).c_str(), shown,
                        ImGuiColorEditFlags_Float | ImGuiColorEditFlags_PickerHueWheel | ImGuiColorEditFlags_NoOptions);
  remember(label, tip);
  if (!changed) return false;
  for (std::size_t i = 0; i < 3; ++i) rgb[i] = image::srgb_decode(std::clamp(shown[i], 0.0f, 1.0f));
  return true;
}

bool Ui::text(const char* label, const char* tip, const char* hint, std::string& value, float room_right) {
  begin_row(label);
  ImGui::SetNextItemWidth(room_right > 0.0f ? -room_right : -1.0f);
  const std::string id = std::string("##") + label;
  const ImVec2 padding = ImGui::GetStyle().FramePadding;
  const float room = ImGui::CalcItemWidth() - 2.0f * padding.x;
  // Shows the end of the text until it is edited.
  const bool idle = ImGui::GetActiveID() != ImGui::GetID(id.c_str()) && ImGui::CalcTextSize(value.c_str()).x > room;
  if (idle) ImGui::PushStyleColor(ImGuiCol_Text, 0U);
  const bool entered = ImGui::InputTextWithHint(
      id.c_str(), hint, &value, ImGuiInputTextFlags_EnterReturnsTrue | ImGuiInputTextFlags_AutoSelectAll);
  if (idle) {
    ImGui::PopStyleColor();
    const ImVec2 corner = ImGui::GetItemRectMin();
    ImGui::GetWindowDrawList()->AddText({corner.x + padding.x, corner.y + padding.y}, color_of(ImGuiCol_Text),
                                        end_of(value, room).c_str());
  }
  remember(label, tip);
  return entered;
}

void Ui::draw_dial(ImVec2 centre, float radius, bool lit, float azimuth, float elevation, float camera_azimuth) const {
  ImDrawList& draw = *ImGui::GetWindowDrawList();
  constexpr int segments = 48;
  draw.AddCircleFilled(centre, radius, color_of(lit ? ImGuiCol_FrameBgHovered : ImGuiCol_FrameBg), segments);
  for (const float ring : {1.0f / 3.0f, 2.0f / 3.0f})
    draw.AddCircle(centre, radius * ring, color_of(ImGuiCol_Text, 0.12f), segments, px(1.0f));
  draw.AddLine({centre.x - radius, centre.y}, {centre.x + radius, centre.y}, color_of(ImGuiCol_Text, 0.12f), px(1.0f));
  draw.AddLine({centre.x, centre.y - radius}, {centre.x, centre.y + radius}, color_of(ImGuiCol_Text, 0.12f), px(1.0f));
  draw.AddCircle(centre, radius, color_of(ImGuiCol_Text, 0.35f), segments, px(1.5f));
  struct Letter {
    const char* text;
    float x, y;
  };
  for (const Letter& letter : {Letter{"+X", 1, 0}, Letter{"-X", -1, 0}, Letter{"+Z", 0, 1}, Letter{"-Z", 0, -1}}) {
    const ImVec2 size = ImGui::CalcTextSize(letter.text);
    const float at = radius + px(10.0f);
    draw.AddText({centre.x + letter.x * at - size.x * 0.5f, centre.y + letter.y * at - size.y * 0.5f},
                 color_of(ImGuiCol_TextDisabled), letter.text);
  }
  const DialPoint camera = dial_point({static_cast<double>(camera_azimuth), 0.0});
  const ImVec2 eye(centre.x + static_cast<float>(camera.x) * radius, centre.y + static_cast<float>(camera.y) * radius);
  const ImVec2 inward((centre.x - eye.x) / radius, (centre.y - eye.y) / radius);
  const float wing = px(5.0f);
  draw.AddTriangleFilled({eye.x + inward.x * wing * 1.8f, eye.y + inward.y * wing * 1.8f},
                         {eye.x - inward.y * wing, eye.y + inward.x * wing},
                         {eye.x + inward.y * wing, eye.y - inward.x * wing}, color_of(ImGuiCol_TextDisabled));
  const DialPoint at = dial_point({static_cast<double>(azimuth), static_cast<double>(elevation)});
  const ImVec2 disc(centre.x + static_cast<float>(at.x) * radius, centre.y + static_cast<float>(at.y) * radius);
  const ImU32 gold = elevation < 0.0f ? IM_COL32(150, 120, 80, 255) : IM_COL32(255, 205, 110, 255);
  draw.AddLine(centre, disc, color_of(ImGuiCol_Text, 0.25f), px(1.0f));
  draw.AddCircleFilled(disc, px(11.0f), (gold & 0x00FFFFFFu) | 0x38000000u, segments);
  draw.AddCircleFilled(disc, px(6.5f), gold, segments);
}

bool Ui::sun_dial(const char* label, const char* tip, float& azimuth, float& elevation, float camera_azimuth) {
  ImGuiContext& g = *ImGui::GetCurrentContext();
  ImGuiWindow* window = ImGui::GetCurrentWindow();
  const float radius = px(62.0f);
  const float margin = px(16.0f);  // for the labels around it
  const float side = 2.0f * (radius + margin);
  const ImVec2 corner(window->DC.CursorPos.x + std::max(0.0f, (ImGui::GetContentRegionAvail().x - side) * 0.5f),
                      window->DC.CursorPos.y);
  const ImRect box(corner, ImVec2(corner.x + side, corner.y + side));
  const ImVec2 centre = box.GetCenter();
  const ImGuiID id = window->GetID(label);
  ImGui::ItemSize(ImVec2(side, side));
  if (!ImGui::ItemAdd(box, id)) {
    remember(label, tip);
    return false;
  }

  // Input as in ImGui's sliders: dragging with the mouse, or arrow keys between two presses of Space or Enter.
  SunAngles sun = {static_cast<double>(azimuth), static_cast<double>(elevation)};
  bool changed = false;
  const bool hovered = ImGui::ItemHoverable(box, id);
  if ((hovered && g.IO.MouseClicked[0]) || g.NavActivateId == id) {
    ImGui::SetActiveID(id, window);
    ImGui::SetFocusID(id, window);
    ImGui::FocusWindow(window);
    g.ActiveIdUsingNavDirMask |=
        (1 << ImGuiDir_Left) | (1 << ImGuiDir_Right) | (1 << ImGuiDir_Up) | (1 << ImGuiDir_Down);
  }
  if (g.ActiveId == id && g.ActiveIdSource == ImGuiInputSource_Mouse) {
    if (!g.IO.MouseDown[0]) {
      ImGui::ClearActiveID();
    } else {
      sun = dial_angles({static_cast<double>((g.IO.MousePos.x - centre.x) / radius),
                         static_cast<double>((g.IO.MousePos.y - centre.y) / radius)},
                        sun.azimuth);
      changed = true;
    }
  } else if (g.ActiveId == id && g.ActiveIdSource == ImGuiInputSource_Nav) {
    const ImVec2 step = ImGui::GetNavInputAmount2d(ImGuiNavDirSourceFlags_Keyboard | ImGuiNavDirSourceFlags_PadDPad,
                                                   ImGuiInputReadMode_RepeatFast, 0.2f, 5.0f);
    if (step.x != 0.0f || step.y != 0.0f) {
      sun = dial_step(sun, 2.0 * static_cast<double>(step.x), -2.0 * static_cast<double>(step.y));
      changed = true;
    }
    if (g.NavActivatePressedId == id && !g.ActiveIdIsJustActivated) ImGui::ClearActiveID();
  }
  if (changed) {
    azimuth = static_cast<float>(sun.azimuth);
    elevation = static_cast<float>(sun.elevation);
  }

  draw_dial(centre, radius, hovered || g.ActiveId == id, azimuth, elevation, camera_azimuth);
  ImGui::RenderNavHighlight(box, id);
  remember(label, tip);
  return changed;
}

/// The rectangle of a curve, and the plot within it.
struct Ui::CurveArea {
  ImVec2 corner, end;  // of the rectangle
  ImVec2 low, high;    // of the plot: the points (0, 0) and (max_value, max_result)
  float max_value, max_result;

  [[nodiscard]] ImVec2 position_of(const settings::RampPoint& point) const {
    return {low.x + (high.x - low.x) * (point[0] / max_value), low.y + (high.y - low.y) * (point[1] / max_result)};
  }
  /// Returns the point at a position, clamped to the plot.
  [[nodiscard]] settings::RampPoint point_at(ImVec2 position) const {
    return {std::clamp((position.x - low.x) / (high.x - low.x), 0.0f, 1.0f) * max_value,
            std::clamp((position.y - low.y) / (high.y - low.y), 0.0f, 1.0f) * max_result};
  }
};

bool Ui::curve(const char* label, const char* tip, settings::RampPoints& points, RampView& view,
               const std::vector<float>& heights, float reach) {
  const ImVec2 corner = ImGui::GetCursorScreenPos();
  const ImVec2 size(ImGui::GetContentRegionAvail().x, px(120.0f));
  ImGui::InvisibleButton((std::string("##") + label).c_str(), size,
                         ImGuiButtonFlags_MouseButtonLeft | ImGuiButtonFlags_MouseButtonRight);
  remember(label, tip);
  const ImVec2 end(corner.x + size.x, corner.y + size.y);
  const float pad = px(6.0f);  // so that points at the border are not clipped
  const CurveArea area{
      corner, end, {corner.x + pad, end.y - pad}, {end.x - pad, corner.y + pad}, view.max_value, view.max_result};
  const ImVec2 mouse = ImGui::GetIO().MousePos;
  std::optional<std::size_t> near;
  float nearest = px(9.0f);
  const bool hovered = ImGui::IsItemHovered();
  for (std::size_t i = 0; hovered && i < points.size(); ++i) {
    const ImVec2 at = area.position_of(points[i]);
    const float distance = std::hypot(at.x - mouse.x, at.y - mouse.y);
    if (distance > nearest) continue;
    nearest = distance;
    near = i;
  }

  bool changed = false;
  if (hovered && ImGui::IsMouseClicked(ImGuiMouseButton_Left)) {
    changed = !near;
    view.held = near ? near : add_point(points, area.point_at(mouse));
    if (view.held) view.chosen = *view.held;
  } else if (!ImGui::IsItemActive()) {
    view.held.reset();
  }
  const ImVec2 moved = ImGui::GetIO().MouseDelta;
  if (view.held && !ImGui::IsMouseClicked(ImGuiMouseButton_Left) && (moved.x != 0.0f || moved.y != 0.0f)) {
    move_point(points, *view.held, area.point_at(mouse));
    changed = true;
  }
  if (near && !view.held && ImGui::IsMouseClicked(ImGuiMouseButton_Right) && remove_point(points, *near)) {
    view.chosen = std::min(view.chosen, points.size() - 1);
    near.reset();
    changed = true;
  }

  if (ImGui::IsItemVisible()) draw_curve(area, points, view, near, heights, reach);
  return changed;
}

void Ui::draw_curve(const CurveArea& area, const settings::RampPoints& points, const RampView& view,
                    std::optional<std::size_t> near, const std::vector<float>& heights, float reach) const {
  ImDrawList& draw = *ImGui::GetWindowDrawList();
  draw.AddRectFilled(area.corner, area.end, color_of(ImGuiCol_FrameBg), px(4.0f));
  draw.PushClipRect(area.corner, area.end, true);
  const float step = reach / static_cast<float>(std::max<std::size_t>(heights.size(), 1));
  for (std::size_t i = 0; i < heights.size(); ++i) {
    const float from = area.position_of({step * static_cast<float>(i), 0.0f}).x;
    const float to = area.position_of({step * static_cast<float>(i + 1), 0.0f}).x;
    draw.AddRectFilled({from, area.low.y + (area.high.y - area.low.y) * heights[i]}, {to, area.low.y},
                       color_of(ImGuiCol_PlotHistogram, 0.22f));
  }
  const ImU32 line = color_of(ImGuiCol_PlotLines);
  ImVec2 before(area.corner.x, area.position_of(points.front()).y);
  for (const settings::RampPoint& point : points) {
    const ImVec2 at = area.position_of(point);
    draw.AddLine(before, at, line, px(1.5f));
    before = at;
  }
  draw.AddLine(before, {area.end.x, before.y}, line, px(1.5f));
  for (std::size_t i = 0; i < points.size(); ++i) {
    const bool lit = i == near || i == view.held;
    draw.AddCircleFilled(area.position_of(points[i]), px(lit ? 5.5f : 4.0f),
                         color_of(i == view.chosen ? ImGuiCol_CheckMark : ImGuiCol_Text));
  }
  draw.PopClipRect();
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.3g", static_cast<double>(area.max_result));
  draw.AddText({area.corner.x + px(5.0f), area.corner.y + px(2.0f)}, color_of(ImGuiCol_TextDisabled), text.data());
  std::snprintf(text.data(), text.size(), "%.3g", static_cast<double>(area.max_value));
  const ImVec2 wide = ImGui::CalcTextSize(text.data());
  draw.AddText({area.end.x - px(5.0f) - wide.x, area.end.y - px(2.0f) - wide.y}, color_of(ImGuiCol_TextDisabled),
               text.data());
}

void Ui::plot(const char* label, const char* tip, const std::vector<float>& values, const std::string& latest) {
  const float height = px(46.0f);
  const float width = ImGui::GetContentRegionAvail().x;
  const ImVec2 corner = ImGui::GetCursorScreenPos();
  ImGui::InvisibleButton((std::string("##") + label).c_str(), {width, height});
  remember(label, tip);
  if (!ImGui::IsItemVisible()) return;  // an invisible plot must not change the frame
  ImDrawList& draw = *ImGui::GetWindowDrawList();
  const ImVec2 end(corner.x + width, corner.y + height);
  draw.AddRectFilled(corner, end, color_of(ImGuiCol_FrameBg), px(4.0f));
  const float line = ImGui::GetTextLineHeight();
  const float pad = px(7.0f);
  const float top = corner.y + line + px(5.0f);
  const float bottom = end.y - px(4.0f);
  float most = 0.0f;
  for (const float value : values) most = std::max(most, value);
  if (values.size() > 1 && most > 0.0f) {
    const float step = (width - 2.0f * px(3.0f)) / static_cast<float>(values.size() - 1);
    const auto point = [&](std::size_t i) {
      return ImVec2(corner.x + px(3.0f) + step * static_cast<float>(i), bottom - (bottom - top) * values[i] / most);
    };
    for (std::size_t i = 0; i + 1 < values.size(); ++i) {
      const ImVec2 a = point(i);
      const ImVec2 b = point(i + 1);
      draw.AddQuadFilled(a, b, {b.x, bottom}, {a.x, bottom}, color_of(ImGuiCol_PlotLines, 0.18f));
      draw.AddLine(a, b, color_of(ImGuiCol_PlotLines), px(1.3f));
    }
  }
  draw.AddText({corner.x + pad, corner.y + px(3.0f)}, color_of(ImGuiCol_TextDisabled), label);
  const ImVec2 size = ImGui::CalcTextSize(latest.c_str());
  draw.AddText({end.x - pad - size.x, corner.y + px(3.0f)}, color_of(ImGuiCol_Text), latest.c_str());
}

void Ui::value_row(const char* label, const std::string& value) {
  const bool narrow = is_narrow();
  heading(label);
  if (!narrow) ImGui::SameLine(px(132.0f));
  ImGui::PushTextWrapPos(0.0f);
  ImGui::TextUnformatted(value.c_str());
  ImGui::PopTextWrapPos();
  remember(label, nullptr);
}

void apply_theme(float scale) {
  ImGuiStyle style;
  style.WindowPadding = {12, 12};
  style.FramePadding = {8, 4};
  style.ItemSpacing = {8, 6};
  style.ItemInnerSpacing = {6, 4};
  style.IndentSpacing = 16;
  style.ScrollbarSize = 12;
  style.GrabMinSize = 10;
  style.WindowMinSize = {16, 16};
  style.WindowRounding = 6;
  style.ChildRounding = 4;
  style.FrameRounding = 4;
  style.PopupRounding = 6;
  style.GrabRounding = 4;
  style.ScrollbarRounding = 6;
  style.WindowBorderSize = 0;
  style.PopupBorderSize = 1;
  style.WindowTitleAlign = {0.5f, 0.5f};
  style.ScaleAllSizes(scale);
  ImGui::StyleColorsDark(&style);
  const auto set = [&style](ImGuiCol index, unsigned rgb, float alpha = 1.0f) {
    style.Colors[index] = {static_cast<float>(rgb >> 16 & 255) / 255.0f, static_cast<float>(rgb >> 8 & 255) / 255.0f,
                           static_cast<float>(rgb & 255) / 255.0f, alpha};
  };
  set(ImGuiCol_Text, 0xD8DCE2);
  set(ImGuiCol_TextDisabled, 0x868D98);
  set(ImGuiCol_WindowBg, 0x1C1F24);
  set(ImGuiCol_ChildBg, 0x17191D);
  set(ImGuiCol_PopupBg, 0x23272D, 0.98f);
  set(ImGuiCol_Border, 0x3A4049);
  set(ImGuiCol_FrameBg, 0x2A2E35);
  set(ImGuiCol_FrameBgHovered, 0x343A43);
  set(ImGuiCol_FrameBgActive, 0x3B424D);
  set(ImGuiCol_TitleBg, 0x23272D);
  set(ImGuiCol_TitleBgActive, 0x2A2F37);
  set(ImGuiCol_ScrollbarBg, 0x000000, 0.0f);
  set(ImGuiCol_ScrollbarGrab, 0x3A4049);
  set(ImGuiCol_ScrollbarGrabHovered, 0x4A515C);
  set(ImGuiCol_ScrollbarGrabActive, 0x5A626E);
  set(ImGuiCol_CheckMark, 0x7FB4E6);
  set(ImGuiCol_SliderGrab, 0x4A7299);
  set(ImGuiCol_SliderGrabActive, 0x5F8FBF);
  set(ImGuiCol_Button, 0x333A44);
  set(ImGuiCol_ButtonHovered, 0x3F4854);
  set(ImGuiCol_ButtonActive, 0x4C5766);
  set(ImGuiCol_MenuBarBg, 0x23272D);
  set(ImGuiCol_Tab, 0x23272D);
  set(ImGuiCol_TabHovered, 0x46698E);
  set(ImGuiCol_TabActive, 0x3D5F82);
  set(ImGuiCol_TabUnfocused, 0x23272D);
  set(ImGuiCol_TabUnfocusedActive, 0x3D5F82);
  set(ImGuiCol_Header, 0x262B32);
  set(ImGuiCol_HeaderHovered, 0x313842);
  set(ImGuiCol_HeaderActive, 0x3A424E);
  set(ImGuiCol_Separator, 0x33383F);
  set(ImGuiCol_PlotLines, 0x7FB4E6);
  set(ImGuiCol_PlotHistogram, 0x5F8FBF);
  set(ImGuiCol_TextSelectedBg, 0x3D5F82);
  set(ImGuiCol_NavHighlight, 0x7FB4E6);
  set(ImGuiCol_ModalWindowDimBg, 0x000000, 0.45f);
  ImGui::GetStyle() = style;
}

void load_fonts(float scale) {
  constexpr std::array folders = {"/usr/share/fonts/truetype/dejavu/", "/usr/share/fonts/dejavu/",
                                  "/usr/share/fonts/dejavu-sans-fonts/", "/usr/share/fonts/TTF/",
                                  "/usr/local/share/fonts/dejavu/"};
  // Latin, Greek and Cyrillic for file names; dashes, arrows and geometric shapes.
  static constexpr std::array<ImWchar, 13> glyphs = {0x0020, 0x024F, 0x0370, 0x052F, 0x2010, 0x2044, 0x2190,
                                                     0x21FF, 0x2200, 0x22FF, 0x25A0, 0x25FF, 0};
  ImFontAtlas& fonts = *ImGui::GetIO().Fonts;
  fonts.Clear();
  for (const char* folder : folders) {
    const std::string path = std::string(folder) + "DejaVuSans.ttf";
    std::error_code error;
    if (!std::filesystem::is_regular_file(path, error)) continue;
    ImFontConfig config;
    config.OversampleH = scale < 1.5f ? 2 : 1;
    config.OversampleV = 1;
    if (fonts.AddFontFromFileTTF(path.c_str(), std::round(font_size * scale), &config, glyphs.data()) == nullptr)
      continue;
    static constexpr std::array<ImWchar, 3> letters = {0x0020, 0x007E, 0};
    fonts.AddFontFromFileTTF(path.c_str(), std::round(title_size * scale), &config, letters.data());
    return;
  }
  ImFontConfig config;
  config.SizePixels = 13.0f * std::max(1.0f, std::round(scale));
  fonts.AddFontDefault(&config);
}

ImFont* title_font() { return ImGui::GetIO().Fonts->Fonts.back(); }

}  // namespace cumulet::demo
