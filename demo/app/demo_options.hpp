#pragma once

#include <iosfwd>
#include <optional>
#include <options.hpp>
#include <string>
#include <vector>

namespace cumulet::demo {

struct DemoOptions {
  SceneOptions scene;
  bool unchosen_ground = false;  // a ground that the scene has is the default one
  bool sized = false;            // --size was given: the window takes it, else the last run's size
  std::string open;              // the file named without a flag: a volume or a scene
  double ui_scale = 0.0;         // 0: as the screen asks
  std::string replay;
  std::string record;
  std::string trace;         // empty: none
  std::string shader_cache;  // likewise: a folder
  std::string shaders;       // likewise
};

/// cumulet-demo's arguments, without the program's name. Nothing if they asked for --help or --version, whose text
/// goes to out. Throws UsageError, and what load_scene throws.
[[nodiscard]] std::optional<DemoOptions> parse_demo_options(std::vector<std::string> arguments, std::ostream& out);

}  // namespace cumulet::demo
