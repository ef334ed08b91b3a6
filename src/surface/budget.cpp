#include "surface/budget.hpp"

#include <algorithm>
#include <fstream>

namespace cumulet::surface::detail {

void malformed(const std::string& cause) { throw Error(ErrorCode::file, cause); }

void Budget::take(std::uint64_t count, std::uint64_t size, std::string_view what) {
  cumulet::check(progress_);
  if (size != 0 && count > left_ / size) {
    malformed(std::string(what) + " would need more than the " + std::to_string(limits_.memory >> 20U) +
              " MiB limit of a glTF file");
  }
  left_ -= count * size;
}

std::vector<std::uint8_t> read_file(const std::filesystem::path& path, Budget& budget) {
  std::error_code error;
  const auto status = std::filesystem::status(path, error);
  if (!std::filesystem::exists(status)) malformed("no such file");
  // Devices and pipes may have no end.
  if (!std::filesystem::is_regular_file(status)) malformed("is not a file");
  const std::uint64_t size = std::filesystem::file_size(path, error);
  if (error) malformed("cannot be read");
  std::ifstream file(path, std::ios::binary);
  if (!file) malformed("cannot be opened");
  budget.take(size, 1, "the file");
  std::vector<std::uint8_t> bytes;
  bytes.reserve(size);
  constexpr std::uint64_t piece = std::uint64_t{4} << 20U;
  while (bytes.size() < size) {
    budget.check(0);
    const std::size_t done = bytes.size();
    bytes.resize(std::min(size, done + piece));
    file.read(reinterpret_cast<char*>(&bytes[done]), static_cast<std::streamsize>(bytes.size() - done));
    if (static_cast<std::size_t>(file.gcount()) != bytes.size() - done) malformed("cannot be read");
  }
  return bytes;
}

}  // namespace cumulet::surface::detail
