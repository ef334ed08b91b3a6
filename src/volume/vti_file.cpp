#include <algorithm>
#include <array>
#include <cctype>
#include <utility>

#include "base/number_parsing.hpp"
#include "volume/array_file.hpp"

namespace cumulet::volume::detail {

namespace {

constexpr std::size_t max_tag = std::size_t{1} << 20U;
constexpr std::string_view blanks = " \t\r\n";

/// A tag of XML, without its angle brackets.
class Tag {
 public:
  explicit Tag(std::string_view text) : text_(text) {}

  [[nodiscard]] std::string_view name() const { return text_.substr(0, text_.find_first_of(" \t\r\n/", 1)); }
  /// Returns the value of an attribute; nullopt if there is none.
  [[nodiscard]] std::optional<std::string_view> find(std::string_view attribute) const {
    for (std::size_t at = text_.find(attribute); at != std::string_view::npos; at = text_.find(attribute, at + 1)) {
      std::string_view rest = text_.substr(at + attribute.size());
      const bool begins = at > 0 && blanks.find(text_[at - 1]) != std::string_view::npos;
      if (!begins || !rest.starts_with('=') || rest.size() < 2) continue;
      const char quote = rest[1];
      const std::size_t end = rest.find(quote, 2);
      if ((quote != '"' && quote != '\'') || end == std::string_view::npos) continue;
      return rest.substr(2, end - 2);
    }
    return std::nullopt;
  }
  /// Parses the numbers of an attribute. Throws if there are not so many.
  template <class Number, std::size_t count>
  [[nodiscard]] std::array<Number, count> numbers(std::string_view attribute) const {
    const std::string_view whole = find(attribute).value_or("");
    std::string_view text = whole;
    std::array<Number, count> numbers{};
    for (Number& number : numbers) {
      text.remove_prefix(std::min(text.find_first_not_of(blanks), text.size()));
      const auto [end, error] = number_from_chars(text.data(), text.data() + text.size(), number);
      if (error != std::errc{}) fail("cannot read " + std::string(attribute) + "=\"" + one_line(whole, 60) + "\"");
      text.remove_prefix(static_cast<std::size_t>(end - text.data()));
    }
    return numbers;
  }

 private:
  std::string_view text_;
};

/// Reads the tags of a file, one after another. Skips the text between them, which may be the values.
class TagReader {
 public:
  TagReader(ByteSource& content, const Progress* progress)
      : content_(content), progress_(progress), piece_(std::size_t{1} << 18U) {}

  /// Reads the next tag. Returns false at the end of the file.
  bool next() {
    tag_.clear();
    do {
      if (!has_more()) return false;
      at_ = index_of('<');
    } while (at_ == got_);
    begin_ = position();
    ++at_;
    do {
      if (!has_more()) return false;
      const std::size_t end = index_of('>');
      tag_.append(piece_.data() + at_, end - at_);
      if (tag_.size() > max_tag) fail("the file is damaged: a tag has no end");
      at_ = end;
    } while (at_ == got_);
    ++at_;
    return true;
  }
  [[nodiscard]] Tag tag() const { return Tag(tag_); }
  /// Positions of the tag's "<", and behind what has been read.
  [[nodiscard]] std::uint64_t begin() const { return begin_; }
  [[nodiscard]] std::uint64_t position() const { return piece_from_ + at_; }
  /// Reads up to the mark before appended data, and over it.
  void skip_mark() {
    while (has_more() && blanks.find(piece_[at_]) != std::string_view::npos) ++at_;
    if (!has_more()) fail(end_of_file);
    if (piece_[at_++] != '_') fail("the file is damaged: its appended data do not begin with \"_\"");
  }

 private:
  bool has_more() {
    if (at_ < got_) return true;
    check(progress_);
    piece_from_ += got_;
    at_ = 0;
    got_ = content_.read(piece_from_, piece_.data(), piece_.size());
    return got_ > 0;
  }
  [[nodiscard]] std::size_t index_of(char c) const {
    const auto first = piece_.begin() + static_cast<std::ptrdiff_t>(at_);
    const auto last = piece_.begin() + static_cast<std::ptrdiff_t>(got_);
    return static_cast<std::size_t>(std::find(first, last, c) - piece_.begin());
  }

  ByteSource& content_;
  const Progress* progress_;
  std::vector<char> piece_;
  std::uint64_t piece_from_ = 0;
  std::size_t at_ = 0;
  std::size_t got_ = 0;
  std::string tag_;
  std::uint64_t begin_ = 0;
};

/// The XML part of a file.
class VtiHeader {
 public:
  VtiHeader(ByteSource& content, const Progress* progress) {
    TagReader tags(content, progress);
    while (!has_appended_ && tags.next()) {
      if (is_inline_) fields_.back().end_byte = tags.begin();
      is_inline_ = false;
      take(tags);
    }
    if (!has_file_) fail("is not a VTK file of image data");
    if (fields_.empty()) fail("has no array of numbers with 1 or 3 components");
    for (const std::size_t i : appended_) {
      if (!has_appended_) fail("has an array whose values are appended, but no appended data");
      fields_[i].base64 = appended_base64_;
      fields_[i].first_byte += tags.position();
    }
  }

  [[nodiscard]] std::vector<ArrayField> fields() const { return fields_; }

 private:
  void take(TagReader& tags) {
    const Tag tag = tags.tag();
    const std::string_view name = tag.name();
    if (name == "VTKFile") {
      begin(tag);
    } else if (name == "ImageData") {
      place(tag);
    } else if (name == "Piece") {
      if (++pieces_ > 1) fail("has several pieces, which is not supported");
      extent_ = tag.numbers<int, 6>("Extent");
    } else if (name == "PointData" || name == "CellData") {
      in_cells_ = name == "CellData";
    } else if (name == "/PointData" || name == "/CellData") {
      in_cells_.reset();
    } else if (name == "DataArray" && in_cells_) {
      add(tag, tags.position());
    } else if (name == "AppendedData") {
      const std::string_view encoding = tag.find("encoding").value_or("base64");
      if (encoding != "raw" && encoding != "base64")
        fail("has appended data in the encoding " + one_line(encoding, 60) + "; raw and base64 are supported");
      appended_base64_ = encoding == "base64";
      tags.skip_mark();
      has_appended_ = true;
    }
  }

  void begin(const Tag& tag) {
    if (tag.find("type") != "ImageData")
      fail("is a VTK file of the type " + one_line(tag.find("type").value_or("?"), 60) + ", not ImageData");
    has_file_ = true;
    big_endian_ = tag.find("byte_order") == "BigEndian";
    table_number_bytes_ = tag.find("header_type") == "UInt64" ? 8 : 4;
    if (const auto compressor = tag.find("compressor")) {
      if (*compressor != "vtkZLibDataCompressor")
        fail("is compressed by " + one_line(*compressor, 60) + "; vtkZLibDataCompressor is supported");
      compressed_ = true;
    }
  }

  void place(const Tag& tag) {
    if (tag.find("Origin")) origin_ = tag.numbers<double, 3>("Origin");
    if (tag.find("Spacing")) spacing_ = tag.numbers<double, 3>("Spacing");
    if (tag.find("Direction")) direction_ = tag.numbers<double, 9>("Direction");
  }

  /// after: position behind the tag, where values inline begin.
  void add(const Tag& tag, std::uint64_t after) {
    std::string type(tag.find("type").value_or(""));
    std::ranges::transform(type, type.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    const std::string_view components = tag.find("NumberOfComponents").value_or("1");
    const auto known = number_type_of(type);
    if (!known || (components != "1" && components != "3")) return;
    ArrayField field;
    field.name = one_line(tag.find("Name").value_or("density"));
    field.type = *known;
    field.components = components == "3" ? 3 : 1;
    field.big_endian = big_endian_;
    field.table_number_bytes = table_number_bytes_;
    field.encoding = compressed_ ? ArrayEncoding::vtk_zlib : ArrayEncoding::vtk;
    const std::string_view format = tag.find("format").value_or("ascii");
    if (format == "appended") {
      field.first_byte = tag.numbers<std::uint64_t, 1>("offset")[0];
      if (field.first_byte > max_offset) fail(end_of_file);
      appended_.push_back(fields_.size());
    } else if (format == "binary" || format == "ascii") {
      field.first_byte = after;
      field.base64 = format == "binary";
      if (format == "ascii") field.encoding = ArrayEncoding::text;
      is_inline_ = true;
    } else {
      fail("has an array in the format " + one_line(format, 60) + "; ascii, binary and appended are supported");
    }
    set_lattice(field);
    if (fields_.size() == max_arrays) fail("has more than " + std::to_string(max_arrays) + " arrays");
    fields_.push_back(std::move(field));
  }

  void set_lattice(ArrayField& field) const {
    glm::dvec3 first(0.0);
    for (int axis = 0; axis < 3; ++axis) {
      const auto a = static_cast<std::size_t>(axis);
      const std::int64_t steps = std::int64_t{extent_.at(2 * a + 1)} - extent_.at(2 * a);
      const bool cells = in_cells_.value_or(false);
      const std::int64_t side = steps + (cells ? 0 : 1);
      field.size[axis] = static_cast<int>(std::clamp<std::int64_t>(side, 0, 1 << 30));
      first[axis] = extent_.at(2 * a) + (cells ? 0.5 : 0.0);
    }
    for (int column = 0; column < 3; ++column) {
      for (int row = 0; row < 3; ++row) {
        const auto entry = 3U * static_cast<std::size_t>(row) + static_cast<std::size_t>(column);
        field.index_to_world[column][row] = direction_.at(entry) * spacing_.at(static_cast<std::size_t>(column));
      }
    }
    const glm::dvec3 origin(origin_[0], origin_[1], origin_[2]);
    field.index_to_world[3] = glm::dvec4(origin + glm::dmat3(field.index_to_world) * first, 1.0);
  }

  static constexpr std::size_t max_arrays = 4096;
  static constexpr std::uint64_t max_offset = std::uint64_t{1} << 60U;

  bool has_file_ = false;
  bool has_appended_ = false;
  bool appended_base64_ = false;
  bool is_inline_ = false;  // the values of the last field are before the next tag
  bool big_endian_ = false;
  bool compressed_ = false;
  std::optional<bool> in_cells_;  // nullopt: in neither points nor cells
  int pieces_ = 0;
  std::size_t table_number_bytes_ = 4;
  std::array<double, 3> origin_{};
  std::array<double, 3> spacing_{1.0, 1.0, 1.0};
  std::array<double, 9> direction_{1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0};
  std::array<int, 6> extent_{};
  std::vector<ArrayField> fields_;
  std::vector<std::size_t> appended_;  // indices of fields whose first_byte is from the mark on
};

}  // namespace

std::unique_ptr<Reader> open_vti(std::unique_ptr<ByteSource> content, Progress* progress) {
  const VtiHeader header(*content, progress);
  return make_array_reader("VTK ImageData", header.fields(), {}, std::move(content), progress);
}

}  // namespace cumulet::volume::detail
