#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <headless.hpp>
#include <string>
#include <vector>

#include "options.hpp"
#include "support/c_host.hpp"

namespace cumulet::bench {

/// A scene for evaluating images: cloud, full (the cloud at its full setting), fire, explosion, model (in the cloud),
/// terrain, fog (in the Cornell box), lamp (in smoke).
struct JudgedScene {
  std::string name;
  std::filesystem::path volume;    ///< a file; empty: none, or generated
  std::filesystem::path surfaces;  ///< a file; empty: none, or generated
};

/// The names of all scenes.
const std::vector<std::string>& judged_names();

/// The requested scenes whose files exist. skipped: receives a line for each other one.
std::vector<JudgedScene> judged_scenes(const Options& options, std::vector<std::string>& skipped);

/// A scene in its own viewer, using only the public API. The context must be current until the destruction. Throws
/// std::runtime_error.
class Stage {
 public:
  /// programs: if null, the viewer uses its own.
  Stage(headless::Context& context, const JudgedScene& scene, std::uint32_t size,
        cumulet_shader_cache* programs = nullptr);

  [[nodiscard]] cumulet_viewer* viewer() { return viewer_.get(); }
  /// Restarts sampling, unless only the number of samples grows.
  void sample(std::uint32_t samples, std::uint32_t seed, cumulet_preview preview = CUMULET_PREVIEW_OFF);
  /// Samples until the noise is below this fraction of the mean.
  void sample_to(double noise_target, bool adaptive, std::uint32_t seed);
  void filter(cumulet_denoise denoise);
  /// Orbits about the center of the visible part.
  void orbit(double degrees);
  /// Rotates the sun about the zenith. Returns false if the scene has none.
  bool turn_sun(float degrees);

  /// Renders one frame into the target and waits for it. Returns the seconds that it took.
  double frame(double budget_ms, bool& more);
  /// Renders until the image has its samples and is drawn completely.
  void converge();
  /// Renders all samples without drawing. Returns the seconds of tracing that the library reports.
  double converge_undrawn();

  /// The image of the last frame: 4 sRGB bytes per pixel, top left first, as displayed().
  [[nodiscard]] std::vector<std::uint8_t> drawn() const;
  /// Radiance as returned by read_linear and read_denoised.
  [[nodiscard]] std::vector<float> linear();
  /// Each pixel's standard error as the library estimates it.
  [[nodiscard]] std::vector<float> errors();
  /// Number of samples of the image.
  [[nodiscard]] std::uint64_t samples_taken();
  /// Two half references with this number of samples in total and different seeds. The viewer keeps the second.
  std::array<std::vector<float>, 2> reference(std::uint32_t samples);
  /// Applies the display transform.
  [[nodiscard]] std::vector<std::uint8_t> displayed(const std::vector<float>& linear);
  [[nodiscard]] std::size_t floats() const { return std::size_t{4} * size_ * size_; }
  /// Factor of radiance in the display transform.
  [[nodiscard]] double exposure() const { return std::exp2(display_.exposure_stops); }

 private:
  void must(cumulet_status status) const;
  void load(const JudgedScene& scene);

  std::uint32_t size_;
  GladGLContext gl_;
  test::HostTarget target_;
  test::ViewerPtr viewer_;
  test::CameraRef camera_;
  cumulet_sun_sky_desc light_;
  cumulet_display_desc display_;
};

/// Mean per pixel.
std::vector<float> mean_of(const std::array<std::vector<float>, 2>& halves);

}  // namespace cumulet::bench
