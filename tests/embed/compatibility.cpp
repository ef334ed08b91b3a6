// A host with a compatibility profile context that uses only cumulet.h. Legacy state does not change images, and state
// that prevents a call returns an error that names it. scramble.cpp tests that all state is restored.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <functional>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "support/c_host.hpp"
#include "support/gltf_seeds.hpp"
#include "support/legacy_gl.hpp"

namespace {

using cumulet::headless::Backend;
using cumulet::headless::Context;
using cumulet::headless::Profile;
using cumulet::test::HostTarget;
using cumulet::test::LegacyGl;
using cumulet::test::make_desc;
using cumulet::test::SurfacesRef;
using cumulet::test::ViewerPtr;
using cumulet::test::VolumeRef;
namespace legacy = cumulet::test::legacy;

constexpr int side = 24;

/// A wall behind the volume with a striped texture that needs mipmaps.
SurfacesRef make_wall() {
  using cumulet::test::json;
  constexpr std::uint32_t texels = 64;
  cumulet::test::GltfModel model;
  cumulet::test::Bytes stripes;
  for (std::uint32_t y = 0; y < texels; ++y) {
    for (std::uint32_t x = 0; x < texels; ++x) {
      const std::uint8_t value = (x / 3 + y / 5) % 2 == 0 ? 255 : static_cast<std::uint8_t>(3 * y);
      for (int i = 0; i < 3; ++i) stripes.push_back(value);
    }
  }
  const int image = model.view(cumulet::test::png(texels, texels, 8, 2, stripes));
  model.add("images", {{"bufferView", image}, {"mimeType", "image/png"}});
  model.add("textures", {{"source", 0}});
  model.add("materials", {{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}, {"metallicFactor", 0}}},
                          {"doubleSided", true}});
  const json wall = {{"attributes",
                      {{"POSITION", model.vec3({-9, -9, -9, 9, -9, -9, -9, 9, -9, 9, -9, -9, 9, 9, -9, -9, 9, -9})},
                       {"NORMAL", model.vec3({0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1})},
                       {"TEXCOORD_0", model.vec2({0, 1, 1, 1, 0, 0, 1, 1, 1, 0, 0, 0})}}},
                     {"material", 0}};
  model.show(wall);
  model.root["scenes"] = json::array({{{"nodes", json::array({0})}}});
  model.root["scene"] = 0;
  return cumulet::test::read_surfaces(model.glb());
}

/// A host's images of a scene: frames of path traced and of rasterized surfaces, with depth, and images that are read
/// back.
struct Pictures {
  std::vector<float> drawn, depths, linear, rasterized;
  bool operator==(const Pictures&) const = default;
};

struct Scene {
  VolumeRef volume = cumulet::test::make_ball(12, 2.0F);
  SurfacesRef wall = make_wall();
};

ViewerPtr viewer_of(Context& context, cumulet_shader_cache* programs,
                    cumulet_gl_state_policy gl_state = CUMULET_GL_STATE_RESTORE,
                    cumulet_get_proc_fn get_proc = Context::get_proc) {
  ViewerPtr viewer = cumulet::test::make_viewer(
      {.get_proc = get_proc, .user = &context, .gl_state = gl_state, .samples = 2, .programs = programs});
  auto display = make_desc<cumulet_display_desc>();
  display.background = CUMULET_BACKGROUND_TRANSPARENT;
  EXPECT_EQ(cumulet_set_display(viewer.get(), &display), CUMULET_OK);
  auto light = make_desc<cumulet_sun_sky_desc>();
  light.sun_elevation_degrees = 40.0F;
  for (float& value : light.sun_irradiance) value = 40.0F;  // radiance above 1, which clamping would change
  for (float& value : light.sky_radiance) value = 0.5F;
  EXPECT_EQ(cumulet_set_sun_sky(viewer.get(), &light), CUMULET_OK);
  return viewer;
}

void render(cumulet_viewer* viewer, const HostTarget& target) {
  auto frame = target.frame();
  frame.color = CUMULET_COLOR_HDR;
  frame.write_depth = 1;
  frame.target = CUMULET_TARGET_NONE;
  cumulet::test::converge(viewer, frame);
  frame.target = CUMULET_TARGET_FRAMEBUFFER;
  ASSERT_EQ(cumulet_render(viewer, &frame, nullptr), CUMULET_OK) << cumulet_last_error(viewer);
}

/// Renders with a new viewer. before and after: called around each call of the viewer, but not around the host's own
/// reads.
Pictures pictures_of(Context& context, const GladGLContext& gl, const Scene& scene, cumulet_shader_cache* programs,
                     const std::function<void()>& before, const std::function<void()>& after,
                     cumulet_gl_state_policy gl_state = CUMULET_GL_STATE_RESTORE) {
  const HostTarget target(gl, side, side, GL_RGBA32F);
  Pictures pictures;
  pictures.linear.resize(std::size_t{side} * side * 4);
  before();
  {
    const ViewerPtr viewer = viewer_of(context, programs, gl_state);
    EXPECT_EQ(cumulet_set_volume(viewer.get(), scene.volume.get()), CUMULET_OK);
    EXPECT_EQ(cumulet_set_surfaces(viewer.get(), scene.wall.get()), CUMULET_OK);
    render(viewer.get(), target);
    EXPECT_EQ(cumulet_read_linear(viewer.get(), pictures.linear.data(), pictures.linear.size()), CUMULET_OK);
    after();
    pictures.drawn = target.floats();
    pictures.depths = target.depths();
    target.clear({}, 1.0F);
    before();
    auto settings = make_desc<cumulet_surface_settings_desc>();
    settings.lighting = CUMULET_SURFACE_LIGHTING_RASTERIZED;
    EXPECT_EQ(cumulet_set_surface_settings(viewer.get(), &settings), CUMULET_OK);
    render(viewer.get(), target);
  }
  after();
  pictures.rasterized = target.floats();
  return pictures;
}

struct Case {
  std::string name;
  std::function<void()> set;
};

class Compatibility : public testing::Test {
 protected:
  Pictures in_core() {
    Context core = Context::create(Backend::egl);
    const GladGLContext core_gl = cumulet::test::load_gl(Context::get_proc, &core);
    Pictures pictures = pictures_of(
        core, core_gl, scene_, nullptr, [] {}, [] {});
    context_.make_current();
    return pictures;
  }

  /// Expects the same images with this state set around each call of the viewer.
  void expect_pictures(const Pictures& expected, const Case& one, cumulet_gl_state_policy gl_state) {
    SCOPED_TRACE(one.name);
    // The library is called inside the host's glPushAttrib.
    const Pictures is = pictures_of(
        context_, gl_, scene_, programs_.get(),
        [&] {
          legacy_.PushAttrib(legacy::all_attributes);
          legacy_.PushClientAttrib(legacy::client_all_attributes);
          one.set();
        },
        [&] {
          legacy_.PopClientAttrib();
          legacy_.PopAttrib();
          gl_.ClampColor(GL_CLAMP_READ_COLOR, GL_FIXED_ONLY);
        },
        gl_state);
    EXPECT_EQ(gl_.GetError(), GLenum{GL_NO_ERROR});
    EXPECT_TRUE(is.drawn == expected.drawn);
    EXPECT_TRUE(is.depths == expected.depths);
    EXPECT_TRUE(is.linear == expected.linear);
    EXPECT_TRUE(is.rasterized == expected.rasterized);
  }

  /// Expects that each [GL] call returns an error with this text and leaves GL unchanged.
  void expect_refused(const std::string& text, const std::string& not_text = "no such text") {
    auto frame = target_.frame();
    auto pick = make_desc<cumulet_pick>();
    const auto map_desc = make_desc<cumulet_transmittance_map_desc>();
    auto map = make_desc<cumulet_transmittance_map>();
    std::vector<float> rgba(std::size_t{side} * side * 4);
    std::vector<std::uint8_t> bytes(rgba.size());
    double noise = 0.0;
    auto warm = make_desc<cumulet_warm_up_result>();
    cumulet_viewer* v = viewer_.get();
    for (const auto& call : std::vector<std::function<cumulet_status()>>{
             [&] { return cumulet_render(v, &frame, nullptr); },
             [&] { return cumulet_warm_up(v, &frame, CUMULET_WARM_UP_SCENE, &warm); },
             [&] { return cumulet_pick_at(v, 1.0, 1.0, &pick); },
             [&] { return cumulet_update_transmittance_map(v, &map_desc, &map); },
             [&] { return cumulet_destroy_transmittance_map(v, 0); },
             [&] { return cumulet_read_linear(v, rgba.data(), rgba.size()); },
             [&] { return cumulet_read_display(v, bytes.data(), bytes.size()); },
             [&] { return cumulet_read_aov(v, CUMULET_AOV_NORMAL, rgba.data(), rgba.size()); },
             [&] { return cumulet_measure_noise(v, &noise); }}) {
      EXPECT_EQ(call(), CUMULET_ERROR_GL);
      const std::string line = cumulet_last_error(v);
      EXPECT_NE(line.find(text), std::string::npos) << line;
      EXPECT_EQ(line.find(not_text), std::string::npos) << line;
    }
    EXPECT_NE(creation_error().find(text), std::string::npos) << creation_error();
  }
  std::string creation_error(cumulet_get_proc_fn get_proc = Context::get_proc) {
    auto create = make_desc<cumulet_create_desc>();
    create.get_proc = get_proc;
    create.get_proc_user = &context_;
    std::array<char, 512> error{};
    cumulet_viewer* out = nullptr;
    EXPECT_NE(cumulet_create(&create, &out, error.data(), error.size()), CUMULET_OK);
    EXPECT_EQ(out, nullptr);
    return error.data();
  }
  void show_volume() {
    ASSERT_EQ(cumulet_set_volume(viewer_.get(), scene_.volume.get()), CUMULET_OK);
    render(viewer_.get(), target_);
    first_ = target_.floats();
    ASSERT_GT(*std::ranges::max_element(first_), 1.0F);
  }
  void expect_healed() {
    EXPECT_EQ(gl_.GetError(), GLenum{GL_NO_ERROR});
    target_.clear({}, 1.0F);
    render(viewer_.get(), target_);
    EXPECT_EQ(target_.floats(), first_);
    EXPECT_EQ(gl_.GetError(), GLenum{GL_NO_ERROR});
  }

  [[nodiscard]] std::vector<Case> fragment_cases() const {
    return {{"nothing", [] {}},
            {"alpha test",
             [this] {
               legacy_.AlphaFunc(GL_NEVER, 0.5F);
               gl_.Enable(legacy::alpha_test);
             }},
            {"polygon stipple",
             [this] {
               const std::array<GLubyte, 128> holes{};
               legacy_.PolygonStipple(holes.data());
               gl_.Enable(legacy::polygon_stipple);
             }},
            {"fragment clamp", [this] { gl_.ClampColor(legacy::clamp_fragment_color, GL_TRUE); }},
            {"vertex clamp", [this] { gl_.ClampColor(legacy::clamp_vertex_color, GL_TRUE); }}};
  }
  [[nodiscard]] std::vector<Case> pixel_cases() const {
    return {
        {"read clamp", [this] { gl_.ClampColor(GL_CLAMP_READ_COLOR, GL_TRUE); }},
        {"scale and bias",
         [this] {
           for (const GLenum scale : legacy::scales) legacy_.PixelTransferf(scale, 0.25F);
           for (const GLenum bias : legacy::biases) legacy_.PixelTransferf(bias, 0.5F);
         }},
        {"pixel maps",
         [this] {
           for (const GLenum map : legacy::color_maps) legacy_.PixelMapfv(map, 4, dark().data());
           legacy_.PixelTransferf(legacy::map_color, 1.0F);
           legacy_.PixelTransferf(legacy::map_stencil, 1.0F);
           legacy_.PixelTransferf(legacy::index_shift, 2.0F);
           legacy_.PixelTransferf(legacy::index_offset, 3.0F);
         }},
        {"pixel store",
         [this] {
           for (const GLenum name : {GL_PACK_LSB_FIRST, GL_PACK_SWAP_BYTES, GL_UNPACK_LSB_FIRST, GL_UNPACK_SWAP_BYTES})
             gl_.PixelStorei(name, 1);
         }},
        {"level-of-detail bias", [this] {
           for (GLuint unit = 0; unit < 32; ++unit) {
             gl_.ActiveTexture(GL_TEXTURE0 + unit);
             legacy_.TexEnvf(legacy::texture_filter_control, GL_TEXTURE_LOD_BIAS, 4.0F);
           }
         }}};
  }
  [[nodiscard]] std::vector<Case> vertex_cases() const {
    return {{"every capability",
             [this] {
               for (const auto& [name, value] : legacy::capabilities) gl_.Enable(value);
               for (const GLenum value : {GL_COLOR_LOGIC_OP, GL_POLYGON_SMOOTH, GL_LINE_SMOOTH, GL_PROGRAM_POINT_SIZE})
                 gl_.Enable(value);
               gl_.LogicOp(GL_INVERT);
               legacy_.AlphaFunc(GL_LESS, 0.0F);
             }},
            {"clip planes",
             [this] {
               const std::array<GLdouble, 4> nothing{0.0, 0.0, 0.0, -1.0};
               for (GLenum i = 0; i < 6; ++i) {
                 legacy_.ClipPlane(GL_CLIP_DISTANCE0 + i, nothing.data());
                 gl_.Enable(GL_CLIP_DISTANCE0 + i);
               }
             }},
            {"fixed function", [this] {
               legacy_.ShadeModel(legacy::flat);
               legacy_.LightModelf(0x0B52, 1.0F);
               legacy_.Color4f(0.0F, 0.0F, 0.0F, 0.0F);
               const std::array<GLfloat, 16> zeros{};
               for (const GLenum mode : {legacy::modelview, legacy::projection}) {
                 legacy_.MatrixMode(mode);
                 legacy_.LoadMatrixf(zeros.data());
               }
               for (GLuint unit = 0; unit < legacy::coordinate_units; ++unit) {
                 gl_.ActiveTexture(GL_TEXTURE0 + unit);
                 for (const auto& [name, value] : legacy::unit_capabilities) gl_.Enable(value);
               }
             }}};
  }
  static const std::array<GLfloat, 4>& dark() {
    static constexpr std::array<GLfloat, 4> entries{0.1F, 0.2F, 0.05F, 0.0F};
    return entries;
  }

  Scene scene_;
  Context context_ = Context::create(Backend::egl, false, Profile::compatibility);
  GladGLContext gl_ = cumulet::test::load_gl(Context::get_proc, &context_);
  LegacyGl legacy_{context_};
  HostTarget target_{gl_, side, side, GL_RGBA32F};
  cumulet::test::ProgramsRef programs_{[] {
    const auto desc = make_desc<cumulet_shader_cache_desc>();
    cumulet_shader_cache* programs = nullptr;
    EXPECT_EQ(cumulet_shader_cache_create(&desc, &programs, nullptr, 0), CUMULET_OK);
    return programs;
  }()};
  ViewerPtr viewer_ = viewer_of(context_, programs_.get());
  std::vector<float> first_;
};

TEST_F(Compatibility, ImagesMatchACoreContextForAnyLegacyState) {
  const Pictures expected = in_core();
  ASSERT_GT(*std::ranges::max_element(expected.drawn), 1.5F);
  ASSERT_GT(*std::ranges::max_element(expected.rasterized), 1.5F);
  ASSERT_LT(*std::ranges::min_element(expected.depths), 1.0F);
  std::vector<Case> cases = fragment_cases();
  for (const auto& more : {pixel_cases(), vertex_cases()}) cases.insert(cases.end(), more.begin(), more.end());
  for (const Case& one : cases) expect_pictures(expected, one, CUMULET_GL_STATE_RESTORE);
  const auto set_all = [&] {
    for (const Case& one : cases) one.set();
  };
  expect_pictures(expected, {"all of them", set_all}, CUMULET_GL_STATE_RESTORE);
  expect_pictures(expected, {"all of them, and the host resets", set_all}, CUMULET_GL_STATE_HOST_RESETS);
}

TEST_F(Compatibility, OpenDisplayListIsRejectedByName) {
  show_volume();
  for (const GLenum mode : {legacy::compile, legacy::compile_and_execute}) {
    const GLuint list = legacy_.GenLists(1);
    legacy_.NewList(list, mode);
    expect_refused(std::string("display list ").append(std::to_string(list)).append(" is open"));
    legacy_.EndList();
    expect_healed();
    // The display list has recorded nothing.
    const GLuint program = gl_.CreateProgram();
    GLint before = -1;
    gl_.GetIntegerv(GL_VERTEX_ARRAY_BINDING, &before);
    target_.clear({0.25F, 0.5F, 0.75F, 1.0F}, 1.0F);
    const auto cleared = target_.floats();
    legacy_.CallList(list);
    EXPECT_EQ(target_.floats(), cleared);
    GLint current = -1;
    gl_.GetIntegerv(GL_CURRENT_PROGRAM, &current);
    EXPECT_EQ(current, 0);
    gl_.DeleteProgram(program);
    legacy_.DeleteLists(list, 1);
  }
}

TEST_F(Compatibility, ViewerMayBeDestroyedInADisplayList) {
  show_volume();
  const GLuint list = legacy_.GenLists(1);
  legacy_.NewList(list, legacy::compile);
  EXPECT_EQ(cumulet_detach(viewer_.get()), CUMULET_OK) << cumulet_last_error(viewer_.get());
  legacy_.EndList();
  EXPECT_EQ(gl_.GetError(), GLenum{GL_NO_ERROR});
  ASSERT_EQ(cumulet_attach(viewer_.get(), Context::get_proc, &context_), CUMULET_OK);
  expect_healed();
  legacy_.CallList(list);
  expect_healed();
  legacy_.DeleteLists(list, 1);
}

TEST_F(Compatibility, SelectionAndFeedbackAreRejectedByName) {
  show_volume();
  std::array<GLuint, 16> names{};
  std::array<GLfloat, 16> values{};
  legacy_.SelectBuffer(names.size(), names.data());
  legacy_.FeedbackBuffer(values.size(), legacy::two_d, values.data());
  for (const GLenum mode : {legacy::select, legacy::feedback}) {
    legacy_.RenderMode(mode);
    expect_refused(mode == legacy::select ? "GL_SELECT" : "GL_FEEDBACK");
    GLint is = 0;
    gl_.GetIntegerv(0x0C40, &is);
    EXPECT_EQ(static_cast<GLenum>(is), mode);
    legacy_.RenderMode(legacy::render);
    expect_healed();
  }
}

TEST_F(Compatibility, CallsBetweenBeginAndEndAreRejectedByName) {
  show_volume();
  gl_.BindFramebuffer(GL_FRAMEBUFFER, target_.framebuffer());
  legacy_.Begin(GL_TRIANGLES);
  legacy_.Vertex2f(0.0F, 0.0F);
  expect_refused("between glBegin and glEnd", "no OpenGL context");
  EXPECT_EQ(cumulet_detach(viewer_.get()), CUMULET_ERROR_GL);
  EXPECT_NE(std::string(cumulet_last_error(viewer_.get())).find("between glBegin and glEnd"), std::string::npos);
  legacy_.End();
  // Between glBegin and glEnd, each query sets a GL error that cannot be read there.
  while (gl_.GetError() != GL_NO_ERROR) {
  }
  expect_healed();
}

// A host's get_proc may not return functions of the window system.
TEST_F(Compatibility, WithoutAWindowSystemBothCausesAreNamed) {
  const ViewerPtr viewer =
      viewer_of(context_, nullptr, CUMULET_GL_STATE_RESTORE, [](void* user, const char* name) -> void* {
        return std::strstr(name, "GetCurrentContext") != nullptr ? nullptr : Context::get_proc(user, name);
      });
  gl_.BindFramebuffer(GL_FRAMEBUFFER, target_.framebuffer());
  const auto frame = target_.frame();
  legacy_.Begin(GL_TRIANGLES);
  EXPECT_EQ(cumulet_render(viewer.get(), &frame, nullptr), CUMULET_ERROR_GL);
  legacy_.End();
  const std::string line = cumulet_last_error(viewer.get());
  EXPECT_NE(line.find("no OpenGL context is current"), std::string::npos) << line;
  EXPECT_NE(line.find("between glBegin and glEnd"), std::string::npos) << line;
  while (gl_.GetError() != GL_NO_ERROR) {
  }
  EXPECT_EQ(cumulet_render(viewer.get(), &frame, nullptr), CUMULET_OK) << cumulet_last_error(viewer.get());
}

TEST_F(Compatibility, WithoutAContextTheErrorSaysSo) {
  show_volume();
  std::thread([&] { expect_refused("no OpenGL", "glBegin"); }).join();
  expect_healed();
}

TEST_F(Compatibility, MissingFunctionsAreNamed) {
  for (const char* missing : {"glPixelTransferf", "glTexEnvf", "glGetTexEnvfv"}) {
    static const char* absent = nullptr;
    absent = missing;
    const std::string line = creation_error([](void* user, const char* name) -> void* {
      return std::strcmp(name, absent) == 0 ? nullptr : Context::get_proc(user, name);
    });
    EXPECT_NE(line.find(missing), std::string::npos) << line;
    EXPECT_NE(line.find("compatibility profile"), std::string::npos) << line;
  }
}

TEST(CoreContext, RequestsNoLegacyFunctions) {
  Context core = Context::create(Backend::egl);
  struct Asked {
    Context* context;
    std::set<std::string> names;
  } asked{&core, {}};
  const ViewerPtr viewer = cumulet::test::make_viewer({.get_proc = [](void* user, const char* name) -> void* {
                                                         auto& of = *static_cast<Asked*>(user);
                                                         of.names.insert(name);
                                                         return Context::get_proc(of.context, name);
                                                       },
                                                       .user = &asked});
  EXPECT_GT(asked.names.count("glDispatchCompute"), 0U);
  for (const char* name : {"glPixelTransferf", "glTexEnvf", "glGetTexEnvfv", "glMatrixMode", "eglGetCurrentContext"})
    EXPECT_EQ(asked.names.count(name), 0U) << name;
}

}  // namespace
