#include "scene/origin.hpp"

#include <algorithm>
#include <limits>

#include "base/origin.hpp"

namespace cumulet::scene {

namespace {

using glm::dvec3;

// Maximum distance of an object from the origin, in sizes of the object: float spacing there is 2^-12 of its size.
constexpr double farthest_widths = 4096.0;

double largest(const dvec3& v) { return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)}); }

dvec3 middle_of(const Extent& thing) { return 0.5 * (thing.low + thing.high); }

// Scale at which an object is seen: its own size, or its distance from the eye if that is larger.
double scale_of(const Extent& thing, const dvec3& eye) {
  return std::max(glm::distance(thing.low, thing.high), glm::distance(eye, glm::clamp(eye, thing.low, thing.high)));
}

void move(std::optional<ShutterTransforms>& ends, const dvec3& origin) {
  if (ends)
    ends = ShutterTransforms{cumulet::counted_from(ends->open, origin), cumulet::counted_from(ends->close, origin)};
}

}  // namespace

dvec3 origin_of_scene(std::span<const Extent> things, const std::optional<dvec3>& eye) {
  dvec3 low(std::numeric_limits<double>::infinity());
  dvec3 high(-low);
  for (const Extent& thing : things) {
    low = glm::min(low, thing.low);
    high = glm::max(high, thing.high);
  }
  const double size = glm::distance(low, high);
  dvec3 origin(0.0);
  if (size > 0.0 && std::isfinite(size)) origin = far_origin(low, high, size);
  if (!eye) return origin;
  const Extent* worst = nullptr;
  double widths = farthest_widths;
  for (const Extent& thing : things) {
    const double ratio = largest(middle_of(thing) - origin) / scale_of(thing, *eye);
    if (!(ratio > widths) || !std::isfinite(ratio)) continue;
    widths = ratio;
    worst = &thing;
  }
  if (worst == nullptr) return origin;
  const dvec3 there = middle_of(*worst);
  return far_origin(there, there, scale_of(*worst, *eye));
}

InstanceTransform counted_from(InstanceTransform transform, const dvec3& origin) {
  transform.to_world = cumulet::counted_from(transform.to_world, origin);
  move(transform.ends, origin);
  return transform;
}

Volume counted_from(Volume volume, const dvec3& origin) {
  volume.transform = counted_from(volume.transform, origin);
  if (volume.previous) volume.previous = counted_from(*volume.previous, origin);
  return volume;
}

Model counted_from(Model model, const dvec3& origin) {
  model.to_world = cumulet::counted_from(model.to_world, origin);
  if (model.previous) model.previous = cumulet::counted_from(*model.previous, origin);
  move(model.ends, origin);
  return model;
}

light::AnalyticLights counted_from(light::AnalyticLights analytic_lights, const dvec3& origin) {
  for (light::AnalyticLight& analytic_light : analytic_lights) analytic_light.position -= origin;
  return analytic_lights;
}

std::optional<Viewpoint> counted_from(std::optional<Viewpoint> view, const dvec3& origin) {
  if (view) view->eye -= origin;
  return view;
}

std::optional<ViewEnds> counted_from(std::optional<ViewEnds> ends, const dvec3& origin) {
  if (!ends) return ends;
  ends->open.eye -= origin;
  ends->close.eye -= origin;
  return ends;
}

std::optional<Ground> counted_from(std::optional<Ground> ground, const dvec3& origin) {
  if (ground) ground->height -= origin.y;
  return ground;
}

}  // namespace cumulet::scene
