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

/// A scene that pictures under way are judged on: cloud, full (the cloud at its full setting), fire, explosion, model
/// (in the cloud), terrain, fog (in the Cornell box), lamp (in smoke).
struct JudgedScene {
  std::string name;
  std::filesystem::path volume;    ///< a file; empty: none, or one that is made here
  std::filesystem::path surfaces;  ///< likewise
};

/// The names of all of them.
const std::vector<std::string>& judged_names();

/// Those that are asked for and whose files are there; skipped: a line for each other one.
std::vector<JudgedScene> judged_scenes(const Options& options, std::vector<std::string>& skipped);

/// Such a scene in a viewer of its own, by the library's public calls alone. The context must be current, now and until
/// the end. Throws std::runtime_error.
class Stage {
 public:
  /// programs: its own, where not null.
  Stage(headless::Context& context, const JudgedScene& scene, std::uint32_t size, cumulet_programs* programs = nullptr);

  [[nodiscard]] cumulet_viewer* viewer() { return viewer_.get(); }
  /// Starts anew, but with the same seed and more samples, which goes on.
  void sample(std::uint32_t samples, std::uint32_t seed, cumulet_preview preview = CUMULET_PREVIEW_OFF);
  /// Until the noise is no more than that, a part of the mean.
  void sample_to(double noise_target, bool adaptive, std::uint32_t seed);
  void filter(cumulet_denoise denoise);
  /// About the middle of what is seen.
  void orbit(double degrees);
  /// Turns the sun about the zenith. False: the scene has none.
  bool turn_sun(float degrees);

  /// One frame into the target. Waits until it is drawn; the seconds that it took.
  double frame(double budget_ms, bool& more);
  /// Frames until the picture has its samples and is drawn as it should be.
  void converge();
  /// The same without drawing anything: the seconds that tracing took, as the library counts them.
  double converge_undrawn();

  /// What the last frame drew: 4 sRGB bytes a pixel, first pixel top left, as of displayed().
  [[nodiscard]] std::vector<std::uint8_t> drawn() const;
  /// Radiance as read_linear and read_denoised give it.
  [[nodiscard]] std::vector<float> linear();
  /// Each pixel's standard error, as the library estimates it.
  [[nodiscard]] std::vector<float> errors();
  /// Samples that the picture has.
  [[nodiscard]] std::uint64_t samples_taken();
  /// That of so many samples in two halves, which have seeds of their own. Leaves the viewer with the second.
  std::array<std::vector<float>, 2> reference(std::uint32_t samples);
  /// As it is displayed.
  [[nodiscard]] std::vector<std::uint8_t> displayed(const std::vector<float>& linear);
  [[nodiscard]] std::size_t floats() const { return std::size_t{4} * size_ * size_; }
  /// By what radiance is multiplied to be displayed.
  [[nodiscard]] double exposure() const { return std::exp2(display_.exposure_stops); }

 private:
  void must(cumulet_status status) const;
  void load(const JudgedScene& scene);

  std::uint32_t size_;
  GladGLContext gl_;
  test::HostTarget target_;
  test::ViewerPtr viewer_;
  test::CameraRef camera_;
  cumulet_light_desc light_;
  cumulet_display_desc display_;
};

/// Pixel by pixel.
std::vector<float> mean_of(const std::array<std::vector<float>, 2>& halves);

}  // namespace cumulet::bench
