#pragma once

#include <iosfwd>
#include <optional>
#include <options.hpp>
#include <string>
#include <vector>

#include "viewer_setup.hpp"

namespace cumulet::demo {

struct DemoOptions {
  SceneOptions scene;
  bool unchosen_ground = false;  // the scene's ground is the default
  bool exposure_given = false;   // by --exposure or --scene
  bool sized = false;            // --size was given; else the window has the size of the last run
  std::string scene_file;        // of --scene; empty: none
  std::string open;              // file without a flag: a volume, surfaces, an environment or a scene
  double ui_scale = 0.0;         // 0: content scale of the screen
  std::string replay;
  std::string record;
  std::string trace;  // empty: none
  ViewerSetup viewer;
};

/// Parses the arguments of cumulet-demo, without the program's name. Returns nullopt for --help and --version, whose
/// text is written to `out`. Throws UsageError and the exceptions of load_scene.
[[nodiscard]] std::optional<DemoOptions> parse_demo_options(std::vector<std::string> arguments, std::ostream& out);

}  // namespace cumulet::demo
