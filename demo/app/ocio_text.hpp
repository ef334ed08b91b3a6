#pragma once

#include <string>
#include <string_view>

namespace cumulet::demo {

/// Returns a message about OpenColorIO without the flag that it begins with.
[[nodiscard]] inline std::string ocio_text(std::string_view message) {
  constexpr std::string_view flag = "--ocio ";
  if (message.starts_with(flag)) message.remove_prefix(flag.size());
  return std::string(message);
}

}  // namespace cumulet::demo
