#pragma once

// Private to volume/: the file as both readers' libraries see it.

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <istream>
#include <optional>
#include <streambuf>
#include <vector>

#include "base/progress_part.hpp"

namespace cumulet::volume::detail {

/// A file as a stream that tells how much of it was read and, cancelled, throws Error(cancelled) out of the read,
/// through whatever library is reading. Seeks within its buffer cost nothing: OpenVDB seeks at every leaf. After others
/// it reads little ahead, and more with each read: heads of grids lie far apart, and shared storage pays for each byte.
class SourceFile final : public std::istream {
 public:
  /// Throws std::runtime_error if it cannot be opened.
  SourceFile(const std::filesystem::path& file, Progress* progress);

  [[nodiscard]] std::int64_t size() const { return buffer_.size(); }
  /// From this place on, bytes of the file and whatever is added to the part count towards total.
  ProgressPart& begin(double from, double to, std::uint64_t total) { return buffer_.begin(from, to, total); }
  /// Holds cancellation off where a throw would lose memory; off it comes with the next read.
  void hold(bool held) { buffer_.hold(held); }

 private:
  class Buffer final : public std::streambuf {
   public:
    Buffer(const std::filesystem::path& file, Progress* progress);
    [[nodiscard]] std::int64_t size() const { return size_; }
    ProgressPart& begin(double from, double to, std::uint64_t total) {
      part_.emplace(progress_, from, to, total);
      part_->add(static_cast<std::uint64_t>(egptr() - gptr()));  // read already
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

    static constexpr std::size_t least_read = std::size_t{16} << 10U;

    std::filebuf file_;
    std::vector<char> bytes_;
    std::size_t next_read_ = least_read;
    std::int64_t size_ = 0;
    std::int64_t end_ = 0;  ///< place in the file of the buffer's end, and of file_
    Progress* progress_;
    std::optional<ProgressPart> part_;
    bool held_ = false;
  };
  Buffer buffer_;
};

}  // namespace cumulet::volume::detail
