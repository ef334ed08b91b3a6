// libFuzzer over scene files: for any text, a scene that is unchanged after writing and reading it, or a one-line
// error. See README.md.

#include <cstdint>
#include <filesystem>
#include <stdexcept>
#include <string>

#include "finding.hpp"
#include "scene_file.hpp"

namespace {

using cumulet::fuzz::fail;

/// Paths are written in normal form: a//b is a/b.
cumulet::demo::SceneOptions with_normal_names(cumulet::demo::SceneOptions scene) {
  for (std::string* file : {&scene.volume, &scene.surfaces}) {
    *file = std::filesystem::path(*file).lexically_normal().string();
  }
  return scene;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string path = "/nowhere/fuzzed.json";
  const std::string text(reinterpret_cast<const char*>(data), size);
  std::string again;
  try {
    const cumulet::demo::SceneOptions scene = cumulet::demo::parse_scene(text, path);
    again = cumulet::demo::scene_text(scene, path);
    const cumulet::demo::SceneOptions read = cumulet::demo::parse_scene(again, path);
    if (!cumulet::demo::same_scene(with_normal_names(scene), with_normal_names(read))) fail("another scene:\n" + again);
  } catch (const std::runtime_error& error) {
    const std::string line = error.what();
    if (!again.empty()) fail("what was written is refused: " + line);
    if (!line.starts_with(path) || line.find_first_of("\n\r") != std::string::npos) fail("not one line: " + line);
  }
  return 0;
}
