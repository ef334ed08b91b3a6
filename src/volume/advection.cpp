#include "volume/advection.hpp"

#include <algorithm>
#include <cmath>

#include "volume/gathering.hpp"

namespace cumulet::volume {

using namespace detail;

namespace {

constexpr double longest_step = 2.0;  // voxels

/// Returns empty fields of the same kinds.
VolumeFrame like(const VolumeFrame& frame) {
  VolumeFrame out;
  const auto emplace = [](const auto& field, auto& to) {
    if (field) to.emplace();
  };
  for_each_amount(emplace, frame, out);
  for_each_property(emplace, frame, out);
  if (frame.velocity) out.velocity = Velocity{{}, frame.velocity->to_index};
  return out;
}

/// Returns the number of fields that are amounts per unit volume, density first.
std::size_t amounts_of(const VolumeFrame& frame) {
  std::size_t count = 1;
  for_each_amount([&](const auto& field) { count += field ? 1U : 0U; }, frame);
  return count;
}

/// Returns the frame's fields, followed by the parts of the velocity that advects them.
std::vector<const ScalarVolume*> sources_of(const VolumeFrame& frame) {
  std::vector<const ScalarVolume*> sources = frame.fields();
  for (const ScalarVolume& part : frame.velocity->parts) sources.push_back(&part);
  return sources;
}

class Advection final : Gathering {
 public:
  Advection(const VolumeFrame& frame, double seconds, Progress* progress, Portion portion)
      : Gathering(sources_of(frame), frame.fields().size(), progress, portion),
        fields_(frame.fields().size()),
        of_matter_(amounts_of(frame)),
        moves_(seconds * frame.velocity->to_index) {
    for (const ScalarVolume& part : frame.velocity->parts) {
      if (!part.empty()) carried_.expand({part.bounds_min, part.bounds_max});
    }
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double above = frame.velocity->parts[2 * axis].max_value;
      const double below = frame.velocity->parts[2 * axis + 1].max_value;
      const glm::dvec3 most = moves_[static_cast<int>(axis)] * above;
      const glm::dvec3 least = moves_[static_cast<int>(axis)] * -below;
      least_ += glm::min(glm::min(most, least), 0.0);
      most_ += glm::max(glm::max(most, least), 0.0);
    }
    least_ = glm::max(least_, -farthest_voxels);
    most_ = glm::min(most_, farthest_voxels);
  }

  std::vector<SourceGrid> run() {
    Box box;
    for (std::size_t i = 0; i < fields_; ++i) {
      const ScalarVolume& field = source(i);
      if (field.empty()) continue;
      box.expand(
          {field.bounds_min + glm::ivec3(glm::floor(least_)) - 1, field.bounds_max + glm::ivec3(glm::ceil(most_)) + 1});
    }
    return gather(box);
  }

 private:
  [[noreturn]] void too_large() const override { fail("is too large to be advected"); }

  [[nodiscard]] Box support(std::size_t i, const Box& box) const override {
    const Box way{box.min - glm::ivec3(glm::ceil(most_ + alike)), box.max + glm::ivec3(glm::ceil(alike - least_))};
    if (i < fields_) return way;
    return {glm::clamp(way.min, carried_.min, carried_.max), glm::clamp(way.max, carried_.min, carried_.max)};
  }

  // Returns the displacement at p over the whole time, in voxels.
  [[nodiscard]] glm::dvec3 movement(std::span<const Window> windows, const glm::dvec3& p) const {
    const glm::dvec3 known = glm::clamp(p, glm::dvec3(carried_.min), glm::dvec3(carried_.max));
    const auto part = [&](std::size_t i) { return windows[fields_ + i].at(known); };
    const glm::dvec3 velocity(part(0) - part(1), part(2) - part(3), part(4) - part(5));
    return glm::clamp(moves_ * velocity, least_, most_);
  }

  // Returns the departure point of the matter that arrives at p.
  [[nodiscard]] glm::dvec3 departure(std::span<const Window> windows, glm::dvec3 p) const {
    for (double left = 1.0; left > 0.0;) {
      const glm::dvec3 here = movement(windows, p);
      const double length = glm::length(here);
      const double step = length * left > longest_step ? longest_step / length : left;
      if (length > 0.0) p -= step * movement(windows, p - 0.5 * step * here);
      left -= step;
    }
    return p;
  }

  // Interpolates a field with density weights, or without weights where the density is 0.
  static double weighed(const Window& field, const Window& density, const glm::dvec3& p) {
    double weight = 0.0;
    double sum = 0.0;
    for_each_corner(p, [&](const glm::ivec3& corner, double part) {
      const double there = part * density.voxel(corner);
      weight += there;
      sum += there * field.voxel(corner);
    });
    return weight > 0.0 ? sum / weight : field.at(p);
  }

  void sample(const glm::ivec3& origin, std::span<const Window> windows, std::span<const std::size_t> wanted,
              std::span<Brick> bricks) const override {
    for (std::size_t i = 0; i < brick_voxels; ++i) {
      const glm::ivec3 voxel = origin + glm::ivec3(i >> 6U, (i >> 3U) & 7U, i & 7U);
      const glm::dvec3 was = departure(windows, glm::dvec3(voxel));
      for (std::size_t f = 0; f < wanted.size(); ++f) {
        const Window& field = windows[wanted[f]];
        const double value = wanted[f] < of_matter_ ? field.at(was) : weighed(field, windows[0], was);
        bricks[f][i] = static_cast<float>(value);
      }
    }
  }

  std::size_t fields_;
  std::size_t of_matter_;  // number of fields that are amounts per unit volume, density first
  glm::dmat3 moves_;       // displacement in voxels over the whole time = moves_ * velocity of the frame
  Box carried_;            // bounds of the velocity voxels
  glm::dvec3 least_{0.0};  // bounds of the displacement along each axis
  glm::dvec3 most_{0.0};
};

}  // namespace

VolumeFrame advect(const VolumeFrame& frame, double seconds, Progress* progress, double from, double to) {
  const auto moves = [](const ScalarVolume& part) { return part.max_value > 0.0F; };
  if (seconds == 0.0 || !frame.velocity || std::ranges::none_of(frame.velocity->parts, moves)) return frame;
  return naming("\"" + frame.density.name + "\"", [&] {
    constexpr double gathering = 0.8;
    const Portion whole{from, to};
    std::vector<SourceGrid> grids = Advection(frame, seconds, progress, whole.part(0.0, gathering)).run();
    VolumeFrame out = like(frame);
    assemble_in_place_of(frame.fields(), std::move(grids), out.fields(), progress, whole.part(gathering, 1.0));
    return out;
  });
}

}  // namespace cumulet::volume
