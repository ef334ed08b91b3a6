#include "gl/objects.hpp"

#include <array>

#include "base/error.hpp"
#include "gl/shader_sources.hpp"

namespace cumulet::gl {

Object::~Object() {
  if (name_ == 0) return;
  switch (kind_) {
    case Kind::buffer:
      gl_->DeleteBuffers(1, &name_);
      break;
    case Kind::texture:
      gl_->DeleteTextures(1, &name_);
      break;
    case Kind::program:
      gl_->DeleteProgram(name_);
      break;
  }
}

Object make_buffer(const FunctionsPtr& gl, std::size_t bytes, const void* data, GLbitfield flags, const char* what) {
  GLuint name = 0;
  gl->CreateBuffers(1, &name);
  Object buffer(gl, Object::Kind::buffer, name);
  gl->NamedBufferStorage(name, static_cast<GLsizeiptr>(bytes), data, flags);
  check(*gl, what);
  return buffer;
}

Object make_texture_buffer(const FunctionsPtr& gl, GLenum format, const Object& buffer, const char* what) {
  GLuint name = 0;
  gl->CreateTextures(GL_TEXTURE_BUFFER, 1, &name);
  Object texture(gl, Object::Kind::texture, name);
  gl->TextureBuffer(name, format, buffer.name());
  check(*gl, what);
  return texture;
}

Object make_texture_2d(const FunctionsPtr& gl, GLenum format, int width, int height, const char* what) {
  GLuint name = 0;
  gl->CreateTextures(GL_TEXTURE_2D, 1, &name);
  Object texture(gl, Object::Kind::texture, name);
  gl->TextureStorage2D(name, 1, format, width, height);
  check(*gl, what);
  return texture;
}

Object make_texture_3d(const FunctionsPtr& gl, GLenum format, int x, int y, int z, const char* what) {
  GLuint name = 0;
  gl->CreateTextures(GL_TEXTURE_3D, 1, &name);
  Object texture(gl, Object::Kind::texture, name);
  gl->TextureStorage3D(name, 1, format, x, y, z);
  // No mipmaps and no filter: complete for texelFetch on every driver.
  gl->TextureParameteri(name, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
  gl->TextureParameteri(name, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
  check(*gl, what);
  return texture;
}

Object make_compute_program(const FunctionsPtr& gl, const std::string& name, std::span<const std::string> defines) {
  const std::string_view source = shader_source(name);
  if (source.empty()) throw Error(ErrorCode::internal, "no shader named " + name);
  const std::size_t end = source.find('\n') + 1;  // #version stays first
  std::string text(source.substr(0, end));
  for (const std::string& define : defines) text += "#define " + define + "\n";
  text += source.substr(end);

  const GLuint shader = gl->CreateShader(GL_COMPUTE_SHADER);
  const char* pointer = text.c_str();
  gl->ShaderSource(shader, 1, &pointer, nullptr);
  gl->CompileShader(shader);
  Object program(gl, Object::Kind::program, gl->CreateProgram());
  gl->AttachShader(program.name(), shader);
  gl->LinkProgram(program.name());
  GLint linked = 0;
  gl->GetProgramiv(program.name(), GL_LINK_STATUS, &linked);
  std::array<char, 2048> log{};
  if (linked == 0) {
    gl->GetShaderInfoLog(shader, static_cast<GLsizei>(log.size()), nullptr, log.data());
    if (log[0] == '\0') gl->GetProgramInfoLog(program.name(), static_cast<GLsizei>(log.size()), nullptr, log.data());
  }
  gl->DeleteShader(shader);
  check(*gl, "building a shader program");
  if (linked == 0) {
    std::string line(log.data());
    for (char& c : line) c = c == '\n' ? ' ' : c;
    throw Error(ErrorCode::gl, "shader " + name + " does not build on this driver: " + line);
  }
  return program;
}

}  // namespace cumulet::gl
