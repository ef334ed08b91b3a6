// The sequence section of the panel, and the timeline below the image.

#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <string>
#include <vector>

#include "icon_button.hpp"
#include "panel.hpp"

namespace cumulet::demo {
namespace {

/// Returns true if the setting has an effect with this interpolation between frames.
template <class Setting>
bool acts(const Setting& setting, const cumulet_playback_desc& playback) {
  using Desc = cumulet_playback_desc;
  if (setting.is(&Desc::subframes)) return playback.interpolation != CUMULET_FRAME_INTERPOLATION_NONE;
  return !setting.is(&Desc::velocity_scale) || playback.interpolation == CUMULET_FRAME_INTERPOLATION_ADVECT;
}

/// Returns the least difference of two numbers on the timeline that is at least this: 1, 2 or 5 times a power of ten.
std::uint32_t tick_step(double least) {
  for (double power = 1.0;; power *= 10.0)
    for (const double digit : {1.0, 2.0, 5.0})
      if (digit * power >= least) return static_cast<std::uint32_t>(digit * power);
}

/// Draws the numbers of frames over the timeline, each at the left of its frame.
void draw_numbers(const Ui& ui, const Play& play, ImVec2 corner, ImVec2 room) {
  const std::uint32_t count = play.row.count();
  const Frame last = play.row.number(count - 1);
  const float frame_width = room.x / static_cast<float>(count);
  const float text_width = ImGui::CalcTextSize(std::to_string(last).c_str()).x + ui.px(16.0f);
  // Files may be numbered in steps.
  const double stride = count > 1 ? static_cast<double>(last - play.row.number(0)) / (count - 1) : 1.0;
  const std::uint32_t step = tick_step(stride * static_cast<double>(text_width / std::max(frame_width, 1e-3f)));
  ImDrawList& list = *ImGui::GetWindowDrawList();
  for (std::uint32_t i = 0; i < count; ++i) {
    const Frame number = play.row.number(i);
    if (number % static_cast<Frame>(step) != 0) continue;
    const float x = corner.x + frame_width * static_cast<float>(i);
    const bool on_white = i == play.info.requested_frame;
    list.AddLine({x, corner.y}, {x, corner.y + 0.3f * room.y}, IM_COL32(134, 141, 152, 160), ui.px(1.0f));
    list.AddText({x + ui.px(3.0f), corner.y - ui.px(1.0f)},
                 on_white ? IM_COL32(20, 22, 26, 255) : IM_COL32(170, 177, 187, 255), std::to_string(number).c_str());
  }
}

constexpr ImU32 cached_color = IM_COL32(95, 143, 191, 255);
constexpr ImU32 broken_color = IM_COL32(200, 90, 75, 255);
constexpr ImU32 displayed_color = IM_COL32(236, 200, 120, 160);

void draw_first(const Pen& pen) {
  pen.bar({-8.0f, -7.0f}, {-5.5f, 7.0f});
  pen.triangle({7.0f, -7.0f}, {7.0f, 7.0f}, {-4.5f, 0.0f});
}
void draw_previous(const Pen& pen) {
  pen.triangle({3.0f, -7.0f}, {3.0f, 7.0f}, {-8.0f, 0.0f});
  pen.bar({4.5f, -7.0f}, {7.0f, 7.0f});
}
void draw_play(const Pen& pen) { pen.triangle({-6.0f, -8.0f}, {-6.0f, 8.0f}, {8.0f, 0.0f}); }
void draw_pause(const Pen& pen) {
  pen.bar({-6.0f, -8.0f}, {-1.5f, 8.0f});
  pen.bar({1.5f, -8.0f}, {6.0f, 8.0f});
}
void draw_next(const Pen& pen) {
  pen.bar({-7.0f, -7.0f}, {-4.5f, 7.0f});
  pen.triangle({-3.0f, -7.0f}, {-3.0f, 7.0f}, {8.0f, 0.0f});
}
void draw_last(const Pen& pen) {
  pen.triangle({-7.0f, -7.0f}, {-7.0f, 7.0f}, {4.5f, 0.0f});
  pen.bar({5.5f, -7.0f}, {8.0f, 7.0f});
}
void draw_loop(const Pen& pen) {
  constexpr float radius = 7.0f;
  constexpr float pi = std::numbers::pi_v<float>;
  pen.arc(radius, 1.1f * pi, 1.85f * pi);
  pen.triangle({2.5f, -3.5f}, {11.0f, -3.5f}, {7.0f, 2.0f});
  pen.arc(radius, 0.1f * pi, 0.85f * pi);
  pen.triangle({-2.5f, 3.5f}, {-11.0f, 3.5f}, {-7.0f, -2.0f});
}

/// Draws the buttons that control playback. Between two of them is a gap.
void draw_transport(Ui& ui, float gap, Model& model, std::vector<Command>& commands) {
  const float side = ImGui::GetFrameHeight();
  const auto button = [&](const IconButton& what) {
    const bool clicked = icon_button(ui, what, side);
    ImGui::SameLine(0.0f, gap);
    return clicked;
  };
  if (button({"First", "First frame of the playback.", draw_first})) commands.push_back({Action::go_to_end, {}, -1});
  if (button({"Previous", "Previous frame (comma).", draw_previous})) commands.push_back({Action::step, {}, -1});
  if (button({"Play", model.playing ? "Pause (Space)." : "Play (Space).", model.playing ? draw_pause : draw_play}))
    commands.push_back({Action::play});
  if (button({"Next", "Next frame (period).", draw_next})) commands.push_back({Action::step, {}, 1});
  if (button({"Last", "Last frame of the playback.", draw_last})) commands.push_back({Action::go_to_end, {}, 1});
  cumulet_repeat& repeat = model.scene.sequence.playback.repeat;
  const bool loops = repeat != CUMULET_REPEAT_HOLD;
  const char* const tip = loops ? "Loop is on, as for every sequence that is opened: playback starts again after the "
                                  "last frame."
                                : "Loop is off: playback stops at the last frame.";
  if (button({"Loop", tip, draw_loop, loops})) repeat = loops ? CUMULET_REPEAT_HOLD : CUMULET_REPEAT_LOOP;
}

/// An entry of the legend: a colored square and a text.
struct LegendEntry {
  ImU32 color;
  std::string text;
};

/// Explains the colors of the timeline.
std::vector<LegendEntry> legend_of(const Play& play, bool other) {
  const std::string cached = std::string("cached ").append(std::to_string(play.info.ready_frames));
  const std::string all = std::to_string(play.info.frames) + ", " + short_bytes(static_cast<double>(play.info.bytes));
  std::vector<LegendEntry> legend = {{cached_color, cached + " / " + all}};
  if (play.info.failed_frames > 0)
    legend.push_back({broken_color, std::string("missing ").append(std::to_string(play.info.failed_frames))});
  if (other) legend.push_back({displayed_color, "displayed"});
  return legend;
}

float width_of(const Ui& ui, const LegendEntry& entry) {
  return ui.px(28.0f) + ImGui::CalcTextSize(entry.text.c_str()).x;
}

/// Draws the legend at the right of the row, as far as it has room.
void draw_legend(const Ui& ui, std::vector<LegendEntry> legend, float from) {
  std::ranges::reverse(legend);
  float x = ImGui::GetWindowPos().x + ImGui::GetWindowContentRegionMax().x;
  const float y = ImGui::GetCursorScreenPos().y;
  ImDrawList& list = *ImGui::GetWindowDrawList();
  for (const LegendEntry& entry : legend) {
    x -= width_of(ui, entry);
    if (x < from) return;
    const float middle = y + 0.5f * ImGui::GetFrameHeight();
    const float left = x + ui.px(12.0f);
    const float half = ui.px(4.5f);
    list.AddRectFilled({left, middle - half}, {left + 2.0f * half, middle + half}, entry.color);
    list.AddText({left + ui.px(14.0f), middle - 0.5f * ImGui::GetTextLineHeight()},
                 ImGui::GetColorU32(ImGuiCol_TextDisabled), entry.text.c_str());
  }
}

}  // namespace

void Panel::sequence(Model& model, std::vector<Command>& commands) {
  if (!model.status.play) {
    const FrameRow& row = *model.status.neighbours;
    ui_.value_row("Frames", std::to_string(row.number(0)) + " to " + std::to_string(row.number(row.count() - 1)));
    if (ui_.button("Play the sequence", "The file is part of a numbered sequence: plays the sequence.", {-1.0f, 0.0f}))
      commands.push_back({Action::play_row});
    return;
  }
  const Play& play = *model.status.play;
  SceneSequence& sequence = model.scene.sequence;
  using Desc = cumulet_playback_desc;
  settings::for_each<Desc>([&](const auto& setting) {
    if (!acts(setting, sequence.playback)) return;
    rows_.draw(setting, sequence.playback.*setting.field);
  });
  const Frame least = play.row.number(0);
  const Frame most = play.row.number(play.row.count() - 1);
  const cumulet_playback_desc played = playback_of(sequence, play.row);
  Frame first = play.row.number(played.first_frame);
  Frame last = play.row.number(played.first_frame + played.frame_count - 1);
  if (ui_.slider("First played", "First frame of playback (I: set to the current frame).", first, least, most, "%d"))
    sequence.first = std::min(first, last);
  if (ui_.slider("Last played", "Last frame of playback (O: set to the current frame).", last, least, most, "%d"))
    sequence.last = std::max(first, last);
  ui_.value_row("Cached", std::to_string(play.info.ready_frames) + " of " + std::to_string(play.info.frames) + ", " +
                              short_bytes(static_cast<double>(play.info.bytes)));
  if (play.info.failed_frames > 0) ui_.value_row("Missing", std::to_string(play.info.failed_frames));
}

void Panel::transport(Model& model, bool other, std::vector<Command>& commands) {
  const Play& play = *model.status.play;
  const float right = ImGui::GetWindowContentRegionMax().x;
  const float gap = ui_.px(3.0f);
  draw_transport(ui_, gap, model, commands);
  // A narrow timeline has the buttons, then the frame, then the frame rate, then the legend.
  const float rate = ui_.px(76.0f);
  std::string text = std::string("Frame ").append(std::to_string(play.frame()));
  if (right - ImGui::GetCursorPosX() > rate + ImGui::CalcTextSize(text.c_str()).x + ui_.px(24.0f)) {
    ImGui::SetCursorPosX(ImGui::GetCursorPosX() + ui_.px(6.0f));
    ImGui::SetNextItemWidth(rate);
    double& fps = model.scene.sequence.playback.frames_per_second;
    constexpr double least = 0.01;
    constexpr double most = 1000.0;
    ImGui::DragScalar("##Playback rate", ImGuiDataType_Double, &fps, 0.1f, &least, &most, "%.4g fps",
                      ImGuiSliderFlags_AlwaysClamp);
    ui_.remember("Playback rate", "Frames per second. Drag, or double-click to type.");
    ImGui::SameLine(0.0f, ui_.px(10.0f));
  }
  if (other) text += ", displayed: " + std::to_string(play.row.number(play.info.displayed_frame));
  if (!play.failure.empty()) text += ": " + play.failure;
  ImGui::AlignTextToFramePadding();
  const ImVec2 corner = ImGui::GetCursorScreenPos();
  const float room = right - ImGui::GetCursorPosX();
  ImGui::PushClipRect(corner, {corner.x + std::max(room, 0.0f), corner.y + ImGui::GetFrameHeight()}, true);
  ImGui::TextUnformatted(text.c_str());
  ui_.remember("Frame", text.c_str());
  ImGui::PopClipRect();
  const float end = ImGui::GetItemRectMax().x;
  ImGui::SameLine();
  draw_legend(ui_, legend_of(play, other), end);
  ImGui::NewLine();
}

void Panel::timeline(Model& model, std::vector<Command>& commands) {
  const Play& play = *model.status.play;
  const auto top = static_cast<float>(view_.y + view_.height);
  const auto width = static_cast<float>(view_.x + view_.width);
  ImGui::SetNextWindowPos({0.0f, top});
  ImGui::SetNextWindowSize({width, ImGui::GetIO().DisplaySize.y - top});
  ImGui::PushStyleVar(ImGuiStyleVar_WindowRounding, 0.0f);
  ImGui::PushStyleVar(ImGuiStyleVar_WindowPadding, {ui_.px(8.0f), ui_.px(5.0f)});
  ImGui::Begin("Timeline", nullptr,
               ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoSavedSettings |
                   ImGuiWindowFlags_NoBringToFrontOnFocus | ImGuiWindowFlags_NoFocusOnAppearing |
                   ImGuiWindowFlags_NoScrollWithMouse);
  ImGui::PopStyleVar(2);
  const bool other = play.info.is_displayed != 0 && play.info.displayed_frame != play.info.requested_frame;
  transport(model, other, commands);

  // Draws the frames from left to right: ready frames, played range and current frame.
  const ImVec2 room(ImGui::GetContentRegionAvail().x, std::max(ImGui::GetContentRegionAvail().y, ui_.px(8.0f)));
  const ImVec2 corner = ImGui::GetCursorScreenPos();
  ImGui::InvisibleButton("##Playhead", {std::max(room.x, 1.0f), room.y});
  const auto count = static_cast<float>(play.row.count());
  if (ImGui::IsItemActive()) {
    const float part = (ImGui::GetIO().MousePos.x - corner.x) / std::max(room.x, 1.0f);
    const auto index = static_cast<std::uint32_t>(std::clamp(std::floor(part * count), 0.0f, count - 1.0f));
    commands.push_back({Action::go_to, {}, static_cast<int>(index)});
  }
  ui_.remember("Playhead",
               "Drag to select a frame. White: the current frame, blue: cached, red: missing or unreadable. Amber: "
               "displayed until the current frame is ready.");
  ImDrawList& list = *ImGui::GetWindowDrawList();
  const auto x_of = [&](float index) { return corner.x + room.x * index / count; };
  const auto bar = [&](float from, float to, float high, float low, ImU32 color) {
    list.AddRectFilled({x_of(from), corner.y + high * room.y},
                       {std::max(x_of(to), x_of(from) + 1.0f), corner.y + low * room.y}, color);
  };
  bar(0.0f, count, 0.0f, 1.0f, IM_COL32(40, 44, 50, 255));
  const cumulet_playback_desc played = playback_of(model.scene.sequence, play.row);
  const auto first = static_cast<float>(played.first_frame);
  bar(first, first + static_cast<float>(played.frame_count), 0.0f, 1.0f, IM_COL32(62, 68, 78, 255));
  for (std::size_t i = 0; i < play.states.size();) {
    std::size_t end = i + 1;
    while (end < play.states.size() && play.states[end] == play.states[i]) ++end;
    const auto from = static_cast<float>(i);
    const auto to = static_cast<float>(end);
    if (play.states[i] == CUMULET_FRAME_READY) bar(from, to, 0.72f, 1.0f, cached_color);
    if (play.states[i] == CUMULET_FRAME_FAILED) bar(from, to, 0.72f, 1.0f, broken_color);
    i = end;
  }
  const auto asked = static_cast<float>(play.info.requested_frame);
  bar(asked, asked + 1.0f, 0.0f, 1.0f, IM_COL32(236, 236, 236, 200));
  draw_numbers(ui_, play, corner, room);
  if (other) {
    const auto drawn = static_cast<float>(play.info.displayed_frame);
    bar(drawn, drawn + 1.0f, 0.0f, 0.72f, displayed_color);
  }
  ImGui::End();
}

}  // namespace cumulet::demo
