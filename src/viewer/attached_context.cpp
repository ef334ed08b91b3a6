#include "viewer/attached_context.hpp"

#include <utility>

#include "base/error.hpp"
#include "gl/compatibility_state.hpp"
#include "gl/state_guard.hpp"

namespace cumulet::viewer {

AttachedContext::AttachedContext(Log log, bool restore_state, std::shared_ptr<Sharing> sharing)
    : log_(std::move(log)),
      restore_state_(restore_state),
      sharing_(sharing ? std::move(sharing) : std::make_shared<Sharing>()) {}

AttachedContext::~AttachedContext() {
  lose_unless_current();
  if (context_) end();
}

Context& AttachedContext::get() const {
  if (!context_) throw Error(ErrorCode::detached, "the viewer is not attached to a GL context");
  return *context_;
}

void AttachedContext::attach(GetProc get_proc, void* user) {
  if (context_) throw Error(ErrorCode::invalid_argument, "the viewer is already attached to a GL context");
  auto functions = gl::load_functions(get_proc, user);
  gl::clear_errors(*functions);
  gl::require_rendering(*functions);
  Commons commons = sharing_->of_current(*functions);
  context_ = std::make_unique<Context>(std::move(functions), std::move(commons));
}

void AttachedContext::detach() {
  if (!context_) return;
  const gl::FunctionsPtr functions = context_->functions();
  if (gl::was_reset(*functions)) {
    lose();
    return;
  }
  context_->group().require();
  end();
  gl::clear_errors(*functions);
}

void AttachedContext::end() {
  const gl::Programs::Turn turn(context_->programs(), log_);
  context_.reset();
}

void AttachedContext::lose() {
  if (!context_) return;
  const gl::Programs::Turn turn(context_->programs(), log_);
  const Commons commons = context_->commons();
  context_->functions()->abandoned = true;
  context_.reset();
  // Another viewer may be attached to another context of the share group.
  if (commons.memories.use_count() > 1) return;
  commons.programs->abandon();
  commons.memories->abandon();
  commons.marches->abandon();
}

void AttachedContext::lose_unless_current() {
  if (context_ && !context_->group().is_current()) lose();
}

void AttachedContext::call(const std::function<void(Context&)>& body) {
  Context& g = get();
  const gl::FunctionsPtr functions = g.functions();
  try {
    gl::clear_errors(*functions);
    gl::check_reset(*functions);
    g.group().require();  // before anything that could not be undone
    gl::require_rendering(*functions);
    const gl::Programs::Turn turn(g.programs(), log_);
    const gl::StateGuard guard(*functions, restore_state_);
    g.find_out_dispatches();
    g.programs()->refresh();
    body(g);
  } catch (const Error& error) {
    // In a lost context every call may fail, so check for loss after any error.
    const bool lost = error.code() == ErrorCode::context_lost || gl::was_reset(*functions);
    if (lost) lose();
    if (lost && error.code() != ErrorCode::context_lost) throw Error(ErrorCode::context_lost, gl::reset_message);
    throw;
  }
  gl::clear_errors(*functions);
}

}  // namespace cumulet::viewer
