#include "kernels.hpp"

#include <algorithm>
#include <map>
#include <set>
#include <span>
#include <utility>

#include "gl/shader_folder.hpp"
#include "gl/shader_sources.hpp"

namespace cumulet::gpu_cost {

namespace {

using Variant = std::map<std::string, std::string>;  // macro to value; undefined macros are missing
using Value = std::pair<std::string, std::string>;
using Pair = std::pair<Value, Value>;

std::vector<std::string> ends(const gl::ShaderMacro& macro) {
  std::vector<std::string> values(macro.values.begin(), macro.values.end());
  if (macro.range && values.size() > 2) values = {values.front(), values.back()};
  return values;
}

// The Cartesian product of the macros' values; the first macro varies slowest.
std::vector<Variant> expand(std::span<const gl::ShaderMacro> macros) {
  std::vector<Variant> variants(1);
  for (const gl::ShaderMacro& macro : macros) {
    std::vector<Variant> longer;
    for (const Variant& variant : variants) {
      for (const std::string& value : ends(macro)) {
        longer.push_back(variant);
        longer.back()[std::string(macro.name)] = value;
      }
    }
    variants = std::move(longer);
  }
  return variants;
}

std::set<Pair> pairs_of(const Variant& variant, const std::set<std::string>& names) {
  std::vector<Value> values;
  for (const std::string& name : names) {
    const auto found = variant.find(name);
    values.emplace_back(name, found == variant.end() ? std::string() : found->second);
  }
  std::set<Pair> pairs;
  for (std::size_t i = 0; i < values.size(); ++i) {
    for (std::size_t j = i; j < values.size(); ++j) pairs.emplace(values[i], values[j]);
  }
  return pairs;
}

std::vector<Variant> covering(const gl::Shader& shader) {
  std::vector<Variant> all;
  std::set<std::string> names;
  for (const std::span<const gl::ShaderMacro> macros : shader.variants) {
    for (Variant& variant : expand(macros)) all.push_back(std::move(variant));
    for (const gl::ShaderMacro& macro : macros) names.emplace(macro.name);
  }
  std::vector<std::set<Pair>> pairs;
  std::set<Pair> open;
  for (const Variant& variant : all) {
    pairs.push_back(pairs_of(variant, names));
    open.insert(pairs.back().begin(), pairs.back().end());
  }
  std::vector<bool> chosen(all.size());
  do {  // a shader without macros has one variant
    std::size_t best = 0;
    std::ptrdiff_t most = -1;
    for (std::size_t i = 0; i < all.size(); ++i) {
      const std::ptrdiff_t found =
          std::ranges::count_if(pairs[i], [&](const Pair& pair) { return open.contains(pair); });
      if (!chosen[i] && found > most) best = i, most = found;
    }
    chosen[best] = true;
    for (const Pair& pair : pairs[best]) open.erase(pair);
  } while (!open.empty());
  std::vector<Variant> result;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (chosen[i]) result.push_back(all[i]);
  }
  return result;
}

std::string source_of(const gl::Shader& shader, const std::filesystem::path& folder,
                      const std::vector<std::string>& defines) {
  if (folder.empty()) return shader.with(defines);
  const std::string text = gl::ShaderFolder(folder).source(shader.path);
  gl::Shader own = shader;
  own.source = text;
  return own.with(defines);
}

}  // namespace

std::vector<Kernel> kernels(const std::filesystem::path& folder) {
  std::vector<Kernel> all;
  for (const gl::Shader& shader : gl::shaders()) {
    if (shader.name.ends_with(".vert")) continue;  // compiled with its fragment shader
    for (const Variant& variant : covering(shader)) {
      Kernel kernel{std::string(shader.name), {}, {}, {}};
      std::vector<std::string> defines;
      for (const auto& [name, value] : variant) {
        defines.push_back(name + " " + value);
        kernel.name.append(" ").append(name, 3).append("=").append(value);
      }
      if (shader.name.ends_with(".comp")) {
        kernel.compute = source_of(shader, folder, defines);
      } else {
        kernel.fragment = source_of(shader, folder, defines);
        kernel.vertex = source_of(*gl::find_shader(gl::vertex_shader_of(shader.name)), folder, defines);
      }
      all.push_back(std::move(kernel));
    }
  }
  return all;
}

}  // namespace cumulet::gpu_cost
