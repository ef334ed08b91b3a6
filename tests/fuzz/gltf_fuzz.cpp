// libFuzzer over the glTF importer: for any bytes, a scene that satisfies scene.hpp, or a one-line error. See
// README.md.

#include <cstring>
#include <string>

#include "base/error.hpp"
#include "finding.hpp"
#include "support/gltf_check.hpp"
#include "support/gltf_model.hpp"
#include "surface/gltf_import.hpp"

extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t max_size);

namespace {

using cumulet::fuzz::fail;
using cumulet::test::Bytes;

std::uint32_t word(const std::uint8_t* bytes) {
  std::uint32_t value = 0;
  std::memcpy(&value, bytes, sizeof value);
  return value;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  cumulet::surface::GltfLimits limits;
  limits.memory = std::uint64_t{64} << 20U;
  limits.unbacked = 1U << 16U;
  limits.image_side = 1024;
  try {
    const auto scene =
        cumulet::surface::import_gltf(Bytes(data, data + size), "fuzzed", "/nowhere", {}, nullptr, limits);
    std::string why = cumulet::test::broken(*scene);
    if (why.empty()) why = cumulet::test::broken(*scene, scene->pose(0.4));
    if (!why.empty()) fail(why);
  } catch (const cumulet::Error& error) {
    const std::string line = error.what();
    if (!line.starts_with("fuzzed: ") || line.find_first_of("\n\r") != std::string::npos) fail("not one line: " + line);
  }
  return 0;
}

// Mutates one of the two chunks of a .glb and updates the lengths. Otherwise almost every mutation would fail the
// container's checks.
extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t max_size,
                                               unsigned seed) {
  const bool glb = size >= 20 && std::memcmp(data, "glTF", 4) == 0 && word(data + 12) <= size - 20;
  if (!glb || seed % 16 == 0) return LLVMFuzzerMutate(data, size, max_size);
  const std::size_t text_size = word(data + 12);
  Bytes text(data + 20, data + 20 + text_size);
  Bytes binary;
  if (size >= 28 + text_size) binary.assign(data + 28 + text_size, data + size);
  Bytes& chosen = seed % 2 == 0 || binary.empty() ? text : binary;
  const std::size_t old = chosen.size();
  const std::size_t room = max_size > size + 64 ? max_size - size - 64 : 0;
  chosen.resize(old + room);
  chosen.resize(LLVMFuzzerMutate(chosen.data(), old, chosen.size()));
  const Bytes whole = cumulet::test::GltfModel::pack(std::string(text.begin(), text.end()), binary);
  if (whole.size() > max_size) return LLVMFuzzerMutate(data, size, max_size);
  std::memcpy(data, whole.data(), whole.size());
  return whole.size();
}
