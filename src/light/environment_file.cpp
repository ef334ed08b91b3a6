#include "light/environment_file.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <system_error>
#include <vector>

#include "base/detached_work.hpp"
#include "base/error.hpp"
#include "base/one_line.hpp"
#include "base/progress_part.hpp"
#include "base/read_rest.hpp"
#include "light/environment_reading.hpp"
#include "light/exr_file.hpp"
#include "light/radiance_file.hpp"

namespace cumulet::light {

namespace {

/// More than the largest environment that is read takes, even without compression.
constexpr std::uint64_t max_file_bytes = std::uint64_t{16} << 30U;

[[noreturn]] void fail(const std::string& name, const std::string& cause) {
  throw Error(ErrorCode::file, one_line(name) + ": " + cause);
}

/// Reads the whole file in pieces, so that a load can be cancelled.
std::vector<std::uint8_t> read_bytes(const FilePath& path, Progress* progress) {
  std::ifstream file(path.absolute(), std::ios::binary);
  if (!file) fail(path.given(), std::strerror(errno));
  std::error_code unknown;
  const std::uintmax_t reported = std::filesystem::file_size(path.absolute(), unknown);
  const std::uintmax_t size = unknown ? 0 : reported;
  constexpr std::size_t piece = std::size_t{1} << 20U;
  ProgressPart part(progress, 0.0, decoded_from, size);
  std::vector<std::uint8_t> bytes;
  bytes.reserve(size + piece);
  read_rest(file, bytes, [&part](std::size_t count) { part.add(count); });
  if (file.bad()) fail(path.given(), std::strerror(errno));
  return bytes;
}

EnvironmentPixels decode(std::vector<std::uint8_t> bytes, const std::string& name, Progress* progress) {
  constexpr std::array<std::uint8_t, 4> open_exr = {0x76, 0x2F, 0x31, 0x01};
  const bool exr = bytes.size() >= open_exr.size() && std::equal(open_exr.begin(), open_exr.end(), bytes.begin());
  return exr ? read_exr(std::move(bytes), name, progress) : read_radiance(bytes, name, progress);
}

}  // namespace

EnvironmentPixels read_environment(const FilePath& path, Progress* progress) {
  return decode(read_bytes(path, progress), path.given(), progress);
}

EnvironmentPtr open_environment(const FilePath& path, Progress* progress) {
  const auto pixels = make_deferred_delete<const EnvironmentPixels>(read_environment(path, progress));
  return make_environment(*pixels, path.given(), progress);
}

EnvironmentPtr read_environment_content(ByteSource& content, const std::string& name) {
  if (content.size() > max_file_bytes) fail(name, "has more than 16 GB");
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(content.size()));
  try {
    bytes.resize(content.read(0, reinterpret_cast<char*>(bytes.data()), bytes.size()));
  } catch (const std::runtime_error& cause) {
    fail(name, cause.what());
  }
  return make_environment(decode(std::move(bytes), name, nullptr), name);
}

}  // namespace cumulet::light
