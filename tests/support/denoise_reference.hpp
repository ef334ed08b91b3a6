#pragma once

// Reference implementation of Open Image Denoise's networks, for tests of the denoiser's kernels. It follows OIDN's
// training/model.py, color.py and API documentation in plain loops and doubles. Of the library it uses only the archive
// reader.

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <glm/glm.hpp>
#include <string>
#include <vector>

#include "denoise/tza.hpp"

namespace cumulet::test {

class DenoiseReference {
 public:
  explicit DenoiseReference(const denoise::TensorArchive& archive) : archive_(archive) {}

  static double encode(double y) {
    double x = 1.92653254e-01 * std::log(y + 6.26026094e-03) + 9.98620152e-01;
    if (y <= 3.22087631e-02) x = 1.64593172 * std::pow(y, 4.31384981e-01) - 2.94139609e-03;
    if (y <= 1.57945760e-06) x = 1.41283765e+03 * y;
    return x / most();
  }
  static double decode(double encoded) {
    const double x = encoded * most();
    if (x <= 2.23151711e-03) return x / 1.41283765e+03;
    if (x <= 3.70974749e-01) return std::pow((x + 2.94139609e-03) / 1.64593172, 1.0 / 4.31384981e-01);
    return std::exp((x - 9.98620152e-01) / 1.92653254e-01) - 6.26026094e-03;
  }

  static double exposure(const std::vector<glm::vec4>& color, glm::ivec2 size) {
    const glm::ivec2 bins = (size + 15) / 16;
    double sum = 0.0;
    int count = 0;
    for (int by = 0; by < bins.y; ++by) {
      for (int bx = 0; bx < bins.x; ++bx) {
        double luminance = 0.0;
        int pixels = 0;
        for (int y = by * size.y / bins.y; y < (by + 1) * size.y / bins.y; ++y) {
          for (int x = bx * size.x / bins.x; x < (bx + 1) * size.x / bins.x; ++x, ++pixels) {
            const glm::dvec3 c = sane(color[static_cast<std::size_t>(y * size.x + x)]);
            luminance += 0.212671 * c.r + 0.715160 * c.g + 0.072169 * c.b;
          }
        }
        luminance /= pixels;
        if (luminance <= 1e-8) continue;
        sum += std::log2(luminance);
        ++count;
      }
    }
    return count > 0 ? 0.18 / std::exp2(sum / count) : 1.0;
  }

  /// Returns the denoised image. albedo and normal are empty for networks that use only color.
  [[nodiscard]] std::vector<glm::dvec3> denoise(const std::vector<glm::vec4>& color,
                                                const std::vector<glm::vec4>& albedo,
                                                const std::vector<glm::vec4>& normal, glm::ivec2 size) const {
    const double exposed = exposure(color, size);
    Channels input((size.x + 2 * rim + 15) / 16 * 16, (size.y + 2 * rim + 15) / 16 * 16, albedo.empty() ? 3 : 9);
    for (int y = 0; y < input.height; ++y) {
      for (int x = 0; x < input.width; ++x) {
        const auto i = static_cast<std::size_t>(mirrored(y - rim, size.y) * size.x + mirrored(x - rim, size.x));
        for (int c = 0; c < 3; ++c) {
          input.at(c, y, x) = encode(exposed * sane(color[i])[c]);
          if (albedo.empty()) continue;
          input.at(3 + c, y, x) = std::clamp(double(albedo[i][c]), 0.0, 1.0);
          input.at(6 + c, y, x) = 0.5 + 0.5 * std::clamp(double(normal[i][c]), -1.0, 1.0);
        }
      }
    }
    const Channels output = network(input);
    std::vector<glm::dvec3> result;
    for (int y = 0; y < size.y; ++y) {
      for (int x = 0; x < size.x; ++x) {
        glm::dvec3 pixel;
        for (int c = 0; c < 3; ++c) pixel[c] = decode(output.at(c, y + rim, x + rim)) / exposed;
        result.push_back(pixel);
      }
    }
    return result;
  }

 private:
  static constexpr int rim = 16;  // pixels of mirrored border around the image
  static int mirrored(int i, int count) {
    if (i < 0) i = -1 - i;
    if (i >= count) i = 2 * count - 1 - i;
    return std::clamp(i, 0, count - 1);
  }

  struct Channels {
    Channels(int w, int h, int n) : width(w), height(h), count(n), values(static_cast<std::size_t>(w * h * n)) {}
    double& at(int c, int y, int x) { return values[static_cast<std::size_t>((c * height + y) * width + x)]; }
    [[nodiscard]] double at(int c, int y, int x) const {
      return values[static_cast<std::size_t>((c * height + y) * width + x)];
    }
    int width, height, count;
    std::vector<double> values;
  };

  static double most() { return 1.92653254e-01 * std::log(65504.0 + 6.26026094e-03) + 9.98620152e-01; }
  static glm::dvec3 sane(const glm::vec4& color) {
    for (int c = 0; c < 3; ++c) {
      if (!std::isfinite(color[c])) return glm::dvec3(0.0);
    }
    return glm::max(glm::dvec3(color), 0.0);
  }

  [[nodiscard]] Channels convolve(const Channels& from, const std::string& name) const {
    const denoise::Tensor& weights = archive_.at(name + ".weight");
    const denoise::Tensor& biases = archive_.at(name + ".bias");
    Channels to(from.width, from.height, static_cast<int>(weights.shape[0]));
    for (int o = 0; o < to.count; ++o) {
      for (int y = 0; y < to.height; ++y) {
        for (int x = 0; x < to.width; ++x) {
          double sum = biases.values[static_cast<std::size_t>(o)];
          for (int i = 0; i < from.count; ++i) {
            for (int dy = -1; dy <= 1; ++dy) {
              for (int dx = -1; dx <= 1; ++dx) {
                if (y + dy < 0 || y + dy >= from.height || x + dx < 0 || x + dx >= from.width) continue;
                const int tap = ((o * from.count + i) * 3 + dy + 1) * 3 + dx + 1;
                sum += double(weights.values[static_cast<std::size_t>(tap)]) * from.at(i, y + dy, x + dx);
              }
            }
          }
          to.at(o, y, x) = std::max(sum, 0.0);
        }
      }
    }
    return to;
  }

  static Channels pool(const Channels& from) {
    Channels to(from.width / 2, from.height / 2, from.count);
    for (int c = 0; c < to.count; ++c) {
      for (int y = 0; y < to.height; ++y) {
        for (int x = 0; x < to.width; ++x) {
          to.at(c, y, x) = std::max(std::max(from.at(c, 2 * y, 2 * x), from.at(c, 2 * y, 2 * x + 1)),
                                    std::max(from.at(c, 2 * y + 1, 2 * x), from.at(c, 2 * y + 1, 2 * x + 1)));
        }
      }
    }
    return to;
  }

  // Concatenates the channels of `coarse`, upsampled to twice its size, and of `fine`.
  static Channels join(const Channels& coarse, const Channels& fine) {
    Channels to(fine.width, fine.height, coarse.count + fine.count);
    for (int c = 0; c < to.count; ++c) {
      for (int y = 0; y < to.height; ++y) {
        for (int x = 0; x < to.width; ++x) {
          to.at(c, y, x) = c < coarse.count ? coarse.at(c, y / 2, x / 2) : fine.at(c - coarse.count, y, x);
        }
      }
    }
    return to;
  }

  [[nodiscard]] Channels network(const Channels& input) const {
    Channels x = convolve(input, "enc_conv0");
    const Channels pool1 = pool(convolve(x, "enc_conv1"));
    const Channels pool2 = pool(convolve(pool1, "enc_conv2"));
    const Channels pool3 = pool(convolve(pool2, "enc_conv3"));
    x = convolve(convolve(pool(convolve(pool3, "enc_conv4")), "enc_conv5a"), "enc_conv5b");
    x = convolve(convolve(join(x, pool3), "dec_conv4a"), "dec_conv4b");
    x = convolve(convolve(join(x, pool2), "dec_conv3a"), "dec_conv3b");
    x = convolve(convolve(join(x, pool1), "dec_conv2a"), "dec_conv2b");
    x = convolve(convolve(join(x, input), "dec_conv1a"), "dec_conv1b");
    return convolve(x, "dec_conv0");
  }

  const denoise::TensorArchive& archive_;
};

}  // namespace cumulet::test
