#pragma once

// The viewer handle of the C ABI, and the guard for calls on it.

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
  pid_t process = getpid();  // a forked child has neither the viewer's threads nor its context
  cumulet::c_abi::KeptHandle<cumulet_volume> volume;
  cumulet::c_abi::KeptHandle<cumulet_surfaces> surfaces;
  cumulet::c_abi::KeptHandle<cumulet_environment> environment;
};

namespace cumulet::c_abi {

/// Runs a call on a viewer, with the checks of the other overloads. The message of an exception becomes its last error.
template <class Call>
cumulet_status guarded(cumulet_viewer* viewer, Call&& call) noexcept {
  // Inside a callback last_error must not be touched, because another thread may be in a call.
  if (viewer == nullptr || CallbackScope::inside()) return CUMULET_ERROR_INVALID_ARGUMENT;
  const HostCall host_call;
  return guarded(viewer->last_error, [&] {
    if (host_call.refused()) throw Error(ErrorCode::cancelled, process_exits);
    if (viewer->process != getpid()) refuse("the viewer belongs to the process that forked this one");
    call(*viewer->viewer);
  });
}

}  // namespace cumulet::c_abi
