#include "volume/source_file.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <ios>
#include <stdexcept>
#include <string>
#include <utility>

namespace cumulet::volume::detail {

namespace {

class DiskFile final : public ByteSource {
 public:
  explicit DiskFile(const std::filesystem::path& file) {
    file_.pubsetbuf(nullptr, 0);
    errno = 0;
    if (file_.open(file, std::ios::in | std::ios::binary) == nullptr)
      throw std::runtime_error(errno != 0 ? std::strerror(errno) : "cannot be opened");
    size_ = std::filesystem::file_size(file);
  }

  [[nodiscard]] std::uint64_t size() const override { return size_; }
  std::size_t read(std::uint64_t position, char* to, std::size_t count) override {
    const auto target = static_cast<std::streamoff>(position);
    if (target != at_ && file_.pubseekpos(target, std::ios::in) != target)
      throw std::runtime_error("cannot be read at position " + std::to_string(position));
    const std::streamsize got = file_.sgetn(to, static_cast<std::streamsize>(count));
    at_ = target + got;
    return static_cast<std::size_t>(got);
  }

 private:
  std::filebuf file_;
  std::uint64_t size_ = 0;
  std::streamoff at_ = 0;
};

}  // namespace

std::unique_ptr<ByteSource> open_file(const std::filesystem::path& file) { return std::make_unique<DiskFile>(file); }

SourceFile::SourceFile(std::unique_ptr<ByteSource> content, Progress* progress)
    : std::istream(nullptr), buffer_(std::move(content), progress) {
  rdbuf(&buffer_);
  exceptions(std::ios::failbit | std::ios::badbit);
}

SourceFile::Buffer::Buffer(std::unique_ptr<ByteSource> content, Progress* progress)
    : content_(std::move(content)),
      bytes_(std::size_t{256} << 10U),
      size_(static_cast<std::int64_t>(content_->size())),
      progress_(progress) {}

SourceFile::Buffer::int_type SourceFile::Buffer::underflow() {
  if (!held_) check(progress_);
  const std::size_t got = content_->read(static_cast<std::uint64_t>(end_), bytes_.data(), next_read_);
  next_read_ = std::min(2 * next_read_, bytes_.size());
  setg(bytes_.data(), bytes_.data(), bytes_.data() + got);
  end_ += static_cast<std::int64_t>(got);
  if (got == 0) return traits_type::eof();
  if (!held_ && part_) part_->add(got);
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
    setg(nullptr, nullptr, nullptr);
    end_ = target;
    next_read_ = min_read;
  }
  return position;
}

}  // namespace cumulet::volume::detail
