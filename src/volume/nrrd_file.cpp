#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "base/number_parsing.hpp"
#include "volume/array_file.hpp"
#include "volume/source_file.hpp"

namespace cumulet::volume::detail {

namespace {

constexpr std::string_view blanks = " \t\r";
constexpr std::size_t max_header = std::size_t{1} << 20U;

std::string_view trimmed(std::string_view text) {
  const std::size_t first = text.find_first_not_of(blanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(blanks) - first + 1);
}

std::vector<std::string_view> words_of(std::string_view text) {
  std::vector<std::string_view> words;
  for (text = trimmed(text); !text.empty(); text = trimmed(text)) {
    const std::size_t end = std::min(text.find_first_of(blanks), text.size());
    words.push_back(text.substr(0, end));
    text.remove_prefix(end);
  }
  return words;
}

template <class Number>
Number number_of(std::string_view text, std::string_view key) {
  Number number{};
  if (text.starts_with('+')) text.remove_prefix(1);
  const auto [end, error] = number_from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc{} || end != text.data() + text.size())
    fail("cannot read '" + one_line(text, 60) + "' in \"" + std::string(key) + "\"");
  return number;
}

/// Parses "(x,y,z)".
glm::dvec3 vector_of(std::string_view text, std::string_view key) {
  const std::string_view whole = text;
  if (!text.starts_with('(') || !text.ends_with(')'))
    fail('"' + std::string(key) + "\" has '" + one_line(whole, 60) + "' in place of (x,y,z)");
  text = text.substr(1, text.size() - 2);
  glm::dvec3 vector(0.0);
  for (int axis = 0; axis < 3; ++axis) {
    const std::size_t end = text.find(',');
    if ((end == std::string_view::npos) != (axis == 2))
      fail('"' + std::string(key) + "\" has '" + one_line(whole, 60) + "' in place of (x,y,z)");
    vector[axis] = number_of<double>(trimmed(text.substr(0, end)), key);
    text.remove_prefix(axis < 2 ? end + 1 : text.size());
  }
  return vector;
}

/// Splits "(a, b, c) none (d,e,f)" at blanks outside of parentheses.
std::vector<std::string_view> directions_of(std::string_view text) {
  std::vector<std::string_view> parts;
  for (text = trimmed(text); !text.empty(); text = trimmed(text)) {
    std::size_t end = text.starts_with('(') ? text.find(')') : text.find_first_of(blanks);
    end = end == std::string_view::npos ? text.size() : end + (text.starts_with('(') ? 1 : 0);
    parts.push_back(text.substr(0, end));
    text.remove_prefix(end);
  }
  return parts;
}

/// The header of a NRRD file.
class NrrdHeader {
 public:
  /// Reads the lines up to an empty one.
  explicit NrrdHeader(ByteSource& content) {
    const std::string text = head_of(content);
    std::size_t at = 0;
    const auto line = [&]() -> std::optional<std::string_view> {
      if (at >= text.size()) return std::nullopt;
      const std::size_t end = std::min(text.find('\n', at), text.size());
      const auto found = trimmed(std::string_view(text).substr(at, end - at));
      at = std::min(end + 1, text.size());
      return found;
    };
    format_ = "NRRD " + std::string(line().value_or("").substr(4));
    std::optional<std::string_view> next = line();
    for (; next && !next->empty(); next = line()) take(*next);
    ends_ = next.has_value();
    if (!ends_ && text.size() == max_header) fail("the file is damaged: its header has no end");
    size_ = at;
  }

  /// Returns the array, except for the position of its first byte.
  [[nodiscard]] ArrayField field() const {
    ArrayField field;
    if (!type_) fail("its header has no \"type\"");
    if (sizes_.empty()) fail("its header has no \"sizes\"");
    field.type = *type_;
    field.encoding = encoding_;
    field.big_endian = big_endian_;
    const bool has_components = sizes_.size() == 4 && (sizes_[0] == 1 || sizes_[0] == 3);
    if (sizes_.size() != 3 && !has_components)
      fail("has " + std::to_string(sizes_.size()) + " axes; 3 are read, and before them an axis of 1 or 3 components");
    const std::size_t first = has_components ? 1 : 0;
    if (has_components) field.components = sizes_[0];
    if (field.components == 3)
      field.name = kinds_.empty() || kinds_[0].find("olor") == std::string::npos ? "velocity" : "color";
    for (int axis = 0; axis < 3; ++axis) {
      const std::size_t i = first + static_cast<std::size_t>(axis);
      field.size[axis] = static_cast<int>(std::min<std::uint64_t>(sizes_[i], 1U << 30U));
      if (directions_.size() > i && directions_[i]) {
        field.index_to_world[axis] = glm::dvec4(*directions_[i], 0.0);
      } else if (spacings_.size() > i && std::isfinite(spacings_[i])) {
        field.index_to_world[axis] *= spacings_[i];
      }
    }
    if (origin_) field.index_to_world[3] = glm::dvec4(*origin_, 1.0);
    return field;
  }

  [[nodiscard]] std::uint64_t size() const { return size_; }
  [[nodiscard]] bool ends() const { return ends_; }
  [[nodiscard]] const std::string& format() const { return format_; }
  [[nodiscard]] const std::string& data_file() const { return data_file_; }
  [[nodiscard]] std::int64_t byte_skip() const { return byte_skip_; }
  [[nodiscard]] std::uint64_t line_skip() const { return line_skip_; }
  [[nodiscard]] std::vector<Metadata> metadata() const { return metadata_; }

 private:
  static std::string head_of(ByteSource& content) {
    std::string text(static_cast<std::size_t>(std::min<std::uint64_t>(content.size(), max_header)), '\0');
    text.resize(content.read(0, text.data(), text.size()));
    return text;
  }

  void take(std::string_view line) {
    if (line.starts_with('#')) return;
    if (const std::size_t pair = line.find(":="); pair != std::string_view::npos) {
      metadata_.push_back({one_line(line.substr(0, pair)), "string", one_line(line.substr(pair + 2))});
      return;
    }
    const std::size_t colon = line.find(": ");
    if (colon == std::string_view::npos) {
      if (line.ends_with(':')) return;
      fail("its header has the line '" + one_line(line, 60) + "', which is not a field");
    }
    set(line.substr(0, colon), trimmed(line.substr(colon + 2)));
  }

  void set(std::string_view key, std::string_view value) {
    if (key == "type") {
      type_ = number_type_of(value);
      if (!type_) fail("has the type '" + one_line(value, 60) + "', which is not supported");
    } else if (key == "sizes") {
      for (const std::string_view word : words_of(value)) sizes_.push_back(number_of<std::uint64_t>(word, key));
    } else if (key == "spacings") {
      for (const std::string_view word : words_of(value))
        spacings_.push_back(word == "nan" || word == "NaN" ? std::nan("") : number_of<double>(word, key));
    } else if (key == "space directions") {
      for (const std::string_view part : directions_of(value))
        directions_.push_back(part == "none" ? std::nullopt : std::optional(vector_of(part, key)));
    } else if (key == "space origin") {
      origin_ = vector_of(value, key);
    } else if (key == "kinds") {
      for (const std::string_view word : words_of(value)) kinds_.emplace_back(word);
    } else if (key == "encoding") {
      set_encoding(value);
    } else if (key == "endian") {
      if (value != "little" && value != "big") fail("has the byte order '" + one_line(value, 60) + "'");
      big_endian_ = value == "big";
    } else if (key == "data file" || key == "datafile") {
      data_file_ = value;
    } else if (key == "byte skip" || key == "byteskip") {
      byte_skip_ = number_of<std::int64_t>(value, key);
      if (byte_skip_ < -1) fail("has a negative \"byte skip\"");
    } else if (key == "line skip" || key == "lineskip") {
      line_skip_ = number_of<std::uint64_t>(value, key);
    } else {
      metadata_.push_back({one_line(key), "string", one_line(value)});
    }
  }

  void set_encoding(std::string_view value) {
    if (value == "raw") {
      encoding_ = ArrayEncoding::raw;
    } else if (value == "gzip" || value == "gz") {
      encoding_ = ArrayEncoding::gzip;
    } else if (value == "ascii" || value == "text" || value == "txt") {
      encoding_ = ArrayEncoding::text;
    } else {
      fail("has the encoding '" + one_line(value, 60) + "'; raw, gzip and ascii are supported");
    }
  }

  std::string format_;
  std::uint64_t size_ = 0;
  bool ends_ = false;  // with an empty line; a detached header need not
  std::optional<NumberType> type_;
  std::vector<std::uint64_t> sizes_;
  std::vector<double> spacings_;
  std::vector<std::optional<glm::dvec3>> directions_;
  std::optional<glm::dvec3> origin_;
  std::vector<std::string> kinds_;
  ArrayEncoding encoding_ = ArrayEncoding::raw;
  bool big_endian_ = false;
  std::string data_file_;
  std::int64_t byte_skip_ = 0;
  std::uint64_t line_skip_ = 0;
  std::vector<Metadata> metadata_;
};

/// Returns the position after so many lines.
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

std::unique_ptr<ByteSource> open_detached(const std::string& name, const std::optional<std::filesystem::path>& folder) {
  const std::string quoted = '"' + one_line(name) + "\"";
  if (name.starts_with("LIST") || name.find('%') != std::string::npos)
    fail("has its values in several files (" + quoted + "), which is not supported");
  if (!folder) fail("has its values in the file " + quoted + ", but the data has no folder");
  try {
    return open_file(*folder / name);
  } catch (const std::runtime_error& cause) {
    fail("has its values in the file " + quoted + ": " + cause.what());
  }
}

}  // namespace

std::unique_ptr<Reader> open_nrrd(std::unique_ptr<ByteSource> content,
                                  const std::optional<std::filesystem::path>& folder, Progress* progress) {
  const NrrdHeader header(*content);
  ArrayField field = header.field();
  check_array_size(field);
  if (header.data_file().empty()) {
    if (!header.ends()) fail(end_of_file);
    field.first_byte = header.size();
  } else {
    content = open_detached(header.data_file(), folder);
  }
  field.first_byte = skip_lines(*content, field.first_byte, header.line_skip());
  if (header.byte_skip() >= 0) {
    field.first_byte += static_cast<std::uint64_t>(header.byte_skip());
  } else {
    // The values are the last bytes of the file.
    const std::uint64_t bytes = field.numbers() * size_of(field.type);
    if (field.encoding != ArrayEncoding::raw) fail("has \"byte skip: -1\" and an encoding other than raw");
    field.first_byte = content->size() - std::min(content->size(), bytes);
  }
  return make_array_reader(header.format(), {std::move(field)}, header.metadata(), std::move(content), progress);
}

}  // namespace cumulet::volume::detail
