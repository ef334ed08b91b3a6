#include "gl/share_group.hpp"

#include "base/error.hpp"

namespace cumulet::gl {

ShareGroup::ShareGroup(FunctionsPtr gl) : gl_(std::move(gl)), token_(gl_->FenceSync(GL_SYNC_GPU_COMMANDS_COMPLETE, 0)) {
  check(*gl_, "creating a sync object");
}

ShareGroup::~ShareGroup() {
  if (!gl_->abandoned.load(std::memory_order_relaxed)) gl_->DeleteSync(token_);
}

void ShareGroup::require() const {
  if (is_current()) return;
  check_reset(*gl_);
  throw Error(ErrorCode::gl,
              "no OpenGL context is current on this thread, or one that does not share objects with the viewer's");
}

}  // namespace cumulet::gl
