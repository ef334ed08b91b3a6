#pragma once

#include <cumulet/cumulet.h>

#include <iosfwd>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace CLI {
class App;
}

namespace cumulet::demo {

/// The command line is wrong; what() is one line. Programs print it and exit 2.
class UsageError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// What every demo program can show, as the library's own descriptors with struct_size set. Zero is the library's
/// default, as there.
struct SceneOptions {
  std::string volume;
  std::string grid_name;
  cumulet_grid_desc grid{};
  cumulet_medium_desc medium{};
  cumulet_light_desc light{};
  cumulet_camera_desc camera{};
  cumulet_image_desc image{};

  SceneOptions();
  /// A pleasant day: what is lit when neither --sun nor --sky is given.
  void set_daylight();
};

/// Adds the flags that fill the scene. Light stays dark if none is given: see finish_scene_options.
/// The scene must outlive the app's parse.
void add_scene_options(CLI::App& app, SceneOptions& scene);
/// What can be said only after the parse: default daylight. Throws UsageError.
void finish_scene_options(const CLI::App& app, SceneOptions& scene);

enum class OutputFormat { png, exr, pfm };
enum class BackendChoice { automatic, egl, osmesa };

struct RenderOptions {
  SceneOptions scene;
  BackendChoice backend = BackendChoice::automatic;
  double exposure_stops = 0.0;
  std::string output;
  OutputFormat format = OutputFormat::png;
  std::string stats;  // empty: none
};

/// cumulet-render's arguments, without the program's name. Nothing if they asked for --help or --version, whose text
/// goes to out. Throws UsageError.
[[nodiscard]] std::optional<RenderOptions> parse_render_options(std::vector<std::string> arguments, std::ostream& out);

// The pieces, for programs with more flags; each throws UsageError. Numbers are read the same in every locale.

/// A finite number and nothing else.
[[nodiscard]] double parse_number(std::string_view text);
/// Exactly count numbers between commas.
[[nodiscard]] std::vector<double> parse_numbers(std::string_view text, std::size_t count);
/// An integer from least to most.
[[nodiscard]] std::uint64_t parse_integer(std::string_view text, std::uint64_t least, std::uint64_t most);

}  // namespace cumulet::demo
