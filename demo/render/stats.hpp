#pragma once

#include "options.hpp"
#include "render_viewer.hpp"

namespace cumulet::demo {

/// Writes the file of --stats. Scripts rely on its names and units: keys may be added, never renamed. Values that do
/// not apply are omitted. Throws std::runtime_error.
void write_stats(const RenderOptions& options, const Viewer& viewer, const char* backend);

}  // namespace cumulet::demo
