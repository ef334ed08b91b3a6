// Read-back without waiting: cumulet_begin_read, cumulet_finish_read, cumulet_cancel_read.

#include <gtest/gtest.h>

#include <chrono>
#include <functional>
#include <string>
#include <thread>
#include <vector>

#include "support/busy_host.hpp"
#include "support/c_viewer.hpp"

namespace {

using namespace cumulet::test;
using cumulet::headless::Context;

constexpr std::uint32_t width = 24;
constexpr std::uint32_t height = 16;
constexpr std::size_t pixel_count = std::size_t{width} * height;

class AsyncRead : public CViewerTest {
 protected:
  AsyncRead() : CViewerTest(width, height) {}
  void SetUp() override {
    CViewerTest::SetUp();
    if (IsSkipped()) return;
    ASSERT_EQ(cumulet_set_volume(v_, ball_.get()), CUMULET_OK);
    set_display({});
  }
  void set_sampling(const std::function<void(cumulet_sampling_desc&)>& change) {
    auto sampling = make_desc<cumulet_sampling_desc>();
    sampling.samples = 4;
    sampling.preview = CUMULET_PREVIEW_OFF;
    change(sampling);
    ASSERT_EQ(cumulet_set_sampling(v_, &sampling), CUMULET_OK) << cumulet_last_error(v_);
  }
  void set_display(const std::function<void(cumulet_display_desc&)>& change) {
    auto display = make_desc<cumulet_display_desc>();
    if (change) change(display);
    ASSERT_EQ(cumulet_set_display(v_, &display), CUMULET_OK) << cumulet_last_error(v_);
  }
  std::uint64_t begin(cumulet_read_source source, cumulet_aov aov = CUMULET_AOV_BEAUTY, std::uint32_t group = 0) {
    auto desc = make_desc<cumulet_read_desc>();
    desc.source = source;
    desc.aov = aov;
    desc.light_group = group;
    std::uint64_t read = 0;
    EXPECT_EQ(cumulet_begin_read(v_, &desc, &read), CUMULET_OK) << cumulet_last_error(v_);
    EXPECT_NE(read, 0U);
    return read;
  }
  // Asks until the values are there.
  std::vector<float> finish(std::uint64_t read, std::uint32_t channels) {
    std::vector<float> values(channels * pixel_count);
    auto info = make_desc<cumulet_read_info>();
    for (int i = 0; i < 20000 && info.ready == 0; ++i) {
      EXPECT_EQ(cumulet_finish_read(v_, read, values.data(), values.size(), &info), CUMULET_OK)
          << cumulet_last_error(v_);
      EXPECT_EQ(std::vector({info.width, info.height, info.channels}), std::vector({width, height, channels}));
      if (info.ready == 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    EXPECT_EQ(info.ready, 1);
    return values;
  }
  void expect_refused(std::uint64_t read, const std::string& line, std::size_t count = 4 * pixel_count) {
    std::vector<float> values(count);
    auto info = make_desc<cumulet_read_info>();
    EXPECT_EQ(cumulet_finish_read(v_, read, values.data(), values.size(), &info), CUMULET_ERROR_INVALID_ARGUMENT);
    EXPECT_EQ(cumulet_last_error(v_), line);
  }
  void expect_not_begun(const cumulet_read_desc& desc, const std::string& line) {
    std::uint64_t read = 1;
    EXPECT_EQ(cumulet_begin_read(v_, &desc, &read), CUMULET_ERROR_INVALID_ARGUMENT);
    EXPECT_NE(std::string(cumulet_last_error(v_)).find(line), std::string::npos) << cumulet_last_error(v_);
    EXPECT_EQ(read, 0U);
  }
  std::uint64_t gl_bytes() {
    auto stats = make_desc<cumulet_stats>();
    EXPECT_EQ(cumulet_get_stats(v_, &stats), CUMULET_OK);
    return stats.gl_bytes;
  }

  VolumeRef ball_ = make_ball(16, 2.0F);
};

TEST_P(AsyncRead, ValuesEqualThoseOfReadLinear) {
  struct Case {
    const char* name;
    std::function<void(cumulet_display_desc&)> display;
    std::function<void(cumulet_sampling_desc&)> sampling = [](cumulet_sampling_desc&) {};
  };
  const std::vector<Case> cases{
      {"sky", {}},
      {"transparent", [](cumulet_display_desc& d) { d.background = CUMULET_BACKGROUND_TRANSPARENT; }},
      {"color in a region",
       [](cumulet_display_desc& d) {
         d.background = CUMULET_BACKGROUND_COLOR;
         d.background_color[1] = 0.5F;
       },
       [](cumulet_sampling_desc& s) {
         s.region[0] = s.region[1] = 0.25F;
         s.region[2] = s.region[3] = 0.5F;
       }},
      {"debug view", {}, [](cumulet_sampling_desc& s) { s.view = CUMULET_VIEW_STEPS; }},
  };
  for (const Case& one : cases) {
    SCOPED_TRACE(one.name);
    set_display(one.display);
    set_sampling(one.sampling);
    make();
    const std::uint64_t read = begin(CUMULET_READ_LINEAR);
    const std::vector<float> values = finish(read, 4);
    EXPECT_EQ(values, linear());
    EXPECT_GT(std::ranges::max(values), 0.1F);
  }
}

TEST_P(AsyncRead, ValuesEqualThoseOfReadLinearForRasterizedSurfaces) {
  const SurfacesRef panes = make_panes(4.0F);
  ASSERT_EQ(cumulet_set_surfaces(v_, panes.get()), CUMULET_OK);
  auto settings = make_desc<cumulet_surface_settings_desc>();
  settings.lighting = CUMULET_SURFACE_LIGHTING_RASTERIZED;
  ASSERT_EQ(cumulet_set_surface_settings(v_, &settings), CUMULET_OK);
  for (const auto background : {CUMULET_BACKGROUND_SKY, CUMULET_BACKGROUND_TRANSPARENT}) {
    set_display([&](cumulet_display_desc& d) { d.background = background; });
    make();
    const std::uint64_t all = begin(CUMULET_READ_LINEAR);
    const std::uint64_t beauty = begin(CUMULET_READ_AOV, CUMULET_AOV_BEAUTY);
    EXPECT_EQ(finish(all, 4), linear());
    EXPECT_EQ(finish(beauty, 4), aov(CUMULET_AOV_BEAUTY, 4));
  }
}

TEST_P(AsyncRead, ValuesEqualThoseOfAovsAndLightGroups) {
  auto sky = make_desc<cumulet_sun_sky_desc>();
  sky.sun_elevation_degrees = 40.0F;
  for (float& value : sky.sun_irradiance) value = 2.5F;
  for (float& value : sky.sky_radiance) value = 0.3F;
  sky.sky_group = 1;
  ASSERT_EQ(cumulet_set_sun_sky(v_, &sky), CUMULET_OK);
  set_sampling([](cumulet_sampling_desc& s) {
    s.separate_volume_aov = 1;
    s.light_groups = 2;
  });
  make();
  const std::uint64_t beauty = begin(CUMULET_READ_AOV, CUMULET_AOV_BEAUTY);
  const std::uint64_t volume = begin(CUMULET_READ_AOV, CUMULET_AOV_VOLUME);
  const std::uint64_t error = begin(CUMULET_READ_AOV, CUMULET_AOV_ERROR);
  const std::uint64_t first = begin(CUMULET_READ_LIGHT_GROUP, CUMULET_AOV_BEAUTY, 0);
  const std::uint64_t second = begin(CUMULET_READ_LIGHT_GROUP, CUMULET_AOV_BEAUTY, 1);
  const auto group = [&](std::uint32_t number) {
    std::vector<float> values(3 * pixel_count);
    EXPECT_EQ(cumulet_read_light_group(v_, number, values.data(), values.size()), CUMULET_OK);
    return values;
  };
  // In another order than they were begun.
  EXPECT_EQ(finish(second, 3), group(1));
  EXPECT_EQ(finish(error, 1), aov(CUMULET_AOV_ERROR, 1));
  EXPECT_EQ(finish(beauty, 4), aov(CUMULET_AOV_BEAUTY, 4));
  EXPECT_EQ(finish(first, 3), group(0));
  EXPECT_EQ(finish(volume, 4), aov(CUMULET_AOV_VOLUME, 4));
  EXPECT_NE(group(0), group(1));
}

TEST_P(AsyncRead, ValuesAreThoseOfTheImageAtItsBegin) {
  make();
  const std::vector<float> before = linear();
  const std::uint64_t read = begin(CUMULET_READ_LINEAR);
  auto medium = make_desc<cumulet_medium_desc>();
  medium.coalbedo[0] = 0.2F;
  ASSERT_EQ(cumulet_set_medium(v_, &medium), CUMULET_OK);
  set_display([](cumulet_display_desc& d) { d.background = CUMULET_BACKGROUND_COLOR; });
  make();
  EXPECT_NE(linear(), before);
  EXPECT_EQ(finish(read, 4), before);
}

TEST_P(AsyncRead, NeverWaitsForWorkThatTheHostHasQueued) {
  constexpr double milliseconds = 800.0;
  make();
  finish(begin(CUMULET_READ_LINEAR), 4);  // the first read may take longer
  const GladGLContext gl = load_gl(Context::get_proc, context_.get());
  const BusyHost host(gl, milliseconds);
  gl.Finish();
  host.queue();
  const auto begun = std::chrono::steady_clock::now();
  const std::uint64_t read = begin(CUMULET_READ_LINEAR);
  std::vector<float> values(4 * pixel_count);
  auto info = make_desc<cumulet_read_info>();
  ASSERT_EQ(cumulet_finish_read(v_, read, values.data(), values.size(), &info), CUMULET_OK);
  const std::chrono::duration<double, std::milli> taken = std::chrono::steady_clock::now() - begun;
  EXPECT_LT(taken.count(), 0.5 * milliseconds);
  EXPECT_EQ(info.ready, 0);
  EXPECT_EQ(finish(read, 4), linear());
}

TEST_P(AsyncRead, RefusesWhatItCannotRead) {
  expect_not_begun(make_desc<cumulet_read_desc>(), "nothing has been rendered yet");
  make();
  auto desc = make_desc<cumulet_read_desc>();
  desc.source = static_cast<cumulet_read_source>(3);
  expect_not_begun(desc, "cumulet_read_desc.source is unknown");
  desc.source = CUMULET_READ_AOV;
  desc.aov = static_cast<cumulet_aov>(11);
  expect_not_begun(desc, "cumulet_read_desc.aov is unknown");
  desc.aov = CUMULET_AOV_NORMAL;
  expect_not_begun(desc, "samples do not accumulate this AOV: use cumulet_read_aov");
  desc.aov = CUMULET_AOV_VOLUME;
  expect_not_begun(desc, "the volume AOV was not rendered");
  desc.source = CUMULET_READ_LIGHT_GROUP;
  expect_not_begun(desc, "the image has 0 light groups");
  set_sampling([](cumulet_sampling_desc& s) { s.view = CUMULET_VIEW_STEPS; });
  make();
  desc.source = CUMULET_READ_AOV;
  desc.aov = CUMULET_AOV_BEAUTY;
  expect_not_begun(desc, "debug view");
}

TEST_P(AsyncRead, ReadsEnd) {
  make();
  const std::uint64_t without = gl_bytes();
  const std::uint64_t read = begin(CUMULET_READ_LINEAR);
  EXPECT_EQ(gl_bytes(), without + pixel_count * (16 + 16 + 8));
  auto info = make_desc<cumulet_read_info>();
  while (info.ready == 0)  // a look does not end it
    ASSERT_EQ(cumulet_finish_read(v_, read, nullptr, 0, &info), CUMULET_OK);
  expect_refused(read, "the image needs " + std::to_string(4 * pixel_count) + " floats", 4 * pixel_count - 1);
  finish(read, 4);
  EXPECT_EQ(gl_bytes(), without);
  expect_refused(read, "there is no read " + std::to_string(read));
  const std::uint64_t dropped = begin(CUMULET_READ_LINEAR);
  EXPECT_EQ(cumulet_cancel_read(v_, dropped), CUMULET_OK);
  EXPECT_EQ(cumulet_cancel_read(v_, dropped), CUMULET_OK);
  expect_refused(dropped, "there is no read " + std::to_string(dropped));
  std::vector<std::uint64_t> many;
  for (int i = 0; i < 16; ++i) many.push_back(begin(CUMULET_READ_LINEAR));
  expect_not_begun(make_desc<cumulet_read_desc>(), "16 reads are pending: finish or cancel one");
  finish(many.front(), 4);
  // Those of another context are gone, and numbers do not come twice.
  ASSERT_EQ(cumulet_detach(v_), CUMULET_OK);
  EXPECT_EQ(cumulet_finish_read(v_, many.back(), nullptr, 0, &info), CUMULET_ERROR_DETACHED);
  ASSERT_EQ(cumulet_attach(v_, Context::get_proc, context_.get()), CUMULET_OK);
  expect_refused(many.back(), "there is no read " + std::to_string(many.back()));
  make();
  EXPECT_GT(begin(CUMULET_READ_LINEAR), many.back());
}

TEST_P(AsyncRead, ChangesNoPixelStateOfTheHost) {
  make();
  const GladGLContext gl = load_gl(Context::get_proc, context_.get());
  GLuint buffer = 0;
  gl.CreateBuffers(1, &buffer);
  gl.NamedBufferStorage(buffer, 64, nullptr, GL_DYNAMIC_STORAGE_BIT);
  gl.BindBuffer(GL_PIXEL_PACK_BUFFER, buffer);
  gl.PixelStorei(GL_PACK_ROW_LENGTH, 5);
  gl.PixelStorei(GL_PACK_SKIP_PIXELS, 2);
  const std::uint64_t read = begin(CUMULET_READ_LINEAR);
  const auto get = [&](GLenum name) {
    GLint value = -1;
    gl.GetIntegerv(name, &value);
    return value;
  };
  EXPECT_EQ(get(GL_PIXEL_PACK_BUFFER_BINDING), static_cast<GLint>(buffer));
  EXPECT_EQ(get(GL_PACK_ROW_LENGTH), 5);
  EXPECT_EQ(get(GL_PACK_SKIP_PIXELS), 2);
  const std::vector<float> values = finish(read, 4);
  EXPECT_EQ(get(GL_PIXEL_PACK_BUFFER_BINDING), static_cast<GLint>(buffer));
  gl.BindBuffer(GL_PIXEL_PACK_BUFFER, 0);
  gl.DeleteBuffers(1, &buffer);
  EXPECT_EQ(values, linear());
  EXPECT_EQ(gl.GetError(), static_cast<GLenum>(GL_NO_ERROR));
}

CUMULET_ON_BACKENDS(AsyncRead);

}  // namespace
