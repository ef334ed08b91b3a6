// Unsuitable render targets return errors that name the cause. All other targets are drawn to.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <string>
#include <vector>

#include "cumulet/cumulet.h"
#include "support/backends.hpp"
#include "support/c_host.hpp"

namespace {

using cumulet::headless::Context;
using cumulet::test::make_desc;

constexpr GLsizei side = 32;

class HostTargets : public cumulet::test::BackendTest {
 protected:
  void SetUp() override {
    BackendTest::SetUp();
    if (IsSkipped()) return;
    gl_ = cumulet::test::load_gl(Context::get_proc, context_.get());
    cumulet::test::ViewerOptions options;
    options.get_proc = Context::get_proc;
    options.user = context_.get();
    viewer_ = cumulet::test::make_viewer(options);
    gl_.CreateFramebuffers(1, &framebuffer_);
  }
  void TearDown() override {
    if (viewer_) {
      EXPECT_EQ(gl_.GetError(), GLenum{GL_NO_ERROR});
    }
  }
  GLuint texture(GLenum format, GLsizei width = side, GLsizei height = side, GLsizei samples = 0) {
    GLuint name = 0;
    gl_.CreateTextures(samples > 0 ? GL_TEXTURE_2D_MULTISAMPLE : GL_TEXTURE_2D, 1, &name);
    if (samples > 0) {
      gl_.TextureStorage2DMultisample(name, samples, format, width, height, GL_TRUE);
    } else {
      gl_.TextureStorage2D(name, 1, format, width, height);
    }
    return name;
  }
  void attach(GLenum point, GLuint texture, GLint level = 0) {
    gl_.NamedFramebufferTexture(framebuffer_, point, texture, level);
  }
  GLuint renderbuffer(GLenum format, GLsizei width = side, GLsizei height = side) {
    GLuint name = 0;
    gl_.CreateRenderbuffers(1, &name);
    gl_.NamedRenderbufferStorage(name, format, width, height);
    return name;
  }
  [[nodiscard]] cumulet_frame_desc frame(cumulet_color_encoding color = CUMULET_COLOR_SRGB) const {
    auto desc = make_desc<cumulet_frame_desc>();
    desc.budget_ms = 5.0;
    desc.framebuffer = framebuffer_;
    desc.width = desc.height = side;
    desc.color = color;
    return desc;
  }
  /// The error message of a frame, "" if it is drawn.
  std::string error_of(const cumulet_frame_desc& desc) {
    const cumulet_status status = cumulet_render(viewer_.get(), &desc, nullptr);
    if (status == CUMULET_OK) return "";
    EXPECT_EQ(status, CUMULET_ERROR_INVALID_ARGUMENT);
    return cumulet_last_error(viewer_.get());
  }
  void refused(const cumulet_frame_desc& desc, const std::string& cause) {
    const std::string error = error_of(desc);
    EXPECT_NE(error.find(cause), std::string::npos) << "'" << error << "', not '" << cause << "'";
    EXPECT_EQ(error.find('\n'), std::string::npos);
    // The viewer continues with a valid target.
    EXPECT_EQ(gl_.GetError(), GLenum{GL_NO_ERROR});
  }

  GladGLContext gl_{};
  cumulet::test::ViewerPtr viewer_;
  GLuint framebuffer_ = 0;
};
CUMULET_ON_BACKENDS(HostTargets);

TEST_P(HostTargets, UnsupportedColorFormatsAreRejected) {
  for (const GLenum format : {GL_RGBA8UI, GL_RGBA32I, GL_RGBA16UI}) {
    attach(GL_COLOR_ATTACHMENT0, texture(format));
    refused(frame(), "integer color");
    attach(GL_COLOR_ATTACHMENT0, 0);
    gl_.NamedFramebufferRenderbuffer(framebuffer_, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, renderbuffer(format));
    refused(frame(), "integer color");
  }
  for (const GLenum format : {GL_R8, GL_RG16F}) {
    attach(GL_COLOR_ATTACHMENT0, texture(format));
    refused(frame(), "without green or blue");
  }
}

TEST_P(HostTargets, UnsupportedEncodingsAreRejected) {
  for (const GLenum format : {GL_RGBA8, GL_RGBA16F, GL_RGB10_A2, GL_RGBA16}) {
    attach(GL_COLOR_ATTACHMENT0, texture(format));
    refused(frame(CUMULET_COLOR_SRGB_FRAMEBUFFER), "CUMULET_COLOR_SRGB_FRAMEBUFFER");
  }
  for (const GLenum format : {GL_RGBA8, GL_SRGB8_ALPHA8, GL_RGB10_A2, GL_RGBA16}) {
    attach(GL_COLOR_ATTACHMENT0, texture(format));
    refused(frame(CUMULET_COLOR_HDR), "CUMULET_COLOR_HDR");
  }
  attach(GL_COLOR_ATTACHMENT0, texture(GL_SRGB8_ALPHA8));
  EXPECT_EQ(error_of(frame(CUMULET_COLOR_SRGB_FRAMEBUFFER)), "");
  for (const GLenum format : {GL_RGBA16F, GL_RGBA32F, GL_R11F_G11F_B10F, GL_RGB16F}) {
    attach(GL_COLOR_ATTACHMENT0, texture(format));
    if (gl_.CheckNamedFramebufferStatus(framebuffer_, GL_DRAW_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE) continue;
    EXPECT_EQ(error_of(frame(CUMULET_COLOR_HDR)), "") << format;
  }
}

TEST_P(HostTargets, MissingAttachmentsAreRejected) {
  gl_.NamedFramebufferTexture(framebuffer_, GL_DEPTH_ATTACHMENT, texture(GL_DEPTH_COMPONENT24), 0);
  refused(frame(), "color");  // depth only: Mesa reports it as complete
  gl_.NamedFramebufferDrawBuffer(framebuffer_, GL_NONE);
  refused(frame(), "GL_NONE");
  attach(GL_COLOR_ATTACHMENT0, texture(GL_RGBA8));
  refused(frame(), "GL_NONE");
  // Only draw buffer 0 is used; the second one does not count.
  const std::array<GLenum, 2> second{GL_NONE, GL_COLOR_ATTACHMENT0};
  gl_.NamedFramebufferDrawBuffers(framebuffer_, 2, second.data());
  refused(frame(), "GL_NONE");
  gl_.NamedFramebufferDrawBuffer(framebuffer_, GL_COLOR_ATTACHMENT0);
  EXPECT_EQ(error_of(frame()), "");
  auto desc = frame();
  desc.write_depth = 1;
  EXPECT_EQ(error_of(desc), "");
  attach(GL_DEPTH_ATTACHMENT, 0);
  refused(desc, "write_depth");
  EXPECT_EQ(error_of(frame()), "");
  // Depth with stencil is accepted.
  gl_.NamedFramebufferTexture(framebuffer_, GL_DEPTH_STENCIL_ATTACHMENT, texture(GL_DEPTH24_STENCIL8), 0);
  EXPECT_EQ(error_of(desc), "");
}

TEST_P(HostTargets, TooSmallTargetsAreRejected) {
  attach(GL_COLOR_ATTACHMENT0, texture(GL_RGBA8, side, side - 1));
  refused(frame(), "32 x 31 pixels, smaller than the frame of 32 x 32");
  attach(GL_COLOR_ATTACHMENT0, texture(GL_RGBA8, side + 9, side));
  EXPECT_EQ(error_of(frame()), "");
  // A mipmap level of a larger texture, and depth that is smaller than the color attachment.
  GLuint levels = 0;
  gl_.CreateTextures(GL_TEXTURE_2D, 1, &levels);
  gl_.TextureStorage2D(levels, 2, GL_RGBA8, side, side);
  attach(GL_COLOR_ATTACHMENT0, levels, 1);
  refused(frame(), "16 x 16");
  attach(GL_COLOR_ATTACHMENT0, levels, 0);
  EXPECT_EQ(error_of(frame()), "");
  attach(GL_DEPTH_ATTACHMENT, texture(GL_DEPTH_COMPONENT32F, side, side / 2));
  refused(frame(), "depth attachment of 32 x 16");
  attach(GL_DEPTH_ATTACHMENT, 0);
  attach(GL_COLOR_ATTACHMENT0, 0);
  gl_.NamedFramebufferRenderbuffer(framebuffer_, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER,
                                   renderbuffer(GL_RGBA8, side - 1, side));
  refused(frame(), "31 x 32");
}

TEST_P(HostTargets, LayeredTargetsAreRejected) {
  GLuint layers = 0;
  gl_.CreateTextures(GL_TEXTURE_2D_ARRAY, 1, &layers);
  gl_.TextureStorage3D(layers, 1, GL_RGBA8, side, side, 3);
  attach(GL_COLOR_ATTACHMENT0, layers);
  refused(frame(), "layered");
  gl_.NamedFramebufferTextureLayer(framebuffer_, GL_COLOR_ATTACHMENT0, layers, 0, 2);
  EXPECT_EQ(error_of(frame()), "");
}

TEST_P(HostTargets, FirstDrawBufferIsUsed) {
  const cumulet::test::VolumeRef volume = cumulet::test::make_ball(16, 2.0F);
  ASSERT_EQ(cumulet_set_volume(viewer_.get(), volume.get()), CUMULET_OK);
  const GLuint other = texture(GL_RGBA8);
  attach(GL_COLOR_ATTACHMENT0, texture(GL_RGBA8UI));  // this attachment is not the draw buffer
  attach(GL_COLOR_ATTACHMENT2, other);
  gl_.NamedFramebufferDrawBuffer(framebuffer_, GL_COLOR_ATTACHMENT2);
  ASSERT_EQ(error_of(frame()), "");
  cumulet::test::converge(viewer_.get(), frame());
  std::vector<std::uint8_t> bytes(std::size_t{side} * side * 4);
  gl_.GetTextureImage(other, 0, GL_RGBA, GL_UNSIGNED_BYTE, static_cast<GLsizei>(bytes.size()), bytes.data());
  EXPECT_GT(std::ranges::max(bytes), 60);
  // Multisampled attachments too.
  attach(GL_COLOR_ATTACHMENT0, 0);
  attach(GL_COLOR_ATTACHMENT2, texture(GL_RGBA8, side, side, 4));
  EXPECT_EQ(error_of(frame()), "");
}

// Errors are returned in every frame. Once the target is valid, the image is drawn.
TEST_P(HostTargets, TargetsAreCheckedInEachFrame) {
  attach(GL_COLOR_ATTACHMENT0, texture(GL_RGBA8));
  for (int i = 0; i < 2; ++i) {
    EXPECT_EQ(error_of(frame()), "");
    gl_.NamedFramebufferDrawBuffer(framebuffer_, GL_NONE);
    refused(frame(), "GL_NONE");
    refused(frame(), "GL_NONE");
    gl_.NamedFramebufferDrawBuffer(framebuffer_, GL_COLOR_ATTACHMENT0);
  }
}

TEST_P(HostTargets, ViewerOwnedTargetsMatchTheirEncoding) {
  struct Case {
    cumulet_color_encoding color;
    GLenum format;
    GLenum made;  // 0: an error
  };
  for (const Case& c :
       {Case{CUMULET_COLOR_SRGB, 0, GL_RGBA8}, Case{CUMULET_COLOR_LINEAR, 0, GL_RGBA8},
        Case{CUMULET_COLOR_SRGB_FRAMEBUFFER, 0, GL_SRGB8_ALPHA8}, Case{CUMULET_COLOR_HDR, 0, GL_RGBA16F},
        Case{CUMULET_COLOR_HDR, GL_RGBA32F, GL_RGBA32F}, Case{CUMULET_COLOR_HDR, GL_RGBA8, 0},
        Case{CUMULET_COLOR_HDR, GL_SRGB8_ALPHA8, 0}, Case{CUMULET_COLOR_SRGB_FRAMEBUFFER, GL_RGBA8, 0},
        Case{CUMULET_COLOR_SRGB_FRAMEBUFFER, GL_RGBA16F, 0}}) {
    auto desc = frame(c.color);
    desc.target = CUMULET_TARGET_TEXTURE;
    desc.format = c.format;
    if (c.made == 0) {
      refused(desc, "cumulet_frame_desc.format");
      continue;
    }
    auto result = make_desc<cumulet_frame_result>();
    ASSERT_EQ(cumulet_render(viewer_.get(), &desc, &result), CUMULET_OK) << cumulet_last_error(viewer_.get());
    GLint made = 0;
    gl_.GetTextureLevelParameteriv(result.texture, 0, GL_TEXTURE_INTERNAL_FORMAT, &made);
    EXPECT_EQ(static_cast<GLenum>(made), c.made);
  }
}

}  // namespace
