#include "edited_shaders.hpp"

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string>

namespace cumulet::bench {

namespace {

std::string text_of(const std::filesystem::path& path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

}  // namespace

std::filesystem::path source_folder(const char* built, const char* variable) {
  const char* given = std::getenv(variable);  // NOLINT(concurrency-mt-unsafe): nothing sets the environment
  return given == nullptr ? built : given;
}

EditedShaders::EditedShaders(std::span<const Edit> edits, std::span<const std::filesystem::path> files) {
  std::filesystem::copy(source_folder(CUMULET_GLSL_DIR, "CUMULET_BENCH_GLSL"), folder_.path(),
                        std::filesystem::copy_options::recursive);
  for (const std::filesystem::path& file : files) std::filesystem::copy(file, folder_ / file.filename().string());
  for (const Edit& edit : edits) {
    const std::filesystem::path path = folder_ / edit.file;
    std::string text = text_of(path);
    const std::string wanted = edit.text;
    const std::size_t at = text.find(wanted);
    if (at == std::string::npos || text.find(wanted, at + 1) != std::string::npos)
      throw std::runtime_error(std::string(edit.file) + ": is not once there: " + wanted);
    text.replace(at, wanted.size(), edit.instead);
    std::ofstream file(path);
    file << text;
    file.close();
    if (!file) throw std::runtime_error(path.string() + ": cannot be written");
  }
  programs_ = std::make_shared<viewer::Sharing>(nullptr, std::make_shared<gl::ShaderFolder>(folder_.path()));
}

}  // namespace cumulet::bench
