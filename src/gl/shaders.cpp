#include <algorithm>

#include "gl/shader_sources.hpp"

namespace cumulet::gl {

namespace {

bool allows(const ShaderMacro& macro, std::string_view define) {
  const std::size_t space = define.find(' ');
  return define.substr(0, space) == macro.name && space != std::string_view::npos &&
         std::ranges::find(macro.values, define.substr(space + 1)) != macro.values.end();
}

}  // namespace

bool Shader::has_variant(std::span<const std::string> defines) const {
  return std::ranges::any_of(variants, [&](std::span<const ShaderMacro> macros) {
    return macros.size() == defines.size() && std::ranges::all_of(macros, [&](const ShaderMacro& macro) {
             return std::ranges::any_of(defines, [&](const std::string& define) { return allows(macro, define); });
           });
  });
}

std::string Shader::with(std::span<const std::string> defines) const {
  const std::size_t end = source.find('\n') + 1;  // #version must stay first
  std::string text(source.substr(0, end));
  for (const std::string& define : defines) text += "#define " + define + "\n";
  text += source.substr(end);
  return text;
}

const Shader* find_shader(std::string_view name) {
  const auto all = shaders();
  const auto found = std::ranges::find(all, name, &Shader::name);
  return found == all.end() ? nullptr : &*found;
}

std::string vertex_shader_of(std::string_view fragment_shader) {
  const std::string own = std::string(fragment_shader.substr(0, fragment_shader.find('.'))) + ".vert";
  return find_shader(own) != nullptr ? own : "composite.vert";
}

}  // namespace cumulet::gl
