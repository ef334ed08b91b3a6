#include "memory.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <fstream>
#include <locale>
#include <stdexcept>
#include <string>

namespace cumulet::demo {

namespace {

std::string gib(std::uint64_t bytes) {
  std::array<char, 32> text{};
  const double number = static_cast<double>(bytes) / static_cast<double>(1U << 30U);
  char* const end = std::to_chars(text.data(), text.data() + text.size(), number, std::chars_format::fixed, 1).ptr;
  return std::string(text.data(), end) + " GiB";
}

}  // namespace

PictureMemory picture_memory(const RenderOptions& options) {
  const std::uint64_t pixels = std::uint64_t{options.scene.width} * options.scene.height;
  // Accumulated per pixel: four floats and four counters. Without light between surfaces, surfaces are separate layers.
  std::uint64_t gl = 32;
  if ((!options.scene.surfaces.empty() || !options.scene.models.empty()) &&
      options.scene.surface.lighting == CUMULET_SURFACE_LIGHTING_RASTERIZED)
    gl += 24;
  // Both are read back, also for measuring the noise.
  std::uint64_t main = 32;
  if (options.format == OutputFormat::png) main += 4 + 8;  // display bytes; filtered and packed
  if (options.format == OutputFormat::pfm) main += 12;
  if (options.format == OutputFormat::exr) main += 16;  // file buffer
  main += options.aovs.size() * 2 * 4 * sizeof(float);  // read buffer and file buffer
  if (const std::uint64_t groups = options.scene.light_groups.size();
      groups > 0 && options.format == OutputFormat::exr) {
    gl += 16 * (groups + 2);
    main += 24 * groups;
  }
  if (options.cryptomatte) {
    gl += 48;
    main += std::uint64_t{3} * 48;  // read buffer, layers, and file buffer
  }
  if (!options.aovs.empty()) {
    gl += 16 + 36;
    main += 16;
  }
  return {gl * pixels, main * pixels};
}

std::optional<std::uint64_t> available_memory() {
  std::ifstream file("/proc/meminfo");
  file.imbue(std::locale::classic());
  for (std::string key; file >> key;) {
    std::uint64_t kib = 0;
    if (key == "MemAvailable:" && file >> kib) return kib * 1024;
    std::string rest;
    std::getline(file, rest);
  }
  return std::nullopt;
}

void check_memory(const RenderOptions& options, std::string_view renderer, std::optional<std::uint64_t> available) {
  const PictureMemory memory = picture_memory(options);
  const bool software = std::ranges::any_of(std::array{"llvmpipe", "softpipe", "Software"}, [&](const char* name) {
    return renderer.find(name) != std::string_view::npos;
  });
  const std::uint64_t needed = memory.main + (software ? memory.gl : 0);
  if (!available || needed <= *available) return;
  throw std::runtime_error(needs_text(options) + ": " + gib(*available) + " of main memory are available" +
                           (software ? ", and this software driver uses main memory" : ""));
}

std::string needs_text(const RenderOptions& options) {
  const PictureMemory memory = picture_memory(options);
  return "an image of " + std::to_string(options.scene.width) + "x" + std::to_string(options.scene.height) + " needs " +
         gib(memory.gl) + " of GPU memory and " + gib(memory.main) + " of main memory";
}

}  // namespace cumulet::demo
