#include "render/wavelet.hpp"

#include <algorithm>
#include <string>

#include "base/milliseconds.hpp"
#include "gl/bindings.hpp"

namespace cumulet::render {

namespace {

using Clock = std::chrono::steady_clock;

// Twice as far apart each: of 32 pixels to each side, where the picture is that large.
constexpr std::uint32_t most_levels = 5;
// Of rows, the least that is sent.
constexpr std::uint32_t least_rows = 8;
constexpr std::uint64_t bytes_a_pixel = 96;
// Locations of the shaders' uniforms.
constexpr GLint rows_at = 0;
constexpr GLint clear_at = 1;
constexpr GLint footprint_at = 2;
constexpr GLint own_at = 3;  // surfaces, or the level's stride

double slots_of(glm::uvec2 size, std::uint32_t rows) { return double(rows) * size.x / 8.0; }

gl::ProgramKey output_key(MeansBackground background) {
  return {"wavelet_output.comp", {"CM_BACKGROUND " + std::to_string(static_cast<int>(background))}};
}

}  // namespace

std::uint32_t Wavelet::levels() const {
  const std::uint32_t least = std::min(size_.x, size_.y);
  std::uint32_t count = 1;
  while (count < most_levels && (4U << count) < least) ++count;
  return count;
}

gl::ProgramKey Wavelet::key(Stage stage, const PictureTextures& picture) const {
  switch (stage) {
    case Stage::input:
      return {"wavelet_input.comp", {(of_ ? holes_ : picture.holes) ? "CM_HOLES 1" : "CM_HOLES 0"}};
    case Stage::variance:
      return {"wavelet_variance.comp", {}};
    case Stage::level:
      break;
  }
  return {"wavelet_level.comp", {}};
}

bool Wavelet::able(const PictureTextures& picture, MeansBackground background, bool wait) {
  bool usable = true;
  const auto ask = [&](const gl::ProgramKey& wanted) {
    usable = (wait ? programs_->get(wanted) : programs_->ask(wanted)).usable() && usable;
  };
  for (const Stage stage : {Stage::input, Stage::variance, Stage::level}) ask(key(stage, picture));
  ask(output_key(background));
  return usable;
}

void Wavelet::begin(const PictureTextures& picture) {
  of_.reset();
  if (size_ != picture.size) {
    free();
    const auto make = [&](GLenum format) {
      return gl::make_texture_2d(gl_, format, static_cast<int>(picture.size.x), static_cast<int>(picture.size.y),
                                 "creating the denoiser's textures, so that the picture is shown with its noise");
    };
    std::array<gl::Object, 2> front{make(GL_RGBA32F), make(GL_RGBA32F)};
    std::array<gl::Object, 2> spread{make(GL_RGBA32F), make(GL_RGBA32F)};
    guides_ = make(GL_RGBA32UI);
    behind_ = make(GL_RGBA32F);
    front_ = std::move(front);
    spread_ = std::move(spread);
    size_ = picture.size;
  }
  of_ = picture.picture;
  holes_ = picture.holes;
  stage_ = Stage::input;
  level_ = row_ = 0;
  done_ = false;
}

void Wavelet::free() {
  front_ = {};
  spread_ = {};
  guides_ = {};
  behind_ = {};
  size_ = glm::uvec2(0U);
  of_.reset();
}

std::uint64_t Wavelet::bytes() const { return std::uint64_t{size_.x} * size_.y * bytes_a_pixel; }

void Wavelet::collect() {
  while (const auto landed = flights_.land()) {
    const double ms = landed->ms.value_or(landed->at_most_ms);
    landed->what.cost->learn(landed->what.slots, landed->ms ? ms : 0.0, ms);
  }
}

std::optional<double> Wavelet::cost(Stage stage, std::uint32_t rows) const {
  return costs_.at(static_cast<std::size_t>(stage))->most(slots_of(size_, rows));
}

std::optional<double> Wavelet::left_ms(glm::uvec2 size) const {
  double sum = 0.0;
  const bool begun = of_ && size == size_;
  if (begun && done_) return 0.0;
  for (const Stage stage : {Stage::input, Stage::variance, Stage::level}) {
    if (begun && stage < stage_) continue;
    const auto ms = costs_.at(static_cast<std::size_t>(stage))->most(slots_of(size, size.y));
    if (!ms) return std::nullopt;
    sum += *ms * (stage == Stage::level ? most_levels - (begun ? level_ : 0U) : 1U);
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
    gl.ProgramUniform1f(program.name(), own_at, guides.surfaces ? 1.0F : 0.0F);
    write(core::CM_IMAGE_WAVELET_GUIDES, guides_, GL_RGBA32UI);
  } else {
    gl.BindTextureUnit(core::CM_UNIT_WAVELET_FRONT, front_[0].name());
    gl.BindTextureUnit(core::CM_UNIT_WAVELET_SPREAD, spread_[0].name());
    gl.BindTextureUnit(core::CM_UNIT_WAVELET_GUIDES, guides_.name());
    gl.ProgramUniform1f(program.name(), clear_at, guides.clear ? 1.0F : 0.0F);
    gl.ProgramUniform2f(program.name(), footprint_at, guides.footprint.x, guides.footprint.y);
    if (stage_ == Stage::level) gl.ProgramUniform1i(program.name(), own_at, 1 << level_);
  }
  if (stage_ != Stage::variance) write(core::CM_IMAGE_WAVELET_FRONT, front_[1], GL_RGBA32F);
  if (stage_ != Stage::level) write(core::CM_IMAGE_WAVELET_BEHIND, behind_, GL_RGBA32F, GL_READ_WRITE);
  write(core::CM_IMAGE_WAVELET_SPREAD, spread_[1], GL_RGBA32F);
}

void Wavelet::dispatch(const gl::Program& program, std::uint32_t rows, bool measured) {
  const auto& gl = *gl_;
  gl.ProgramUniform2i(program.name(), rows_at, static_cast<GLint>(row_), static_cast<GLint>(row_ + rows));
  Dispatched what;
  what.slots = slots_of(size_, rows);
  what.cost = costs_.at(static_cast<std::size_t>(stage_));
  what.most_ms = what.cost->most(what.slots).value_or(0.0);
  if (measured) flights_.begin(Flights::Kind::dispatch);
  gl.DispatchCompute((size_.x + 7) / 8, (rows + 7) / 8, 1);
  if (measured) flights_.end(std::move(what), 0, 0);
  row_ += rows;
  if (row_ < size_.y) return;
  gl::memory_barrier(gl, GL_TEXTURE_FETCH_BARRIER_BIT | GL_SHADER_IMAGE_ACCESS_BARRIER_BIT);
  row_ = 0;
  if (stage_ != Stage::variance) std::swap(front_[0], front_[1]);
  std::swap(spread_[0], spread_[1]);
  if (stage_ == Stage::level) {
    done_ = ++level_ == levels();
  } else {
    stage_ = stage_ == Stage::input ? Stage::variance : Stage::level;
  }
}

bool Wavelet::work(const PictureTextures& picture, Deadline deadline) {
  const gl::DebugGroup group(*gl_, "cumulet: denoise");
  collect();
  flights_.order();
  double sent_ms = 0.0;
  for (bool first = true; !done_; first = false) {
    const double left = milliseconds_until(deadline) - flights_.expected_ms() - sent_ms;
    const auto fits = [&](std::uint32_t rows) {
      const auto ms = cost(stage_, rows);
      return ms && *ms <= left;
    };
    // What nothing is known of is sent once at a time, measured.
    const bool known = cost(stage_, least_rows).has_value();
    if (!first && (known ? !fits(least_rows) : left <= 0.0 || !flights_.empty())) break;
    std::uint32_t rows = least_rows;
    while (row_ + rows < size_.y && fits(2 * rows)) rows *= 2;
    rows = std::min(rows, size_.y - row_);
    const bool measured = !flights_.full();
    if (!measured) sent_ms += cost(stage_, rows).value_or(0.0);
    const gl::Program& program = programs_->get(key(stage_, picture));
    program.use(*gl_);
    bind(picture, program);
    dispatch(program, rows, measured);
    collect();
  }
  gl::check(*gl_, "denoising the picture");
  return done_;
}

void Wavelet::give(const PictureTextures& picture, MeansBackground background, GLuint means, GLuint background_means) {
  const gl::DebugGroup group(*gl_, "cumulet: denoised means");
  const auto& gl = *gl_;
  const PictureGuides& guides = *picture.guides;
  const gl::Program& program = programs_->get(output_key(background));
  gl.BindTextureUnit(core::CM_UNIT_SUM, picture.sum);
  gl.BindTextureUnit(core::CM_UNIT_COUNTS, picture.counts);
  gl.BindTextureUnit(core::CM_UNIT_BACKGROUND, picture.background);
  gl.BindTextureUnit(core::CM_UNIT_GUIDE_ALBEDO, guides.albedo);
  gl.BindTextureUnit(core::CM_UNIT_GUIDE_NORMAL, guides.normal);
  gl.BindTextureUnit(core::CM_UNIT_GUIDE_TRANSMITTANCE, guides.transmittance);
  gl.BindTextureUnit(core::CM_UNIT_WAVELET_FRONT, front_[0].name());
  gl.BindTextureUnit(core::CM_UNIT_WAVELET_SPREAD, spread_[0].name());
  gl.BindTextureUnit(core::CM_UNIT_WAVELET_GUIDES, guides_.name());
  gl.BindImageTexture(core::CM_IMAGE_WAVELET_BEHIND, behind_.name(), 0, GL_FALSE, 0, GL_READ_ONLY, GL_RGBA32F);
  gl.BindImageTexture(core::CM_IMAGE_MEANS, means, 0, GL_FALSE, 0, GL_WRITE_ONLY, GL_RGBA32F);
  if (background == MeansBackground::apart) {
    gl.BindImageTexture(core::CM_IMAGE_BACKGROUND_MEANS, background_means, 0, GL_FALSE, 0, GL_WRITE_ONLY, GL_RGBA32F);
  }
  gl.ProgramUniform2i(program.name(), rows_at, 0, static_cast<GLint>(size_.y));
  gl.ProgramUniform1f(program.name(), clear_at, guides.clear ? 1.0F : 0.0F);
  gl.ProgramUniform1f(program.name(), own_at, guides.surfaces ? 1.0F : 0.0F);
  program.use(gl);
  gl.DispatchCompute((size_.x + 7) / 8, (size_.y + 7) / 8, 1);
  gl::memory_barrier(gl, GL_TEXTURE_FETCH_BARRIER_BIT | GL_TEXTURE_UPDATE_BARRIER_BIT);
  gl::check(gl, "writing the denoised picture");
  of_.reset();
}

}  // namespace cumulet::render
