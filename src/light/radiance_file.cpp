#include "light/radiance_file.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "base/error.hpp"
#include "base/one_line.hpp"
#include "base/progress_part.hpp"
#include "light/environment_reading.hpp"
#include "light/radiance_header.hpp"

namespace cumulet::light {

namespace {

using Pixel = std::array<std::uint8_t, 4>;

[[noreturn]] void fail(const std::string& name, const std::string& cause) {
  throw Error(ErrorCode::file, one_line(name) + ": " + cause);
}

/// Decodes lines of pixels. stb_image is not used: it reads a truncated file as one whose rest is black.
class RadianceLines {
 public:
  RadianceLines(std::span<const std::uint8_t> bytes, const std::string& name) : bytes_(bytes), name_(name) {}

  /// Reads a line, flat or run-length encoded; the line's first bytes show which.
  void read(std::vector<Pixel>& line) {
    const std::size_t length = line.size();
    const bool coded = length >= 8 && length < 32768 && left() >= 4 && bytes_[at_] == 2 && bytes_[at_ + 1] == 2 &&
                       bytes_[at_ + 2] < 128;
    if (!coded) return read_old(line);
    if ((std::size_t{bytes_[at_ + 2]} << 8U | bytes_[at_ + 3]) != length) fail(name_, "a row has the wrong width");
    at_ += 4;
    for (std::size_t c = 0; c < 4; ++c) {
      for (std::size_t x = 0; x < length;) {
        const std::uint8_t count = next();
        const bool run = count > 128;
        const std::size_t pixels = run ? count - 128U : count;
        if (pixels == 0 || pixels > length - x) fail(name_, "a run exceeds its row");
        std::uint8_t value = run ? next() : std::uint8_t{0};
        for (std::size_t i = 0; i < pixels; ++i) {
          if (!run) value = next();
          line[x++][c] = value;
        }
      }
    }
  }

  /// Reads pixels without any coding.
  void read_flat(std::vector<Pixel>& line) {
    for (Pixel& pixel : line) {
      for (std::uint8_t& byte : pixel) byte = next();
    }
  }

  [[nodiscard]] std::size_t left() const { return bytes_.size() - at_; }

 private:
  std::uint8_t next() {
    if (at_ >= bytes_.size()) fail(name_, "truncated Radiance file");
    return bytes_[at_++];
  }

  /// Old run-length encoding: 1, 1, 1, n repeats the previous pixel n times; directly following counts are shifted by 8
  /// more bits each.
  void read_old(std::vector<Pixel>& line) {
    unsigned shift = 0;
    for (std::size_t x = 0; x < line.size();) {
      Pixel pixel{};
      for (std::uint8_t& byte : pixel) byte = next();
      if (pixel[0] != 1 || pixel[1] != 1 || pixel[2] != 1) {
        line[x++] = pixel;
        shift = 0;
        continue;
      }
      const std::size_t length = shift < 24 ? std::size_t{pixel[3]} << shift : line.size();
      if (x == 0 || length > line.size() - x) fail(name_, "a run exceeds its row");
      for (std::size_t i = 0; i < length; ++i, ++x) line[x] = line[x - 1];
      shift += 8;
    }
  }

  std::span<const std::uint8_t> bytes_;
  const std::string& name_;
  std::size_t at_ = 0;
};

class RadianceReader {
 public:
  RadianceReader(std::span<const std::uint8_t> bytes, const std::string& name, Progress* progress)
      : name_(name),
        progress_(progress),
        header_(read_radiance_header(bytes, name)),
        data_(bytes.subspan(header_.size)) {}

  EnvironmentPixels read() {
    check_environment_size(name_, header_.width, header_.height);
    // Minimum size of a line in any coding.
    const std::size_t least = std::min<std::size_t>(header_.line_length(), 4);
    if (data_.size() / least < header_.lines()) fail(name_, "truncated Radiance file");
    decode();
    turn();
    EnvironmentPixels pixels{header_.width, header_.height, std::move(values_), std::move(header_.remarks)};
    if (header_.xyz) {
      convert_rows(pixels, rec709_matrix_of_xyz(), "CIE XYZ", progress_);
    } else if (header_.primaries && !similar(*header_.primaries, Primaries{})) {
      convert_rows(pixels, rec709_matrix(*header_.primaries).value(), name_of(*header_.primaries), progress_);
    }
    return pixels;
  }

 private:
  /// Size of the image in bytes if no line is coded.
  [[nodiscard]] std::size_t flat_size() const { return std::size_t{4} * header_.width * header_.height; }

  void decode() {
    const bool may_be_flat = data_.size() == flat_size();
    try {
      if (lines(false) == 0 || !may_be_flat) return;
    } catch (const Error& error) {
      if (error.code() != ErrorCode::file || !may_be_flat) throw;
    }
    // The colors of a flat image may look like the beginning of a coded line.
    lines(true);
  }

  /// Decodes all lines. Returns the number of bytes left.
  std::size_t lines(bool flat) {
    values_.clear();
    values_.reserve(std::size_t{header_.width} * header_.height);
    RadianceLines from(data_, name_);
    std::vector<Pixel> line(header_.line_length());
    ProgressPart part(progress_, decoded_from, decoded_to, header_.lines());
    for (std::uint32_t i = 0; i < header_.lines(); ++i) {
      part.add(1);
      if (flat) {
        from.read_flat(line);
      } else {
        from.read(line);
      }
      for (const auto& [r, g, b, e] : line) {
        const double unit = e == 0 ? 0.0 : std::ldexp(1.0, e - 136);
        values_.emplace_back(glm::dvec3(r, g, b) * unit / header_.exposure);
      }
    }
    return from.left();
  }

  /// Reorders lines to "-Y HEIGHT +X WIDTH".
  void turn() {
    if (!header_.in_columns && !header_.upwards && !header_.leftwards) return;
    std::vector<glm::vec3> turned;
    resize(turned, values_.size(), progress_);
    const std::size_t length = header_.line_length();
    for (std::uint32_t y = 0; y < header_.height; ++y) {
      check(progress_);
      const std::size_t row = header_.upwards ? header_.height - 1 - y : y;
      for (std::uint32_t x = 0; x < header_.width; ++x) {
        const std::size_t column = header_.leftwards ? header_.width - 1 - x : x;
        turned[std::size_t{y} * header_.width + x] =
            header_.in_columns ? values_[column * length + row] : values_[row * length + column];
      }
    }
    values_ = std::move(turned);
  }

  const std::string& name_;
  Progress* progress_;
  RadianceHeader header_;
  std::span<const std::uint8_t> data_;
  std::vector<glm::vec3> values_;
};

}  // namespace

EnvironmentPixels read_radiance(std::span<const std::uint8_t> bytes, const std::string& name, Progress* progress) {
  return RadianceReader(bytes, name, progress).read();
}

}  // namespace cumulet::light
