#include "options.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <analytic_light_limits.hpp>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>
#include <memory>
#include <names.hpp>
#include <ostream>
#include <presets.hpp>
#include <set>
#include <settings.hpp>
#include <type_traits>
#include <utility>

#include "old_flags.hpp"
#include "option_table.hpp"

namespace cumulet::demo {
namespace {

constexpr std::size_t help_columns = 100;

std::string in_quotes(std::string_view text) { return "'" + std::string(text) + "'"; }

std::vector<std::string_view> split(std::string_view text, char separator) {
  std::vector<std::string_view> parts;
  for (;;) {
    const auto end = text.find(separator);
    parts.push_back(text.substr(0, end));
    if (end == std::string_view::npos) return parts;
    text.remove_prefix(end + 1);
  }
}

/// Splits a value such as "0,0,1 0,0,0 40" at white space.
std::vector<std::string_view> words(std::string_view text) {
  constexpr std::string_view white = " \t\n\v\f\r";
  std::vector<std::string_view> parts;
  std::size_t at = text.find_first_not_of(white);
  while (at != std::string_view::npos) {
    const std::size_t end = std::min(text.find_first_of(white, at), text.size());
    parts.push_back(text.substr(at, end - at));
    at = text.find_first_not_of(white, end);
  }
  return parts;
}

/// Parses three numbers in a range.
std::array<double, 3> parse_three(std::string_view text, const settings::Range& range) {
  const std::vector<double> values = parse_numbers(text, 3);
  for (const double value : values) {
    if (range.holds(value)) continue;
    const bool negative = range.least == 0.0 && value < 0.0;
    throw UsageError(in_quotes(text) + (negative ? " has a negative number" : " has a number that is too large"));
  }
  return {values[0], values[1], values[2]};
}

void parse_light(std::string_view text, float (&rgb)[3]) {
  const std::array<double, 3> values = parse_three(text, settings::light_range);
  for (std::size_t i = 0; i < 3; ++i) rgb[i] = static_cast<float>(values[i]);
}

/// Adds a flag with a value. If it is repeated, the last one wins. A bad value is an error that names the flag.
CLI::Option* add(CLI::App& app, const char* group, const std::string& flag, const std::string& type,
                 std::function<void(const std::string&)> parse, const std::string& help) {
  const auto checked = [flag, parse = std::move(parse)](const std::string& text) {
    try {
      parse(text);
    } catch (const UsageError& error) {
      // The long spelling is easier to recognize in a script's log.
      throw CLI::ValidationError(flag.substr(flag.rfind("--")), error.what());
    }
  };
  return app.add_option_function<std::string>(flag, checked, help)->type_name(type)->group(group)->take_last();
}

/// Returns the value with this name; null if there is none. Reports a name of an earlier version. of: the text before
/// the name on the command line.
template <class Names>
auto* find_choice(const CLI::App& app, const std::string& of, const Names& names, std::string_view text) {
  for (const auto& name : names) {
    if (text == name.name) return &name;
    if constexpr (requires { name.old; }) {
      if (text.empty() || text != name.old) continue;
      report_renamed(app, of + ' ' + name.old, of + ' ' + name.name);
      return &name;
    }
  }
  return static_cast<decltype(&*std::begin(names))>(nullptr);
}

template <class Names, class Target>
CLI::Option* add_choice(CLI::App& app, const char* group, const std::string& flag, const Names& names, Target& target,
                        const std::string& help) {
  return add(
      app, group, flag, list_names(names, "|"),
      [&app, flag, names, &target](const std::string& text) {
        const auto* const found = find_choice(app, flag, names, text);
        if (found == nullptr) throw UsageError(in_quotes(text) + " is not one of " + list_names(names, ", "));
        target = static_cast<Target>(found->value);
      },
      help);
}

/// Returns true if the flag's text is a keyword that has been handled, so that it is not parsed as a value.
using TakeWord = std::function<bool(std::string_view flag, const std::string& text)>;

/// Parses a number in the range that users may set and that the field can represent.
template <class Desc, class Value>
Value parse_real(const settings::Setting<Desc, Value>& setting, const std::string& text) {
  const double number = parse_number(text);
  const auto value = static_cast<Value>(number);
  const settings::Range range = setting.given_range();
  if (!range.holds(number) || !range.holds(value)) throw UsageError(in_quotes(text) + " " + range.refusal());
  const bool negative = setting.spelling == settings::Spelling::zero_is_negative && value == Value{};
  return negative ? Value{-1} : value;
}

/// Parses a whole number in the range that users may set and that the field can represent.
template <class Desc, class Value>
Value parse_count(const settings::Setting<Desc, Value>& setting, const std::string& text) {
  const settings::Range range = setting.given_range();
  constexpr auto most = static_cast<double>(std::numeric_limits<Value>::max());
  return static_cast<Value>(parse_integer(
      text, static_cast<std::uint64_t>(std::max(range.least, 0.0)),
      range.most < most ? static_cast<std::uint64_t>(range.most) : std::uint64_t{std::numeric_limits<Value>::max()}));
}

/// Parses three numbers in the range that users may set and that the field can represent.
template <class Desc, class Value>
void parse_triple(const settings::Setting<Desc, Value>& setting, const std::string& text, Value& value) {
  const std::array<double, 3> given = parse_three(text, setting.given_range());
  if (setting.zero != 0.0 && settings::all_zero(given)) throw UsageError(in_quotes(text) + " must not be black");
  const bool complement = setting.spelling == settings::Spelling::complement;
  for (std::size_t i = 0; i < 3; ++i)
    value[i] = static_cast<std::remove_extent_t<Value>>(complement ? 1.0 - given[i] : given[i]);
}

/// Parses x, y, width and height.
template <class Desc, class Value>
void parse_rectangle(const settings::Setting<Desc, Value>& setting, const std::string& text, Value& value) {
  const std::vector<double> given = parse_numbers(text, 4);
  for (const double number : given)
    if (!setting.given_range().holds(number))
      throw UsageError(in_quotes(text) + " has a number that " + setting.given_range().refusal());
  std::ranges::transform(given, value, [](double number) { return static_cast<std::remove_extent_t<Value>>(number); });
}

template <class Desc, class Value>
void add_setting(CLI::App& app, const char* group, const settings::Setting<Desc, Value>& setting, Value& value,
                 const TakeWord& take_word) {
  const auto add_parsed = [&](auto parse) {
    const auto parse_or_take = [flag = setting.flag, parse, take_word](const std::string& text) {
      if (!take_word || !take_word(flag, text)) parse(text);
    };
    add(app, group, setting.flag, setting.type, parse_or_take, setting.help);
  };
  if constexpr (settings::Enumerated<Value>) {
    add_choice(app, group, setting.flag, setting.choices, value, setting.help);
  } else if constexpr (settings::Switch<Value>) {
    if (*setting.type != '\0') {
      add_choice(app, group, setting.flag, std::array{Name{"on", 1}, Name{"off", 0}}, value, setting.help);
    } else {
      app.add_flag_function(
             setting.flag, [&value](std::int64_t count) { value = count > 0 ? 1 : 0; }, setting.help)
          ->group(group);
    }
  } else if constexpr (settings::Count<Value>) {
    add_parsed([&value, setting](const std::string& text) { value = parse_count(setting, text); });
  } else if constexpr (settings::Real<Value>) {
    add_parsed([&value, setting](const std::string& text) { value = parse_real(setting, text); });
  } else if constexpr (settings::Rectangle<Value>) {
    add_parsed([&value, setting](const std::string& text) { parse_rectangle(setting, text, value); });
  } else {
    add_parsed([&value, setting](const std::string& text) { parse_triple(setting, text, value); });
  }
}

/// Adds the flags of a descriptor's settings.
template <class Desc>
void add_settings(CLI::App& app, const char* group, Desc& desc, const TakeWord& take_word = {}) {
  settings::for_each<Desc>([&](const auto& setting) {
    if (*setting.flag != '\0') add_setting(app, group, setting, desc.*setting.field, take_word);
  });
}

void parse_size(std::string_view text, SceneOptions& scene) {
  const std::vector<std::string_view> sides = split(text, 'x');
  if (sides.size() != 2) throw UsageError(in_quotes(text) + " is not WIDTHxHEIGHT, such as 1280x720");
  scene.width = static_cast<std::uint32_t>(parse_integer(sides[0], 1, 16384));
  scene.height = static_cast<std::uint32_t>(parse_integer(sides[1], 1, 16384));
}

/// Sets eye, target and field of view; keeps the lens.
void parse_camera(std::string_view text, cumulet_camera_desc& camera) {
  const std::vector<std::string_view> parts = words(text);
  if (parts.size() != 3) throw UsageError(in_quotes(text) + " is not \"ex,ey,ez tx,ty,tz fovy\"");
  const std::vector<double> eye = parse_numbers(parts[0], 3);
  const std::vector<double> target = parse_numbers(parts[1], 3);
  if (eye == target) throw UsageError("the eye and the target are the same point");
  const double fovy = parse_number(parts[2]);
  if (!(fovy > 0.0 && fovy < 180.0))
    throw UsageError(in_quotes(parts[2]) + " is not an angle between 0 and 180 degrees");
  const cumulet_camera_desc before = camera;
  camera = {};
  camera.struct_size = sizeof camera;
  camera.lens_radius = before.lens_radius;
  camera.focus_distance = before.focus_distance;
  std::copy(eye.begin(), eye.end(), camera.eye);
  std::copy(target.begin(), target.end(), camera.target);
  camera.fovy_degrees = fovy;
}

void parse_sun(std::string_view text, cumulet_sun_sky_desc& light) {
  const std::vector<std::string_view> parts = words(text);
  if (parts.empty() || parts.size() > 2) throw UsageError(in_quotes(text) + " is not \"azimuth,elevation r,g,b\"");
  const std::vector<double> angles = parse_numbers(parts[0], 2);
  if (std::abs(angles[0]) > 360.0) throw UsageError("the azimuth is not from -360 to 360 degrees");
  if (std::abs(angles[1]) > 90.0) throw UsageError("the elevation is not from -90 to 90 degrees");
  if (parts.size() == 2) parse_light(parts[1], light.sun_irradiance);
  light.sun_azimuth_degrees = static_cast<float>(angles[0]);
  light.sun_elevation_degrees = static_cast<float>(angles[1]);
}

void parse_sky_model(std::string_view text, cumulet_sun_sky_desc& light) {
  const std::vector<double> numbers = parse_numbers(text, 2);
  const auto take = [&](float cumulet_sun_sky_desc::*field, double number) {
    settings::with(field, [&](const auto& setting) {
      if (!setting.given_range().holds(number))
        throw UsageError(std::string(setting.row.label) + " " + setting.given_range().refusal());
    });
    light.*field = static_cast<float>(number);
  };
  take(&cumulet_sun_sky_desc::turbidity, numbers[0]);
  take(&cumulet_sun_sky_desc::ground_albedo, numbers[1]);
  light.sky = CUMULET_SKY_PHYSICAL;
}

settings::RampPoints parse_ramp(std::string_view text) {
  settings::RampPoints points;
  if (text == "none") return points;
  for (const std::string_view point : split(text, ',')) {
    const std::vector<std::string_view> pair = split(point, ':');
    if (pair.size() != 2) throw UsageError(in_quotes(point) + " is not a pair INPUT:OUTPUT, such as 0.5:1");
    points.push_back({static_cast<float>(parse_number(pair[0])), static_cast<float>(parse_number(pair[1]))});
  }
  const std::string why = settings::ramp_refusal(points);
  if (!why.empty()) throw UsageError(in_quotes(text) + " " + why);
  return points;
}

std::vector<std::string> parse_light_groups(std::string_view text) {
  std::vector<std::string> names;
  if (text == "none") return names;
  for (const std::string_view name : split(text, ',')) names.emplace_back(name);
  if (const std::string why = light_groups_refusal(names); !why.empty()) throw UsageError(in_quotes(text) + " " + why);
  return names;
}

/// Sets one field of a light by its scene file key. Returns false if there is no such key.
bool take_analytic_light_key(cumulet_light_desc& analytic_light, std::string_view key, const std::string& text) {
  bool known = false;
  settings::for_each<cumulet_light_desc>([&](const auto& setting) {
    auto& value = analytic_light.*setting.field;
    using Value = std::remove_reference_t<decltype(value)>;
    if (key != setting.key) return;
    if constexpr (settings::Real<Value>) {
      value = parse_real(setting, text);
      known = true;
    } else if constexpr (settings::Count<Value>) {
      value = parse_count(setting, text);
      known = true;
    } else if constexpr (settings::Triple<Value>) {
      parse_triple(setting, text, value);
      known = true;
    }
  });
  return known;
}

/// Parses a light such as "point position=0,1,2 power=100": a kind, then keys and values as in scene files.
cumulet_light_desc parse_analytic_light(const CLI::App& app, std::string_view text) {
  const std::vector<std::string_view> parts = words(text);
  cumulet_light_desc analytic_light{};
  analytic_light.struct_size = sizeof analytic_light;
  const std::string_view kind = parts.empty() ? std::string_view{} : parts.front();
  const auto* const named = find_choice(app, "--light", settings::analytic_light_choices, kind);
  if (named == nullptr)
    throw UsageError(in_quotes(kind) + " is not one of " + list_names(settings::analytic_light_choices, ", "));
  analytic_light.kind = static_cast<cumulet_light_kind>(named->value);
  std::set<std::string_view> given;
  for (std::size_t i = 1; i < parts.size(); ++i) {
    const std::size_t equals = parts[i].find('=');
    if (equals == std::string_view::npos)
      throw UsageError(in_quotes(parts[i]) + " is not KEY=VALUE, such as power=100");
    std::string_view key = parts[i].substr(0, equals);
    if (key == "across") {
      key = "tangent";
      report_renamed(app, "--light across", "--light tangent");
    }
    const std::string value(parts[i].substr(equals + 1));
    if (!given.insert(key).second) throw UsageError(std::string(key) + " is given twice");
    bool known = false;
    try {
      known = take_analytic_light_key(analytic_light, key, value);
    } catch (const UsageError& error) {
      throw UsageError(std::string(key) + ": " + error.what());
    }
    if (!known) throw UsageError("lights have no setting " + in_quotes(key));
  }
  if (const auto refusal = settings::analytic_light_refusal(analytic_light))
    throw UsageError(std::string(refusal->name) + " " + refusal->cause);
  return analytic_light;
}

/// Adds --light: analytic lights in addition to those of a scene file. "none" removes the lights given before it.
void add_analytic_lights(CLI::App& app, const char* group, std::vector<cumulet_light_desc>& analytic_lights) {
  const auto take = [&app, &analytic_lights](const std::vector<std::string>& texts) {
    try {
      for (const std::string& text : texts) {
        if (text == "none")
          analytic_lights.clear();
        else
          analytic_lights.push_back(parse_analytic_light(app, text));
      }
      if (const std::string why = settings::analytic_light_count_refusal(analytic_lights.size()); !why.empty())
        throw UsageError(why);
    } catch (const UsageError& error) {
      throw CLI::ValidationError("--light", error.what());
    }
  };
  app.add_option_function<std::vector<std::string>>(
         "--light", take,
         "Add a light: point, spot, disk, rect or distant, such as \"disk position=0,30,10 power=20000 width=4\"; can "
         "be repeated. Keys as in scene files: position, direction, tangent, color, power (watts; for a distant light "
         "W/m2), width, height, angle_degrees, blend, group. Lights are added to those of the scene; none removes all "
         "lights so far")
      ->type_name("\"KIND KEY=VALUE ...\"|none")
      ->group(group)
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
}

/// CLI11 takes "-.5" for a flag. Joined to the preceding flag with "=", it is a value.
std::vector<std::string> glue_negative_fractions(std::vector<std::string> arguments) {
  std::vector<std::string> glued;
  for (std::string& argument : arguments) {
    const bool fraction =
        argument.size() > 2 && argument[0] == '-' && argument[1] == '.' && argument[2] >= '0' && argument[2] <= '9';
    const bool after_flag = !glued.empty() && glued.back().rfind("--", 0) == 0 && glued.back().size() > 2 &&
                            glued.back().find('=') == std::string::npos;
    if (fraction && after_flag)
      glued.back() += "=" + argument;
    else
      glued.push_back(std::move(argument));
  }
  return glued;
}

/// Returns the file name extension in lower case, without the dot.
std::string ending_of(const std::string& path) {
  const auto dot = path.find_last_of("./");
  std::string ending = dot == std::string::npos || path[dot] != '.' ? "" : path.substr(dot + 1);
  for (char& c : ending)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return ending;
}

OutputFormat format_of(const std::string& path) {
  const std::string ending = ending_of(path);
  if (ending == "png") return OutputFormat::png;
  if (ending == "exr") return OutputFormat::exr;
  if (ending == "pfm") return OutputFormat::pfm;
  throw UsageError(in_quotes(path) + " does not end in .png, .exr or .pfm");
}

/// Formats help for a terminal of 100 columns, with line breaks between words.
class HelpFormatter final : public CLI::Formatter {
 public:
  HelpFormatter() { column_width(44); }

  std::string make_option(const CLI::Option* option, bool positional) const override {
    std::string text = "  " + make_option_name(option, positional) + make_option_opts(option);
    const std::size_t indent = get_column_width();
    // A flag that is too long for its column gets a line of its own.
    const std::size_t used = text.size();
    if (used >= indent) text += '\n';
    text.append(used < indent ? indent - used : indent, ' ');
    return text + wrapped(make_option_desc(option), indent) + "\n";
  }

  std::string make_description(const CLI::App* app) const override {
    return wrapped(CLI::Formatter::make_description(app), 0) + "\n";
  }

 private:
  static std::string wrapped(std::string_view description, std::size_t indent) {
    std::string text;
    std::size_t column = indent;
    for (const std::string_view line : split(description, '\n')) {
      for (const std::string_view word : words(line)) {
        if (column > indent && column + 1 + word.size() > help_columns) {
          text += '\n';
          text.append(indent, ' ');
          column = indent;
        }
        if (column > indent) text += ' ';
        column += word.size() + (column > indent ? 1 : 0);
        text += word;
      }
    }
    return text;
  }
};

}  // namespace

double parse_number(std::string_view text) {
  double value = 0.0;
  const std::string_view digits = text.substr(text.size() > 1 && text[0] == '+' && text[1] != '-' ? 1 : 0);
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (error != std::errc{} || end != digits.data() + digits.size() || !std::isfinite(value))
    throw UsageError(in_quotes(text) + " is not a finite number");
  return value;
}

std::vector<double> parse_numbers(std::string_view text, std::size_t count) {
  const std::vector<std::string_view> parts = split(text, ',');
  if (parts.size() != count)
    throw UsageError(in_quotes(text) + " is not " + std::to_string(count) + " numbers separated by commas");
  std::vector<double> values;
  values.reserve(parts.size());
  for (const std::string_view part : parts) values.push_back(parse_number(part));
  return values;
}

std::uint64_t parse_integer(std::string_view text, std::uint64_t least, std::uint64_t most) {
  std::uint64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  const bool number = end == text.data() + text.size() && !text.empty();
  if (!number || error == std::errc::invalid_argument) throw UsageError(in_quotes(text) + " is not a whole number");
  if (error != std::errc{} || value < least || value > most)
    throw UsageError(in_quotes(text) + " is not from " + std::to_string(least) + " to " + std::to_string(most));
  return value;
}

void add_scene_options(CLI::App& app, SceneOptions& scene) {
  const char* group = "Scene";
  // This flag must be added first: flags take effect in the order of addition, and all others override the file.
  add(
      app, group, "--scene", "FILE.json", [&](const std::string& text) { scene = load_scene(text); },
      "Scene file, for example saved by cumulet-demo; other flags override its settings");
  add(
      app, group, "--scene-camera", "NAME",
      [&](const std::string& text) {
        try {
          look_through(scene, text);
        } catch (const std::runtime_error& error) {
          throw UsageError(error.what());
        }
      },
      "Use this camera of the scene");
  add(
      app, group, "--volume", "FILE",
      [&](const std::string& text) {
        if (text.empty()) throw UsageError("the file's name is empty");
        scene.volume = text;
      },
      "OpenVDB or NanoVDB file (.vdb, .nvdb), or a sequence such as name.####.vdb");
  add(
      app, group, "--grid-name", "NAME", [&](const std::string& text) { scene.grid_name = text; },
      "Density grid (default: density, else the most likely grid)");
  add(
      app, group, "--temperature-grid", "NAME", [&](const std::string& text) { scene.temperature_grid = text; },
      "Temperature grid; none: not used (default: found by name)");
  add(
      app, group, "--flame-grid", "NAME", [&](const std::string& text) { scene.flame_grid = text; },
      "Flame grid; none: not used (default: found by name)");
  add(
      app, group, "--color-grid", "NAME", [&](const std::string& text) { scene.color_grid = text; },
      "Color grid; none: not used (default: found by name)");
  add(
      app, group, "--anisotropy-grid", "NAME", [&](const std::string& text) { scene.anisotropy_grid = text; },
      "Anisotropy grid, replaces --anisotropy; none: not used (default: found by name)");
  add(
      app, group, "--velocity-grid", "NAME", [&](const std::string& text) { scene.velocity_grid = text; },
      "Velocity grid, for --aovs velocity and --shutter; none: not used (default: found by name)");
  add_choice(app, group, "--up", up_names, scene.up,
             "Up axis of the volume (default: y; use z for Blender and Mantaflow)");
  add(
      app, group, "--gltf", "FILE",
      [&](const std::string& text) {
        if (text.empty()) throw UsageError("the file's name is empty");
        scene.surfaces = text;
      },
      "Surfaces: a glTF 2.0 file (.gltf, .glb)");
  add(
      app, group, "--gltf-variant", "NAME|N", [&](const std::string& text) { scene.surface_variant = text; },
      "Material variant, by name or index from 0 (default: none); --info lists them");
  add(
      app, group, "--gltf-camera", "N",
      [&](const std::string& text) {
        scene.surface_camera = static_cast<std::int32_t>(parse_integer(text, 0, 1000000));
      },
      "Use this camera of the glTF file, by index from 0");
  add_settings(app, group, scene.surface);
  add(
      app, group, "--camera", "\"ex,ey,ez tx,ty,tz fovy\"",
      [&](const std::string& text) {
        parse_camera(text, scene.camera);
        end_shutter(scene);
      },
      "Eye, target and vertical field of view in degrees (default: fit the scene)");
  add_settings(app, group, scene.camera);

  const auto take_auto = [&scene](std::string_view flag, const std::string& text) {
    if (flag != "--density-scale") return false;
    scene.auto_density_scale = text == "auto";
    if (scene.auto_density_scale) scene.medium.density_scale = 0.0;
    return scene.auto_density_scale;
  };
  add(
      app, "Medium", "--preset", list_names(preset_choices, "|"),
      [&](const std::string& text) {
        const auto* found = std::find_if(preset_choices.begin(), preset_choices.end(),
                                         [&](const settings::Choice& choice) { return text == choice.name; });
        if (found == preset_choices.end())
          throw UsageError(in_quotes(text) + " is not one of " + list_names(preset_choices, ", "));
        apply(static_cast<Preset>(found->value), scene.medium);
      },
      "Medium preset; does not set the density scale; other flags override its settings");
  add_settings(app, "Medium", scene.medium, take_auto);
  for (std::size_t i = 0; i < scene.ramps.size(); ++i) {
    add(
        app, "Medium", settings::ramps[i].flag, "X:Y,X:Y,...|none",
        [&points = scene.ramps[i]](const std::string& text) { points = parse_ramp(text); }, settings::ramps[i].help);
  }

  group = "Light (default: a clear day; if sun, sky, environment or lights are given, the others are off)";
  add(
      app, group, "--sun", "\"azimuth,elevation r,g,b\"",
      [&](const std::string& text) { parse_sun(text, scene.light); },
      "Sun: azimuth from +Z towards +X and elevation in degrees; irradiance, which can be omitted with --sky-model");
  add_settings(app, group, scene.light);
  add(
      app, group, "--env", "FILE",
      [&](const std::string& text) {
        if (text.empty()) throw UsageError("the file's name is empty");
        scene.set_environment(text);
      },
      "Environment map (HDRI) instead of the sky: an equirectangular .hdr or .exr image, or an .exr cube map; +Y is "
      "up, the center is +Z");
  add_settings(app, group, scene.environment_settings);
  add(
      app, group, "--sky-model", "\"turbidity,ground_albedo\"",
      [&](const std::string& text) { parse_sky_model(text, scene.light); },
      "Physical sun and sky: turbidity from 1 (no aerosols) to 10, 3 is clear; and ground albedo from 0 to 1");
  add_analytic_lights(app, group, scene.analytic_lights);
  add_settings(app, group, scene.ground);
  add_settings(app, "Grid", scene.grid);

  group = "Picture";
  add(
      app, group, "--size", "WxH", [&](const std::string& text) { parse_size(text, scene); },
      "Image size in pixels (default: 1280x720)");
  add_settings(app, group, scene.sampling);
  add(
      app, group, "--light-groups", "NAME,...|none",
      [&](const std::string& text) { scene.light_groups = parse_light_groups(text); },
      "Names of up to 8 light groups, starting with group 0. Each is written as a layer Combined_NAME of an .exr; "
      "their sum is the image. Lights of unnamed groups are added to group 0 (default: none)");
  const auto choose_color = [&scene](std::string_view flag, const std::string&) {
    if (flag == "--background-color") scene.display.background = CUMULET_BACKGROUND_COLOR;
    return false;
  };
  add_settings(app, group, scene.display, choose_color);
}

namespace {

enum class FileKind { volume, surfaces, scene };

/// Detects the kind of a file by its extension, else by its content.
FileKind kind_of(const std::string& path) {
  const std::string ending = ending_of(path);
  if (ending == "vdb" || ending == "nvdb") return FileKind::volume;
  if (ending == "gltf" || ending == "glb") return FileKind::surfaces;
  if (ending == "json") return FileKind::scene;
  std::string head(4096, '\0');
  std::ifstream file(path, std::ios::binary);
  file.read(head.data(), static_cast<std::streamsize>(head.size()));
  head.resize(static_cast<std::size_t>(file.gcount()));
  if (head.rfind("NanoVDB", 0) == 0 || head.rfind(" BDV", 0) == 0) return FileKind::volume;
  if (head.rfind("glTF", 0) == 0) return FileKind::surfaces;
  if (head.find("\"cumulet_scene\"") != std::string::npos) return FileKind::scene;
  if (head.find("\"asset\"") != std::string::npos) return FileKind::surfaces;
  throw UsageError(in_quotes(path) + " is not a volume (.vdb, .nvdb), glTF file (.gltf, .glb) or scene (.json)");
}

/// Adds the files without a flag: at most one of each kind. The scene is loaded first.
void add_files(CLI::App& app, SceneOptions& scene, bool& lit) {
  const auto take = [&scene, &lit](const std::vector<std::string>& files) {
    try {
      std::array<std::string, 3> of_kind;
      for (const std::string& file : files) {
        std::string& file_of_kind = of_kind[static_cast<std::size_t>(kind_of(file))];
        if (!file_of_kind.empty())
          throw UsageError(in_quotes(file_of_kind) + " and " + in_quotes(file) +
                           " are files of the same kind; only one is allowed");
        file_of_kind = file;
      }
      const auto& [volume, surfaces, scene_file] = of_kind;
      lit = !scene_file.empty();
      if (lit) scene = load_scene(scene_file);
      if (!volume.empty()) scene.volume = volume;
      if (!surfaces.empty()) scene.surfaces = surfaces;
    } catch (const UsageError& error) {
      throw CLI::ValidationError("FILE", error.what());
    }
  };
  app.add_option_function<std::vector<std::string>>(
         "files", take, "Volume (.vdb, .nvdb), surfaces (.gltf, .glb) or scene (.json); at most one of each")
      ->type_name("FILE");
}

}  // namespace

void finish_scene_options(const CLI::App& app, SceneOptions& scene, const NamedFiles& files) {
  for (const char* flag : {"--env-rotation", "--env-strength"}) {
    if (app.count(flag) > 0 && scene.environment.empty())
      throw UsageError(std::string(flag) + " needs an environment: --env, or a --scene that names one");
  }
  for (const char* flag : {"--gltf-time", "--gltf-animation", "--gltf-variant", "--gltf-camera"}) {
    if (app.count(flag) > 0 && scene.surfaces.empty())
      throw UsageError(std::string(flag) + " needs a model: --gltf, or a --scene that names one");
  }
  for (const char* flag : {"--sky", "--env"}) {
    if (app.count(flag) > 0 && app.count("--sky-model") > 0)
      throw UsageError(std::string(flag) + " and --sky-model exclude each other");
  }
  if (app.count("--criterion") > 0) {
    if (app.count("--threshold") == 0) scene.grid.threshold = 0.0;  // the scene's is for its own criterion
    settings::name_criterion(scene.grid);
  }
  if (app.count("--sky") > 0) scene.light.sky = CUMULET_SKY_CONSTANT;
  if (app.count("--sun") > 0 && scene.light.sky == CUMULET_SKY_CONSTANT) {
    const std::string sun = app.get_option("--sun")->results().back();
    if (words(sun).size() == 1) throw UsageError("--sun: " + in_quotes(sun) + " needs an irradiance, or --sky-model");
  }
  const bool analytic_lights_alone = !scene.analytic_lights.empty() && app.count("--sky-model") == 0;
  if (!files.scene && app.count("--scene") == 0 && app.count("--sun") == 0 && app.count("--sky") == 0 &&
      app.count("--env") == 0 && !analytic_lights_alone) {
    const cumulet_sun_sky_desc given = scene.light;
    scene.set_daylight();
    if (app.count("--sky-model") > 0) {
      scene.light.turbidity = given.turbidity;
      scene.light.ground_albedo = given.ground_albedo;
    } else if (app.count("--ground") == 0 && scene.surfaces.empty() && !files.model) {
      scene.ground.mode = CUMULET_GROUND_BELOW;
    }
  }
  if (app.count("--ground-height") > 0 && app.count("--ground") == 0) scene.ground.mode = CUMULET_GROUND_AT_HEIGHT;
  if (app.count("--ground-height") > 0 && scene.ground.mode != CUMULET_GROUND_AT_HEIGHT)
    throw UsageError("--ground-height needs --ground at-height");
}

bool parse_arguments(CLI::App& app, std::vector<std::string> arguments, std::ostream& out) {
  const std::string version = app.get_name() + " " + version_text();
  app.set_help_flag("-h,--help", "Show this help and exit");
  app.set_version_flag("--version", version, "Show the version and exit");
  app.formatter(std::make_shared<HelpFormatter>());
  if (arguments == std::vector<std::string>{"--option-table"}) {
    out << option_table(app);
    return false;
  }
  replace_old_flags(app, arguments);
  try {
    std::vector<std::string> reversed = glue_negative_fractions(std::move(arguments));
    std::reverse(reversed.begin(), reversed.end());  // CLI11 expects them in reverse order
    app.parse(std::move(reversed));
  } catch (const CLI::CallForHelp&) {
    out << app.help();
    return false;
  } catch (const CLI::CallForVersion&) {
    out << version << '\n';
    return false;
  } catch (const CLI::ParseError& error) {
    throw UsageError(one_line(error.what()));
  }
  return true;
}

namespace {

// Samples per pixel of an image that stops at a noise target or time limit.
constexpr std::uint32_t max_samples = 65536;

// Checks that an image with --first-sample can be merged with others.
void check_part(const RenderOptions& options, bool part) {
  if (!part) return;
  if (options.format != OutputFormat::exr) throw UsageError("--first-sample needs an .exr output");
  if (options.scene.sampling.view != CUMULET_VIEW_SHADED) throw UsageError("--first-sample needs the shaded view");
  if (options.denoise != Denoise::off) throw UsageError("--first-sample cannot be combined with --denoise");
  if (options.time_limit || options.scene.sampling.noise_target_percent > 0.0f)
    throw UsageError("--first-sample cannot be combined with --time-limit or --noise-target");
  const auto last = std::uint64_t{options.scene.sampling.first_sample} + options.scene.sampling.samples;
  if (last > std::uint64_t{1} << 32U) throw UsageError("--first-sample: the last sample number exceeds 4294967295");
}

// Checks combinations of flags. part: --first-sample is given.
void check_together(const RenderOptions& options, bool part) {
  if (is_empty(options.scene)) throw UsageError("a file is required: --volume or --gltf, or a --scene that names one");
  if (options.json && !options.info) throw UsageError("--json needs --info");
  if (options.info) return;
  if (options.output.empty()) throw UsageError("--output is required");
  if (options.has_layers() && options.format != OutputFormat::exr) throw UsageError("--aovs needs an .exr output");
  if (options.has_layers() && options.scene.sampling.view != CUMULET_VIEW_SHADED)
    throw UsageError("--aovs needs the shaded view");
  if (options.denoise != Denoise::off && options.scene.sampling.view != CUMULET_VIEW_SHADED)
    throw UsageError("--denoise needs the shaded view");
  if (options.denoise != Denoise::off && options.scene.surface.lighting == CUMULET_SURFACE_LIGHTING_RASTERIZED)
    throw UsageError("--denoise cannot be combined with --surface-lighting rasterized");
  check_part(options, part);
  if (!options.checkpoint.empty() && options.scene.sampling.view != CUMULET_VIEW_SHADED)
    throw UsageError("--checkpoint needs the shaded view");
  for (const auto& [flag, file] :
       {std::pair("--output", options.output), {"--stats", options.stats}, {"--trace", options.trace}}) {
    if (same_file(options.checkpoint, file))
      throw UsageError("--checkpoint and " + std::string(flag) + " are the same file");
  }
  for (const auto& [flag, file] : {std::pair("--output", options.output),
                                   {"--stats", options.stats},
                                   {"--trace", options.trace},
                                   {"--checkpoint", options.checkpoint}}) {
    if (same_file(options.sequence_cache, file))
      throw UsageError("--sequence-cache and " + std::string(flag) + " are the same file");
  }
  if (same_file(options.stats, options.output)) throw UsageError("--stats and --output are the same file");
  if (same_file(options.trace, options.output)) throw UsageError("--trace and --output are the same file");
  if (same_file(options.trace, options.stats)) throw UsageError("--trace and --stats are the same file");
}

}  // namespace

bool same_file(const std::string& a, const std::string& b) {
  if (a.empty() || b.empty()) return false;
  std::error_code of_a;
  std::error_code of_b;
  const auto path_a = std::filesystem::weakly_canonical(a, of_a);
  const auto path_b = std::filesystem::weakly_canonical(b, of_b);
  return of_a || of_b ? a == b : path_a == path_b;
}

std::optional<RenderOptions> parse_render_options(std::vector<std::string> arguments, std::ostream& out) {
  RenderOptions options;
  CLI::App app("Path-traces a volume to an image file, without a display.", "cumulet-render");
  app.footer(
      "Exit status: 0 success; 1 failure, with one line on standard error; 2 wrong usage.\n"
      "Ctrl-C writes the samples so far and exits with 1; a second Ctrl-C stops at once.\n"
      "For a sequence, one line per frame is printed: frame 12 (3 of 20) done|kept|failed FILE...\n"
      "Frames that cannot be read fail, and the others are rendered; the exit status is then 1.\n"
      "Ctrl-C does not write the current frame of a sequence.");
  // Added before the flags, which override the scene.
  bool lit = false;
  add_files(app, options.scene, lit);
  add_scene_options(app, options.scene);

  const char* group = "Output";
  add(
      app, group, "-o,--output", "FILE",
      [&](const std::string& text) {
        options.format = format_of(text);
        options.output = text;
      },
      "Output file. .png is exposed and tone-mapped; .exr and .pfm contain linear radiance. For a sequence: "
      "name.####.exr");
  add(
      app, group, "--frames", "A-BxS,...", [&](const std::string& text) { options.frames = parse_frames(text); },
      "Frames of the sequence, such as 5, 1-100, 1-100x2, -2-2, 1-3,7 or 1-10x0.5 (fractional frames are interpolated; "
      "default: the frame of the scene, else all existing files). The volume's name is a pattern with ####, %04d, $F4 "
      "or <frame04>, or a file of the sequence");
  add_settings(app, group, options.scene.sequence.playback);
  app.add_flag("--overwrite", options.overwrite, "Re-render frames whose output exists (default: skip them)")
      ->group(group);
  add(
      app, group, "--sequence-cache", "FILE",
      [&](const std::string& text) {
        if (text.empty()) throw UsageError("the file's name is empty");
        options.sequence_cache = text;
      },
      "Cache values shared by all frames (density scale, camera, ground height) in this file, so that later runs need "
      "not read the reference frame; it is read again if its size or modification time has changed");
  app.add_flag("--info", options.info, "Describe the contents of the files; render nothing")->group(group);
  app.add_flag("--json", options.json, "Write --info as JSON")->group(group);
  add(
      app, group, "--aovs", "NAME,...|all",
      [&](const std::string& text) {
        options.aovs.clear();
        options.cryptomatte = false;
        for (const std::string_view part : split(text, ',')) {
          const bool mattes = part == "all" || part == cryptomatte_name;
          options.cryptomatte = options.cryptomatte || mattes;
          for (const auto& [name, aov] : aov_names) {
            const bool meant = part == "all" || part == name;
            if (meant && std::ranges::find(options.aovs, aov) == options.aovs.end()) options.aovs.push_back(aov);
          }
          const bool known = std::ranges::any_of(aov_names, [&](const auto& n) { return part == n.name; });
          if (!known && !mattes)
            throw UsageError(in_quotes(part) + " is not one of all, " + list_names(aov_names, ", ") + ", " +
                             cryptomatte_name);
        }
      },
      "Additional layers (AOVs) of an .exr: volume, transmittance, depth, volume_depth, normal, albedo, error, "
      "velocity, backward and volume_backward (motion vectors), cryptomatte");
  add(
      app, group, "--stats", "FILE.json",
      [&](const std::string& text) {
        if (text.empty()) throw UsageError("the file's name is empty");
        options.stats = text;
      },
      "Write statistics and timings in SI units");
  add(
      app, group, "--trace", "FILE.json",
      [&](const std::string& text) {
        if (text.empty()) throw UsageError("the file's name is empty");
        options.trace = text;
      },
      "Write a trace of frames, passes and worker jobs for chrome://tracing and Perfetto");
  add(
      app, group, "--time-limit", "SECONDS",
      [&](const std::string& text) {
        const double seconds = parse_number(text);
        if (!(seconds > 0.0)) throw UsageError(text + " is not above 0");
        options.time_limit = seconds;
      },
      "Stop after this time (loading does not count), but not before each pixel has a sample");
  add(
      app, group, "--gpu-memory", "MIB",
      [&](const std::string& text) {
        constexpr unsigned mebibyte = 20;
        options.gpu_memory = parse_integer(text, 1, std::uint64_t{1} << 40U) << mebibyte;
      },
      "GPU memory limit in MiB; grids are coarsened to fit (default: no limit)");
  add(
      app, group, "--first-sample", "N",
      [&](const std::string& text) {
        options.scene.sampling.first_sample =
            static_cast<std::uint32_t>(parse_integer(text, 0, std::numeric_limits<std::uint32_t>::max()));
      },
      "Render only the samples N to N + SPP - 1 of each pixel, counted from 0; cumulet-merge joins the .exr files");
  add(
      app, group, "--checkpoint", "FILE",
      [&](const std::string& text) {
        if (text.empty()) throw UsageError("the file's name is empty");
        options.checkpoint = text;
      },
      "Save the accumulated samples to FILE periodically and on interruption; the same command resumes from it and "
      "deletes it when the image is written. For a sequence: name.####");
  add(
      app, group, "--checkpoint-every", "SECONDS",
      [&](const std::string& text) {
        options.checkpoint_every = parse_number(text);
        if (!(options.checkpoint_every > 0.0)) throw UsageError(text + " is not above 0");
      },
      "Seconds between checkpoints (default: 300)");
  // The scene's own setting is for interactive windows.
  app.remove_option(app.get_option("--denoise"));
  add_choice(app, group, "--denoise",
             std::array{Name{"off", Denoise::off}, Name{"fast", Denoise::fast}, Name{"high", Denoise::high}},
             options.denoise,
             "Denoise: fast (filter) or high (Open Image Denoise network; fast if there is no network). An .exr gets "
             "an additional layer `denoised` (default: off)");
  add(
      app, group, "--oidn-weights", "DIR",
      [&](const std::string& text) {
        if (text.empty()) throw UsageError("the folder's name is empty");
        options.denoiser = text;
      },
      "Folder of the Open Image Denoise networks (default: $CUMULET_OIDN_WEIGHTS, else cumulet/oidn below "
      "$XDG_DATA_HOME)");
  add(
      app, group, "--shader-cache", "DIR",
      [&](const std::string& text) {
        if (text.empty()) throw UsageError("the folder's name is empty");
        options.shader_cache = text;
      },
      "Cache compiled shaders in this folder");
  add_choice(app, group, "--backend",
             std::array{Name{"auto", BackendChoice::automatic}, Name{"egl", BackendChoice::egl},
                        Name{"osmesa", BackendChoice::osmesa}},
             options.backend,
             "How to create the OpenGL context without a display (default: auto, which tries EGL, then OSMesa)");

  if (!parse_arguments(app, std::move(arguments), out)) return std::nullopt;
  finish_scene_options(app, options.scene, {.scene = lit});
  // Otherwise the default number of samples would end the image before the noise target or the time limit.
  const bool stops = options.time_limit || options.scene.sampling.noise_target_percent > 0.0f;
  const bool asked = app.count("--noise-target") + app.count("--time-limit") > 0;
  if (stops && asked && app.count("--spp") == 0) options.scene.sampling.samples = max_samples;
  if (app.count("--light-groups") > 0 && !options.scene.light_groups.empty() && options.format != OutputFormat::exr)
    throw UsageError("--light-groups needs an .exr output");
  check_together(options, app.count("--first-sample") > 0);
  // Like every scene setting, it changes the scene hash in the file.
  options.scene.display.denoise = options.denoise == Denoise::off ? CUMULET_DENOISE_OFF : CUMULET_DENOISE_FAST;
  return options;
}

}  // namespace cumulet::demo
