// cumulet-merge: partial renders made of known samples, and parts that do not belong together.

#include "merge.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <attributes.hpp>
#include <cmath>
#include <fstream>
#include <image.hpp>
#include <layers.hpp>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "support/folder.hpp"

namespace {

using namespace cumulet;
namespace attributes = image::attributes;
namespace layers = image::layers;
using demo::merge;

constexpr std::uint32_t width = 5;
constexpr std::uint32_t height = 3;
constexpr std::size_t pixels = std::size_t{width} * height;

/// Description of a part; tests change single members.
struct Description {
  std::uint32_t width = ::width;
  std::string version = "0.2.0";
  std::string scene = "00c0ffee00c0ffee";
  std::string grid_type = "tetrahedral";
  std::string background = "sky";
  double seed = 3.0;
  bool error = true;
  bool volume = false;
  bool denoised = false;
  std::string manifest = {};  // of the Cryptomatte; "": there is none
  bool whole = true;          // every pixel has its samples
};

double luminance(const std::array<double, 4>& rgba) { return 0.2126 * rgba[0] + 0.7152 * rgba[1] + 0.0722 * rgba[2]; }

class Merge : public ::testing::Test {
 protected:
  /// The value of this sample of a pixel: some are dark, few are bright.
  static std::array<double, 4> sample(std::size_t pixel, std::uint64_t number) {
    std::mt19937_64 dice(1000 * number + pixel);
    std::uniform_real_distribution<double> u(0.0, 1.0);
    const double bright = u(dice) < 0.2 ? 5.0 * u(dice) : 0.1 * u(dice);
    return {bright, 0.5 * bright, 0.25 * bright + 0.1 * u(dice), u(dice) < 0.5 ? 1.0 : 0.0};
  }

  /// Writes a file of those samples, in the format of cumulet-render.
  std::string part(std::uint64_t first, std::uint64_t samples, const Description& of = {}) {
    std::vector<float> rgba;
    std::vector<float> errors;
    std::vector<float> depth;
    double squared = 0.0;
    double bright = 0.0;
    const auto n = static_cast<double>(samples);
    for (std::size_t pixel = 0; pixel < std::size_t{of.width} * height; ++pixel) {
      std::array<double, 4> sum{};
      double square = 0.0;
      for (std::uint64_t i = first; i < first + samples; ++i) {
        const std::array<double, 4> one = sample(pixel, i);
        for (std::size_t c = 0; c < 4; ++c) sum[c] += one[c] / n;
        square += luminance(one) * luminance(one) / n;
      }
      const double mean = luminance(sum);
      const double error = samples > 1 ? std::sqrt(std::max(0.0, square - mean * mean) / (n - 1.0))
                                       : std::numeric_limits<double>::infinity();
      for (const double c : sum) rgba.push_back(static_cast<float>(c));
      errors.push_back(static_cast<float>(error));
      depth.push_back(static_cast<float>(100 + pixel + first));
      squared += error * error;
      bright += mean;
    }
    std::vector<image::Layer> all{{layers::beauty, rgba}, {layers::depth, depth}};
    if (of.error) all.push_back({layers::error, errors});
    if (of.volume) all.push_back({layers::volume, rgba});
    if (of.denoised) all.push_back({layers::denoised, rgba});
    // Two layers that are not merged, because ids cannot be averaged.
    std::vector<float> mattes;
    for (std::size_t i = 0; i < rgba.size(); ++i) mattes.push_back(static_cast<float>(i) * 1e-30F);
    if (!of.manifest.empty()) {
      for (const char* name : {"CryptoObject00", "CryptoObject01"})
        all.push_back({{name, layers::cryptomatte_channels}, mattes});
    }
    std::vector<image::Attribute> said{{"cumulet:eye", std::array{1.0, 2.0, 3.0}},
                                       {std::string(attributes::comments), attributes::comments_text(of.version, n)},
                                       {std::string(attributes::version), of.version},
                                       {std::string(attributes::scene), of.scene},
                                       {std::string(attributes::grid_type), of.grid_type},
                                       {std::string(attributes::background), of.background},
                                       {std::string(attributes::seed), of.seed},
                                       {std::string(attributes::samples), of.whole ? n : n - 0.25}};
    if (of.whole) said.push_back({std::string(attributes::first_sample), double(first)});
    if (!of.manifest.empty()) said.push_back({"cryptomatte/3ae39a5/manifest", of.manifest});
    if (samples > 1) {
      const double count = double(of.width) * height;
      said.push_back({std::string(attributes::noise), std::sqrt(squared / count) / (bright / count)});
    }
    const std::string name = "part" + std::to_string(files_++) + ".exr";
    image::write_exr(folder_ / name, of.width, height, all, said);
    return folder_ / name;
  }

  std::string refusal(const std::vector<std::string>& parts) {
    try {
      merge(parts, output());
    } catch (const std::runtime_error& error) {
      EXPECT_FALSE(std::filesystem::exists(output()));
      std::string said = error.what();
      EXPECT_EQ(said.find('\n'), std::string::npos);
      for (std::size_t at; (at = said.find(folder_.path().string() + "/")) != std::string::npos;)
        said.erase(at, folder_.path().string().size() + 1);
      return said;
    }
    return "";
  }
  [[nodiscard]] std::string output() const { return folder_ / "whole.exr"; }

  static double number(const image::Contents& contents, std::string_view name) {
    const auto found = std::ranges::find(contents.attributes, name, &image::Attribute::name);
    return found == contents.attributes.end() ? -1.0 : std::get<double>(found->value);
  }
  void expect_layer(const std::string& wanted_file, const image::LayerName& layer, double tolerance) {
    const auto wanted = image::read_exr(wanted_file, layer).values;
    const auto made = image::read_exr(output(), layer).values;
    ASSERT_EQ(made.size(), wanted.size());
    for (std::size_t i = 0; i < made.size(); ++i)
      EXPECT_NEAR(made[i], wanted[i], tolerance * std::abs(wanted[i])) << layer.name << " " << i;
  }

  test::Folder folder_;

 private:
  int files_ = 0;
};

TEST_F(Merge, SevenUnequalPartsEqualTheFullRenderingInAnyOrder) {
  std::vector<std::string> parts;
  std::uint64_t first = 0;
  for (const std::uint64_t samples : {5U, 1U, 16U, 2U, 1U, 30U, 9U}) {
    parts.push_back(part(first, samples, {.volume = true}));
    first += samples;
  }
  std::mt19937 dice(5);
  std::ranges::shuffle(parts, dice);
  const demo::Merged merged = merge(parts, output());
  EXPECT_EQ(merged.first, 0u);
  EXPECT_EQ(merged.samples, 64u);
  EXPECT_FALSE(merged.without_error || merged.without_denoised);
  const std::string whole = part(0, 64, {.volume = true});
  expect_layer(whole, layers::beauty, 1e-6);
  expect_layer(whole, layers::volume, 1e-6);
  expect_layer(whole, layers::error, 1e-5);
  expect_layer(whole, layers::depth, 0.0);
  const image::Contents made = image::read_contents(output());
  const image::Contents wanted = image::read_contents(whole);
  EXPECT_EQ(made.channels, wanted.channels);
  ASSERT_EQ(made.attributes.size(), wanted.attributes.size());
  for (std::size_t i = 0; i < made.attributes.size(); ++i) {
    EXPECT_EQ(made.attributes[i].name, wanted.attributes[i].name);
    if (made.attributes[i].name == attributes::noise) continue;
    EXPECT_EQ(made.attributes[i].value, wanted.attributes[i].value) << made.attributes[i].name;
  }
  EXPECT_NEAR(number(made, attributes::noise), number(wanted, attributes::noise), 1e-6);
}

TEST_F(Merge, MergedPartsCanBeMergedAgain) {
  const std::string early = part(0, 3);
  merge({part(3, 4), part(7, 9)}, folder_ / "late.exr");
  const demo::Merged merged = merge({folder_ / "late.exr", early}, output());
  EXPECT_EQ(merged.samples, 16u);
  expect_layer(part(0, 16), layers::error, 1e-5);
  // Merging one part gives that part.
  EXPECT_EQ(merge({early}, output()).samples, 3u);
  expect_layer(early, layers::beauty, 0.0);
}

TEST_F(Merge, OneSamplePartsGiveAnErrorEstimateTogether) {
  merge({part(0, 1), part(1, 1)}, output());
  expect_layer(part(0, 2), layers::error, 1e-5);
  const std::string one = part(0, 1);
  merge({one}, output());
  EXPECT_TRUE(std::isinf(image::read_exr(output(), layers::error).values[0]));
  EXPECT_EQ(number(image::read_contents(output()), attributes::noise), -1.0);
}

TEST_F(Merge, NonAdditiveLayersAreDroppedAndReported) {
  const Description clear{.background = "transparent", .denoised = true};
  const demo::Merged merged = merge({part(0, 4, clear), part(4, 4, clear)}, output());
  EXPECT_TRUE(merged.without_error && merged.without_denoised);
  const image::Contents made = image::read_contents(output());
  EXPECT_EQ(made.channels, (std::vector<std::string>{"A", "B", "G", "R", "depth.Z"}));
  EXPECT_EQ(number(made, attributes::noise), -1.0);
}

TEST_F(Merge, OverlappingAndMissingSamplesAreNamed) {
  EXPECT_EQ(refusal({part(0, 16), part(8, 16)}),
            "part1.exr: has samples 8 to 23, overlapping those of part0.exr: samples 0 to 15");
  EXPECT_EQ(refusal({part(20, 4), part(0, 16)}), "between part3.exr and part2.exr no file has samples 16 to 19");
  EXPECT_EQ(refusal({part(5, 4), part(0, 4)}), "between part5.exr and part4.exr no file has sample 4");
  const std::string twice = part(0, 4);
  EXPECT_NE(refusal({twice, twice}).find("overlapping those of"), std::string::npos);
}

TEST_F(Merge, PartsOfOtherImagesAreRejected) {
  const std::string a = part(0, 4);
  EXPECT_EQ(refusal({a, part(4, 4, {.width = 7})}), "part1.exr: has 7x3 pixels, but part0.exr has 5x3");
  EXPECT_EQ(refusal({a, part(4, 4, {.version = "0.3.0"})}), "part2.exr: has another version of Cumulet than part0.exr");
  EXPECT_EQ(refusal({a, part(4, 4, {.seed = 4.0})}), "part3.exr: has another seed than part0.exr");
  EXPECT_EQ(refusal({a, part(4, 4, {.grid_type = "dense"})}), "part4.exr: has another grid type than part0.exr");
  EXPECT_EQ(refusal({a, part(4, 4, {.scene = "0"})}), "part5.exr: has another scene than part0.exr");
  EXPECT_EQ(refusal({a, part(4, 4, {.error = false})}), "part6.exr: has other layers than part0.exr");
}

TEST_F(Merge, CryptomattesComeFromTheFirstPart) {
  const Description named{.manifest = R"({"cloud":"13851a76"})"};
  const std::string first = part(0, 4, named);
  merge({part(4, 12, named), first}, output());
  for (const char* name : {"CryptoObject00", "CryptoObject01"}) expect_layer(first, {name, "RGBA"}, 0.0);
  const image::Contents made = image::read_contents(output());
  const auto found = std::ranges::find(made.attributes, "cryptomatte/3ae39a5/manifest", &image::Attribute::name);
  ASSERT_NE(found, made.attributes.end());
  EXPECT_EQ(std::get<std::string>(found->value), named.manifest);
  std::filesystem::remove(output());
  EXPECT_EQ(refusal({first, part(4, 4, {.manifest = R"({"smoke":"13851a76"})"})}),
            "part2.exr: has other Cryptomatte names than part0.exr");
  EXPECT_EQ(refusal({first, part(4, 4)}), "part3.exr: has other layers than part0.exr");
}

TEST_F(Merge, OtherFilesAreRejected) {
  const std::string a = part(0, 4);
  EXPECT_NE(refusal({a, part(4, 4, {.whole = false})}).find("part1.exr: is not a partial render"), std::string::npos);
  image::write_exr(folder_ / "plain.exr", {1, 1, {0.0f, 0.0f, 0.0f, 1.0f}});
  EXPECT_EQ(refusal({folder_ / "plain.exr"}),
            "plain.exr: is not an image of cumulet-render: it has no attribute cumulet:version");
  EXPECT_EQ(refusal({folder_ / "none.exr"}), "none.exr: No such file or directory");
  std::ofstream(folder_ / "torn.exr") << "no picture";
  EXPECT_NE(refusal({folder_ / "torn.exr"}).find("torn.exr: not a readable OpenEXR file"), std::string::npos);
  EXPECT_EQ(refusal({}), "there are no files to merge");
}

}  // namespace
