#pragma once

// What the C ABI's viewer is, and the wall around calls on it.

#include <unistd.h>

#include <memory>
#include <string>
#include <utility>

#include "viewer/c_handles.hpp"
#include "viewer/c_support.hpp"
#include "viewer/viewer.hpp"

struct cumulet_viewer {
  std::unique_ptr<cumulet::viewer::Viewer> viewer;
  std::string last_error;
  pid_t process = getpid();  // a forked child has neither its threads nor its context
  cumulet::c_abi::KeptHandle<cumulet_volume> volume;
  cumulet::c_abi::KeptHandle<cumulet_surfaces> surfaces;
  cumulet::c_abi::KeptHandle<cumulet_environment> environment;
};

namespace cumulet::c_abi {

/// As its namesakes, of a call that is given the viewer; what it throws is its last error.
template <class Call>
cumulet_status guarded(cumulet_viewer* viewer, Call&& call) noexcept {
  // Not even the message may be touched from inside a callback: another thread may be in a call.
  if (viewer == nullptr || CallbackScope::inside()) return CUMULET_ERROR_INVALID_ARGUMENT;
  const HostCall host_call;
  return guarded(viewer->last_error, [&] {
    if (host_call.refused()) throw Error(ErrorCode::cancelled, process_exits);
    if (viewer->process != getpid()) refuse("the viewer belongs to the process that forked this one");
    call(*viewer->viewer);
  });
}

}  // namespace cumulet::c_abi
