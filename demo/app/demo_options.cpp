#include "demo_options.hpp"

#include <CLI/CLI.hpp>
#include <ostream>
#include <utility>

#include "model.hpp"

namespace cumulet::demo {

std::optional<DemoOptions> parse_demo_options(std::vector<std::string> arguments, std::ostream& out) {
  DemoOptions options;
  // More samples than for a file, because the image is viewed while it refines.
  options.scene.sampling.samples = 256;
  CLI::App app("Shows volumes in a window: path-traced, as they are turned and changed.", "cumulet-demo");
  app.footer(
      "Here --size is the window's, --volume may be left out, and --spp is 256 unless said.\n"
      "Settings are kept in $XDG_CONFIG_HOME/cumulet/demo.json, or below ~/.config.\n"
      "Exit status: 0 done; 1 failed, one line on standard error says why; 2 wrong usage.");
  app.add_option("file", options.open,
                 "A volume (.vdb, .nvdb), surfaces (.gltf, .glb), an environment (.hdr, .exr) or a scene (.json)")
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
  app.add_option_function<std::string>("--ui-scale", scale, "Size of the controls (default: as the screen asks)")
      ->type_name("FACTOR")
      ->group(group);
  app.add_option("--replay", options.replay, "Play recorded events, then quit: see docs/replay.md")
      ->type_name("FILE")
      ->group(group);
  app.add_option("--record", options.record, "Record what is done, for --replay")->type_name("FILE")->group(group);
  app.add_option("--trace", options.trace,
                 "Write when frames, their passes and jobs ran, for chrome://tracing and Perfetto")
      ->type_name("FILE.json")
      ->group(group);
  const auto add_folder = [&](const char* name, std::string& folder, const char* help) {
    const auto set = [name, &folder](const std::string& text) {
      if (text.empty()) throw CLI::ValidationError(name, "the folder's name is empty");
      folder = text;
    };
    app.add_option_function<std::string>(name, set, help)->type_name("DIR")->group(group);
  };
  add_folder("--shader-cache", options.shader_cache,
             "Keep what the driver made of shaders in this folder, for the next run");
  add_folder("--shaders", options.shaders,
             "Take the shaders of this folder (a copy of glsl/), anew as they change: in debug builds");

  if (!parse_arguments(app, std::move(arguments), out)) return std::nullopt;
  finish_scene_options(app, options.scene, {.model = is_model(options.open)});
  options.unchosen_ground = app.count("--ground") + app.count("--ground-height") + app.count("--scene") == 0;
  options.sized = app.count("--size") > 0;
  if (!options.open.empty() && (!options.scene.volume.empty() || app.count("--scene") > 0))
    throw UsageError("'" + options.open + "' is given as well as --volume or --scene");
  return options;
}

}  // namespace cumulet::demo
