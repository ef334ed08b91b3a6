#include "gl/program_files.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <fstream>
#include <limits>
#include <random>
#include <span>
#include <string_view>
#include <system_error>

#include "base/error.hpp"

namespace cumulet::gl {

namespace {

namespace fs = std::filesystem;

constexpr std::array<char, 8> magic{'C', 'U', 'M', 'P', 'R', 'O', 'G', '1'};
constexpr std::string_view suffix = ".program";
constexpr std::string_view unfinished = ".part";
constexpr auto given_up = std::chrono::hours(1);  // leftovers of a writer that died

struct Key {
  std::uint64_t first = 0, second = 0;
  bool operator==(const Key&) const = default;
};

struct Header {
  std::array<char, 8> kind{};
  Key key;
  std::uint64_t length = 0;
  std::uint64_t sum = 0;
  std::uint64_t format = 0;
};
static_assert(sizeof(Header) == 48);

// FNV-1a, followed by the finalizer of MurmurHash3.
std::uint64_t hash(std::span<const std::byte> bytes, std::uint64_t basis) {
  std::uint64_t h = basis;
  for (const std::byte b : bytes) h = (h ^ static_cast<std::uint64_t>(b)) * 0x100000001b3U;
  h = (h ^ (h >> 33U)) * 0xff51afd7ed558ccdU;
  h = (h ^ (h >> 33U)) * 0xc4ceb9fe1a85ec53U;
  return h ^ (h >> 33U);
}
constexpr std::uint64_t basis = 0xcbf29ce484222325U;
constexpr std::uint64_t other_basis = 0x9e3779b97f4a7c15U;

Key key_of(const std::string& driver, const std::string& source) {
  std::string all = driver;
  all.push_back('\0');
  all.append(source);
  const auto bytes = std::as_bytes(std::span(all));
  return {hash(bytes, basis), hash(bytes, other_basis)};
}

fs::path file_of(const fs::path& folder, const Key& key) {
  std::array<char, 33> digits{};
  std::snprintf(digits.data(), digits.size(), "%016llx%016llx", static_cast<unsigned long long>(key.first),
                static_cast<unsigned long long>(key.second));
  return folder / std::string(digits.data()).append(suffix);
}

// Whether the name is that of a finished cache file.
bool is_whole(std::string_view name) {
  constexpr std::size_t digits = 32;
  if (!name.ends_with(suffix)) return false;
  name.remove_suffix(suffix.size());
  return name.size() == digits && name.find_first_not_of("0123456789abcdef") == std::string_view::npos;
}

// Whether the name is that of a temporary file of keep(): the final name, a number, and `unfinished`.
bool is_part(std::string_view name) {
  if (!name.ends_with(unfinished)) return false;
  name.remove_suffix(unfinished.size());
  const std::size_t end = name.find_last_not_of("0123456789") + 1;
  return end < name.size() && is_whole(name.substr(0, end));
}

// Checksum of everything that is passed to the driver.
std::uint64_t sum_of(std::uint64_t format, std::span<const std::byte> bytes) {
  const std::array<std::uint64_t, 2> words{format, bytes.size()};
  return hash(bytes, hash(std::as_bytes(std::span(words)), basis));
}

[[noreturn]] void fail(const fs::path& path, const std::string& why) {
  throw Error(ErrorCode::file, path.string() + ": " + why);
}

}  // namespace

std::optional<ProgramFiles::Binary> ProgramFiles::find(const std::string& driver, const std::string& source) {
  const std::scoped_lock lock(mutex_);
  const Key key = key_of(driver, source);
  const fs::path path = file_of(folder_.absolute(), key);
  std::error_code error;
  const std::uintmax_t size = fs::file_size(path, error);
  if (error || size <= sizeof(Header) || size > max_bytes_) return std::nullopt;
  Header header;
  Binary binary;
  binary.bytes.resize(static_cast<std::size_t>(size - sizeof(Header)));
  std::ifstream file(path, std::ios::binary);
  file.read(reinterpret_cast<char*>(&header), sizeof(header));
  file.read(reinterpret_cast<char*>(binary.bytes.data()), static_cast<std::streamsize>(binary.bytes.size()));
  if (!file || header.kind != magic || header.key != key || header.length != binary.bytes.size() ||
      header.format > std::numeric_limits<std::uint32_t>::max() || header.sum != sum_of(header.format, binary.bytes)) {
    return std::nullopt;
  }
  binary.format = static_cast<std::uint32_t>(header.format);
  fs::last_write_time(path, fs::file_time_type::clock::now(), error);  // marks it as recently used
  return binary;
}

void ProgramFiles::keep(const std::string& driver, const std::string& source, const Binary& binary) {
  const std::scoped_lock lock(mutex_);
  std::error_code error;
  const fs::path folder = folder_.absolute();
  fs::create_directories(folder, error);
  if (error) fail(folder_.given(), error.message());
  const auto as_given = [&](const fs::path& file) { return fs::path(folder_.given()) / file.filename(); };
  const Key key = key_of(driver, source);
  const fs::path path = file_of(folder, key);
  fs::path part = path;
  part += std::to_string(std::random_device{}());  // another process may write the same key
  part += unfinished;
  {
    const Header header{magic, key, binary.bytes.size(), sum_of(binary.format, binary.bytes), binary.format};
    std::ofstream file(part, std::ios::binary | std::ios::trunc);
    file.write(reinterpret_cast<const char*>(&header), sizeof(header));
    file.write(reinterpret_cast<const char*>(binary.bytes.data()), static_cast<std::streamsize>(binary.bytes.size()));
    file.close();
    if (!file) {
      fs::remove(part, error);
      fail(as_given(part), "cannot be written");
    }
  }
  fs::rename(part, path, error);
  if (error) {
    const std::string why = error.message();
    fs::remove(part, error);
    fail(as_given(path), why);
  }
  make_room();
}

void ProgramFiles::make_room() const {
  struct File {
    fs::path path;
    fs::file_time_type time;
    std::uintmax_t size = 0;
  };
  const auto now = fs::file_time_type::clock::now();
  std::vector<File> files;
  std::uintmax_t bytes = 0;
  std::error_code error;
  for (fs::directory_iterator at(folder_.absolute(), error), end; !error && at != end; at.increment(error)) {
    std::error_code gone;  // deleted by another process
    const File file{at->path(), at->last_write_time(gone), at->file_size(gone)};
    if (gone) continue;
    const std::string name = file.path.filename().string();
    if (is_part(name) && now - file.time > given_up) fs::remove(file.path, gone);
    if (!is_whole(name)) continue;
    bytes += file.size;
    files.push_back(file);
  }
  std::ranges::sort(files, {}, &File::time);
  for (const File& file : files) {
    if (bytes <= max_bytes_) return;
    fs::remove(file.path, error);
    bytes -= file.size;
  }
}

}  // namespace cumulet::gl
