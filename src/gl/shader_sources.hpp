#pragma once

#include <span>
#include <string>
#include <string_view>

namespace cumulet::gl {

/// A macro of a shader, and the values that it may have.
struct ShaderMacro {
  std::string_view name;
  std::span<const std::string_view> values;
  bool range;  // consecutive numbers: a property of the first and the last holds for those between
};

/// A shader of glsl/ with its includes resolved, embedded at build time.
struct Shader {
  std::string_view name;  // of its file, without folders
  std::string_view path;  // of its file in glsl/
  std::string_view source;
  /// All variants that the library builds, from the "variants:" lines of the shader: each is a set of macros that are
  /// defined together. A shader without such lines has one variant without macros.
  std::span<const std::span<const ShaderMacro>> variants;

  /// Whether these macros, each "NAME VALUE", in any order, are one of the variants.
  [[nodiscard]] bool has_variant(std::span<const std::string> defines) const;
  /// Returns the source with these macros defined.
  [[nodiscard]] std::string with(std::span<const std::string> defines) const;
};

/// Returns one entry for each file of glsl/ that is a shader stage.
std::span<const Shader> shaders();
/// Returns null if there is no shader of that name.
const Shader* find_shader(std::string_view name);
/// Returns the vertex shader for a fragment shader: the one of the same name, else the one that covers a rectangle.
std::string vertex_shader_of(std::string_view fragment_shader);

}  // namespace cumulet::gl
