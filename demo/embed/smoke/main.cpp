// A live simulation: smoke that the user stirs with the mouse. It is computed in the host's own context. Each step is
// passed to Cumulet as a texture and path-traced while it moves.
//
//     cumulet-embed-smoke [--voxels N] [--build-device cpu|gpu] [--fire on|off] [--record FILE]
//     cumulet-embed-smoke --mouse FILE --test OUT_DIR [--voxels N] [--build-device cpu|gpu] [--fire on|off]
//
// --build-device gpu: the smoke stays on the GPU, and its grids are built there. --fire on: the smoke is hot at its
// source and emits light until it has cooled; the scene is in evening light. The left button stirs; the other buttons
// and the wheel move the camera; Escape quits. --record writes the mouse input, one line per change: frame, x, y (0 to
// 1, from the top left), pressed. --test plays such a file without a window, checks that images follow the smoke and
// that states are drawn often enough, and writes OUT_DIR/smoke.ppm.
#include <cumulet/cumulet.hpp>

#define GL_GLEXT_PROTOTYPES
#include <GL/glcorearb.h>
#define GLFW_INCLUDE_NONE
#include <EGL/egl.h>
#include <EGL/eglext.h>
#include <GLFW/glfw3.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace {

[[noreturn]] void fail(const std::string& cause) {
  std::fprintf(stderr, "cumulet-embed-smoke: %s\n", cause.c_str());
  std::exit(1);
}

template <class T>
T must(cumulet::Result<T> result) {
  if (!result) fail(result.error().message.c_str());
  return std::move(result).value();
}

void must(const cumulet::Result<>& result) {
  if (!result) fail(result.error().message.c_str());
}

using Point = std::array<double, 3>;

// ---- the solver: stable fluids (Stam 1999) in a cube from -1 to 1, lengths and speeds in voxels ----

constexpr const char* kernels = R"(
layout(local_size_x = 4, local_size_y = 4, local_size_z = 4) in;
layout(binding = 0) uniform sampler3D velocity;
layout(binding = 1) uniform sampler3D other;
layout(binding = 0, rgba32f) uniform writeonly image3D to_velocity;
layout(binding = 1, r32f) uniform writeonly image3D to_number;
layout(location = 0) uniform float dt;
layout(location = 1) uniform vec3 stirred;
layout(location = 2) uniform vec3 push;
layout(location = 3) uniform float fade;  // a second
const float buoyancy = 26.0, reach = 0.09;

ivec3 cell = ivec3(gl_GlobalInvocationID);
int n = textureSize(velocity, 0).x;
vec3 from() { return (vec3(cell) + 0.5 - dt * texelFetch(velocity, cell, 0).xyz) / n; }
vec4 at(sampler3D field, ivec3 p) { return texelFetch(field, clamp(p, ivec3(0), ivec3(n - 1)), 0); }
// Density of the smoke that enters near (0.5, 0.1, 0.5).
float source() {
  vec3 away = (vec3(cell) + 0.5) / n - vec3(0.5, 0.1, 0.5);
  return max(0.0, 1.0 - dot(away, away) / 0.008);
}

#if STEP == 0  // velocities move themselves, smoke lifts and the mouse pushes
void main() {
  vec3 v = texture(velocity, from()).xyz;
  v.y += dt * buoyancy * texelFetch(other, cell, 0).x;
  vec3 away = ((vec3(cell) + 0.5) / n - stirred) / reach;
  v += push * exp(-dot(away, away));
  bool wall = any(equal(cell, ivec3(0))) || any(equal(cell, ivec3(n - 1)));
  imageStore(to_velocity, cell, vec4(wall ? vec3(0.0) : v, 0.0));
}
#elif STEP == 1  // what flows out of a voxel
void main() {
  float sum = 0.0;
  for (int axis = 0; axis < 3; ++axis) {
    ivec3 step = ivec3(0);
    step[axis] = 1;
    sum += at(velocity, cell + step)[axis] - at(velocity, cell - step)[axis];
  }
  imageStore(to_velocity, cell, vec4(0.5 * sum));
}
#elif STEP == 2  // a pressure that stops that, by Jacobi; velocity is here the divergence
void main() {
  float sum = -texelFetch(velocity, cell, 0).x;
  for (int axis = 0; axis < 3; ++axis) {
    ivec3 step = ivec3(0);
    step[axis] = 1;
    sum += at(other, cell + step).x + at(other, cell - step).x;
  }
  imageStore(to_number, cell, vec4(sum / 6.0));
}
#elif STEP == 3  // and what it does
void main() {
  vec3 v = texelFetch(velocity, cell, 0).xyz;
  for (int axis = 0; axis < 3; ++axis) {
    ivec3 step = ivec3(0);
    step[axis] = 1;
    v[axis] -= 0.5 * (at(other, cell + step).x - at(other, cell - step).x);
  }
  imageStore(to_velocity, cell, vec4(v, 0.0));
}
#else  // smoke, and its heat, moves along, fades, and comes in
void main() {
  float number = texture(other, from()).x * (1.0 - fade * dt) + 3.0 * dt * source();
  if (number < 1e-3) number = 0.0;
  imageStore(to_number, cell, vec4(number));
}
#endif
)";

GLuint program_of(int step) {
  const std::string source = "#version 450\n#define STEP " + std::to_string(step) + "\n" + kernels;
  const char* text = source.c_str();
  const GLuint program = glCreateShaderProgramv(GL_COMPUTE_SHADER, 1, &text);
  GLint linked = 0;
  glGetProgramiv(program, GL_LINK_STATUS, &linked);
  std::array<char, 1024> log{};
  glGetProgramInfoLog(program, static_cast<GLsizei>(log.size()), nullptr, log.data());
  if (linked == 0) fail(std::string("a kernel does not compile: ") + log.data());
  return program;
}

class Solver {
 public:
  explicit Solver(int voxels) : n_(voxels) {
    for (int step = 0; step < 5; ++step) programs_[std::size_t(step)] = program_of(step);
    for (Pair* pair : {&velocity_, &divergence_}) *pair = make(GL_RGBA32F);
    for (Pair* pair : {&pressure_, &smoke_, &heat_}) *pair = make(GL_R32F);
  }
  Solver(const Solver&) = delete;
  Solver& operator=(const Solver&) = delete;
  ~Solver() {
    for (const GLuint program : programs_) glDeleteProgram(program);
    for (const Pair& pair : {velocity_, divergence_, pressure_, smoke_, heat_}) glDeleteTextures(2, pair.data());
  }

  struct Stir {
    Point at{};    ///< fraction of the cube
    Point push{};  ///< voxels per second
  };
  void step(float dt, const Stir& stir) {
    for (const GLuint program : programs_) {
      glProgramUniform1f(program, 0, dt);
      glProgramUniform3f(program, 1, float(stir.at[0]), float(stir.at[1]), float(stir.at[2]));
      glProgramUniform3f(program, 2, float(stir.push[0]), float(stir.push[1]), float(stir.push[2]));
    }
    run(0, velocity_[0], smoke_[0], velocity_[1], 0);
    std::swap(velocity_[0], velocity_[1]);
    run(1, velocity_[0], 0, divergence_[0], 0);
    for (int i = 0; i < 24; ++i) {
      run(2, divergence_[0], pressure_[0], 0, pressure_[1]);
      std::swap(pressure_[0], pressure_[1]);
    }
    run(3, velocity_[0], pressure_[0], velocity_[1], 0);
    std::swap(velocity_[0], velocity_[1]);
    for (const auto& [numbers, fade] : {std::pair(&smoke_, 0.25F), std::pair(&heat_, 1.2F)}) {
      glProgramUniform1f(programs_[4], 3, fade);
      run(4, velocity_[0], (*numbers)[0], 0, (*numbers)[1]);
      std::swap((*numbers)[0], (*numbers)[1]);
    }
  }
  /// Return the 3D float textures of the last step.
  [[nodiscard]] GLuint smoke() const { return smoke_[0]; }
  [[nodiscard]] GLuint heat() const { return heat_[0]; }

 private:
  using Pair = std::array<GLuint, 2>;
  [[nodiscard]] Pair make(GLenum format) const {
    Pair pair{};
    glCreateTextures(GL_TEXTURE_3D, 2, pair.data());
    for (const GLuint texture : pair) {
      glTextureStorage3D(texture, 1, format, n_, n_, n_);
      glTextureParameteri(texture, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
      for (const GLenum axis : {GL_TEXTURE_WRAP_S, GL_TEXTURE_WRAP_T, GL_TEXTURE_WRAP_R})
        glTextureParameteri(texture, axis, GL_CLAMP_TO_EDGE);
      glClearTexImage(texture, 0, format == GL_R32F ? GL_RED : GL_RGBA, GL_FLOAT, nullptr);
    }
    return pair;
  }
  void run(int step, GLuint velocity, GLuint other, GLuint to_velocity, GLuint to_number) const {
    glUseProgram(programs_[std::size_t(step)]);
    glBindTextureUnit(0, velocity);
    glBindTextureUnit(1, other);
    if (to_velocity != 0) glBindImageTexture(0, to_velocity, 0, GL_TRUE, 0, GL_WRITE_ONLY, GL_RGBA32F);
    if (to_number != 0) glBindImageTexture(1, to_number, 0, GL_TRUE, 0, GL_WRITE_ONLY, GL_R32F);
    const auto groups = static_cast<GLuint>((n_ + 3) / 4);
    glDispatchCompute(groups, groups, groups);
    glMemoryBarrier(GL_TEXTURE_FETCH_BARRIER_BIT | GL_SHADER_IMAGE_ACCESS_BARRIER_BIT);
  }

  int n_;
  std::array<GLuint, 5> programs_{};
  Pair velocity_{}, divergence_{}, pressure_{}, smoke_{}, heat_{};
};

// ---- the host ----

struct Mouse {
  double x = 0.0;  // position in the image, 0 to 1, from the top left
  double y = 0.0;
  bool stirs = false;
};

struct Options {
  int voxels = 64;
  cumulet::BuildDevice build = cumulet::BuildDevice::cpu;
  bool fire = false;
};

class Host {
 public:
  Host(const cumulet::GetProc& get_proc, const Options& options, bool test)
      : voxels_(options.voxels),
        fire_(options.fire),
        solver_(voxels_),
        viewer_(must(cumulet::Viewer::create({.get_proc = get_proc}))) {
    if (fire_) {
      must(viewer_.set_sun_sky({.sun_azimuth_degrees = 60.0F,
                                .sun_elevation_degrees = 4.0F,
                                .sun_irradiance = {0.4F, 0.2F, 0.1F},
                                .sky_radiance = {0.05F, 0.07F, 0.12F}}));
      must(viewer_.set_medium({.density_scale = 9.0,
                               .coalbedo = {0.3F, 0.3F, 0.3F},
                               .temperature_scale = 3000.0F,
                               .blackbody = 1.0F,
                               .blackbody_tint = {12.0F, 12.0F, 12.0F}}));
    } else {
      must(viewer_.set_sun_sky({.sun_azimuth_degrees = 60.0F,
                                .sun_elevation_degrees = 50.0F,
                                .sun_irradiance = {3.0F, 2.8F, 2.5F},
                                .sky_radiance = {0.25F, 0.35F, 0.5F}}));
      must(viewer_.set_medium({.density_scale = 9.0, .coalbedo = {0.03F, 0.03F, 0.03F}}));
    }
    must(viewer_.set_ground({.mode = cumulet::GroundMode::below}));
    must(viewer_.set_display({.denoise = cumulet::Denoise::fast}));
    must(viewer_.set_sampling({.samples = test ? 8U : 64U}));
    // The bounding box is fixed, so that neither the camera nor the ground moves while the smoke rises.
    live_ = must(cumulet::DynamicVolume::create({.bounds_min = {-1.0, -1.0, -1.0},
                                                 .bounds_max = {1.0, 1.0, 1.0},
                                                 .gpu_resident = options.build == cumulet::BuildDevice::gpu}));
    must(viewer_.set_grid({.build_device = options.build}));
    must(viewer_.set_dynamic_volume(live_));
  }

  [[nodiscard]] cumulet::Viewer& viewer() { return viewer_; }

  /// Simulates a step and passes its textures to the viewer. The next step may overwrite them.
  void advance(const Mouse& mouse, double aspect) {
    solver_.step(1.0F / 30.0F, stir(mouse, aspect));
    const double voxel = 2.0 / voxels_;
    const double first = -1.0 + 0.5 * voxel;
    const cumulet::GlField smoke{
        .channel = cumulet::Channel::density,
        .texture = solver_.smoke(),
        .index_to_world = {voxel, 0, 0, 0, 0, voxel, 0, 0, 0, 0, voxel, 0, first, first, first, 1}};
    cumulet::GlField heat = smoke;
    heat.channel = cumulet::Channel::temperature;
    heat.texture = solver_.heat();
    const std::array fields{smoke, heat};
    must(viewer_.dynamic_volume_set_gl(live_, {.fields = {fields.data(), fire_ ? 2U : 1U}, .name = "smoke"}));
  }

  /// Returns the projected center of mass of the last step's smoke in the image, 0 to 1, from the top left.
  [[nodiscard]] std::array<double, 2> middle_of_smoke(double aspect) {
    const auto n = static_cast<std::size_t>(voxels_);
    std::vector<float> values(n * n * n);
    glMemoryBarrier(GL_TEXTURE_UPDATE_BARRIER_BIT);
    glGetTextureImage(solver_.smoke(), 0, GL_RED, GL_FLOAT, GLsizei(values.size() * sizeof(float)), values.data());
    double mass = 0.0;
    Point sum{};
    for (std::size_t i = 0; i < values.size(); ++i) {
      const double value = values[i];
      mass += value;
      const std::array<std::size_t, 3> p{i % n, i / n % n, i / n / n};
      for (std::size_t axis = 0; axis < 3; ++axis) sum[axis] += value * (2.0 * (double(p[axis]) + 0.5) / voxels_ - 1.0);
    }
    const Seen seen = look(aspect);
    const auto along = [&](std::size_t row) {
      double value = seen.view[12 + row];
      for (std::size_t axis = 0; axis < 3; ++axis) value += seen.view[4 * axis + row] * sum[axis] / mass;
      return value;
    };
    return {0.5 + 0.5 * along(0) / seen.half_width / -along(2), 0.5 - 0.5 * along(1) / seen.half_height / -along(2)};
  }

 private:
  struct Seen {
    cumulet::Matrix view{};
    double half_width = 0.0;  // of the image at distance 1
    double half_height = 0.0;
  };
  [[nodiscard]] Seen look(double aspect) {
    const auto matrices =
        must(must(viewer_.get_camera()).get_matrices(aspect, cumulet::ClipSpace::negative_one_to_one));
    return {matrices.view, 1.0 / matrices.projection[0], 1.0 / matrices.projection[5]};
  }

  // Returns the mouse position on the plane through the box center that faces the camera, and its velocity there.
  Solver::Stir stir(const Mouse& mouse, double aspect) {
    const std::optional<Mouse> before = std::exchange(mouse_, mouse.stirs ? std::optional(mouse) : std::nullopt);
    if (!mouse.stirs) return {};
    const Seen seen = look(aspect);
    const double distance = -seen.view[14];
    Solver::Stir stir;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double right = seen.view[4 * axis] * seen.half_width * distance;
      const double up = seen.view[4 * axis + 1] * seen.half_height * distance;
      stir.at[axis] = 0.5 + 0.5 * ((2.0 * mouse.x - 1.0) * right + (1.0 - 2.0 * mouse.y) * up);
      if (!before) continue;
      constexpr double strength = 8.0;  // steps per second, times a drag factor
      const double moved = (mouse.x - before->x) * right - (mouse.y - before->y) * up;
      stir.push[axis] = strength * moved * voxels_;
    }
    return stir;
  }

  int voxels_;
  bool fire_;
  Solver solver_;
  std::optional<Mouse> mouse_;  // mouse state of the last frame while the button is pressed
  cumulet::DynamicVolume live_;
  cumulet::Viewer viewer_;
};

// ---- playback of a mouse record without a window ----

struct Moved {
  int frame = 0;
  Mouse mouse;
};

std::vector<Moved> read_mouse(const std::string& path) {
  std::ifstream file(path);
  std::vector<Moved> moves;
  Moved move;
  while (file >> move.frame >> move.mouse.x >> move.mouse.y >> move.mouse.stirs) moves.push_back(move);
  if (moves.empty() || !file.eof()) fail(path + ": not a mouse record");
  return moves;
}

void make_headless_context() {
  const auto query = reinterpret_cast<PFNEGLQUERYDEVICESEXTPROC>(eglGetProcAddress("eglQueryDevicesEXT"));
  std::array<EGLDeviceEXT, 16> devices{};
  EGLint count = 0;
  if (query == nullptr || query(EGLint(devices.size()), devices.data(), &count) == EGL_FALSE)
    fail("EGL has no devices");
  constexpr std::array<EGLint, 7> attributes = {
      EGL_CONTEXT_MAJOR_VERSION,           4,       EGL_CONTEXT_MINOR_VERSION, 5, EGL_CONTEXT_OPENGL_PROFILE_MASK,
      EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT, EGL_NONE};
  for (int i = 0; i < count; ++i) {
    EGLDisplay display = eglGetPlatformDisplay(EGL_PLATFORM_DEVICE_EXT, devices[std::size_t(i)], nullptr);
    if (eglInitialize(display, nullptr, nullptr) == EGL_FALSE || eglBindAPI(EGL_OPENGL_API) == EGL_FALSE) continue;
    EGLContext context = eglCreateContext(display, EGL_NO_CONFIG_KHR, EGL_NO_CONTEXT, attributes.data());
    if (context != EGL_NO_CONTEXT && eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, context) == EGL_TRUE)
      return;
  }
  fail("no EGL device has OpenGL 4.5 core");
}

void write_ppm(const std::string& path, const std::vector<std::uint8_t>& rgba, std::uint32_t width,
               std::uint32_t height) {
  std::FILE* file = std::fopen(path.c_str(), "wb");
  if (file == nullptr) fail(path + ": cannot be written");
  std::fprintf(file, "P6\n%u %u\n255\n", width, height);
  for (std::size_t i = 0; i < rgba.size(); i += 4) std::fwrite(&rgba[i], 1, 3, file);
  if (std::fclose(file) != 0) fail(path + ": cannot be written");
}

/// Plays a record: each frame simulates a step, passes its state and renders within a budget. Ends the program if a
/// check fails.
void play(const std::string& record, const std::string& folder, const Options& options) {
  make_headless_context();
  const std::vector<Moved> moves = read_mouse(record);
  constexpr std::uint32_t width = 240, height = 240;
  Host host([](const char* name) { return reinterpret_cast<void*>(eglGetProcAddress(name)); }, options, true);
  cumulet::Viewer& viewer = host.viewer();
  const cumulet::FrameDesc frame{
      .budget_ms = 30.0, .target = cumulet::FrameTarget::texture, .width = width, .height = height};
  Mouse mouse;
  std::size_t next = 0;
  std::uint64_t drawn = 0;
  const int frames = moves.back().frame + 1;
  const auto follow = [&] {
    const auto info = must(viewer.get_dynamic_volume_info());
    if (info.displayed_update < drawn) fail("an older state was drawn after a newer one");
    if (info.ready_count > info.displayed_count + 1) fail("a state was built and never drawn");
    drawn = info.displayed_update;
    return info;
  };
  for (int i = 0; i < frames; ++i) {
    for (; next < moves.size() && moves[next].frame <= i; ++next) mouse = moves[next].mouse;
    host.advance(mouse, 1.0);
    must(viewer.render(frame));
    follow();
  }
  // Returns true if no work is pending and the latest state is drawn.
  const auto rests = [&] {
    return must(viewer.render(frame)).has(cumulet::RenderFlags::converged) &&
           follow().displayed_update == follow().submitted_update;
  };
  for (int more = 0; !rests(); ++more) {
    if (more == 1000) fail("the newest state is never drawn");
  }
  const auto info = follow();
  std::printf("%d frames, %llu states, %llu drawn\n", frames, static_cast<unsigned long long>(info.submitted_update),
              static_cast<unsigned long long>(info.displayed_count));
  if (info.displayed_count * 20 < info.submitted_update) fail("too few states were drawn");

  // Checks that the image shows the latest state: the center of the smoke must agree.
  must(viewer.set_ground({}));
  must(viewer.set_sampling({.samples = 16, .preview = cumulet::Preview::off}));
  while (!must(viewer.render(frame)).has(cumulet::RenderFlags::converged)) {
  }
  std::vector<float> linear(std::size_t{4} * width * height);
  must(viewer.read_linear(linear));
  double mass = 0.0, x = 0.0, y = 0.0;
  for (std::size_t i = 0; i < std::size_t{width} * height; ++i) {
    // Uses the optical depth in front of the sky instead of the opacity, which saturates.
    const double depth = -std::log(1.0 - std::min(0.999, double{linear[4 * i + 3]}));
    mass += depth;
    x += depth * (double(i % width) + 0.5) / width;
    const std::size_t row = i / width;
    y += depth * (double(row) + 0.5) / height;
  }
  const auto expected = host.middle_of_smoke(1.0);
  std::printf("smoke at %.3f, %.3f; in the image at %.3f, %.3f\n", expected[0], expected[1], x / mass, y / mass);
  if (!(std::abs(x / mass - expected[0]) < 0.03 && std::abs(y / mass - expected[1]) < 0.03))
    fail("the image does not show the newest state");
  if (options.fire) {
    const auto by_red = [&](std::size_t a, std::size_t b) { return linear[4 * a] < linear[4 * b]; };
    std::size_t hottest = 0;
    for (std::size_t i = 0; i < std::size_t{width} * height; ++i) hottest = std::max(hottest, i, by_red);
    const float* color = &linear[4 * hottest];
    std::printf("hottest %.3f, %.3f, %.3f\n", double{color[0]}, double{color[1]}, double{color[2]});
    if (!(color[0] > 1.0F && color[0] > 3.0F * color[2])) fail("no emission is visible");
  }
  must(viewer.set_ground({.mode = cumulet::GroundMode::below}));
  while (!must(viewer.render(frame)).has(cumulet::RenderFlags::converged)) {
  }
  std::vector<std::uint8_t> picture(std::size_t{4} * width * height);
  must(viewer.read_display(picture));
  write_ppm(folder + "/smoke.ppm", picture, width, height);
}

// ---- in a window ----

Host& host_of(GLFWwindow* window) { return *static_cast<Host*>(glfwGetWindowUserPointer(window)); }

Mouse mouse_of(GLFWwindow* window) {
  int width = 0, height = 0;
  Mouse mouse;
  glfwGetCursorPos(window, &mouse.x, &mouse.y);
  glfwGetWindowSize(window, &width, &height);
  mouse.x /= std::max(width, 1);
  mouse.y /= std::max(height, 1);
  mouse.stirs = glfwGetMouseButton(window, GLFW_MOUSE_BUTTON_LEFT) == GLFW_PRESS;
  return mouse;
}

/// Passes camera input to the viewer. The right button orbits, because the left one stirs.
void feed(GLFWwindow* window, cumulet::Event event) {
  int width = 0, height = 0;
  glfwGetFramebufferSize(window, &width, &height);
  const Mouse mouse = mouse_of(window);
  event.x = mouse.x * width;
  event.y = mouse.y * height;
  must(host_of(window).viewer().input(event));
}

void on_button(GLFWwindow* window, int button, int action, int) {
  if (button == GLFW_MOUSE_BUTTON_LEFT || button > GLFW_MOUSE_BUTTON_MIDDLE) return;
  feed(window, {.type = action == GLFW_PRESS ? cumulet::EventType::button_down : cumulet::EventType::button_up,
                .button = button == GLFW_MOUSE_BUTTON_RIGHT ? cumulet::Button::left : cumulet::Button::middle});
}

void run(GLFWwindow* window, Host& host, const std::string& record) {
  glfwSetWindowUserPointer(window, &host);
  glfwSetMouseButtonCallback(window, on_button);
  glfwSetCursorPosCallback(window,
                           [](GLFWwindow* w, double, double) { feed(w, {.type = cumulet::EventType::pointer_move}); });
  glfwSetScrollCallback(window, [](GLFWwindow* w, double, double steps) {
    feed(w, {.type = cumulet::EventType::wheel, .wheel = steps});
  });
  glfwSetKeyCallback(window, [](GLFWwindow* w, int key, int, int, int) {
    if (key == GLFW_KEY_ESCAPE) glfwSetWindowShouldClose(w, GLFW_TRUE);
  });
  std::ofstream file;
  if (!record.empty()) file.open(record);
  Mouse last;
  for (int i = 0; glfwWindowShouldClose(window) == GLFW_FALSE; ++i) {
    int width = 0, height = 0;
    glfwGetFramebufferSize(window, &width, &height);
    const Mouse mouse = mouse_of(window);
    if (file && (mouse.x != last.x || mouse.y != last.y || mouse.stirs != last.stirs))
      file << i << ' ' << mouse.x << ' ' << mouse.y << ' ' << mouse.stirs << '\n';
    last = mouse;
    host.advance(mouse, height > 0 ? double(width) / height : 1.0);
    must(host.viewer().render(
        {.budget_ms = 12.0, .width = static_cast<std::uint32_t>(width), .height = static_cast<std::uint32_t>(height)}));
    glfwSwapBuffers(window);
    glfwPollEvents();
  }
}

}  // namespace

int main(int argc, char** argv) {
  std::string record, mouse, folder;
  Options options;
  std::string built = "cpu";
  std::string fire = "off";
  for (int i = 1; i + 1 < argc; i += 2) {
    if (std::strcmp(argv[i], "--record") == 0) record = argv[i + 1];
    if (std::strcmp(argv[i], "--mouse") == 0) mouse = argv[i + 1];
    if (std::strcmp(argv[i], "--test") == 0) folder = argv[i + 1];
    if (std::strcmp(argv[i], "--voxels") == 0) options.voxels = std::atoi(argv[i + 1]);
    if (std::strcmp(argv[i], "--build-device") == 0) built = argv[i + 1];
    if (std::strcmp(argv[i], "--fire") == 0) fire = argv[i + 1];
  }
  options.build = built == "gpu" ? cumulet::BuildDevice::gpu : cumulet::BuildDevice::cpu;
  options.fire = fire == "on";
  if (argc % 2 == 0 || (built != "cpu" && built != "gpu") || (fire != "on" && fire != "off") ||
      folder.empty() != mouse.empty() || options.voxels < 8 || options.voxels > 256)
    fail(
        "usage: cumulet-embed-smoke [--voxels 8..256] [--build-device cpu|gpu] [--fire on|off] [--record FILE | "
        "--mouse FILE "
        "--test OUT_DIR]");
  if (!folder.empty()) {
    play(mouse, folder, options);
    return 0;
  }
  if (glfwInit() == GLFW_FALSE) fail("GLFW finds no display");
  glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 4);
  glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 5);
  glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
  GLFWwindow* window = glfwCreateWindow(900, 900, "Cumulet: live smoke", nullptr, nullptr);
  if (window == nullptr) fail("no window with OpenGL 4.5");
  glfwMakeContextCurrent(window);
  {
    Host host(glfwGetProcAddress, options, false);
    run(window, host, record);
  }
  glfwDestroyWindow(window);
  glfwTerminate();
  return 0;
}
