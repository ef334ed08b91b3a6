#include <algorithm>
#include <array>
#include <cmath>
#include <system_error>
#include <utility>

#include "base/number_parsing.hpp"
#include "volume/array_file.hpp"
#include "volume/source_file.hpp"

namespace cumulet::volume::detail {

namespace {

constexpr std::string_view blanks = " \t\r";
constexpr std::size_t max_header = std::size_t{1} << 20U;
constexpr std::uint64_t max_files = std::uint64_t{1} << 20U;

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

/// Returns the name of a file by a pattern as of printf, with one number.
std::string name_by(std::string_view pattern, std::int64_t number) {
  std::string name;
  for (std::size_t at = 0, numbers = 0; at < pattern.size(); ++at) {
    if (pattern[at] != '%') {
      name += pattern[at];
      continue;
    }
    if (pattern.substr(at, 2) == "%%") {
      name += pattern[at++];
      continue;
    }
    std::size_t width = 0;
    const std::size_t end = std::min(pattern.find_first_not_of("0123456789", at + 1), pattern.size());
    const std::string_view digits = pattern.substr(at + 1, end - at - 1);
    if (!digits.empty()) width = number_of<std::uint8_t>(digits, "data file");
    const bool is_number = end < pattern.size() && (pattern[end] == 'd' || pattern[end] == 'i' || pattern[end] == 'u');
    if (!is_number || ++numbers > 1)
      fail("has the pattern '" + one_line(pattern, 60) + "' in \"data file\", which is not one of one number");
    const std::string text = std::to_string(number);
    name.append(width - std::min(width, text.size()), digits.starts_with('0') ? '0' : ' ');
    name += text;
    at = end;
  }
  return name;
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
    for (; next && !next->empty(); next = line()) {
      if (is_list_) {
        data_files_.emplace_back(*next);
      } else {
        take(*next);
      }
    }
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
    const bool has_components = has_components_first();
    const bool has_last = !has_components && sizes_.size() == 4 && sizes_[3] == 1;
    if (sizes_.size() != 3 && !has_components && !has_last)
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
    field.first_byte = data_file_.empty() ? size_ : 0;
    field.skipped_lines = line_skip_;
    field.skipped_bytes = byte_skip_;
    if (byte_skip_ < 0 && encoding_ == ArrayEncoding::text) fail("has a negative \"byte skip\" and is ascii");
    return field;
  }

  /// Returns the names of the files that hold the values, in order; none if they are behind the header.
  [[nodiscard]] std::vector<std::string> data_files() const {
    const std::vector<std::string_view> words = words_of(data_file_);
    if (is_list_) {
      check_files(data_files_.size(), words.size() > 1 ? words[1] : "");
      return data_files_;
    }
    // NAME%d.raw FIRST LAST STEP [SUBDIM]
    const bool is_pattern = (words.size() == 4 || words.size() == 5) && words[0].find('%') != std::string_view::npos;
    if (!is_pattern) return data_file_.empty() ? std::vector<std::string>{} : std::vector{data_file_};
    const std::int64_t first = number_of<std::int32_t>(words[1], data_file_key);
    const std::int64_t last = number_of<std::int32_t>(words[2], data_file_key);
    const std::int64_t step = number_of<std::int32_t>(words[3], data_file_key);
    if (step == 0) fail("has the step 0 in \"data file\"");
    const bool reaches = step > 0 ? first <= last : first >= last;
    const std::int64_t count = reaches ? (last - first) / step + 1 : 0;
    check_files(static_cast<std::uint64_t>(count), words.size() > 4 ? words[4] : "");
    std::vector<std::string> names;
    for (std::int64_t i = 0; i < count; ++i) names.push_back(name_by(words[0], first + i * step));
    return names;
  }

  [[nodiscard]] bool ends() const { return ends_; }
  [[nodiscard]] const std::string& format() const { return format_; }
  [[nodiscard]] std::vector<Metadata> metadata() const { return metadata_; }

 private:
  static std::string head_of(ByteSource& content) {
    std::string text(static_cast<std::size_t>(std::min<std::uint64_t>(content.size(), max_header)), '\0');
    text.resize(content.read(0, text.data(), text.size()));
    return text;
  }

  static constexpr std::string_view data_file_key = "data file";

  /// Returns whether an axis of 1 or 3 components is before those of space.
  [[nodiscard]] bool has_components_first() const {
    if (sizes_.size() == 3 && !kinds_.empty() && !is_of_space(kinds_[0]))
      fail("has 2 axes and one of the kind '" + one_line(kinds_[0], 60) + "' before them; 3 axes are read");
    return sizes_.size() == 4 && (sizes_[0] == 1 || sizes_[0] == 3) && (directions_.empty() || !directions_[0]);
  }
  static bool is_of_space(std::string_view kind) {
    constexpr std::array<std::string_view, 6> kinds = {"domain", "space", "time", "list", "none", "???"};
    return std::ranges::find(kinds, kind) != kinds.end();
  }

  /// Throws unless so many files can hold the array in equal parts. dimension: number of axes that a file has; empty:
  /// all except the last one.
  void check_files(std::uint64_t count, std::string_view dimension) const {
    const std::size_t axes = sizes_.size();
    const std::size_t within = dimension.empty() ? axes - 1 : number_of<std::size_t>(dimension, data_file_key);
    if (count > max_files) fail("has more than " + std::to_string(max_files) + " data files");
    if (within < 1 || within > axes) fail("has files of " + std::to_string(within) + " axes in \"data file\"");
    std::uint64_t wanted = 1;  // each size is at most that of check_array_size
    for (std::size_t axis = within; axis < axes; ++axis) wanted *= sizes_[axis];
    if (within < axes ? count == wanted : count > 0 && sizes_.back() % count == 0) return;
    const std::string number = "the number of its data files is " + std::to_string(count);
    if (within < axes) fail(number + " in place of " + std::to_string(wanted));
    fail(number + ", which does not divide its " + std::to_string(sizes_.back()) + " slices");
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
    // Teem ignores the case of these words.
    set(lower_case(std::string(line.substr(0, colon))), trimmed(line.substr(colon + 2)));
  }

  void set(std::string_view key, std::string_view value) {
    if (key == "type") {
      type_ = number_type_of(lower_case(std::string(value)));
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
      set_encoding(lower_case(std::string(value)));
    } else if (key == "endian") {
      const std::string order = lower_case(std::string(value));
      if (order != "little" && order != "big") fail("has the byte order '" + one_line(value, 60) + "'");
      big_endian_ = order == "big";
    } else if (key == data_file_key || key == "datafile") {
      data_file_ = value;
      const std::vector<std::string_view> words = words_of(value);
      is_list_ = !words.empty() && words[0] == "LIST";
    } else if (key == "byte skip" || key == "byteskip") {
      byte_skip_ = number_of<std::int64_t>(value, key);
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
  bool is_list_ = false;
  std::vector<std::string> data_files_;  // of a list
  std::int64_t byte_skip_ = 0;
  std::uint64_t line_skip_ = 0;
  std::vector<Metadata> metadata_;
};

/// Returns the path of a file with values. Throws if it cannot be read.
std::filesystem::path detached(const std::string& name, const std::optional<std::filesystem::path>& folder) {
  const std::string quoted = '"' + one_line(name) + "\"";
  if (!folder) fail("has its values in the file " + quoted + ", but the data has no folder");
  try {
    std::filesystem::path file = *folder / name;
    std::error_code error;
    const std::filesystem::file_status status = std::filesystem::status(file, error);
    if (exists(status) && !is_regular_file(status)) fail("is not a regular file");
    open_file(file);
    return file;
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
  for (const std::string& name : header.data_files()) field.files.push_back(detached(name, folder));
  if (field.files.empty() && !header.ends()) fail(end_of_file);
  return make_array_reader(header.format(), {std::move(field)}, header.metadata(), std::move(content), progress);
}

}  // namespace cumulet::volume::detail
