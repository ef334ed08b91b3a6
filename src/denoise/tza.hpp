#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "base/file_path.hpp"

namespace cumulet::denoise {

/// An array of any number of dimensions; the last varies fastest.
struct Tensor {
  std::vector<std::uint32_t> shape;
  std::string layout;  ///< a letter per dimension, as in the file: "oihw" for convolution weights, "x" for biases
  std::vector<float> values;
};

/// Tensors by name.
using TensorArchive = std::map<std::string, Tensor>;

/// Reads a tensor archive (.tza) of Intel's Open Image Denoise, version 2. It is little-endian: magic 0x41D7 (16 bits),
/// major and minor version (8 each), offset of the table (64). The table has the number of tensors (32). An entry has
/// the name (length in 16 bits, then characters), number of dimensions (8), extents (32 each), and a layout letter per
/// dimension. It ends with the type ('h' half or 'f' float) and the offset of the values (64), anywhere in the file.
/// name: prefix of messages. Throws Error(file) for anything else: truncated files, values outside of the file, tensors
/// that together are larger than the file, and values that are not finite.
TensorArchive read_tza(std::span<const std::uint8_t> bytes, const std::string& name);
/// Reads a file of at most max_tza_bytes. Messages begin with its path.
TensorArchive read_tza(const FilePath& path);

/// The published networks have 2 MB.
inline constexpr std::size_t max_tza_bytes = std::size_t{64} << 20U;

}  // namespace cumulet::denoise
