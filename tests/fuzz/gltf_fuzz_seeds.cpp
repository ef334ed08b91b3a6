// Writes the seeds of gltf_fuzz into a folder.

#include "fuzz/seed_folder.hpp"
#include "support/gltf_seeds.hpp"

int main(int argc, char** argv) {
  const cumulet::test::SeedFolder folder(argc, argv);
  const auto write = [&](const std::string& name, const cumulet::test::Bytes& bytes) {
    folder.write(name, std::string(bytes.begin(), bytes.end()));
  };
  const std::pair<const char*, cumulet::test::GltfModel> models[] = {
      {"materials", cumulet::test::seed_materials()},
      {"animated", cumulet::test::seed_animated()},
      {"draco", cumulet::test::seed_draco(2)},
      {"draco_slow", cumulet::test::seed_draco(2, 0)},
      {"draco_fast", cumulet::test::seed_draco(2, 10)},
      {"meshopt", cumulet::test::seed_meshopt(2)},
      {"pointers", cumulet::test::seed_pointers()},
      {"instances", cumulet::test::seed_instances()},
      {"webp", cumulet::test::seed_webp(cumulet::test::webp(2, 2, cumulet::test::Bytes(16, 77)))},
      {"webp_lossy", cumulet::test::seed_webp(cumulet::test::webp(2, 2, cumulet::test::Bytes(16, 77), 50.0F))}};
  for (const auto& [name, model] : models) {
    write(std::string(name) + ".gltf", model.gltf());
    write(std::string(name) + ".glb", model.glb());
  }
  return 0;
}
