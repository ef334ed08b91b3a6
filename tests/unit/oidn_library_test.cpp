// The library of Open Image Denoise, loaded at run time. Libraries of the test take its place.

#include "denoise/oidn_library.hpp"

#include <dlfcn.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "support/denoised_images.hpp"

namespace {

namespace denoise = cumulet::denoise;
using cumulet::test::DenoisedImage;
using cumulet::test::floats;
using cumulet::test::make_desc;
using denoise::OidnError;
using denoise::OidnLibrary;
using glm::vec4;

constexpr const char* second = CUMULET_FAKE_OIDN "_2.so";
constexpr const char* first = CUMULET_FAKE_OIDN "_1.so";
constexpr const char* old_one = CUMULET_FAKE_OIDN "_old.so";

int objects(const char* file) {
  void* library = dlopen(file, RTLD_NOW | RTLD_NOLOAD);
  EXPECT_NE(library, nullptr) << "the process keeps it";
  auto* const count = reinterpret_cast<int (*)()>(dlsym(library, "fake_oidn_objects"));
  return count != nullptr ? count() : -1;
}

TEST(OidnLibrary, DenoisesByBothVersionsOfTheInterface) {
  for (const auto& [file, version] : {std::pair(first, "1.4.3"), std::pair(second, "2.3.1")}) {
    {
      const OidnLibrary library(file);
      EXPECT_EQ(library.version(), version);
      constexpr float nan = std::numeric_limits<float>::quiet_NaN();
      const std::vector<vec4> color = {{1, 2, 3, 0.5F}, {4, nan, 6, 1}, {7, 8, 9, 0},
                                       {10, 11, 12, 1}, {0, 0, 0, 0},   {1, 1, 1, 1}};
      const std::vector<vec4> albedo(6, vec4(0.25F));
      const std::vector<vec4> normal(6, vec4(0.0F));
      std::vector<vec4> result(6);
      library.denoise({{3, 2}, color, albedo, normal}, result);
      EXPECT_EQ(result[0], vec4(1, 3, 0.25F, 0.5F));
      EXPECT_EQ(result[1].r, 4.0F) << "passed through";
      EXPECT_TRUE(std::isnan(result[1].g));
      EXPECT_EQ(result[5], vec4(1, 2, 0.25F, 1));
      const std::vector<vec4> wrong(6, vec4(3.0F));
      EXPECT_THROW(library.denoise({{3, 2}, color, albedo, wrong}, result), OidnError);
      EXPECT_EQ(objects(file), 1) << "the device";
    }
    EXPECT_EQ(objects(file), 0);
  }
}

TEST(OidnLibrary, RefusalsAreOneLine) {
  const auto refusal = [](const std::string& file) -> std::string {
    try {
      const OidnLibrary library(file);
    } catch (const OidnError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(refusal(old_one), "the version of Open Image Denoise is older than 1.4");
  EXPECT_EQ(objects(old_one), 0);
  EXPECT_NE(refusal("/no/such/library.so").find("/no/such/library.so"), std::string::npos);
  EXPECT_EQ(refusal("libm.so.6"), "the library is not Open Image Denoise 1.4 or later");
}

/// The images of DenoisedImage, of a viewer that logs.
class LibraryImage : public DenoisedImage {
 protected:
  LibraryImage() {
    viewer_ = cumulet::test::make_viewer(
        {.get_proc = cumulet::headless::Context::get_proc,
         .user = &context_,
         .log = [](void* user, cumulet_log_level,
                   const char* text) { static_cast<std::vector<std::string>*>(user)->emplace_back(text); },
         .log_user = &log_});
    sample(4);
  }

  std::vector<float> by(const char* library, const char* network) const {
    auto desc = make_desc<cumulet_denoise_desc>();
    desc.network = network;
    desc.oidn_library = library;
    std::vector<float> rgba(floats);
    EXPECT_EQ(cumulet_read_denoised(viewer_.get(), &desc, rgba.data(), rgba.size()), CUMULET_OK) << error();
    return rgba;
  }
  [[nodiscard]] std::ptrdiff_t lines_with(const std::string& text) const {
    return std::ranges::count_if(log_, [&](const std::string& line) { return line.find(text) != std::string::npos; });
  }

  std::vector<std::string> log_;
};

TEST_F(LibraryImage, DenoisesInPlaceOfTheNetwork) {
  const std::vector<float> raw = picture();
  const std::vector<float> denoised = by(second, file_.c_str());
  for (std::size_t i = 0; i < floats; i += 4) {
    ASSERT_NEAR(denoised[i], raw[i], 1e-4F);
    ASSERT_NEAR(denoised[i + 1], raw[i + 1] + 1.0F, 1e-4F);
    ASSERT_EQ(denoised[i + 3], raw[i + 3]);
  }
  EXPECT_EQ(by(second, nullptr), denoised) << "needs no network";
  EXPECT_EQ(by(second, "/no/such.tza"), denoised) << "does not read the network";
  EXPECT_EQ(lines_with("denoising by Open Image Denoise 2.3.1"), 1);
  EXPECT_EQ(linear(), raw);
  EXPECT_EQ(gl_.GetError(), GLenum{GL_NO_ERROR});
}

TEST_F(LibraryImage, WithoutTheLibraryTheNetworkDenoises) {
  static_cast<void>(picture());
  const std::vector<float> network = by(nullptr, file_.c_str());
  EXPECT_EQ(by("/no/such/library.so", file_.c_str()), network);
  EXPECT_EQ(by("/no/such/library.so", file_.c_str()), network);
  EXPECT_EQ(lines_with("/no/such/library.so"), 1) << "said once";
  EXPECT_EQ(by(old_one, file_.c_str()), network);
  EXPECT_EQ(by("/no/such/library.so", nullptr), by(nullptr, nullptr)) << "the filter";
}

TEST_F(LibraryImage, AfterAFailureTheNetworkDenoises) {
  static_cast<void>(picture());
  const std::vector<float> network = by(nullptr, file_.c_str());
  ASSERT_EQ(setenv("FAKE_OIDN_FAILS", "1", 1), 0);
  EXPECT_EQ(by(second, file_.c_str()), network);
  unsetenv("FAKE_OIDN_FAILS");
  EXPECT_EQ(by(second, file_.c_str()), network) << "it is not tried again";
  EXPECT_EQ(lines_with("no longer denoising by the library of Open Image Denoise"), 1);
}

}  // namespace
