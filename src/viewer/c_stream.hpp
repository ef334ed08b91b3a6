#pragma once

#include <string>

#include "base/byte_source.hpp"
#include "viewer/c_support.hpp"

namespace cumulet::c_abi {

/// Content that a host's callback reads.
class HostStream final : public ByteSource {
 public:
  explicit HostStream(const cumulet_stream_desc* desc) : desc_(read_desc(desc, "cumulet_stream_desc")) {
    require(desc_.read != nullptr, "cumulet_stream_desc.read is NULL");
    require(desc_.size <= max_size, "cumulet_stream_desc.size is above 2^62");
  }

  [[nodiscard]] std::uint64_t size() const override { return desc_.size; }
  std::size_t read(std::uint64_t position, char* to, std::size_t count) override {
    const std::uint64_t wanted = std::min<std::uint64_t>(count, desc_.size - position);
    if (wanted == 0) return 0;
    const std::uint64_t got = call(position, to, wanted);
    if (got != wanted) {
      throw std::runtime_error("the host's stream returned " + std::to_string(got) + " of " + std::to_string(wanted) +
                               " bytes at position " + std::to_string(position));
    }
    return static_cast<std::size_t>(wanted);
  }

 private:
  static constexpr std::uint64_t max_size = std::uint64_t{1} << 62U;

  [[nodiscard]] std::uint64_t call(std::uint64_t position, char* to, std::uint64_t wanted) const {
    const CallbackScope inside;
    const viewer::WorkerPool::InCallback waits;
    return desc_.read(desc_.read_user, position, to, wanted);
  }

  cumulet_stream_desc desc_;
};

}  // namespace cumulet::c_abi
