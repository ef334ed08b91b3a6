#include "surfaces.hpp"

#include <algorithm>

#include "support/surfaces.hpp"

namespace cumulet::bench {

scene::ModelSourcePtr surfaces_in(const viewer::Bounds& bounds) {
  const glm::vec3 low(bounds.min);
  const glm::vec3 extent(bounds.max - bounds.min);
  const auto scene = std::make_shared<test::StillScene>();
  surface::Material material;
  material.base_color = glm::vec4(0.6F, 0.55F, 0.5F, 1.0F);
  material.metallic = 0.0F;
  material.roughness = 0.4F;
  const std::uint32_t number = scene->add(material);
  // The terrain's heights reach 0.12 to both sides.
  scene->add_mesh(test::moved(test::terrain(300), extent * glm::vec3(0.98F, 0.9F, 0.98F),
                              low + extent * glm::vec3(0.01F, 0.12F, 0.01F)),
                  number);
  const float radius = 0.2F * std::min({extent.x, extent.y, extent.z});
  scene->add_mesh(test::moved(test::icosphere(5), glm::vec3(radius), low + 0.5F * extent), number);
  return test::source_of(scene);
}

}  // namespace cumulet::bench
