// Writes the seeds of gltf_fuzz into a folder.

#include <cstdio>
#include <filesystem>
#include <fstream>

#include "support/gltf_seeds.hpp"

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fputs("usage: gltf_fuzz_seeds FOLDER\n", stderr);
    return 2;
  }
  const std::filesystem::path folder = argv[1];
  std::filesystem::create_directories(folder);
  const auto write = [&](const std::string& name, const cumulet::test::Bytes& bytes) {
    std::ofstream(folder / name, std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  };
  const std::pair<const char*, cumulet::test::GltfModel> models[] = {
      {"materials", cumulet::test::seed_materials()},   {"animated", cumulet::test::seed_animated()},
      {"draco", cumulet::test::seed_draco(2)},          {"draco_slow", cumulet::test::seed_draco(2, 0)},
      {"draco_fast", cumulet::test::seed_draco(2, 10)}, {"meshopt", cumulet::test::seed_meshopt(2)}};
  for (const auto& [name, model] : models) {
    write(std::string(name) + ".gltf", model.gltf());
    write(std::string(name) + ".glb", model.glb());
  }
  return 0;
}
