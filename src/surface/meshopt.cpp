#include "surface/meshopt.hpp"

#include <meshoptimizer.h>

#include "base/detached_work.hpp"

namespace cumulet::surface::detail {

std::vector<std::uint8_t> decode_meshopt(const tinygltf::Value& extension, std::span<const std::uint8_t> from,
                                         const std::shared_ptr<const void>& owner, const std::string& what,
                                         Budget& budget) {
  const auto number = [&extension](const char* key) {
    return extension.Has(key) ? static_cast<std::size_t>(extension.Get(key).GetNumberAsDouble()) : std::size_t{0};
  };
  const auto text = [&extension](const char* key, const char* otherwise) {
    return extension.Has(key) ? extension.Get(key).Get<std::string>() : std::string(otherwise);
  };
  const std::size_t count = number("count");
  const std::size_t stride = number("byteStride");
  const std::string mode = text("mode", "");
  const std::string filter = text("filter", "NONE");
  const bool attributes = mode == "ATTRIBUTES";
  const bool triangles = mode == "TRIANGLES";
  // The decoders assert all of these conditions.
  bool good = attributes ? stride > 0 && stride <= 256 && stride % 4 == 0
                         : (triangles || mode == "INDICES") && (stride == 2 || stride == 4) && filter == "NONE";
  if (triangles) good = good && count % 3 == 0;
  if (filter == "OCTAHEDRAL") {
    good = good && (stride == 4 || stride == 8);
  } else if (filter == "QUATERNION") {
    good = good && stride == 8;
  } else if (filter != "EXPONENTIAL" && filter != "NONE") {
    good = false;
  }
  if (!good) malformed(what + ": EXT_meshopt_compression is malformed");
  // The format's best case is one byte for 64 (16 vertices per group, 4 group headers per byte).
  if (count > (from.size() * 128 + 65536) / stride) {
    malformed(what + ": " + std::to_string(from.size()) + " bytes cannot hold " + std::to_string(count) + " elements");
  }
  budget.take(count, stride, what);
  return run_cancellable(budget.progress_for(count * stride), [=] {
    std::vector<std::uint8_t> bytes(count * stride);
    int status = 0;
    if (count != 0) {
      if (attributes) status = meshopt_decodeVertexBuffer(bytes.data(), count, stride, from.data(), from.size());
      if (triangles) status = meshopt_decodeIndexBuffer(bytes.data(), count, stride, from.data(), from.size());
      if (mode == "INDICES") {
        status = meshopt_decodeIndexSequence(bytes.data(), count, stride, from.data(), from.size());
      }
    }
    if (status != 0) malformed(what + " cannot be decompressed (EXT_meshopt_compression)");
    if (filter == "OCTAHEDRAL") meshopt_decodeFilterOct(bytes.data(), count, stride);
    if (filter == "QUATERNION") meshopt_decodeFilterQuat(bytes.data(), count, stride);
    if (filter == "EXPONENTIAL") meshopt_decodeFilterExp(bytes.data(), count, stride);
    static_cast<void>(owner);
    return bytes;
  });
}

}  // namespace cumulet::surface::detail
