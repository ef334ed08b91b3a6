#include "render/film/film_reader.hpp"

namespace cumulet::render {

namespace {

// At least the alignment of texel buffers on all drivers, which copy to others by waiting.
constexpr std::size_t copy_alignment = 256;

std::size_t aligned(std::size_t bytes) { return (bytes + copy_alignment - 1) / copy_alignment * copy_alignment; }

}  // namespace

FilmReader::Copied::Copied(const gl::Functions& gl, const FilmValues& values, float* to) {
  const auto& sources = values.sources();
  memory_.resize(sources.size());
  for (std::size_t i = 0; i < sources.size(); ++i) {
    auto* copy = reinterpret_cast<std::byte*>(to);
    if (to == nullptr || i != values.in_place()) {
      memory_[i].resize(values.bytes_of(sources[i]));
      copy = memory_[i].data();
    }
    copy_source(gl, values, sources[i], copy);
    copies_.push_back(copy);
  }
  gl::check(gl, "reading back the image");
}

void FilmReader::read(const FilmValues& values, float* to) const {
  const Copied copied(*gl_, values, to);
  values.make(copied.all(), to);
}

void FilmReader::read_feature(const Picture& picture, const AovValues& values_of, float* values) const {
  const std::size_t pixels = std::size_t{picture.size().x} * picture.size().y;
  const GLuint texture = picture.film().texture(values_of.layer);
  if (values_of.first == 0 && (values_of.count == 1 || values_of.count == 3)) {
    gl_->GetTextureImage(texture, 0, values_of.count == 1 ? GL_RED : GL_RGB, GL_FLOAT,
                         static_cast<GLsizei>(pixels * values_of.count * sizeof(float)), values);
    gl::check(*gl_, "reading the feature buffers");
    return;
  }
  std::vector<glm::vec4> texels(pixels);
  gl_->GetTextureImage(texture, 0, GL_RGBA, GL_FLOAT, static_cast<GLsizei>(pixels * sizeof(glm::vec4)), texels.data());
  gl::check(*gl_, "reading the feature buffers");
  for (const glm::vec4& texel : texels) {
    for (std::size_t i = 0; i < values_of.count; ++i) *values++ = texel[static_cast<int>(values_of.first + i)];
  }
}

Totals FilmReader::totals(const Picture& picture) const {
  if (!picture.film().has(film_layers::counts)) return {};
  Totals totals;
  ErrorSums sums;
  const FilmValues errors = FilmValues::errors(picture);
  const Copied copied(*gl_, errors, nullptr);
  for_each_error(copied.all(), errors.pixels(), [&](const PixelError& pixel) {
    totals.samples += pixel.samples;
    totals.steps += pixel.steps;
    if (pixel.samples < 2) return;
    sums += {pixel.squared, pixel.mean, 1.0};
  });
  totals.noise = sums.noise();
  return totals;
}

PendingRead::PendingRead(const gl::FunctionsPtr& gl, FilmValues values) : values_(std::move(values)) {
  for (const FilmValues::Source& source : values_.sources()) bytes_ += aligned(values_.bytes_of(source));
  buffer_ = gl::ReadBack::unfilled(gl, bytes_, "creating the buffer to read the image back");
  // The copies contain the writes of all dispatches before.
  gl::memory_barrier(*gl, GL_TEXTURE_UPDATE_BARRIER_BIT);
  gl->BindBuffer(GL_PIXEL_PACK_BUFFER, buffer_.name());
  std::size_t offset = 0;
  for (const FilmValues::Source& source : values_.sources()) {
    // NOLINTNEXTLINE(performance-no-int-to-ptr): so GL takes offsets
    copy_source(*gl, values_, source, reinterpret_cast<void*>(offset));
    offset += aligned(values_.bytes_of(source));
  }
  gl->BindBuffer(GL_PIXEL_PACK_BUFFER, 0);
  fence_ = gl::Fence(gl);
  gl::check(*gl, "copying the image to read it back");
}

void PendingRead::take(float* to) const {
  std::vector<const std::byte*> copies;
  const std::byte* at = buffer_.data();
  for (const FilmValues::Source& source : values_.sources()) {
    copies.push_back(at);
    at += aligned(values_.bytes_of(source));
  }
  values_.make(copies, to);
}

}  // namespace cumulet::render
