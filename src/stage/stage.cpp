#include "stage/stage.hpp"

#include <algorithm>
#include <limits>
#include <numeric>
#include <utility>

#include "base/corners.hpp"
#include "base/error.hpp"
#include "scene/model_table.hpp"
#include "scene/origin.hpp"
#include "scene/space.hpp"

namespace cumulet::viewer {

namespace {

using glm::dvec3;

// Maximum number of triangles that the camera fit visits individually.
constexpr std::size_t max_vertices = std::size_t{1} << 24U;

Bounds both(const Bounds& a, const Bounds& b) { return {glm::min(a.min, b.min), glm::max(a.max, b.max)}; }

// Box around all of these; nullopt if there are none.
std::optional<Bounds> box_of(const std::vector<Bounds>& boxes) {
  if (boxes.empty()) return std::nullopt;
  return std::accumulate(boxes.begin() + 1, boxes.end(), boxes.front(), both);
}

using Add = std::function<void(const dvec3&)>;

// Adds the vertices of a mesh, or the corners of its box.
void add_mesh(const scene::ModelSource& source, const scene::ModelMesh& mesh, const glm::dmat4& to_world, bool as_box,
              const Add& add) {
  if (as_box) {
    const auto [low, high] = scene::box_of(mesh.bvh);
    for (const dvec3& corner : corners_of(low, high)) add(dvec3(to_world * glm::dvec4(corner, 1.0)));
    return;
  }
  const auto first = source.scene->indices.begin() + 3 * std::ptrdiff_t{mesh.first_triangle};
  for (auto i = first; i != first + 3 * std::ptrdiff_t{mesh.triangle_count}; ++i)
    add(dvec3(to_world * glm::dvec4(source.pose.vertices[*i].position, 1.0)));
}

}  // namespace

Stage::Stage(Jobs& jobs, ReportedFailures& failures, StageHost& host, std::shared_ptr<ResourceLimits> limits, Log log)
    : volumes(jobs, failures, host, std::move(limits), log),
      models(jobs.surfaces, jobs.poses, failures, host),
      sky(jobs.environments, failures, host, log),
      camera(host),
      host_(host),
      log_(std::move(log)) {}

void Stage::rebuild() {
  models.renew_requests();
  volumes.rebuild();
  host_.touch();
}

void Stage::use_surface_camera(std::size_t index) {
  host_.sync();
  camera.copy(models.camera(index), box());
}

void Stage::set_sampling(double shutter_seconds, bool previews) {
  camera.set_shutter(shutter_seconds);
  volumes.set_preview(previews);
  models.set_shutter(shutter_seconds);
  volumes.set_shutter(shutter_seconds);
  host_.touch();
}

bool Stage::input(const InputEvent& event) {
  host_.sync();
  return camera.input(event, subject());
}

void Stage::frame_all() {
  static_cast<void>(bounds());  // throws if there is nothing to fit
  camera.fit(*subject());
}

Bounds Stage::bounds() {
  host_.sync();
  const auto all = box();
  if (!all) throw Error(ErrorCode::invalid_argument, "the scene is empty: no volume and no surfaces");
  return *all;
}

void Stage::sync() {
  volumes.sync();
  revision_ += volumes.take_changes();
  revision_ += models.sync();
  sky.sync();
}

std::uint64_t Stage::tag_of(std::uint64_t id) const {
  if (const auto tag = volumes.tag_of(id)) return *tag;
  return models.tag_of(id).value_or(0);
}

void Stage::prepare(const glm::uvec2& size, bool traces, const std::function<bool()>& displays_newest) {
  host_.sync();
  const auto box = this->box();
  camera.advance(box);

  // Without a scene the last image is dropped too. Models without triangles still count as a scene, lit by the sky
  // only.
  const bool scene = volumes.is_shown() || models.shows_models();
  if (!scene) volumes.drop_grid();
  if (models.shows_models()) volumes.show_nothing(box);

  camera.begin_frame(size);
  volumes.set_view(std::nullopt, size);
  // Without a scene the camera may still wait for its bounds.
  if (size.x > 0 && size.y > 0 && scene) {
    camera.set_view(subject());
    volumes.set_view(camera.view(), size);
    camera.set_previous_view(subject());
  }
  volumes.send_due_requests();
  revision_ += volumes.take_changes();
  if (!traces) return;

  camera.note_traced();
  volumes.request_for_view(camera.rests(), displays_newest);
  revision_ += volumes.take_changes();
}

std::vector<Bounds> Stage::boxes() const {
  std::vector<Bounds> boxes;
  volumes.append_bounds(boxes);
  models.append_bounds(boxes);
  return boxes;
}

std::optional<Bounds> Stage::box() const { return box_of(boxes()); }

std::optional<Subject> Stage::subject() const {
  const auto all = box();
  if (!all) return std::nullopt;
  Subject subject(*all);
  subject.reach = [this](const dvec3& direction, std::span<const dvec3> normals) {
    return seen_reach(direction, normals);
  };
  return subject;
}

std::vector<double> Stage::seen_reach(const dvec3& direction, std::span<const dvec3> normals) const {
  std::vector<double> reach;
  const auto add = [&](const dvec3& p) {
    reach.resize(normals.size(), std::numeric_limits<double>::lowest());
    for (std::size_t i = 0; i < normals.size(); ++i) reach[i] = std::max(reach[i], glm::dot(p, normals[i]));
  };
  volumes.visit_reach(direction, add);
  std::size_t vertices = 0;
  for (const scene::Model& model : models.models()) {
    for (const scene::ModelMesh& mesh : model.source->meshes) {
      for (const glm::dmat4& transform : mesh.transforms) {
        // For many instances the boxes are sufficient.
        vertices += mesh.triangle_count;
        add_mesh(*model.source, mesh, model.to_world * transform, vertices > max_vertices, add);
      }
    }
  }
  return reach;
}

dvec3 Stage::origin(const std::vector<Bounds>& boxes, const std::optional<scene::Ground>& ground) const {
  std::vector<scene::Extent> things;
  things.reserve(boxes.size());
  for (const Bounds& bounds : boxes) things.push_back({bounds.min, bounds.max});
  const std::optional<dvec3> eye = camera.eye();
  if (eye && things.empty() && ground) {
    const dvec3 below(eye->x, ground->height, eye->z);
    things.push_back({below, below});
  }
  return scene::origin_of_scene(things, eye);
}

std::optional<scene::Ground> Stage::ground(const std::optional<Bounds>& all) const {
  const bool on_triangles = sky.has_ground() && models.shows_triangles();
  return sky.ground(all, on_triangles, camera.eye());
}

void Stage::remark_on_precision() {
  for (const scene::Model& model : scene_.models) {
    const surface::ScenePtr& scene = model.source->scene;
    if (scene->precision_remark.empty()) continue;
    std::erase_if(remarked_scenes_, [](const auto& remarked) { return remarked.expired(); });
    const auto is = [&](const auto& remarked) { return remarked.lock() == scene; };
    if (std::ranges::any_of(remarked_scenes_, is)) continue;
    remarked_scenes_.emplace_back(scene);
    log_.warning(scene->precision_remark);
  }
}

scene::SnapshotPtr Stage::snapshot() {
  scene_.volumes = volumes.volumes(scene_.volumes);
  const std::vector<Bounds> boxes = this->boxes();
  const std::optional<scene::Ground> ground = this->ground(box_of(boxes));
  const dvec3 origin = this->origin(boxes, ground);
  scene_.origin = origin;
  if (const auto& lights = sky.analytic_lights(origin); scene_.analytic_lights != lights)
    scene_.analytic_lights = lights;
  volumes.count_from(scene_.volumes, origin);
  scene_.lights = sky.lights();
  scene_.surroundings = sky.surroundings();
  scene_.models = models.models();
  for (scene::Model& model : scene_.models) model = scene::counted_from(std::move(model), origin);
  remark_on_precision();
  const auto seen = [&](const std::optional<ViewFrame>& view) {
    return scene::counted_from(view ? std::optional<scene::Viewpoint>(*view) : std::nullopt, origin);
  };
  scene_.view.set(seen(camera.view()));
  scene_.previous.set({seen(camera.previous_view()), camera.previous_seconds()});
  scene_.view_ends.set(scene::counted_from(camera.view_ends(), origin));
  scene_.ground.set(scene::counted_from(ground, origin));
  if (!snapshot_ || *snapshot_ != scene_) snapshot_ = std::make_shared<const scene::Snapshot>(scene_);
  return snapshot_;
}

}  // namespace cumulet::viewer
