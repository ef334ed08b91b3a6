#pragma once

#include <array>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <string_view>

#include "gl/objects.hpp"

namespace cumulet::test {

/// The text of glsl/NAME with its includes expanded, for shaders that tests write around it.
inline std::string glsl_file(const std::string& name) {
  constexpr std::string_view include = "#include \"";
  std::ifstream in(std::filesystem::path(CUMULET_GLSL_DIR) / name);
  if (!in) throw std::runtime_error("there is no glsl/" + name);
  std::string text;
  for (std::string line; std::getline(in, line);) {
    text += line.starts_with(include) ? glsl_file(line.substr(include.size(), line.rfind('"') - include.size())) : line;
    text += '\n';
  }
  return text;
}

/// Compiles a compute program. Throws with the driver's log.
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
