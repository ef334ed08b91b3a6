#include "volume/array_file.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <type_traits>
#include <utility>

#include "base/number_parsing.hpp"
#include "volume/array_pieces.hpp"
#include "volume/memory.hpp"
#include "volume/source_file.hpp"

namespace cumulet::volume::detail {

namespace {

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

/// Appends `count` numbers.
void read_binary(Pieces& pieces, const ArrayField& field, std::uint64_t count, std::vector<float>& numbers,
                 ProgressPart& part) {
  const std::size_t each = size_of(field.type);
  const bool swapped = field.big_endian != (std::endian::native == std::endian::big);
  const Convert convert = converter_of(field.type);
  std::vector<char> piece(piece_bytes);
  for (std::uint64_t done = 0; done < count;) {
    const auto wanted = static_cast<std::size_t>(std::min<std::uint64_t>(count - done, piece.size() / each));
    const std::size_t got = pieces.read(piece.data(), wanted * each) / each;
    for (std::size_t i = 0; i < got; ++i) numbers.push_back(convert(piece.data() + i * each, swapped));
    done += got;
    if (got < wanted) fail_truncated(count, done);
    part.add(got);
  }
}

/// Appends `count` numbers.
void read_text(Pieces& pieces, std::uint64_t count, std::vector<float>& numbers, ProgressPart& part) {
  const auto is_blank = [](char c) { return c == ' ' || c == '\n' || c == '\r' || c == '\t' || c == ','; };
  std::string text;
  std::vector<char> piece(piece_bytes);
  std::uint64_t done = 0;
  for (bool ended = false; !ended && done < count;) {
    const std::size_t got = pieces.read(piece.data(), piece.size());
    ended = got < piece.size();
    text.append(piece.data(), got);
    std::size_t at = 0;
    while (done < count) {
      while (at < text.size() && is_blank(text[at])) ++at;
      std::size_t end = at;
      while (end < text.size() && !is_blank(text[end])) ++end;
      if (end == at || (end == text.size() && !ended)) break;  // the rest of the word is in the next piece
      double number = 0.0;                                     // also holds what is too small for a float
      const auto [last, error] = number_from_chars(text.data() + at, text.data() + end, number);
      if (error != std::errc{} || last != text.data() + end)
        fail("cannot read the value '" + one_line(text.substr(at, end - at), 60) + "'");
      numbers.push_back(static_cast<float>(number));
      ++done;
      at = end;
    }
    text.erase(0, at);
    if (text.size() > piece_bytes) fail("its values are not text");
    part.add(got);
  }
  if (done < count) fail_truncated(count, done);
}

/// Throws if a content cannot have so many numbers, before memory is allocated for them.
void check_room(const ByteSource& content, const ArrayField& field, std::uint64_t count) {
  if (const std::uint64_t most = max_numbers(content, field); count > most) fail_truncated(count, most);
}

/// Appends `count` numbers of a content.
void append_numbers(ByteSource& content, const ArrayField& field, std::uint64_t count, std::vector<float>& numbers,
                    Progress* progress, Portion portion) {
  const bool text = field.encoding == ArrayEncoding::text;
  ProgressPart part(progress, portion.from, portion.to, text ? content.size() : count);
  const std::unique_ptr<Pieces> pieces = open_pieces(content, field, count);
  if (text) {
    read_text(*pieces, count, numbers, part);
  } else {
    read_binary(*pieces, field, count, numbers, part);
  }
  if (field.encoding == ArrayEncoding::gzip) {
    char rest = 0;
    static_cast<void>(pieces->read(&rest, 1));  // compares the checksum behind the values
  }
}

/// Calls visit with each of the field's files. Errors begin with the file's name.
template <class Visit>
void for_each_file(const ArrayField& field, const Visit& visit) {
  for (std::size_t i = 0; i < field.files.size(); ++i) {
    try {
      visit(*open_file(field.files[i]), i);
    } catch (const Error&) {
      throw;
    } catch (const std::runtime_error& cause) {
      fail('"' + one_line(field.files[i].filename().string()) + "\": " + cause.what());
    }
  }
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

std::vector<float> read_numbers(ByteSource& content, const ArrayField& field, Progress* progress, Portion portion) {
  std::vector<float> numbers;
  if (field.files.empty()) {
    check_room(content, field, field.numbers());
    numbers.reserve(static_cast<std::size_t>(field.numbers()));
    append_numbers(content, field, field.numbers(), numbers, progress, portion);
    return numbers;
  }
  const std::uint64_t count = field.numbers() / field.files.size();
  for_each_file(field, [&](ByteSource& file, std::size_t) { check_room(file, field, count); });
  numbers.reserve(static_cast<std::size_t>(field.numbers()));
  const double files = static_cast<double>(field.files.size());
  for_each_file(field, [&](ByteSource& file, std::size_t i) {
    const auto at = static_cast<double>(i);
    append_numbers(file, field, count, numbers, progress, portion.part(at / files, (at + 1.0) / files));
  });
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
