// Invalid names, the state of the host's objects, and default framebuffers.

#include <dlfcn.h>
#include <gtest/gtest.h>

#include <array>
#include <string>
#include <utility>
#include <vector>

#include "base/error.hpp"
#include "gl/state_guard.hpp"
#include "render/raster/host_depth.hpp"
#include "support/gl_state.hpp"
#include "support/host_depths.hpp"

namespace {

using cumulet::Error;
using cumulet::ErrorCode;
using cumulet::gl::Object;
using cumulet::gl::StateGuard;
using cumulet::render::DepthSource;
using cumulet::render::HostDepth;
using cumulet::render::HostDepthInput;
using cumulet::test::Camera;
using cumulet::test::cameras;
using cumulet::test::DepthScene;
using cumulet::test::HostDepths;
namespace gl = cumulet::gl;

TEST_P(HostDepths, InvalidNamesAreReportedAndKeepTheImage) {
  const Camera& camera = cameras[0];
  const glm::ivec4 viewport(0, 0, size);
  const DepthScene::Host host = scene_->make_host(GL_DEPTH_COMPONENT24, 0, false);
  scene_->draw_scene(camera, host.framebuffer.name(), viewport);
  const HostDepthInput good = DepthScene::input_of(camera, DepthSource::texture, host.depth.name(), viewport);
  scene_->update(good);
  const auto cause = [&](DepthSource source, GLuint name, glm::ivec4 rectangle) -> std::string {
    try {
      scene_->update(DepthScene::input_of(camera, source, name, rectangle));
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::invalid_argument);
      EXPECT_EQ(gl_->GetError(), GLenum{GL_NO_ERROR});
      return error.what();
    }
    return "";
  };
  const auto text = [](const char* kind, GLuint name, const std::string& rest) {
    return "host depth, " + std::string(kind) + " " + std::to_string(name) + ", " + rest;
  };
  const Object color = gl::make_texture_2d(gl_, GL_RGBA8, size.x, size.y, "colour");
  const Object array = gl::make_texture_2d_array(gl_, GL_DEPTH_COMPONENT24, 4, 4, 4, "array");
  const Object multisample = gl::make_texture_2d_multisample(gl_, GL_RGBA8, 4, size.x, size.y, "colour");
  const Object empty = gl::make_framebuffer(gl_);
  const Object no_depth = gl::make_framebuffer(gl_);
  gl_->NamedFramebufferTexture(no_depth.name(), GL_COLOR_ATTACHMENT0, color.name(), 0);
  const GLuint name = host.depth.name();
  const GLuint framebuffer = host.framebuffer.name();
  for (const GLuint unknown : {0U, 4711U}) {
    EXPECT_EQ(cause(DepthSource::texture, unknown, viewport), text("texture", unknown, "is not a GL_TEXTURE_2D"));
  }
  EXPECT_EQ(cause(DepthSource::texture, array.name(), viewport),
            text("texture", array.name(), "is not a GL_TEXTURE_2D"));
  EXPECT_EQ(cause(DepthSource::texture_multisample, name, viewport),
            text("texture", name, "is not a GL_TEXTURE_2D_MULTISAMPLE"));
  EXPECT_EQ(cause(DepthSource::texture, color.name(), viewport),
            text("texture", color.name(), "has neither a depth format nor GL_R32F"));
  EXPECT_EQ(cause(DepthSource::texture_multisample, multisample.name(), viewport),
            text("texture", multisample.name(), "does not have a depth format"));
  EXPECT_EQ(cause(DepthSource::framebuffer, 4711, viewport),
            text("framebuffer", 4711, "does not exist in the current context"));
  EXPECT_EQ(cause(DepthSource::framebuffer, empty.name(), viewport),
            text("framebuffer", empty.name(), "is not complete"));
  EXPECT_EQ(cause(DepthSource::framebuffer, no_depth.name(), viewport),
            text("framebuffer", no_depth.name(), "has no depth buffer"));
  const std::string small = "is 48x32 and does not contain the viewport, 48x33 at 0,0";
  EXPECT_EQ(cause(DepthSource::texture, name, {0, 0, 48, 33}), text("texture", name, small));
  EXPECT_EQ(cause(DepthSource::framebuffer, framebuffer, {0, 0, 48, 33}), text("framebuffer", framebuffer, small));
  EXPECT_NE(cause(DepthSource::texture, name, {-1, 0, 20, 20}), "");
  EXPECT_FALSE(scene_->update(good));  // the previous depth is kept
  scene_->expect_scene(camera, viewport, false, 1, 2.5e-7);
}

TEST_P(HostDepths, DoesNotModifyTheHostsFramebuffer) {
  const DepthScene::Host host = scene_->make_host(GL_DEPTH_COMPONENT32F, 0, true);
  const glm::ivec4 viewport(0, 0, size);
  scene_->draw_scene(cameras[0], host.framebuffer.name(), viewport);
  scene_->update(DepthScene::input_of(cameras[0], DepthSource::framebuffer, host.framebuffer.name(), viewport));
  HostDepth again(gl_, programs_);
  const std::vector<float> first = scene_->read();
  const StateGuard guard(*gl_);
  EXPECT_TRUE(
      again.update(DepthScene::input_of(cameras[0], DepthSource::framebuffer, host.framebuffer.name(), viewport)));
  EXPECT_FALSE(scene_->depth_->update(
      DepthScene::input_of(cameras[0], DepthSource::framebuffer, host.framebuffer.name(), viewport)));
  EXPECT_EQ(scene_->read(), first);
}

/// A context of OSMesa in main memory whose default framebuffer has a size and depth. The library stays loaded, so that
/// leak reports contain its name.
struct DefaultFramebuffer {
  void* library = dlopen("libOSMesa.so.8", RTLD_NOW);
  void* context = nullptr;
  std::vector<std::uint32_t> pixels;

  template <class Function>
  Function get(const char* name) const {
    return reinterpret_cast<Function>(dlsym(library, name));
  }
  DefaultFramebuffer(glm::ivec2 size, int depth_bits, int stencil_bits)
      : pixels(static_cast<std::size_t>(size.x * size.y)) {
    if (library == nullptr) return;
    // RGBA, depth, stencil, core profile, 4.5
    const std::array<int, 13> attributes{0x22, 0x1908, 0x30, depth_bits, 0x31, stencil_bits, 0x33, 0x34,
                                         0x36, 4,      0x37, 5,          0};
    context = get<void* (*)(const int*, void*)>("OSMesaCreateContextAttribs")(attributes.data(), nullptr);
    if (context == nullptr) return;
    get<unsigned char (*)(void*, void*, unsigned, int, int)>("OSMesaMakeCurrent")(context, pixels.data(), 0x1401,
                                                                                  size.x, size.y);
  }
  DefaultFramebuffer(const DefaultFramebuffer&) = delete;
  DefaultFramebuffer& operator=(const DefaultFramebuffer&) = delete;
  ~DefaultFramebuffer() {
    if (context != nullptr) get<void (*)(void*)>("OSMesaDestroyContext")(context);
  }
  static void* get_proc(void* user, const char* name) {
    return static_cast<DefaultFramebuffer*>(user)->get<void* (*)(const char*)>("OSMesaGetProcAddress")(name);
  }
};

TEST(DefaultFramebufferDepth, IsReadLikeAnyFramebuffer) {
  for (const auto& [depth_bits, stencil_bits] : {std::pair{24, 8}, std::pair{16, 0}, std::pair{32, 0}}) {
    SCOPED_TRACE(depth_bits);
    DefaultFramebuffer screen(DepthScene::size, depth_bits, stencil_bits);
    if (screen.context == nullptr) GTEST_SKIP() << "no such OSMesa context";
    const gl::FunctionsPtr functions = gl::load_functions(DefaultFramebuffer::get_proc, &screen);
    DepthScene scene(functions, std::make_shared<gl::Programs>(*functions, nullptr));
    const glm::ivec4 viewport(5, 3, 40, 27);
    scene.draw_scene(cameras[0], 0, viewport);
    scene.update(DepthScene::input_of(cameras[0], DepthSource::framebuffer, 0, viewport));
    scene.expect_scene(cameras[0], viewport, false, 1, depth_bits == 16 ? 1.0 / 65535.0 : 2.5e-7);
    EXPECT_EQ(functions->GetError(), GLenum{GL_NO_ERROR});
  }
}

}  // namespace
