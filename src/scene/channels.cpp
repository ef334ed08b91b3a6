#include "scene/channels.hpp"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <limits>
#include <string>
#include <vector>

#include "base/error.hpp"
#include "base/luminance.hpp"
#include "base/one_line.hpp"
#include "base/progress_part.hpp"
#include "light/black_body.hpp"
#include "volume/bricks.hpp"

namespace cumulet::scene {

namespace {

using glm::ivec3;
using glm::vec3;
using volume::brick_size;
using volume::brick_voxels;
using volume::ScalarVolume;

using Values = volume::BrickValues::Brick;

// Reads the brick at this origin.
void read(const ScalarVolume& field, const ivec3& origin, Values& values) {
  if (const float* brick = volume::find_brick(field, origin, values)) {
    if (brick != values.data()) std::copy(brick, brick + brick_voxels, values.begin());
    return;
  }
  std::vector<std::uint32_t> tiles;
  for (std::uint32_t t = 0; t < field.tiles.size(); ++t) {
    const bool apart = glm::any(glm::greaterThan(field.tiles[t].min, origin + (brick_size - 1))) ||
                       glm::any(glm::lessThan(field.tiles[t].max, origin));
    if (!apart) tiles.push_back(t);
  }
  volume::fill_brick(field, origin, tiles, values.data());
}

// Collects the brick origins of fields: the bricks they store, and those that their tiles and backgrounds fill.
class BrickSet {
 public:
  /// what: name for error messages.
  explicit BrickSet(const char* what) : what_(what) {}
  void add(const ScalarVolume& field) {
    origins_.insert(origins_.end(), field.brick_origins.begin(), field.brick_origins.end());
    for (const volume::Tile& tile : field.tiles) {
      if (tile.value > 0.0F) add(tile.min, tile.max);
    }
    if (field.background > 0.0F) add(field.bounds_min, field.bounds_max);
  }
  std::vector<ivec3> take() {
    std::ranges::sort(origins_, volume::lexicographic);
    origins_.erase(std::unique(origins_.begin(), origins_.end()), origins_.end());
    return std::move(origins_);
  }

 private:
  void add(const ivec3& low, const ivec3& high) {
    const ivec3 first = low >> 3;
    const glm::i64vec3 count = glm::i64vec3(high >> 3) - glm::i64vec3(first) + std::int64_t{1};
    filled_ += count.x * count.y * count.z;
    constexpr std::int64_t most = std::int64_t{1} << 18;
    if (filled_ > most) {
      throw Error(ErrorCode::unsupported,
                  std::string(what_) + " with constant values covers more than " + std::to_string(most) + " bricks");
    }
    for (int x = 0; x < count.x; ++x) {
      for (int y = 0; y < count.y; ++y) {
        for (int z = 0; z < count.z; ++z) origins_.push_back((first + ivec3(x, y, z)) * brick_size);
      }
    }
  }

  const char* what_;
  std::vector<ivec3> origins_;
  std::int64_t filled_ = 0;
};

// Far above any visible radiance, and low enough that float sums over a volume stay finite.
constexpr double max_radiance = 1e12;

glm::dvec3 flame_color_of(const Emission& emission) {
  return glm::dvec3(emission.flame_color) * emission.flame_strength;
}
float intensity_of(const Emission& emission) { return static_cast<float>(std::min(emission.blackbody, max_radiance)); }

// Reads the density of a brick and applies the ramp.
void read_density(const volume::VolumeFrame& frame, const volume::Ramp& ramp, const ivec3& origin, Values& density) {
  read(frame.density, origin, density);
  for (float& value : density) value = ramp(value);
}

// Sources of the scattering of one frame.
struct ScatterSource {
  const volume::VolumeFrame& frame;
  const DensityRamps& ramps;
  const ScalarVolume& colored_by;

  [[nodiscard]] bool colored() const { return frame.color || !ramps.colors.empty(); }
};

// The fields of one brick that determine scattering.
struct Scatters {
  Values density{};
  std::array<Values, 3> color{};

  void read_brick(const ScatterSource& source, const ivec3& origin) {
    for (std::size_t i = 0; source.frame.color && i < 3; ++i) read((*source.frame.color)[i], origin, color[i]);
    if (!source.ramps.colors.empty()) {
      read(source.colored_by, origin, density);
      for (std::size_t v = 0; v < brick_voxels; ++v) {
        const vec3 by_density = source.ramps.colors(density[v]);
        for (std::size_t i = 0; i < 3; ++i)
          color[i][v] = by_density[static_cast<int>(i)] * (source.frame.color ? std::min(color[i][v], 1.0F) : 1.0F);
      }
    }
    read_density(source.frame, source.ramps.values, origin, density);
  }
  [[nodiscard]] vec3 colored(std::size_t v) const {
    return density[v] * glm::min(vec3(color[0][v], color[1][v], color[2][v]), vec3(1.0F));
  }
};

// Makes `count` component fields on these bricks, leaving out bricks that are 0 in all components. value() computes the
// components of a voxel from the data that read_brick() read.
template <int count, class Read, class ReadBrick, class Value>
std::array<ScalarVolume, count> fields_of(const glm::dmat4& index_to_world, const std::vector<ivec3>& origins,
                                          const std::string& name, const Progress* progress,
                                          const ReadBrick& read_brick, const Value& value) {
  using vec = glm::vec<count, float>;
  std::array<std::vector<float>, count> values;
  for (auto& component : values) component.resize(origins.size() * brick_voxels);
  std::vector<vec> most(origins.size(), vec(0.0F));
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, origins.size(), 16), [&](const auto& range) {
    check(progress);
    Read here;
    for (std::size_t b = range.begin(); b != range.end(); ++b) {
      read_brick(origins[b], here);
      for (std::size_t v = 0; v < brick_voxels; ++v) {
        const vec one = value(here, v);
        most[b] = glm::max(most[b], one);
        for (int i = 0; i < count; ++i) values[static_cast<std::size_t>(i)][b * brick_voxels + v] = one[i];
      }
    }
  });

  std::array<ScalarVolume, count> components;
  ScalarVolume& first = components[0];
  first.index_to_world = index_to_world;
  first.bounds_min = ivec3(std::numeric_limits<int>::max());
  first.bounds_max = ivec3(std::numeric_limits<int>::min());
  std::size_t kept = 0;
  vec max_value(0.0F);
  for (std::size_t b = 0; b < origins.size(); ++b) {
    if (most[b] == vec(0.0F)) continue;
    max_value = glm::max(max_value, most[b]);
    first.brick_origins.push_back(origins[b]);
    first.bounds_min = glm::min(first.bounds_min, origins[b]);
    first.bounds_max = glm::max(first.bounds_max, origins[b] + (brick_size - 1));
    for (auto& component : values) {
      if (kept == b) break;
      const auto from = component.begin() + static_cast<std::ptrdiff_t>(b * brick_voxels);
      std::copy(from, from + brick_voxels, component.begin() + static_cast<std::ptrdiff_t>(kept * brick_voxels));
    }
    ++kept;
  }
  if (kept == 0) first.bounds_min = first.bounds_max = ivec3(0);
  first.active_voxels = kept * brick_voxels;
  std::fill(components.begin() + 1, components.end(), first);
  for (std::size_t i = 0; i < count; ++i) {
    values[i].resize(kept * brick_voxels);
    components[i].name = name;
    components[i].brick_values = std::move(values[i]);
    components[i].max_value = max_value[static_cast<int>(i)];
  }
  return components;
}

}  // namespace

Emission EmissionDefaults::complete(Emission emission) const {
  if (!emission.temperature_scale && temperature_scale) {
    float largest = 0.0F;
    for (const glm::vec2& point : emission.temperature_ramp.points()) largest = std::max(largest, point.y);
    emission.temperature_scale =
        emission.temperature_ramp.empty() ? *temperature_scale : volume::temperature_scale_of(largest);
  }
  if (emission.blackbody == 0.0 && has_only_temperature) emission.blackbody = 1.0;
  return emission;
}

FieldEmission::FieldEmission(const Emission& emission) : emission_(emission) {}

glm::dvec3 FieldEmission::flame(float value) const {
  const double strength = double{emission_.flame_ramp(value)};
  if (emission_.flame_colors.empty()) return strength * flame_color_of(emission_);
  return strength * (glm::dvec3(emission_.flame_colors(value)) * emission_.flame_strength);
}

glm::dvec3 FieldEmission::black_body(float value) const {
  const float temperature = emission_.temperature_ramp(value);
  if (!(temperature > 0.0F) || !(emission_.blackbody > 0.0)) return {};
  constexpr double hottest = 1e6;
  const double kelvin =
      std::min(emission_.temperature_offset + emission_.kelvin_a_value() * double{temperature}, hottest);
  const glm::dvec3 tint(emission_.blackbody_tint);
  if (emission_.temperature_colors.empty())
    return glm::dvec3(black_body_.emission(static_cast<float>(kelvin), intensity_of(emission_))) * tint;
  return light::black_body_radiance(kelvin, double{intensity_of(emission_)}) *
         glm::dvec3(emission_.temperature_colors(value)) * tint;
}

vec3 FieldEmission::operator()(float temperature_value, float flame_value) const {
  return {glm::min(flame(flame_value) + black_body(temperature_value), glm::dvec3(max_radiance))};
}

core::CmBrickEmissive shader_emissive(const Emission& emission, const light::BlackBody& body) {
  core::CmBrickEmissive emissive{};
  const auto put = [](const volume::Ramp& ramp, core::CmRampPart* to) {
    const std::vector<glm::vec2>& points = ramp.points();
    constexpr float largest = std::numeric_limits<float>::max();
    std::fill_n(to, CM_RAMP_PARTS, core::CmRampPart{std::numeric_limits<float>::infinity(), 0.0F, 0.0F});
    *to++ = points.empty() ? core::CmRampPart{0.0F, 0.0F, 1.0F} : core::CmRampPart{0.0F, points.front().y, 0.0F};
    for (std::size_t i = 0; i < points.size(); ++i) {
      const glm::dvec2 rise =
          i + 1 < points.size() ? glm::dvec2(points[i + 1]) - glm::dvec2(points[i]) : glm::dvec2(1, 0);
      *to++ = {points[i].x, points[i].y,
               static_cast<float>(std::clamp(rise.y / rise.x, -double{largest}, double{largest}))};
    }
  };
  emissive.flame_color = flame_color_of(emission);
  emissive.intensity = intensity_of(emission);
  emissive.tint = emission.blackbody_tint;
  emissive.unit = emission.blackbody > 0.0 ? static_cast<float>(light::black_body_radiance(1000.0, 1.0) / 1e12) : 0.0F;
  emissive.offset = static_cast<float>(emission.temperature_offset);
  emissive.scale = static_cast<float>(emission.kelvin_a_value());
  emissive.most = static_cast<float>(max_radiance);
  put(emission.temperature_ramp, emissive.ramps);
  put(emission.flame_ramp, emissive.ramps + CM_RAMP_PARTS);
  static_assert(CM_BODY_COLORS == std::tuple_size_v<light::BlackBody::Colors>);
  float* to = emissive.colors;
  for (const vec3& color : body.colors()) {
    for (int i = 0; i < 3; ++i) *to++ = color[i];
  }
  return emissive;
}

std::optional<grid::RgbField::Components> emission_of(const volume::VolumeFrame& frame, const Emission& emission,
                                                      const Progress* progress) {
  const bool burns = frame.flame && !frame.flame->empty() && emission.burns();
  const bool hot = frame.temperature && !frame.temperature->empty() && emission.is_hot();
  if (!burns && !hot) return std::nullopt;
  BrickSet set("temperature or flame");
  if (burns) set.add(*frame.flame);
  if (hot) set.add(*frame.temperature);
  const FieldEmission emissive(emission);
  struct Read {
    Values flame{};
    Values temperature{};
  };
  auto radiance =
      fields_of<3, Read>((burns ? *frame.flame : *frame.temperature).index_to_world, set.take(), "emission", progress,
                         [&](const ivec3& origin, Read& read_here) {
                           if (burns) read(*frame.flame, origin, read_here.flame);
                           if (hot) read(*frame.temperature, origin, read_here.temperature);
                         },
                         [&](const Read& here, std::size_t v) { return emissive(here.temperature[v], here.flame[v]); });
  if (radiance[0].empty()) return std::nullopt;
  return radiance;
}

std::optional<grid::RgbField::Components> scattering_of(const volume::VolumeFrame& frame, const DensityRamps& ramps,
                                                        const Progress* progress, const ScalarVolume* colored_by) {
  const ScatterSource source{frame, ramps, colored_by != nullptr ? *colored_by : frame.density};
  if (!source.colored() || frame.density.empty()) return std::nullopt;
  BrickSet set("density");
  set.add(frame.density);
  return fields_of<3, Scatters>(
      frame.density.index_to_world, set.take(), "scattering", progress,
      [&](const ivec3& origin, Scatters& here) { here.read_brick(source, origin); },
      [](const Scatters& here, std::size_t v) { return here.colored(v); });
}

std::optional<ScalarVolume> forward_of(const volume::VolumeFrame& frame, const DensityRamps& ramps,
                                       const Progress* progress, const ScalarVolume* colored_by) {
  const ScatterSource source{frame, ramps, colored_by != nullptr ? *colored_by : frame.density};
  if (!frame.anisotropy || frame.density.empty()) return std::nullopt;
  BrickSet set("density");
  set.add(frame.density);
  struct Read {
    Scatters scatters;
    std::array<Values, 2> anisotropy{};
  };
  return std::move(fields_of<1, Read>(
      frame.density.index_to_world, set.take(), "anisotropy", progress,
      [&](const ivec3& origin, Read& here) {
        here.scatters.read_brick(source, origin);
        for (std::size_t i = 0; i < 2; ++i) read((*frame.anisotropy)[i], origin, here.anisotropy[i]);
      },
      [&](const Read& here, std::size_t v) {
        const float scatters = source.colored() ? luminance(here.scatters.colored(v)) : here.scatters.density[v];
        return glm::vec1(scatters * (0.5F + 0.5F * (here.anisotropy[0][v] - here.anisotropy[1][v])));
      })[0]);
}

namespace {

// Returns the voxelwise mean of each component.
template <std::size_t count>
std::optional<std::array<ScalarVolume, count>> means_of(const std::array<const ScalarVolume*, count>& a,
                                                        const std::array<const ScalarVolume*, count>& b,
                                                        const char* what, const Progress* progress) {
  BrickSet set(what);
  const ScalarVolume* one = nullptr;
  for (const auto& fields : {a, b}) {
    for (const ScalarVolume* field : fields) {
      if (field == nullptr || field->empty()) continue;
      set.add(*field);
      one = field;
    }
  }
  if (one == nullptr) return std::nullopt;
  struct Both {
    std::array<std::array<Values, 2>, count> ends{};
  };
  auto means = fields_of<static_cast<int>(count), Both>(
      one->index_to_world, set.take(), one->name, progress,
      [&](const ivec3& origin, Both& here) {
        for (std::size_t i = 0; i < count; ++i) {
          for (std::size_t end = 0; end < 2; ++end) {
            const ScalarVolume* field = end == 0 ? a[i] : b[i];
            if (field != nullptr) read(*field, origin, here.ends[i][end]);
          }
        }
      },
      [](const Both& here, std::size_t v) {
        glm::vec<static_cast<int>(count), float> mean(0.0F);
        for (std::size_t i = 0; i < count; ++i)
          mean[static_cast<int>(i)] = 0.5F * (here.ends[i][0][v] + here.ends[i][1][v]);
        return mean;
      });
  if (means[0].empty()) return std::nullopt;
  return means;
}

}  // namespace

std::optional<ScalarVolume> mean_of(const ScalarVolume* a, const ScalarVolume* b, const char* what,
                                    const Progress* progress) {
  auto means = means_of<1>({a}, {b}, what, progress);
  return means ? std::optional(std::move((*means)[0])) : std::nullopt;
}

std::optional<grid::RgbField::Components> mean_of(const std::optional<grid::RgbField::Components>& a,
                                                  const std::optional<grid::RgbField::Components>& b, const char* what,
                                                  const Progress* progress) {
  const auto fields = [](const std::optional<grid::RgbField::Components>& of) {
    std::array<const ScalarVolume*, 3> all{};
    for (std::size_t i = 0; of && i < 3; ++i) all[i] = &(*of)[i];
    return all;
  };
  return means_of<3>(fields(a), fields(b), what, progress);
}

double fastest_of(const volume::VolumeFrame& frame) {
  if (!frame.velocity) return 0.0;
  const std::array<ScalarVolume, 6>& parts = frame.velocity->parts;
  const glm::dmat3& to_index = frame.velocity->to_index;
  glm::dvec3 most(0.0);  // along each lattice axis
  for (int axis = 0; axis < 3; ++axis) {
    const std::size_t first = 2 * static_cast<std::size_t>(axis);
    most += glm::abs(to_index[axis]) * double{std::max(parts[first].max_value, parts[first + 1].max_value)};
  }
  return std::min(std::max({most.x, most.y, most.z}), volume::fastest_velocity);
}

std::optional<grid::MomentumField::Values> momentum_of(const volume::VolumeFrame& frame,
                                                       const volume::Ramp& density_ramp, const Progress* progress,
                                                       const Log& log, double fastest) {
  if (!frame.velocity || frame.density.empty()) return std::nullopt;
  const std::array<ScalarVolume, 6>& parts = frame.velocity->parts;
  const glm::dmat3& to_index = frame.velocity->to_index;
  fastest = std::max(fastest, fastest_of(frame));
  if (!(fastest > 0.0)) return std::nullopt;
  BrickSet set("density");
  try {
    set.add(frame.density);
  } catch (const Error& error) {
    // A missing velocity only disables motion blur and motion vectors.
    log.warning(one_line("grid \"" + parts[0].name + "\": the velocity is ignored: " + error.what()));
    return std::nullopt;
  }
  struct Read {
    Values density{};
    std::array<Values, 6> parts{};
  };
  const glm::dmat3 to_relative = to_index / fastest;
  auto components = fields_of<3, Read>(
      frame.density.index_to_world, set.take(), "velocity", progress,
      [&](const ivec3& origin, Read& here) {
        read_density(frame, density_ramp, origin, here.density);
        for (std::size_t i = 0; i < parts.size(); ++i) read(parts[i], origin, here.parts[i]);
      },
      [&](const Read& here, std::size_t v) {
        const glm::dvec3 given(here.parts[0][v] - here.parts[1][v], here.parts[2][v] - here.parts[3][v],
                               here.parts[4][v] - here.parts[5][v]);
        const vec3 relative(glm::clamp(to_relative * given, -1.0, 1.0));
        return here.density[v] * (0.5F + 0.5F * relative);
      });
  return grid::MomentumField::Values{std::move(components), static_cast<float>(fastest)};
}

}  // namespace cumulet::scene
