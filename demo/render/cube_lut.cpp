#include "cube_lut.hpp"

#include <array>
#include <fstream>
#include <program.hpp>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "option_values.hpp"

namespace cumulet::demo {

namespace {

constexpr std::uint64_t min_size = 2;
constexpr std::uint64_t max_size = 65;

class CubeReader {
 public:
  CubeReader(std::istream& file, const std::string& name) : file_(file), name_(name) {}

  DisplayLut read() {
    for (std::string text; std::getline(file_, text);) {
      ++line_;
      if (text.find('\0') != std::string::npos) fail("it is not a text");
      const std::vector<std::string_view> parts = words(text);
      if (!parts.empty() && !parts[0].starts_with('#')) line(parts);
    }
    if (lut_.size == 0) refuse("it has no LUT_3D_SIZE");
    const std::uint64_t points = std::uint64_t{lut_.size} * lut_.size * lut_.size;
    if (lut_.values.size() != 3 * points) {
      refuse("it has " + std::to_string(lut_.values.size() / 3) + " points, not " + std::to_string(points));
    }
    if (!(lut_.domain_min < lut_.domain_max)) refuse("its DOMAIN_MIN is not below its DOMAIN_MAX");
    return std::move(lut_);
  }

 private:
  [[noreturn]] void refuse(const std::string& cause) const { throw std::runtime_error(name_ + ": " + cause); }
  [[noreturn]] void fail(const std::string& cause) const { refuse("line " + std::to_string(line_) + ": " + cause); }

  std::array<float, 3> numbers(const std::vector<std::string_view>& parts, std::size_t first) const {
    if (parts.size() != first + 3) fail("it does not have three numbers");
    std::array<float, 3> values{};
    try {
      for (std::size_t i = 0; i < 3; ++i) values[i] = static_cast<float>(parse_number(parts[first + i]));
    } catch (const UsageError& error) {
      fail(error.what());
    }
    return values;
  }

  float domain(const std::vector<std::string_view>& parts) const {
    const std::array<float, 3> values = numbers(parts, 1);
    if (values[1] != values[0] || values[2] != values[0]) fail("the domains of the channels differ");
    return values[0];
  }

  void set_size(const std::vector<std::string_view>& parts) {
    if (parts.size() != 2) fail("LUT_3D_SIZE has no number");
    try {
      lut_.size = static_cast<std::uint32_t>(parse_integer(parts[1], min_size, max_size));
    } catch (const UsageError& error) {
      fail(std::string("LUT_3D_SIZE: ") + error.what());
    }
  }

  void line(const std::vector<std::string_view>& parts) {
    const std::string_view key = parts[0];
    if (key == "TITLE") return;
    if (key == "LUT_3D_SIZE") return set_size(parts);
    if (key == "LUT_1D_SIZE") fail("1D LUTs are not supported");
    if (key == "DOMAIN_MIN") {
      lut_.domain_min = domain(parts);
    } else if (key == "DOMAIN_MAX") {
      lut_.domain_max = domain(parts);
    } else {
      for (const float value : numbers(parts, 0)) lut_.values.push_back(value);
      constexpr std::size_t most = 3 * max_size * max_size * max_size;
      if (lut_.values.size() > most) fail("it has more than 65^3 points");
    }
  }

  std::istream& file_;
  const std::string& name_;
  std::size_t line_ = 0;
  DisplayLut lut_;
};

}  // namespace

DisplayLut read_cube_lut(std::istream& file, const std::string& name) { return CubeReader(file, name).read(); }

DisplayLut read_cube_lut(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw std::runtime_error(path + ": cannot be opened");
  return read_cube_lut(file, path);
}

}  // namespace cumulet::demo
