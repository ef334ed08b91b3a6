#pragma once

#include <span>
#include <string>
#include <string_view>

namespace cumulet::gl {

/// A macro that a shader is compiled with, and the values that it may have.
struct ShaderMacro {
  std::string_view name;
  std::span<const std::string_view> values;
  bool range;  // numbers in turn: what holds for the first and the last holds for those between
};

/// A file of glsl/ with its includes resolved, embedded at build time.
struct Shader {
  std::string_view name;
  std::string_view source;
  /// All that the library builds of it, from the shader's own "variants:" lines: the macros that are defined together.
  /// One without macros where there are none.
  std::span<const std::span<const ShaderMacro>> variants;

  /// Whether these macros, each "NAME VALUE", in any order, are one of the variants.
  [[nodiscard]] bool has_variant(std::span<const std::string> defines) const;
  /// The source with these macros.
  [[nodiscard]] std::string with(std::span<const std::string> defines) const;
};

/// One for each file of glsl/ that is a stage.
std::span<const Shader> shaders();
/// Null if there is none of that name.
const Shader* find_shader(std::string_view name);
/// The vertex shader that a fragment shader goes with: of its name, else one that covers a rectangle.
std::string vertex_shader_of(std::string_view fragment_shader);

}  // namespace cumulet::gl
