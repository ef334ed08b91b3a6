#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <optional>

#include "gl/programs.hpp"
#include "render/film/picture_textures.hpp"
#include "render/pacing/pace.hpp"

namespace cumulet::render {

/// Variance-guided edge-avoiding a-trous wavelet filter (Dammertz et al. 2010; Schied et al. 2017, SVGF) with temporal
/// reprojection.
///
/// Edges are differences beyond the noise, and differences of the noise-free feature buffers. These are normal and
/// depth of surfaces, transmittance of the volume, and its depth at half opacity. Radiance is demodulated before
/// filtering: it is divided by the surface's albedo and by the volume's coverage of the pixel. Both the radiance and
/// the divisor are filtered as sums, so that no small number divides. The background is that of the pixel's own
/// samples, weighted by the filtered uncovered fraction.
/// As samples come in, the tolerance of edges goes to 0 with the noise's deviation, and the result converges to the
/// mean of samples. If the filter's error exceeds the noise, as estimated from the difference that it makes around a
/// pixel, most of the unfiltered radiance is kept.
///
/// Temporal accumulation: pictures with a view keep a history of at most 32 samples per pixel, including earlier
/// history, for the next picture. Pixels are reprojected by depth: of surfaces, or the mean scattering depth of the
/// medium. History is accepted if depth, normal and transmittance match. It is clamped to the range of the new samples
/// around the pixel. Its confidence is reduced if it differs from them by more than their noise. It counts as the
/// pixel's own samples, and fades out as the pixel gets 64 new ones.
///
/// Memory: 112 bytes per pixel while denoising, and 80 more for pictures with a view. All calls except the queries need
/// a current context and an active StateGuard.
class Wavelet {
 public:
  using Deadline = std::chrono::steady_clock::time_point;

  Wavelet(gl::FunctionsPtr gl, gl::ProgramsPtr programs)
      : gl_(std::move(gl)), programs_(std::move(programs)), dispatches_in_flight_(gl_) {}

  /// Requests the programs for such a picture, and returns whether they are usable. wait: waits until they are.
  bool able(const PictureTextures& picture, MeansBackground background, bool wait);
  /// Starts denoising this picture, which must have moments and guides. Throws Error(out_of_memory, gl). If there is no
  /// memory for the history, returns the error, once per size, and denoises without history.
  std::optional<Error> begin(const PictureTextures& picture);
  /// PictureTextures::picture of the current picture; nullopt: none, or it was given.
  [[nodiscard]] const std::optional<std::uint64_t>& of() const { return of_; }
  /// Denoises the picture until about the deadline, in steps that take milliseconds on slow devices. Returns whether it
  /// is done. The next call continues.
  bool work(const PictureTextures& picture, Deadline deadline);
  /// Writes the denoised means, as resolve.comp writes means, to rgba32f textures of the picture's size. Call it once
  /// after work() returned true. background_means: used with MeansBackground::apart.
  void give(const PictureTextures& picture, MeansBackground background, GLuint means, GLuint background_means);
  /// Cancels the current picture.
  void drop() { of_.reset(); }
  /// Estimated maximum time for the rest of a picture of this size, in milliseconds; nullopt while it is unknown.
  [[nodiscard]] std::optional<double> left_ms(glm::uvec2 size) const;
  /// Frees all memory, including the history.
  void free();
  [[nodiscard]] std::uint64_t bytes() const;

 private:
  enum class Stage : std::uint8_t { input, reproject, merge, variance, level, blend };
  static constexpr std::size_t stages = 6;
  /// History of a picture: glsl/denoise/wavelet_history.glsl.
  struct History {
    gl::Object light;
    gl::Object guides;
    glm::uvec2 size{0U};
    bool filled = false;
    std::uint64_t picture = 0;
    std::uint64_t request = 0;
    PictureView view;
    bool surfaces = true;  // as PictureGuides::surfaces
    glm::vec2 footprint{0.0F};
  };
  [[nodiscard]] std::uint32_t levels() const;
  [[nodiscard]] gl::ProgramKey key(Stage stage, const PictureTextures& picture) const;
  [[nodiscard]] bool has(Stage stage) const;
  // Chooses which of the two histories this picture reads, and sets up the one that it writes.
  void remember(const PictureTextures& picture);
  void make_history(glm::uvec2 size);
  void forget();
  // Sets the uniforms of the temporal stages, and binds their inputs and outputs.
  void bind_history(const PictureTextures& picture, const gl::Program& program);
  // Binds the inputs and outputs of the current stage.
  void bind(const PictureTextures& picture, const gl::Program& program);
  void dispatch(const gl::Program& program, std::uint32_t rows, bool measured);
  void collect();
  [[nodiscard]] std::optional<double> cost(Stage stage, std::uint32_t rows) const;

  gl::FunctionsPtr gl_;
  gl::ProgramsPtr programs_;
  InFlightDispatches dispatches_in_flight_;
  std::array<std::shared_ptr<RoundCost>, stages> costs_{std::make_shared<RoundCost>(), std::make_shared<RoundCost>(),
                                                        std::make_shared<RoundCost>(), std::make_shared<RoundCost>(),
                                                        std::make_shared<RoundCost>(), std::make_shared<RoundCost>()};
  glm::uvec2 size_{0U};
  // In each pair, the first is read and the second written.
  std::array<gl::Object, 2> front_;
  std::array<gl::Object, 2> spread_;
  gl::Object guides_;
  gl::Object behind_;
  gl::Object unfiltered_;
  History before_;  // history of an earlier picture
  History kept_;    // history of the current or last picture
  gl::Object history_light_;
  bool keeps_ = false;                           // this picture writes a history
  bool recalls_ = false;                         // this picture reads a history
  std::optional<glm::uvec2> no_memory_to_keep_;  // of pictures of this size
  std::optional<std::uint64_t> of_;
  bool holes_ = false;  // at begin()
  Stage stage_ = Stage::input;
  std::uint32_t level_ = 0;
  std::uint32_t row_ = 0;
  bool done_ = false;
};

}  // namespace cumulet::render
