#include "render/passes/transmittance_map.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <utility>

#include "base/error.hpp"
#include "gl/bindings.hpp"
#include "render/film/path_features.hpp"
#include "render/pacing/row_dispatches.hpp"

namespace cumulet::render {

namespace {

constexpr std::uint32_t min_size = 16;

struct Axes {
  glm::dvec3 right;
  glm::dvec3 up;
};

// Returns two unit vectors that are perpendicular to a unit vector and to each other.
Axes axes_about(const glm::dvec3& forward) {
  const glm::dvec3 aside = std::abs(forward.y) < 0.9 ? glm::dvec3(0.0, 1.0, 0.0) : glm::dvec3(1.0, 0.0, 0.0);
  const glm::dvec3 right = glm::normalize(glm::cross(forward, aside));
  return {right, glm::cross(right, forward)};
}

// Returns the distance of a point from the bounding box of the corners, and from the box's farthest corner.
glm::dvec2 distances(const glm::dvec3& point, const std::vector<glm::dvec3>& corners) {
  glm::dvec3 low(corners.front());
  glm::dvec3 high(corners.front());
  for (const glm::dvec3& corner : corners) {
    low = glm::min(low, corner);
    high = glm::max(high, corner);
  }
  const glm::dvec3 nearest = glm::clamp(point, low, high);
  const glm::dvec3 farthest = glm::max(glm::abs(low - point), glm::abs(high - point));
  return {glm::distance(point, nearest), glm::length(farthest)};
}

}  // namespace

TransmittanceMap::Made TransmittanceMap::make(const gl::FunctionsPtr& gl, std::uint32_t size, std::uint32_t slices) {
  Made made;
  made.size = size;
  made.slices = slices;
  const int side = static_cast<int>(size);
  made.texture = gl::make_texture_3d(gl, GL_R16F, side, side, static_cast<int>(slices), "creating a transmittance map");
  gl->TextureParameteri(made.texture.name(), GL_TEXTURE_MIN_FILTER, GL_LINEAR);
  gl->TextureParameteri(made.texture.name(), GL_TEXTURE_MAG_FILTER, GL_LINEAR);
  for (const GLenum axis : {GL_TEXTURE_WRAP_S, GL_TEXTURE_WRAP_T, GL_TEXTURE_WRAP_R})
    gl->TextureParameteri(made.texture.name(), axis, GL_CLAMP_TO_EDGE);
  return made;
}

TransmittanceMap::TransmittanceMap(gl::FunctionsPtr gl, gl::ProgramsPtr programs)
    : gl_(gl), programs_(std::move(programs)), dispatches_in_flight_(std::move(gl)) {}

std::uint64_t TransmittanceMap::bytes() const {
  const auto of = [](const Made& made) { return std::uint64_t{2} * made.size * made.size * made.slices; };
  return of(shown_) + (under_way_ ? of(under_way_->made) : 0);
}

void TransmittanceMap::begin(Of of, const scene::Snapshot& snapshot, GpuScene& scene) {
  const std::vector<glm::dvec3> corners = scene.corners();
  const MapRequest& request = of.request;
  const std::uint32_t size = std::max(min_size, request.size >> coarser_);
  UnderWay next;
  scene::Viewpoint view;
  if (request.light.kind == MapLight::Kind::parallel) {
    const glm::dvec3 forward = -request.light.towards;
    const Axes axes = axes_about(forward);
    const glm::dvec3 right = axes.right;
    const glm::dvec3 up = axes.up;
    const auto seen = [&](const glm::dvec3& p) {
      return glm::dvec3(glm::dot(p, right), glm::dot(p, up), glm::dot(p, forward));
    };
    glm::dvec3 low = seen(corners.front());
    glm::dvec3 high = low;
    for (const glm::dvec3& corner : corners) {
      low = glm::min(low, seen(corner));
      high = glm::max(high, seen(corner));
    }
    const glm::dvec3 middle = 0.5 * (low + high);
    // Rays of the outermost texels miss all volumes. Beyond the map, where these texels are repeated, the transmittance
    // is 1.
    const double margin = 1.0 + 2.0 / (size - 1.0);
    const double least = 1e-6 * glm::length(high - low);
    const glm::dvec3 half = glm::max(0.5 * (high - low) * glm::dvec3(margin, margin, 1.0), glm::dvec3(least));
    view.orthographic = true;
    view.forward = forward;
    view.right = half.x * right;
    view.up = half.y * up;
    view.eye = middle.x * right + middle.y * up + (middle.z - half.z) * forward;
    next.slices_at = {0.0, 2.0 * half.z};
  } else {
    view.eye = request.light.position - of.origin;
    next.slices_at = distances(view.eye, corners);
  }
  scene::Snapshot seen = snapshot;
  seen.view.set(view);
  const PictureParameters picture = scene.parameters(seen, scene.trace_inputs(seen, false), {}, glm::uvec2(size));
  next.parameters.view = picture.view;
  next.parameters.space = picture.space;
  next.parameters.grid = picture.grid;
  next.parameters.medium = picture.medium;
  next.parameters.dispatch.tile_size = glm::uvec2(size);
  next.made = make(gl_, size, request.slices);
  if (view.orthographic) {
    // Rows of texels go down. Slices are at texel centers, from near to far.
    const glm::dvec3 u = view.right / glm::dot(view.right, view.right) * 0.5;
    const glm::dvec3 v = view.up / glm::dot(view.up, view.up) * -0.5;
    const double inner = (request.slices - 1.0) / request.slices;
    const glm::dvec3 w = view.forward * (inner / next.slices_at.y);
    const glm::dvec3 offset(0.5 - glm::dot(u, view.eye), 0.5 - glm::dot(v, view.eye),
                            0.5 / request.slices - glm::dot(w, view.eye));
    next.made.to_map = glm::transpose(glm::dmat4(glm::dvec4(u, offset.x), glm::dvec4(v, offset.y),
                                                 glm::dvec4(w, offset.z), glm::dvec4(0.0, 0.0, 0.0, 1.0)));
  } else {
    next.made.range = next.slices_at;
    next.made.to_map[3] = glm::dvec4(-view.eye, 1.0);
  }
  next.made.to_map = glm::translate(next.made.to_map, -of.origin);
  next.of = std::move(of);
  under_way_ = std::move(next);
}

void TransmittanceMap::collect() {
  while (const auto completed = dispatches_in_flight_.take_completed()) learn_rows(*completed);
}

void TransmittanceMap::show_clear() {
  Made clear = make(gl_, 1, 1);
  const float all = 1.0F;
  gl_->ClearTexImage(clear.texture.name(), 0, GL_RED, GL_FLOAT, &all);
  gl::check(*gl_, "clearing a transmittance map");
  shown_ = std::move(clear);
  shown_of_.reset();
}

void TransmittanceMap::advance(const MapRequest& request, const scene::Snapshot& snapshot, GpuScene& scene,
                               Deadline deadline) {
  if (!shown_.texture) show_clear();
  collect();
  const MarchData* const data = scene.data();
  if (data == nullptr || scene.volumes().empty()) {
    if (shown_of_) show_clear();
    under_way_.reset();
    coarser_ = 0;
    newest_ = true;
    return;
  }
  Of of{request, snapshot.origin, scene.volumes(), scene.data_revision(), scene.instances_revision()};
  for (scene::Volume& volume : of.volumes) {
    volume.source = nullptr;
    volume.frame.reset();
  }
  const bool whole = shown_of_ == of;
  newest_ = whole && shown_.size == request.size;
  if (newest_) {
    under_way_.reset();
    return;
  }
  if (whole) coarser_ = 0;  // the scene rests
  if (under_way_ && under_way_->of != of) {
    under_way_.reset();
    if (request.size >> coarser_ > min_size) ++coarser_;
  }
  const TraceInputs inputs = scene.trace_inputs(snapshot, false);
  const gl::Program& program = programs_->ask(transmittance_key(*data, inputs));
  if (!program.usable()) return;
  if (failed_ == of) return;
  if (!under_way_) {
    try {
      begin(of, snapshot, scene);
    } catch (const Error&) {
      failed_ = std::move(of);  // the error is thrown once
      throw;
    }
  }
  if (!uniforms_)
    uniforms_ = gl::make_buffer(gl_, sizeof(core::CmParameters), nullptr, GL_DYNAMIC_STORAGE_BIT, "creating uniforms");
  UnderWay& work = *under_way_;
  failed_.reset();
  dispatches_in_flight_.order();
  data->bind(*gl_);
  if (inputs.instances != nullptr) inputs.instances->bind(*gl_);
  gl_->BindBufferBase(GL_UNIFORM_BUFFER, core::CM_UNIFORM_PARAMETERS, uniforms_.name());
  gl_->BindImageTexture(core::CM_IMAGE_TRANSMITTANCE_MAP, work.made.texture.name(), 0, GL_TRUE, 0, GL_WRITE_ONLY,
                        GL_R16F);
  const bool point = work.of.request.light.kind == MapLight::Kind::point;
  gl_->ProgramUniform1i(program.name(), 0, point ? 1 : 0);
  gl_->ProgramUniform2f(program.name(), 1, static_cast<float>(work.slices_at.x), static_cast<float>(work.slices_at.y));
  program.use(*gl_);
  const glm::uvec2 size(work.made.size);
  const auto send = [&](glm::uvec2 rows) {
    work.parameters.dispatch.rows = rows;
    gl_->NamedBufferSubData(uniforms_.name(), 0, sizeof(work.parameters), &work.parameters);
    gl_->DispatchCompute((size.x + 7) / 8, (rows.y - rows.x + 7) / 8, 1);
  };
  send_rows(dispatches_in_flight_, cost_, size, work.row, deadline, send, [&] { collect(); });
  gl::memory_barrier(*gl_, GL_TEXTURE_FETCH_BARRIER_BIT | GL_TEXTURE_UPDATE_BARRIER_BIT | GL_BUFFER_UPDATE_BARRIER_BIT);
  gl::check(*gl_, "rendering a transmittance map");
  if (work.row < size.y) return;
  shown_ = std::move(work.made);
  shown_of_ = std::move(work.of);
  under_way_.reset();
  newest_ = shown_.size == request.size;
}

}  // namespace cumulet::render
