// The table of settings compared with everything derived from it: C API, scene files, flags, and their documentation
// page.

#include "settings/settings.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstring>
#include <fstream>
#include <memory>
#include <set>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include "options.hpp"
#include "settings/aov_table.hpp"
#include "stage/settings.hpp"
#include "viewer/c_fields.hpp"
#include "viewer/c_settings.hpp"

namespace {

using namespace cumulet;
using demo::SceneOptions;
using settings::Setting;

/// Calls visit with each descriptor of a scene and the function that sets it on a viewer.
template <class Visit>
void for_each_descriptor(Visit&& visit) {
  visit(&SceneOptions::medium, cumulet_set_medium);
  visit(&SceneOptions::light, cumulet_set_sun_sky);
  visit(&SceneOptions::environment_settings, cumulet_set_environment_settings);
  visit(&SceneOptions::ground, cumulet_set_ground);
  visit(&SceneOptions::grid, cumulet_set_grid);
  visit(&SceneOptions::surface, cumulet_set_surface_settings);
  visit(&SceneOptions::sampling, cumulet_set_sampling);
  visit(&SceneOptions::display, cumulet_set_display);
}

/// Sets a valid value that is not the default.
template <class Desc, class Value>
void set_sample(const Setting<Desc, Value>& setting, Value& value) {
  if constexpr (settings::Enumerated<Value>) {
    const Value before = value;
    for (const settings::Choice& choice : setting.choices)
      if (static_cast<Value>(choice.value) != before) value = static_cast<Value>(choice.value);
  } else if constexpr (settings::Triple<Value>) {
    value[0] = 0.25f;
    value[1] = 0.5f;
    value[2] = 0.125f;
  } else if constexpr (settings::Rectangle<Value>) {
    constexpr std::array sample{0.25f, 0.5f, 0.125f, 0.375f};
    std::ranges::copy(sample, value);
  } else if constexpr (settings::Switch<Value>) {
    value = 1;
  } else if constexpr (settings::Count<Value>) {
    value = 7;
  } else {
    value = static_cast<Value>(std::max(0.25, setting.given_range().least));
  }
}

/// The text of that value on the command line.
template <class Desc, class Value>
std::string sample_text(const Setting<Desc, Value>& setting, const Value& value) {
  if constexpr (settings::Enumerated<Value>) {
    for (const settings::Choice& choice : setting.choices)
      if (choice.value == value) return choice.name;
    return "";
  } else if constexpr (settings::Triple<Value>) {
    return setting.spelling == settings::Spelling::complement ? "0.75,0.5,0.875" : "0.25,0.5,0.125";
  } else if constexpr (settings::Rectangle<Value>) {
    return "0.25,0.5,0.125,0.375";
  } else if constexpr (settings::Switch<Value>) {
    return "on";
  } else if constexpr (settings::Count<Value>) {
    return "7";
  } else {
    return settings::number_text(value);
  }
}

/// Sets a value that the C API rejects. Returns false if there is none.
template <class Desc, class Value>
bool set_bad(const Setting<Desc, Value>&, Value& value) {
  if constexpr (settings::Enumerated<Value> || settings::Switch<Value>) {
    const int bad = 99;
    std::memcpy(&value, &bad, sizeof value);
  } else if constexpr (std::is_array_v<Value>) {
    value[1] = std::numeric_limits<float>::quiet_NaN();
  } else if constexpr (settings::Count<Value>) {
    return false;
  } else {
    value = std::numeric_limits<Value>::quiet_NaN();
  }
  return true;
}

template <class Value>
bool equal(const Value& a, const Value& b) {
  if constexpr (std::is_array_v<Value>)
    return std::equal(std::begin(a), std::end(a), std::begin(b));
  else
    return a == b;
}

template <class Desc>
void expect_all_fields() {
  SCOPED_TRACE(settings::Table<Desc>::name);
  std::vector<std::string> names = {"struct_size"};
  const Desc desc{};
  settings::for_each<Desc>([&](const auto& setting) {
    const auto offset = static_cast<std::size_t>(reinterpret_cast<const char*>(&(desc.*setting.field)) -
                                                 reinterpret_cast<const char*>(&desc));
    for (const c_abi::Field& field : c_abi::fields_of<Desc>) {
      if (field.offset == offset) {
        EXPECT_STREQ(field.name, setting.name);
      }
    }
    names.emplace_back(setting.name);
  });
  std::set<std::string> fields;
  for (const c_abi::Field& field : c_abi::fields_of<Desc>) fields.insert(field.name);
  EXPECT_EQ(std::set<std::string>(names.begin(), names.end()), fields);
  EXPECT_EQ(names.size(), fields.size());
}

TEST(Settings, TheTableHasEveryFieldOfTheHeaderUnderItsName) {
  expect_all_fields<cumulet_medium_desc>();
  expect_all_fields<cumulet_sun_sky_desc>();
  expect_all_fields<cumulet_environment_settings_desc>();
  expect_all_fields<cumulet_light_desc>();
  expect_all_fields<cumulet_ground_desc>();
  expect_all_fields<cumulet_grid_desc>();
  expect_all_fields<cumulet_surface_settings_desc>();
  expect_all_fields<cumulet_sampling_desc>();
  expect_all_fields<cumulet_display_desc>();
  expect_all_fields<cumulet_camera_desc>();
  expect_all_fields<cumulet_navigation_desc>();
}

TEST(Settings, InterpolationIsLinearByDefaultWhereVoxelsAreInMainMemory) {
  using grid::Interpolation;
  struct Case {
    cumulet_interpolation asked;
    Interpolation in_memory, in_gl;
  };
  for (const bool can_stay : {false, true}) {
    SCOPED_TRACE(can_stay);
    for (const Case& one : {Case{CUMULET_INTERPOLATION_AUTO, Interpolation::linear,
                                 can_stay ? Interpolation::nearest : Interpolation::linear},
                            Case{CUMULET_INTERPOLATION_NEAREST, Interpolation::nearest, Interpolation::nearest},
                            Case{CUMULET_INTERPOLATION_LINEAR, Interpolation::linear, Interpolation::linear}}) {
      cumulet_grid_desc grid{};
      grid.struct_size = sizeof grid;
      grid.interpolation = one.asked;
      const auto expect = [&](cumulet_grid_type type, cumulet_build_device device) {
        grid.type = type;
        grid.build_device = device;
        const auto found = viewer::GridSettings::of(c_abi::read_settings(&grid));
        EXPECT_EQ(found.build.interpolation, one.in_memory) << one.asked;
        EXPECT_EQ(found.interpolation_in_gl, one.in_gl) << one.asked;
      };
      if (can_stay) {
        expect(CUMULET_GRID_TETRAHEDRAL, CUMULET_BUILD_GPU);
        continue;
      }
      // All cells of a scene are of one kind, and trilinear ones need interpolation.
      grid.cells = CUMULET_CELLS_TRILINEAR;
      expect(CUMULET_GRID_TETRAHEDRAL, CUMULET_BUILD_GPU);
      grid.cells = CUMULET_CELLS_LINEAR;
      expect(CUMULET_GRID_TETRAHEDRAL, CUMULET_BUILD_CPU);
      expect(CUMULET_GRID_DENSE, CUMULET_BUILD_GPU);
      expect(CUMULET_GRID_BRICKS, CUMULET_BUILD_CPU);
    }
  }
  // A scene leaves it to the library.
  EXPECT_NE(demo::scene_text(SceneOptions(), "/s.json").find(R"("interpolation": "auto")"), std::string::npos);
}

TEST(Settings, SceneFilesRoundTripEachSetting) {
  std::set<std::string> keys;
  std::set<std::string> without;
  for_each_descriptor([&](auto part, auto) {
    settings::for_each<std::decay_t<decltype(SceneOptions().*part)>>([&](const auto& setting) {
      if (*setting.key == '\0') {
        without.insert(setting.name);
        return;
      }
      EXPECT_TRUE(keys.insert(setting.key).second) << setting.key;
      SceneOptions scene;
      scene.surfaces = "/a.glb";
      scene.environment = "/a.hdr";
      const SceneOptions before = scene;
      set_sample(setting, scene.*part.*setting.field);
      EXPECT_FALSE(same_scene(scene, before)) << setting.key;
      EXPECT_FALSE(settings::same(scene.*part, before.*part)) << setting.key;
      const SceneOptions read = demo::parse_scene(demo::scene_text(scene, "/s.json"), "/s.json");
      EXPECT_TRUE(equal(read.*part.*setting.field, scene.*part.*setting.field)) << setting.key;
      EXPECT_TRUE(settings::same(read.*part, scene.*part)) << setting.key;
    });
  });
  // Settings that scene files do not contain, or contain by name (surfaces.variant).
  EXPECT_EQ(without,
            (std::set<std::string>{"first_sample", "light_groups", "preview", "variant", "separate_volume_aov"}));
}

TEST(Settings, DocumentationListsExactlyTheKeys) {
  std::ifstream file(CUMULET_DOCS "/scene_file.md");
  ASSERT_TRUE(file.is_open());
  std::set<std::string> documented;
  for (std::string line; std::getline(file, line);) {
    if (line.rfind("| `", 0) != 0) continue;
    std::istringstream parts(line.substr(2, line.find('|', 2) - 2));
    for (std::string key; std::getline(parts, key, '`');)
      if (key.find('.') != std::string::npos) documented.insert(key);
  }
  std::set<std::string> keys = {"volume.file",
                                "volume.grid",
                                "volume.up",
                                "medium.temperature_grid",
                                "medium.flame_grid",
                                "medium.color_grid",
                                "medium.anisotropy_grid",
                                "medium.velocity_grid",
                                "surfaces.file",
                                "surfaces.camera",
                                "surfaces.variant",
                                "camera.eye",
                                "camera.target",
                                "camera.up",
                                "camera.fovy_degrees",
                                "camera.orthographic_height",
                                "camera.lens_radius",
                                "camera.focus_distance",
                                "picture.width",
                                "picture.height",
                                "picture.light_groups",
                                "environment.file",
                                "display.ocio.config",
                                "display.ocio.display",
                                "display.ocio.view",
                                "display.ocio.input",
                                "sequence.first_frame",
                                "sequence.last_frame",
                                "sequence.frame"};
  settings::for_each<cumulet_playback_desc>([&](const auto& setting) {
    if (*setting.key != '\0') keys.insert(setting.key);
  });
  for_each_descriptor([&](auto part, auto) {
    settings::for_each<std::decay_t<decltype(SceneOptions().*part)>>([&](const auto& setting) {
      if (*setting.key != '\0') keys.insert(setting.key);
    });
  });
  for (const settings::RampInfo& ramp : settings::ramps) keys.insert(ramp.key);
  for (const settings::ColorRampInfo& ramp : settings::color_ramps) keys.insert(ramp.key);
  EXPECT_EQ(documented, keys);
}

TEST(Aovs, HeaderAndDocumentationListExactlyTheTable) {
  std::size_t constants = 0;
  std::ifstream header(CUMULET_DOCS "/../src/include/cumulet/cumulet.h");
  ASSERT_TRUE(header.is_open());
  for (std::string line; std::getline(header, line);) {
    const std::string_view text = std::string_view(line).substr(std::min(line.find_first_not_of(' '), line.size()));
    constants += text.starts_with("CUMULET_AOV_") ? 1 : 0;
  }
  EXPECT_EQ(constants, settings::aovs.size());
  std::ifstream page(CUMULET_DOCS "/aovs.md");
  ASSERT_TRUE(page.is_open());
  std::set<std::string> documented;
  for (std::string line; std::getline(page, line) && !line.starts_with("## ");) {
    if (line.starts_with("| `")) documented.insert(line.substr(3, line.find('`', 3) - 3));
  }
  for (const std::string_view name : {"denoised", "Combined_NAME", "CryptoObject00"})
    EXPECT_EQ(documented.erase(std::string(name)), 1U) << name;
  std::set<std::string> names;
  for (const settings::Aov& aov : settings::named_aovs) names.emplace(aov.name);
  EXPECT_EQ(documented, names);
}

TEST(Settings, EachSettingHasAFlag) {
  std::set<std::string> flags;
  std::set<std::string> without;
  for_each_descriptor([&](auto part, auto) {
    settings::for_each<std::decay_t<decltype(SceneOptions().*part)>>([&](const auto& setting) {
      if (*setting.flag == '\0') {
        without.insert(setting.name);
        return;
      }
      EXPECT_TRUE(flags.insert(setting.flag).second) << setting.flag;
      EXPECT_STRNE(setting.help, "") << setting.flag;
      SceneOptions scene;
      set_sample(setting, scene.*part.*setting.field);
      const std::string text = sample_text(setting, scene.*part.*setting.field);
      std::ostringstream out;
      const auto options = demo::parse_render_options({"--volume", "a.vdb", "--gltf", "a.glb", "--env", "a.hdr", "-o",
                                                       "a.png", std::string(setting.flag) + "=" + text},
                                                      out);
      ASSERT_TRUE(options.has_value());
      EXPECT_TRUE(equal(options->scene.*part.*setting.field, scene.*part.*setting.field)) << setting.flag;
    });
  });
  // --sun and --sky-model set three settings at once.
  EXPECT_EQ(without, (std::set<std::string>{"first_sample", "ground_albedo", "light_groups", "preview", "sky",
                                            "sun_azimuth_degrees", "sun_elevation_degrees", "sun_irradiance",
                                            "turbidity", "variant", "separate_volume_aov"}));
}

TEST(Settings, LibraryAcceptsEachAndNamesInvalidValues) {
  cumulet_create_desc create{};
  create.struct_size = sizeof create;
  cumulet_viewer* made = nullptr;
  ASSERT_EQ(cumulet_create(&create, &made, nullptr, 0), CUMULET_OK);
  const std::unique_ptr<cumulet_viewer, decltype(&cumulet_destroy)> viewer(made, cumulet_destroy);
  for_each_descriptor([&](auto part, auto set) {
    using Desc = std::decay_t<decltype(SceneOptions().*part)>;
    settings::for_each<Desc>([&](const auto& setting) {
      Desc desc = SceneOptions().*part;
      set_sample(setting, desc.*setting.field);
      EXPECT_EQ(set(made, &desc), CUMULET_OK) << setting.name << ": " << cumulet_last_error(made);
      if (!set_bad(setting, desc.*setting.field)) return;
      EXPECT_EQ(set(made, &desc), CUMULET_ERROR_INVALID_ARGUMENT) << setting.name;
      const std::string named = std::string(settings::Table<Desc>::name) + "." + setting.name + " is ";
      EXPECT_EQ(std::string(cumulet_last_error(made)).rfind(named, 0), 0U) << cumulet_last_error(made);
    });
  });
}

TEST(Settings, RangesAreReported) {
  using settings::Range;
  EXPECT_EQ(Range{}.refusal(), "is not finite");
  EXPECT_EQ((Range{0.0}).refusal(), "is negative");
  EXPECT_EQ((Range{1.0}).refusal(), "is less than 1");
  EXPECT_EQ(settings::above_zero.refusal(), "is not above 0");
  EXPECT_EQ((Range{-1.0, 1.0, true}).refusal(), "is not between -1 and 1");
  EXPECT_EQ((Range{0.0, 1e30}).refusal(), "is not from 0 to 1e30");
  EXPECT_FALSE(Range{}.holds(std::numeric_limits<double>::quiet_NaN()));
  EXPECT_FALSE(Range{}.holds(std::numeric_limits<double>::infinity()));
  EXPECT_FALSE(settings::above_zero.holds(0.0));
  EXPECT_TRUE((Range{0.0, 1.0}).holds(1.0));
}

}  // namespace
