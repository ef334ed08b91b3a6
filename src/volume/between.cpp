#include "volume/between.hpp"

#include <algorithm>
#include <cmath>

#include "volume/advection.hpp"
#include "volume/gathering.hpp"
#include "volume/resample.hpp"

namespace cumulet::volume {

using namespace detail;

namespace {

/// For each field of either frame: the field in the first frame, in the second frame, and the result.
struct Pairs {
  const ScalarVolume nothing = {};
  std::vector<const ScalarVolume*> first, second;
  std::vector<ScalarVolume*> out;

  void add(const ScalarVolume* a, const ScalarVolume* b, ScalarVolume& to) {
    first.push_back(a);
    second.push_back(b);
    out.push_back(&to);
  }
  /// Adds an amount of matter. In a frame without the field it is 0.
  void add_matter(const std::optional<ScalarVolume>& a, const std::optional<ScalarVolume>& b,
                  std::optional<ScalarVolume>& to) {
    if (a || b) add(a ? &*a : &nothing, b ? &*b : &nothing, to.emplace());
  }
  /// Adds a property of matter (color, anisotropy, velocity). A frame without the field uses that of the other frame.
  template <std::size_t Count>
  void add_kind(const std::optional<std::array<ScalarVolume, Count>>& a,
                const std::optional<std::array<ScalarVolume, Count>>& b,
                std::optional<std::array<ScalarVolume, Count>>& to) {
    if (a || b) add_kind(a ? *a : *b, b ? *b : *a, to.emplace());
  }
  template <std::size_t Count>
  void add_kind(const std::array<ScalarVolume, Count>& a, const std::array<ScalarVolume, Count>& b,
                std::array<ScalarVolume, Count>& to) {
    for (std::size_t i = 0; i < Count; ++i) add(&a[i], &b[i], to[i]);
  }
};

class Blending final : Gathering {
 public:
  Blending(const Pairs& pairs, std::size_t of_matter, double part, Progress* progress, Portion portion)
      : Gathering(both(pairs), pairs.out.size(), progress, portion),
        fields_(pairs.out.size()),
        of_matter_(of_matter),
        part_(part) {}

  std::vector<SourceGrid> run() {
    Box box;
    for (std::size_t i = 0; i < 2 * fields_; ++i) {
      if (!source(i).empty()) box.expand({source(i).bounds_min, source(i).bounds_max});
    }
    return gather(box);
  }

 private:
  static std::vector<const ScalarVolume*> both(const Pairs& pairs) {
    std::vector<const ScalarVolume*> all = pairs.first;
    all.insert(all.end(), pairs.second.begin(), pairs.second.end());
    return all;
  }

  // value(i): returns the value of source i at the voxel.
  template <class Value>
  [[nodiscard]] double mixed(std::size_t field, const Value& value) const {
    double of_first = 1.0 - part_;
    double of_second = part_;
    if (field >= of_matter_) {
      const double first = of_first * value(0);
      const double second = of_second * value(fields_);
      if (first + second > 0.0) {
        of_first = first / (first + second);
        of_second = second / (first + second);
      }
    }
    return of_first * value(field) + of_second * value(fields_ + field);
  }

  [[nodiscard]] Box support(std::size_t /*source*/, const Box& box) const override { return box; }

  [[nodiscard]] std::optional<float> constant(std::size_t field,
                                              std::span<const std::optional<float>> sources) const override {
    const bool weighed = field >= of_matter_;
    if (!sources[field] || !sources[fields_ + field]) return std::nullopt;
    if (weighed && (!sources[0] || !sources[fields_])) return std::nullopt;
    return static_cast<float>(mixed(field, [&](std::size_t i) { return double{*sources[i]}; }));
  }

  void sample(const glm::ivec3& origin, std::span<const Window> windows, std::span<const std::size_t> wanted,
              std::span<Brick> bricks) const override {
    for (std::size_t i = 0; i < brick_voxels; ++i) {
      const glm::ivec3 voxel = origin + glm::ivec3(i >> 6U, (i >> 3U) & 7U, i & 7U);
      for (std::size_t f = 0; f < wanted.size(); ++f)
        bricks[f][i] = static_cast<float>(mixed(wanted[f], [&](std::size_t w) { return windows[w].voxel(voxel); }));
    }
  }

  [[noreturn]] void too_large() const override { fail("is too large to be interpolated"); }

  std::size_t fields_;
  std::size_t of_matter_;  // number of fields that are amounts per unit volume, density first
  double part_;
};

bool same(const glm::dmat3& a, const glm::dmat3& b) {
  const glm::dmat3 off = a - b;
  double most = 0.0;
  double size = 0.0;
  for (int column = 0; column < 3; ++column) {
    most = std::max(most, glm::length(off[column]));
    size = std::max(size, glm::length(a[column]));
  }
  return most <= 1e-6 * size;
}

Box box_of(const VolumeFrame& frame) {
  Box box;
  for (const ScalarVolume* field : frame.fields()) {
    if (!field->empty()) box.expand({field->bounds_min, field->bounds_max});
  }
  return box;
}

/// Resamples all fields to another lattice.
VolumeFrame moved(const VolumeFrame& frame, const glm::dmat4& lattice, Progress* progress, Portion portion) {
  VolumeFrame out = frame;
  const glm::dmat4 to_lattice = glm::inverse(lattice) * frame.density.index_to_world;
  const std::vector<ScalarVolume*> fields = out.fields();
  for (std::size_t i = 0; i < fields.size(); ++i) {
    const auto share = [&](std::size_t index) {
      return static_cast<double>(index) / static_cast<double>(fields.size());
    };
    if (!fields[i]->empty()) {
      const ScalarVolume before = std::move(*fields[i]);
      std::vector<SourceGrid> grids;
      grids.push_back(resample(before, lattice, std::nullopt, progress, portion.part(share(i), share(i + 1))));
      const std::array<const ScalarVolume*, 1> from{&before};
      const std::array<ScalarVolume*, 1> to{fields[i]};
      assemble_in_place_of(from, std::move(grids), to, nullptr, {});
    }
    fields[i]->index_to_world = lattice;
  }
  if (out.velocity) out.velocity->to_index = glm::dmat3(to_lattice) * out.velocity->to_index;
  return out;
}

VolumeFrame blend(const VolumeFrame& before, const VolumeFrame& after, double part, Progress* progress,
                  Portion portion) {
  if (part == 0.0) return before;
  if (part == 1.0) return after;
  return naming("\"" + before.density.name + "\"", [&] {
    const glm::dmat4& lattice = before.density.index_to_world;
    const Box box = box_of(after);
    if (!box.empty() && !same_positions(lattice, after.density.index_to_world, box)) {
      constexpr double moving = 0.6;
      return blend(before, moved(after, lattice, progress, portion.part(0.0, moving)), part, progress,
                   portion.part(moving, 1.0));
    }
    VolumeFrame out;
    Pairs pairs;
    pairs.add(&before.density, &after.density, out.density);
    for_each_amount([&](const auto& a, const auto& b, auto& to) { pairs.add_matter(a, b, to); }, before, after, out);
    const std::size_t of_matter = pairs.out.size();
    for_each_property([&](const auto& a, const auto& b, auto& to) { pairs.add_kind(a, b, to); }, before, after, out);
    if (before.velocity || after.velocity) {
      const Velocity& first = before.velocity ? *before.velocity : *after.velocity;
      // If the velocities use different axes, the first one is used for both.
      const bool alike = after.velocity && same(first.to_index, after.velocity->to_index);
      out.velocity = Velocity{{}, first.to_index};
      pairs.add_kind(first.parts, alike ? after.velocity->parts : first.parts, out.velocity->parts);
    }
    constexpr double gathering = 0.8;
    std::vector<SourceGrid> grids = Blending(pairs, of_matter, part, progress, portion.part(0.0, gathering)).run();
    for (std::size_t i = 0; i < pairs.out.size(); ++i) {
      if (pairs.first[i] == &pairs.nothing) pairs.first[i] = pairs.second[i];
    }
    assemble_in_place_of(pairs.first, std::move(grids), pairs.out, progress, portion.part(gathering, 1.0));
    for (ScalarVolume* field : pairs.out) field->index_to_world = lattice;
    return out;
  });
}

}  // namespace

VolumeFrame blend(const VolumeFrame& before, const VolumeFrame& after, double part, Progress* progress) {
  return blend(before, after, part, progress, {});
}

VolumeFrame between(const VolumeFrame& before, const VolumeFrame& after, double part, double seconds,
                    Progress* progress) {
  if (part == 0.0) return before;
  if (part == 1.0) return after;
  if (!before.velocity || !after.velocity) return blend(before, after, part, progress);
  constexpr double moving = 0.4;
  const VolumeFrame on = advect(before, part * seconds, progress, 0.0, moving);
  const VolumeFrame back = advect(after, (part - 1.0) * seconds, progress, moving, 2.0 * moving);
  return blend(on, back, part, progress, {2.0 * moving, 1.0});
}

}  // namespace cumulet::volume
