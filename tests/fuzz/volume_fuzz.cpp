// libFuzzer over the volume importers (vdb_fuzz, nanovdb_fuzz and array_fuzz, by their seeds): for any bytes, a valid
// volume or a one-line error. See README.md.

#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <new>
#include <string>

#include "base/error.hpp"
#include "finding.hpp"
#include "volume/frame_import.hpp"
#include "volume/inspection.hpp"
#include "volume/volume.hpp"

namespace {

using cumulet::fuzz::fail;

/// Bytes in memory with a file name.
class MemoryFile {
 public:
  MemoryFile(const std::uint8_t* data, std::size_t size) : descriptor_(memfd_create("fuzzed", 0)) {
    if (descriptor_ < 0 || write(descriptor_, data, size) != static_cast<ssize_t>(size)) fail("no memory for a file");
  }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;
  ~MemoryFile() { close(descriptor_); }
  [[nodiscard]] std::string path() const { return "/proc/self/fd/" + std::to_string(descriptor_); }

 private:
  int descriptor_;
};

void check_line(const std::string& line, const std::string& path) {
  if (!line.starts_with(path) || line.find_first_of("\n\r") != std::string::npos) fail("not one line: " + line);
}

void check_volume(const cumulet::volume::ScalarVolume& volume) {
  if (volume.brick_values.size() != volume.brick_origins.size() * cumulet::volume::brick_voxels) fail("bricks");
  for (std::size_t i = 0; i < volume.brick_values.size(); ++i) {
    const float value = volume.brick_values[i];
    if (!(value >= 0.0F) || !std::isfinite(value) || value > volume.max_value) fail("a value out of its range");
  }
}

}  // namespace

// OpenVDB allocates the size that a damaged length declares. Under AddressSanitizer that ends the process. Otherwise it
// throws, as on a machine with less memory.
void* operator new(std::size_t size) {
  constexpr std::size_t most = std::size_t{1} << 30U;
  void* memory = size <= most ? std::malloc(size) : nullptr;
  if (memory == nullptr) throw std::bad_alloc();
  return memory;
}
void* operator new[](std::size_t size) { return operator new(size); }
// std::stable_sort allocates by this one. AddressSanitizer would notice its own one beside these.
void* operator new(std::size_t size, const std::nothrow_t& /*unused*/) noexcept { return std::malloc(size); }
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete[](void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete[](void* memory, std::size_t) noexcept { std::free(memory); }

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const MemoryFile file(data, size);
  const std::string path = file.path();
  try {
    check_volume(cumulet::volume::import_volume(path, "", {}));
  } catch (const cumulet::Error& error) {
    check_line(error.what(), path);
  } catch (const std::bad_alloc&) {  // thrown by operator new above
  }
  try {
    cumulet::volume::VolumeFrame frame = cumulet::volume::import_frame(path, {}, {});
    check_volume(frame.density);
    for (const auto* field : frame.beside_density()) check_volume(*field);
  } catch (const cumulet::Error& error) {
    check_line(error.what(), path);
  } catch (const std::bad_alloc&) {  // thrown by operator new above
  }
  try {
    cumulet::volume::Inspection inspection(path);
    for (std::size_t grid = 0; grid < inspection.grids().size(); ++grid) static_cast<void>(inspection.statistics(grid));
  } catch (const cumulet::Error& error) {
    check_line(error.what(), path);
  }
  return 0;
}
