#pragma once

#include <glad/gl.h>

#include <chrono>
#include <stdexcept>

namespace cumulet::test {

/// A host with GPU work of its own: a fragment shader that counts. queue() submits about the requested milliseconds of
/// it and does not wait. The constructor measures the rate.
class BusyHost {
 public:
  BusyHost(const GladGLContext& gl, double milliseconds) : gl_(gl) {
    constexpr const char* vertex =
        "#version 450\nout gl_PerVertex { vec4 gl_Position; };\n"
        "void main() { gl_Position = vec4(gl_VertexID == 1 ? 3 : -1, gl_VertexID == 2 ? 3 : -1, 0, 1); }";
    constexpr const char* fragment =
        "#version 450\nlayout(location = 0) uniform int rounds; layout(location = 0) out vec4 colour;\n"
        "void main() { float x = gl_FragCoord.x; for (int i = 0; i < rounds; ++i) x = sin(x) * 1.3 + 0.1;\n"
        "  colour = vec4(x); }";
    programs_[0] = gl_.CreateShaderProgramv(GL_VERTEX_SHADER, 1, &vertex);
    programs_[1] = gl_.CreateShaderProgramv(GL_FRAGMENT_SHADER, 1, &fragment);
    gl_.CreateProgramPipelines(1, &pipeline_);
    gl_.UseProgramStages(pipeline_, GL_VERTEX_SHADER_BIT, programs_[0]);
    gl_.UseProgramStages(pipeline_, GL_FRAGMENT_SHADER_BIT, programs_[1]);
    gl_.CreateTextures(GL_TEXTURE_2D, 1, &color_);
    gl_.TextureStorage2D(color_, 1, GL_RGBA8, side, side);
    gl_.CreateFramebuffers(1, &framebuffer_);
    gl_.NamedFramebufferTexture(framebuffer_, GL_COLOR_ATTACHMENT0, color_, 0);
    gl_.CreateVertexArrays(1, &vertices_);
    // The first draw compiles the program. The loop then draws more and more until the time is long enough to measure.
    draw(1);
    gl_.Finish();
    for (int rounds = 64;; rounds *= 4) {
      const auto start = std::chrono::steady_clock::now();
      draw(rounds);
      gl_.Finish();
      const double taken = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
      if (taken < 10.0 && rounds < (1 << 20)) continue;
      rounds_ = static_cast<int>(rounds * (milliseconds / taken));
      break;
    }
    if (gl_.GetError() != GL_NO_ERROR) throw std::runtime_error("the busy host cannot draw");
  }
  BusyHost(const BusyHost&) = delete;
  BusyHost& operator=(const BusyHost&) = delete;
  ~BusyHost() {
    gl_.DeleteVertexArrays(1, &vertices_);
    gl_.DeleteFramebuffers(1, &framebuffer_);
    gl_.DeleteTextures(1, &color_);
    gl_.DeleteProgramPipelines(1, &pipeline_);
    for (const GLuint program : programs_) gl_.DeleteProgram(program);
  }

  void queue() const { draw(rounds_); }

 private:
  static constexpr int side = 256;
  void draw(int rounds) const {
    gl_.UseProgram(0);
    gl_.BindProgramPipeline(pipeline_);
    gl_.BindVertexArray(vertices_);
    gl_.BindFramebuffer(GL_DRAW_FRAMEBUFFER, framebuffer_);
    gl_.Viewport(0, 0, side, side);
    gl_.ProgramUniform1i(programs_[1], 0, rounds);
    gl_.DrawArrays(GL_TRIANGLES, 0, 3);
    gl_.Flush();
  }

  const GladGLContext& gl_;
  GLuint programs_[2] = {};
  GLuint pipeline_ = 0;
  GLuint color_ = 0;
  GLuint framebuffer_ = 0;
  GLuint vertices_ = 0;
  int rounds_ = 1;
};

}  // namespace cumulet::test
