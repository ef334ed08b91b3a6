#include "gl/share_group.hpp"

#include <array>
#include <cstdint>

#include "base/error.hpp"
#include "gl/compatibility_functions.hpp"
#include "gl/compatibility_state.hpp"

namespace cumulet::gl {

ShareGroup::ShareGroup(FunctionsPtr gl)
    : gl_(std::move(gl)),
      token_(make_buffer(gl_, 4, nullptr, 0, "creating the share group's token")),
      label_("cumulet: share group " + std::to_string(reinterpret_cast<std::uintptr_t>(this))) {
  gl_->ObjectLabel(GL_BUFFER, token_.name(), static_cast<GLsizei>(label_.size()), label_.c_str());
  check(*gl_, "creating the share group's token");
  keeps_label_ = has_label();
}

bool ShareGroup::is_current() const {
  return gl_->IsBuffer(token_.name()) != GL_FALSE && (!keeps_label_ || has_label());
}

bool ShareGroup::has_label() const {
  std::array<char, 64> label{};  // longer than label_
  gl_->GetObjectLabel(GL_BUFFER, token_.name(), static_cast<GLsizei>(label.size()), nullptr, label.data());
  return label_ == label.data();
}

void ShareGroup::require() const {
  if (is_current()) return;
  check_reset(*gl_);
  const BetweenBeginAndEnd between = between_begin_and_end(*gl_);
  if (between.certain) throw Error(ErrorCode::gl, between_begin_and_end_message);
  throw Error(ErrorCode::gl, std::string("no OpenGL context is current on this thread, or the current one does not "
                                         "share objects with the viewer's context") +
                                 (between.possible ? ", or the function was called between glBegin and glEnd" : ""));
}

}  // namespace cumulet::gl
