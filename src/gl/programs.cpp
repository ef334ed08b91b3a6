#include "gl/programs.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <span>
#include <string_view>
#include <utility>

#include "base/error.hpp"
#include "gl/bindings.hpp"
#include "gl/extensions.hpp"
#include "gl/shader_sources.hpp"
#include "shader_macros.hpp"

namespace cumulet::gl {

namespace {

// KHR_parallel_shader_compile; ARB_parallel_shader_compile has the same value.
constexpr GLenum completion_status = 0x91B1;

std::string text_of(const ProgramKey& key) {
  std::string all = key.name;
  for (const std::string& define : key.defines) all.append(", ").append(define);
  return all;
}

struct Stage {
  GLenum type;
  std::string name;
  std::string source;
};

std::string source_of(const ShaderFolder* folder, const std::string& name, const std::vector<std::string>& defines,
                      bool names_variants) {
  const Shader* shader = find_shader(name);
  if (shader == nullptr) throw Error(ErrorCode::internal, "no shader named " + name);
  if (names_variants && !shader->has_variant(defines)) {
    std::string all;
    for (const std::string& define : defines) all.append(all.empty() ? "" : ", ").append(define);
    throw Error(ErrorCode::internal, name + " has no variant with [" + all + "]");
  }
  if (folder == nullptr) return shader->with(defines);
  const std::string text = folder->source(shader->path);
  Shader own = *shader;
  own.source = text;
  return own.with(defines);
}

// The last stage is the one that declares the variants.
std::vector<Stage> stages_of(const ShaderFolder* folder, const ProgramKey& key) {
  if (key.vertex.empty()) return {{GL_COMPUTE_SHADER, key.name, source_of(folder, key.name, key.defines, true)}};
  return {{GL_VERTEX_SHADER, key.vertex, source_of(folder, key.vertex, key.defines, false)},
          {GL_FRAGMENT_SHADER, key.name, source_of(folder, key.name, key.defines, true)}};
}

std::string sources_of(const ShaderFolder* folder, const ProgramKey& key) {
  std::string all;
  for (const Stage& stage : stages_of(folder, key)) all += stage.source;
  return all;
}

}  // namespace

Programs::Programs(const Functions& gl, std::shared_ptr<ProgramFiles> files, std::shared_ptr<ShaderFolder> shaders)
    : gl_(copy_of(gl)),
      group_(gl_),
      parallel_(has_extension(gl, "GL_KHR_parallel_shader_compile") ||
                has_extension(gl, "GL_ARB_parallel_shader_compile")),
      shaders_(std::move(shaders)) {
  GLint formats = 0;
  gl.GetIntegerv(GL_NUM_PROGRAM_BINARY_FORMATS, &formats);
  if (formats > 0) files_ = std::move(files);
  for (const GLenum name : {GL_VENDOR, GL_RENDERER, GL_VERSION}) driver_.append(string_of(gl, name)).append(1, '\n');
  check(gl, "querying the driver's program capabilities");
}

Programs::~Programs() {
  if (!gl_->abandoned && !group_.is_current()) abandon();
}

const Program& Programs::ask(const ProgramKey& key) {
  auto& held = programs_[key];
  if (!held) held = std::make_unique<Program>();
  Program& program = *held;
  if (program.usable()) return program;
  if (program.failure_) throw Error(*program.failure_);
  if (program.state_ != Program::State::compiling) begin(key, program);
  if (program.state_ == Program::State::compiling && complete(program)) finish(key, program);
  return program;
}

const Program& Programs::get(const ProgramKey& key) {
  if (const auto found = programs_.find(key); found != programs_.end()) found->second->failure_.reset();
  ask(key);
  Program& program = *programs_.at(key);
  if (program.state_ == Program::State::compiling) finish(key, program);
  return program;
}

void Programs::try_again() {
  for (auto& [key, program] : programs_) program->failure_.reset();
}

Program::State Programs::state(const ProgramKey& key) const {
  const auto found = programs_.find(key);
  return found == programs_.end() ? Program::State::absent : found->second->state();
}

void Programs::refresh() {
  if (!shaders_ || !shaders_->changed()) return;
  for (auto& [key, program] : programs_) {
    if (std::exchange(program->failure_, std::nullopt)) revision_.advance();
    if (!program->usable()) continue;
    Program fresh;
    try {
      begin(key, fresh);
      if (fresh.state_ == Program::State::compiling) finish(key, fresh);
    } catch (const Error& error) {
      if (error.code() == ErrorCode::context_lost) throw;
      if (log_ != nullptr) log_->warning(error.what());
      continue;
    }
    program->object_ = std::move(fresh.object_);
    revision_.advance();
  }
}

Programs::Counts Programs::counts() const {
  Counts counts;
  for (const auto& [key, program] : programs_) {
    ++counts.asked;
    counts.usable += program->usable() ? 1 : 0;
    counts.ready += program->state() == Program::State::ready ? 1 : 0;
    counts.failed += program->state() == Program::State::failed ? 1 : 0;
  }
  return counts;
}

void Programs::begin(const ProgramKey& key, Program& program) {
  program.state_ = Program::State::absent;
  const std::vector<Stage> stages = stages_of(shaders_.get(), key);
  if (shaders_) {
    for (const Stage& stage : stages) log_shader(stage.name);
  }
  program.shaders_.clear();
  program.object_ = Object(gl_, Object::Kind::program, gl_->CreateProgram());
  check(*gl_, "creating a shader program");
  label(*gl_, Object::Kind::program, program.object_.name(), text_of(key));
  if (load(key, program)) {
    program.state_ = Program::State::linked;
    return;
  }
  const GLuint name = program.object_.name();
  for (const Stage& stage : stages) {
    const Object& shader = program.shaders_.emplace_back(gl_, Object::Kind::shader, gl_->CreateShader(stage.type));
    const char* pointer = stage.source.c_str();
    gl_->ShaderSource(shader.name(), 1, &pointer, nullptr);
    gl_->CompileShader(shader.name());
    gl_->AttachShader(name, shader.name());
  }
  if (files_) gl_->ProgramParameteri(name, GL_PROGRAM_BINARY_RETRIEVABLE_HINT, GL_TRUE);
  gl_->LinkProgram(name);
  program.state_ = Program::State::compiling;
}

void Programs::log_shader(const std::string& name) {
  if (log_ == nullptr || !logged_shaders_.insert(name).second) return;
  const Shader& shader = *find_shader(name);
  const bool same = shaders_->source(shader.path) == shader.source;
  log_->info("shader " + name + ": read from " + shaders_->given() +
             (same ? ", identical to the library's" : ", differs from the library's"));
}

bool Programs::load(const ProgramKey& key, Program& program) {
  if (!files_) return false;
  const auto binary = files_->find(driver_, sources_of(shaders_.get(), key));
  if (!binary) return false;
  const GLuint name = program.object_.name();
  gl_->ProgramBinary(name, binary->format, binary->bytes.data(), static_cast<GLsizei>(binary->bytes.size()));
  GLint linked = 0;
  gl_->GetProgramiv(name, GL_LINK_STATUS, &linked);
  clear_errors(*gl_);  // the driver may no longer support the format
  return linked != 0;
}

bool Programs::complete(const Program& program) const {
  if (!parallel_) return true;
  GLint done = 0;
  gl_->GetProgramiv(program.object_.name(), completion_status, &done);
  return done != 0;
}

void Programs::finish(const ProgramKey& key, Program& program) {
  const GLuint name = program.object_.name();
  GLint linked = 0;
  gl_->GetProgramiv(name, GL_LINK_STATUS, &linked);
  program.state_ = Program::State::failed;
  check(*gl_, "building a shader program");
  if (linked == 0) {
    program.failure_ = Error(ErrorCode::gl, failure(key, program));
    throw Error(*program.failure_);
  }
  for (const Object& shader : program.shaders_) gl_->DetachShader(name, shader.name());
  program.shaders_.clear();
  program.state_ = Program::State::linked;
  keep(key, program);
}

std::string Programs::failure(const ProgramKey& key, const Program& program) const {
  // Reports the first shader with a log, else the linker's log.
  std::array<char, 2048> log{};
  std::string culprit = key.vertex.empty() ? key.name : key.vertex;
  for (const Object& shader : program.shaders_) {
    GLint compiled = 0;
    gl_->GetShaderiv(shader.name(), GL_COMPILE_STATUS, &compiled);
    if (compiled != 0) continue;
    if (&shader == &program.shaders_.back()) culprit = key.name;
    gl_->GetShaderInfoLog(shader.name(), static_cast<GLsizei>(log.size()), nullptr, log.data());
    if (log[0] != '\0') break;
  }
  if (log[0] == '\0') {
    gl_->GetProgramInfoLog(program.object_.name(), static_cast<GLsizei>(log.size()), nullptr, log.data());
  }
  std::string line(log.data());
  std::ranges::replace(line, '\n', ' ');
  return "shader " + culprit + " does not build on this driver: " + line;
}

void Programs::keep(const ProgramKey& key, const Program& program) {
  if (!files_) return;
  const GLuint name = program.object_.name();
  GLint length = 0;
  gl_->GetProgramiv(name, GL_PROGRAM_BINARY_LENGTH, &length);
  ProgramFiles::Binary binary;
  binary.bytes.resize(static_cast<std::size_t>(std::max(length, 0)));
  GLsizei written = 0;
  gl_->GetProgramBinary(name, length, &written, &binary.format, binary.bytes.data());
  binary.bytes.resize(static_cast<std::size_t>(std::clamp(written, 0, length)));
  clear_errors(*gl_);  // the driver may provide no binary
  if (binary.bytes.empty()) return;
  try {
    files_->keep(driver_, sources_of(shaders_.get(), key), binary);
  } catch (const Error& error) {
    if (log_ != nullptr) log_->warning(std::string("the shader cache is disabled: ") + error.what());
    files_.reset();  // log the failure only once
  }
}

std::vector<ProgramKey> all_programs() {
  // These are more than half of all variants.
  const auto rare = [](const ShaderMacro& macro) {
    const auto is = [&](MacroName name) { return macro.name == name.text(); };
    return is(macros::groups) || is(macros::holdout) || is(macros::clip) || is(macros::motion) || is(macros::wide);
  };
  std::vector<ProgramKey> all;
  for (const Shader& shader : shaders()) {
    if (shader.name.ends_with(".vert")) continue;
    const std::string name(shader.name);
    const std::string vertex = name.ends_with(".frag") ? vertex_shader_of(name) : "";
    for (const std::span<const ShaderMacro> macros : shader.variants) {
      if (std::ranges::any_of(macros, rare)) continue;
      std::vector<ProgramKey> keys{{name, {}, vertex}};
      for (const ShaderMacro& macro : macros) {
        std::vector<ProgramKey> longer;
        for (const ProgramKey& key : keys) {
          for (const std::string_view value : macro.values.first(macro.range ? 1 : macro.values.size())) {
            longer.push_back(key);
            longer.back().defines.push_back(std::string(macro.name) + " " + std::string(value));
          }
        }
        keys = std::move(longer);
      }
      all.insert(all.end(), keys.begin(), keys.end());
    }
  }
  return all;
}

void find_out_dispatches(const FunctionsPtr& gl, Programs& programs) {
  const ReadBack seen(gl, 4, "creating a read-back buffer");
  programs.get({"sign.comp", {}}).use(*gl);
  gl->BindBufferBase(GL_SHADER_STORAGE_BUFFER, core::CM_STORAGE_SIGN, seen.name());
  gl->DispatchCompute(1, 1, 1);
  // Nothing was flushed: a value that is visible now was written within the call.
  std::uint32_t sign = 0;
  std::memcpy(&sign, seen.data(), sizeof(sign));
  gl->dispatches_in_call = sign != 0;
  check(*gl, "executing the first dispatch");
}

ProgramsPtr ProgramPool::of_current(const Functions& gl) {
  const std::scoped_lock lock(mutex_);
  std::erase_if(groups_, [](const auto& group) { return group.expired(); });
  for (const auto& group : groups_) {
    if (ProgramsPtr programs = group.lock(); programs && programs->is_current()) return programs;
  }
  auto made = std::make_shared<Programs>(gl, files_, shaders_);
  groups_.push_back(made);
  return made;
}

}  // namespace cumulet::gl
