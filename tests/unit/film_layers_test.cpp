#include "render/film/film.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <string>
#include <vector>

#include "base/error.hpp"
#include "gl/state_guard.hpp"
#include "render/film/feature_buffers.hpp"
#include "support/gl_state.hpp"

namespace {

using cumulet::Error;
using cumulet::ErrorCode;
using cumulet::gl::StateGuard;
using cumulet::render::Film;
using cumulet::render::FilmLayer;
using cumulet::render::Pass;
namespace layers = cumulet::render::film_layers;
using Deadline = std::chrono::steady_clock::time_point;

// A layer that the library does not have. This is the whole declaration of a layer (docs/architecture.md counts the
// lines).
constexpr FilmLayer history{"history", GL_RGBA32F, 16};

class FilmLayers : public cumulet::test::GlTest {
 protected:
  void SetUp() override {
    GlTest::SetUp();
    film_.begin(glm::uvec2(4U, 2U));
  }
  bool run(const Pass& pass) { return cumulet::render::run(gl_, film_, pass, std::chrono::steady_clock::now()); }
  Pass fill(const FilmLayer& layer, float value) {
    return {"fill", {}, {layer}, [this, layer, value](const Film& film, Deadline) {
              const glm::vec4 texel(value);
              gl_->ClearTexImage(film.texture(layer), 0, GL_RGBA, GL_FLOAT, &texel);
              return true;
            }};
  }
  // A pass that keeps the last radiance, as a temporal denoiser does.
  Pass remember() {
    return {"remember", {layers::radiance}, {history}, [this](const Film& film, Deadline) {
              gl_->CopyImageSubData(film.texture(layers::radiance), GL_TEXTURE_2D, 0, 0, 0, 0, film.texture(history),
                                    GL_TEXTURE_2D, 0, 0, 0, 0, 4, 2, 1);
              return true;
            }};
  }
  std::vector<float> read(const FilmLayer& layer) {
    std::vector<float> values(4 * 4 * 2);
    gl_->GetTextureImage(film_.texture(layer), 0, GL_RGBA, GL_FLOAT, static_cast<GLsizei>(values.size() * 4),
                         values.data());
    return values;
  }

  Film film_;
};

TEST_P(FilmLayers, AreCreatedByTheFirstPassThatWritesThem) {
  const StateGuard guard(*gl_);
  EXPECT_EQ(film_.bytes(), 0U);
  EXPECT_EQ(film_.texture(layers::radiance), 0U);
  ASSERT_TRUE(run(fill(layers::radiance, 3.0F)));
  EXPECT_TRUE(film_.has(layers::radiance));
  EXPECT_FALSE(film_.has(layers::volume));
  EXPECT_EQ(film_.bytes(), 4U * 2U * 16U);
  ASSERT_TRUE(run(fill(layers::depth, 1.0F)));
  EXPECT_EQ(film_.bytes(), 4U * 2U * 20U);
  film_.drop(layers::radiance);
  EXPECT_FALSE(film_.has(layers::radiance));
  EXPECT_EQ(film_.bytes(), 4U * 2U * 4U);
}

TEST_P(FilmLayers, UnwrittenLayersAreFreedWithTheNextImage) {
  const StateGuard guard(*gl_);
  ASSERT_TRUE(run(fill(layers::radiance, 3.0F)));
  ASSERT_TRUE(run(fill(layers::normal, 1.0F)));
  const GLuint radiance = film_.texture(layers::radiance);
  film_.begin(film_.size());
  EXPECT_FALSE(film_.has(layers::normal));
  EXPECT_EQ(film_.bytes(), 4U * 2U * 32U);
  ASSERT_TRUE(run(fill(layers::radiance, 4.0F)));
  EXPECT_EQ(film_.texture(layers::radiance), radiance);
  film_.begin(film_.size());
  EXPECT_EQ(film_.texture(layers::normal), 0U);
  EXPECT_EQ(film_.bytes(), 4U * 2U * 16U);
}

TEST_P(FilmLayers, PassWithMissingInputIsRejected) {
  const StateGuard guard(*gl_);
  const auto why = [&] {
    try {
      run(remember());
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::internal);
      return std::string(error.what());
    }
    return std::string("not refused");
  };
  const std::string words = "the pass remember reads the layer radiance, which no pass has written";
  EXPECT_EQ(why(), words);
  EXPECT_EQ(film_.texture(history), 0U);  // not allocated
  ASSERT_TRUE(run(fill(layers::radiance, 1.0F)));
  film_.begin(film_.size());  // begins another image
  EXPECT_EQ(why(), words);
}

TEST_P(FilmLayers, PassRepeatsUntilItIsDone) {
  const StateGuard guard(*gl_);
  int calls = 0;
  const Pass slow{"slow", {}, {layers::depth}, [&](const Film&, Deadline) { return ++calls == 3; }};
  EXPECT_FALSE(run(slow));
  EXPECT_FALSE(run(slow));
  EXPECT_FALSE(film_.has(layers::depth));
  EXPECT_NE(film_.texture(layers::depth), 0U);
  EXPECT_TRUE(run(slow));
  EXPECT_TRUE(film_.has(layers::depth));
}

TEST_P(FilmLayers, TexturesOfTheSameSizeAreReused) {
  const StateGuard guard(*gl_);
  ASSERT_TRUE(run(fill(layers::radiance, 1.0F)));
  const GLuint texture = film_.texture(layers::radiance);
  film_.begin(film_.size());
  EXPECT_EQ(film_.texture(layers::radiance), texture);
  EXPECT_FALSE(film_.has(layers::radiance));
  film_.begin(glm::uvec2(5U, 2U));
  EXPECT_EQ(film_.texture(layers::radiance), 0U);
  EXPECT_EQ(film_.bytes(), 0U);
}

TEST_P(FilmLayers, NewLayersNeedOnlyAPass) {
  const StateGuard guard(*gl_);
  ASSERT_TRUE(run(fill(layers::radiance, 7.0F)));
  ASSERT_TRUE(run(remember()));
  ASSERT_TRUE(run(fill(layers::radiance, 8.0F)));
  EXPECT_EQ(read(history), std::vector<float>(32, 7.0F));
  EXPECT_EQ(film_.bytes(), 4U * 2U * 32U);
}

CUMULET_ON_BACKENDS(FilmLayers);

}  // namespace
