#pragma once

// Private to volume/: the input stream for the libraries of both readers.

#include <cstdint>
#include <filesystem>
#include <istream>
#include <memory>
#include <optional>
#include <streambuf>
#include <vector>

#include "base/byte_source.hpp"
#include "base/progress_part.hpp"

namespace cumulet::volume::detail {

/// Opens a file on disk. Throws std::runtime_error with the cause.
std::unique_ptr<ByteSource> open_file(const std::filesystem::path& file);

/// A stream over a file's content that reports read progress. On cancellation it throws Error(cancelled) from the read,
/// through the library that is reading. Seeks within its buffer are free: OpenVDB seeks at every leaf. After other
/// seeks it reads little ahead, and more with each read: grid headers are far from each other, and shared storage is
/// slow per byte.
class SourceFile final : public std::istream {
 public:
  SourceFile(std::unique_ptr<ByteSource> content, Progress* progress);

  [[nodiscard]] std::int64_t size() const { return buffer_.size(); }
  /// Starts a progress range: bytes read from now on, and amounts added to the returned part, count towards `total`.
  ProgressPart& begin(double from, double to, std::uint64_t total) { return buffer_.begin(from, to, total); }
  /// Defers cancellation while a throw would leak memory; after release the next read throws.
  void hold(bool held) { buffer_.hold(held); }

 private:
  class Buffer final : public std::streambuf {
   public:
    Buffer(std::unique_ptr<ByteSource> content, Progress* progress);
    [[nodiscard]] std::int64_t size() const { return size_; }
    ProgressPart& begin(double from, double to, std::uint64_t total) {
      part_.emplace(progress_, from, to, total);
      part_->add(static_cast<std::uint64_t>(egptr() - gptr()));  // bytes already read
      return *part_;
    }
    void hold(bool held) { held_ = held; }

   protected:
    int_type underflow() override;
    std::streamsize xsgetn(char* to, std::streamsize count) override;
    pos_type seekoff(off_type offset, std::ios_base::seekdir from, std::ios_base::openmode which) override;
    pos_type seekpos(pos_type position, std::ios_base::openmode which) override;

   private:
    [[nodiscard]] std::int64_t position() const { return end_ - (egptr() - gptr()); }

    static constexpr std::size_t min_read = std::size_t{16} << 10U;

    std::unique_ptr<ByteSource> content_;
    std::vector<char> bytes_;
    std::size_t next_read_ = min_read;
    std::int64_t size_;
    std::int64_t end_ = 0;  ///< position of the buffer's end within the content
    Progress* progress_;
    std::optional<ProgressPart> part_;
    bool held_ = false;
  };
  Buffer buffer_;
};

}  // namespace cumulet::volume::detail
