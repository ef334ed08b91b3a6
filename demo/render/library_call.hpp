#pragma once

#include <cumulet/cumulet.h>

#include <stdexcept>
#include <string>

namespace cumulet::demo {

/// Throws the library's line about a call that failed. It is read after the call, so that the order in which arguments
/// are evaluated does not matter. viewer: of the call; null: it was one without a viewer. file: begins the line; "":
/// none.
inline void check_call(cumulet_status status, const cumulet_viewer* viewer = nullptr, const std::string& file = "") {
  if (status == CUMULET_OK) return;
  const std::string line = cumulet_last_error(viewer);
  throw std::runtime_error((file.empty() ? "" : file + ": ") + (line.empty() ? cumulet_status_text(status) : line));
}

}  // namespace cumulet::demo
