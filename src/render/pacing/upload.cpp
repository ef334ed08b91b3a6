#include "render/pacing/upload.hpp"

#include <algorithm>

namespace cumulet::render {

void Upload::add_pieces(std::size_t bytes, const std::function<void(std::size_t, std::size_t)>& copy,
                        std::size_t unit) {
  const std::size_t piece = std::max(piece_bytes / unit, std::size_t{1}) * unit;
  for (std::size_t first = 0; first < bytes; first += piece) {
    add([copy, first, count = std::min(piece, bytes - first)] { copy(first, count); });
  }
}

void Upload::add_bytes(std::function<Location()> to, const void* bytes, std::size_t size) {
  add_pieces(size, [this, to = std::move(to), from = static_cast<const std::byte*>(bytes)](std::size_t first,
                                                                                           std::size_t count) {
    const Location location = to();
    gl_->NamedBufferSubData(location.buffer, static_cast<GLintptr>(location.offset + first),
                            static_cast<GLsizeiptr>(count), from + first);
  });
}

void Upload::add_dispatches(const gl::ProgramsPtr& programs, const gl::ProgramKey& key, std::uint32_t items,
                            std::uint32_t a_step, const DispatchItems& dispatch) {
  for (std::uint32_t first = 0; first < items; first += a_step) {
    add_until([programs, key, dispatch, first, end = std::min(items, first + a_step)] {
      const gl::Program& program = programs->ask(key);
      if (!program.usable()) return false;
      dispatch(program, first, end);
      return true;
    });
  }
}

void Upload::add_image(std::function<GLuint()> texture, const Rectangle& to, const std::uint8_t* rgba) {
  const std::size_t row = std::size_t{to.size.x} * 4;
  const auto copy = [this, texture = std::move(texture), to, rgba, row](std::size_t first, std::size_t count) {
    const auto x = static_cast<GLint>(to.corner.x);
    const auto y = static_cast<GLint>(to.corner.y + first / row);
    const auto width = static_cast<GLsizei>(to.size.x);
    const auto height = static_cast<GLsizei>(count / row);
    if (to.layer) {
      gl_->TextureSubImage3D(texture(), to.level, x, y, *to.layer, width, height, 1, GL_RGBA, GL_UNSIGNED_BYTE,
                             rgba + first);
    } else {
      gl_->TextureSubImage2D(texture(), to.level, x, y, width, height, GL_RGBA, GL_UNSIGNED_BYTE, rgba + first);
    }
  };
  add_pieces(row * to.size.y, copy, row);
}

bool Upload::advance(Deadline deadline) {
  while (next_ < steps_.size()) {
    const bool made = steps_[next_]();
    gl::check(*gl_, what_);
    if (!made) break;
    ++next_;
    if (std::chrono::steady_clock::now() >= deadline) break;
  }
  return done();
}

}  // namespace cumulet::render
