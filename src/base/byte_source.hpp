#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>

namespace cumulet {

/// The content of a file, which may also be in memory or behind a host's callback.
class ByteSource {
 public:
  ByteSource() = default;
  ByteSource(const ByteSource&) = delete;
  ByteSource& operator=(const ByteSource&) = delete;
  virtual ~ByteSource() = default;

  [[nodiscard]] virtual std::uint64_t size() const = 0;
  /// Reads up to `count` bytes from a position, which is at most size(). Returns the bytes read, which are fewer only
  /// at the end. Throws std::runtime_error. One call at a time, on any thread.
  virtual std::size_t read(std::uint64_t position, char* to, std::size_t count) = 0;
};

/// Bytes in memory, which are not copied.
class MemorySource final : public ByteSource {
 public:
  explicit MemorySource(std::span<const std::byte> bytes) : bytes_(bytes) {}

  [[nodiscard]] std::uint64_t size() const override { return bytes_.size(); }
  std::size_t read(std::uint64_t position, char* to, std::size_t count) override {
    const auto from = bytes_.subspan(static_cast<std::size_t>(position));
    const std::size_t bytes = std::min(count, from.size());
    if (bytes > 0) std::memcpy(to, from.data(), bytes);
    return bytes;
  }

 private:
  std::span<const std::byte> bytes_;
};

}  // namespace cumulet
