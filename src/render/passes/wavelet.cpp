#include "render/passes/wavelet.hpp"

#include <algorithm>
#include <string>

#include "gl/bindings.hpp"
#include "render/pacing/dispatch_pacer.hpp"
#include "shader_macros.hpp"

namespace cumulet::render {

namespace {

// Each level doubles the stride of the filter: together 32 pixels to each side, if the picture is that large.
constexpr std::uint32_t max_levels = 5;
// Minimum rows per dispatch.
constexpr std::uint32_t min_rows = 8;
constexpr std::uint64_t bytes_per_pixel = 112;
// Uniform locations in the shaders.
constexpr GLint rows_at = 0;
constexpr GLint footprint_at = 2;
constexpr GLint own_at = 3;        // PictureGuides::surfaces, or the level's stride
constexpr GLint box_at = 4;        // wavelet_input.comp
constexpr GLint max_at = 3;        // wavelet_merge.comp
constexpr GLint to_before_at = 3;  // wavelet_reproject.comp
constexpr GLint moved_at = 4;
constexpr GLint orthographic_at = 5;
constexpr GLint footprint_before_at = 6;
constexpr GLint surfaces_at = 7;
constexpr GLint max_history_at = 8;
// A larger maximum would blur, because each picture is resampled from the previous one between its pixels. It would
// also hide changes.
constexpr float max_samples = 32.0F;
// A finer history is kept for this many requests before a coarser one replaces it.
constexpr std::uint64_t max_requests = 16;
constexpr std::uint64_t history_bytes_per_pixel = 32;
constexpr std::uint64_t history_light_bytes_per_pixel = 16;

std::uint64_t area(glm::uvec2 size) { return std::uint64_t{size.x} * size.y; }

// Transform of points from one view to another, in the shader's coordinates.
struct Motion {
  glm::mat3 turn{1.0F};
  glm::vec3 shift{0.0F};
};

Motion motion(const PictureView& from, const PictureView& to) {
  const glm::dmat3 back = glm::inverse(glm::dmat3(to.right, to.up, to.forward));
  return {glm::mat3(back * glm::dmat3(from.right, from.up, from.forward)), glm::vec3(back * (from.eye - to.eye))};
}

double slots_of(glm::uvec2 size, std::uint32_t rows) { return double(rows) * size.x / lanes_per_slot; }

gl::ProgramKey output_key(MeansBackground background) {
  return {"wavelet_output.comp", {gl::macros::background(background)}};
}

}  // namespace

std::uint32_t Wavelet::levels() const {
  const std::uint32_t least = std::min(size_.x, size_.y);
  std::uint32_t count = 1;
  while (count < max_levels && (4U << count) < least) ++count;
  return count;
}

gl::ProgramKey Wavelet::key(Stage stage, const PictureTextures& picture) const {
  switch (stage) {
    case Stage::input:
      return {"wavelet_input.comp", {gl::macros::holes(of_ ? holes_ : picture.holes)}};
    case Stage::reproject:
      return {"wavelet_reproject.comp", {}};
    case Stage::merge:
      return {"wavelet_merge.comp", {gl::macros::history(recalls_)}};
    case Stage::variance:
      return {"wavelet_variance.comp", {}};
    case Stage::level:
      return {"wavelet_level.comp", {}};
    case Stage::blend:
      break;
  }
  return {"wavelet_blend.comp", {}};
}

bool Wavelet::able(const PictureTextures& picture, MeansBackground background, bool wait) {
  bool usable = true;
  const auto ask = [&](const gl::ProgramKey& wanted) {
    usable = (wait ? programs_->get(wanted) : programs_->ask(wanted)).usable() && usable;
  };
  for (const Stage stage : {Stage::input, Stage::variance, Stage::level, Stage::blend}) ask(key(stage, picture));
  if (picture.view) {
    ask(key(Stage::reproject, picture));
    for (const bool recalls : {false, true}) ask({"wavelet_merge.comp", {gl::macros::history(recalls)}});
  }
  ask(output_key(background));
  return usable;
}

bool Wavelet::has(Stage stage) const {
  if (stage == Stage::reproject) return recalls_;
  return stage != Stage::merge || keeps_;
}

void Wavelet::forget() {
  before_ = {};
  kept_ = {};
  history_light_ = {};
  keeps_ = recalls_ = false;
}

void Wavelet::make_history(glm::uvec2 size) {
  const auto make = [&](const char* what) {
    return gl::make_texture_2d(gl_, GL_RGBA32UI, static_cast<int>(size.x), static_cast<int>(size.y), what);
  };
  constexpr const char* doing = "creating the denoiser's history; denoising continues without it";
  if (kept_.size != size) {
    kept_ = {};
    kept_.light = make(doing);
    kept_.guides = make(doing);
    kept_.size = size;
  }
  if (!history_light_) history_light_ = make(doing);
}

void Wavelet::remember(const PictureTextures& picture) {
  const PictureView& view = *picture.view;
  if (kept_.filled && kept_.picture != picture.picture) {
    const bool coarser = before_.filled && area(kept_.size) < area(before_.size);
    const bool lasts = before_.view.scene == view.scene && picture.request - before_.request <= max_requests;
    if (!coarser || !lasts) std::swap(before_, kept_);
    kept_.filled = false;
  }
  make_history(picture.size);
  kept_.picture = picture.picture;
  kept_.request = picture.request;
  kept_.view = view;
  kept_.surfaces = picture.guides->surfaces;
  kept_.footprint = picture.guides->footprint;
  keeps_ = true;
  recalls_ = before_.filled && before_.view.scene == view.scene && before_.surfaces == kept_.surfaces;
}

std::optional<Error> Wavelet::begin(const PictureTextures& picture) {
  of_.reset();
  if (size_ != picture.size) {
    front_ = {};
    spread_ = {};
    guides_ = {};
    behind_ = {};
    unfiltered_ = {};
    history_light_ = {};
    size_ = glm::uvec2(0U);
    const auto make = [&](GLenum format) {
      return gl::make_texture_2d(gl_, format, static_cast<int>(picture.size.x), static_cast<int>(picture.size.y),
                                 "creating the denoiser's textures; the image is shown without denoising");
    };
    std::array<gl::Object, 2> front{make(GL_RGBA32F), make(GL_RGBA32F)};
    std::array<gl::Object, 2> spread{make(GL_RGBA32F), make(GL_RGBA32F)};
    guides_ = make(GL_RGBA32UI);
    behind_ = make(GL_RGBA32F);
    unfiltered_ = make(GL_RGBA32F);
    front_ = std::move(front);
    spread_ = std::move(spread);
    size_ = picture.size;
  }
  of_ = picture.picture;
  holes_ = picture.holes;
  stage_ = Stage::input;
  level_ = row_ = 0;
  done_ = false;
  keeps_ = recalls_ = false;
  if (!picture.view || no_memory_to_keep_ == picture.size) return std::nullopt;
  try {
    remember(picture);
  } catch (const Error& error) {
    if (error.code() != ErrorCode::out_of_memory) throw;
    forget();
    no_memory_to_keep_ = picture.size;
    return error;
  }
  return std::nullopt;
}

void Wavelet::free() {
  front_ = {};
  spread_ = {};
  guides_ = {};
  behind_ = {};
  unfiltered_ = {};
  size_ = glm::uvec2(0U);
  of_.reset();
  forget();
}

std::uint64_t Wavelet::bytes() const {
  return area(size_) * (bytes_per_pixel + (history_light_ ? history_light_bytes_per_pixel : 0U)) +
         (area(before_.size) + area(kept_.size)) * history_bytes_per_pixel;
}

void Wavelet::collect() {
  while (const auto completed = dispatches_in_flight_.take_completed()) {
    const double ms = completed->ms.value_or(completed->at_most_ms);
    completed->what.cost->learn(completed->what.slots, completed->ms ? ms : 0.0, ms);
  }
}

std::optional<double> Wavelet::cost(Stage stage, std::uint32_t rows) const {
  return costs_.at(static_cast<std::size_t>(stage))->most(slots_of(size_, rows));
}

std::optional<double> Wavelet::left_ms(glm::uvec2 size) const {
  double sum = 0.0;
  const bool begun = of_ && size == size_;
  if (begun && done_) return 0.0;
  for (std::size_t i = 0; i < stages; ++i) {
    const auto stage = static_cast<Stage>(i);
    if ((begun && stage < stage_) || !has(stage)) continue;
    const auto ms = costs_.at(i)->most(slots_of(size, size.y));
    if (!ms) return std::nullopt;
    sum += *ms * (stage == Stage::level ? max_levels - (begun ? level_ : 0U) : 1U);
  }
  return sum;
}

void Wavelet::bind(const PictureTextures& picture, const gl::Program& program) {
  const auto& gl = *gl_;
  const PictureGuides& guides = *picture.guides;
  const auto write = [&](GLint unit, const gl::Object& texture, GLenum format, GLenum access = GL_WRITE_ONLY) {
    gl.BindImageTexture(static_cast<GLuint>(unit), texture.name(), 0, GL_FALSE, 0, access, format);
  };
  if (stage_ == Stage::input) {
    bind_sums(gl, picture);
    gl.BindTextureUnit(core::CM_UNIT_MOMENTS, picture.moments);
    gl.BindTextureUnit(core::CM_UNIT_GUIDE_ALBEDO, guides.albedo);
    gl.BindTextureUnit(core::CM_UNIT_GUIDE_NORMAL, guides.normal);
    gl.BindTextureUnit(core::CM_UNIT_GUIDE_TRANSMITTANCE, guides.transmittance);
    gl.BindTextureUnit(core::CM_UNIT_GUIDE_SURFACE_Z, guides.surface_z);
    gl.BindTextureUnit(core::CM_UNIT_GUIDE_VOLUME_Z, guides.volume_z);
    gl.BindTextureUnit(core::CM_UNIT_GUIDE_EMISSION, guides.emission);
    gl.ProgramUniform1f(program.name(), own_at, guides.surfaces ? 1.0F : 0.0F);
    const PixelBox box = picture.box.value_or(PixelBox{glm::uvec2(0U), picture.size});
    const glm::ivec2 first(box.first);
    const glm::ivec2 end(box.first + box.size);
    gl.ProgramUniform4i(program.name(), box_at, first.x, first.y, end.x, end.y);
    write(core::CM_IMAGE_WAVELET_GUIDES, guides_, GL_RGBA32UI);
  } else {
    if (stage_ == Stage::reproject || stage_ == Stage::merge) bind_history(picture, program);
    gl.BindTextureUnit(core::CM_UNIT_WAVELET_FRONT, front_[0].name());
    gl.BindTextureUnit(core::CM_UNIT_WAVELET_SPREAD, spread_[0].name());
    gl.BindTextureUnit(core::CM_UNIT_WAVELET_GUIDES, guides_.name());
    gl.ProgramUniform2f(program.name(), footprint_at, guides.footprint.x, guides.footprint.y);
    if (stage_ == Stage::level) gl.ProgramUniform1i(program.name(), own_at, 1 << level_);
    if (stage_ == Stage::blend) gl.BindTextureUnit(core::CM_UNIT_WAVELET_UNFILTERED, unfiltered_.name());
  }
  write(core::CM_IMAGE_WAVELET_FRONT, front_[1], GL_RGBA32F);
  if (stage_ == Stage::input || stage_ == Stage::variance) {
    write(core::CM_IMAGE_WAVELET_BEHIND, behind_, GL_RGBA32F, GL_READ_WRITE);
  }
  if (stage_ == Stage::variance) write(core::CM_IMAGE_WAVELET_UNFILTERED, unfiltered_, GL_RGBA32F);
  write(core::CM_IMAGE_WAVELET_SPREAD, spread_[1], GL_RGBA32F);
}

void Wavelet::bind_history(const PictureTextures& picture, const gl::Program& program) {
  const auto& gl = *gl_;
  const auto write = [&](GLint unit, const gl::Object& texture) {
    gl.BindImageTexture(static_cast<GLuint>(unit), texture.name(), 0, GL_FALSE, 0, GL_WRITE_ONLY, GL_RGBA32UI);
  };
  gl.BindTextureUnit(core::CM_UNIT_GUIDE_ALBEDO, picture.guides->albedo);
  gl.BindTextureUnit(core::CM_UNIT_GUIDE_NORMAL, picture.guides->normal);
  if (stage_ == Stage::merge) {
    gl.BindTextureUnit(core::CM_UNIT_HISTORY_LIGHT, history_light_.name());
    write(core::CM_IMAGE_HISTORY_LIGHT, kept_.light);
    write(core::CM_IMAGE_HISTORY_GUIDES, kept_.guides);
    gl.ProgramUniform1f(program.name(), max_at, max_samples);
    return;
  }
  gl.BindTextureUnit(core::CM_UNIT_HISTORY_LIGHT, before_.light.name());
  gl.BindTextureUnit(core::CM_UNIT_HISTORY_GUIDES, before_.guides.name());
  write(core::CM_IMAGE_HISTORY_LIGHT, history_light_);
  const Motion moved = motion(kept_.view, before_.view);
  gl.ProgramUniformMatrix3fv(program.name(), to_before_at, 1, GL_FALSE, &moved.turn[0][0]);
  gl.ProgramUniform3f(program.name(), moved_at, moved.shift.x, moved.shift.y, moved.shift.z);
  gl.ProgramUniform2i(program.name(), orthographic_at, kept_.view.orthographic ? 1 : 0,
                      before_.view.orthographic ? 1 : 0);
  gl.ProgramUniform2f(program.name(), footprint_before_at, before_.footprint.x, before_.footprint.y);
  gl.ProgramUniform1f(program.name(), surfaces_at, kept_.surfaces ? 1.0F : 0.0F);
  gl.ProgramUniform1f(program.name(), max_history_at, max_samples);
}

void Wavelet::dispatch(const gl::Program& program, std::uint32_t rows, bool measured) {
  const auto& gl = *gl_;
  gl.ProgramUniform2i(program.name(), rows_at, static_cast<GLint>(row_), static_cast<GLint>(row_ + rows));
  Dispatched what;
  what.slots = slots_of(size_, rows);
  what.cost = costs_.at(static_cast<std::size_t>(stage_));
  what.max_ms = what.cost->most(what.slots).value_or(0.0);
  if (measured) dispatches_in_flight_.begin(InFlightDispatches::Kind::dispatch);
  gl.DispatchCompute((size_.x + 7) / 8, (rows + 7) / 8, 1);
  if (measured) dispatches_in_flight_.end(std::move(what), 0, 0);
  row_ += rows;
  if (row_ < size_.y) return;
  gl::memory_barrier(gl, GL_TEXTURE_FETCH_BARRIER_BIT | GL_SHADER_IMAGE_ACCESS_BARRIER_BIT);
  row_ = 0;
  if (stage_ != Stage::reproject && (stage_ != Stage::merge || recalls_)) {
    std::swap(front_[0], front_[1]);
    if (stage_ != Stage::blend) std::swap(spread_[0], spread_[1]);
  }
  if (stage_ == Stage::merge) kept_.filled = true;
  if (stage_ == Stage::blend) {
    done_ = true;
    return;
  }
  if (stage_ == Stage::level && ++level_ < levels()) return;
  do {
    stage_ = static_cast<Stage>(static_cast<unsigned>(stage_) + 1U);
  } while (!has(stage_));
}

bool Wavelet::work(const PictureTextures& picture, Deadline deadline) {
  const gl::DebugGroup group(*gl_, "cumulet: denoise");
  collect();
  dispatches_in_flight_.order();
  DispatchPacer pacer(deadline, 1.0);
  double sent_ms = 0.0;
  while (!done_) {
    const double left = pacer.left_ms(dispatches_in_flight_.expected_ms() + sent_ms);
    const auto fits = [&](std::uint32_t rows) {
      const auto ms = cost(stage_, rows);
      return ms && *ms <= left;
    };
    // A stage of unknown cost is sent once at a time and measured.
    const bool known = cost(stage_, min_rows).has_value();
    if (pacer.has_sent() && (known ? !fits(min_rows) : left <= 0.0 || !dispatches_in_flight_.empty())) break;
    std::uint32_t rows = min_rows;
    while (row_ + rows < size_.y && fits(2 * rows)) rows *= 2;
    rows = std::min(rows, size_.y - row_);
    const bool measured = !dispatches_in_flight_.full();
    if (!measured) sent_ms += cost(stage_, rows).value_or(0.0);
    const gl::Program& program = programs_->get(key(stage_, picture));
    program.use(*gl_);
    bind(picture, program);
    dispatch(program, rows, measured);
    pacer.note_sent();
    collect();
  }
  gl::check(*gl_, "denoising the image");
  return done_;
}

void Wavelet::give(const PictureTextures& picture, MeansBackground background, GLuint means, GLuint background_means) {
  const gl::DebugGroup group(*gl_, "cumulet: denoised mean");
  const auto& gl = *gl_;
  const PictureGuides& guides = *picture.guides;
  const gl::Program& program = programs_->get(output_key(background));
  gl.BindTextureUnit(core::CM_UNIT_SUM, picture.sum);
  gl.BindTextureUnit(core::CM_UNIT_COUNTS, picture.counts);
  gl.BindTextureUnit(core::CM_UNIT_BACKGROUND, picture.background);
  gl.BindTextureUnit(core::CM_UNIT_GUIDE_ALBEDO, guides.albedo);
  gl.BindTextureUnit(core::CM_UNIT_GUIDE_TRANSMITTANCE, guides.transmittance);
  gl.BindTextureUnit(core::CM_UNIT_GUIDE_VOLUME_Z, guides.volume_z);
  gl.BindTextureUnit(core::CM_UNIT_GUIDE_EMISSION, guides.emission);
  gl.BindTextureUnit(core::CM_UNIT_WAVELET_FRONT, front_[0].name());
  gl.BindTextureUnit(core::CM_UNIT_WAVELET_SPREAD, spread_[0].name());
  gl.BindTextureUnit(core::CM_UNIT_WAVELET_GUIDES, guides_.name());
  gl.BindImageTexture(core::CM_IMAGE_WAVELET_BEHIND, behind_.name(), 0, GL_FALSE, 0, GL_READ_ONLY, GL_RGBA32F);
  gl.BindImageTexture(core::CM_IMAGE_MEANS, means, 0, GL_FALSE, 0, GL_WRITE_ONLY, GL_RGBA32F);
  if (background == MeansBackground::apart) {
    gl.BindImageTexture(core::CM_IMAGE_BACKGROUND_MEANS, background_means, 0, GL_FALSE, 0, GL_WRITE_ONLY, GL_RGBA32F);
  }
  gl.ProgramUniform2i(program.name(), rows_at, 0, static_cast<GLint>(size_.y));
  gl.ProgramUniform1f(program.name(), own_at, guides.surfaces ? 1.0F : 0.0F);
  program.use(gl);
  gl.DispatchCompute((size_.x + 7) / 8, (size_.y + 7) / 8, 1);
  gl::memory_barrier(gl, GL_TEXTURE_FETCH_BARRIER_BIT | GL_TEXTURE_UPDATE_BARRIER_BIT);
  gl::check(gl, "writing the denoised image");
  of_.reset();
}

}  // namespace cumulet::render
