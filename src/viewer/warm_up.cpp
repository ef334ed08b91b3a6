// The warm-up of a viewer's context before the first frame.

#include <algorithm>
#include <chrono>

#include "base/error.hpp"
#include "gl/transient_framebuffer.hpp"
#include "light/light_table.hpp"
#include "viewer/context.hpp"

namespace cumulet::viewer {

WarmUp Context::warm_up(const Shot& shot, const Frame& frame, bool all, bool waits, render::Deadline deadline) {
  if (!shader_warm_up_) {
    shader_warm_up_ = std::make_unique<render::ShaderWarmUp>(functions_, programs_);
    warm_ = 0.0;
    unbuilt_.reset();
  }
  WarmUp result;
  const bool known = !waits && !scene_.uploading();
  try {
    result.more = !known || !warm_up_step(shot, frame, all, deadline);
  } catch (...) {
    shader_warm_up_.reset();
    throw;
  }
  if (!result.more) shader_warm_up_.reset();
  // Progress: compiling counts for half and first use for half. Programs that are not used count fully once compiled.
  const gl::Programs::Counts counts = programs_->counts();
  const std::size_t wanted = all ? std::max(counts.asked, gl::all_programs().size()) : counts.asked;
  const std::size_t done = 2 * counts.failed + counts.usable + (all ? counts.usable : counts.ready);
  const double part = 0.5 * static_cast<double>(done) / static_cast<double>(std::max<std::size_t>(1, wanted));
  if (known) warm_ = result.more ? std::max(warm_, std::min(part, 0.99)) : 1.0;
  result.progress = warm_;
  return result;
}

template <class Part>
bool Context::done_or_failed(Part&& part) {
  try {
    return part();
  } catch (const Error& error) {
    if (error.code() != ErrorCode::gl) throw;
    gl::check_reset(*functions_);
    gl::clear_errors(*functions_);
    if (!unbuilt_) unbuilt_ = error;
    return true;
  }
}

bool Context::warm_up_step(const Shot& shot, const Frame& frame, bool all, render::Deadline deadline) {
  if (!all) return warm_up_frame(shot, frame, deadline);
  if (!done_or_failed([&] { return warm_up_frame(shot, frame, deadline); })) return false;
  bool there = true;
  for (const gl::ProgramKey& key : gl::all_programs()) {
    const gl::Program::State before = programs_->state(key);
    there = done_or_failed([&] { return programs_->ask(key).usable(); }) && there;
    // At least one program per call, even if the frame's own programs took all the time.
    if (programs_->state(key) != before && std::chrono::steady_clock::now() >= deadline) return false;
  }
  if (there && unbuilt_) throw Error(*unbuilt_);
  return there;
}

bool Context::warm_up_frame(const Shot& shot, const Frame& frame, render::Deadline deadline) {
  shader_warm_up_->begin();
  const bool drawing = draws(shot, frame);
  if (drawing) {
    render::Picture& empty = shader_warm_up_->empty();
    if (!empty.film().has(render::film_layers::radiance)) shader_warm_up_->tracer().clear(empty);
    shader_warm_up_->tracer().set_background(empty, scene_.lights(*shot.scene).sky_radiance);
    warm_up_drawing(shot, frame, empty);
  }
  if (shot.view()) {
    take_host_depth(shot, frame);
    const auto draw = [&](const render::Picture& shown) {
      if (drawing) warm_up_drawing(shot, frame, shown);
    };
    if (scene_.data() != nullptr) {
      const render::TraceInputs inputs = trace_inputs(shot);
      if (!shader_warm_up_->advance(request(shot, frame, inputs), *scene_.data(), inputs, deadline, draw)) return false;
    }
    if (host_depth_.waits_for_program()) return false;
  }
  return !shader_warm_up_->lags();
}

void Context::warm_up_drawing(const Shot& shot, const Frame& frame, const render::Picture& shown) {
  const render::PictureTextures picture = textures_of(shown, nullptr);
  render::FrameTarget target = Context::target(shot, frame, shown);
  target.region = {};  // a warm-up image has no render region
  if (frame.target == Target::framebuffer) {
    shader_warm_up_->draw(picture, display(shot, frame, shown), target);
    return;
  }
  const gl::Object color = gl::make_texture_2d(functions_, frame.format, 1, 1, "creating the warm-up target");
  gl::Object depth;
  if (frame.write_depth) {
    depth =
        gl::make_texture_2d(functions_, GL_DEPTH_COMPONENT32F, 1, 1, "creating the depth buffer of the warm-up target");
  }
  const gl::TransientFramebuffer framebuffer(functions_, color.name(), depth.name());
  target.framebuffer = framebuffer.name();
  target.blend_over = false;
  shader_warm_up_->draw(picture, display(shot, frame, shown), target);
}

}  // namespace cumulet::viewer
