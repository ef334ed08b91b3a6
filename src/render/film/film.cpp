#include "render/film/film.hpp"

#include <algorithm>
#include <string>

#include "base/error.hpp"

namespace cumulet::render {

PixelTransfer transfer_of(const FilmLayer& layer) {
  if (layer.format == GL_RGBA32F) return {GL_RGBA, GL_FLOAT};
  if (layer.format == GL_RG32UI) return {GL_RG_INTEGER, GL_UNSIGNED_INT};
  if (layer.format == GL_RG32F) return {GL_RG, GL_FLOAT};
  return {GL_RED, GL_FLOAT};
}

void Film::begin(glm::uvec2 size) {
  if (size != size_) held_.clear();
  size_ = size;
  std::erase_if(held_, [](const Held& held) { return !held.asked; });
  for (Held& held : held_) held.written = held.asked = false;
}

const Film::Held* Film::find(const FilmLayer& layer) const {
  const auto found = std::ranges::find(held_, layer, &Held::layer);
  return found == held_.end() ? nullptr : &*found;
}

bool Film::has(const FilmLayer& layer) const {
  const Held* held = find(layer);
  return held != nullptr && held->written;
}

GLuint Film::texture(const FilmLayer& layer) const {
  const Held* held = find(layer);
  return held == nullptr ? 0 : held->texture.name();
}

void Film::make(const gl::FunctionsPtr& gl, const FilmLayer& layer) {
  if (const auto found = std::ranges::find(held_, layer, &Held::layer); found != held_.end()) {
    if (found->layer.slices == layer.slices) {
      found->asked = true;
      return;
    }
    held_.erase(found);
  }
  const std::string what = std::string("creating the image layer ") + layer.name;
  const glm::ivec2 size(size_);
  gl::Object texture = layer.slices > 0 ? gl::make_texture_2d_array(gl, layer.format, size.x, size.y,
                                                                    static_cast<int>(layer.slices), what.c_str())
                                        : gl::make_texture_2d(gl, layer.format, size.x, size.y, what.c_str());
  held_.push_back({layer, std::move(texture), false, true});
}

void Film::drop(const FilmLayer& layer) {
  std::erase_if(held_, [&](const Held& held) { return held.layer == layer; });
}

std::uint64_t Film::bytes() const {
  std::uint64_t pixel = 0;
  for (const Held& held : held_) pixel += held.layer.pixel_bytes;
  return std::uint64_t{size_.x} * size_.y * pixel;
}

void Film::bind(const gl::Functions& gl, GLuint unit, const FilmLayer& layer, GLenum access) const {
  const GLboolean all = layer.slices > 0 ? GL_TRUE : GL_FALSE;
  gl.BindImageTexture(unit, texture(layer), 0, all, 0, access, layer.format);
}

bool run(const gl::FunctionsPtr& gl, Film& film, const Pass& pass, std::chrono::steady_clock::time_point deadline) {
  const gl::DebugGroup group(*gl, pass.name);
  for (const FilmLayer& layer : pass.reads) {
    if (!film.has(layer)) {
      throw Error(ErrorCode::internal, std::string("the pass ") + pass.name + " reads the layer " + layer.name +
                                           ", which no pass has written");
    }
  }
  for (const FilmLayer& layer : pass.writes) film.make(gl, layer);
  if (!pass.work(film, deadline)) return false;
  for (Film::Held& held : film.held_) {
    if (std::ranges::find(pass.writes, held.layer) != pass.writes.end()) held.written = true;
  }
  return true;
}

}  // namespace cumulet::render
