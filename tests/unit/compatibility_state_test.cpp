// State that only compatibility contexts have. Fake functions replace drivers that are not available: drivers with
// GL_ARB_imaging and drivers that lack functions.

#include "gl/compatibility_state.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "base/error.hpp"
#include "gl/api.hpp"
#include "gl/compatibility_functions.hpp"

namespace {

using cumulet::Error;
using cumulet::gl::CompatibilityState;
using cumulet::gl::Functions;
namespace gl = cumulet::gl;

constexpr GLenum color_matrix_mode = 0x1800;
constexpr GLenum modelview = 0x1700;

/// The legacy state of a driver with GL_ARB_imaging, and counts of its changes.
struct Driver {
  GLint profile = GL_CONTEXT_COMPATIBILITY_PROFILE_BIT;
  GLint flags = 0;
  bool has_imaging = true;
  std::map<GLenum, GLfloat> values;
  std::set<GLenum> enabled;
  GLenum matrix_mode = modelview;
  std::map<GLenum, std::array<GLfloat, 16>> matrices;
  int sets = 0;
  std::string missing;
};

class ImagingDriver : public testing::Test {
 protected:
  ImagingDriver() {
    driver() = {};
    // Initial values of a driver.
    for (const GLenum scale : scales) driver().values[scale] = 1.0F;
    driver().matrices[color_matrix_mode] = identity;
    gl_.GetIntegerv = [](GLenum name, GLint* value) {
      if (name == GL_CONTEXT_PROFILE_MASK) *value = driver().profile;
      if (name == GL_CONTEXT_FLAGS) *value = driver().flags;
      if (name == GL_NUM_EXTENSIONS) *value = driver().has_imaging ? 2 : 1;
      if (name == 0x0BA0) *value = static_cast<GLint>(driver().matrix_mode);
      if (driver().values.contains(name)) *value = static_cast<GLint>(driver().values[name]);
    };
    gl_.GetFloatv = [](GLenum name, GLfloat* value) {
      if (name == 0x80B1) {
        std::ranges::copy(driver().matrices[color_matrix_mode], value);
      } else {
        *value = driver().values[name];
      }
    };
    gl_.GetStringi = [](GLenum, GLuint index) {
      return reinterpret_cast<const GLubyte*>(index == 0 ? "GL_ARB_multitexture" : "GL_ARB_imaging");
    };
    gl_.GladGLContext::IsEnabled = [](GLenum name) -> GLboolean { return driver().enabled.contains(name); };
    gl_.GladGLContext::Enable = [](GLenum name) {
      ++driver().sets;
      driver().enabled.insert(name);
    };
    gl_.GladGLContext::Disable = [](GLenum name) {
      ++driver().sets;
      driver().enabled.erase(name);
    };
    gl_.ClampColor = [](GLenum name, GLenum value) {
      ++driver().sets;
      driver().values[name] = static_cast<GLfloat>(value);
    };
  }

  static Driver& driver() {
    static Driver one;
    return one;
  }
  static void* get_proc(void* /*user*/, const char* name) {
    const std::string asked = name;
    if (asked == driver().missing) return nullptr;
    if (asked == "glPixelTransferf") {
      return reinterpret_cast<void*>(+[](GLenum value_name, GLfloat value) {
        ++driver().sets;
        driver().values[value_name] = value;
      });
    }
    if (asked == "glTexEnvf") return reinterpret_cast<void*>(+[](GLenum, GLenum, GLfloat) { ++driver().sets; });
    if (asked == "glGetTexEnvfv") return reinterpret_cast<void*>(+[](GLenum, GLenum, GLfloat* value) { *value = 0; });
    if (asked == "glMatrixMode") return reinterpret_cast<void*>(+[](GLenum mode) { driver().matrix_mode = mode; });
    if (asked == "glLoadMatrixf") {
      return reinterpret_cast<void*>(+[](const GLfloat* matrix) {
        ++driver().sets;
        std::copy_n(matrix, 16, driver().matrices[driver().matrix_mode].begin());
      });
    }
    return nullptr;
  }
  void load() { gl_.compatibility = gl::load_compatibility(gl_, get_proc, nullptr); }
  /// Sets everything that a host may have set: each transfer parameter, each step and a matrix.
  static void set_all() {
    float value = 0.0F;
    for (GLenum name = 0x0D10; name <= 0x0D1F; ++name) driver().values[name] = value += 0.5F;
    for (GLenum name = 0x801C; name <= 0x8023; ++name) driver().values[name] = value += 0.5F;
    for (GLenum name = 0x80B4; name <= 0x80BB; ++name) driver().values[name] = value += 0.5F;
    driver().values.erase(0x0D16);  // GL_ZOOM_X and GL_ZOOM_Y are not transfer parameters
    driver().values.erase(0x0D17);
    driver().enabled = {steps.begin(), steps.end()};
    driver().enabled.insert(GL_BLEND);
    driver().matrices[color_matrix_mode][5] = 3.0F;
  }
  /// known: the transfer parameters whose default is not 0.
  static void expect_core(const std::map<GLenum, GLfloat>& known) {
    for (const auto& [name, is] : driver().values) EXPECT_EQ(is, known.contains(name) ? 1.0F : 0.0F) << name;
    EXPECT_EQ(driver().enabled, std::set<GLenum>{GL_BLEND});
    EXPECT_EQ(driver().matrices[color_matrix_mode], identity);
    EXPECT_EQ(driver().matrix_mode, modelview);
  }
  std::string refusal() {
    try {
      load();
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), cumulet::ErrorCode::unsupported);
      return error.what();
    }
    return "";
  }

  static constexpr std::array<GLfloat, 16> identity{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
  static constexpr std::array<GLenum, 13> scales{0x0D14, 0x0D18, 0x0D1A, 0x0D1C, 0x0D1E, 0x801C, 0x801D,
                                                 0x801E, 0x801F, 0x80B4, 0x80B5, 0x80B6, 0x80B7};
  static constexpr std::array<GLenum, 8> steps{0x80D0, 0x80D1, 0x80D2, 0x8010, 0x8011, 0x8012, 0x8024, 0x802E};
  Functions gl_;
};

TEST_F(ImagingDriver, LegacyStateIsSetLikeACoreContextAndRestored) {
  load();
  ASSERT_NE(gl_.compatibility, nullptr);
  const auto known = driver().values;
  set_all();
  const auto values = driver().values;
  const auto enabled = driver().enabled;
  const auto matrices = driver().matrices;
  {
    CompatibilityState state(gl_, true);
    state.prepare_pixels();
    expect_core(known);
    const int sets = driver().sets;
    state.prepare_pixels();
    EXPECT_EQ(driver().sets, sets) << "once a guard";
    state.restore();
  }
  EXPECT_EQ(driver().values, values);
  EXPECT_EQ(driver().enabled, enabled);
  EXPECT_EQ(driver().matrices, matrices);
  EXPECT_EQ(driver().matrix_mode, modelview);
}

TEST_F(ImagingDriver, StateThatIsCorrectIsNotSet) {
  load();
  CompatibilityState state(gl_, true);
  state.prepare_fragments();
  state.prepare_pixels();
  state.prepare_unit(0);
  state.restore();
  state.restore_unit(0);
  EXPECT_EQ(driver().sets, 0);
}

TEST_F(ImagingDriver, WithHostResetsStateIsSetWithoutQueries) {
  load();
  driver().enabled = {steps.begin(), steps.end()};
  driver().enabled.insert({0x0BC0, 0x0B42});
  driver().values[0x891B] = GL_TRUE;
  driver().values[0x0D1A] = 7.0F;
  gl_.GetFloatv = nullptr;
  gl_.GladGLContext::IsEnabled = nullptr;
  CompatibilityState state(gl_, false);
  state.prepare_fragments();
  state.prepare_pixels();
  EXPECT_TRUE(driver().enabled.empty());
  EXPECT_EQ(driver().values[0x891B], GL_FALSE);
  EXPECT_EQ(driver().values[0x0D1A], 1.0F);
}

TEST_F(ImagingDriver, MissingFunctionsAreNamed) {
  for (const char* name : {"glPixelTransferf", "glTexEnvf", "glGetTexEnvfv", "glMatrixMode", "glLoadMatrixf"}) {
    driver().missing = name;
    EXPECT_NE(refusal().find(name), std::string::npos) << name << ": " << refusal();
  }
  // Functions of the imaging subset are only required if the driver has it.
  driver().has_imaging = false;
  EXPECT_EQ(refusal(), "");
}

TEST_F(ImagingDriver, CoreAndForwardCompatibleContextsHaveNoLegacyState) {
  driver().missing = "glPixelTransferf";
  driver().profile = GL_CONTEXT_CORE_PROFILE_BIT;
  EXPECT_EQ(refusal(), "");
  EXPECT_EQ(gl_.compatibility, nullptr);
  driver().profile = GL_CONTEXT_COMPATIBILITY_PROFILE_BIT;
  driver().flags = GL_CONTEXT_FLAG_FORWARD_COMPATIBLE_BIT;
  EXPECT_EQ(refusal(), "");
  EXPECT_EQ(gl_.compatibility, nullptr);
  CompatibilityState state(gl_, true);
  state.prepare_fragments();
  state.prepare_pixels();
  state.prepare_unit(0);
  state.restore();
  state.restore_unit(0);
  EXPECT_EQ(driver().sets, 0);
}

TEST_F(ImagingDriver, WrongRenderModeIsNamed) {
  load();
  gl::require_rendering(gl_);
  for (const auto& [mode, name] : {std::pair{0x1C02, "GL_SELECT"}, std::pair{0x1C01, "GL_FEEDBACK"}}) {
    driver().values[0x0C40] = static_cast<GLfloat>(mode);
    try {
      gl::require_rendering(gl_);
      ADD_FAILURE() << name;
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find(name), std::string::npos) << error.what();
    }
  }
}

}  // namespace
