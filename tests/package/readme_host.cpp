// A host for the README's C example, which is compiled unchanged: a framebuffer in a headless context. Usage:
// readme_host VOLUME. Status 0: the volume was displayed.
#include <glad/gl.h>

#include <cstdint>
#include <cstdio>
#include <exception>
#include <vector>

#include "cumulet/cumulet.h"
#include "headless.hpp"

extern "C" {
cumulet_viewer* panel_open(cumulet_get_proc_fn get_proc, void* user, const char* path);
uint32_t panel_draw(cumulet_viewer* viewer, uint32_t framebuffer, uint32_t width, uint32_t height);
}

namespace {

int run(const char* volume) {
  using cumulet::headless::Context;
  Context context = Context::create(cumulet::headless::Backend::automatic);
  GladGLContext gl{};
  const auto load = [](void* user, const char* name) {
    return reinterpret_cast<GLADapiproc>(Context::get_proc(user, name));
  };
  if (gladLoadGLContextUserPtr(&gl, load, &context) == 0) throw std::runtime_error("no OpenGL functions");

  constexpr GLsizei width = 80;
  constexpr GLsizei height = 60;
  GLuint color = 0;
  GLuint framebuffer = 0;
  gl.GenRenderbuffers(1, &color);
  gl.BindRenderbuffer(GL_RENDERBUFFER, color);
  gl.RenderbufferStorage(GL_RENDERBUFFER, GL_RGBA8, width, height);
  gl.GenFramebuffers(1, &framebuffer);
  gl.BindFramebuffer(GL_FRAMEBUFFER, framebuffer);
  gl.FramebufferRenderbuffer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, color);

  cumulet_viewer* viewer = panel_open(Context::get_proc, &context, volume);
  if (viewer == nullptr) return 1;
  uint32_t flags = 0;
  do {
    flags = panel_draw(viewer, framebuffer, width, height);
  } while ((flags & (CUMULET_RENDER_INCOMPLETE | CUMULET_RENDER_LOADING)) != 0);
  std::vector<std::uint8_t> pixels(std::size_t{width} * height * 4);
  gl.ReadPixels(0, 0, width, height, GL_RGBA, GL_UNSIGNED_BYTE, pixels.data());
  cumulet_destroy(viewer);

  const std::size_t middle = (std::size_t{height} / 2 * width + width / 2) * 4;
  std::printf("flags %u, corner %d, middle %d\n", flags, pixels[0], pixels[middle]);
  return (flags & CUMULET_RENDER_CONVERGED) != 0 && pixels[0] == 0 && pixels[middle] > 20 ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return argc == 2 ? run(argv[1]) : 2;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "readme_host: %s\n", error.what());
    return 1;
  }
}
