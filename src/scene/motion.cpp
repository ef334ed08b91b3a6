#include "scene/motion.hpp"

namespace cumulet::scene {

namespace {

using glm::dmat4;

// Returns the transform from world space to view space.
dmat4 into(const Viewpoint& view) {
  const glm::dmat3 back = glm::inverse(glm::dmat3(view.right, view.up, view.forward));
  dmat4 map(back);
  map[3] = glm::dvec4(back * -view.eye, 1.0);
  return map;
}

core::CmMotion map_of(const dmat4& matrix, std::uint32_t vertices = 0) {
  core::CmMotion map{};
  map.x = glm::vec3(matrix[0]);
  map.y = glm::vec3(matrix[1]);
  map.z = glm::vec3(matrix[2]);
  map.origin = glm::vec3(matrix[3]);
  map.vertices = vertices;
  return map;
}

}  // namespace

MotionTable make_motion(const Snapshot& snapshot, const dmat4& ray_to_world, std::span<const Volume> volumes,
                        std::span<const Model> models, const ModelTable* table,
                        const std::function<std::uint32_t(const ModelSource&)>& vertices_of) {
  const Viewpoint now = (*snapshot.view).value_or(Viewpoint{});
  const Viewpoint then = snapshot.previous->view.value_or(now);
  MotionTable made;
  made.frame.orthographic_now = now.orthographic ? 1U : 0U;
  made.frame.orthographic_then = then.orthographic ? 1U : 0U;
  made.frame.seconds = static_cast<float>(snapshot.previous->seconds);
  const dmat4 into_then = into(then);
  made.maps.push_back(map_of(into(now) * ray_to_world));
  made.maps.push_back(map_of(into_then * ray_to_world));
  for (const Volume& volume : volumes) {
    const dmat4& transform = volume.transform.to_world;
    const dmat4 moved = volume.previous ? volume.previous->to_world * glm::inverse(transform) : dmat4(1.0);
    made.maps.push_back(map_of(into_then * moved * ray_to_world));
  }
  made.frame.first_model = static_cast<std::uint32_t>(made.maps.size());
  if (table == nullptr) return made;
  for (const ModelPart& part : table->parts) {
    const Model& model = models[part.model];
    // If the previous scene had other meshes, the current pose is used.
    const ModelSourcePtr& then_posed = model.previous_source;
    const bool alike =
        then_posed && then_posed->meshes.size() == model.source->meshes.size() &&
        then_posed->meshes[part.mesh].transforms.size() == model.source->meshes[part.mesh].transforms.size();
    const ModelSource& source = alike ? *then_posed : *model.source;
    const dmat4 transform = source.meshes.at(part.mesh).transforms.at(part.instance);
    made.maps.push_back(map_of(into_then * model.previous.value_or(model.to_world) * transform, vertices_of(source)));
  }
  return made;
}

}  // namespace cumulet::scene
