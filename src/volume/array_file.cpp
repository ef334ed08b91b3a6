#include "volume/array_file.hpp"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <new>
#include <type_traits>
#include <utility>

#include "base/number_parsing.hpp"
#include "volume/memory.hpp"

namespace cumulet::volume::detail {

namespace {

constexpr int max_side = 1 << 20;
constexpr std::size_t piece_bytes = std::size_t{1} << 20U;
constexpr std::uint64_t max_expansion = 1040;  // zlib's, rounded up
constexpr std::uint64_t max_bytes = std::uint64_t{1} << 50U;

struct TypeName {
  std::string_view name;
  NumberType type;
};
constexpr std::array type_names = {
    TypeName{"int8", NumberType::int8},
    TypeName{"uint8", NumberType::uint8},
    TypeName{"int16", NumberType::int16},
    TypeName{"uint16", NumberType::uint16},
    TypeName{"int32", NumberType::int32},
    TypeName{"uint32", NumberType::uint32},
    TypeName{"int64", NumberType::int64},
    TypeName{"uint64", NumberType::uint64},
    TypeName{"float32", NumberType::float32},
    TypeName{"float64", NumberType::float64},
    TypeName{"int8_t", NumberType::int8},
    TypeName{"signed char", NumberType::int8},
    TypeName{"uint8_t", NumberType::uint8},
    TypeName{"uchar", NumberType::uint8},
    TypeName{"unsigned char", NumberType::uint8},
    TypeName{"int16_t", NumberType::int16},
    TypeName{"short", NumberType::int16},
    TypeName{"short int", NumberType::int16},
    TypeName{"signed short", NumberType::int16},
    TypeName{"signed short int", NumberType::int16},
    TypeName{"uint16_t", NumberType::uint16},
    TypeName{"ushort", NumberType::uint16},
    TypeName{"unsigned short", NumberType::uint16},
    TypeName{"unsigned short int", NumberType::uint16},
    TypeName{"int32_t", NumberType::int32},
    TypeName{"int", NumberType::int32},
    TypeName{"signed int", NumberType::int32},
    TypeName{"uint32_t", NumberType::uint32},
    TypeName{"uint", NumberType::uint32},
    TypeName{"unsigned int", NumberType::uint32},
    TypeName{"int64_t", NumberType::int64},
    TypeName{"longlong", NumberType::int64},
    TypeName{"long long", NumberType::int64},
    TypeName{"long long int", NumberType::int64},
    TypeName{"signed long long", NumberType::int64},
    TypeName{"signed long long int", NumberType::int64},
    TypeName{"uint64_t", NumberType::uint64},
    TypeName{"ulonglong", NumberType::uint64},
    TypeName{"unsigned long long", NumberType::uint64},
    TypeName{"unsigned long long int", NumberType::uint64},
    TypeName{"float", NumberType::float32},
    TypeName{"double", NumberType::float64},
};

/// Bytes of a content in pieces.
class Pieces {
 public:
  Pieces() = default;
  Pieces(const Pieces&) = delete;
  Pieces& operator=(const Pieces&) = delete;
  virtual ~Pieces() = default;
  /// Returns the number of bytes written, which is smaller only at the end.
  virtual std::size_t read(char* to, std::size_t count) = 0;
};

class PlainPieces final : public Pieces {
 public:
  PlainPieces(ByteSource& content, std::uint64_t position) : content_(content), position_(position) {}
  std::size_t read(char* to, std::size_t count) override {
    const std::size_t got = content_.read(position_, to, count);
    position_ += got;
    return got;
  }

 private:
  ByteSource& content_;
  std::uint64_t position_;
};

/// Decodes gzip or zlib data.
class GzipPieces final : public Pieces {
 public:
  GzipPieces(ByteSource& content, std::uint64_t position) : from_(content, position), input_(piece_bytes) {
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
        zip_.avail_in = static_cast<uInt>(from_.read(reinterpret_cast<char*>(input_.data()), input_.size()));
        if (zip_.avail_in == 0) break;
      }
      const int status = inflate(&zip_, Z_NO_FLUSH);
      ended_ = status == Z_STREAM_END;
      if (status != Z_OK && !ended_) fail("the file is damaged: its compressed values cannot be decoded");
    }
    return count - zip_.avail_out;
  }

 private:
  PlainPieces from_;
  std::vector<Bytef> input_;
  z_stream zip_{};
  bool ended_ = false;
};

/// Decodes the zlib blocks of VTK: the number of blocks, the size of a block, that of the last one (0: a whole one),
/// the compressed size of each block, and the blocks.
class VtkPieces final : public Pieces {
 public:
  VtkPieces(ByteSource& content, const ArrayField& field)
      : content_(content), field_(field), next_table_(field.first_byte) {
    const std::uint64_t blocks = number();
    block_bytes_ = number();
    const std::uint64_t last_bytes = number();
    if (blocks > content.size() || block_bytes_ > max_block) fail(damaged);
    next_block_ = next_table_ + blocks * field.table_number_bytes;
    left_ = blocks;
    last_bytes_ = last_bytes == 0 ? block_bytes_ : last_bytes;
  }

  std::size_t read(char* to, std::size_t count) override {
    std::size_t done = 0;
    while (done < count) {
      if (at_ == block_.size()) {
        if (left_ == 0) break;
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
  static constexpr const char* damaged = "the file is damaged: its compressed values cannot be decoded";
  static constexpr std::uint64_t max_block = std::uint64_t{1} << 30U;

  std::uint64_t number() {
    std::array<char, 8> raw{};
    const std::size_t bytes = field_.table_number_bytes;
    if (next_table_ > content_.size() || content_.read(next_table_, raw.data(), bytes) < bytes) fail(end_of_file);
    next_table_ += bytes;
    std::uint64_t number = 0;
    for (std::size_t i = 0; i < bytes; ++i) {
      const std::size_t from = field_.big_endian ? i : bytes - 1 - i;
      number = number << 8U | static_cast<std::uint8_t>(raw.at(from));
    }
    return number;
  }

  void decode_next() {
    const std::uint64_t bytes = number();
    if (next_block_ > content_.size() || bytes > content_.size() - next_block_) fail(end_of_file);
    std::vector<char> packed(static_cast<std::size_t>(bytes));
    if (content_.read(next_block_, packed.data(), packed.size()) < packed.size()) fail(end_of_file);
    next_block_ += bytes;
    --left_;
    const std::uint64_t wanted = left_ == 0 ? last_bytes_ : block_bytes_;
    if (wanted == 0 || wanted > max_block || wanted / max_expansion > bytes) fail(damaged);
    block_.resize(static_cast<std::size_t>(wanted));
    at_ = 0;
    auto size = static_cast<uLongf>(block_.size());
    const int status = uncompress(reinterpret_cast<Bytef*>(block_.data()), &size,
                                  reinterpret_cast<const Bytef*>(packed.data()), static_cast<uLong>(packed.size()));
    if (status != Z_OK || size != block_.size()) fail(damaged);
  }

  ByteSource& content_;
  const ArrayField& field_;
  std::uint64_t next_table_;
  std::uint64_t next_block_ = 0;
  std::uint64_t left_ = 0;  // blocks
  std::uint64_t block_bytes_ = 0;
  std::uint64_t last_bytes_ = 0;
  std::vector<char> block_;
  std::size_t at_ = 0;  // in the block
};

std::unique_ptr<Pieces> open_pieces(ByteSource& content, const ArrayField& field) {
  if (field.encoding == ArrayEncoding::gzip) return std::make_unique<GzipPieces>(content, field.first_byte);
  if (field.encoding == ArrayEncoding::vtk_zlib) return std::make_unique<VtkPieces>(content, field);
  return std::make_unique<PlainPieces>(content, field.first_byte);
}

template <class T>
float number_at(const char* bytes, bool swapped) {
  std::array<char, sizeof(T)> raw{};
  std::memcpy(raw.data(), bytes, sizeof(T));
  if (swapped) std::ranges::reverse(raw);
  return static_cast<float>(std::bit_cast<T>(raw));
}

using Convert = float (*)(const char* bytes, bool swapped);

Convert converter_of(NumberType type) {
  switch (type) {
    case NumberType::int8:
      return number_at<std::int8_t>;
    case NumberType::uint8:
      return number_at<std::uint8_t>;
    case NumberType::int16:
      return number_at<std::int16_t>;
    case NumberType::uint16:
      return number_at<std::uint16_t>;
    case NumberType::int32:
      return number_at<std::int32_t>;
    case NumberType::uint32:
      return number_at<std::uint32_t>;
    case NumberType::int64:
      return number_at<std::int64_t>;
    case NumberType::uint64:
      return number_at<std::uint64_t>;
    case NumberType::float32:
      return number_at<float>;
    case NumberType::float64:
      break;
  }
  return number_at<double>;
}

[[noreturn]] void fail_truncated(std::uint64_t wanted, std::uint64_t available) {
  fail("the file is truncated: it has " + std::to_string(available) + " of " + std::to_string(wanted) + " values");
}

void read_binary(Pieces& pieces, const ArrayField& field, std::vector<float>& numbers, ProgressPart& part) {
  const std::size_t each = size_of(field.type);
  const bool swapped = field.big_endian != (std::endian::native == std::endian::big);
  const Convert convert = converter_of(field.type);
  const std::uint64_t count = field.numbers();
  std::vector<char> piece(piece_bytes);
  while (numbers.size() < count) {
    const auto wanted = static_cast<std::size_t>(std::min<std::uint64_t>(count - numbers.size(), piece.size() / each));
    const std::size_t got = pieces.read(piece.data(), wanted * each) / each;
    for (std::size_t i = 0; i < got; ++i) numbers.push_back(convert(piece.data() + i * each, swapped));
    if (got < wanted) fail_truncated(count, numbers.size());
    part.add(got);
  }
}

void read_text(Pieces& pieces, const ArrayField& field, std::vector<float>& numbers, ProgressPart& part) {
  const std::uint64_t count = field.numbers();
  const auto is_blank = [](char c) { return c == ' ' || c == '\n' || c == '\r' || c == '\t' || c == ','; };
  std::string text;
  std::vector<char> piece(piece_bytes);
  for (bool ended = false; !ended && numbers.size() < count;) {
    const std::size_t got = pieces.read(piece.data(), piece.size());
    ended = got < piece.size();
    text.append(piece.data(), got);
    std::size_t at = 0;
    while (numbers.size() < count) {
      while (at < text.size() && is_blank(text[at])) ++at;
      std::size_t end = at;
      while (end < text.size() && !is_blank(text[end])) ++end;
      if (end == at || (end == text.size() && !ended)) break;  // the rest of the word is in the next piece
      float number = 0.0F;
      const auto [last, error] = number_from_chars(text.data() + at, text.data() + end, number);
      if (error != std::errc{} || last != text.data() + end)
        fail("cannot read the value '" + one_line(text.substr(at, end - at), 60) + "'");
      numbers.push_back(number);
      at = end;
    }
    text.erase(0, at);
    if (text.size() > piece_bytes) fail("its values are not text");
    part.add(got);
  }
  if (numbers.size() < count) fail_truncated(count, numbers.size());
}

/// A file with arrays. The values of a grid are read with it, and kept for the sweeps over it.
class ArrayReader final : public Reader {
 public:
  ArrayReader(std::string format, std::vector<ArrayField> fields, std::vector<Metadata> metadata,
              std::unique_ptr<ByteSource> content, Progress* progress)
      : format_(std::move(format)),
        fields_(std::move(fields)),
        metadata_(std::move(metadata)),
        content_(std::move(content)),
        progress_(progress) {
    for (const ArrayField& field : fields_) grids_.push_back(info_of(field));
  }

  [[nodiscard]] const std::vector<GridInfo>& grids() const override { return grids_; }
  [[nodiscard]] const std::vector<Metadata>& metadata() const override { return metadata_; }
  [[nodiscard]] const std::string& format() const override { return format_; }
  [[nodiscard]] double reading() const override { return 0.5; }

  SourceGrid read(std::size_t grid, Portion portion, const Log& /*log*/, const std::string& /*log_prefix*/) override {
    const ArrayField& field = fields_.at(grid);
    std::vector<float> numbers = read_numbers(*content_, field, progress_, portion.part(0.0, 0.7));
    if (field.components > 1) {
      for (std::size_t i = 0; i < numbers.size() / 3; ++i) {
        const glm::dvec3 vector(numbers[3 * i], numbers[3 * i + 1], numbers[3 * i + 2]);
        numbers[i] = static_cast<float>(glm::length(vector));
      }
      numbers.resize(numbers.size() / 3);
    }
    kept_.clear();
    kept_.push_back(std::move(numbers));
    return source(field, 0, portion.part(0.7, 1.0));
  }

  std::array<SourceGrid, 3> read_vector(std::size_t grid, Portion portion, const Log& /*log*/,
                                        const std::string& /*log_prefix*/) override {
    const ArrayField& field = fields_.at(grid);
    if (field.components != 3) fail("is not a field of vectors");
    const std::vector<float> numbers = read_numbers(*content_, field, progress_, portion.part(0.0, 0.7));
    kept_.assign(3, std::vector<float>(numbers.size() / 3));
    for (std::size_t i = 0; i < numbers.size(); ++i) kept_[i % 3][i / 3] = numbers[i];
    return {source(field, 0, portion.part(0.7, 0.8)), source(field, 1, portion.part(0.8, 0.9)),
            source(field, 2, portion.part(0.9, 1.0))};
  }

 private:
  [[nodiscard]] GridInfo info_of(const ArrayField& field) const {
    const bool scalar = field.components == 1;
    GridInfo info;
    info.name = info.unique_name = field.name;
    if (std::ranges::count(fields_, field.name, &ArrayField::name) > 1) {
      const auto before = std::ranges::count(grids_, field.name, &GridInfo::name);
      info.unique_name += '[' + std::to_string(before) + "]";
    }
    info.type = scalar ? name_of(field.type) : "vec3s";
    info.grid_class = "fog volume";
    info.refusal = scalar_fog_refusal(info.type, info.grid_class, scalar);
    info.values = scalar ? Values::scalars : Values::lengths;
    return info;
  }

  SourceGrid source(const ArrayField& field, std::size_t component, Portion portion) {
    const DenseVoxels voxels{.values = kept_[component], .size = field.size, .index_to_world = field.index_to_world};
    return source_of({Channel::density, voxels}, progress_, portion);
  }

  std::string format_;
  std::vector<ArrayField> fields_;
  std::vector<Metadata> metadata_;
  std::unique_ptr<ByteSource> content_;
  Progress* progress_;
  std::vector<GridInfo> grids_;
  std::vector<std::vector<float>> kept_;
};

}  // namespace

std::optional<NumberType> number_type_of(std::string_view name) {
  for (const TypeName& type : type_names)
    if (type.name == name) return type.type;
  return std::nullopt;
}

const char* name_of(NumberType type) { return std::ranges::find(type_names, type, &TypeName::type)->name.data(); }

std::size_t size_of(NumberType type) {
  constexpr std::array<std::size_t, 10> sizes = {1, 1, 2, 2, 4, 4, 8, 8, 4, 8};
  return sizes.at(static_cast<std::size_t>(type));
}

void check_array_size(const ArrayField& field) {
  if (glm::any(glm::lessThan(field.size, glm::ivec3(1))) ||
      glm::any(glm::greaterThan(field.size, glm::ivec3(max_side))))
    fail("its size is " + to_string(field.size) + "; each side is from 1 to " + std::to_string(max_side));
}

std::vector<float> read_numbers(ByteSource& content, const ArrayField& field, Progress* progress, Portion portion) {
  const std::uint64_t count = field.numbers();
  const std::uint64_t bytes = content.size() - std::min(content.size(), field.first_byte);
  // Sizes that the content cannot have are refused before memory is allocated.
  std::uint64_t most = bytes;
  if (field.encoding == ArrayEncoding::raw) most = bytes / size_of(field.type);
  if (field.encoding == ArrayEncoding::gzip || field.encoding == ArrayEncoding::vtk_zlib)
    most = std::min(bytes, max_bytes) * max_expansion / size_of(field.type);
  if (count > most) fail_truncated(count, most);
  ProgressPart part(progress, portion.from, portion.to, field.encoding == ArrayEncoding::text ? bytes : count);
  std::vector<float> numbers;
  numbers.reserve(static_cast<std::size_t>(count));
  const std::unique_ptr<Pieces> pieces = open_pieces(content, field);
  if (field.encoding == ArrayEncoding::text) {
    read_text(*pieces, field, numbers, part);
  } else {
    read_binary(*pieces, field, numbers, part);
  }
  if (field.encoding == ArrayEncoding::gzip) {
    char rest = 0;
    static_cast<void>(pieces->read(&rest, 1));  // compares the checksum behind the values
  }
  return numbers;
}

std::unique_ptr<Reader> make_array_reader(std::string format, std::vector<ArrayField> fields,
                                          std::vector<Metadata> metadata, std::unique_ptr<ByteSource> content,
                                          Progress* progress) {
  for (const ArrayField& field : fields) check_array_size(field);
  return std::make_unique<ArrayReader>(std::move(format), std::move(fields), std::move(metadata), std::move(content),
                                       progress);
}

}  // namespace cumulet::volume::detail
