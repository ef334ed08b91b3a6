#pragma once

#include <string>

namespace cumulet::demo {

/// Opens the folder of a file in the desktop's file manager, by xdg-open. Does not wait for it. Returns false if
/// xdg-open is missing.
[[nodiscard]] bool show_in_folder(const std::string& path);

}  // namespace cumulet::demo
