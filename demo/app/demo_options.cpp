#include "demo_options.hpp"

#include <CLI/CLI.hpp>
#include <ostream>
#include <utility>

#include "model.hpp"

namespace cumulet::demo {

std::optional<DemoOptions> parse_demo_options(std::vector<std::string> arguments, std::ostream& out) {
  DemoOptions options;
  options.scene.sampling.samples = default_samples;
  CLI::App app("Interactive viewer for path-traced volumes.", "cumulet-demo");
  app.footer(
      "In this program --size is the size of the window, --volume is optional, and --spp defaults to 256.\n"
      "Preferences are stored in $XDG_CONFIG_HOME/cumulet/demo.json, or below ~/.config.\n"
      "Copies of unsaved changes are stored in $XDG_STATE_HOME/cumulet, or below ~/.local/state.\n"
      "Exit status: 0 success; 1 failure, with one line on standard error; 2 wrong usage.");
  app.add_option(
         "file", options.open,
         "Volume (.vdb, .nvdb, .nrrd, .nhdr, .vti, .raw, .tif), surfaces (.gltf, .glb), environment (.hdr, .exr) or "
         "scene (.json)")
      ->type_name("FILE");
  add_scene_options(app, options.scene);

  const char* group = "Window";
  const auto scale = [&options](const std::string& text) {
    constexpr double least = 0.5;
    constexpr double most = 4.0;
    try {
      options.ui_scale = parse_number(text);
    } catch (const UsageError& error) {
      throw CLI::ValidationError("--ui-scale", error.what());
    }
    if (options.ui_scale < least || options.ui_scale > most)
      throw CLI::ValidationError("--ui-scale", "'" + text + "' is not from 0.5 to 4");
  };
  app.add_option_function<std::string>("--ui-scale", scale, "Scale of the user interface (default: that of the screen)")
      ->type_name("FACTOR")
      ->group(group);
  app.add_option("--replay", options.replay, "Play recorded events and quit; see docs/replay.md")
      ->type_name("FILE")
      ->group(group);
  app.add_option("--record", options.record, "Record the session for --replay")->type_name("FILE")->group(group);
  app.add_option("--trace", options.trace,
                 "Write a trace of frames, passes and worker jobs for chrome://tracing and Perfetto")
      ->type_name("FILE.json")
      ->group(group);
  const auto add_folder = [&](const char* name, std::string& folder, const char* help) {
    const auto set = [name, &folder](const std::string& text) {
      if (text.empty()) throw CLI::ValidationError(name, "the folder's name is empty");
      folder = text;
    };
    app.add_option_function<std::string>(name, set, help)->type_name("DIR")->group(group);
  };
  add_folder("--shader-cache", options.viewer.shader_cache, "Cache compiled shaders in this folder");
  add_folder("--shaders", options.viewer.shaders,
             "Load shaders from this folder (a copy of glsl/) and reload them when they change");
  add_ocio_options(app, group, options.scene.ocio);

  if (!parse_arguments(app, std::move(arguments), out)) return std::nullopt;
  finish_ocio_options(app, options.scene.ocio);
  finish_scene_options(app, options.scene, {.model = is_model(options.open)});
  options.unchosen_ground = app.count("--ground") + app.count("--ground-height") + app.count("--scene") == 0;
  options.exposure_given = app.count("--exposure") + app.count("--scene") > 0;
  if (app.count("--scene") > 0) options.scene_file = app.get_option("--scene")->as<std::string>();
  options.sized = app.count("--size") > 0;
  if (!options.open.empty() && (!options.scene.volume.empty() || app.count("--scene") > 0))
    throw UsageError("'" + options.open + "' cannot be combined with --volume or --scene");
  return options;
}

}  // namespace cumulet::demo
