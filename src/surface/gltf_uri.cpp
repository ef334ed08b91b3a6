#include "surface/gltf_uri.hpp"

#include <algorithm>
#include <cctype>
#include <system_error>

#include "base/base64.hpp"

namespace cumulet::surface::detail {

namespace {

namespace fs = std::filesystem;

bool same_letters(std::string_view a, std::string_view b) {
  return std::ranges::equal(a, b, [](unsigned char x, unsigned char y) { return std::tolower(x) == std::tolower(y); });
}

std::string_view trimmed(std::string_view text) {
  const auto blank = [](char c) { return std::isspace(static_cast<unsigned char>(c)) != 0; };
  while (!text.empty() && blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && blank(text.back())) text.remove_suffix(1);
  return text;
}

std::string decode_percent(std::string_view uri, const Budget* budget = nullptr) {
  const auto digit = [](char c) {
    if (c >= '0' && c <= '9') return c - '0';
    if (c >= 'a' && c <= 'f') return c - 'a' + 10;
    if (c >= 'A' && c <= 'F') return c - 'A' + 10;
    return -1;
  };
  std::string text;
  text.reserve(uri.size());
  for (std::size_t i = 0; i < uri.size(); ++i) {
    if (budget != nullptr) budget->check(i);
    if (uri[i] == '%' && i + 2 < uri.size() && digit(uri[i + 1]) >= 0 && digit(uri[i + 2]) >= 0) {
      text += static_cast<char>(digit(uri[i + 1]) * 16 + digit(uri[i + 2]));
      i += 2;
    } else {
      text += uri[i];
    }
  }
  return text;
}

std::vector<std::uint8_t> decode_base64(std::string_view text, const Budget& budget) {
  std::vector<std::uint8_t> bytes;
  bytes.reserve(text.size() / 4 * 3 + 3);
  Base64Decoder decoder;
  for (std::size_t i = 0; i < text.size(); ++i) {
    budget.check(i);
    const Base64Decoder::Step step = decoder.take(text[i]);
    if (step == Base64Decoder::Step::bad) malformed("a data URI is not base64");
    if (step == Base64Decoder::Step::byte) bytes.push_back(decoder.byte());
  }
  return bytes;
}

/// "data:[type][;attribute=value][;base64],bytes"; values may be in quotes.
std::vector<std::uint8_t> decode_data_uri(std::string_view uri, Budget& budget) {
  std::size_t comma = 0;
  for (bool quoted = false; comma < uri.size() && (quoted || uri[comma] != ','); ++comma) {
    if (uri[comma] == '"') quoted = !quoted;
  }
  if (comma == uri.size()) comma = uri.find(',');
  if (comma == std::string_view::npos) malformed("a data URI has no data");
  bool base64 = false;
  for (std::string_view head = uri.substr(0, comma); !head.empty();) {
    const std::size_t next = std::min(head.find(';'), head.size() - 1) + 1;
    const std::string_view parameter = head.substr(0, next);
    base64 |= same_letters(trimmed(parameter.substr(0, parameter.find(';'))), "base64");
    head.remove_prefix(next);
  }
  const std::string_view data = uri.substr(comma + 1);
  const bool encoded = data.find('%') != std::string_view::npos;
  budget.take(data.size(), base64 && encoded ? 2 : 1, "a data URI");
  if (base64 && !encoded) return decode_base64(data, budget);
  const std::string plain = decode_percent(data, &budget);
  if (base64) return decode_base64(plain, budget);
  return {plain.begin(), plain.end()};
}

/// Returns true for URIs such as "http:..." (RFC 3986, 3.1).
bool has_scheme(std::string_view uri) {
  const std::size_t colon = uri.find(':');
  return colon != std::string_view::npos && colon != 0 && std::isalpha(static_cast<unsigned char>(uri[0])) != 0 &&
         std::ranges::all_of(uri.substr(0, colon),
                             [](unsigned char c) { return std::isalnum(c) != 0 || c == '+' || c == '.' || c == '-'; });
}

bool is_relative(const std::string& path) {
  return path.front() != '/' && path.front() != '\\' && path.find('\0') == std::string::npos;
}

}  // namespace

bool is_data_uri(std::string_view uri) { return same_letters(uri.substr(0, 5), "data:"); }

std::vector<std::string> paths_of(std::string_view uri) {
  std::vector<std::string> paths;
  const auto add = [&paths](const std::string& path) {
    if (!path.empty() && std::ranges::find(paths, path) == paths.end()) paths.push_back(path);
  };
  const auto add_both = [&](const std::string& path) {
    add(path);
    std::string slashes = path;
    std::ranges::replace(slashes, '\\', '/');
    add(slashes);
  };
  // A file whose name contains "?" or "#" may be named without encoding.
  if (!has_scheme(uri)) {
    add_both(decode_percent(uri.substr(0, uri.find_first_of("?#"))));
    add_both(decode_percent(uri.substr(0, uri.find('#'))));
    add_both(decode_percent(uri));
  }
  add_both(std::string(uri));
  return paths;
}

std::vector<std::uint8_t> resolve_uri(const std::string& uri, const std::optional<fs::path>& folder, Budget& budget) {
  if (is_data_uri(uri)) return decode_data_uri(std::string_view(uri).substr(5), budget);
  if (uri.empty()) malformed("its URI is empty");
  const std::string quoted = std::string("\"").append(one_line(uri)).append("\"");
  const std::vector<std::string> paths = paths_of(uri);
  if (!std::ranges::all_of(paths, is_relative)) malformed(quoted + " is not a relative path");
  if (!folder && !has_scheme(uri)) malformed(quoted + " is an external file, but the glTF data has no folder");
  const auto there = [&](bool (*is)(const fs::path&, std::error_code&)) {
    return std::ranges::find_if(paths, [&](const std::string& path) {
      std::error_code unknown;
      return folder && is(*folder / path, unknown);
    });
  };
  auto found = there([](const fs::path& path, std::error_code& error) { return fs::is_regular_file(path, error); });
  if (found == paths.end() && has_scheme(uri)) malformed(quoted + " is not a relative path");
  if (found == paths.end()) {
    found = there([](const fs::path& path, std::error_code& error) { return fs::exists(path, error); });
  }
  try {
    return read_file(*folder / (found == paths.end() ? paths.front() : *found), budget);
  } catch (const Error& error) {
    throw Error(error.code(), one_line(uri) + ": " + error.what());
  }
}

}  // namespace cumulet::surface::detail
