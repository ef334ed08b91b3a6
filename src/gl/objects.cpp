#include "gl/objects.hpp"

#include <array>
#include <cstring>

#include "base/error.hpp"

namespace cumulet::gl {

namespace {

Object make_texture(const FunctionsPtr& gl, GLenum target) {
  GLuint name = 0;
  gl->CreateTextures(target, 1, &name);
  return {gl, Object::Kind::texture, name};
}

// Without this check the driver only reports an invalid value.
void require_size(const Functions& gl, int width, int height, const char* what) {
  const GLint most = gl.max_texture_size;
  if (width <= most && height <= most) return;
  throw Error(ErrorCode::unsupported, std::string(what) + ": " + std::to_string(width) + "x" + std::to_string(height) +
                                          " texels are more than this driver's GL_MAX_TEXTURE_SIZE, " +
                                          std::to_string(most));
}

Object finish_texture(const FunctionsPtr& gl, Object texture, const char* what) {
  label(*gl, Object::Kind::texture, texture.name(), what);
  // No mipmaps and no filter: complete for texelFetch on every driver, in integer formats too.
  gl->TextureParameteri(texture.name(), GL_TEXTURE_MIN_FILTER, GL_NEAREST);
  gl->TextureParameteri(texture.name(), GL_TEXTURE_MAG_FILTER, GL_NEAREST);
  check(*gl, what);
  return texture;
}

}  // namespace

DebugGroup::DebugGroup(const Functions& gl, std::string_view name) : gl_(gl) {
  // A StateGuard resets the value at the start of a call. The host pushes no group within a call.
  if (!gl_.debug_group_room || (gl_.guard == nullptr && gl_.open_debug_groups == 0)) {
    GLint depth = 0;
    gl_.GetIntegerv(GL_DEBUG_GROUP_STACK_DEPTH, &depth);
    gl_.debug_group_room = gl_.max_debug_groups - depth;
  }
  pushed_ = gl_.open_debug_groups < *gl_.debug_group_room;
  if (!pushed_) return;
  ++gl_.open_debug_groups;
  gl_.PushDebugGroup(GL_DEBUG_SOURCE_THIRD_PARTY, 0, static_cast<GLsizei>(name.size()), name.data());
}

DebugGroup::~DebugGroup() {
  if (!pushed_) return;
  --gl_.open_debug_groups;
  if (!gl_.abandoned.load(std::memory_order_relaxed)) gl_.PopDebugGroup();
}

Object::~Object() {
  if (name_ == 0 || gl_->abandoned.load(std::memory_order_relaxed)) return;
  switch (kind_) {
    case Kind::buffer:
      gl_->DeleteBuffers(1, &name_);
      break;
    case Kind::texture:
      gl_->DeleteTextures(1, &name_);
      break;
    case Kind::sampler:
      gl_->DeleteSamplers(1, &name_);
      break;
    case Kind::shader:
      gl_->DeleteShader(name_);
      break;
    case Kind::program:
      gl_->DeleteProgram(name_);
      break;
    case Kind::framebuffer:
      gl_->DeleteFramebuffers(1, &name_);
      break;
    case Kind::vertex_array:
      gl_->DeleteVertexArrays(1, &name_);
      break;
  }
}

void label(const Functions& gl, Object::Kind kind, GLuint name, std::string_view what) {
  constexpr std::array<GLenum, 7> identifiers{GL_BUFFER,  GL_TEXTURE,     GL_SAMPLER,     GL_SHADER,
                                              GL_PROGRAM, GL_FRAMEBUFFER, GL_VERTEX_ARRAY};
  constexpr std::size_t longest = 255;  // accepted by every driver
  for (const std::string_view prefix : {"creating ", "the ", "a "}) {
    if (what.starts_with(prefix)) what.remove_prefix(prefix.size());
  }
  const std::string text = ("cumulet: " + std::string(what)).substr(0, longest);
  gl.ObjectLabel(identifiers.at(static_cast<std::size_t>(kind)), name, static_cast<GLsizei>(text.size()), text.c_str());
}

Fence::Fence(FunctionsPtr gl) : gl_(std::move(gl)), sync_(gl_->FenceSync(GL_SYNC_GPU_COMMANDS_COMPLETE, 0)) {
  gl_->Flush();
}

Fence::~Fence() {
  if (sync_ != nullptr && !gl_->abandoned.load(std::memory_order_relaxed)) gl_->DeleteSync(sync_);
}

// GL_SYNC_FLUSH_COMMANDS_BIT is left out: it makes Mesa's zink wait, and the fence was flushed.
bool Fence::passed() const { return sync_ == nullptr || gl_->ClientWaitSync(sync_, 0, 0) != GL_TIMEOUT_EXPIRED; }

void Fence::wait() const {
  constexpr GLuint64 long_time = 1'000'000'000;
  while (sync_ != nullptr && gl_->ClientWaitSync(sync_, GL_SYNC_FLUSH_COMMANDS_BIT, long_time) == GL_TIMEOUT_EXPIRED) {
  }
}

void Fence::order() const {
  if (sync_ != nullptr) gl_->WaitSync(sync_, 0, GL_TIMEOUT_IGNORED);
}

ReadBack::ReadBack(const FunctionsPtr& gl, std::size_t bytes, const char* what) {
  const std::vector<std::byte> zeros(bytes);
  map(gl, bytes, zeros.data(), what);
}

ReadBack ReadBack::unfilled(const FunctionsPtr& gl, std::size_t bytes, const char* what) {
  ReadBack made;
  made.map(gl, bytes, nullptr, what);
  return made;
}

void ReadBack::map(const FunctionsPtr& gl, std::size_t bytes, const void* values, const char* what) {
  constexpr GLbitfield access = GL_MAP_READ_BIT | GL_MAP_PERSISTENT_BIT | GL_MAP_COHERENT_BIT;
  buffer_ = make_buffer(gl, bytes, values, access, what);
  data_ =
      static_cast<const std::byte*>(gl->MapNamedBufferRange(buffer_.name(), 0, static_cast<GLsizeiptr>(bytes), access));
  check(*gl, what);
  if (data_ == nullptr) throw Error(ErrorCode::gl, std::string("the GL buffer cannot be mapped: ") + what);
}

void memory_barrier(const Functions& gl, GLbitfield barriers) {
  if (!gl.dispatches_in_call.load(std::memory_order_relaxed)) gl.MemoryBarrier(barriers);
}

Object make_buffer(const FunctionsPtr& gl, std::size_t bytes, const void* data, GLbitfield flags, const char* what) {
  GLuint name = 0;
  gl->CreateBuffers(1, &name);
  Object buffer(gl, Object::Kind::buffer, name);
  gl->NamedBufferStorage(name, static_cast<GLsizeiptr>(bytes), data, flags);
  label(*gl, Object::Kind::buffer, name, what);
  check(*gl, what);
  return buffer;
}

Object make_texture_buffer(const FunctionsPtr& gl, GLenum format, const Object& buffer, const char* what) {
  GLuint name = 0;
  gl->CreateTextures(GL_TEXTURE_BUFFER, 1, &name);
  Object texture(gl, Object::Kind::texture, name);
  gl->TextureBuffer(name, format, buffer.name());
  label(*gl, Object::Kind::texture, name, what);
  check(*gl, what);
  return texture;
}

Object make_texture_2d(const FunctionsPtr& gl, GLenum format, int width, int height, const char* what) {
  require_size(*gl, width, height, what);
  Object texture = make_texture(gl, GL_TEXTURE_2D);
  gl->TextureStorage2D(texture.name(), 1, format, width, height);
  return finish_texture(gl, std::move(texture), what);
}

Object make_texture_2d_array(const FunctionsPtr& gl, GLenum format, int width, int height, int layers,
                             const char* what) {
  require_size(*gl, width, height, what);
  Object texture = make_texture(gl, GL_TEXTURE_2D_ARRAY);
  gl->TextureStorage3D(texture.name(), 1, format, width, height, layers);
  return finish_texture(gl, std::move(texture), what);
}

Object make_texture_2d_multisample(const FunctionsPtr& gl, GLenum format, int samples, int width, int height,
                                   const char* what) {
  Object texture = make_texture(gl, GL_TEXTURE_2D_MULTISAMPLE);
  gl->TextureStorage2DMultisample(texture.name(), samples, format, width, height, GL_TRUE);
  label(*gl, Object::Kind::texture, texture.name(), what);
  check(*gl, what);
  return texture;
}

Object make_texture_3d(const FunctionsPtr& gl, GLenum format, int x, int y, int z, const char* what) {
  Object texture = make_texture(gl, GL_TEXTURE_3D);
  gl->TextureStorage3D(texture.name(), 1, format, x, y, z);
  return finish_texture(gl, std::move(texture), what);
}

Object make_framebuffer(const FunctionsPtr& gl) {
  GLuint name = 0;
  gl->CreateFramebuffers(1, &name);
  Object framebuffer(gl, Object::Kind::framebuffer, name);
  label(*gl, Object::Kind::framebuffer, name, "framebuffer");
  check(*gl, "creating a framebuffer");
  return framebuffer;
}

Object make_vertex_array(const FunctionsPtr& gl) {
  GLuint name = 0;
  gl->CreateVertexArrays(1, &name);
  Object vertex_array(gl, Object::Kind::vertex_array, name);
  label(*gl, Object::Kind::vertex_array, name, "vertex array");
  check(*gl, "creating a vertex array");
  return vertex_array;
}

Object make_sampler(const FunctionsPtr& gl) {
  GLuint name = 0;
  gl->CreateSamplers(1, &name);
  Object sampler(gl, Object::Kind::sampler, name);
  gl->SamplerParameteri(name, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
  gl->SamplerParameteri(name, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
  label(*gl, Object::Kind::sampler, name, "sampler");
  check(*gl, "creating a sampler");
  return sampler;
}

}  // namespace cumulet::gl
