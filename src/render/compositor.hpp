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
#include "render/composed.hpp"
#include "render/display.hpp"
#include "render/picture_textures.hpp"
#include "render/region.hpp"
#include "render/target_format.hpp"
#include "render/wavelet.hpp"

namespace cumulet::render {

/// When drawing waits for the driver's compiler.
enum class Wait {
  never,    ///< what is not there yet draws nothing
  to_show,  ///< where nothing was drawn yet that serves instead
  always,   ///< what is drawn is read back, and may not lag
};

struct FrameTarget {
  GLuint framebuffer = 0;
  glm::uvec2 size{0U};  // that it has at least
  bool needs_depth = false;
  glm::ivec4 viewport{0};  // as glViewport
  Region region;           // of it, that is drawn: the rest stays as it is
  bool flip_y = false;     // true: the picture's top row at y = 0
  bool blend_over = true;
  bool is_hidden = false;  // nothing is written: for programs to be used once
  Wait wait = Wait::to_show;
  double filter_ms = 0.0;  // that a denoised picture may take of this frame
  // Depth to write, where the picture has volume_z: a + b / z, or a + b z where orthographic.
  bool write_depth = false;
  bool reversed = false;
  bool orthographic = false;
  double depth_a = 0.0;
  double depth_b = 0.0;
};

/// Draws an accumulation over a rectangle of a framebuffer: one triangle, bilinear where sizes differ. One over
/// surfaces of another size than the rectangle is drawn at theirs first, which is most of the work, and enlarged as
/// displayed. Needs the context current and a StateGuard around; leaves any state it likes. Vertex arrays and
/// framebuffers belong to one context of a share group: those it needs live for one call.
class Compositor {
 public:
  Compositor(gl::FunctionsPtr gl, gl::ProgramsPtr programs)
      : gl_(std::move(gl)), programs_(std::move(programs)), composed_(gl_), wavelet_(gl_, programs_) {}
  /// Draws nothing without a picture or into a rectangle of size 0. Writes color to draw buffer 0 only, whatever the
  /// depth there: cm_display_over of glsl/display.glsl of premultiplied radiance. Throws Error(invalid_argument) as
  /// check_target. What the last frame drew, and on drivers that run dispatches within their call every picture, is
  /// composed in a texture and copied; only rows that changed are composed again. Denoised, where the display is and
  /// the picture has guides: by and by, as filter_ms allow; until then as it was denoised last, if that was of the same
  /// wish, else as it is. Throws Error(out_of_memory, gl), once for each size, where there is no memory for that, or
  /// the driver does not build it: it is drawn as it is.
  void draw(const PictureTextures& picture, const Display& display, const FrameTarget& target);
  /// For frames that do not draw: goes on with denoising what draw() would draw so, for that long. Errors as draw().
  void denoise(const PictureTextures& picture, const Display& display, double filter_ms);
  /// There is nothing to denoise any more: forgets all that it has for that.
  void rest();
  /// Begins anew with the picture that it is denoising: what is known of it without noise is another.
  void begin_denoising_anew() { wavelet_.drop(); }
  /// Of GL memory.
  [[nodiscard]] std::uint64_t bytes() const;
  /// Milliseconds that the next call of draw will take, as far as is known.
  [[nodiscard]] double expected_ms() const;
  /// Of that, for denoising.
  [[nodiscard]] double expected_filter_ms() const;
  /// Whether the device has come to all that was drawn, where dispatches run within their call. Never waits.
  [[nodiscard]] bool drawn() const {
    return drawn_.passed() && std::ranges::all_of(means_, [](const auto& means) { return means->drawn.passed(); });
  }
  /// Whether the last draw drew what there was some frames ago, all memory for what is newer being in use by drawing
  /// that the device has not come to, or as it was drawn then, or nothing (Wait::never), its programs not being there
  /// yet: to be drawn again.
  [[nodiscard]] bool lags() const { return lags_; }
  /// Whether a picture that has all its samples is still to be denoised.
  [[nodiscard]] bool denoising() const { return denoising_; }
  /// Another with every picture that was denoised: what draw() draws is another then.
  [[nodiscard]] std::uint64_t denoised() const { return denoised_; }
  /// Rows that the last draw composed; nothing where it composed the whole in the target itself.
  [[nodiscard]] std::optional<std::uint32_t> composed_rows() const { return composed_rows_; }

 private:
  using Clock = std::chrono::steady_clock;
  using Background = MeansBackground;
  /// Means that are drawn. Where dispatches run within their call, one that writes what queued drawing reads, sums as
  /// well as means, waits for all that the host has queued: so drawing reads means alone, and while anything is queued
  /// none are written a second time, for llvmpipe takes some that were drawn long ago for being read still.
  struct Means {
    gl::Object texture;
    gl::Object background;  // where that is apart
    MeansOf of;
    gl::Fence drawn;
  };
  // What a program that draws colours reads, and what its target takes.
  struct Kind {
    bool layered = false;
    bool resolved = false;
    bool bilinear = false;
    ColourEncoding encoding = ColourEncoding::srgb;
    bool operator==(const Kind&) const = default;
  };
  // serves: something else may be drawn until it is linked.
  const gl::Program& program(const gl::ProgramKey& key, Wait wait, bool serves);
  // Until the one for this display is there, the one of before; null if that is of another kind.
  const gl::Program* colour_program(const Kind& kind, const Display& display, Wait wait);
  // What is drawn of a picture.
  struct Shown {
    const Means* means = nullptr;  // null: what there is in the picture itself
    const gl::Program* program = nullptr;
    bool layered = false;
  };
  // A rectangle of a framebuffer, and how it takes colours; with a region, until the draw ends nothing else is written.
  void aim(const FrameTarget& target, const Display& display) const;
  static void place(const gl::Functions& gl, const gl::Program& program, const FrameTarget& target);
  // All that drawing such a picture into that rectangle needs, but the rectangle.
  void bind_colour(const Shown& shown, const PictureTextures& picture, const Display& display,
                   const FrameTarget& target) const;
  void draw_colour(const Shown& shown, const PictureTextures& picture, const Display& display,
                   const FrameTarget& target) const;
  // The same by a copy of what is composed. Returns whether it did.
  bool draw_composed(const Shown& shown, const PictureTextures& picture, const Display& display,
                     const FrameTarget& target, const TargetFormat& format);
  void compose(GLuint texture, const std::vector<RowRange>& rows, const Shown& shown, const PictureTextures& picture,
               const Display& display, const FrameTarget& target) const;
  void draw_enlarged(const gl::Program& enlarge, const Shown& shown, const PictureTextures& picture,
                     const Display& display, const FrameTarget& target);
  void draw_depth(const PictureTextures& picture, const FrameTarget& target);
  [[nodiscard]] static MeansOf means_of(const PictureTextures& picture, Background background, bool filtered);
  // The means to draw; null if there is no memory for them.
  Means* resolve(const PictureTextures& picture, Background background, Wait wait);
  // The same, denoised; null where they are not there yet, nor ones of the same wish that serve.
  Means* filter(const PictureTextures& picture, Background background, const FrameTarget& target);
  // What is drawn of the two.
  Means* means_to_draw(const PictureTextures& picture, Background background, const Display& display,
                       const FrameTarget& target);
  // As far as it is denoised; null: not at all yet, or it shall not be.
  Means* go_on_filtering(const PictureTextures& picture, Background background, const Display& display,
                         const FrameTarget& target);
  static Background background_of(const PictureTextures& picture, const Display& display);
  // As free_means, but where there is no memory keeps that to be told, once, and gives null.
  Means* some_means(const MeansOf& wanted, bool overwrite, bool newest_serves);
  // To be written. Where as many as there may be wait to be drawn: null if the newest serves as well, else in place of
  // the oldest, whose memory the driver keeps until it is drawn. Else newest_ may be gone. overwrite: takes one that is
  // still to be drawn.
  Means* free_means(glm::uvec2 size, bool apart, bool overwrite, bool newest_serves);
  [[nodiscard]] bool resolves_now() const;
  [[nodiscard]] bool filters_now() const;

  gl::FunctionsPtr gl_;
  gl::ProgramsPtr programs_;
  Composed composed_;
  std::optional<std::uint32_t> composed_rows_;
  gl::Fence drawn_;  // the last
  std::vector<std::unique_ptr<Means>> means_;
  Means* newest_ = nullptr;
  struct Small {
    glm::uvec2 size{0U};
    GLenum format = GL_RGBA8;
    bool operator==(const Small&) const = default;
  };
  gl::Object small_;  // what is to be enlarged
  Small small_kind_;
  std::optional<Small> no_memory_for_small_;
  const gl::Program* colour_ = nullptr;  // the last
  Kind colour_kind_;
  std::optional<glm::uvec2> no_memory_for_;  // means of this size: tried again with another
  std::optional<Error> untold_;              // why something is not there, to be told
  std::optional<glm::uvec2> cannot_filter_;  // pictures of this size: likewise
  Wavelet wavelet_;
  MeansOf filtering_;             // what it is at
  double filtering_ms_ = 0.0;     // in all frames so far
  double filter_ms_ = 0.0;        // of the last that was done...
  Clock::time_point filtered_{};  // ...then
  double may_filter_ms_ = 0.0;    // of a frame
  double resolve_ms_ = 0.0;       // within the call
  double draw_ms_ = 0.0;          // the rest of it
  bool lags_ = false;
  bool denoising_ = false;
  std::uint64_t denoised_ = 0;
  Clock::time_point resolved_{};
};

}  // namespace cumulet::render
