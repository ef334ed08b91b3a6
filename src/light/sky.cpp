#include "light/sky.hpp"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>

#include "light/air.hpp"
#include "light/spectrum.hpp"

namespace cumulet::light {

namespace {

using glm::dvec3;
using glm::vec3;
using std::numbers::pi;

using air::aerosol_albedo;
using air::density;
using air::ground;
using air::sun_outside;
using air::top;

constexpr double sun_angular_radius = 0.00465;  // radians

// Most light that aerosols scatter stays near its direction. In the delta-Eddington approximation (Joseph, Wiscombe and
// Weinman 1976) this fraction counts as not scattered, and the rest as scattered equally in all directions. The first
// scattering keeps its phase function (Nakajima and Tanaka 1988). With isotropic scattering instead, the horizon was up
// to 45 % too dark, and the sky above it as much too bright.
constexpr double aerosol_forward = air::aerosol_anisotropy * air::aerosol_anisotropy;
constexpr auto aerosol_rest = static_cast<float>(1.0 - aerosol_forward);
// Extinction of aerosols without that fraction.
constexpr auto aerosol_extinction = static_cast<float>(1.0 - aerosol_albedo * aerosol_forward);

// Every second sample of a Spectrum.
constexpr std::size_t band_count = 21;
using Bands = std::array<float, band_count>;

constexpr std::size_t sample_of(std::size_t band) { return 2 * band; }

// Contribution of a band to a color: a triangular spectrum that falls to 0 at the adjacent bands.
std::array<vec3, band_count> band_colors() {
  std::array<vec3, band_count> colors{};
  dvec3 all(0.0);
  for (std::size_t band = 0; band < band_count; ++band) {
    const double sun = air::at_sample(air::solar_irradiance, sample_of(band));
    Spectrum spectrum{};
    const std::size_t sample = sample_of(band);
    spectrum[sample] = sun;
    if (sample > 0) spectrum[sample - 1] = 0.5 * sun;
    if (sample + 1 < spectrum.size()) spectrum[sample + 1] = 0.5 * sun;
    const dvec3 color = rec709(spectrum);
    all += color;
    colors[band] = vec3(color);
  }
  for (vec3& color : colors) color *= vec3(sun_outside / all);
  return colors;
}

// Distances along a ray from radius r; mu is the cosine to the zenith.
double to_top(double r, double mu) {
  return std::max(0.0, -r * mu + std::sqrt(std::max(0.0, r * r * (mu * mu - 1.0) + top * top)));
}
double horizon(double r) { return -std::sqrt(std::max(0.0, 1.0 - (ground / r) * (ground / r))); }
bool hits_ground(double r, double mu) { return mu < horizon(r); }
double to_ground(double r, double mu) {
  return std::max(0.0, -r * mu - std::sqrt(std::max(0.0, r * r * (mu * mu - 1.0) + ground * ground)));
}

// Position in a piecewise linear table: between i and i + 1.
struct Between {
  std::size_t i = 0;
  float part = 0.0F;
};
Between between(double share, std::size_t count) {
  const double at = std::clamp(share, 0.0, 1.0) * static_cast<double>(count - 1);
  const std::size_t i = std::min(static_cast<std::size_t>(at), count - 2);
  return {i, static_cast<float>(at - static_cast<double>(i))};
}
double share_of(std::size_t i, std::size_t count) { return static_cast<double>(i) / static_cast<double>(count - 1); }

// Column densities of air, aerosols and ozone along rays that leave the atmosphere. Uses Bruneton and Neyret's mapping,
// "Precomputed Atmospheric Scattering" (2008), which is smooth at the horizon.
class Paths {
 public:
  Paths() : table_(radii * cosines) {
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, radii), [&](const auto& range) {
      for (std::size_t i = range.begin(); i != range.end(); ++i) {
        const double tangent = farthest() * share_of(i, radii);  // distance to the ray's tangent point on the ground
        const double r = std::sqrt(tangent * tangent + ground * ground);
        for (std::size_t j = 0; j < cosines; ++j) {
          const double d = (top - r) + (tangent + farthest() - (top - r)) * share_of(j, cosines);
          const double mu = d > 0.0 ? std::clamp((top * top - r * r - d * d) / (2.0 * r * d), -1.0, 1.0) : 1.0;
          table_[i * cosines + j] = vec3(sum(r, mu));
        }
      }
    });
  }

  // For a ray that does not hit the ground.
  [[nodiscard]] vec3 operator()(double r, double mu) const {
    const double tangent = std::sqrt(std::max(0.0, r * r - ground * ground));
    const double nearest = top - r;
    const double length = to_top(r, mu);
    const Between i = between(tangent / farthest(), radii);
    const Between j = between((length - nearest) / (tangent + farthest() - nearest), cosines);
    const vec3* row = &table_[i.i * cosines + j.i];
    return glm::mix(glm::mix(row[0], row[1], j.part), glm::mix(row[cosines], row[cosines + 1], j.part), i.part);
  }

 private:
  static constexpr std::size_t radii = 32;
  static constexpr std::size_t cosines = 128;

  static double farthest() { return std::sqrt(top * top - ground * ground); }

  static dvec3 sum(double r, double mu) {
    constexpr int steps = 128;
    const double length = to_top(r, mu);
    dvec3 result(0.0);
    for (int i = 0; i < steps; ++i) {
      // Steps are smaller at the start, where the air is densest.
      const double x = (i + 0.5) / steps;
      const double t = length * x * x;
      const double height = std::sqrt(r * r + t * t + 2.0 * r * mu * t) - ground;
      result += density(std::max(height, 0.0)) * (2.0 * x * length / steps);
    }
    return result;
  }

  std::vector<vec3> table_;
};

}  // namespace

// Light in units of a white sun with irradiance 1.
class Atmosphere {
 public:
  explicit Atmosphere(const SkyModel& model) : ground_albedo_(model.ground_albedo) {
    for (std::size_t band = 0; band < band_count; ++band) {
      const glm::vec3 column(air::column(model.turbidity, sample_of(band)));
      air_[band] = column.x;
      aerosols_[band] = column.y;
      ozone_[band] = column.z;
    }
    scatter_more();
  }

  [[nodiscard]] double ground_albedo() const { return ground_albedo_; }

  // Returns the sunlight at radius r; mu is the cosine of the sun's zenith angle. aerosols: factor of their
  // extinction, 1 for the disk alone.
  [[nodiscard]] Bands sunlight(double r, double mu, float aerosols = aerosol_extinction) const {
    const double above = (mu - horizon(r)) / sun_angular_radius;
    Bands result{};
    if (above <= -1.0) return result;
    // The fraction of the sun's disk that the ground does not occlude.
    const double edge = std::min(above, 1.0);
    const auto part = static_cast<float>(0.5 + (edge * std::sqrt(1.0 - edge * edge) + std::asin(edge)) / pi);
    const vec3 path = paths_(r, std::max(mu, horizon(r)));
    for (std::size_t b = 0; b < band_count; ++b) {
      result[b] = part * std::exp(-(path.x * air_[b] + path.y * aerosols * aerosols_[b] + path.z * ozone_[b]));
    }
    return result;
  }

  // Marches along a ray from radius r. Calls visit(radius, cosine of the sun, air, aerosols) per step. The last two
  // are, per band, the fraction of light that they scatter and that reaches the start. Returns the transmittance of the
  // whole ray, with aerosol_extinction.
  template <class Visit>
  Bands march(double r, double mu, double azimuth, double sun_mu, int steps, const Visit& visit) const {
    const dvec3 start(0.0, r, 0.0);
    const double across = std::sqrt(std::max(0.0, 1.0 - mu * mu));
    const dvec3 along(across * std::cos(azimuth), mu, across * std::sin(azimuth));
    const dvec3 sun(std::sqrt(std::max(0.0, 1.0 - sun_mu * sun_mu)), sun_mu, 0.0);
    const double length = hits_ground(r, mu) ? to_ground(r, mu) : to_top(r, mu);
    Bands through{};
    through.fill(1.0F);
    for (int i = 0; i < steps; ++i) {
      // Steps are smaller at the start, as in Paths.
      const double x0 = static_cast<double>(i) / steps;
      const double x1 = static_cast<double>(i + 1) / steps;
      const double x = 0.5 * (x0 + x1);
      const dvec3 at = start + length * x * x * along;
      const double radius = glm::length(at);
      const vec3 amount(density(std::max(0.0, radius - ground)) * (length * (x1 * x1 - x0 * x0)));
      Bands air{};
      Bands aerosols{};
      for (std::size_t b = 0; b < band_count; ++b) {
        const float by_air = amount.x * air_[b];
        const float by_aerosols = amount.y * aerosols_[b];
        const float depth = by_air + aerosol_extinction * by_aerosols + amount.z * ozone_[b];
        const float passes = std::exp(-depth);
        // The mean transmittance over the step.
        const float mean = depth > 1.0e-4F ? (1.0F - passes) / depth : 1.0F - 0.5F * depth;
        air[b] = through[b] * mean * by_air;
        aerosols[b] = through[b] * mean * by_aerosols * static_cast<float>(aerosol_albedo);
        through[b] *= passes;
      }
      visit(radius, glm::dot(at, sun) / radius, air, aerosols);
    }
    return through;
  }

  // Returns the radiance that multiple scattering adds per unit of scattering, from all directions equally.
  [[nodiscard]] Bands more(double r, double sun_mu) const {
    const Between i = between(std::sqrt(std::max(0.0, r - ground) / (top - ground)), more_radii);
    const Between j = between(0.5 + 0.5 * std::copysign(std::sqrt(std::abs(sun_mu)), sun_mu), more_cosines);
    const Bands* row = &more_[i.i * more_cosines + j.i];
    Bands result{};
    for (std::size_t b = 0; b < band_count; ++b) {
      const float low = glm::mix(row[0][b], row[1][b], j.part);
      const float high = glm::mix(row[more_cosines][b], row[more_cosines + 1][b], j.part);
      result[b] = glm::mix(low, high, i.part);
    }
    return result;
  }

 private:
  static constexpr std::size_t more_radii = 10;
  static constexpr std::size_t more_cosines = 32;

  void scatter_more() {
    more_.resize(more_radii * more_cosines);
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, more_.size()), [&](const auto& range) {
      for (std::size_t k = range.begin(); k != range.end(); ++k) {
        const double height = share_of(k / more_cosines, more_radii);
        const double side = 2.0 * share_of(k % more_cosines, more_cosines) - 1.0;
        more_[k] = scattered_more(ground + (top - ground) * height * height, side * std::abs(side));
      }
    });
  }

  // Hillaire's method: second-order scattering with isotropic phase functions, and all higher orders as a geometric
  // series.
  [[nodiscard]] Bands scattered_more(double r, double sun_mu) const {
    constexpr int cosines = 16;
    constexpr int azimuths = 2;
    constexpr int steps = 16;
    constexpr float each = 1.0F / (cosines * azimuths);
    Bands second{};
    Bands again{};
    for (int i = 0; i < cosines * azimuths; ++i) {
      const int ring = i / azimuths;
      const double mu = (ring + 0.5) / cosines * 2.0 - 1.0;
      const double azimuth = (i % azimuths + 0.5) / azimuths * pi;
      const auto visit = [&](double radius, double sun, const Bands& air, const Bands& aerosols) {
        const Bands light = sunlight(radius, sun);
        for (std::size_t b = 0; b < band_count; ++b) {
          const float scattered = air[b] + aerosol_rest * aerosols[b];
          second[b] += each * scattered * light[b] * static_cast<float>(0.25 / pi);
          again[b] += each * scattered;
        }
      };
      const Bands through = march(r, mu, azimuth, sun_mu, steps, visit);
      if (!hits_ground(r, mu)) continue;
      const double length = to_ground(r, mu);
      const double across = std::sqrt(std::max(0.0, 1.0 - mu * mu));
      const double sun_across = std::sqrt(std::max(0.0, 1.0 - sun_mu * sun_mu));
      const double sun =
          ((r + length * mu) * sun_mu + length * across * std::cos(azimuth) * sun_across) / ground;  // at the ray's end
      if (!(sun > 0.0)) continue;
      const Bands light = sunlight(ground, sun);
      const float back = each * static_cast<float>(ground_albedo_) * static_cast<float>(sun / pi);
      for (std::size_t b = 0; b < band_count; ++b) second[b] += back * through[b] * light[b];
    }
    for (std::size_t b = 0; b < band_count; ++b) second[b] /= 1.0F - again[b];
    return second;
  }

  double ground_albedo_;
  Paths paths_;
  // Optical depths of the vertical column above the ground.
  Bands air_{};
  Bands aerosols_{};
  Bands ozone_{};
  std::vector<Bands> more_;
};

namespace {

double air_phase(double cosine) { return 3.0 / (16.0 * pi) * (1.0 + cosine * cosine); }

// Cornette and Shanks, "Physically Reasonable Analytic Expression for the Single-Scattering Phase Function" (1992).
double aerosol_phase(double cosine) {
  constexpr double g = air::aerosol_anisotropy;
  return 3.0 / (8.0 * pi) * (1.0 - g * g) * (1.0 + cosine * cosine) /
         ((2.0 + g * g) * std::pow(1.0 + g * g - 2.0 * g * cosine, 1.5));
}

vec3 color_of(const std::array<vec3, band_count>& colors, const Bands& bands) {
  vec3 sum(0.0F);
  for (std::size_t b = 0; b < band_count; ++b) sum += bands[b] * colors[b];
  return sum;
}

double elevation_of_row(std::size_t row, std::size_t rows) {
  const double share = share_of(row, rows);
  return 0.5 * pi * share * share;
}

}  // namespace

Sky::Sky(const SkyModel& model, const dvec3& to_sun) : Sky(Atmosphere(model), to_sun) {}

Sky::Sky(const Atmosphere& atmosphere, const dvec3& to_sun) : to_sun_(to_sun), table_(rows * columns) {
  constexpr int steps = 40;
  const std::array<vec3, band_count> colors = band_colors();
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, table_.size()), [&](const auto& range) {
    for (std::size_t k = range.begin(); k != range.end(); ++k) {
      const double mu = std::sin(elevation_of_row(k / columns, rows));
      const double azimuth = pi * share_of(k % columns, columns);
      Bands once_by_air{};
      Bands once_by_aerosols{};
      Bands more{};
      atmosphere.march(ground, mu, azimuth, to_sun.y, steps,
                       [&](double radius, double sun, const Bands& air, const Bands& aerosols) {
                         const Bands light = atmosphere.sunlight(radius, sun);
                         const Bands even = atmosphere.more(radius, sun);
                         for (std::size_t b = 0; b < band_count; ++b) {
                           once_by_air[b] += air[b] * light[b];
                           once_by_aerosols[b] += aerosols[b] * light[b];
                           more[b] += (air[b] + aerosol_rest * aerosols[b]) * even[b];
                         }
                       });
      table_[k] = {color_of(colors, once_by_air), color_of(colors, once_by_aerosols), color_of(colors, more)};
    }
  });

  sun_irradiance_ = glm::max(color_of(colors, atmosphere.sunlight(ground, to_sun.y, 1.0F)), vec3(0.0F));

  // Samples uniform over the unit disk below the hemisphere are cosine-weighted.
  constexpr int rings = 64;
  constexpr int sectors = 128;
  dvec3 sum(0.0);
  for (int i = 0; i < rings; ++i) {
    const double across = std::sqrt((i + 0.5) / rings);
    for (int j = 0; j < sectors; ++j) {
      const double azimuth = 2.0 * pi * (j + 0.5) / sectors;
      const dvec3 direction(across * std::sin(azimuth), std::sqrt(1.0 - across * across), across * std::cos(azimuth));
      sum += dvec3(radiance(direction));
    }
  }
  sky_irradiance_ = vec3(sum * (pi / (rings * sectors)));

  const vec3 falls = sky_irradiance_ + sun_irradiance_ * static_cast<float>(std::max(0.0, to_sun.y));
  ground_radiance_ = falls * static_cast<float>(atmosphere.ground_albedo() / pi);
}

Sky::Scattered Sky::scattered(double elevation, double azimuth) const {
  const Between row = between(std::sqrt(elevation / (0.5 * pi)), rows);
  const Between column = between(azimuth / pi, columns);
  const Scattered* at = &table_[row.i * columns + column.i];
  const auto mixed = [&](vec3 Scattered::*part) {
    return glm::mix(glm::mix(at[0].*part, at[1].*part, column.part),
                    glm::mix(at[columns].*part, at[columns + 1].*part, column.part), row.part);
  };
  return {mixed(&Scattered::air), mixed(&Scattered::aerosols), mixed(&Scattered::more)};
}

vec3 Sky::radiance(const dvec3& direction) const {
  if (direction.y < 0.0) return ground_radiance_;
  // Azimuth relative to the sun's; both sides are equal.
  const double sine = direction.x * to_sun_.z - direction.z * to_sun_.x;
  const double cosine = direction.x * to_sun_.x + direction.z * to_sun_.z;
  const Scattered s = scattered(std::asin(std::min(direction.y, 1.0)), std::abs(std::atan2(sine, cosine)));
  const double from_sun = std::clamp(glm::dot(direction, to_sun_), -1.0, 1.0);
  return glm::max(s.air * static_cast<float>(air_phase(from_sun)) +
                      s.aerosols * static_cast<float>(aerosol_phase(from_sun)) + s.more,
                  vec3(0.0F));
}

Daylight make_daylight(const Day& day, const Daylight* last) {
  const double up = day.sun_elevation_degrees * pi / 180.0;
  const bool kept = last != nullptr && last->day.model == day.model;
  const AtmospherePtr atmosphere = kept ? last->atmosphere : std::make_shared<const Atmosphere>(day.model);
  const Sky sky(*atmosphere, {0.0, std::sin(up), std::cos(up)});
  EnvironmentPixels pixels{.width = 512, .height = 256, .values = {}};
  pixels.values.resize(std::size_t{pixels.width} * pixels.height);
  // One row more: directions just above the horizon are interpolated between it and the row above.
  const std::uint32_t rows = day.above_alone ? pixels.height / 2 + 1 : pixels.height;
  tbb::parallel_for(tbb::blocked_range<std::uint32_t>(0, rows), [&](const auto& range) {
    for (std::uint32_t y = range.begin(); y != range.end(); ++y) {
      const double elevation = pi * (0.5 - (y + 0.5) / pixels.height);
      for (std::uint32_t x = 0; x < pixels.width; ++x) {
        const double azimuth = 2.0 * pi * (0.5 - (x + 0.5) / pixels.width);
        const double across = std::cos(elevation);
        const dvec3 direction(std::sin(azimuth) * across, std::sin(elevation), std::cos(azimuth) * across);
        pixels.values[std::size_t{y} * pixels.width + x] = sky.radiance(direction);
      }
    }
  });
  return {day, atmosphere, sky.sun_irradiance(), make_environment(pixels, "the physical sky")};
}

}  // namespace cumulet::light
