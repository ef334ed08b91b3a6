// The editor of color ramps in cumulet-demo, without a window.

#include <gtest/gtest.h>

#include <array>
#include <string>

#include "color_ramp_edit.hpp"
#include "history.hpp"

namespace {

using namespace cumulet::demo;
using cumulet::settings::color_ramp_refusal;
using cumulet::settings::color_ramps;
using cumulet::settings::ColorStop;
using Stops = cumulet::settings::ColorStops;

const Stops plain = {{0.0f, 0.0f, 0.0f, 1.0f}, {2.0f, 1.0f, 0.5f, 0.0f}};

TEST(ColorRampEdit, AddedStopsKeepAllColors) {
  Stops stops = plain;
  EXPECT_EQ(color_at(stops, -1.0f), (std::array<float, 3>{0.0f, 0.0f, 1.0f}));
  EXPECT_EQ(color_at(stops, 1.5f), (std::array<float, 3>{0.75f, 0.375f, 0.25f}));
  EXPECT_EQ(color_at(stops, 9.0f), (std::array<float, 3>{1.0f, 0.5f, 0.0f}));
  EXPECT_EQ(add_stop(stops, 1.0f), 1u);
  EXPECT_EQ(stops[1], (ColorStop{1.0f, 0.5f, 0.25f, 0.5f}));
  EXPECT_EQ(add_stop(stops, 3.0f), 3u);
  EXPECT_EQ(stops[3], (ColorStop{3.0f, 1.0f, 0.5f, 0.0f}));
  EXPECT_EQ(add_stop(stops, 2.0f), 2u) << "the stop of this value";
  EXPECT_EQ(stops.size(), 4u);
  for (const float value : {0.3f, 1.0f, 1.7f}) EXPECT_EQ(color_at(stops, value), color_at(plain, value)) << value;
}

TEST(ColorRampEdit, MovesBetweenNeighborsAndKeepsTwoStops) {
  Stops stops = plain;
  static_cast<void>(add_stop(stops, 1.0f));
  move_stop(stops, 1, 1.5f);
  EXPECT_EQ(stops[1], (ColorStop{1.5f, 0.5f, 0.25f, 0.5f})) << "with its color";
  move_stop(stops, 1, 5.0f);
  EXPECT_LT(stops[1][0], 2.0f);
  EXPECT_GT(stops[1][0], 1.99f);
  EXPECT_TRUE(remove_stop(stops, 0));
  EXPECT_FALSE(remove_stop(stops, 0)) << "a color ramp has two";
}

// After any edit it is a valid color ramp.
TEST(ColorRampEdit, StaysAValidColorRamp) {
  Stops stops = plain;
  for (int i = 0; i < 40; ++i) static_cast<void>(add_stop(stops, 0.01f * static_cast<float>(i * 7 % 40)));
  EXPECT_EQ(stops.size(), cumulet::settings::max_ramp_points);
  EXPECT_FALSE(add_stop(stops, 1.234f)) << "no room";
  for (const float to : {-1e38f, 5.0f, 0.1f, 1e38f}) {
    for (std::size_t i = 0; i < stops.size(); ++i) {
      move_stop(stops, i, to);
      EXPECT_EQ(color_ramp_refusal(color_ramps[0], stops), "");
    }
  }
}

TEST(ColorRampEdit, AStopDraggedOffReturnsWithTheMouse) {
  Stops stops = plain;
  ColorRampView view;
  view.held = view.chosen = *add_stop(stops, 1.0f);
  EXPECT_TRUE(drag_stop(stops, view, 1.25f, false));
  EXPECT_EQ(stops[1][0], 1.25f);
  EXPECT_TRUE(drag_stop(stops, view, 1.5f, true));
  EXPECT_EQ(stops, plain);
  EXPECT_FALSE(drag_stop(stops, view, 1.6f, true)) << "it is off already";
  EXPECT_TRUE(drag_stop(stops, view, 0.5f, false));
  ASSERT_EQ(stops.size(), 3u);
  EXPECT_EQ(stops[1], (ColorStop{0.5f, 0.5f, 0.25f, 0.5f})) << "at another value, with its color";
  EXPECT_EQ(view.held, 1u);
  Stops two = plain;
  view = {};
  view.held = 0;
  EXPECT_TRUE(drag_stop(two, view, 0.5f, true));
  EXPECT_EQ(two.size(), 2u) << "the last two stay, and are moved";
  EXPECT_EQ(two[0][0], 0.5f);
}

TEST(ColorRampEdit, FitsTheRangeToGridAndStops) {
  ColorRampView view;
  view.chosen = 5;
  fit(view, plain, 3.0f);
  EXPECT_EQ(view.min_value, 0.0f);
  EXPECT_EQ(view.max_value, 3.0f);
  EXPECT_EQ(view.chosen, 1u);
  fit(view, {{-2.0f, 0.0f, 0.0f, 0.0f}, {5.0f, 1.0f, 1.0f, 1.0f}}, 3.0f);
  EXPECT_EQ(view.min_value, -2.0f);
  EXPECT_EQ(view.max_value, 5.0f);
  view.held = 1;
  fit(view, plain, 3.0f);
  EXPECT_EQ(view.max_value, 5.0f) << "not while it is dragged";
  fit(view, {}, 3.0f);
  EXPECT_FALSE(view.held) << "an undo has removed it";
}

TEST(ColorRampEdit, PresetsAndTextsAreValid) {
  EXPECT_GE(color_ramp_presets().size(), 5u);
  for (const ColorRampPreset& preset : color_ramp_presets()) {
    for (const float most : {1.0f, 0.003f, 4000.0f}) {
      const Stops stops = stops_of(preset, most);
      EXPECT_EQ(color_ramp_refusal(color_ramps[CUMULET_RAMP_DENSITY], stops), "") << preset.label;
      EXPECT_EQ(stops.front()[0], 0.0f);
      EXPECT_EQ(stops.back()[0], most);
      EXPECT_EQ(color_ramp_of_text(color_ramps[0], color_ramp_text(stops)), stops) << preset.label;
    }
  }
  EXPECT_EQ(color_ramp_text({{0.0f, 0.0f, 0.0f, 0.0f}, {0.5f, 1.0f, 0.25f, 20.0f}}), "0:0/0/0,0.5:1/0.25/20");
  for (const char* text : {"", "none", "hello", "0:0/0/0", "0:0,1:1", "1:0/0/0,0:1/1/1", "0:0/0/0,1:20/0/0"})
    EXPECT_FALSE(color_ramp_of_text(color_ramps[CUMULET_RAMP_DENSITY], text)) << text;
  EXPECT_TRUE(color_ramp_of_text(color_ramps[CUMULET_RAMP_FLAME], "0:0/0/0,1:20/0/0")) << "emission has no limit of 1";
}

TEST(ColorRampEdit, FirstStopsOfDensityAndFlameChangeNothing) {
  cumulet_medium_desc medium{};
  const std::array<float, 3> white{1.0f, 1.0f, 1.0f};
  for (const float value : {0.0f, 1.0f, 3.0f}) {
    EXPECT_EQ(color_at(first_stops(CUMULET_RAMP_DENSITY, 3.0f, medium), value), white);
    EXPECT_EQ(color_at(first_stops(CUMULET_RAMP_FLAME, 3.0f, medium), value), white) << "the default";
  }
  medium.flame_color[0] = 2.0f;
  EXPECT_EQ(color_at(first_stops(CUMULET_RAMP_FLAME, 3.0f, medium), 1.0f), (std::array<float, 3>{2.0f, 0.0f, 0.0f}));
  EXPECT_EQ(color_at(first_stops(CUMULET_RAMP_DENSITY, 3.0f, medium), 1.0f), white);
  const std::array<float, 3> fire = color_at(first_stops(CUMULET_RAMP_TEMPERATURE, 3.0f, medium), 1.5f);
  EXPECT_GT(fire[0], fire[1]);
  EXPECT_GT(fire[1], fire[2]);
}

TEST(UndoHistory, ColorRampChangeIsOneNamedStep) {
  SceneOptions scene;
  History history(scene);
  const SceneOptions before = scene;
  scene.color_ramps[CUMULET_RAMP_FLAME] = plain;
  EXPECT_EQ(change_name(before, scene), "Color ramp");
  history.offer(scene, false);
  const auto undone = history.undo(scene);
  ASSERT_TRUE(undone);
  EXPECT_TRUE(undone->color_ramps[CUMULET_RAMP_FLAME].empty());
}

}  // namespace
