#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "base/file_path.hpp"

namespace cumulet::denoise {

/// Numbers of any count of dimensions, the last the fastest.
struct Tensor {
  std::vector<std::uint32_t> shape;
  std::string layout;  ///< a letter a dimension, as the file has it: "oihw" weights of convolutions, "x" biases
  std::vector<float> values;
};

/// Tensors by name.
using TensorArchive = std::map<std::string, Tensor>;

/// The tensor archives (.tza) of Intel's Open Image Denoise, version 2: little-endian; magic 0x41D7 (16 bits), major
/// and minor version (8 each), offset of the table (64). The table: how many tensors (32), and of each its name (length
/// in 16 bits, then letters), count of dimensions (8), extents (32 each), a letter of the layout each, type ('h' half
/// or 'f' float) and the offset of its values (64), anywhere in the file. name: what messages begin with. Throws
/// Error(file) on anything else: what is cut short, what lies outside of the file or over something else, and values
/// that are not finite.
TensorArchive read_tza(std::span<const std::uint8_t> bytes, const std::string& name);
/// The same of a file, whose path messages begin with; of at most most_tza_bytes.
TensorArchive read_tza(const FilePath& path);

/// The published networks have 2 MB.
inline constexpr std::size_t most_tza_bytes = std::size_t{64} << 20U;

}  // namespace cumulet::denoise
