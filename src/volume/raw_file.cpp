#include <algorithm>
#include <array>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <system_error>
#include <utility>

#include "volume/array_file.hpp"

namespace cumulet::volume::detail {

namespace {

using nlohmann::json;

/// Reads three numbers of a key. Returns false if the key is missing.
template <class Number>
bool read_three(const json& object, const char* key, Number* to) {
  const auto found = object.find(key);
  if (found == object.end()) return false;
  const bool valid = found->is_array() && found->size() == 3 &&
                     std::ranges::all_of(*found, [](const json& number) { return number.is_number(); });
  if (!valid) fail(std::string("\"") + key + "\" is not three numbers");
  for (std::size_t i = 0; i < 3; ++i) to[i] = found->at(i).get<Number>();
  return true;
}

std::string text_of(const json& object, const char* key) {
  const auto found = object.find(key);
  if (found == object.end()) return {};
  if (!found->is_string()) fail(std::string("\"") + key + "\" is not a text");
  return found->get<std::string>();
}

}  // namespace

std::optional<std::filesystem::path> raw_description_of(const std::filesystem::path& file) {
  if (file.extension() != ".raw") return std::nullopt;
  std::filesystem::path beside = file;
  beside += ".json";
  std::filesystem::path replaced = file;
  replaced.replace_extension(".json");
  for (const std::filesystem::path& description : {beside, replaced}) {
    std::error_code error;
    if (std::filesystem::is_regular_file(description, error)) return description;
  }
  return std::nullopt;
}

ArrayField raw_field_of(std::string_view text) {
  const json object = json::parse(text, nullptr, /*allow_exceptions=*/false);
  if (!object.is_object()) fail("is not a JSON object");
  ArrayField field;
  const std::string type = text_of(object, "type");
  const std::optional<NumberType> known = number_type_of(type);
  if (type.empty()) fail("has no \"type\"");
  if (!known) fail("has the type '" + one_line(type, 60) + "', which is not supported");
  field.type = *known;
  std::array<double, 3> size{};
  if (!read_three(object, "size", size.data())) fail("has no \"size\"");
  std::array<double, 3> spacing{1.0, 1.0, 1.0};
  read_three(object, "spacing", spacing.data());
  std::array<double, 3> origin{};
  read_three(object, "origin", origin.data());
  for (int axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<std::size_t>(axis);
    constexpr double most = 1e9;
    if (!(size.at(i) >= 1.0 && size.at(i) <= most)) fail("\"size\" is out of range");
    field.size[axis] = static_cast<int>(size.at(i));
    field.index_to_world[axis] *= spacing.at(i);
    field.index_to_world[3][axis] = origin.at(i);
  }
  const std::string endian = text_of(object, "endian");
  if (!endian.empty() && endian != "little" && endian != "big") fail("\"endian\" is neither little nor big");
  field.big_endian = endian == "big";
  if (const auto offset = object.find("offset"); offset != object.end()) {
    if (!offset->is_number_unsigned()) fail("\"offset\" is not a number of bytes");
    field.first_byte = offset->get<std::uint64_t>();
  }
  check_array_size(field);
  return field;
}

std::unique_ptr<Reader> open_raw(std::unique_ptr<ByteSource> content, const std::filesystem::path& description,
                                 Progress* progress) {
  std::ifstream file(description, std::ios::binary);
  const std::string text(std::istreambuf_iterator<char>(file), {});
  ArrayField field;
  try {
    field = raw_field_of(text);
  } catch (const std::runtime_error& cause) {
    fail(description.filename().string() + ": " + cause.what());
  }
  return make_array_reader("raw", {std::move(field)}, {}, std::move(content), progress);
}

}  // namespace cumulet::volume::detail
