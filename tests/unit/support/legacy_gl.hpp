#pragma once

// The state that only compatibility contexts have: its functions, all its values by glGet, and unusual but legal
// values.

#include <glad/gl.h>
#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <memory>
#include <random>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "headless.hpp"

namespace cumulet::test {

/// Enumerants that the core profile's header lacks.
namespace legacy {

constexpr GLenum all_attributes = 0x000FFFFF;
constexpr GLenum client_all_attributes = 0xFFFFFFFF;
constexpr GLenum alpha_test = 0x0BC0;
constexpr GLenum polygon_stipple = 0x0B42;
constexpr GLenum clamp_vertex_color = 0x891A;
constexpr GLenum clamp_fragment_color = 0x891B;
constexpr GLenum flat = 0x1D00;
constexpr GLenum smooth = 0x1D01;
constexpr GLenum modelview = 0x1700;
constexpr GLenum projection = 0x1701;
constexpr GLenum compile = 0x1300;
constexpr GLenum compile_and_execute = 0x1301;
constexpr GLenum render = 0x1C00;
constexpr GLenum feedback = 0x1C01;
constexpr GLenum select = 0x1C02;
constexpr GLenum two_d = 0x0600;
constexpr GLenum map_color = 0x0D10;
constexpr GLenum map_stencil = 0x0D11;
constexpr GLenum index_shift = 0x0D12;
constexpr GLenum index_offset = 0x0D13;
constexpr std::array<GLenum, 5> scales{0x0D14, 0x0D18, 0x0D1A, 0x0D1C, 0x0D1E};  // red, green, blue, alpha, depth
constexpr std::array<GLenum, 5> biases{0x0D15, 0x0D19, 0x0D1B, 0x0D1D, 0x0D1F};
constexpr std::array<GLenum, 4> color_maps{0x0C76, 0x0C77, 0x0C78,
                                           0x0C79};  // GL_PIXEL_MAP_R_TO_R to GL_PIXEL_MAP_A_TO_A
constexpr GLenum texture_filter_control = 0x8500;
constexpr GLenum texture_env = 0x2300;
constexpr GLenum texture_env_mode = 0x2200;

struct Named {
  const char* name;
  GLenum value;
};

constexpr std::array<Named, 18> capabilities{{{"GL_ALPHA_TEST", alpha_test},
                                              {"GL_POLYGON_STIPPLE", polygon_stipple},
                                              {"GL_LINE_STIPPLE", 0x0B24},
                                              {"GL_FOG", 0x0B60},
                                              {"GL_LIGHTING", 0x0B50},
                                              {"GL_LIGHT0", 0x4000},
                                              {"GL_COLOR_MATERIAL", 0x0B57},
                                              {"GL_NORMALIZE", 0x0BA1},
                                              {"GL_RESCALE_NORMAL", 0x803A},
                                              {"GL_POINT_SMOOTH", 0x0B10},
                                              {"GL_POINT_SPRITE", 0x8861},
                                              {"GL_INDEX_LOGIC_OP", 0x0BF1},
                                              {"GL_COLOR_SUM", 0x8458},
                                              {"GL_VERTEX_PROGRAM_TWO_SIDE", 0x8643},
                                              {"GL_AUTO_NORMAL", 0x0D80},
                                              {"GL_MAP1_VERTEX_3", 0x0D97},
                                              {"GL_MAP2_VERTEX_3", 0x0DB7},
                                              {"GL_MAP2_COLOR_4", 0x0DB0}}};

/// Capabilities of a texture unit that has texture coordinates.
constexpr std::array<Named, 7> unit_capabilities{{{"GL_TEXTURE_1D", GL_TEXTURE_1D},
                                                  {"GL_TEXTURE_2D", GL_TEXTURE_2D},
                                                  {"GL_TEXTURE_3D", GL_TEXTURE_3D},
                                                  {"GL_TEXTURE_RECTANGLE", GL_TEXTURE_RECTANGLE},
                                                  {"GL_TEXTURE_CUBE_MAP", GL_TEXTURE_CUBE_MAP},
                                                  {"GL_TEXTURE_GEN_S", 0x0C60},
                                                  {"GL_TEXTURE_GEN_T", 0x0C61}}};
constexpr GLuint coordinate_units = 8;

constexpr std::array<Named, 55> values{{{"GL_ALPHA_TEST_FUNC", 0x0BC1},
                                        {"GL_ALPHA_TEST_REF", 0x0BC2},
                                        {"GL_SHADE_MODEL", 0x0B54},
                                        {"GL_CLAMP_VERTEX_COLOR", clamp_vertex_color},
                                        {"GL_CLAMP_FRAGMENT_COLOR", clamp_fragment_color},
                                        {"GL_FOG_MODE", 0x0B65},
                                        {"GL_FOG_DENSITY", 0x0B62},
                                        {"GL_FOG_START", 0x0B63},
                                        {"GL_FOG_END", 0x0B64},
                                        {"GL_FOG_COLOR", 0x0B66},
                                        {"GL_LIGHT_MODEL_TWO_SIDE", 0x0B52},
                                        {"GL_LIGHT_MODEL_AMBIENT", 0x0B53},
                                        {"GL_MATRIX_MODE", 0x0BA0},
                                        {"GL_MODELVIEW_MATRIX", 0x0BA6},
                                        {"GL_PROJECTION_MATRIX", 0x0BA7},
                                        {"GL_MODELVIEW_STACK_DEPTH", 0x0BA3},
                                        {"GL_PROJECTION_STACK_DEPTH", 0x0BA4},
                                        {"GL_ATTRIB_STACK_DEPTH", 0x0BB0},
                                        {"GL_CLIENT_ATTRIB_STACK_DEPTH", 0x0BB1},
                                        {"GL_MAP_COLOR", map_color},
                                        {"GL_MAP_STENCIL", map_stencil},
                                        {"GL_INDEX_SHIFT", index_shift},
                                        {"GL_INDEX_OFFSET", index_offset},
                                        {"GL_RED_SCALE", scales[0]},
                                        {"GL_GREEN_SCALE", scales[1]},
                                        {"GL_BLUE_SCALE", scales[2]},
                                        {"GL_ALPHA_SCALE", scales[3]},
                                        {"GL_DEPTH_SCALE", scales[4]},
                                        {"GL_RED_BIAS", biases[0]},
                                        {"GL_GREEN_BIAS", biases[1]},
                                        {"GL_BLUE_BIAS", biases[2]},
                                        {"GL_ALPHA_BIAS", biases[3]},
                                        {"GL_DEPTH_BIAS", biases[4]},
                                        {"GL_ZOOM_X", 0x0D16},
                                        {"GL_ZOOM_Y", 0x0D17},
                                        {"GL_LINE_STIPPLE_PATTERN", 0x0B25},
                                        {"GL_LINE_STIPPLE_REPEAT", 0x0B26},
                                        {"GL_LIST_BASE", 0x0B32},
                                        {"GL_LIST_INDEX", 0x0B33},
                                        {"GL_RENDER_MODE", 0x0C40},
                                        {"GL_CURRENT_COLOR", 0x0B00},
                                        {"GL_CURRENT_NORMAL", 0x0B02},
                                        {"GL_CURRENT_RASTER_POSITION", 0x0B07},
                                        {"GL_ACCUM_CLEAR_VALUE", 0x0B80},
                                        {"GL_CLIENT_ACTIVE_TEXTURE", 0x84E1},
                                        {"GL_INDEX_WRITEMASK", 0x0C21},
                                        {"GL_EDGE_FLAG", 0x0B43},
                                        {"GL_VERTEX_ARRAY", 0x8074},
                                        {"GL_COLOR_ARRAY", 0x8076},
                                        {"GL_PERSPECTIVE_CORRECTION_HINT", 0x0C50},
                                        {"GL_POINT_SMOOTH_HINT", 0x0C51},
                                        {"GL_FOG_HINT", 0x0C54},
                                        {"GL_GENERATE_MIPMAP_HINT", 0x8192},
                                        {"GL_POINT_SIZE_MIN", 0x8126},
                                        {"GL_POINT_SIZE_MAX", 0x8127}}};

}  // namespace legacy

/// Functions of the compatibility profile, loaded from a context that has them.
struct LegacyGl {
  explicit LegacyGl(headless::Context& context) {
    const auto load = [&context](auto& function, const char* name) {
      function =
          reinterpret_cast<std::remove_reference_t<decltype(function)>>(headless::Context::get_proc(&context, name));
      EXPECT_NE(function, nullptr) << name;
    };
    load(AlphaFunc, "glAlphaFunc");
    load(Begin, "glBegin");
    load(CallList, "glCallList");
    load(ClearAccum, "glClearAccum");
    load(ClientActiveTexture, "glClientActiveTexture");
    load(ClipPlane, "glClipPlane");
    load(Color4f, "glColor4f");
    load(DeleteLists, "glDeleteLists");
    load(DisableClientState, "glDisableClientState");
    load(EdgeFlag, "glEdgeFlag");
    load(EnableClientState, "glEnableClientState");
    load(End, "glEnd");
    load(EndList, "glEndList");
    load(FeedbackBuffer, "glFeedbackBuffer");
    load(Fogf, "glFogf");
    load(Fogfv, "glFogfv");
    load(GetPixelMapfv, "glGetPixelMapfv");
    load(GetPolygonStipple, "glGetPolygonStipple");
    load(GetTexEnvfv, "glGetTexEnvfv");
    load(IndexMask, "glIndexMask");
    load(LightModelf, "glLightModelf");
    load(LightModelfv, "glLightModelfv");
    load(LineStipple, "glLineStipple");
    load(ListBase, "glListBase");
    load(LoadMatrixf, "glLoadMatrixf");
    load(MatrixMode, "glMatrixMode");
    load(NewList, "glNewList");
    load(Normal3f, "glNormal3f");
    load(PixelMapfv, "glPixelMapfv");
    load(PixelTransferf, "glPixelTransferf");
    load(PixelZoom, "glPixelZoom");
    load(PolygonStipple, "glPolygonStipple");
    load(PopAttrib, "glPopAttrib");
    load(PopClientAttrib, "glPopClientAttrib");
    load(PopMatrix, "glPopMatrix");
    load(PushAttrib, "glPushAttrib");
    load(PushClientAttrib, "glPushClientAttrib");
    load(PushMatrix, "glPushMatrix");
    load(SelectBuffer, "glSelectBuffer");
    load(ShadeModel, "glShadeModel");
    load(TexEnvf, "glTexEnvf");
    load(Vertex2f, "glVertex2f");
    load(GenLists, "glGenLists");
    load(RenderMode, "glRenderMode");
  }

  void (*AlphaFunc)(GLenum, GLfloat) = nullptr;
  void (*Begin)(GLenum) = nullptr;
  void (*CallList)(GLuint) = nullptr;
  void (*ClearAccum)(GLfloat, GLfloat, GLfloat, GLfloat) = nullptr;
  void (*ClientActiveTexture)(GLenum) = nullptr;
  void (*ClipPlane)(GLenum, const GLdouble*) = nullptr;
  void (*Color4f)(GLfloat, GLfloat, GLfloat, GLfloat) = nullptr;
  void (*DeleteLists)(GLuint, GLsizei) = nullptr;
  void (*DisableClientState)(GLenum) = nullptr;
  void (*EdgeFlag)(GLboolean) = nullptr;
  void (*EnableClientState)(GLenum) = nullptr;
  void (*End)() = nullptr;
  void (*EndList)() = nullptr;
  void (*FeedbackBuffer)(GLsizei, GLenum, GLfloat*) = nullptr;
  void (*Fogf)(GLenum, GLfloat) = nullptr;
  void (*Fogfv)(GLenum, const GLfloat*) = nullptr;
  void (*GetPixelMapfv)(GLenum, GLfloat*) = nullptr;
  void (*GetPolygonStipple)(GLubyte*) = nullptr;
  void (*GetTexEnvfv)(GLenum, GLenum, GLfloat*) = nullptr;
  void (*IndexMask)(GLuint) = nullptr;
  void (*LightModelf)(GLenum, GLfloat) = nullptr;
  void (*LightModelfv)(GLenum, const GLfloat*) = nullptr;
  void (*LineStipple)(GLint, GLushort) = nullptr;
  void (*ListBase)(GLuint) = nullptr;
  void (*LoadMatrixf)(const GLfloat*) = nullptr;
  void (*MatrixMode)(GLenum) = nullptr;
  void (*NewList)(GLuint, GLenum) = nullptr;
  void (*Normal3f)(GLfloat, GLfloat, GLfloat) = nullptr;
  void (*PixelMapfv)(GLenum, GLsizei, const GLfloat*) = nullptr;
  void (*PixelTransferf)(GLenum, GLfloat) = nullptr;
  void (*PixelZoom)(GLfloat, GLfloat) = nullptr;
  void (*PolygonStipple)(const GLubyte*) = nullptr;
  void (*PopAttrib)() = nullptr;
  void (*PopClientAttrib)() = nullptr;
  void (*PopMatrix)() = nullptr;
  void (*PushAttrib)(GLbitfield) = nullptr;
  void (*PushClientAttrib)(GLbitfield) = nullptr;
  void (*PushMatrix)() = nullptr;
  void (*SelectBuffer)(GLsizei, GLuint*) = nullptr;
  void (*ShadeModel)(GLenum) = nullptr;
  void (*TexEnvf)(GLenum, GLenum, GLfloat) = nullptr;
  void (*Vertex2f)(GLfloat, GLfloat) = nullptr;
  GLuint (*GenLists)(GLsizei) = nullptr;
  GLint (*RenderMode)(GLenum) = nullptr;
};

/// Null in a core context.
using LegacyGlPtr = std::shared_ptr<const LegacyGl>;

/// Reads pixel maps and the polygon stipple. GL writes them to the pixel pack buffer, using the pack parameters.
template <class Add>
void read_legacy_patterns(const GladGLContext& gl, const LegacyGl& legacy_gl, const Add& add) {
  GLint pack = 0;
  gl.GetIntegerv(GL_PIXEL_PACK_BUFFER_BINDING, &pack);
  if (pack != 0 && gl.IsBuffer(static_cast<GLuint>(pack)) == GL_FALSE)
    return;  // a deleted buffer cannot be bound again
  gl.BindBuffer(GL_PIXEL_PACK_BUFFER, 0);
  for (const GLenum map : legacy::color_maps) {
    std::array<GLfloat, 16> entries{};
    legacy_gl.GetPixelMapfv(map, entries.data());
    add(std::string("a pixel map ").append(std::to_string(map)), {entries.begin(), entries.end()});
  }
  std::array<GLubyte, 4096> stipple{};
  legacy_gl.GetPolygonStipple(stipple.data());
  add("the polygon stipple", {stipple.begin(), stipple.end()});
  gl.BindBuffer(GL_PIXEL_PACK_BUFFER, static_cast<GLuint>(pack));
}

/// The legacy state of the current context: names (with the unit where there are several) and values.
inline std::vector<std::pair<std::string, std::vector<double>>> read_legacy_state(const GladGLContext& gl,
                                                                                  const LegacyGl& legacy_gl) {
  std::vector<std::pair<std::string, std::vector<double>>> state;
  const auto add = [&](const std::string& name, std::vector<double> read) {
    EXPECT_EQ(gl.GetError(), GLenum{GL_NO_ERROR}) << name;
    state.emplace_back(name, std::move(read));
  };
  for (const auto& [name, value] : legacy::values) {
    std::vector<double> read(16, -1.0);
    gl.GetDoublev(value, read.data());
    add(name, std::move(read));
  }
  for (const auto& [name, value] : legacy::capabilities) add(name, {double(gl.IsEnabled(value))});
  read_legacy_patterns(gl, legacy_gl, add);
  GLint active = 0;
  gl.GetIntegerv(GL_ACTIVE_TEXTURE, &active);
  for (GLuint unit = 0; unit < 32; ++unit) {
    const std::string of_unit = std::string("[").append(std::to_string(unit)).append("]");
    gl.ActiveTexture(GL_TEXTURE0 + unit);
    GLfloat bias = -1.0F;
    legacy_gl.GetTexEnvfv(legacy::texture_filter_control, GL_TEXTURE_LOD_BIAS, &bias);
    add("GL_TEXTURE_LOD_BIAS" + of_unit, {bias});
    if (unit >= legacy::coordinate_units) continue;
    GLfloat mode = -1.0F;
    legacy_gl.GetTexEnvfv(legacy::texture_env, legacy::texture_env_mode, &mode);
    add("GL_TEXTURE_ENV_MODE" + of_unit, {mode});
    for (const auto& [name, value] : legacy::unit_capabilities) add(name + of_unit, {double(gl.IsEnabled(value))});
  }
  gl.ActiveTexture(static_cast<GLenum>(active));
  return state;
}

/// Sets the legacy state at random; part of ScramblingHost.
class LegacyHost {
 public:
  LegacyHost(const GladGLContext& gl, LegacyGlPtr legacy_gl) : gl_(gl), legacy_(std::move(legacy_gl)) {}

  void scramble(std::mt19937& random) {
    random_ = &random;
    scramble_stacks();
    scramble_fragments();
    scramble_vertices();
    scramble_pixels();
    scramble_units();
  }

 private:
  std::uint32_t below(std::uint32_t count) { return static_cast<std::uint32_t>((*random_)() % count); }
  bool coin() { return below(2) == 1; }
  float unit() { return static_cast<float>(below(1U << 20U)) / float(1U << 20U); }
  void toggle(GLenum capability) {
    if (coin()) {
      gl_.Enable(capability);
    } else {
      gl_.Disable(capability);
    }
  }

  // Pushes attributes and matrices, because a host may call the library between glPushAttrib or glPushMatrix and its
  // pop.
  void scramble_stacks() {
    constexpr GLbitfield current_and_fog = 0x00000001 | 0x00000080;
    const auto deepen = [this](GLenum depth_name, auto&& push, auto&& pop) {
      GLint depth = 0;
      gl_.GetIntegerv(depth_name, &depth);
      if (coin() && depth < 3) {
        push();
      } else if (depth > 1) {
        pop();
      }
    };
    deepen(
        0x0BB0, [this] { legacy_->PushAttrib(current_and_fog); }, [this] { legacy_->PopAttrib(); });
    deepen(
        0x0BB1, [this] { legacy_->PushClientAttrib(2); }, [this] { legacy_->PopClientAttrib(); });
    for (const GLenum mode : {legacy::modelview, legacy::projection}) {
      legacy_->MatrixMode(mode);
      deepen(
          mode == legacy::modelview ? 0x0BA3 : 0x0BA4, [this] { legacy_->PushMatrix(); },
          [this] { legacy_->PopMatrix(); });
      std::array<GLfloat, 16> matrix{};
      for (GLfloat& value : matrix) value = unit() - 0.5F;
      legacy_->LoadMatrixf(matrix.data());
    }
    legacy_->MatrixMode(coin() ? legacy::modelview : legacy::projection);
    legacy_->ListBase(below(100));
  }

  void scramble_fragments() {
    for (const auto& [name, value] : legacy::capabilities) toggle(value);
    legacy_->AlphaFunc(GL_NEVER + below(8), unit());
    std::array<GLubyte, 4096> pattern{};
    for (GLubyte& row : pattern) row = static_cast<GLubyte>(below(256));
    GLint unpack = 0;
    gl_.GetIntegerv(GL_PIXEL_UNPACK_BUFFER_BINDING, &unpack);
    gl_.BindBuffer(GL_PIXEL_UNPACK_BUFFER, 0);
    // With skipped pixels that are no multiple of 8, Mesa 22 writes a byte beyond its copy of the pattern.
    GLint skipped = 0;
    gl_.GetIntegerv(GL_UNPACK_SKIP_PIXELS, &skipped);
    gl_.PixelStorei(GL_UNPACK_SKIP_PIXELS, 0);
    legacy_->PolygonStipple(pattern.data());
    gl_.PixelStorei(GL_UNPACK_SKIP_PIXELS, skipped);
    gl_.BindBuffer(GL_PIXEL_UNPACK_BUFFER, static_cast<GLuint>(unpack));
    legacy_->LineStipple(1 + static_cast<GLint>(below(4)), static_cast<GLushort>(below(65536)));
    const auto clamp = [this] {
      const std::uint32_t pick = below(3);
      return pick == 0 ? GLenum{GL_TRUE} : pick == 1 ? GLenum{GL_FALSE} : GLenum{GL_FIXED_ONLY};
    };
    gl_.ClampColor(legacy::clamp_vertex_color, clamp());
    gl_.ClampColor(legacy::clamp_fragment_color, clamp());
    legacy_->ClearAccum(unit(), unit(), unit(), unit());
    legacy_->IndexMask(below(65536));
  }

  void scramble_vertices() {
    legacy_->ShadeModel(coin() ? legacy::flat : legacy::smooth);
    const std::array<GLfloat, 4> color{unit(), unit(), unit(), unit()};
    legacy_->Fogf(0x0B65, coin() ? 0x0800 : 0x2601);  // GL_EXP, GL_LINEAR
    legacy_->Fogf(0x0B62, unit());
    legacy_->Fogf(0x0B63, unit());
    legacy_->Fogf(0x0B64, 1.0F + unit());
    legacy_->Fogfv(0x0B66, color.data());
    legacy_->LightModelf(0x0B52, coin() ? 1.0F : 0.0F);
    legacy_->LightModelfv(0x0B53, color.data());
    legacy_->Color4f(unit(), unit(), unit(), unit());
    legacy_->Normal3f(unit(), unit(), unit());
    legacy_->EdgeFlag(coin() ? GL_TRUE : GL_FALSE);
    for (GLenum i = 0; i < 6; ++i) {
      const std::array<GLdouble, 4> plane{unit() - 0.5, unit() - 0.5, unit() - 0.5, unit() - 0.5};
      legacy_->ClipPlane(0x3000 + i, plane.data());
    }
    for (const GLenum hint : {0x0C50, 0x0C51, 0x0C54, 0x8192}) gl_.Hint(hint, coin() ? GL_NICEST : GL_FASTEST);
    gl_.PointParameterf(0x8126, unit());
    gl_.PointParameterf(0x8127, 1.0F + unit());
  }

  void scramble_pixels() {
    const auto some = [this](float known) { return coin() ? known : 2.0F * unit() - 0.5F; };
    for (const GLenum scale : legacy::scales) legacy_->PixelTransferf(scale, some(1.0F));
    for (const GLenum bias : legacy::biases) legacy_->PixelTransferf(bias, some(0.0F));
    legacy_->PixelTransferf(legacy::map_color, coin() ? 1.0F : 0.0F);
    legacy_->PixelTransferf(legacy::map_stencil, coin() ? 1.0F : 0.0F);
    legacy_->PixelTransferf(legacy::index_shift, static_cast<float>(below(4)));
    legacy_->PixelTransferf(legacy::index_offset, static_cast<float>(below(4)));
    legacy_->PixelZoom(1.0F + unit(), 1.0F - unit());
    GLint unpack = 0;
    gl_.GetIntegerv(GL_PIXEL_UNPACK_BUFFER_BINDING, &unpack);
    gl_.BindBuffer(GL_PIXEL_UNPACK_BUFFER, 0);
    for (const GLenum map : legacy::color_maps) {
      std::array<GLfloat, 16> entries{};
      for (GLfloat& entry : entries) entry = unit();
      legacy_->PixelMapfv(map, static_cast<GLsizei>(entries.size()), entries.data());
    }
    gl_.BindBuffer(GL_PIXEL_UNPACK_BUFFER, static_cast<GLuint>(unpack));
  }

  void scramble_units() {
    GLint active = 0;
    gl_.GetIntegerv(GL_ACTIVE_TEXTURE, &active);
    for (GLuint i = 0; i < 32; ++i) {
      gl_.ActiveTexture(GL_TEXTURE0 + i);
      legacy_->TexEnvf(legacy::texture_filter_control, GL_TEXTURE_LOD_BIAS, coin() ? 0.0F : 6.0F * unit() - 3.0F);
      if (i >= legacy::coordinate_units) continue;
      legacy_->TexEnvf(legacy::texture_env, legacy::texture_env_mode, coin() ? 0x2100 : 0x1E01);  // modulate, replace
      for (const auto& [name, value] : legacy::unit_capabilities) toggle(value);
    }
    gl_.ActiveTexture(static_cast<GLenum>(active));
    legacy_->ClientActiveTexture(GL_TEXTURE0 + below(legacy::coordinate_units));
    for (const GLenum array : {0x8074, 0x8076}) {
      if (coin()) {
        legacy_->EnableClientState(array);
      } else {
        legacy_->DisableClientState(array);
      }
    }
  }

  const GladGLContext& gl_;
  LegacyGlPtr legacy_;
  std::mt19937* random_ = nullptr;
};

}  // namespace cumulet::test
