#include "options.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <analytic_light_limits.hpp>
#include <aov_table.hpp>
#include <array>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <memory>
#include <names.hpp>
#include <ostream>
#include <presets.hpp>
#include <set>
#include <settings.hpp>
#include <type_traits>
#include <utility>

#include "add_options.hpp"
#include "old_flags.hpp"
#include "option_table.hpp"
#include "option_values.hpp"

namespace cumulet::demo {
namespace {

constexpr std::size_t help_columns = 100;

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

constexpr std::uint64_t min_thumbnail = 16;
constexpr std::uint64_t max_thumbnail = 1024;

OutputFormat format_of(const std::string& path) {
  const std::string ending = ending_of(path);
  if (ending == "png") return OutputFormat::png;
  if (ending == "exr") return OutputFormat::exr;
  if (ending == "pfm") return OutputFormat::pfm;
  throw UsageError("--output: " + in_quotes(path) + " does not end in .png, .exr or .pfm");
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

void add_volume_options(CLI::App& app, const char* group, SceneOptions& scene) {
  add_path(app, group, "--volume", "FILE", scene.volume,
           "OpenVDB or NanoVDB file (.vdb, .nvdb), or dense array (.nrrd, .nhdr, .vti, .raw, .tif), or a folder of "
           ".tif slices, or a sequence such as name.####.vdb");
  add_text(app, group, "--grid-name", "NAME", scene.grid_name,
           "Density grid (default: density, else the most likely grid)");
  add_text(app, group, "--temperature-grid", "NAME", scene.temperature_grid,
           "Temperature grid; none: not used (default: found by name)");
  add_text(app, group, "--flame-grid", "NAME", scene.flame_grid, "Flame grid; none: not used (default: found by name)");
  add_text(app, group, "--color-grid", "NAME", scene.color_grid, "Color grid; none: not used (default: found by name)");
  add_text(app, group, "--anisotropy-grid", "NAME", scene.anisotropy_grid,
           "Anisotropy grid, replaces --anisotropy; none: not used (default: found by name)");
  add_text(app, group, "--velocity-grid", "NAME", scene.velocity_grid,
           "Velocity grid, for --aovs velocity and --shutter; none: not used (default: found by name)");
  add_choice(app, group, "--up", up_names, scene.up,
             "Up axis of the volume (default: y; cumulet-render uses z if the metadata of the file names Blender or "
             "Mantaflow, but not with --camera or a scene file)");
  add(
      app, group, "--clip-box", "X0,Y0,Z0,X1,Y1,Z1|none",
      [&scene](const std::string& text) { scene.clip.box = parse_clip_box(text); },
      "Show only the part of the volume in this box: its lowest and its highest corner, in the volume's world units "
      "before its transforms, as --info prints its bounds (default: none)");
  add(
      app, group, "--clip-planes", "\"A,B,C,D ...\"|none",
      [&scene](const std::string& text) { scene.clip.planes = parse_clip_planes(text); },
      "Show only the part of the volume where a x + b y + c z + d >= 0, for up to 6 planes, in the same units "
      "(default: none)");
}

void add_surface_options(CLI::App& app, const char* group, SceneOptions& scene) {
  add_path(app, group, "--gltf", "FILE", scene.surfaces, "Surfaces: a glTF 2.0 file (.gltf, .glb)");
  add_text(app, group, "--gltf-variant", "NAME|N", scene.surface_variant,
           "Material variant, by name or index from 0 (default: none); --info lists them");
  add(
      app, group, "--gltf-camera", "N",
      [&](const std::string& text) {
        scene.surface_camera = static_cast<std::int32_t>(parse_integer(text, 0, 1000000));
      },
      "Use this camera of the glTF file, by index from 0");
  add_settings(app, group, scene.surface);
}

void add_medium_options(CLI::App& app, const char* group, SceneOptions& scene) {
  const auto take_auto = [&scene](std::string_view flag, const std::string& text) {
    if (flag != "--density-scale") return false;
    scene.auto_density_scale = text == "auto";
    if (scene.auto_density_scale) scene.medium.density_scale = 0.0;
    return scene.auto_density_scale;
  };
  add(
      app, group, "--preset", list_names(preset_choices, "|"),
      [&](const std::string& text) {
        const auto* found = std::find_if(preset_choices.begin(), preset_choices.end(),
                                         [&](const settings::Choice& choice) { return text == choice.name; });
        if (found == preset_choices.end())
          throw UsageError(in_quotes(text) + " is not one of " + list_names(preset_choices, ", "));
        apply(static_cast<Preset>(found->value), scene.medium);
      },
      "Medium preset; does not set the density scale; other flags override its settings");
  const auto take_special = [take_auto, &scene](std::string_view flag, const std::string& text) {
    if (flag == "--albedo") scene.albedo_given = true;
    return take_auto(flag, text);
  };
  add_settings(app, group, scene.medium, take_special);
  for (std::size_t i = 0; i < scene.ramps.size(); ++i) {
    add(
        app, group, settings::ramps[i].flag, "X:Y,X:Y,...|none",
        [&points = scene.ramps[i]](const std::string& text) { points = parse_ramp(text); }, settings::ramps[i].help);
    const settings::ColorRampInfo& info = settings::color_ramps[i];
    add(
        app, group, info.flag, "X:COLOR,X:COLOR,...|none",
        [&info, &stops = scene.color_ramps[i]](const std::string& text) { stops = parse_color_ramp(info, text); },
        info.help);
  }
}

void add_light_options(CLI::App& app, SceneOptions& scene) {
  const char* group = "Light (default: a clear day; if sun, sky, environment or lights are given, the others are off)";
  add(
      app, group, "--sun", "\"azimuth,elevation r,g,b\"",
      [&](const std::string& text) { parse_sun(text, scene.light); },
      "Sun: azimuth from +Z towards +X and elevation in degrees; irradiance, which can be omitted with --sky-model");
  add_settings(app, group, scene.light);
  add_path(
      app, group, "--env", "FILE", [&](const std::string& text) { scene.set_environment(text); },
      "Environment map (HDRI) instead of the sky: an equirectangular .hdr or .exr image, or an .exr cube map; +Y is "
      "up, the center is +Z");
  add_settings(app, group, scene.environment_settings);
  add(
      app, group, "--sky-model", "\"turbidity,ground_albedo\"",
      [&](const std::string& text) { parse_sky_model(text, scene.light); },
      "Physical sun and sky: turbidity from 1 (no aerosols) to 10, 3 is clear; and ground albedo from 0 to 1");
  add_analytic_lights(app, group, scene.analytic_lights);
  add_settings(app, group, scene.ground);
}

void add_picture_options(CLI::App& app, SceneOptions& scene) {
  const char* group = "Picture";
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

}  // namespace

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
  add_volume_options(app, group, scene);
  add_surface_options(app, group, scene);
  add(
      app, group, "--camera", "\"ex,ey,ez tx,ty,tz fovy\"",
      [&](const std::string& text) {
        parse_camera(text, scene.camera);
        end_shutter(scene);
      },
      "Eye, target and vertical field of view in degrees (default: fit the scene)");
  add_settings(app, group, scene.camera);
  add_medium_options(app, "Medium", scene);
  add_light_options(app, scene);
  add_settings(app, "Grid", scene.grid);
  add_picture_options(app, scene);
}

namespace {

enum class FileKind { volume, surfaces, scene };

/// Detects the kind of a file by its extension, else by its content.
FileKind kind_of(const std::string& path) {
  const std::string ending = ending_of(path);
  constexpr std::array<std::string_view, 8> volumes = {"vdb", "nvdb", "nrrd", "nhdr", "vti", "raw", "tif", "tiff"};
  if (std::ranges::find(volumes, ending) != volumes.end()) return FileKind::volume;
  std::error_code error;
  if (std::filesystem::is_directory(path, error)) return FileKind::volume;  // of slices
  if (ending == "gltf" || ending == "glb") return FileKind::surfaces;
  if (ending == "json") return FileKind::scene;
  std::string head(4096, '\0');
  std::ifstream file(path, std::ios::binary);
  file.read(head.data(), static_cast<std::streamsize>(head.size()));
  head.resize(static_cast<std::size_t>(file.gcount()));
  for (const char* magic : {"NanoVDB", " BDV", "NRRD0"}) {
    if (head.rfind(magic, 0) == 0) return FileKind::volume;
  }
  if (head.rfind("glTF", 0) == 0) return FileKind::surfaces;
  if (head.find("\"cumulet_scene\"") != std::string::npos) return FileKind::scene;
  if (head.find("\"asset\"") != std::string::npos) return FileKind::surfaces;
  throw UsageError(in_quotes(path) +
                   " is not a volume (.vdb, .nvdb, .nrrd, .nhdr, .vti, .raw, .tif), glTF file (.gltf, .glb) or scene "
                   "(.json)");
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
  app.add_option_function<std::vector<std::string>>("files", take,
                                                    "Volume (.vdb, .nvdb, .nrrd, .nhdr, .vti, .raw, .tif), surfaces "
                                                    "(.gltf, .glb) or scene (.json); at most one of each")
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
  const bool with_scene = files.scene || app.count("--scene") > 0;
  if (!with_scene && app.count("--sun") == 0 && app.count("--sky") == 0 && app.count("--env") == 0 &&
      !analytic_lights_alone) {
    const cumulet_sun_sky_desc given = scene.light;
    scene.set_daylight();
    if (app.count("--sky-model") > 0) {
      scene.light.turbidity = given.turbidity;
      scene.light.ground_albedo = given.ground_albedo;
    } else if (app.count("--ground") == 0) {
      // A model that is cut out for compositing needs none.
      const bool cut_out = scene.display.background != CUMULET_BACKGROUND_SKY;
      const bool has_model = !scene.surfaces.empty() || files.model;
      if (!has_model || !cut_out) scene.ground.mode = CUMULET_GROUND_BELOW;
    }
  }
  // The environment shows its own ground.
  if (!with_scene && !scene.environment.empty() && app.count("--ground") == 0 &&
      scene.display.background == CUMULET_BACKGROUND_SKY)
    scene.ground.mode = CUMULET_GROUND_SHADOW_CATCHER_BELOW;
  if (app.count("--ground-height") > 0 && app.count("--ground") == 0) scene.ground.mode = at_height(scene.ground.mode);
  if (app.count("--ground-height") > 0 && !is_at_height(scene.ground.mode))
    throw UsageError("--ground-height needs --ground at-height or --ground shadow-catcher-at-height");
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

namespace {

/// Parses the names of AOVs, separated by commas. They replace those given before.
void parse_aovs(std::string_view text, RenderOptions& options) {
  options.aovs.clear();
  options.cryptomatte = false;
  for (const std::string_view part : split(text, ',')) {
    const bool mattes = part == "all" || part == cryptomatte_name;
    options.cryptomatte = options.cryptomatte || mattes;
    for (const settings::Aov& aov : settings::named_aovs) {
      const bool meant = part == "all" || part == aov.name;
      if (meant && std::ranges::find(options.aovs, aov.value) == options.aovs.end()) options.aovs.push_back(aov.value);
    }
    const bool known =
        std::ranges::find(settings::named_aovs, part, &settings::Aov::name) != settings::named_aovs.end();
    if (!known && !mattes)
      throw UsageError(in_quotes(part) + " is not one of all, " + list_names(settings::named_aovs, ", ") + ", " +
                       cryptomatte_name);
  }
}

void add_sequence_options(CLI::App& app, const char* group, RenderOptions& options) {
  add(
      app, group, "--frames", "A-BxS,...", [&](const std::string& text) { options.frames = parse_frames(text); },
      "Frames of the sequence, such as 5, 1-100, 1-100x2, -2-2, 1-3,7 or 1-10x0.5 (fractional frames are interpolated; "
      "default: the frame of the scene, else all existing files). The volume's name is a pattern with ####, %04d, $F4 "
      "or <frame04>, or a file of the sequence");
  add_settings(app, group, options.scene.sequence.playback);
  app.add_flag("--overwrite", options.overwrite, "Re-render frames whose output exists (default: skip them)")
      ->group(group);
  add_path(
      app, group, "--sequence-cache", "FILE", options.sequence_cache,
      "Cache values shared by all frames (density scale, camera, ground height) in this file, so that later runs need "
      "not read the reference frame; it is read again if its size or modification time has changed");
}

void add_report_options(CLI::App& app, const char* group, RenderOptions& options) {
  app.add_flag("--info", options.info, "Describe the contents of the files; render nothing")->group(group);
  app.add_flag("--json", options.json, "Write --info as JSON")->group(group);
  add(
      app, group, "--aovs", "NAME,...|all", [&](const std::string& text) { parse_aovs(text, options); },
      "Additional layers (AOVs) of an .exr: " + list_names(settings::named_aovs, ", ") +
          ", cryptomatte; backward and volume_backward are motion vectors");
  add_path(app, group, "--stats", "FILE.json", options.stats, "Write statistics and timings in SI units");
  add_path(app, group, "--trace", "FILE.json", options.trace,
           "Write a trace of frames, passes and worker jobs for chrome://tracing and Perfetto");
}

void add_sample_options(CLI::App& app, const char* group, RenderOptions& options) {
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
  add_path(
      app, group, "--checkpoint", "FILE", options.checkpoint,
      "Save the accumulated samples to FILE periodically and on interruption; the same command resumes from it and "
      "deletes it when the image is written. For a sequence: name.####");
  add(
      app, group, "--checkpoint-every", "SECONDS",
      [&](const std::string& text) {
        options.checkpoint_every = parse_number(text);
        if (!(options.checkpoint_every > 0.0)) throw UsageError(text + " is not above 0");
      },
      "Seconds between checkpoints (default: 300)");
}

void add_device_options(CLI::App& app, const char* group, RenderOptions& options) {
  // The scene's own setting is for interactive windows.
  app.remove_option(app.get_option("--denoise"));
  add_choice(app, group, "--denoise",
             std::array{Name{"off", Denoise::off}, Name{"fast", Denoise::fast}, Name{"high", Denoise::high}},
             options.denoise,
             "Denoise: fast (filter) or high (Open Image Denoise network; fast if there is no network). An .exr gets "
             "an additional layer `denoised` (default: fast for .png, or as in the scene file; off for other files)");
  add_path(app, group, "--oidn-weights", "DIR", options.denoiser,
           "Folder of the Open Image Denoise networks (default: $CUMULET_OIDN_WEIGHTS, else cumulet/oidn below "
           "$XDG_DATA_HOME)");
  add_path(
      app, group, "--oidn-library", "FILE|off", options.oidn_library,
      "Library of Open Image Denoise, which does --denoise high where OpenGL runs on the CPU and needs no networks "
      "(default: $CUMULET_OIDN_LIBRARY, else libOpenImageDenoise.so.2 if it is installed)");
  add_path(app, group, "--lut", "FILE", options.lut,
           "3D LUT (.cube, at most 65^3 points) that replaces the tone map of .png files (default: none)");
  add_choice(app, group, "--lut-input",
             std::array{Name{"srgb", CUMULET_LUT_SHAPER_SRGB}, Name{"log2", CUMULET_LUT_SHAPER_LOG2},
                        Name{"linear", CUMULET_LUT_SHAPER_LINEAR}},
             options.lut_shaper,
             "Values that the LUT maps: the sRGB curve, log2 or the value itself of exposed radiance (default: srgb)");
  add_ocio_options(app, group, options.scene.ocio);
  add_path(app, group, "--shader-cache", "DIR", options.shader_cache, "Cache compiled shaders in this folder");
  add_path(app, group, "--shaders", "DIR", options.shaders,
           "Load shaders from this folder (a copy of glsl/), to compare variants without a build (default: built in)");
  add_choice(app, group, "--backend",
             std::array{Name{"auto", BackendChoice::automatic}, Name{"egl", BackendChoice::egl},
                        Name{"osmesa", BackendChoice::osmesa}},
             options.backend,
             "How to create the OpenGL context without a display (default: auto, which tries EGL, then OSMesa)");
}

// Flags that set light, exposure or tone map.
constexpr std::array look_flags = {"--sun",      "--sun-angle", "--sky",   "--sky-model", "--env",
                                   "--exposure", "--tone-map",  "--light", "--lut",       "--ocio"};

/// Returns the denoising of an image for which --denoise is not given. has_scene: a scene file sets it.
Denoise default_denoise(const RenderOptions& options, bool has_scene) {
  const SceneOptions& scene = options.scene;
  const bool possible = options.format == OutputFormat::png && scene.sampling.view == CUMULET_VIEW_SHADED &&
                        scene.surface.lighting != CUMULET_SURFACE_LIGHTING_RASTERIZED;
  const bool wanted = !has_scene || scene.display.denoise != CUMULET_DENOISE_OFF;
  return possible && wanted ? Denoise::fast : Denoise::off;
}

/// Returns the default folder of compiled shaders: cumulet/shaders below $XDG_CACHE_HOME, else below ~/.cache; "" if
/// neither is set.
std::string thumbnail_shader_cache() {
  const auto below = [](const char* variable, const std::string& folder) {
    const char* value = std::getenv(variable);
    // By the XDG specification, relative paths are ignored.
    return value != nullptr && *value == '/' ? value + folder : std::string();
  };
  const std::string cache = below("XDG_CACHE_HOME", "/cumulet/shaders");
  return cache.empty() ? below("HOME", "/.cache/cumulet/shaders") : cache;
}

/// Sets the options of a thumbnail of options.thumbnail pixels, except those that flags of the app set. Throws
/// UsageError for flags that exclude it.
void make_thumbnail(const CLI::App& app, RenderOptions& options) {
  const auto given = [&app](const char* flag) { return app.count(flag) > 0; };
  for (const char* flag : {"--size", "--info", "--checkpoint", "--frames", "--aovs", "--first-sample"}) {
    if (given(flag)) throw UsageError("--thumbnail cannot be combined with " + std::string(flag));
  }
  constexpr std::uint32_t samples = 16;
  constexpr double seconds = 1.5;
  constexpr double whole_seconds = 2.6;
  constexpr std::uint64_t max_cells = 200'000;
  SceneOptions& scene = options.scene;
  scene.width = scene.height = *options.thumbnail;
  options.format = OutputFormat::png;
  if (!given("--spp")) scene.sampling.samples = samples;
  if (!given("--time-limit")) options.time_limit = seconds, options.whole_seconds = whole_seconds;
  if (!given("--denoise")) options.denoise = Denoise::fast;
  if (!given("--max-cells")) scene.grid.max_cells = max_cells;
  if (!given("--shader-cache")) options.shader_cache = thumbnail_shader_cache();
}

}  // namespace

void add_ocio_options(CLI::App& app, const char* group, OcioView& view) {
  // A configuration replaces the view of a scene file too.
  add(
      app, group, "--ocio", "FILE|none",
      [&](const std::string& text) {
        if (text.empty()) throw UsageError("the file's name is empty");
        view = {};
        if (text != "none") view.config = text;
      },
      "OpenColorIO configuration; its view replaces the tone map (default: none, or as in the scene file)");
  add_text(app, group, "--ocio-display", "NAME", view.display,
           "Display of --ocio (default: that of the configuration)");
  add_text(app, group, "--ocio-view", "NAME", view.view, "View of --ocio (default: that of the display)");
  add_text(app, group, "--ocio-input", "NAME", view.input,
           "Color space of --ocio that is linear Rec. 709 (default: found by its name or by the role "
           "aces_interchange, and printed)");
}

void finish_ocio_options(const CLI::App& app, OcioView& view) {
  if (app.count("--tone-map") > 0 && app.count("--ocio") == 0) view = {};
  if (!view.config.empty()) return;
  for (const auto& [flag, name] : {std::pair{"--ocio-display", &view.display}, std::pair{"--ocio-view", &view.view},
                                   std::pair{"--ocio-input", &view.input}})
    if (!name->empty()) throw UsageError(std::string(flag) + " needs --ocio");
}

std::optional<RenderOptions> parse_render_options(std::vector<std::string> arguments, std::ostream& out) {
  RenderOptions options;
  CLI::App app("Path-traces a volume to an image file, without a display.", "cumulet-render");
  app.footer(
      "Exit status: 0 success; 1 failure, with one line on standard error; 2 wrong usage.\n"
      "Ctrl-C writes the samples so far and exits with 1; a second Ctrl-C stops at once.\n"
      "Without --stats, --trace and --checkpoint, a .png is first written after 10 s, and then improves.\n"
      "For a sequence, one line per frame is printed: frame 12 (3 of 20) done|kept|failed FILE...\n"
      "With --gltf-time, animations of models stay at one time. Else they follow the clock of the sequence.\n"
      "Frames that cannot be read fail, and the others are rendered; the exit status is then 1.\n"
      "Ctrl-C does not write the current frame of a sequence.");
  // Added before the flags, which override the scene.
  bool lit = false;
  add_files(app, options.scene, lit);
  add_scene_options(app, options.scene);

  const char* group = "Output";
  add(
      app, group, "-o,--output", "FILE", [&](const std::string& text) { options.output = text; },
      "Output file. .png is exposed and tone-mapped; .exr and .pfm contain linear radiance. For a sequence: "
      "name.####.exr");
  add(
      app, group, "--thumbnail", "PIXELS",
      [&](const std::string& text) {
        options.thumbnail = static_cast<std::uint32_t>(parse_integer(text, min_thumbnail, max_thumbnail));
      },
      "Write a thumbnail for a file manager: a square PNG of 16 to 1024 pixels per side, whatever the file's name, "
      "with few samples and denoised");
  add_sequence_options(app, group, options);
  add_report_options(app, group, options);
  add_sample_options(app, group, options);
  add_device_options(app, group, options);

  if (!parse_arguments(app, std::move(arguments), out)) return std::nullopt;
  finish_scene_options(app, options.scene, {.scene = lit});
  if (options.thumbnail) {
    make_thumbnail(app, options);
  } else if (!options.output.empty() || app.count("--output") > 0) {
    options.format = format_of(options.output);
  }
  // Otherwise the default number of samples would end the image before the noise target or the time limit.
  const bool stops = options.time_limit || options.scene.sampling.noise_target_percent > 0.0f;
  const bool asked = app.count("--noise-target") + app.count("--time-limit") > 0;
  if (stops && asked && app.count("--spp") == 0) options.scene.sampling.samples = max_samples;
  if (app.count("--light-groups") > 0 && !options.scene.light_groups.empty() && options.format != OutputFormat::exr)
    throw UsageError("--light-groups needs an .exr output");
  const bool part = app.count("--first-sample") > 0;
  if (!options.lut.empty() && options.format != OutputFormat::png) throw UsageError("--lut needs a .png output");
  OcioView& ocio = options.scene.ocio;
  finish_ocio_options(app, ocio);
  const bool asks_ocio = app.count("--ocio") > 0 && !ocio.config.empty();
  if (asks_ocio && options.format != OutputFormat::png) throw UsageError("--ocio needs a .png output");
  if (asks_ocio && !options.lut.empty()) throw UsageError("--ocio and --lut exclude each other");
  if (!options.lut.empty()) ocio = {};
  if (options.lut.empty() && app.count("--lut-input") > 0) throw UsageError("--lut-input needs --lut");
  options.denoises_by_default = app.count("--denoise") == 0;
  options.given.up = app.count("--up") > 0;
  // A given camera is made for the file's own axes.
  options.default_up = !options.given.up && app.count("--camera") + app.count("--scene") == 0 && !lit;
  options.default_look = std::ranges::all_of(look_flags, [&](const char* flag) { return app.count(flag) == 0; });
  options.given.time = app.count("--gltf-time") > 0;
  options.given.exposure =
      lit || app.count("--scene") + app.count("--exposure") > 0 || !options.lut.empty() || !ocio.config.empty();
  if (options.denoises_by_default && !part) options.denoise = default_denoise(options, lit || app.count("--scene") > 0);
  check_together(options, part);
  // Like every scene setting, it changes the scene hash in the file.
  options.scene.display.denoise = options.denoise == Denoise::off ? CUMULET_DENOISE_OFF : CUMULET_DENOISE_FAST;
  return options;
}

}  // namespace cumulet::demo
