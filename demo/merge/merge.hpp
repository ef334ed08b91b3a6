#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace cumulet::demo {

/// The merged sample range: samples first to first + samples - 1 of each pixel.
struct Merged {
  std::uint64_t first = 0;
  std::uint64_t samples = 0;
  bool without_denoised = false;  ///< the denoised layer was dropped, because it cannot be computed from the parts
  bool without_error = false;     ///< the error layer was dropped, because its background is not in the files
};

/// Merges OpenEXR files of cumulet-render (--first-sample), given in any order. The output equals a render of all
/// samples by one process, except for rounding. Sampled layers are averaged, weighted by the numbers of samples;
/// `error` is computed from the combined variance. Layers that do not depend on samples are taken from the file with
/// the first samples. Throws std::runtime_error, one line that names the files, if scene, size, seed, version or layers
/// differ, or if sample ranges overlap or leave a gap.
Merged merge(const std::vector<std::string>& paths, const std::string& output);

}  // namespace cumulet::demo
