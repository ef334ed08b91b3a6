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

#include "option_values.hpp"

namespace CLI {
class App;
}

namespace cumulet::demo {

/// Adds the flags that fill the scene, including --scene. The other flags override the values of that file. The light
/// stays black if no flag sets it: see finish_scene_options. The scene must outlive the app's parse(), which throws the
/// exceptions of load_scene.
void add_scene_options(CLI::App& app, SceneOptions& scene);
/// Adds --ocio and the flags that choose its view.
void add_ocio_options(CLI::App& app, const char* group, OcioView& view);
/// Completes the view after the parse: another tone map or LUT replaces that of a scene file. Throws UsageError for
/// flags that exclude each other or lack --ocio.
void finish_ocio_options(const CLI::App& app, OcioView& view);
/// Kinds of files that were named without a flag.
struct NamedFiles {
  bool scene = false;  ///< a scene file, which sets the light
  bool model = false;
};
/// Completes the scene after the parse: sets daylight unless a flag or file sets the light, and checks flags that
/// exclude each other. Throws UsageError.
void finish_scene_options(const CLI::App& app, SceneOptions& scene, const NamedFiles& files);

/// Parses the arguments. For --help, --version and --option-table (option_table.hpp) it writes the text to `out` and
/// returns false. Flags of earlier versions are accepted and reported (old_flags.hpp). Throws UsageError.
[[nodiscard]] bool parse_arguments(CLI::App& app, std::vector<std::string> arguments, std::ostream& out);

enum class OutputFormat { png, exr, pfm };
enum class Denoise { off, fast, high };
enum class BackendChoice { automatic, egl, osmesa };

/// Settings that are given and have no default value then.
struct Given {
  bool exposure = false;  // by a flag, a scene file, or a view that has its own
  bool time = false;      // --gltf-time, for all frames of a sequence
  bool up = false;        // --up
};

struct RenderOptions {
  SceneOptions scene;
  BackendChoice backend = BackendChoice::automatic;
  std::string output;  // not empty unless `info` is set
  OutputFormat format = OutputFormat::png;
  std::string stats;           // empty: none
  std::string trace;           // empty: none
  std::string shader_cache;    // a folder; empty: none
  std::string shaders;         // a folder; empty: the library's
  std::vector<Moment> frames;  // of the sequence; empty: the frame of the scene, else all
  bool overwrite = false;      // re-render frames whose output exists
  std::string
      sequence_cache;  // sequence cache: file with the settings shared by all frames; empty: derive them in each run
  bool info = false;   // print the content of the files, render nothing
  bool json = false;   // print `info` as JSON
  std::string checkpoint;                  // empty: none
  double checkpoint_every = 300.0;         // seconds
  std::optional<double> time_limit;        // seconds from the first sample
  std::optional<double> whole_seconds;     // of a thumbnail, from the start; replaces time_limit
  std::uint64_t gpu_memory = 0;            // bytes; 0: no limit
  Denoise denoise = Denoise::off;          // for .exr, the denoised image is an additional layer
  bool denoises_by_default = false;        // --denoise is not given
  std::string denoiser;                    // folder of networks; empty: denoiser_folder()
  std::string oidn_library;                // file or "off"; empty: find_denoiser()
  std::vector<cumulet_aov> aovs;           // additional layers of an .exr
  bool cryptomatte = false;                // additional layers of an .exr
  std::optional<std::uint32_t> thumbnail;  // pixels per side
  std::string lut;                         // a .cube file; empty: none
  cumulet_lut_shaper lut_shaper = CUMULET_LUT_SHAPER_SRGB;
  Given given;
  bool default_look = true;  // no flag sets light, exposure or tone map
  bool default_up = true;    // the metadata of the volume names its up axis

  [[nodiscard]] bool has_layers() const { return !aovs.empty() || cryptomatte; }
};

/// Returns true if both names refer to the same file, existing or not, even if they are spelled differently. Empty
/// names refer to none.
[[nodiscard]] bool same_file(const std::string& a, const std::string& b);

/// Parses the arguments of cumulet-render, without the program's name. Returns nullopt for --help and --version, whose
/// text is written to `out`. Throws UsageError.
[[nodiscard]] std::optional<RenderOptions> parse_render_options(std::vector<std::string> arguments, std::ostream& out);

}  // namespace cumulet::demo
