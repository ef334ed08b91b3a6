#pragma once

#include <gtest/gtest.h>
#include <imgui.h>

#include <set>
#include <string>
#include <utility>
#include <vector>

#include "model.hpp"
#include "panel.hpp"

namespace cumulet::test {

using namespace cumulet::demo;

/// The panel without a window: ImGui computes the layout, and nothing is drawn.
class PanelTest : public ::testing::TestWithParam<std::pair<float, ImVec2>> {
 public:
  PanelTest(const PanelTest&) = delete;
  PanelTest& operator=(const PanelTest&) = delete;

 protected:
  PanelTest() {
    ImGui::CreateContext();
    ImGuiIO& io = ImGui::GetIO();
    io.IniFilename = nullptr;
    io.DisplaySize = GetParam().second;
    apply_theme(GetParam().first);
    load_fonts(GetParam().first);
    unsigned char* pixels = nullptr;
    int width = 0;
    int height = 0;
    io.Fonts->GetTexDataAsAlpha8(&pixels, &width, &height);
    model_.status.has_volume = model_.status.has_content = true;
    model_.status.stats.gl_renderer[0] = 'x';
    model_.status.stats.samples = model_.status.stats.steps = 1;
    model_.grids = {{"density", "float", ""}, {"velocity", "vec3s", "not a scalar"}};
    model_.preferences.recent = {"/a/cloud.vdb"};
    model_.scene.environment = "/a/sky.hdr";
    model_.thumbnail_texture = 1;
    for (const cumulet_light_kind kind : {CUMULET_LIGHT_SPOT, CUMULET_LIGHT_RECT}) {
      model_.scene.analytic_lights.emplace_back().struct_size = sizeof(cumulet_light_desc);
      model_.scene.analytic_lights.back().kind = kind;
    }
    spell_out_defaults(model_.scene);
  }
  ~PanelTest() override { ImGui::DestroyContext(); }

  void frame(const ImVec2& mouse = {-1.0f, -1.0f}) {
    ImGuiIO& io = ImGui::GetIO();
    io.DeltaTime = 1.0f / 60.0f;
    io.MousePos = mouse;
    time_ += 1.0 / 60.0;
    ImGui::NewFrame();
    panel_.draw(model_, GetParam().first, time_, commands_);
    ImGui::Render();
  }

  void check_controls() {
    const auto& controls = panel_.ui().controls();
    const std::set<std::string> without_tip = {"File",      "Edit",     "View",       "Render",        "Help",
                                               "Image",     "Sampling", "Advanced",   "Model",         "Triangles",
                                               "Grid data", "Levels",   "Cell count", "Active voxels", "OpenColorIO"};
    const auto is_group = [](const std::string& name) { return name.starts_with("Material/"); };
    EXPECT_GT(controls.size(), 20u);
    const ImVec2 screen = ImGui::GetIO().DisplaySize;
    for (const auto& [name, control] : controls) {
      EXPECT_EQ(control.has_tip, !without_tip.contains(name) && !is_group(name)) << name;
      const Rectangle& a = control.rectangle;
      EXPECT_GE(a.x, 0.0) << name;
      EXPECT_LE(a.x + a.width, static_cast<double>(screen.x) + 0.5) << name;
      EXPECT_GT(a.width, 2.0) << name;
      for (const auto& [other, control_b] : controls) {
        const Rectangle& b = control_b.rectangle;
        const bool apart =
            a.x + a.width <= b.x || b.x + b.width <= a.x || a.y + a.height <= b.y || b.y + b.height <= a.y;
        // The toolbar is fixed; scrolled controls pass below it.
        if (name < other && control.in_view && control_b.in_view) {
          EXPECT_TRUE(apart) << name << " and " << other;
        }
      }
    }
  }

  /// Clicks the middle of a control.
  void click(const std::string& label, ImGuiMouseButton button = ImGuiMouseButton_Left) {
    const auto rectangle = panel_.ui().find(label);
    ASSERT_TRUE(rectangle) << label;
    const ImVec2 middle(static_cast<float>(rectangle->x + rectangle->width / 2),
                        static_cast<float>(rectangle->y + rectangle->height / 2));
    frame(middle);
    ImGui::GetIO().MouseDown[button] = true;
    frame(middle);
    ImGui::GetIO().MouseDown[button] = false;
    frame(middle);
    frame(middle);
  }

  /// Opens the group of the ramps in the inspector of a volume.
  void open_ramps() {
    for (int i = 0; i < 5; ++i) {
      panel_.ui().bring_into_view("Material/Ramps");
      frame();
    }
    click("Material/Ramps");
  }

  void drag_mouse(const ImVec2& from, const ImVec2& to) {
    frame(from);
    ImGui::GetIO().MouseDown[0] = true;
    frame(from);
    constexpr int steps = 6;
    for (int i = 1; i <= steps; ++i) {
      const float part = static_cast<float>(i) / steps;
      frame({from.x + (to.x - from.x) * part, from.y + (to.y - from.y) * part});
    }
    frame(to);
    ImGui::GetIO().MouseDown[0] = false;
    frame(to);
    frame(to);
  }

  Model model_;
  Panel panel_;
  std::vector<Command> commands_;
  double time_ = 1.0;
};

/// Scales of the interface and sizes of the window.
inline auto panel_sizes() {
  return ::testing::Values(std::make_pair(1.0f, ImVec2(1440, 900)), std::make_pair(2.0f, ImVec2(1680, 1040)),
                           std::make_pair(1.0f, ImVec2(640, 400)), std::make_pair(1.25f, ImVec2(1024, 3000)),
                           std::make_pair(2.0f, ImVec2(900, 600)));
}

}  // namespace cumulet::test
