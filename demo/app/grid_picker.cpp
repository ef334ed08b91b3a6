#include "grid_picker.hpp"

#include <cumulet/cumulet.h>
#include <imgui.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <utility>

namespace cumulet::demo {
namespace {

constexpr const char* popup = "Grids of the file###grids";

struct ReleaseInspection {
  void operator()(cumulet_inspection* inspection) const { cumulet_inspection_release(inspection); }
};

}  // namespace

GridPicker::Reader::Reader(std::string path, std::function<void()> wake)
    : path_(std::move(path)), wake_(std::move(wake)), thread_([this] { read(); }) {}

GridPicker::Reader::~Reader() {
  stop();
  thread_.join();
}

GridPicker::Reader::Found GridPicker::Reader::found() const {
  const std::lock_guard lock(mutex_);
  return found_;
}

void GridPicker::Reader::read() {
  const auto update = [this](auto&& change) {
    {
      const std::lock_guard lock(mutex_);
      change(found_);
    }
    wake_();
  };
  std::array<char, 512> error{};
  cumulet_inspection* opened = nullptr;
  cumulet_volume_file_info file{};
  file.struct_size = sizeof file;
  const auto status = cumulet_inspect_volume_file(path_.c_str(), &opened, error.data(), error.size());
  const std::unique_ptr<cumulet_inspection, ReleaseInspection> inspection(opened);
  if (status != CUMULET_OK || cumulet_inspection_get_file(opened, &file) != CUMULET_OK) {
    update([&](Found& found) {
      found.trouble = error.data();
      found.all = true;
    });
    return;
  }
  for (std::uint32_t i = 0; i < file.grid_count && !stop_; ++i) {
    cumulet_grid_info info{};
    info.struct_size = sizeof info;
    if (cumulet_inspection_get_grid(opened, i, &info) != CUMULET_OK) continue;
    Grid grid{info.name,
              std::string(info.type) + ", " + info.grid_class + (*info.channel != '\0' ? ": " : "") + info.channel,
              info.unsupported_reason,
              info.active_voxels,
              info.min_value,
              info.max_value,
              {}};
    if (info.values != CUMULET_GRID_VALUES_NONE && info.active_voxels > 0) grid.histogram = heights(info.histogram);
    update([&](Found& found) { found.grids.push_back(std::move(grid)); });
  }
  update([](Found& found) { found.all = true; });
}

void GridPicker::open(const std::string& path, std::function<void()> wake) {
  for (const auto& reader : readers_) reader->stop();
  std::erase_if(readers_, [](const auto& reader) { return reader->found().all; });
  readers_.push_back(std::make_unique<Reader>(path, std::move(wake)));
  path_ = path;
  opening_ = true;
}

bool GridPicker::draw_grid(Ui& ui, const Grid& grid) {
  const float line = ImGui::GetTextLineHeightWithSpacing();
  const float height = 2.0f * line + ui.px(6.0f);
  const float chart = ui.px(150.0f);
  const float width = ImGui::GetContentRegionAvail().x;
  const ImVec2 corner = ImGui::GetCursorScreenPos();
  ImGui::PushID(grid.name.c_str());
  ImGui::BeginDisabled(!grid.refusal.empty());
  const bool chosen = ImGui::Selectable("##grid", false, ImGuiSelectableFlags_DontClosePopups, {0.0f, height});
  ImGui::EndDisabled();
  ui.remember(("Grids/" + grid.name).c_str(),
              grid.refusal.empty() ? "Uses this grid as the density." : grid.refusal.c_str());
  ImGui::PopID();
  ImDrawList& draw = *ImGui::GetWindowDrawList();
  const ImU32 bright = ImGui::GetColorU32(grid.refusal.empty() ? ImGuiCol_Text : ImGuiCol_TextDisabled);
  const ImU32 quiet = ImGui::GetColorU32(ImGuiCol_TextDisabled);
  const float room = width - chart - ui.px(16.0f);
  const float top = corner.y + ui.px(3.0f);
  draw.AddText({corner.x, top}, bright, grid.name.c_str());
  draw.AddText({corner.x + ImGui::CalcTextSize(grid.name.c_str()).x + ui.px(12.0f), top}, quiet, grid.type.c_str());
  std::array<char, 96> range{};
  std::snprintf(range.data(), range.size(), " voxels, %.4g to %.4g", static_cast<double>(grid.least),
                static_cast<double>(grid.most));
  const std::string summary = short_count(static_cast<double>(grid.voxels)) + range.data();
  draw.AddText({corner.x, top + line}, quiet,
               grid.refusal.empty() ? summary.c_str() : end_of(grid.refusal, room).c_str());
  const float left = corner.x + width - chart;
  const float bottom = corner.y + height - ui.px(3.0f);
  draw.AddRectFilled({left, top}, {left + chart, bottom}, ImGui::GetColorU32(ImGuiCol_FrameBg), ui.px(3.0f));
  const auto count = static_cast<float>(std::max<std::size_t>(grid.histogram.size(), 1));
  for (std::size_t i = 0; i < grid.histogram.size(); ++i) {
    const float at = left + chart * static_cast<float>(i) / count;
    draw.AddRectFilled({at, bottom - (bottom - top) * grid.histogram[i]}, {at + chart / count, bottom},
                       ImGui::GetColorU32(ImGuiCol_PlotHistogram));
  }
  return chosen && grid.refusal.empty();
}

void GridPicker::draw(Ui& ui, std::vector<Command>& commands) {
  if (opening_) ImGui::OpenPopup(popup);
  const ImVec2 screen = ImGui::GetIO().DisplaySize;
  ImGui::SetNextWindowPos({screen.x * 0.5f, screen.y * 0.5f}, ImGuiCond_Always, {0.5f, 0.5f});
  ImGui::SetNextWindowSize({std::min(ui.px(600.0f), screen.x * 0.95f), 0.0f});
  open_ = ImGui::BeginPopupModal(
      popup, nullptr, ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoResize | ImGuiWindowFlags_AlwaysAutoResize);
  opening_ = false;
  if (!open_) return;
  const Reader::Found found = readers_.back()->found();
  Ui::heading(end_of(path_, ImGui::GetContentRegionAvail().x).c_str());
  ImGui::Spacing();
  ImGui::BeginChild("list", {0.0f, std::min(ui.px(330.0f), screen.y * 0.6f)}, true, ImGuiWindowFlags_NavFlattened);
  bool done = false;
  for (const Grid& grid : found.grids) {
    if (!draw_grid(ui, grid)) continue;
    commands.push_back({Action::choose_grid, grid.name});
    done = true;
  }
  if (!found.all) Ui::heading("Reading ...");
  if (!found.trouble.empty()) ImGui::TextWrapped("%s", found.trouble.c_str());
  ImGui::EndChild();
  const bool escape = ImGui::IsKeyPressed(ImGui::GetKeyIndex(ImGuiKey_Escape)) && !ImGui::IsAnyItemActive();
  if (ui.button("Keep current", "Closes the window and keeps the current grid (Escape).", {ui.px(124.0f), 0.0f}) ||
      escape || done) {
    open_ = false;
    for (const auto& reader : readers_) reader->stop();
    ImGui::CloseCurrentPopup();
  }
  ImGui::EndPopup();
}

}  // namespace cumulet::demo
