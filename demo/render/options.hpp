#pragma once

#include <cstdint>
#include <frames.hpp>
#include <iosfwd>
#include <optional>
#include <program.hpp>
#include <scene_file.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace CLI {
class App;
}

namespace cumulet::demo {

/// Adds the flags that fill the scene, --scene among them: the values of that file are what the other flags override.
/// Light stays dark if none is given: see finish_scene_options. The scene must outlive the app's parse, which throws
/// what load_scene does.
void add_scene_options(CLI::App& app, SceneOptions& scene);
/// Of files that are named without a flag: what the scene does not tell yet.
struct NamedFiles {
  bool scene = false;  ///< whose light holds
  bool model = false;
};
/// What can be said only after the parse: a clear day by default, unless a file has light; and which flags exclude each
/// other. Throws UsageError.
void finish_scene_options(const CLI::App& app, SceneOptions& scene, const NamedFiles& files);

/// Parses, with --help and --version (and --option-table: option_table.hpp), for which it gives false after their text
/// went to out. Throws UsageError.
[[nodiscard]] bool parse_arguments(CLI::App& app, std::vector<std::string> arguments, std::ostream& out);

enum class OutputFormat { png, exr, pfm };
enum class Denoise { off, fast, high };
enum class BackendChoice { automatic, egl, osmesa };

struct RenderOptions {
  SceneOptions scene;
  BackendChoice backend = BackendChoice::automatic;
  std::string output;  // not empty, unless info
  OutputFormat format = OutputFormat::png;
  std::string stats;                 // empty: none
  std::string trace;                 // likewise
  std::string shader_cache;          // a folder; empty: none
  std::vector<Moment> frames;        // of the volume's sequence; empty: all, where its name is a sequence's
  bool overwrite = false;            // frames that are there already
  std::string settled;               // what frames have in common; empty: found in each run
  bool info = false;                 // tell what is in the files, render nothing
  bool json = false;                 // as JSON
  std::string checkpoint;            // empty: none
  double checkpoint_every = 300.0;   // seconds
  std::optional<double> time_limit;  // seconds from the first sample on
  std::uint64_t gpu_memory = 0;      // bytes; 0: no limit
  Denoise denoise = Denoise::off;    // the picture; of an .exr a layer beside it
  std::string denoiser;              // a folder of networks; empty: where the script puts them
  std::vector<cumulet_aov> aovs;     // layers of an .exr beside the picture
  bool cryptomatte = false;          // likewise

  [[nodiscard]] bool has_layers() const { return !aovs.empty() || cryptomatte; }
};

/// Whether both names are of one file, there or not, however they are written; none is of none.
[[nodiscard]] bool same_file(const std::string& a, const std::string& b);

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
