#pragma once

#include <array>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string>

#include "gl/objects.hpp"

namespace cumulet::test {

/// The text of glsl/NAME, for shaders that tests write around it.
inline std::string glsl_file(const std::string& name) {
  std::ifstream in(std::string(CUMULET_GLSL_DIR) + "/" + name);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

/// A compute program of this text. Throws the driver's log.
inline gl::Object compute_program(const gl::FunctionsPtr& gl, const std::string& text) {
  const gl::Object shader(gl, gl::Object::Kind::shader, gl->CreateShader(GL_COMPUTE_SHADER));
  gl::Object program(gl, gl::Object::Kind::program, gl->CreateProgram());
  const char* pointer = text.c_str();
  gl->ShaderSource(shader.name(), 1, &pointer, nullptr);
  gl->CompileShader(shader.name());
  gl->AttachShader(program.name(), shader.name());
  gl->LinkProgram(program.name());
  GLint linked = 0;
  gl->GetProgramiv(program.name(), GL_LINK_STATUS, &linked);
  if (linked == 0) {
    std::array<char, 2048> log{};
    gl->GetShaderInfoLog(shader.name(), static_cast<GLsizei>(log.size()), nullptr, log.data());
    throw std::runtime_error(log.data());
  }
  return program;
}

}  // namespace cumulet::test
