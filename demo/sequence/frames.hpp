#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace cumulet::demo {

/// A frame's number: not negative.
using Frame = std::uint32_t;

/// The largest that there is.
inline constexpr Frame last_frame = 9'999'999;

/// "5", "1-100", "1-100x2" (1, 3, 5, ... up to 100) and several of them between commas, in the order they are named in,
/// each frame once. Throws UsageError, which quotes what it cannot read.
[[nodiscard]] std::vector<Frame> parse_frames(std::string_view text);

/// The same in few words, of frames in any order: "1-3, 7, 10-20".
[[nodiscard]] std::string frames_text(const std::vector<Frame>& frames);

}  // namespace cumulet::demo
