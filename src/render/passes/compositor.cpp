#include "render/passes/compositor.hpp"

#include <algorithm>
#include <string>
#include <utility>

#include "base/milliseconds.hpp"
#include "gl/bindings.hpp"
#include "gl/transient_framebuffer.hpp"
#include "shader_macros.hpp"

namespace cumulet::render {

namespace {

GLint as_bool(bool value) { return value ? 1 : 0; }

// More frames than a host queues ahead.
constexpr std::size_t max_means = 3;
// Minimum time between two means of an unfinished picture, as a multiple of the time that they took.
constexpr double pause = 4.0;

gl::ProgramKey key_of(std::vector<std::string> defines) {
  return {"composite.frag", std::move(defines), "composite.vert"};
}

}  // namespace

bool Compositor::resolves_now() const { return milliseconds(Clock::now() - resolved_) >= pause * resolve_ms_; }

bool Compositor::filters_now() const { return milliseconds(Clock::now() - filtered_) >= pause * filter_ms_; }

double Compositor::expected_ms() const {
  return draw_ms_ + (resolves_now() ? resolve_ms_ : 0.0) + expected_filter_ms();
}

double Compositor::expected_filter_ms() const {
  if (may_filter_ms_ <= 0.0 || (!wavelet_.of() && !filters_now())) return 0.0;
  return std::min(may_filter_ms_, wavelet_.left_ms(filtering_.size).value_or(may_filter_ms_));
}

Compositor::Means* Compositor::free_means(glm::uvec2 size, bool apart, bool overwrite, bool newest_serves) {
  const bool waits = !overwrite && gl_->dispatches_in_call && !gl::Fence(gl_).passed();
  if (waits) {
    std::erase_if(means_, [this](const auto& means) { return means.get() != newest_ && means->drawn.passed(); });
    if (means_.size() >= max_means) {
      if (newest_serves) return nullptr;
      newest_ = nullptr;
      means_.erase(means_.begin());
    }
  } else {
    newest_ = nullptr;
    means_.resize(std::min<std::size_t>(means_.size(), 1));
  }
  if (waits || means_.empty()) means_.push_back(std::make_unique<Means>());
  Means& means = *means_.back();
  const auto make = [&] {
    return gl::make_texture_2d(gl_, GL_RGBA32F, static_cast<int>(size.x), static_cast<int>(size.y),
                               "creating the mean texture");
  };
  if (!means.texture || means.of.size != size) {
    means.texture = {};
    means.background = {};
    means.of = {};
    means.texture = make();
  }
  if (!apart) means.background = {};
  if (apart && !means.background) means.background = make();
  return &means;
}

const gl::Program& Compositor::program(const gl::ProgramKey& key, Wait wait, bool serves) {
  if (wait == Wait::always) return programs_->get(key);
  const gl::Program& program = programs_->ask(key);  // throws again if the program failed to build
  return program.usable() || wait == Wait::never || serves ? program : programs_->get(key);
}

MeansOf Compositor::means_of(const PictureTextures& picture, Background background, bool filtered) {
  return {picture.sum,     picture.holes ? picture.sum_before : 0,
          picture.holes,   background,
          picture.size,    picture.picture,
          picture.request, picture.revision,
          filtered};
}

Compositor::Means* Compositor::some_means(const MeansOf& wanted, bool overwrite, bool newest_serves) {
  try {
    return free_means(wanted.size, wanted.background == Background::apart, overwrite, newest_serves);
  } catch (const Error& error) {
    if (error.code() != ErrorCode::out_of_memory) throw;
    means_.clear();
    newest_ = nullptr;
    no_memory_for_ = wanted.size;
    unreported_ = error;
    // The picture is drawn from its sums then: slower and with unsampled pixels.
    return nullptr;
  }
}

Compositor::Means* Compositor::filter(const PictureTextures& picture, Background background,
                                      const FrameTarget& target) {
  const MeansOf wanted = means_of(picture, background, true);
  const bool alike = newest_ != nullptr && newest_->of.filtered && newest_->of.background == background;
  if (alike && wanted.revision && newest_->of == wanted) return newest_;
  const bool older = alike && newest_->of.picture == wanted.picture && newest_->of.size == wanted.size;
  Means* const serves = older || (alike && newest_->of.request == wanted.request) ? newest_ : nullptr;
  if (no_memory_for_ == picture.size || cannot_filter_ == picture.size) return nullptr;
  const bool always = target.wait == Wait::always;
  // able() might ask for another program variant otherwise.
  if (wavelet_.of() != picture.picture) wavelet_.drop();
  try {
    if (!wavelet_.able(picture, background, always)) return serves;
  } catch (const Error& error) {
    // If the driver does not build the programs, pictures are shown without denoising.
    cannot_filter_ = picture.size;
    unreported_ = error;
    return nullptr;
  }
  if (wavelet_.of() != picture.picture || filtering_.background != background) {
    wavelet_.drop();
    if (older && picture.may_lag && !filters_now()) return newest_;
    try {
      if (auto forgets = wavelet_.begin(picture)) unreported_ = std::move(forgets);
    } catch (const Error& error) {
      if (error.code() != ErrorCode::out_of_memory) throw;
      wavelet_.free();
      cannot_filter_ = picture.size;
      unreported_ = error;
      return nullptr;
    }
    filtering_ = wanted;
    filtering_ms_ = 0.0;
  }
  const auto begun = Clock::now();
  // Warm-up pictures are small, so they are denoised at once.
  const bool at_once = target.wait != Wait::to_show;
  bool done = wavelet_.work(picture, deadline_after(target.filter_ms));
  while (!done && at_once) done = wavelet_.work(picture, deadline_after(target.filter_ms));
  filtering_ms_ += milliseconds(Clock::now() - begun);
  if (!done) return serves;
  Means* means = some_means(filtering_, always, serves != nullptr);
  if (means == nullptr) {
    // There may be memory for the means without the denoiser.
    if (no_memory_for_ == filtering_.size) {
      wavelet_.free();
      cannot_filter_ = std::exchange(no_memory_for_, std::nullopt);
    }
    return newest_ != nullptr ? serves : nullptr;
  }
  wavelet_.give(picture, background, means->texture.name(), means->background.name());
  means->of = filtering_;
  newest_ = means;
  ++denoised_;
  filtered_ = Clock::now();
  // On a GPU, calls return before the work is done.
  filter_ms_ = std::max(filtering_ms_, wavelet_.left_ms(filtering_.size).value_or(0.0));
  return means;
}

Compositor::Means* Compositor::means_to_draw(const PictureTextures& picture, Background background,
                                             const Display& display, const FrameTarget& target) {
  lags_ = false;
  Means* const means = go_on_filtering(picture, background, display, target);
  shows_denoised_ = means != nullptr;
  return means != nullptr ? means : resolve(picture, background, target.wait);
}

Compositor::Means* Compositor::go_on_filtering(const PictureTextures& picture, Background background,
                                               const Display& display, const FrameTarget& target) {
  denoising_ = false;
  if (!display.denoise) rest();
  // If guides are only late, the history is kept, because it is needed later.
  if (!display.denoise || !picture.guides) return nullptr;
  // A frame without a budget does not change the budget of frames that have one.
  if (target.filter_ms > 0.0) may_filter_ms_ = target.filter_ms;
  Means* const means = filter(picture, background, target);
  const bool can = no_memory_for_ != picture.size && cannot_filter_ != picture.size;
  denoising_ = can && !picture.may_lag && (means == nullptr || !(means->of == means_of(picture, background, true)));
  return means;
}

void Compositor::rest() {
  denoising_ = false;
  may_filter_ms_ = 0.0;
  wavelet_.free();
}

void Compositor::denoise(const PictureTextures& picture, const Display& display, double filter_ms) {
  if (picture.sum == 0 || picture.size.x == 0 || picture.size.y == 0) return;
  FrameTarget target;
  target.filter_ms = filter_ms;
  go_on_filtering(picture, background_of(picture, display), display, target);
  gl::check(*gl_, "denoising the image");
  if (const auto failure = std::exchange(unreported_, std::nullopt)) throw Error(*failure);
}

Compositor::Background Compositor::background_of(const PictureTextures& picture, const Display& display) {
  if (picture.beneath != nullptr && picture.beneath->color) return Background::apart;
  return display.shows_background() ? Background::added : Background::left_out;
}

Compositor::Means* Compositor::resolve(const PictureTextures& picture, Background background, Wait wait) {
  const MeansOf wanted = means_of(picture, background, false);
  const bool alike = newest_ != nullptr && newest_->of.background == background && !newest_->of.filtered;
  if (alike) {
    if (wanted.revision && newest_->of == wanted) return newest_;
    const bool older = newest_->of.picture == wanted.picture && newest_->of.size == wanted.size;
    if (older && picture.may_lag && !resolves_now()) return newest_;
  }
  if (no_memory_for_ == picture.size) return nullptr;
  const gl::Program& program = Compositor::program(
      {"resolve.comp", {gl::macros::holes(picture.holes), gl::macros::background(background)}}, wait, alike);
  if (!program.usable()) {
    lags_ = true;
    return alike ? newest_ : nullptr;
  }
  const gl::DebugGroup group(*gl_, "cumulet: resolve");
  const auto begun = Clock::now();
  Means* means = some_means(wanted, wait == Wait::always, alike);
  if (no_memory_for_ == picture.size) return nullptr;
  lags_ = means == nullptr;
  if (lags_) return newest_;
  const auto& gl = *gl_;
  bind_sums(gl, picture);
  gl.BindImageTexture(core::CM_IMAGE_MEANS, means->texture.name(), 0, GL_FALSE, 0, GL_WRITE_ONLY, GL_RGBA32F);
  if (means->background) {
    gl.BindImageTexture(core::CM_IMAGE_BACKGROUND_MEANS, means->background.name(), 0, GL_FALSE, 0, GL_WRITE_ONLY,
                        GL_RGBA32F);
  }
  program.use(gl);
  for (const RowRange& rows : changed_rows(means->of, wanted, picture.rows)) {
    gl.ProgramUniform2ui(program.name(), 0, rows.first, rows.end);
    gl.DispatchCompute((picture.size.x + 7) / 8, (rows.end - rows.first + 7) / 8, 1);
  }
  gl::memory_barrier(gl, GL_TEXTURE_FETCH_BARRIER_BIT);
  means->of = wanted;
  newest_ = means;
  if (gl.dispatches_in_call) {
    resolved_ = Clock::now();
    resolve_ms_ = milliseconds(resolved_ - begun);
  }
  return means;
}

const gl::Program* Compositor::color_program(const Kind& kind, const Display& display, Wait wait) {
  // In the order of the shader's list of variants, from which warm_up() makes the same keys.
  std::vector<std::string> defines{gl::macros::depth(0), gl::macros::bilinear(kind.bilinear),
                                   gl::macros::resolved(kind.resolved)};
  if (!kind.lut) defines.push_back(gl::macros::tone_map(std::to_string(curve_of(display)) + "u"));
  defines.push_back(gl::macros::encode(kind.encoding == ColorEncoding::srgb ? "true" : "false"));
  if (kind.layered) defines.push_back(gl::macros::layers(1));
  if (kind.lut) defines.push_back(gl::macros::lut(1));
  const bool serves = color_ != nullptr && color_kind_ == kind;  // color_ can be used meanwhile
  const gl::Program& wanted = program(key_of(std::move(defines)), wait, serves);
  if (wanted.usable()) {
    color_ = &wanted;
    color_kind_ = kind;
    return color_;
  }
  lags_ = true;
  return serves ? color_ : nullptr;
}

void Compositor::draw_depth(const PictureTextures& picture, const FrameTarget& target) {
  const auto& gl = *gl_;
  const gl::Program& program = Compositor::program(key_of({gl::macros::depth(1)}), target.wait, false);
  if (!program.usable()) {
    lags_ = true;
    return;
  }
  const GLuint depth = program.name();
  const glm::ivec4 viewport = target.viewport;
  gl.BindTextureUnit(core::CM_UNIT_VOLUME_Z, picture.volume_z);
  gl.ProgramUniform4i(depth, 0, viewport.x, viewport.y, viewport.z, viewport.w);
  gl.ProgramUniform1i(depth, 1, as_bool(target.flip_y));
  gl.ProgramUniform2f(depth, 2, static_cast<GLfloat>(target.depth_a), static_cast<GLfloat>(target.depth_b));
  gl.ProgramUniform1i(depth, 3, as_bool(target.orthographic));
  gl.ColorMaski(0, GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
  gl.Enable(GL_DEPTH_TEST);
  gl.DepthFunc(target.reversed ? GL_GEQUAL : GL_LEQUAL);
  gl.DepthMask(GL_TRUE);
  program.use(gl);
  gl.DrawArrays(GL_TRIANGLES, 0, 3);
  gl.Disable(GL_DEPTH_TEST);
  gl.DepthMask(GL_FALSE);
  gl.ColorMaski(0, GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
}

void Compositor::aim(const FrameTarget& target, const Display& display) const {
  const auto& gl = *gl_;
  const glm::vec4 viewport(target.viewport);
  gl.BindFramebuffer(GL_DRAW_FRAMEBUFFER, target.framebuffer);
  gl.ViewportIndexedf(0, viewport.x, viewport.y, viewport.z, viewport.w);
  if (target.is_hidden) {
    gl.Enablei(GL_SCISSOR_TEST, 0);
    gl.ScissorIndexed(0, 0, 0, 0, 0);
  } else if (!target.region.is_whole()) {
    const PixelBox box = target.region.pixels({target.viewport.z, target.viewport.w});
    const glm::ivec2 first(box.first);
    const glm::ivec2 size(box.size);
    const int bottom = target.flip_y ? first.y : target.viewport.w - first.y - size.y;
    gl.Enablei(GL_SCISSOR_TEST, 0);
    gl.ScissorIndexed(0, target.viewport.x + first.x, target.viewport.y + bottom, size.x, size.y);
  }
  if (display.encoding == ColorEncoding::srgb_framebuffer) {
    gl.Enable(GL_FRAMEBUFFER_SRGB);
  } else {
    gl.Disable(GL_FRAMEBUFFER_SRGB);
  }
  if (target.blend_over && display.transparent) {  // otherwise the image is opaque
    gl.Enablei(GL_BLEND, 0);
    gl.BlendEquationSeparatei(0, GL_FUNC_ADD, GL_FUNC_ADD);
    gl.BlendFuncSeparatei(0, GL_ONE, GL_ONE_MINUS_SRC_ALPHA, GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
  } else {
    gl.Disablei(GL_BLEND, 0);
  }
  gl.Disable(GL_DEPTH_TEST);
  gl.ColorMaski(0, GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
}

void Compositor::set_viewport(const gl::Functions& gl, const gl::Program& program, const FrameTarget& target) {
  const glm::ivec4 viewport = target.viewport;
  gl.ProgramUniform4i(program.name(), 0, viewport.x, viewport.y, viewport.z, viewport.w);
  gl.ProgramUniform1i(program.name(), 1, as_bool(target.flip_y));
}

void Compositor::bind_color(const Shown& shown, const PictureTextures& picture, const Display& display,
                            const FrameTarget& target) const {
  const auto& gl = *gl_;
  const bool resolved = shown.means != nullptr;
  gl.BindTextureUnit(core::CM_UNIT_SUM, resolved ? shown.means->texture.name() : picture.sum);
  if (!resolved) gl.BindTextureUnit(core::CM_UNIT_COUNTS, picture.counts);
  if (shown.layered || !resolved) {
    gl.BindTextureUnit(core::CM_UNIT_BACKGROUND, resolved ? shown.means->background.name() : picture.background);
  }
  const GLuint color = shown.program->name();
  set_viewport(gl, *shown.program, target);
  gl.ProgramUniform1f(color, 2, exposure_of(display));
  gl.ProgramUniform1i(color, 3, as_bool(display.transparent));
  const glm::vec3 backdrop = display.backdrop.value_or(glm::vec3(0.0F));
  gl.ProgramUniform3f(color, 4, backdrop.x, backdrop.y, backdrop.z);
  if (shown.layered || !resolved) gl.ProgramUniform1i(color, 6, as_bool(display.shows_background()));
  if (shown.lut != 0) {
    gl.BindTextureUnit(core::CM_UNIT_DISPLAY_LUT, shown.lut);
    gl.ProgramUniform1ui(color, 7, static_cast<GLuint>(display.lut->shaper));
    gl.ProgramUniform2f(color, 8, display.lut->domain.x, display.lut->domain.y);
  }
  if (shown.layered) {
    const SurfaceLayers& layers = *picture.beneath;
    gl.BindTextureUnit(core::CM_UNIT_LAYER_COLOR, layers.color.name());
    gl.BindTextureUnit(core::CM_UNIT_LAYER_Z, layers.z.name());
    if (picture.host_z != 0) gl.BindTextureUnit(core::CM_UNIT_HOST_DEPTH, picture.host_z);
    gl.ProgramUniform4i(color, 5, static_cast<GLint>(layers.layers), as_bool(layers.blended),
                        picture.host_z != 0 ? static_cast<GLint>(picture.host_layers) : 0, 0);
  }
}

void Compositor::draw_color(const Shown& shown, const PictureTextures& picture, const Display& display,
                            const FrameTarget& target) const {
  bind_color(shown, picture, display, target);
  aim(target, display);
  shown.program->use(*gl_);
  gl_->DrawArrays(GL_TRIANGLES, 0, 3);
}

void Compositor::compose(GLuint texture, const std::vector<RowRange>& rows, const Shown& shown,
                         const PictureTextures& picture, const Display& display, const FrameTarget& target) const {
  const auto& gl = *gl_;
  const glm::ivec2 size(target.viewport.z, target.viewport.w);
  const glm::uvec2 extent(size);
  const PixelBox box = target.region.is_whole() ? PixelBox{glm::uvec2(0U), extent} : target.region.pixels(extent);
  const gl::TransientFramebuffer framebuffer(gl_, texture, 0);
  FrameTarget whole;
  whole.framebuffer = framebuffer.name();
  whole.viewport = {0, 0, size};
  whole.flip_y = true;
  whole.blend_over = false;
  bind_color(shown, picture, display, whole);
  aim(whole, display);
  shown.program->use(gl);
  gl.Enablei(GL_SCISSOR_TEST, 0);
  for (const RowRange& range : rows) {
    const std::uint32_t first = std::max(range.first, box.first.y);
    const std::uint32_t end = std::min(range.end, box.first.y + box.size.y);
    if (first >= end) continue;
    gl.ScissorIndexed(0, static_cast<GLint>(box.first.x), static_cast<GLint>(first), static_cast<GLsizei>(box.size.x),
                      static_cast<GLsizei>(end - first));
    gl.DrawArrays(GL_TRIANGLES, 0, 3);
  }
  gl.Disablei(GL_SCISSOR_TEST, 0);
}

bool Compositor::draw_composed(const Shown& shown, const PictureTextures& picture, const Display& display,
                               const FrameTarget& target, const TargetFormat& format) {
  const auto& gl = *gl_;
  // The program is requested in every frame, so that it is linked when it is needed.
  const gl::Program& copy = programs_->ask({"copy.frag", {}, "composite.vert"});
  if (target.is_hidden && !copy.usable()) lags_ = true;
  // A hidden frame uses both programs, even if this driver does not keep images. One pixel is enough for that.
  const glm::ivec2 size = target.is_hidden ? glm::ivec2(1) : glm::ivec2(target.viewport.z, target.viewport.w);
  const Composed::Of of{
      shown.means->of, display, shown.program->name(), size, target.region, copy_format(format, display.encoding)};
  if (!composed_.is_kept(of, gl.dispatches_in_call || target.is_hidden) || !copy.usable()) return false;
  // llvmpipe waits for queued work before it draws into a texture that was read.
  if (gl.dispatches_in_call && !composed_.is_current(of, picture.rows) && !gl::Fence(gl_).passed()) return false;
  GLuint texture = 0;
  try {
    texture = composed_.update(of, picture.rows, [&](GLuint made, const std::vector<RowRange>& rows) {
      compose(made, rows, shown, picture, display, target);
    });
  } catch (const Error& error) {
    if (error.code() != ErrorCode::out_of_memory) throw;
    // The image is drawn directly then, which is slower.
    unreported_ = error;
  }
  if (texture == 0) return false;
  composed_rows_ = composed_.composed_rows();
  gl.BindTextureUnit(core::CM_UNIT_SUM, texture);
  set_viewport(gl, copy, target);
  aim(target, display);
  copy.use(gl);
  gl.DrawArrays(GL_TRIANGLES, 0, 3);
  return !target.is_hidden;
}

void Compositor::draw_enlarged(const gl::Program& enlarge, const Shown& shown, const PictureTextures& picture,
                               const Display& display, const FrameTarget& target) {
  const auto& gl = *gl_;
  // Without sRGB encoding, 8 bits would show banding.
  const GLenum format = display.encoding == ColorEncoding::srgb ? GL_RGBA8 : GL_RGBA32F;
  const Small kind{picture.beneath->size, format};
  const glm::ivec2 size(kind.size);
  // The error is thrown once. Pictures at rest need no enlarging.
  if (no_memory_for_small_ == kind) return;
  if (!small_ || small_kind_ != kind) {
    small_ = {};
    try {
      small_ = gl::make_texture_2d(gl_, kind.format, size.x, size.y, "creating the upscaling texture");
    } catch (const Error& error) {
      if (error.code() == ErrorCode::out_of_memory) no_memory_for_small_ = kind;
      throw;
    }
    no_memory_for_small_.reset();
    gl.TextureParameteri(small_.name(), GL_TEXTURE_MIN_FILTER, GL_LINEAR);
    gl.TextureParameteri(small_.name(), GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    gl.TextureParameteri(small_.name(), GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
    gl.TextureParameteri(small_.name(), GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
    small_kind_ = kind;
  }
  const gl::TransientFramebuffer framebuffer(gl_, small_.name(), 0);
  FrameTarget small;
  small.framebuffer = framebuffer.name();
  small.viewport = {0, 0, size};
  small.flip_y = true;
  small.blend_over = false;
  draw_color(shown, picture, display, small);
  gl.BindTextureUnit(core::CM_UNIT_SUM, small_.name());
  set_viewport(gl, enlarge, target);
  aim(target, display);
  enlarge.use(gl);
  gl.DrawArrays(GL_TRIANGLES, 0, 3);
}

std::uint64_t Compositor::bytes() const {
  std::uint64_t bytes = wavelet_.bytes() + composed_.bytes() + lut_.bytes();
  for (const auto& means : means_) {
    bytes += std::uint64_t{means->of.size.x} * means->of.size.y * (means->background ? 32 : 16);
  }
  if (small_) {
    bytes += std::uint64_t{small_kind_.size.x} * small_kind_.size.y * (small_kind_.format == GL_RGBA8 ? 4 : 16);
  }
  return bytes;
}

void Compositor::draw(const PictureTextures& picture, const Display& display, const FrameTarget& target) {
  const glm::ivec4 viewport = target.viewport;
  if (picture.sum == 0 || picture.size.x == 0 || picture.size.y == 0 || viewport.z <= 0 || viewport.w <= 0) return;
  const auto& gl = *gl_;
  const TargetFormat format = check_target(gl, target, display.encoding);
  const Background background = background_of(picture, display);
  const bool layered = background == Background::apart;
  const gl::Object vertex_array = gl::make_vertex_array(gl_);
  gl.BindVertexArray(vertex_array.name());
  Means* const means = means_to_draw(picture, background, display, target);
  const auto begun = Clock::now();
  // Without means there is either no memory for them, or their program is still compiling.
  const bool resolved = means != nullptr || lags_;
  const glm::uvec2 size = means != nullptr ? means->of.size : picture.size;
  const bool bilinear = layered || glm::ivec2(size) != glm::ivec2(viewport.z, viewport.w);
  const DisplayLutPtr lut = lut_of(display);
  const Kind kind{layered, resolved, bilinear, lut != nullptr, display.encoding};
  const gl::Program* const color = color_program(kind, display, target.wait);
  const gl::Program* enlarge = nullptr;
  if (layered && glm::ivec2(picture.beneath->size) != glm::ivec2(viewport.z, viewport.w)) {
    enlarge = &program({"enlarge.frag", {}, "composite.vert"}, target.wait, false);
    if (!enlarge->usable()) lags_ = true;
  }
  if ((resolved && means == nullptr) || color == nullptr || (enlarge != nullptr && !enlarge->usable())) return;
  composed_rows_.reset();
  if (!lut) lut_.drop();
  const Shown shown{means, color, layered, lut ? lut_.of(lut) : 0U};
  if (enlarge != nullptr) {
    draw_enlarged(*enlarge, shown, picture, display, target);
  } else {
    small_ = {};
    // The surfaces beneath a picture may change while the picture does not.
    const bool composed = means != nullptr && !layered && draw_composed(shown, picture, display, target, format);
    if (!composed) draw_color(shown, picture, display, target);
  }
  if (layered || means == nullptr) composed_.drop();
  if (target.write_depth && picture.volume_z != 0) draw_depth(picture, target);
  if (target.is_hidden || !target.region.is_whole()) gl.Disablei(GL_SCISSOR_TEST, 0);
  if (gl.dispatches_in_call) drawn_ = gl::Fence(gl_);
  const bool reads_means = resolved && composed_rows_ != 0U;
  if (reads_means && gl.dispatches_in_call) means->drawn = gl::Fence(gl_);
  draw_ms_ += 0.3 * (milliseconds(Clock::now() - begun) - draw_ms_);
  gl::check(gl, "drawing the image");
  if (const auto failure = std::exchange(unreported_, std::nullopt)) throw Error(*failure);
}

}  // namespace cumulet::render
