#include "volume/array_pieces.hpp"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <new>
#include <utility>
#include <vector>

#include "base/base64.hpp"
#include "volume/import_detail.hpp"

namespace cumulet::volume::detail {

namespace {

constexpr std::uint64_t max_expansion = 1040;  // zlib's, rounded up
constexpr std::uint64_t max_bytes = std::uint64_t{1} << 50U;
constexpr const char* damaged = "the file is damaged: its compressed values cannot be decoded";

class PlainPieces final : public Pieces {
 public:
  PlainPieces(ByteSource& content, std::uint64_t position, std::uint64_t end)
      : content_(content), position_(std::min(position, end)), end_(end) {}
  std::size_t read(char* to, std::size_t count) override {
    const std::size_t got =
        content_.read(position_, to, static_cast<std::size_t>(std::min<std::uint64_t>(count, end_ - position_)));
    position_ += got;
    return got;
  }

 private:
  ByteSource& content_;
  std::uint64_t position_;
  std::uint64_t end_;
};

/// Decodes gzip or zlib data.
class GzipPieces final : public Pieces {
 public:
  explicit GzipPieces(std::unique_ptr<Pieces> from) : from_(std::move(from)), input_(piece_bytes) {
    constexpr int any_header = 32;
    if (inflateInit2(&zip_, MAX_WBITS + any_header) != Z_OK) throw std::bad_alloc();
  }
  GzipPieces(const GzipPieces&) = delete;
  GzipPieces& operator=(const GzipPieces&) = delete;
  ~GzipPieces() override { inflateEnd(&zip_); }

  std::size_t read(char* to, std::size_t count) override {
    zip_.next_out = reinterpret_cast<Bytef*>(to);
    zip_.avail_out = static_cast<uInt>(count);
    while (zip_.avail_out > 0 && !ended_) {
      if (zip_.avail_in == 0) {
        zip_.next_in = input_.data();
        zip_.avail_in = static_cast<uInt>(from_->read(reinterpret_cast<char*>(input_.data()), input_.size()));
        if (zip_.avail_in == 0) break;
      }
      const int status = inflate(&zip_, Z_NO_FLUSH);
      ended_ = status == Z_STREAM_END;
      if (status != Z_OK && !ended_) fail(damaged);
    }
    return count - zip_.avail_out;
  }

 private:
  std::unique_ptr<Pieces> from_;
  std::vector<Bytef> input_;
  z_stream zip_{};
  bool ended_ = false;
};

/// Decodes base64 text, which the next tag ends.
class Base64Pieces final : public Pieces {
 public:
  explicit Base64Pieces(std::unique_ptr<Pieces> from) : from_(std::move(from)), input_(piece_bytes) {}

  std::size_t read(char* to, std::size_t count) override {
    std::size_t done = 0;
    while (done < count) {
      const char c = next();
      if (c == end) break;
      const Base64Decoder::Step step = decoder_.take(c);
      if (step == Base64Decoder::Step::bad) fail(not_base64);
      if (step == Base64Decoder::Step::byte) to[done++] = static_cast<char>(decoder_.byte());
    }
    return done;
  }
  void end_stream() override {
    while (!decoder_.is_between_groups()) {
      const char c = next();
      if (c == end) fail(end_of_file);
      if (decoder_.take(c) != Base64Decoder::Step::more) fail(not_base64);
    }
    decoder_ = {};
  }

 private:
  static constexpr char end = '<';
  static constexpr const char* not_base64 = "the file is damaged: its values are not base64";

  /// Returns the next character, and `end` from there on.
  char next() {
    if (at_ == got_) {
      got_ = from_->read(input_.data(), input_.size());
      at_ = 0;
      if (got_ == 0) return end;
    }
    return input_[at_] == end ? end : input_[at_++];
  }

  std::unique_ptr<Pieces> from_;
  std::vector<char> input_;
  std::size_t at_ = 0;
  std::size_t got_ = 0;
  Base64Decoder decoder_;
};

std::uint64_t number_of(const char* raw, const ArrayField& field) {
  std::uint64_t number = 0;
  const std::size_t bytes = field.table_number_bytes;
  for (std::size_t i = 0; i < bytes; ++i)
    number = number << 8U | static_cast<std::uint8_t>(raw[field.big_endian ? i : bytes - 1 - i]);
  return number;
}

/// Reads a number before the values of VTK.
std::uint64_t read_number(Pieces& from, const ArrayField& field) {
  std::array<char, 8> raw{};
  if (from.read(raw.data(), field.table_number_bytes) < field.table_number_bytes) fail(end_of_file);
  return number_of(raw.data(), field);
}

/// Decodes the zlib blocks of VTK: the number of blocks, the size of a block, that of the last one (0: a whole one),
/// the compressed size of each block, and the blocks. In base64 the blocks are a second stream.
class VtkPieces final : public Pieces {
 public:
  /// most: bytes that `from` has at most.
  VtkPieces(std::unique_ptr<Pieces> from, const ArrayField& field, std::uint64_t most)
      : from_(std::move(from)), field_(field), most_(most), blocks_(read_number(*from_, field)) {
    block_bytes_ = read_number(*from_, field);
    const std::uint64_t last_bytes = read_number(*from_, field);
    last_bytes_ = last_bytes == 0 ? block_bytes_ : last_bytes;
    if (blocks_ > most / field.table_number_bytes || block_bytes_ > max_block || last_bytes_ > max_block) fail(damaged);
    table_.resize(static_cast<std::size_t>(blocks_) * field.table_number_bytes);
    if (from_->read(table_.data(), table_.size()) < table_.size()) fail(end_of_file);
    from_->end_stream();
  }

  std::size_t read(char* to, std::size_t count) override {
    std::size_t done = 0;
    while (done < count) {
      if (at_ == block_.size()) {
        if (next_ == blocks_) break;
        decode_next();
      }
      const std::size_t bytes = std::min(count - done, block_.size() - at_);
      std::memcpy(to + done, block_.data() + at_, bytes);
      at_ += bytes;
      done += bytes;
    }
    return done;
  }

 private:
  static constexpr std::uint64_t max_block = std::uint64_t{1} << 30U;

  void decode_next() {
    const std::uint64_t bytes = number_of(table_.data() + next_ * field_.table_number_bytes, field_);
    if (bytes > most_) fail(end_of_file);
    std::vector<char> packed(static_cast<std::size_t>(bytes));
    if (from_->read(packed.data(), packed.size()) < packed.size()) fail(end_of_file);
    ++next_;
    const std::uint64_t wanted = next_ == blocks_ ? last_bytes_ : block_bytes_;
    if (wanted == 0 || wanted / max_expansion > bytes) fail(damaged);
    block_.resize(static_cast<std::size_t>(wanted));
    at_ = 0;
    auto size = static_cast<uLongf>(block_.size());
    const int status = uncompress(reinterpret_cast<Bytef*>(block_.data()), &size,
                                  reinterpret_cast<const Bytef*>(packed.data()), static_cast<uLong>(packed.size()));
    if (status != Z_OK || size != block_.size()) fail(damaged);
  }

  std::unique_ptr<Pieces> from_;
  const ArrayField& field_;
  std::uint64_t most_;
  std::uint64_t blocks_;
  std::uint64_t block_bytes_ = 0;
  std::uint64_t last_bytes_ = 0;
  std::vector<char> table_;
  std::uint64_t next_ = 0;  // block
  std::vector<char> block_;
  std::size_t at_ = 0;  // in the block
};

/// Returns the position behind so many lines.
std::uint64_t skip_lines(ByteSource& content, std::uint64_t position, std::uint64_t lines) {
  std::array<char, 4096> piece{};
  while (lines > 0) {
    const std::size_t got = content.read(std::min(position, content.size()), piece.data(), piece.size());
    if (got == 0) fail(end_of_file);
    for (std::size_t i = 0; i < got && lines > 0; ++i) {
      ++position;
      if (piece.at(i) == '\n') --lines;
    }
  }
  return position;
}

std::uint64_t end_of(const ByteSource& content, const ArrayField& field) {
  return std::min(content.size(), field.end_byte);
}

/// Returns the decoded bytes before the values at the end. all: decoded bytes, or fewer.
std::uint64_t bytes_before(const ArrayField& field, std::uint64_t count, std::uint64_t all) {
  const auto behind = static_cast<std::uint64_t>(-(field.skipped_bytes + 1));
  const std::uint64_t bytes = count * size_of(field.type);
  if (behind > all || bytes > all - behind) fail(end_of_file);
  return all - behind - bytes;
}

}  // namespace

std::uint64_t Pieces::skip(std::uint64_t count) {
  std::vector<char> piece(static_cast<std::size_t>(std::min<std::uint64_t>(count, piece_bytes)));
  for (std::uint64_t done = 0; done < count;) {
    const auto wanted = static_cast<std::size_t>(std::min<std::uint64_t>(count - done, piece.size()));
    const std::size_t got = read(piece.data(), wanted);
    done += got;
    if (got < wanted) return done;
  }
  return count;
}

std::unique_ptr<Pieces> open_pieces(ByteSource& content, const ArrayField& field, std::uint64_t count) {
  const std::uint64_t first = skip_lines(content, field.first_byte, field.skipped_lines);
  const std::uint64_t end = end_of(content, field);
  const auto plain = [&](std::uint64_t position) { return std::make_unique<PlainPieces>(content, position, end); };
  const auto from_first = [&] { return plain(first); };
  if (field.encoding == ArrayEncoding::gzip) {
    const auto open = [&] { return std::make_unique<GzipPieces>(from_first()); };
    std::uint64_t skipped = static_cast<std::uint64_t>(field.skipped_bytes);
    if (field.skipped_bytes < 0) skipped = bytes_before(field, count, open()->skip(max_bytes));
    std::unique_ptr<Pieces> pieces = open();
    pieces->skip(skipped);
    return pieces;
  }
  if (field.encoding == ArrayEncoding::raw || field.encoding == ArrayEncoding::text) {
    if (field.skipped_bytes >= 0) return plain(first + static_cast<std::uint64_t>(field.skipped_bytes));
    return plain(first + bytes_before(field, count, end - std::min(end, first)));
  }
  std::unique_ptr<Pieces> pieces = from_first();
  if (field.base64) pieces = std::make_unique<Base64Pieces>(std::move(pieces));
  if (field.encoding == ArrayEncoding::vtk_zlib)
    return std::make_unique<VtkPieces>(std::move(pieces), field, end - std::min(end, first));
  const std::uint64_t bytes = read_number(*pieces, field);
  const std::uint64_t wanted = count * size_of(field.type);
  if (bytes < wanted)
    fail("the file is damaged: it declares " + std::to_string(bytes) + " bytes for the " + std::to_string(wanted) +
         " of its values");
  return pieces;
}

std::uint64_t max_numbers(const ByteSource& content, const ArrayField& field) {
  const std::uint64_t end = end_of(content, field);
  std::uint64_t skipped = field.first_byte;
  if (field.encoding != ArrayEncoding::gzip && field.skipped_bytes > 0)
    skipped += static_cast<std::uint64_t>(field.skipped_bytes);
  std::uint64_t most = end - std::min(end, skipped);
  if (field.base64) most = most / 4 * 3 + most % 4 * 3 / 4;
  if (field.encoding == ArrayEncoding::text) return most;
  if (field.encoding == ArrayEncoding::vtk) most -= std::min<std::uint64_t>(most, field.table_number_bytes);
  if (field.encoding == ArrayEncoding::gzip || field.encoding == ArrayEncoding::vtk_zlib)
    most = std::min(most, max_bytes) * max_expansion;
  return most / size_of(field.type);
}

}  // namespace cumulet::volume::detail
