// Recognizes the format of a volume file.

#include <algorithm>
#include <array>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "volume/array_file.hpp"
#include "volume/import_detail.hpp"
#include "volume/source_file.hpp"

namespace cumulet::volume {

using namespace detail;

namespace {

bool begins_with(ByteSource& content, std::string_view magic) {
  std::string head(magic.size(), '\0');
  head.resize(content.read(0, head.data(), head.size()));
  return head == magic;
}

bool is_nrrd(ByteSource& content) { return begins_with(content, "NRRD0"); }

bool is_vtk(ByteSource& content) {
  std::string head(256, '\0');
  head.resize(content.read(0, head.data(), head.size()));
  return head.find("<VTKFile") != std::string::npos;
}

bool is_tiff(ByteSource& content) {
  // Both byte orders, of TIFF and of BigTIFF.
  constexpr std::array<std::string_view, 4> magics = {{{"II*\0", 4}, {"MM\0*", 4}, {"II+\0", 4}, {"MM\0+", 4}}};
  return std::ranges::any_of(magics, [&](std::string_view magic) { return begins_with(content, magic); });
}

bool is_digit(char c) { return c >= '0' && c <= '9'; }

/// Compares names such that slice9 is before slice10.
bool numbers_in_order(std::string_view a, std::string_view b) {
  const auto number_length = [](std::string_view text) {
    return static_cast<std::size_t>(std::ranges::find_if_not(text, is_digit) - text.begin());
  };
  const auto skip_zeros = [](std::string_view& text) {
    text.remove_prefix(std::min(text.find_first_not_of('0'), text.size()));
  };
  while (!a.empty() && !b.empty()) {
    if (is_digit(a[0]) && is_digit(b[0])) {
      skip_zeros(a);
      skip_zeros(b);
      const std::size_t digits_a = number_length(a);
      const std::size_t digits_b = number_length(b);
      if (digits_a != digits_b) return digits_a < digits_b;
      if (const int order = a.compare(0, digits_a, b, 0, digits_b); order != 0) return order < 0;
      a.remove_prefix(digits_a);
      b.remove_prefix(digits_b);
    } else {
      if (a[0] != b[0]) return a[0] < b[0];
      a.remove_prefix(1);
      b.remove_prefix(1);
    }
  }
  return a.size() < b.size();
}

/// Returns the TIFF files of a folder, in the order of the numbers in their names.
std::vector<std::filesystem::path> tiff_files_of(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    const std::string ending = lower_case(entry.path().extension().string());
    const bool hidden = entry.path().filename().string().starts_with('.');
    if ((ending == ".tif" || ending == ".tiff") && !hidden && entry.is_regular_file()) files.push_back(entry.path());
  }
  std::ranges::sort(files, [](const auto& a, const auto& b) {
    const std::string name_a = a.filename().string();
    const std::string name_b = b.filename().string();
    if (numbers_in_order(name_a, name_b)) return true;
    return !numbers_in_order(name_b, name_a) && name_a < name_b;
  });
  return files;
}

}  // namespace

std::unique_ptr<Reader> detail::open(const std::filesystem::path& file, Progress* progress) {
  namespace fs = std::filesystem;
  std::error_code error;
  const fs::file_status status = fs::status(file, error);
  if (status.type() == fs::file_type::not_found) fail("no such file");
  if (status.type() == fs::file_type::none) fail(error.message());
  if (status.type() == fs::file_type::directory) {
    const std::vector<fs::path> slices = tiff_files_of(file);
    if (slices.empty()) fail("is a directory");
    return open_tiff_slices(slices, progress);
  }
  if (status.type() != fs::file_type::regular) fail("is not a regular file");
  std::unique_ptr<ByteSource> content = open_file(file);
  if (const auto description = raw_description_of(file)) return open_raw(std::move(content), *description, progress);
  if (is_nrrd(*content)) return open_nrrd(std::move(content), file.parent_path(), progress);
  if (file.extension() == ".raw" && !begins_with(*content, "NanoVDB") && !begins_with(*content, " BDV")) {
    const std::string name = file.filename().string();
    fail("has no description beside it: " + name + ".json or " + file.stem().string() + ".json");
  }
  return open(std::move(content), progress);
}

std::uint64_t detail::bytes_of(const std::filesystem::path& file) {
  if (!std::filesystem::is_directory(file)) return std::filesystem::file_size(file);
  std::uint64_t bytes = 0;
  for (const std::filesystem::path& slice : tiff_files_of(file)) bytes += std::filesystem::file_size(slice);
  return bytes;
}

std::unique_ptr<Reader> detail::open(std::unique_ptr<ByteSource> content, Progress* progress) {
  if (is_nrrd(*content)) return open_nrrd(std::move(content), std::nullopt, progress);
  if (is_tiff(*content)) return open_tiff(std::move(content), progress);
  if (is_vtk(*content)) return open_vti(std::move(content), progress);
  // Recognized by content: a wrong file extension is no error.
  std::array<char, 8> magic{};
  const std::size_t got = content->read(0, magic.data(), magic.size());
  const std::string_view head(magic.data(), got);
  if (got == 0) fail("is empty");
  if (head.starts_with("NanoVDB")) return open_nanovdb(std::move(content), progress);
  if (head == std::string_view(" BDV\0\0\0\0", 8)) return open_vdb(std::move(content), progress);
  if (head.ends_with("BDVonaN")) fail("is a NanoVDB file in big-endian byte order, which is not supported");
  if (head == std::string_view("\0\0\0\0VDB ", 8)) {
    fail("is an OpenVDB file in big-endian byte order, which is not supported");
  }
  if (got < magic.size()) fail("is too short to be a VDB, NanoVDB, NRRD, VTK or TIFF file");
  fail("is not a VDB, NanoVDB, NRRD, VTK or TIFF file");
}

}  // namespace cumulet::volume
