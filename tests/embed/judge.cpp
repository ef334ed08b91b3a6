// Checks a host's screenshot with simple measures, and writes a PNG beside it for visual inspection.
//
//     cumulet-judge PICTURE.ppm|.png RULE...
//
// A rule is AREA:MEASURE:LOW..HIGH. AREA: "all", or x0,y0,x1,y1 as fractions of the image from its top left. MEASURE:
// the mean of r, g, b or luma (sRGB-encoded, 0 to 1), "spread" (standard deviation of luma), "edge" (mean difference of
// luma between neighbors), or "differs=OTHER" (mean absolute difference from another image of the same size). Exit
// status: 0 if all rules hold; 1 if some do not, with a line for each.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <exception>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string>

#include "file.hpp"
#include "image.hpp"

namespace {

using cumulet::image::Image;

/// Encoded values for both file types.
Image read(const std::string& path) {
  Image image;
  if (path.ends_with(".png")) {
    image = cumulet::image::read_png(path);
    for (float& value : image.rgba) value = cumulet::image::srgb_encode(value);
    return image;
  }
  std::istringstream file(cumulet::image::read_file(path));
  std::string magic;
  int largest = 0;
  file >> magic >> image.width >> image.height >> largest;
  file.get();
  if (magic != "P6" || largest != 255 || image.width > 16384 || image.height > 16384)
    throw std::runtime_error(path + ": not an 8-bit PPM");
  for (std::size_t i = 0; i < std::size_t{image.width} * image.height; ++i) {
    for (int c = 0; c < 3; ++c) image.rgba.push_back(static_cast<float>(file.get()) / 255.0F);
    image.rgba.push_back(1.0F);
  }
  if (!file) throw std::runtime_error(path + ": cut short");
  return image;
}

void write_encoded(const std::string& path, Image image) {
  for (float& value : image.rgba) value = cumulet::image::srgb_decode(value);
  cumulet::image::write_png(path, image, {.tone_mapping = cumulet::image::ToneMapping::none});
}

struct Area {
  std::uint32_t x0, y0, x1, y1;
};

Area area_of(const Image& image, const std::string& text) {
  std::array<double, 4> part{0.0, 0.0, 1.0, 1.0};
  if (text != "all" && std::sscanf(text.c_str(), "%lf,%lf,%lf,%lf", &part[0], &part[1], &part[2], &part[3]) != 4)
    throw std::runtime_error("no area: " + text);
  const auto at = [](double fraction, std::uint32_t size) { return static_cast<std::uint32_t>(fraction * size); };
  return {at(part[0], image.width), at(part[1], image.height), at(part[2], image.width), at(part[3], image.height)};
}

double luma(const Image& image, std::uint32_t x, std::uint32_t y) {
  const float* p = &image.rgba[(std::size_t{y} * image.width + x) * 4];
  return 0.2126 * p[0] + 0.7152 * p[1] + 0.0722 * p[2];
}

double measure(const Image& image, const Area& area, const std::string& what) {
  Image other;
  if (what.starts_with("differs=")) {
    other = read(what.substr(8));
    if (other.width != image.width || other.height != image.height)
      throw std::runtime_error(what.substr(8) + ": another size");
  } else if (what != "r" && what != "g" && what != "b" && what != "luma" && what != "spread" && what != "edge") {
    throw std::runtime_error("no measure: " + what);
  }
  double sum = 0.0, squares = 0.0, count = 0.0;
  for (std::uint32_t y = area.y0; y < area.y1; ++y) {
    for (std::uint32_t x = area.x0; x < area.x1; ++x) {
      const std::size_t i = (std::size_t{y} * image.width + x) * 4;
      double value = luma(image, x, y);
      if (what.size() == 1) value = image.rgba[i + (what == "r" ? 0 : what == "g" ? 1 : 2)];
      if (what == "edge") value = std::abs(value - luma(image, std::min(x + 1, area.x1 - 1), y));
      if (!other.rgba.empty()) {
        value = 0.0;
        for (std::size_t c = 0; c < 3; ++c) value += std::abs(image.rgba[i + c] - other.rgba[i + c]) / 3.0;
      }
      sum += value;
      squares += value * value;
      count += 1.0;
    }
  }
  if (count == 0.0) throw std::runtime_error("an empty area");
  const double mean = sum / count;
  return what == "spread" ? std::sqrt(std::max(squares / count - mean * mean, 0.0)) : mean;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fputs("usage: cumulet-judge PICTURE AREA:MEASURE:LOW..HIGH ...\n", stderr);
    return 2;
  }
  try {
    const std::string path = argv[1];
    const Image image = read(path);
    if (path.ends_with(".ppm")) write_encoded(path.substr(0, path.size() - 3) + "png", image);
    bool good = true;
    for (int i = 2; i < argc; ++i) {
      const std::string rule = argv[i];
      const std::size_t first = rule.find(':'), last = rule.rfind(':');
      const std::size_t dots = rule.find("..", last);
      if (first == last || dots == std::string::npos) throw std::runtime_error("no rule: " + rule);
      const double low = std::stod(rule.substr(last + 1, dots - last - 1));
      const double high = std::stod(rule.substr(dots + 2));
      const double value =
          measure(image, area_of(image, rule.substr(0, first)), rule.substr(first + 1, last - first - 1));
      const bool holds = value >= low && value <= high;
      std::printf("%s %s: %s is %.4f\n", path.c_str(), holds ? "holds" : "FAILS", rule.c_str(), value);
      good = good && holds;
    }
    return good ? 0 : 1;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "cumulet-judge: %s\n", error.what());
    return 1;
  }
}
