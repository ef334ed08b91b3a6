#include "denoise/tza.hpp"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <fstream>
#include <glm/gtc/packing.hpp>

#include "base/error.hpp"
#include "base/one_line.hpp"
#include "base/read_rest.hpp"

namespace cumulet::denoise {

namespace {

constexpr std::uint32_t magic = 0x41D7;
constexpr unsigned version = 2;
constexpr std::size_t header_bytes = 12;
constexpr unsigned max_dimensions = 4;

class Reader {
 public:
  Reader(std::span<const std::uint8_t> bytes, const std::string& name) : bytes_(bytes), name_(name) {}

  TensorArchive read() {
    if (bytes_.size() < 2 || number(2) != magic) fail("is not a tensor archive (.tza) of Open Image Denoise");
    if (bytes_.size() < header_bytes) fail("is truncated: incomplete header");
    const std::uint64_t major = number(1);
    number(1);  // the minor version is irrelevant for readers
    if (major != version) fail("is a tensor archive of version " + std::to_string(major) + ", not 2");
    const std::uint64_t table = number(8);
    if (table > bytes_.size()) fail("is truncated: no tensor table");
    at_ = static_cast<std::size_t>(table);
    TensorArchive archive;
    for (std::uint64_t left = number(4); left > 0; --left) add(archive);
    return archive;
  }

 private:
  [[noreturn]] void fail(const std::string& cause) const { throw Error(ErrorCode::file, name_ + ": " + cause); }

  std::span<const std::uint8_t> take(std::size_t size) {
    if (size > bytes_.size() - at_) fail("is truncated: incomplete tensor table");
    at_ += size;
    return bytes_.subspan(at_ - size, size);
  }

  std::uint64_t number(std::size_t size) {
    std::uint64_t value = 0;
    unsigned shift = 0;
    for (const std::uint8_t byte : take(size)) {
      value |= std::uint64_t{byte} << shift;
      shift += 8;
    }
    return value;
  }

  std::string text(std::size_t size) {
    const auto letters = take(size);
    return {letters.begin(), letters.end()};
  }

  void add(TensorArchive& archive) {
    const std::string tensor_name = text(static_cast<std::size_t>(number(2)));
    tensor_ = "tensor '" + one_line(tensor_name, 60) + "' ";
    const std::uint64_t dimensions = number(1);
    if (dimensions < 1 || dimensions > max_dimensions)
      fail(tensor_ + "has " + std::to_string(dimensions) + " dimensions");
    Tensor tensor;
    std::uint64_t count = 1;
    for (std::uint64_t i = 0; i < dimensions; ++i) {
      tensor.shape.push_back(static_cast<std::uint32_t>(number(4)));
      // The clamp avoids overflow: counts beyond the file size are rejected below.
      count = std::min<std::uint64_t>(count * tensor.shape.back(), max_tza_bytes);
    }
    tensor.layout = text(static_cast<std::size_t>(dimensions));
    const auto type = static_cast<char>(number(1));
    if (type != 'h' && type != 'f') fail(tensor_ + "has a data type other than half ('h') or float ('f')");
    const std::uint64_t offset = number(8);
    const std::uint64_t value_bytes = type == 'h' ? 2 : 4;
    if (count == 0) fail(tensor_ + "is empty");
    if (offset > bytes_.size() || count > (bytes_.size() - offset) / value_bytes) {
      fail(tensor_ + "exceeds the end of the file");
    }
    // Otherwise a small file with overlapping tensors could request any amount of memory.
    used_ += count * value_bytes;
    if (used_ > bytes_.size()) fail(tensor_ + "overlaps another tensor");
    tensor.values = values(bytes_.subspan(static_cast<std::size_t>(offset)), static_cast<std::size_t>(count), type);
    if (!archive.emplace(tensor_name, std::move(tensor)).second) fail(tensor_ + "occurs twice");
  }

  [[nodiscard]] std::vector<float> values(std::span<const std::uint8_t> from, std::size_t count, char type) const {
    std::vector<float> result(count);
    if (type == 'f') {
      std::memcpy(result.data(), from.data(), count * sizeof(float));
    } else {
      for (std::size_t i = 0; i < count; ++i) {
        std::uint16_t half = 0;
        std::memcpy(&half, from.data() + i * sizeof(half), sizeof(half));
        result[i] = glm::unpackHalf1x16(half);
      }
    }
    if (!std::ranges::all_of(result, [](float value) { return std::isfinite(value); })) {
      fail(tensor_ + "contains a non-finite value");
    }
    return result;
  }

  std::span<const std::uint8_t> bytes_;
  const std::string& name_;
  std::size_t at_ = 0;
  std::uint64_t used_ = 0;  // total bytes of values so far
  std::string tensor_;      // the tensor being read, for messages
};

}  // namespace

TensorArchive read_tza(std::span<const std::uint8_t> bytes, const std::string& name) {
  return Reader(bytes, name).read();
}

TensorArchive read_tza(const FilePath& path) {
  const auto fail = [&](const std::string& cause) { throw Error(ErrorCode::file, path.given() + ": " + cause); };
  std::ifstream file(path.absolute(), std::ios::binary);
  if (!file) fail(std::strerror(errno));
  std::vector<std::uint8_t> bytes;
  read_rest(file, bytes, [&](std::size_t /*count*/) {
    if (bytes.size() > max_tza_bytes) fail("is larger than 64 MiB, the maximum for a network");
  });
  if (file.bad()) fail(std::strerror(errno));
  return read_tza(bytes, path.given());
}

}  // namespace cumulet::denoise
