#include "spirv.hpp"

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <stdexcept>

namespace cumulet::gpu_cost {

namespace {

namespace fs = std::filesystem;

// From SPIR-V 1.5, section 3: the opcodes that this file uses.
enum Op : std::uint32_t {
  op_type_image = 25,
  op_type_sampled_image = 27,
  op_type_array = 28,
  op_type_pointer = 32,
  op_constant = 43,
  op_variable = 59,
  op_decorate = 71,
};
enum Decoration : std::uint32_t { buffer_block = 3, location = 30, binding = 33 };
enum Storage : std::uint32_t { uniform_constant = 0, input = 1, uniform = 2, output = 3, storage_buffer = 12 };
constexpr std::uint32_t dim_buffer = 5;
constexpr std::uint32_t storage_image = 2;  // value of the "sampled" word of an image type

class Reflection {
 public:
  explicit Reflection(const std::vector<std::uint32_t>& words) {
    for (std::size_t i = 5; i < words.size(); i += words[i] >> 16) {
      const std::uint32_t* word = &words[i];
      switch (word[0] & 0xffffU) {
        case op_decorate:
          decorations_[word[1]][word[2]] = (word[0] >> 16) > 3 ? word[3] : 1;
          break;
        case op_type_image:
        case op_type_sampled_image:
        case op_type_array:
        case op_type_pointer:
          types_[word[1]] = word;
          break;
        case op_constant:
          constants_[word[2]] = word[3];
          break;
        case op_variable:
          variables_.push_back(word);
          break;
        default:
          break;
      }
    }
  }

  void fill(Module& module) const {
    for (const std::uint32_t* variable : variables_) {
      const std::uint32_t storage = variable[3];
      const auto decorations = decorations_.find(variable[2]);
      if (decorations == decorations_.end()) continue;
      if (const auto at = decorations->second.find(location); at != decorations->second.end()) {
        if (storage == input) module.inputs.push_back(at->second);
        if (storage == output) module.outputs.push_back(at->second);
      }
      const auto at = decorations->second.find(binding);
      if (at != decorations->second.end()) module.bindings[at->second] = descriptor(variable[1], storage);
    }
  }

 private:
  [[nodiscard]] Descriptor descriptor(std::uint32_t pointer, std::uint32_t storage) const {
    std::uint32_t type = types_.at(pointer)[3];
    std::uint32_t count = 1;
    if (is(type, op_type_array)) {
      count = constants_.at(types_.at(type)[3]);
      type = types_.at(type)[2];
    }
    if (storage == storage_buffer) return {VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, count};
    if (storage == uniform) {
      const auto found = decorations_.find(type);
      const bool storage_block = found != decorations_.end() && found->second.contains(buffer_block);
      return {storage_block ? VK_DESCRIPTOR_TYPE_STORAGE_BUFFER : VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER, count};
    }
    if (is(type, op_type_sampled_image)) {
      const std::uint32_t* image = types_.at(types_.at(type)[2]);
      return {
          image[3] == dim_buffer ? VK_DESCRIPTOR_TYPE_UNIFORM_TEXEL_BUFFER : VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER,
          count};
    }
    if (is(type, op_type_image) && types_.at(type)[7] == storage_image) {
      return {VK_DESCRIPTOR_TYPE_STORAGE_IMAGE, count};
    }
    throw std::runtime_error("a resource of a kind that tests/gpu_cost/spirv.cpp does not know");
  }
  [[nodiscard]] bool is(std::uint32_t type, Op op) const {
    const auto found = types_.find(type);
    return found != types_.end() && (found->second[0] & 0xffffU) == op;
  }

  std::map<std::uint32_t, std::map<std::uint32_t, std::uint32_t>> decorations_;
  std::map<std::uint32_t, const std::uint32_t*> types_;
  std::map<std::uint32_t, std::uint32_t> constants_;
  std::vector<const std::uint32_t*> variables_;
};

// A temporary folder, removed by the destructor.
class Folder {
 public:
  Folder() {
    std::string name = (fs::temp_directory_path() / "cumulet-gpu-cost-XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr) throw std::runtime_error("no temporary folder");
    path_ = name;
  }
  ~Folder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  [[nodiscard]] std::string file(const std::string& name) const { return (path_ / name).string(); }

 private:
  fs::path path_;
};

}  // namespace

Module compile(const std::string& source, const std::string& extension) {
  const Folder folder;
  const std::string from = folder.file("shader." + extension);
  const std::string to = folder.file("shader.spv");
  const std::string log = folder.file("log");
  std::ofstream(from) << source;
  // -R: allows uniforms outside of blocks, and gl_VertexID. OpenGL numbers units, images and both kinds of buffers
  // separately.
  const std::string command =
      std::string("'") + CUMULET_GLSLANG_VALIDATOR +
      "' -V -R --target-env vulkan1.2 --auto-map-bindings --auto-map-locations --shift-image-binding 100 "
      "--shift-UBO-binding 200 --shift-ssbo-binding 300 -o '" +
      to + "' '" + from + "' > '" + log + "' 2>&1";
  const int status = std::system(command.c_str());
  if (status != 0) {
    std::ostringstream text;
    text << std::ifstream(log).rdbuf();
    throw std::runtime_error(text.str());
  }
  Module module;
  module.words.resize(fs::file_size(to) / 4);
  std::ifstream(to, std::ios::binary)
      .read(reinterpret_cast<char*>(module.words.data()), static_cast<std::streamsize>(module.words.size() * 4));
  Reflection(module.words).fill(module);
  return module;
}

}  // namespace cumulet::gpu_cost
