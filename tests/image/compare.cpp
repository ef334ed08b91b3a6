// compare A B [--tolerance T] [--bias T]: noise-aware comparison of two linear images (.exr or .pfm), after OSPRay's
// test tools. Signed errors are averaged over blocks, where noise cancels and a real difference remains.
//
// Passes if the mean of every 8 x 8 block differs by at most T (default 0.1) of the larger of the block's and the
// image's mean, and the mean of the image by at most the bias (default 0.01) of it. Exit status: 0 equal, 1 not, 2
// usage.

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <iostream>
#include <string>

#include "image.hpp"

namespace {

using cumulet::image::Image;

Image read(const std::string& path) {
  return path.ends_with(".pfm") ? cumulet::image::read_pfm(path) : cumulet::image::read_exr(path);
}

struct Mean {
  double value[3] = {0.0, 0.0, 0.0};
};

Mean mean_of(const Image& image, std::uint32_t x0, std::uint32_t y0, std::uint32_t x1, std::uint32_t y1) {
  Mean mean;
  double count = 0.0;
  for (std::uint32_t y = y0; y < std::min(y1, image.height); ++y) {
    for (std::uint32_t x = x0; x < std::min(x1, image.width); ++x) {
      for (std::size_t c = 0; c < 3; ++c) mean.value[c] += image.rgba[(std::size_t{y} * image.width + x) * 4 + c];
      count += 1.0;
    }
  }
  for (double& v : mean.value) v /= count;
  return mean;
}

int run(const std::string& first, const std::string& second, double tolerance, double bias) {
  const Image a = read(first);
  const Image b = read(second);
  if (a.width != b.width || a.height != b.height) {
    std::cout << first << " and " << second << " differ in size\n";
    return 1;
  }
  const Mean whole_a = mean_of(a, 0, 0, a.width, a.height);
  const Mean whole_b = mean_of(b, 0, 0, b.width, b.height);
  double worst_bias = 0.0;
  for (std::size_t c = 0; c < 3; ++c) {
    worst_bias = std::max(worst_bias, std::abs(whole_a.value[c] - whole_b.value[c]) / std::max(1e-6, whole_b.value[c]));
  }
  double worst = 0.0;
  std::uint32_t worst_x = 0;
  std::uint32_t worst_y = 0;
  constexpr std::uint32_t block = 8;
  for (std::uint32_t y = 0; y < a.height; y += block) {
    for (std::uint32_t x = 0; x < a.width; x += block) {
      const Mean p = mean_of(a, x, y, x + block, y + block);
      const Mean q = mean_of(b, x, y, x + block, y + block);
      for (std::size_t c = 0; c < 3; ++c) {
        const double error = std::abs(p.value[c] - q.value[c]) / std::max({1e-6, q.value[c], whole_b.value[c]});
        if (!(error <= worst)) {  // NaN too
          worst = std::isnan(error) ? 1e9 : error;
          worst_x = x;
          worst_y = y;
        }
      }
    }
  }
  std::cout << "bias " << 100.0 * worst_bias << " % (allowed " << 100.0 * bias << " %), worst block " << 100.0 * worst
            << " % at " << worst_x << "," << worst_y << " (allowed " << 100.0 * tolerance << " %)\n";
  return worst_bias <= bias && worst <= tolerance ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    double tolerance = 0.1;
    double bias = 0.01;
    if (argc < 3 || argc % 2 == 0) throw std::invalid_argument("usage: compare A B [--tolerance T] [--bias T]");
    for (int i = 3; i + 1 < argc; i += 2) {
      const std::string flag = argv[i];
      if (flag != "--tolerance" && flag != "--bias") throw std::invalid_argument("unknown flag " + flag);
      (flag == "--bias" ? bias : tolerance) = std::stod(argv[i + 1]);
    }
    return run(argv[1], argv[2], tolerance, bias);
  } catch (const std::invalid_argument& error) {
    std::cerr << "compare: " << error.what() << "\n";
    return 2;
  } catch (const std::exception& error) {
    std::cerr << "compare: " << error.what() << "\n";
    return 1;
  }
}
