#include "light/primaries.hpp"

#include <algorithm>
#include <cmath>

#include "base/luminance.hpp"

namespace cumulet::light {

namespace {

using glm::dmat3;
using glm::dvec2;
using glm::dvec3;
using glm::vec3;

struct Known {
  const char* name;
  Primaries primaries;
};

constexpr dvec2 d65{0.3127, 0.3290};

constexpr Known known[] = {
    {"ACES AP0", aces_primaries},
    {"ACES AP1", {{0.713, 0.293}, {0.165, 0.830}, {0.128, 0.044}, {0.32168, 0.33767}}},
    {"Rec. 2020", {{0.708, 0.292}, {0.170, 0.797}, {0.131, 0.046}, d65}},
    {"Display P3", {{0.680, 0.320}, {0.265, 0.690}, {0.150, 0.060}, d65}},
    {"DCI P3", {{0.680, 0.320}, {0.265, 0.690}, {0.150, 0.060}, {0.314, 0.351}}},
    {"Adobe RGB", {{0.64, 0.33}, {0.21, 0.71}, {0.15, 0.06}, d65}},
    {"Radiance", {{0.640, 0.330}, {0.290, 0.600}, {0.150, 0.060}, {0.3333, 0.3333}}},
    {"CIE XYZ", {{1.0, 0.0}, {0.0, 1.0}, {0.0, 0.0}, {1.0 / 3.0, 1.0 / 3.0}}},
};

dvec3 xyz_of(const dvec2& xy) { return {xy.x, xy.y, 1.0 - xy.x - xy.y}; }

bool finite(const dvec2& v) { return std::isfinite(v.x) && std::isfinite(v.y); }

/// Cone responses of the Bradford transform.
dmat3 bradford() {
  return glm::transpose(dmat3(0.8951, 0.2664, -0.1614, -0.7502, 1.7135, 0.0367, 0.0389, -0.0685, 1.0296));
}

}  // namespace

bool similar(const Primaries& a, const Primaries& b) {
  constexpr double within = 0.0015;
  const auto near = [](const dvec2& p, const dvec2& q) {
    return std::abs(p.x - q.x) < within && std::abs(p.y - q.y) < within;
  };
  return near(a.red, b.red) && near(a.green, b.green) && near(a.blue, b.blue) && near(a.white, b.white);
}

std::string name_of(const Primaries& primaries) {
  const auto* const found =
      std::ranges::find_if(known, [&](const Known& one) { return similar(one.primaries, primaries); });
  return found == std::end(known) ? "custom primaries" : std::string(found->name) + " primaries";
}

std::optional<dmat3> xyz_matrix(const Primaries& primaries) {
  const auto& [red, green, blue, white] = primaries;
  if (!finite(red) || !finite(green) || !finite(blue) || !finite(white) || !(white.y > 1e-4)) return std::nullopt;
  const dmat3 directions(xyz_of(red), xyz_of(green), xyz_of(blue));
  constexpr double smallest_determinant = 1e-4;
  if (!(std::abs(glm::determinant(directions)) > smallest_determinant)) return std::nullopt;
  const dvec3 lengths = glm::inverse(directions) * (xyz_of(white) / white.y);
  // A white point outside of the primaries' triangle has no positive mixture.
  if (!(lengths.x > 0.0 && lengths.y > 0.0 && lengths.z > 0.0)) return std::nullopt;
  return dmat3(directions[0] * lengths.x, directions[1] * lengths.y, directions[2] * lengths.z);
}

std::optional<dmat3> rec709_matrix(const Primaries& primaries) {
  const auto to_xyz = xyz_matrix(primaries);
  if (!to_xyz) return std::nullopt;
  const dvec3 from_white = bradford() * (xyz_of(primaries.white) / primaries.white.y);
  const dvec3 to_white = bradford() * (xyz_of(d65) / d65.y);
  const dvec3 scale = to_white / from_white;
  const dmat3 adapt =
      glm::inverse(bradford()) * dmat3(scale.x, 0.0, 0.0, 0.0, scale.y, 0.0, 0.0, 0.0, scale.z) * bradford();
  return rec709_matrix_of_xyz() * adapt * *to_xyz;
}

dmat3 rec709_matrix_of_xyz() { return glm::inverse(xyz_matrix(Primaries{}).value()); }

vec3 into_gamut(const vec3& color) {
  const float least = std::min(color.x, std::min(color.y, color.z));
  const auto gray = static_cast<float>(luminance(glm::dvec3(color)));
  if (!(least < 0.0F) || !(gray > 0.0F) || !std::isfinite(gray) || !std::isfinite(least)) return color;
  return glm::max(vec3(gray) + (color - gray) * (gray / (gray - least)), 0.0F);
}

std::uint64_t convert(std::span<vec3> pixels, const dmat3& matrix) {
  // Out-of-gamut amounts below this fraction of the luminance are within the error of half floats.
  constexpr float clearly = 0.01F;
  std::uint64_t outside = 0;
  for (vec3& pixel : pixels) {
    const vec3 color(matrix * dvec3(pixel));
    const float least = std::min(color.x, std::min(color.y, color.z));
    if (least < -clearly * static_cast<float>(luminance(dvec3(color)))) ++outside;
    pixel = into_gamut(color);
  }
  return outside;
}

}  // namespace cumulet::light
