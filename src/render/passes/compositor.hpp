#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <optional>
#include <vector>

#include "base/error.hpp"
#include "gl/programs.hpp"
#include "render/film/picture_textures.hpp"
#include "render/pacing/region.hpp"
#include "render/passes/composed.hpp"
#include "render/passes/display.hpp"
#include "render/passes/frame_target.hpp"
#include "render/passes/lut_texture.hpp"
#include "render/passes/target_format.hpp"
#include "render/passes/wavelet.hpp"

namespace cumulet::render {

/// Draws an accumulated picture into a rectangle of a framebuffer, with one triangle, bilinearly filtered if sizes
/// differ. A picture over rasterized surfaces of another size than the rectangle is composed at the surfaces' size, and
/// then enlarged. Composing is most of the work. Needs a current context and an active StateGuard; changes GL state
/// freely. Vertex arrays and framebuffers belong to one context of a share group, so they are created per call.
class Compositor {
 public:
  Compositor(gl::FunctionsPtr gl, gl::ProgramsPtr programs)
      : gl_(std::move(gl)), programs_(std::move(programs)), composed_(gl_), lut_(gl_), wavelet_(gl_, programs_) {}
  /// Draws the picture. Draws nothing if there is no picture or the rectangle is empty. Writes color to draw buffer 0
  /// only, without a depth test: cm_display_over() of glsl/display/display.glsl, from premultiplied radiance. Throws
  /// Error(invalid_argument) as check_target().
  /// The image is composed into a texture and copied if the last frame drew the same image. Drivers that run dispatches
  /// within the call always use that texture. Only rows that changed are composed again.
  /// If display.denoise is set and the picture has guides, it is denoised over several frames within filter_ms. Until
  /// that is done, the last denoised picture of the same request is drawn, or else the noisy one. Throws
  /// Error(out_of_memory, gl), once per size, if there is no memory for denoising or its programs do not build; the
  /// noisy picture is drawn then.
  void draw(const PictureTextures& picture, const Display& display, const FrameTarget& target);
  /// Continues denoising for filter_ms, for frames that do not draw. Throws as draw().
  void denoise(const PictureTextures& picture, const Display& display, double filter_ms);
  /// Stops denoising and frees its memory.
  void rest();
  /// Restarts denoising of the current picture, because its noise-free component has changed.
  void begin_denoising_anew() { wavelet_.drop(); }
  /// GL memory.
  [[nodiscard]] std::uint64_t bytes() const;
  /// Estimated time of the next call of draw(), in milliseconds.
  [[nodiscard]] double expected_ms() const;
  /// The part of expected_ms() that is for denoising.
  [[nodiscard]] double expected_filter_ms() const;
  /// True if the GPU has executed everything that was drawn. Only tracked on drivers that run dispatches within the
  /// call. Never waits.
  [[nodiscard]] bool drawn() const {
    return drawn_.passed() && std::ranges::all_of(means_, [](const auto& means) { return means->drawn.passed(); });
  }
  /// True if the last draw() showed an older image, or none. The reason is that all buffers were in use by the GPU, or
  /// that a program was still compiling. Draw again.
  [[nodiscard]] bool lags() const { return lags_; }
  /// True if a picture that has all its samples is not denoised yet.
  [[nodiscard]] bool denoising() const { return denoising_; }
  /// True if the last draw() showed a denoised picture.
  [[nodiscard]] bool shows_denoised() const { return shows_denoised_; }
  /// Revision number; changes with every denoised picture, so that draw() would draw another image.
  [[nodiscard]] std::uint64_t denoised() const { return denoised_; }
  /// Rows that the last draw() composed; nullopt if it drew the whole image directly into the target.
  [[nodiscard]] std::optional<std::uint32_t> composed_rows() const { return composed_rows_; }

 private:
  using Clock = std::chrono::steady_clock;
  using Background = MeansBackground;
  /// A texture of mean radiance that is drawn. Some drivers run dispatches within the call. A dispatch that writes a
  /// texture which queued drawing reads then waits for everything that the host has queued. This holds for sums as well
  /// as for means, so drawing reads only means. While anything is queued, each write uses a new texture, because
  /// llvmpipe may consider textures of old frames as still in use.
  struct Means {
    gl::Object texture;
    gl::Object background;  // with MeansBackground::apart
    MeansOf of;
    gl::Fence drawn;
  };
  // Selects a color program: its inputs, and the encoding of the target.
  struct Kind {
    bool layered = false;
    bool resolved = false;
    bool bilinear = false;
    bool lut = false;
    ColorEncoding encoding = ColorEncoding::srgb;
    bool operator==(const Kind&) const = default;
  };
  // serves: something else can be drawn until the program is linked.
  const gl::Program& program(const gl::ProgramKey& key, Wait wait, bool serves);
  // Returns the program for this display. While it is compiling, returns the previous one if it is of the same kind,
  // else null.
  const gl::Program* color_program(const Kind& kind, const Display& display, Wait wait);
  // Inputs of a color pass.
  struct Shown {
    const Means* means = nullptr;  // null: reads the picture's sums
    const gl::Program* program = nullptr;
    bool layered = false;
    GLuint lut = 0;  // 0: the program has a tone curve
  };
  // Binds the framebuffer, and sets the viewport, scissor, blending and encoding. Until the draw ends, nothing outside
  // the region is written.
  void aim(const FrameTarget& target, const Display& display) const;
  static void set_viewport(const gl::Functions& gl, const gl::Program& program, const FrameTarget& target);
  // Binds the inputs of a color pass and sets its uniforms, except the framebuffer state that aim() sets.
  void bind_color(const Shown& shown, const PictureTextures& picture, const Display& display,
                  const FrameTarget& target) const;
  void draw_color(const Shown& shown, const PictureTextures& picture, const Display& display,
                  const FrameTarget& target) const;
  // Draws by a copy of the composed image. Returns false if it is not used.
  bool draw_composed(const Shown& shown, const PictureTextures& picture, const Display& display,
                     const FrameTarget& target, const TargetFormat& format);
  void compose(GLuint texture, const std::vector<RowRange>& rows, const Shown& shown, const PictureTextures& picture,
               const Display& display, const FrameTarget& target) const;
  void draw_enlarged(const gl::Program& enlarge, const Shown& shown, const PictureTextures& picture,
                     const Display& display, const FrameTarget& target);
  void draw_depth(const PictureTextures& picture, const FrameTarget& target);
  [[nodiscard]] static MeansOf means_of(const PictureTextures& picture, Background background, bool filtered);
  // Returns the Means to draw; null if there is no memory for them.
  Means* resolve(const PictureTextures& picture, Background background, Wait wait);
  // Returns denoised means; null if they are not ready and there are none of the same request.
  Means* filter(const PictureTextures& picture, Background background, const FrameTarget& target);
  // Returns the denoised means if there are any, else the noisy ones.
  Means* means_to_draw(const PictureTextures& picture, Background background, const Display& display,
                       const FrameTarget& target);
  // Continues denoising. Returns denoised means; null if there are none yet, or if denoising is off.
  Means* go_on_filtering(const PictureTextures& picture, Background background, const Display& display,
                         const FrameTarget& target);
  static Background background_of(const PictureTextures& picture, const Display& display);
  // Calls free_means(). If there is no memory, keeps the error in unreported_, to be thrown once, and returns null.
  Means* some_means(const MeansOf& wanted, bool overwrite, bool newest_serves);
  // Returns means to overwrite. May reset newest_. If the maximum number waits to be drawn, returns null if
  // newest_serves, else replaces the oldest, whose memory the driver keeps until it is drawn. overwrite: takes means
  // that are still to be drawn.
  Means* free_means(glm::uvec2 size, bool apart, bool overwrite, bool newest_serves);
  [[nodiscard]] bool resolves_now() const;
  [[nodiscard]] bool filters_now() const;

  gl::FunctionsPtr gl_;
  gl::ProgramsPtr programs_;
  Composed composed_;
  std::optional<std::uint32_t> composed_rows_;
  gl::Fence drawn_;  // of the last draw; only if dispatches run within the call
  std::vector<std::unique_ptr<Means>> means_;
  Means* newest_ = nullptr;
  struct Small {
    glm::uvec2 size{0U};
    GLenum format = GL_RGBA8;
    bool operator==(const Small&) const = default;
  };
  gl::Object small_;  // a picture over surfaces, before it is enlarged
  Small small_kind_;
  std::optional<Small> no_memory_for_small_;
  const gl::Program* color_ = nullptr;  // the program that was drawn with last
  Kind color_kind_;
  std::optional<glm::uvec2> no_memory_for_;  // size that did not fit; retried when the size changes
  std::optional<Error> unreported_;          // error to be thrown by the next draw
  std::optional<glm::uvec2> cannot_filter_;  // size of pictures that cannot be denoised
  LutTexture lut_;
  Wavelet wavelet_;
  MeansOf filtering_;             // means that are being denoised
  double filtering_ms_ = 0.0;     // time for it, over all frames so far
  double filter_ms_ = 0.0;        // time of the last completed denoising
  Clock::time_point filtered_{};  // when that completed
  double may_filter_ms_ = 0.0;    // budget per frame
  double resolve_ms_ = 0.0;       // time of the last resolve, within the call
  double draw_ms_ = 0.0;          // smoothed time of the rest of draw()
  bool lags_ = false;
  bool denoising_ = false;
  bool shows_denoised_ = false;
  std::uint64_t denoised_ = 0;
  Clock::time_point resolved_{};
};

}  // namespace cumulet::render
