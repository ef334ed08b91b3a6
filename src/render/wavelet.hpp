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
/// deviation goes to 0, and with it all that is filtered: the result becomes the mean of samples.
///
/// Takes 96 bytes a pixel while under way. All calls but those that tell need the context current and a StateGuard
/// around.
class Wavelet {
 public:
  using Deadline = std::chrono::steady_clock::time_point;

  Wavelet(gl::FunctionsPtr gl, gl::ProgramsPtr programs)
      : gl_(std::move(gl)), programs_(std::move(programs)), flights_(gl_) {}

  /// Whether the programs are there for such a picture: they are asked for; wait: waited for.
  bool able(const PictureTextures& picture, MeansBackground background, bool wait);
  /// From now on of this picture, which has moments and guides. Throws Error(out_of_memory, gl).
  void begin(const PictureTextures& picture);
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
  /// Gives its memory back.
  void free();
  [[nodiscard]] std::uint64_t bytes() const;

 private:
  enum class Stage : std::uint8_t { input, variance, level };
  static constexpr std::size_t stages = 3;
  [[nodiscard]] std::uint32_t levels() const;
  gl::ProgramKey key(Stage stage, const PictureTextures& picture) const;
  // Binds what the stage under way reads and writes.
  void bind(const PictureTextures& picture, const gl::Program& program);
  void dispatch(const gl::Program& program, std::uint32_t rows, bool measured);
  void collect();
  [[nodiscard]] std::optional<double> cost(Stage stage, std::uint32_t rows) const;

  gl::FunctionsPtr gl_;
  gl::ProgramsPtr programs_;
  Flights flights_;
  std::array<std::shared_ptr<RoundCost>, stages> costs_{std::make_shared<RoundCost>(), std::make_shared<RoundCost>(),
                                                        std::make_shared<RoundCost>()};
  glm::uvec2 size_{0U};
  // Of each two the first is read and the second written.
  std::array<gl::Object, 2> front_;
  std::array<gl::Object, 2> spread_;
  gl::Object guides_;
  gl::Object behind_;
  std::optional<std::uint64_t> of_;
  bool holes_ = false;  // as it began
  Stage stage_ = Stage::input;
  std::uint32_t level_ = 0;
  std::uint32_t row_ = 0;
  bool done_ = false;
};

}  // namespace cumulet::render
