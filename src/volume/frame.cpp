#include "volume/frame.hpp"

#include <algorithm>
#include <limits>

namespace cumulet::volume {

namespace {

template <class Field, class Frame>
std::vector<Field*> fields_beside_density(Frame& frame) {
  std::vector<Field*> fields;
  const auto add = [&](Field& field) { fields.push_back(&field); };
  const auto add_amount = [&](auto& field) {
    if (field) add(*field);
  };
  const auto add_property = [&](auto& parts) {
    if (parts) std::ranges::for_each(*parts, add);
  };
  for_each_amount(add_amount, frame);
  for_each_property(add_property, frame);
  if (frame.velocity) std::ranges::for_each(frame.velocity->parts, add);
  return fields;
}

}  // namespace

float Velocity::most() const {
  double longest = 0.0;
  const glm::dmat3 rows = glm::transpose(to_index);
  for (int axis = 0; axis < 3; ++axis) longest = std::max(longest, glm::dot(glm::abs(rows[axis]), glm::dvec3(1.0)));
  return static_cast<float>(std::min(fastest_velocity / longest, double{std::numeric_limits<float>::max()}));
}

std::vector<const ScalarVolume*> VolumeFrame::beside_density() const {
  return fields_beside_density<const ScalarVolume>(*this);
}
std::vector<ScalarVolume*> VolumeFrame::beside_density() { return fields_beside_density<ScalarVolume>(*this); }

std::vector<const ScalarVolume*> VolumeFrame::fields() const {
  std::vector<const ScalarVolume*> fields = beside_density();
  fields.insert(fields.begin(), &density);
  return fields;
}
std::vector<ScalarVolume*> VolumeFrame::fields() {
  std::vector<ScalarVolume*> fields = beside_density();
  fields.insert(fields.begin(), &density);
  return fields;
}

}  // namespace cumulet::volume
