#include "render/passes/inspector.hpp"

#include <algorithm>
#include <array>

#include "gl/bindings.hpp"

namespace cumulet::render {

namespace {

constexpr std::uint32_t view_depth = 5;  // as in inspect.comp

}  // namespace

bool Inspector::trace_view(Picture& picture, const MarchData& data, const TraceInputs& trace_inputs,
                           Deadline deadline) {
  const std::vector<FilmLayer> layers = picture.accumulated_layers();
  const auto work = [&](Film&, Deadline until) { return find_view(picture, data, trace_inputs, until); };
  return run(gl_, picture.film(), {"cumulet: samples", layers, layers, work}, deadline);
}

bool Inspector::find_view(Picture& picture, const MarchData& data, const TraceInputs& trace_inputs, Deadline deadline) {
  const TraceProgram& program = programs_.get(inspect_key(data, trace_inputs));
  dispatches_.order();
  dispatches_.use(*program.object, data, trace_inputs);
  bind_samples(*gl_, picture);
  const core::CmParameters parameters = with_current_inputs(picture.parameters(), trace_inputs);
  picture.change_all(dispatches_.next_revision());
  const PixelBox& box = picture.box();
  const bool done = dispatches_.run_rows(box, parameters, program.cost, picture.view_row(), deadline);
  picture.accumulation().set_known_pixels(std::uint64_t{box.size.x} * std::min(picture.view_row(), box.size.y));
  return done;
}

bool Inspector::trace_depth(Picture& picture, const MarchData& data, const TraceInputs& trace_inputs,
                            Deadline deadline) {
  if (picture.film().has(film_layers::depth)) return true;
  if (!programs_.asked([&] { programs_.get(inspect_key(data, trace_inputs)); })) return false;
  const auto work = [&](const Film& film, Deadline until) {
    dispatches_.order();
    const TraceProgram& program = programs_.get(inspect_key(data, trace_inputs));
    dispatches_.use(*program.object, data, trace_inputs);
    film.bind(*gl_, core::CM_IMAGE_SUM, film_layers::radiance, GL_READ_WRITE);
    film.bind(*gl_, core::CM_IMAGE_COUNTS, film_layers::counts, GL_READ_WRITE);
    film.bind(*gl_, core::CM_IMAGE_VOLUME_Z, film_layers::depth, GL_WRITE_ONLY);
    core::CmParameters parameters = with_current_inputs(picture.parameters(), trace_inputs);
    parameters.dispatch.view = view_depth;
    if (picture.depth_row() == 0) clear_outside_box(*gl_, picture, std::array{film_layers::depth});
    return dispatches_.run_rows(picture.box(), parameters, program.cost, picture.depth_row(), until);
  };
  return run(gl_, picture.film(), {"cumulet: depth", {}, {film_layers::depth}, work}, deadline);
}

Picked Inspector::pick(const MarchData& data, const PictureParameters& parameters, const TraceInputs& trace_inputs,
                       glm::uvec2 pixel) {
  dispatches_.order();
  if (!depth_) depth_ = gl::make_texture_2d(gl_, GL_R32F, 1, 1, "creating the pick texture");
  if (!object_) object_ = gl::make_texture_2d(gl_, GL_RG32UI, 1, 1, "creating the pick result");
  core::CmParameters p = kernel_parameters(parameters, trace_inputs);
  p.dispatch.tile_corner = pixel;
  p.dispatch.tile_size = glm::uvec2(1U);
  p.dispatch.view = view_depth;
  p.dispatch.picks = 1;
  p.dispatch.rows = {0U, 1U};
  dispatches_.use(*programs_.get(inspect_key(data, trace_inputs)).object, data, trace_inputs);
  gl_->BindImageTexture(core::CM_IMAGE_SUM, 0, 0, GL_FALSE, 0, GL_WRITE_ONLY, GL_RGBA32F);
  gl_->BindImageTexture(core::CM_IMAGE_COUNTS, object_.name(), 0, GL_FALSE, 0, GL_WRITE_ONLY, GL_RG32UI);
  gl_->BindImageTexture(core::CM_IMAGE_VOLUME_Z, depth_.name(), 0, GL_FALSE, 0, GL_WRITE_ONLY, GL_R32F);
  dispatches_.set(p);
  gl_->DispatchCompute(1, 1, 1);
  gl::memory_barrier(*gl_, GL_TEXTURE_UPDATE_BARRIER_BIT | GL_BUFFER_UPDATE_BARRIER_BIT);
  Picked picked;
  glm::uvec2 object(0U);
  gl_->GetTextureImage(depth_.name(), 0, GL_RED, GL_FLOAT, sizeof(picked.z), &picked.z);
  gl_->GetTextureImage(object_.name(), 0, GL_RG_INTEGER, GL_UNSIGNED_INT, sizeof(object), &object);
  gl::check(*gl_, "picking");
  if (object.x == 1U) picked.volume = object.y;
  if (object.x == 2U) picked.triangle = object.y;
  return picked;
}

}  // namespace cumulet::render
