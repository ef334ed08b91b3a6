#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace cumulet::demo {

/// What was put together: of each pixel the samples first to first + samples - 1.
struct Merged {
  std::uint64_t first = 0;
  std::uint64_t samples = 0;
  bool without_denoised = false;  ///< a part had that layer, which no sum of parts gives
  bool without_error = false;     ///< a part had that layer, whose background the parts do not tell
};

/// Puts OpenEXR files of cumulet-render (--first-sample) together, in any order: the file at output is what one process
/// would have made of all their samples, but for rounding. Layers of samples are means weighed by the parts' counts,
/// `error` is of the moments of all; what is known without samples is that of the part with the first. Throws
/// std::runtime_error, one line that names the files, where they do not belong together: other scene, size, seed,
/// version or layers, or samples that two have, or that none has between others.
Merged merge(const std::vector<std::string>& paths, const std::string& output);

}  // namespace cumulet::demo
