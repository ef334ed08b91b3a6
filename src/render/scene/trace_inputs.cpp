#include "render/scene/trace_inputs.hpp"

#include "gl/bindings.hpp"

namespace cumulet::render {

core::CmParameters kernel_parameters(const PictureParameters& picture, const TraceInputs& trace_inputs) {
  core::CmParameters parameters{};
  parameters.view = picture.view;
  parameters.space = picture.space;
  parameters.grid = picture.grid;
  parameters.emissive = picture.emissive;
  parameters.medium = picture.medium;
  parameters.lights = picture.lights;
  parameters.environment = picture.environment;
  parameters.ground = picture.ground;
  parameters.integrator = picture.integrator;
  parameters.shutter = picture.shutter;
  return with_current_inputs(parameters, trace_inputs);
}

core::CmParameters with_current_inputs(core::CmParameters parameters, const TraceInputs& trace_inputs) {
  parameters.host_depth = {trace_inputs.size, trace_inputs.depth != 0 ? trace_inputs.layers : 0};
  if (trace_inputs.scene != nullptr) parameters.surfaces = trace_inputs.scene->tables();
  parameters.analytic_lights.count = trace_inputs.analytic_light_count();
  return parameters;
}

void bind_inputs(const gl::Functions& gl, const TraceInputs& trace_inputs) {
  if (trace_inputs.depth != 0) gl.BindTextureUnit(core::CM_UNIT_HOST_DEPTH, trace_inputs.depth);
  if (trace_inputs.scene != nullptr) trace_inputs.scene->bind(gl);
  if (trace_inputs.environment != nullptr) trace_inputs.environment->bind(gl);
  if (trace_inputs.analytic_lights != nullptr) trace_inputs.analytic_lights->bind(gl);
  if (trace_inputs.instances != nullptr) trace_inputs.instances->bind(gl);
}

}  // namespace cumulet::render
