#include "light/environment.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <glm/gtc/packing.hpp>
#include <numbers>
#include <utility>

#include "base/error.hpp"
#include "base/luminance.hpp"
#include "light/alias_table.hpp"

namespace cumulet::light {

namespace {

using glm::vec3;

// Above, sums and products of radiance would not be finite.
constexpr float brightest = 1e30F;

/// A colour as Environment's z and w; what is read back of it follows.
struct Packed {
  std::uint32_t z = 0;
  std::uint32_t w = 0;
};

Packed pack(const vec3& colour) {
  const float most = std::max(colour.x, std::max(colour.y, colour.z));
  if (!(most > 0.0F)) return {};
  // The largest of the three from 1 to 2, so that its half has all its digits; of the smallest floats fewer.
  const auto unit = std::max(std::bit_cast<std::uint32_t>(most) & 0x7F800000U, 0x00800000U);
  const vec3 halves = colour / std::bit_cast<float>(unit);
  return {glm::packHalf2x16({halves.x, halves.y}), glm::packHalf2x16({halves.z, 0.0F}) | unit};
}

vec3 unpack(const Packed& packed) {
  const glm::vec2 rg = glm::unpackHalf2x16(packed.z);
  const glm::vec2 b = glm::unpackHalf2x16(packed.w & 0xFFFFU);
  return vec3(rg, b.x) * std::bit_cast<float>(packed.w & 0xFFFF0000U);
}

/// radiance: of texel i; sines: the sum of all texels'.
template <class Radiance>
Harmonics project(std::uint32_t width, std::uint32_t height, double sines, const glm::dvec3& mean,
                  const Radiance& radiance) {
  // Means of radiance times w, and times products of w's components.
  std::array<glm::dvec3, 3> first{};
  std::array<glm::dvec3, 5> second{};  // xy, yz, zx, xx, yy
  std::vector<glm::dvec2> level(width);
  for (std::uint32_t x = 0; x < width; ++x) {
    const double azimuth = 2.0 * std::numbers::pi * (0.5 - (x + 0.5) / width);
    level[x] = {std::sin(azimuth), std::cos(azimuth)};
  }
  for (std::uint32_t y = 0; y < height; ++y) {
    const double down = std::numbers::pi * (y + 0.5) / height;
    for (std::uint32_t x = 0; x < width; ++x) {
      const glm::dvec3 w(std::sin(down) * level[x].x, std::cos(down), std::sin(down) * level[x].y);
      const glm::dvec3 light = std::sin(down) / sines * glm::dvec3(radiance(std::size_t{y} * width + x));
      for (int i = 0; i < 3; ++i) first[static_cast<std::size_t>(i)] += w[i] * light;
      second[0] += w.x * w.y * light;
      second[1] += w.y * w.z * light;
      second[2] += w.z * w.x * light;
      second[3] += w.x * w.x * light;
      second[4] += w.y * w.y * light;
    }
  }
  // 3 <L v> w, and 15/2 w (<L v v> - <L> / 3) w, whose last diagonal element is the others' less.
  Harmonics found{};
  for (std::size_t i = 0; i < 3; ++i) {
    found[i] = vec3(3.0 * first[i]);
    found[3 + i] = vec3(15.0 * second[i]);
  }
  for (std::size_t i = 0; i < 2; ++i) found[6 + i] = vec3(7.5 * (second[3 + i] - mean / 3.0));
  return found;
}

}  // namespace

void check_environment_size(const std::string& name, std::int64_t width, std::int64_t height) {
  const std::int64_t most = Environment::max_side;
  if (width >= 1 && height >= 1 && width <= most && height <= most) return;
  const std::string limit = width < 1 || height < 1 ? "" : "; at most " + std::to_string(most) + " a side";
  throw Error(ErrorCode::file,
              name + ": an environment of " + std::to_string(width) + "x" + std::to_string(height) + " pixels" + limit);
}

EnvironmentPtr make_environment(const EnvironmentPixels& pixels, const std::string& name) {
  check_environment_size(name, pixels.width, pixels.height);
  if (pixels.values.size() != std::size_t{pixels.width} * pixels.height) {
    throw Error(ErrorCode::file, name + ": an environment of " + std::to_string(pixels.width) + "x" +
                                     std::to_string(pixels.height) + " pixels has " +
                                     std::to_string(pixels.values.size()));
  }
  auto made = std::make_shared<Environment>();
  made->name = name;
  made->width = pixels.width;
  made->height = pixels.height;
  made->words.reserve(pixels.values.size());
  std::vector<double> weights;
  weights.reserve(pixels.values.size());
  double sines = 0.0;
  double sum = 0.0;
  for (std::uint32_t y = 0; y < pixels.height; ++y) {
    const double sine = std::sin(std::numbers::pi * (y + 0.5) / pixels.height);
    for (std::uint32_t x = 0; x < pixels.width; ++x) {
      vec3 colour = pixels.values[std::size_t{y} * pixels.width + x];
      bool good = true;
      for (int c = 0; c < 3; ++c) {
        if (colour[c] >= 0.0F && colour[c] <= brightest) continue;
        good = false;
        colour[c] = 0.0F;
      }
      if (!good) ++made->replaced;
      const Packed packed = pack(colour);
      const glm::dvec3 kept(unpack(packed));
      weights.push_back(luminance(kept) * sine);
      sum += weights.back();
      made->mean += sine * kept;
      sines += sine;
      made->words.emplace_back(Alias::certain, static_cast<std::uint32_t>(made->words.size()), packed.z, packed.w);
    }
  }
  made->mean /= sines;
  made->harmonics = project(pixels.width, pixels.height, sines, made->mean, [&](std::size_t i) {
    return unpack({made->words[i].z, made->words[i].w});
  });
  if (!(sum > 0.0)) return made;
  const double unit = 2.0 * std::numbers::pi * std::numbers::pi / static_cast<double>(weights.size());
  made->density = static_cast<float>(1.0 / (sum * unit));
  const std::vector<Alias> aliases = alias_table(std::move(weights), sum);
  for (std::size_t i = 0; i < aliases.size(); ++i) {
    made->words[i].x = aliases[i].stays;
    made->words[i].y = aliases[i].other;
  }
  return made;
}

}  // namespace cumulet::light
