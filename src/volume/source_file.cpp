#include "volume/source_file.hpp"

#include <algorithm>
#include <cstring>
#include <stdexcept>

namespace cumulet::volume::detail {

SourceFile::SourceFile(const std::filesystem::path& file, Progress* progress)
    : std::istream(nullptr), buffer_(file, progress) {
  rdbuf(&buffer_);
  exceptions(std::ios::failbit | std::ios::badbit);
}

SourceFile::Buffer::Buffer(const std::filesystem::path& file, Progress* progress)
    : bytes_(std::size_t{256} << 10U), progress_(progress) {
  file_.pubsetbuf(nullptr, 0);
  if (file_.open(file, std::ios::in | std::ios::binary) == nullptr) throw std::runtime_error("cannot be opened");
  size_ = static_cast<std::int64_t>(std::filesystem::file_size(file));
}

SourceFile::Buffer::int_type SourceFile::Buffer::underflow() {
  if (!held_) check(progress_);
  const std::streamsize got = file_.sgetn(bytes_.data(), static_cast<std::streamsize>(next_read_));
  next_read_ = std::min(2 * next_read_, bytes_.size());
  setg(bytes_.data(), bytes_.data(), bytes_.data() + got);
  end_ += got;
  if (got == 0) return traits_type::eof();
  if (!held_ && part_) part_->add(static_cast<std::uint64_t>(got));
  return traits_type::to_int_type(*gptr());
}

std::streamsize SourceFile::Buffer::xsgetn(char* to, std::streamsize count) {
  std::streamsize done = 0;
  while (done < count) {
    if (gptr() == egptr() && underflow() == traits_type::eof()) break;
    const std::streamsize n = std::min<std::streamsize>(count - done, egptr() - gptr());
    std::memcpy(to + done, gptr(), static_cast<std::size_t>(n));
    gbump(static_cast<int>(n));
    done += n;
  }
  return done;
}

SourceFile::Buffer::pos_type SourceFile::Buffer::seekoff(off_type offset, std::ios_base::seekdir from,
                                                         std::ios_base::openmode which) {
  const std::int64_t base = from == std::ios_base::beg ? 0 : from == std::ios_base::cur ? position() : size_;
  return seekpos(base + offset, which);
}

SourceFile::Buffer::pos_type SourceFile::Buffer::seekpos(pos_type position, std::ios_base::openmode /*which*/) {
  const std::int64_t target = position;
  if (target < 0 || target > size_) return {off_type{-1}};
  const std::int64_t from_end = end_ - target;
  if (from_end >= 0 && from_end <= egptr() - eback()) {
    setg(eback(), egptr() - from_end, egptr());
  } else {
    if (file_.pubseekpos(target, std::ios::in) != position) return {off_type{-1}};
    setg(nullptr, nullptr, nullptr);
    end_ = target;
    next_read_ = min_read;
  }
  return position;
}

}  // namespace cumulet::volume::detail
