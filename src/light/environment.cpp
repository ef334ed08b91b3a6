#include "light/environment.hpp"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <glm/gtc/packing.hpp>
#include <numbers>
#include <utility>

#include "base/detached_work.hpp"
#include "base/error.hpp"
#include "base/luminance.hpp"
#include "base/one_line.hpp"
#include "base/progress_part.hpp"
#include "light/alias_table.hpp"

namespace cumulet::light {

namespace {

using glm::vec3;

// Above this limit, sums and products of radiance would overflow.
constexpr float brightest = 1e30F;

/// A color as it is stored in the z and w words of Environment.
struct Packed {
  std::uint32_t z = 0;
  std::uint32_t w = 0;
};

Packed pack(const vec3& color) {
  const float most = std::max(color.x, std::max(color.y, color.z));
  if (!(most > 0.0F)) return {};
  // Scales the largest component to [1, 2), so that its half has full precision; denormal floats have less.
  const auto unit = std::max(std::bit_cast<std::uint32_t>(most) & 0x7F800000U, 0x00800000U);
  const vec3 halves = color / std::bit_cast<float>(unit);
  return {glm::packHalf2x16({halves.x, halves.y}), glm::packHalf2x16({halves.z, 0.0F}) | unit};
}

vec3 unpack(const Packed& packed) {
  const glm::vec2 rg = glm::unpackHalf2x16(packed.z);
  const glm::vec2 b = glm::unpackHalf2x16(packed.w & 0xFFFFU);
  return vec3(rg, b.x) * std::bit_cast<float>(packed.w & 0xFFFF0000U);
}

/// Contribution of a row of texels to the means over all directions: sums, weighted by the sine of the row's angle from
/// +Y.
struct RowSums {
  double weight = 0.0;  // sum of luminance x sine
  glm::dvec3 mean{0.0};
  glm::dvec3 level{0.0};  // sum of radiance times the positive cosine from +Y
  // Sums of radiance times w, and times products of w's components.
  std::array<glm::dvec3, 3> first{};
  std::array<glm::dvec3, 5> second{};  // xy, yz, zx, xx, yy
  std::uint64_t replaced = 0;

  void add(const glm::dvec3& w, const glm::dvec3& light) {
    mean += light;
    level += std::max(0.0, w.y) * light;
    for (int i = 0; i < 3; ++i) first[static_cast<std::size_t>(i)] += w[i] * light;
    second[0] += w.x * w.y * light;
    second[1] += w.y * w.z * light;
    second[2] += w.z * w.x * light;
    second[3] += w.x * w.x * light;
    second[4] += w.y * w.y * light;
  }
  void add(const RowSums& row) {
    weight += row.weight;
    mean += row.mean;
    level += row.level;
    for (std::size_t i = 0; i < first.size(); ++i) first[i] += row.first[i];
    for (std::size_t i = 0; i < second.size(); ++i) second[i] += row.second[i];
    replaced += row.replaced;
  }
  /// Returns 3 <L v> w, and 15/2 w (<L v v> - <L> / 3) w. The last diagonal element is minus the sum of the others.
  /// sines: sum over all texels.
  [[nodiscard]] Harmonics harmonics(double sines) const {
    Harmonics found{};
    for (std::size_t i = 0; i < 3; ++i) {
      found[i] = vec3(3.0 / sines * first[i]);
      found[3 + i] = vec3(15.0 / sines * second[i]);
    }
    for (std::size_t i = 0; i < 2; ++i) found[6 + i] = vec3(7.5 / sines * (second[3 + i] - mean / 3.0));
    return found;
  }
};

/// Makes the texels of a row, without aliases yet, and their sampling weights.
class RowMaker {
 public:
  RowMaker(const EnvironmentPixels& pixels, std::vector<glm::uvec4>& words, std::vector<double>& weights)
      : pixels_(pixels), words_(words), weights_(weights) {
    for (std::uint32_t x = 0; x < pixels.width; ++x) {
      const double azimuth = 2.0 * std::numbers::pi * (0.5 - (x + 0.5) / pixels.width);
      level_.emplace_back(std::sin(azimuth), std::cos(azimuth));
    }
  }

  [[nodiscard]] RowSums make(std::uint32_t y) const {
    RowSums sums;
    const double down = std::numbers::pi * (y + 0.5) / pixels_.height;
    const double sine = std::sin(down);
    const double cosine = std::cos(down);
    for (std::uint32_t x = 0; x < pixels_.width; ++x) {
      const std::size_t i = std::size_t{y} * pixels_.width + x;
      vec3 color = pixels_.values[i];
      bool good = true;
      for (int c = 0; c < 3; ++c) {
        if (color[c] >= 0.0F && color[c] <= brightest) continue;
        good = false;
        color[c] = 0.0F;
      }
      if (!good) ++sums.replaced;
      const Packed packed = pack(color);
      const glm::dvec3 kept(unpack(packed));
      weights_[i] = luminance(kept) * sine;
      sums.weight += weights_[i];
      sums.add({sine * level_[x].x, cosine, sine * level_[x].y}, sine * kept);
      words_[i] = {Alias::certain, static_cast<std::uint32_t>(i), packed.z, packed.w};
    }
    return sums;
  }

 private:
  const EnvironmentPixels& pixels_;
  std::vector<glm::uvec4>& words_;
  std::vector<double>& weights_;
  std::vector<glm::dvec2> level_;  // sine and cosine of the azimuth, per column
};

/// Calls visit with each row, on TBB threads.
template <class Visit>
void for_each_row(std::uint32_t rows, const Visit& visit) {
  tbb::parallel_for(tbb::blocked_range<std::uint32_t>(0, rows), [&](const auto& range) {
    for (std::uint32_t y = range.begin(); y != range.end(); ++y) visit(y);
  });
}

}  // namespace

void check_environment_size(const std::string& name, std::int64_t width, std::int64_t height) {
  const std::int64_t most = Environment::max_side;
  if (width >= 1 && height >= 1 && width <= most && height <= most) return;
  const std::string limit = width < 1 || height < 1 ? "" : "; the limit is " + std::to_string(most) + " per side";
  throw Error(ErrorCode::file, one_line(name) + ": the environment has " + std::to_string(width) + "x" +
                                   std::to_string(height) + " pixels" + limit);
}

EnvironmentPtr make_environment(const EnvironmentPixels& pixels, const std::string& name, Progress* progress) {
  check_environment_size(name, pixels.width, pixels.height);
  const std::size_t texels = std::size_t{pixels.width} * pixels.height;
  if (pixels.values.size() != texels) {
    throw Error(ErrorCode::file, one_line(name) + ": the environment size is " + std::to_string(pixels.width) + "x" +
                                     std::to_string(pixels.height) + " pixels, but it has " +
                                     std::to_string(pixels.values.size()) + " values");
  }
  const auto made = make_deferred_delete<Environment>();
  made->name = name;
  made->remarks = pixels.remarks;
  made->width = pixels.width;
  made->height = pixels.height;
  std::vector<double> weights;
  resize(made->words, texels, progress);
  resize(weights, texels, progress);
  std::vector<RowSums> rows(pixels.height);
  {
    const RowMaker maker(pixels, made->words, weights);
    ProgressPart part(progress, 0.5, 0.75, pixels.height);
    for_each_row(pixels.height, [&](std::uint32_t y) {
      rows[y] = maker.make(y);
      part.add(1);
    });
  }
  // Summed in the order of rows, so that the result does not depend on threads.
  RowSums all;
  double sines = 0.0;
  for (std::uint32_t y = 0; y < pixels.height; ++y) {
    all.add(rows[y]);
    sines += pixels.width * std::sin(std::numbers::pi * (y + 0.5) / pixels.height);
  }
  made->mean = all.mean / sines;
  const double unit = 2.0 * std::numbers::pi * std::numbers::pi / static_cast<double>(texels);
  made->level_irradiance = unit * all.level;
  made->harmonics = all.harmonics(sines);
  made->replaced = all.replaced;
  if (all.weight > 0.0) {
    made->density = static_cast<float>(1.0 / (all.weight * unit));
    const std::vector<Alias> aliases = run_cancellable(
        progress,
        [weights = std::move(weights), sum = all.weight]() mutable { return alias_table(std::move(weights), sum); });
    ProgressPart part(progress, 0.9, 0.95, pixels.height);
    for_each_row(pixels.height, [&](std::uint32_t y) {
      for (std::size_t i = std::size_t{y} * pixels.width; i < std::size_t{y + 1} * pixels.width; ++i) {
        made->words[i].x = aliases[i].stays;
        made->words[i].y = aliases[i].other;
      }
      part.add(1);
    });
  }
  const auto read = [&made](std::uint32_t y, std::vector<vec3>& row) {
    for (std::uint32_t x = 0; x < made->width; ++x) {
      const glm::uvec4& word = made->words[std::size_t{y} * made->width + x];
      row[x] = unpack({word.z, word.w});
    }
  };
  made->prefiltered = prefilter({made->width, made->height, read}, made->mean, progress);
  if (progress != nullptr) progress->at(1.0);
  return made;
}

std::vector<vec3> pixels_of(const Environment& environment, std::uint32_t width, std::uint32_t height) {
  // The range of source texels (of `many`) that target pixel i (of `few`) covers; at least one.
  const auto covered = [](std::uint32_t i, std::uint32_t few, std::uint32_t many) {
    const auto edge = [&](std::uint32_t at) { return static_cast<std::uint32_t>(std::uint64_t{at} * many / few); };
    return std::pair(edge(i), std::max(edge(i + 1), edge(i) + 1));
  };
  std::vector<vec3> pixels(std::size_t{width} * height);
  for_each_row(height, [&](std::uint32_t y) {
    const auto [top, bottom] = covered(y, height, environment.height);
    for (std::uint32_t x = 0; x < width; ++x) {
      const auto [left, right] = covered(x, width, environment.width);
      glm::dvec3 sum(0.0);
      for (std::uint32_t v = top; v < bottom; ++v) {
        for (std::uint32_t u = left; u < right; ++u) {
          const glm::uvec4& word = environment.words[std::size_t{v} * environment.width + u];
          sum += glm::dvec3(unpack({word.z, word.w}));
        }
      }
      pixels[std::size_t{y} * width + x] = vec3(sum / (double(bottom - top) * (right - left)));
    }
  });
  return pixels;
}

}  // namespace cumulet::light
