#include "light/environment_file.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
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

}  // namespace

EnvironmentPixels read_environment(const FilePath& path, Progress* progress) {
  std::vector<std::uint8_t> bytes = read_bytes(path, progress);
  constexpr std::array<std::uint8_t, 4> open_exr = {0x76, 0x2F, 0x31, 0x01};
  const bool exr = bytes.size() >= open_exr.size() && std::equal(open_exr.begin(), open_exr.end(), bytes.begin());
  return exr ? read_exr(std::move(bytes), path.given(), progress) : read_radiance(bytes, path.given(), progress);
}

EnvironmentPtr open_environment(const FilePath& path, Progress* progress) {
  const auto pixels = make_deferred_delete<const EnvironmentPixels>(read_environment(path, progress));
  return make_environment(*pixels, path.given(), progress);
}

}  // namespace cumulet::light
