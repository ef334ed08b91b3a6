#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <optional>

#include "gl/programs.hpp"
#include "render/pace.hpp"
#include "render/picture_textures.hpp"

namespace cumulet::render {

/// A pixel's neighbours tell what its own samples do not yet: an edge-avoiding a-trous wavelet (Dammertz et al. 2010)
/// whose edges are what differs by more than the noise does (variance-guided, Schied et al. 2017), and what facts of
/// pixels tell apart without noise: surfaces by normal and depth, the volume by its transmittance and by the depth of
/// its half opacity. What is filtered is light over what it is in proportion to, which is known without noise: a
/// surface's albedo, and how much of a pixel the volume covers (sums of both, so that no small number divides). What is
/// behind all is that of the pixel's own samples, in the filtered part that nothing covers. As samples come the noise's
/// deviation goes to 0, and with it all that is filtered: the result becomes the mean of samples. Sooner where the
/// filter is off by more than the noise, as what it took away about a pixel tells: there most is given unfiltered.
///
/// Of pictures that have a view, what one knows is kept for the next: samples, their own and those that were kept
/// before them, at most 32 a pixel, found again by depths (of what is solid; of the medium the mean one at which it
/// scatters) where depth, normal and transmittance are alike, within what new samples about a pixel differ by, and for
/// less where these are off from them by more than their noise. They count as a pixel's own, and fade as it gets 64 of
/// these.
///
/// Takes 112 bytes a pixel while under way, and 80 more of pictures that have a view. All calls but those that tell
/// need the context current and a StateGuard around.
class Wavelet {
 public:
  using Deadline = std::chrono::steady_clock::time_point;

  Wavelet(gl::FunctionsPtr gl, gl::ProgramsPtr programs)
      : gl_(std::move(gl)), programs_(std::move(programs)), flights_(gl_) {}

  /// Whether the programs are there for such a picture: they are asked for; wait: waited for.
  bool able(const PictureTextures& picture, MeansBackground background, bool wait);
  /// From now on of this picture, which has moments and guides. Throws Error(out_of_memory, gl). Returns why nothing is
  /// known of pictures before it where there is no memory for that, once for each size.
  std::optional<Error> begin(const PictureTextures& picture);
  /// The picture that it is of, by PictureTextures::picture; nothing: none, all is given.
  [[nodiscard]] const std::optional<std::uint64_t>& of() const { return of_; }
  /// Filters that picture until about the deadline, of steps that take milliseconds on slow devices; returns whether it
  /// is done. Goes on in the next call.
  bool work(const PictureTextures& picture, Deadline deadline);
  /// Once that is done: writes it, as resolve.comp writes means, to rgba32f textures of the picture's size, that of the
  /// background where it is apart.
  void give(const PictureTextures& picture, MeansBackground background, GLuint means, GLuint background_means);
  /// Gives up what is under way.
  void drop() { of_.reset(); }
  /// Milliseconds that what is left of such a picture takes at most; nothing while that is not known.
  [[nodiscard]] std::optional<double> left_ms(glm::uvec2 size) const;
  /// Gives its memory back, and forgets all pictures.
  void free();
  [[nodiscard]] std::uint64_t bytes() const;

 private:
  enum class Stage : std::uint8_t { input, reproject, merge, variance, level, blend };
  static constexpr std::size_t stages = 6;
  /// What is kept of a picture: glsl/wavelet_history.glsl.
  struct History {
    gl::Object light;
    gl::Object guides;
    glm::uvec2 size{0U};
    bool filled = false;
    std::uint64_t picture = 0;
    std::uint64_t wish = 0;
    PictureView view;
    bool surfaces = true;  // as its guides have them
    glm::vec2 footprint{0.0F};
  };
  [[nodiscard]] std::uint32_t levels() const;
  [[nodiscard]] gl::ProgramKey key(Stage stage, const PictureTextures& picture) const;
  [[nodiscard]] bool has(Stage stage) const;
  // Which of the two histories this picture begins with, and where it will be kept.
  void remember(const PictureTextures& picture);
  void make_history(glm::uvec2 size);
  void forget();
  // What the temporal stages are told, and what they read and write.
  void bind_history(const PictureTextures& picture, const gl::Program& program);
  // Binds what the stage under way reads and writes.
  void bind(const PictureTextures& picture, const gl::Program& program);
  void dispatch(const gl::Program& program, std::uint32_t rows, bool measured);
  void collect();
  [[nodiscard]] std::optional<double> cost(Stage stage, std::uint32_t rows) const;

  gl::FunctionsPtr gl_;
  gl::ProgramsPtr programs_;
  Flights flights_;
  std::array<std::shared_ptr<RoundCost>, stages> costs_{std::make_shared<RoundCost>(), std::make_shared<RoundCost>(),
                                                        std::make_shared<RoundCost>(), std::make_shared<RoundCost>(),
                                                        std::make_shared<RoundCost>(), std::make_shared<RoundCost>()};
  glm::uvec2 size_{0U};
  // Of each two the first is read and the second written.
  std::array<gl::Object, 2> front_;
  std::array<gl::Object, 2> spread_;
  gl::Object guides_;
  gl::Object behind_;
  gl::Object unfiltered_;
  History before_;  // of another picture
  History kept_;    // of the one that is filtered, or was last
  gl::Object recalled_;
  bool keeps_ = false;                           // what is known of this picture
  bool recalls_ = false;                         // what was known before
  std::optional<glm::uvec2> no_memory_to_keep_;  // of this size
  std::optional<std::uint64_t> of_;
  bool holes_ = false;  // as it began
  Stage stage_ = Stage::input;
  std::uint32_t level_ = 0;
  std::uint32_t row_ = 0;
  bool done_ = false;
};

}  // namespace cumulet::render
