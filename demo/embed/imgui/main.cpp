// Cumulet in two Dear ImGui panels: as a separate image, and composited into a scene that the host draws with its own
// shaders and depth buffer. The volume casts a shadow on the scene. Both viewers share one volume and one camera.
//
//     cumulet-embed-imgui --volume FILE [--test OUT_DIR]
//
// Escape quits, P writes a screenshot imgui-N.ppm (to OUT_DIR or the current folder) when both images have all samples.
// --test: a small window with few samples.
#include <cumulet/cumulet.hpp>

#define GL_GLEXT_PROTOTYPES
#include <GL/glcorearb.h>
#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <imgui.h>

#include <backends/imgui_impl_glfw.h>
#include <backends/imgui_impl_opengl3.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace {

[[noreturn]] void fail(const std::string& cause) {
  std::fprintf(stderr, "cumulet-embed-imgui: %s\n", cause.c_str());
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

ImTextureID image_of(GLuint texture) {
  return reinterpret_cast<ImTextureID>(std::uintptr_t{texture});  // NOLINT(performance-no-int-to-ptr): ImGui's way
}

// ---- The host's own scene: boxes ----------------------------------------------------------------------------------

constexpr const char* box_vertex = R"(#version 450 core
uniform mat4 to_clip;
uniform vec3 low, high;
out vec3 position;
flat out vec3 normal;
void main() {
  int face = gl_VertexID / 6, axis = face >> 1;
  float side = float(face & 1);
  vec2 corner = vec2[](vec2(0, 0), vec2(1, 0), vec2(1, 1), vec2(0, 0), vec2(1, 1), vec2(0, 1))[gl_VertexID % 6];
  vec3 p = vec3(0), n = vec3(0);
  p[axis] = side;
  p[(axis + 1) % 3] = corner.x;
  p[(axis + 2) % 3] = corner.y;
  n[axis] = side * 2 - 1;
  position = mix(low, high, p);
  normal = n;
  gl_Position = to_clip * vec4(position, 1);
})";

// cumulet_transmittance() of cumulet::transmittance_map_glsl() is inserted between the next two strings.
constexpr const char* fragment_version = "#version 450 core\n";
constexpr const char* box_fragment = R"(
uniform vec3 colour;
uniform float tile;
uniform vec3 to_sun;
uniform sampler3D shadow_map;
uniform mat4 to_shadow_map;
in vec3 position;
flat in vec3 normal;
out vec4 result;
void main() {
  vec2 square = floor(position.xz / max(tile, 1e-6));
  float check = tile > 0 ? 0.6 + 0.4 * mod(square.x + square.y, 2) : 1;
  float sun = max(dot(normal, to_sun), 0) * cumulet_transmittance(shadow_map, to_shadow_map, vec2(0), position);
  result = vec4(colour * check * (0.35 + 0.75 * sun), 1);
})";

GLuint make_program() {
  const GLuint program = glCreateProgram();
  const std::array<const char*, 1> vertex{box_vertex};
  const std::array<const char*, 3> fragment{fragment_version, cumulet::transmittance_map_glsl(), box_fragment};
  using Sources = std::span<const char* const>;
  for (const auto& [type, sources] :
       {std::pair<GLenum, Sources>(GL_VERTEX_SHADER, vertex), {GL_FRAGMENT_SHADER, fragment}}) {
    const GLuint shader = glCreateShader(type);
    glShaderSource(shader, static_cast<GLsizei>(sources.size()), sources.data(), nullptr);
    glCompileShader(shader);
    glAttachShader(program, shader);
    glDeleteShader(shader);
  }
  glLinkProgram(program);
  GLint linked = 0;
  glGetProgramiv(program, GL_LINK_STATUS, &linked);
  if (linked == 0) fail("the scene's shaders failed to compile");
  return program;
}

cumulet::Matrix multiply(const cumulet::Matrix& a, const cumulet::Matrix& b) {
  cumulet::Matrix product{};
  for (std::size_t column = 0; column < 4; ++column)
    for (std::size_t row = 0; row < 4; ++row)
      for (std::size_t k = 0; k < 4; ++k) product[column * 4 + row] += a[k * 4 + row] * b[column * 4 + k];
  return product;
}

/// A framebuffer with color and depth textures, recreated when the panel's size changes.
struct SceneTarget {
  int width = 0, height = 0;
  GLuint framebuffer = 0, color = 0, depth = 0;

  void release() {
    glDeleteFramebuffers(1, &framebuffer);
    glDeleteTextures(1, &color);
    glDeleteTextures(1, &depth);
  }
  void resize(int w, int h) {
    if (w == width && h == height) return;
    release();
    width = w, height = h;
    glCreateTextures(GL_TEXTURE_2D, 1, &color);
    glTextureStorage2D(color, 1, GL_RGBA8, w, h);
    glCreateTextures(GL_TEXTURE_2D, 1, &depth);
    glTextureStorage2D(depth, 1, GL_DEPTH_COMPONENT32F, w, h);
    glCreateFramebuffers(1, &framebuffer);
    glNamedFramebufferTexture(framebuffer, GL_COLOR_ATTACHMENT0, color, 0);
    glNamedFramebufferTexture(framebuffer, GL_DEPTH_ATTACHMENT, depth, 0);
  }
};

// Azimuth 60 degrees from +Z, elevation 40 degrees, same as the viewers' sun.
constexpr std::array<float, 3> to_sun{0.6634F, 0.6428F, 0.3830F};

/// Draws the sky, a checkered ground below the volume's bounding box, and three cubes: in front of the volume, half
/// inside, and behind.
void draw_scene(const SceneTarget& target, GLuint program, GLuint vertex_array, const cumulet::Matrix& to_clip,
                const cumulet::Bounds& bounds, const cumulet::TransmittanceMap& shadow) {
  glBindFramebuffer(GL_FRAMEBUFFER, target.framebuffer);
  glViewport(0, 0, target.width, target.height);
  glDisable(GL_SCISSOR_TEST);
  glDisable(GL_BLEND);
  glEnable(GL_DEPTH_TEST);
  glDepthMask(GL_TRUE);
  const std::array<float, 4> sky{0.55F, 0.66F, 0.8F, 1.0F};
  const float far_depth = 1.0F;
  glClearBufferfv(GL_COLOR, 0, sky.data());
  glClearBufferfv(GL_DEPTH, 0, &far_depth);

  std::array<float, 3> centre{}, size{};
  for (std::size_t i = 0; i < 3; ++i) {
    centre[i] = static_cast<float>(0.5 * (bounds.min[i] + bounds.max[i]));
    size[i] = static_cast<float>(bounds.max[i] - bounds.min[i]);
  }
  glUseProgram(program);
  glBindVertexArray(vertex_array);
  const auto set_matrix = [&](const char* name, const cumulet::Matrix& values) {
    std::array<float, 16> matrix{};
    std::transform(values.begin(), values.end(), matrix.begin(), [](double v) { return static_cast<float>(v); });
    glUniformMatrix4fv(glGetUniformLocation(program, name), 1, GL_FALSE, matrix.data());
  };
  set_matrix("to_clip", to_clip);
  set_matrix("to_shadow_map", shadow.to_map);
  glUniform3fv(glGetUniformLocation(program, "to_sun"), 1, to_sun.data());
  glBindTextureUnit(0, shadow.texture);
  const auto box = [&](float x, float y, float z, float rx, float ry, float rz, const std::array<float, 3>& color,
                       float tile) {
    glUniform3f(glGetUniformLocation(program, "low"), x - rx, y - ry, z - rz);
    glUniform3f(glGetUniformLocation(program, "high"), x + rx, y + ry, z + rz);
    glUniform3fv(glGetUniformLocation(program, "colour"), 1, color.data());
    glUniform1f(glGetUniformLocation(program, "tile"), tile);
    glDrawArrays(GL_TRIANGLES, 0, 36);
  };
  const float ground = static_cast<float>(bounds.min[1]) - 0.15F * size[1];
  const float side = 0.13F * std::max({size[0], size[1], size[2]});
  box(centre[0], ground, centre[2], 1.5F * size[0], 0.01F * size[1], 1.5F * size[2], {0.7F, 0.7F, 0.66F}, side);
  const auto cube = [&](float x, float y, float z, const std::array<float, 3>& color) {
    box(centre[0] + x * size[0], centre[1] + y * size[1], centre[2] + z * size[2], side, side, side, color, 0.0F);
  };
  cube(-0.25F, -0.25F, 0.75F, {0.9F, 0.25F, 0.2F});
  cube(0.2F, 0.1F, 0.3F, {0.95F, 0.75F, 0.2F});
  cube(0.0F, 0.0F, -0.8F, {0.2F, 0.4F, 0.9F});
}

// ---- Panels -------------------------------------------------------------------------------------------------------

/// Forwards ImGui's mouse input over the last item, and keys while the panel has the focus.
void forward_input(cumulet::Viewer& viewer, const ImVec2& origin, float scale) {
  const ImGuiIO& io = ImGui::GetIO();
  const auto modifiers = (io.KeyShift ? cumulet::Modifiers::shift : cumulet::Modifiers::none) |
                         (io.KeyCtrl ? cumulet::Modifiers::ctrl : cumulet::Modifiers::none) |
                         (io.KeyAlt ? cumulet::Modifiers::alt : cumulet::Modifiers::none);
  const auto feed = [&](cumulet::Event event) {
    event.x = (io.MousePos.x - origin.x) * scale;
    event.y = (io.MousePos.y - origin.y) * scale;
    event.modifiers = modifiers;
    must(viewer.input(event));
  };
  if (ImGui::IsItemHovered() || ImGui::IsItemActive()) {
    if (io.MouseDelta.x != 0.0F || io.MouseDelta.y != 0.0F) feed({.type = cumulet::EventType::pointer_move});
    if (io.MouseWheel != 0.0F) feed({.type = cumulet::EventType::wheel, .wheel = io.MouseWheel});
  }
  constexpr std::array buttons{std::pair(ImGuiMouseButton_Left, cumulet::Button::left),
                               std::pair(ImGuiMouseButton_Middle, cumulet::Button::middle),
                               std::pair(ImGuiMouseButton_Right, cumulet::Button::right)};
  for (const auto& [imgui_button, button] : buttons) {
    if (ImGui::IsItemHovered() && ImGui::IsMouseClicked(imgui_button))
      feed({.type = cumulet::EventType::button_down, .button = button});
    if (ImGui::IsMouseReleased(imgui_button)) feed({.type = cumulet::EventType::button_up, .button = button});
  }
  const int home = ImGui::GetKeyIndex(ImGuiKey_Home);
  if (ImGui::IsWindowFocused() && ImGui::IsKeyPressed(home, false))
    feed({.type = cumulet::EventType::key_down, .key = cumulet::Key::home});
  if (ImGui::IsKeyReleased(home)) feed({.type = cumulet::EventType::key_up, .key = cumulet::Key::home});
}

/// Lays out an image that fills the panel. show() draws its texture and may be called after rendering.
struct Panel {
  ImVec2 low, high;
  int width = 0, height = 0;  // in physical pixels

  explicit Panel(cumulet::Viewer& viewer) {
    const float scale = ImGui::GetIO().DisplayFramebufferScale.x;
    const ImVec2 room = ImGui::GetContentRegionAvail();
    const ImVec2 size(std::max(room.x, 1.0F), std::max(room.y, 1.0F));
    low = ImGui::GetCursorScreenPos();
    high = ImVec2(low.x + size.x, low.y + size.y);
    width = static_cast<int>(size.x * scale);
    height = static_cast<int>(size.y * scale);
    ImGui::InvisibleButton(
        "picture", size,
        ImGuiButtonFlags_MouseButtonLeft | ImGuiButtonFlags_MouseButtonMiddle | ImGuiButtonFlags_MouseButtonRight);
    forward_input(viewer, low, scale);
  }
  void show(GLuint texture, bool top_row_first) const {
    const float top = top_row_first ? 0.0F : 1.0F;
    if (texture != 0)
      ImGui::GetWindowDrawList()->AddImage(image_of(texture), low, high, ImVec2(0, top), ImVec2(1, 1.0F - top));
  }
};

void write_picture(const std::string& path, int width, int height) {
  const std::size_t row = std::size_t(width) * 3;
  std::vector<unsigned char> pixels(row * std::size_t(height));
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glReadPixels(0, 0, width, height, GL_RGB, GL_UNSIGNED_BYTE, pixels.data());
  std::FILE* file = std::fopen(path.c_str(), "wb");
  if (file == nullptr) fail(path + ": cannot be written");
  std::fprintf(file, "P6\n%d %d\n255\n", width, height);
  for (std::size_t end = pixels.size(); end > 0; end -= row) std::fwrite(&pixels[end - row], 1, row, file);
  std::fclose(file);
}

cumulet::Viewer make_viewer(cumulet::Background background, bool test) {
  auto viewer = must(cumulet::Viewer::create({.get_proc = glfwGetProcAddress, .update = [] { glfwPostEmptyEvent(); }}));
  must(viewer.set_sun_sky({.sun_azimuth_degrees = 60.0F,
                           .sun_elevation_degrees = 40.0F,
                           .sun_irradiance = {2.6F, 2.5F, 2.3F},
                           .sky_radiance = {0.2F, 0.3F, 0.5F}}));
  must(viewer.set_sampling({.samples = test ? 2U : 0U}));
  must(viewer.set_display({.background = background}));
  return viewer;
}

/// First panel: the viewer renders into its own texture.
cumulet::FrameResult show_image(cumulet::Viewer& viewer, const ImVec2& room, ImGuiCond condition) {
  cumulet::FrameResult image;
  ImGui::SetNextWindowPos(ImVec2(room.x * 0.01F, room.y * 0.02F), condition);
  ImGui::SetNextWindowSize(ImVec2(room.x * 0.48F, room.y * 0.96F), condition);
  if (ImGui::Begin("Viewer")) {
    const cumulet::Progress progress = must(viewer.get_progress());
    if (!progress.message.empty()) ImGui::TextWrapped("%s", progress.message.c_str());
    if (progress.stage != cumulet::Stage::idle) ImGui::ProgressBar(static_cast<float>(progress.fraction));
    const Panel panel(viewer);
    image = must(viewer.render({.target = cumulet::FrameTarget::texture,
                                .width = static_cast<std::uint32_t>(panel.width),
                                .height = static_cast<std::uint32_t>(panel.height),
                                .flip_y = true}));
    panel.show(image.texture, true);
  }
  ImGui::End();
  return image;
}

/// Runs the frame loop until the window is closed.
void run(GLFWwindow* window, const std::string& volume_path, const std::string& folder, bool test) {
  cumulet::Viewer image_viewer = make_viewer(cumulet::Background::sky, test);
  cumulet::Viewer scene_viewer = make_viewer(cumulet::Background::transparent, test);
  cumulet::Camera camera = must(image_viewer.get_camera());
  must(scene_viewer.set_camera(camera));
  must(image_viewer.load_volume(volume_path));

  SceneTarget target;
  const GLuint program = make_program();
  GLuint vertex_array = 0;
  glCreateVertexArrays(1, &vertex_array);

  cumulet::TransmittanceMap shadow = must(scene_viewer.update_transmittance_map({}));
  bool volume_shared = false, picture_wanted = false, p_was_down = false;
  int pictures = 0;
  ImVec2 last_room;
  while (glfwWindowShouldClose(window) == GLFW_FALSE && glfwGetKey(window, GLFW_KEY_ESCAPE) != GLFW_PRESS) {
    ImGui_ImplOpenGL3_NewFrame();
    ImGui_ImplGlfw_NewFrame();
    ImGui::NewFrame();
    const ImVec2 room = ImGui::GetIO().DisplaySize;
    const ImGuiCond condition = room.x != last_room.x || room.y != last_room.y ? ImGuiCond_Always : ImGuiCond_Once;
    last_room = room;
    const cumulet::FrameResult image = show_image(image_viewer, room, condition);
    cumulet::FrameResult scene;

    if (!volume_shared) {  // when it is loaded
      const cumulet::Volume volume = must(image_viewer.get_volume());
      if (volume) must(scene_viewer.set_volume(volume));
      volume_shared = static_cast<bool>(volume);
    }

    // Second panel: the host draws its scene, then the viewer draws the volume over it, clipped by the scene's depth.
    ImGui::SetNextWindowPos(ImVec2(room.x * 0.51F, room.y * 0.02F), condition);
    ImGui::SetNextWindowSize(ImVec2(room.x * 0.48F, room.y * 0.96F), condition);
    if (ImGui::Begin("Scene") && volume_shared) {
      const Panel panel(scene_viewer);
      target.resize(panel.width, panel.height);
      const auto [view, projection] =
          must(camera.get_matrices(double(panel.width) / panel.height, cumulet::ClipSpace::negative_one_to_one));
      draw_scene(target, program, vertex_array, multiply(projection, view), must(scene_viewer.get_bounds()), shadow);
      scene = must(scene_viewer.render({.framebuffer = target.framebuffer,
                                        .width = static_cast<std::uint32_t>(panel.width),
                                        .height = static_cast<std::uint32_t>(panel.height),
                                        .depth_source = cumulet::DepthSource::texture,
                                        .depth_name = target.depth}));
      panel.show(target.color, false);
      // The map contains the data uploaded by render(), and is used for the scene of the next frame.
      shadow = must(scene_viewer.update_transmittance_map({}));
    }
    ImGui::End();

    ImGui::Render();
    int width = 0, height = 0;
    glfwGetFramebufferSize(window, &width, &height);
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    glViewport(0, 0, width, height);
    glClear(GL_COLOR_BUFFER_BIT);
    ImGui_ImplOpenGL3_RenderDrawData(ImGui::GetDrawData());
    const bool p_down = glfwGetKey(window, GLFW_KEY_P) == GLFW_PRESS;
    picture_wanted = picture_wanted || (p_down && !p_was_down);
    p_was_down = p_down;
    if (picture_wanted && image.has(cumulet::RenderFlags::converged) && scene.has(cumulet::RenderFlags::converged) &&
        !shadow.incomplete) {
      write_picture(folder + "/imgui-" + std::to_string(++pictures) + ".ppm", width, height);
      picture_wanted = false;
    }
    glfwSwapBuffers(window);
    if (image.has(cumulet::RenderFlags::incomplete) || scene.has(cumulet::RenderFlags::incomplete) ||
        shadow.incomplete || picture_wanted) {
      glfwPollEvents();
    } else {
      glfwWaitEventsTimeout(0.1);
    }
  }
  target.release();
  glDeleteVertexArrays(1, &vertex_array);
  glDeleteProgram(program);
}

}  // namespace

int main(int argc, char** argv) {
  std::string volume_path, folder = ".";
  bool test = false;
  for (int i = 1; i + 1 < argc; i += 2) {
    if (std::string(argv[i]) == "--volume") volume_path = argv[i + 1];
    if (std::string(argv[i]) == "--test") folder = argv[i + 1], test = true;
  }
  if (volume_path.empty()) fail("usage: cumulet-embed-imgui --volume FILE [--test OUT_DIR]");

  if (glfwInit() == GLFW_FALSE) fail("GLFW finds no display");
  glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 4);
  glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 5);
  glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
  const int start_width = test ? 480 : 1280, start_height = test ? 240 : 640;
  GLFWwindow* window = glfwCreateWindow(start_width, start_height, "Cumulet in Dear ImGui", nullptr, nullptr);
  if (window == nullptr) fail("no window with OpenGL 4.5");
  glfwMakeContextCurrent(window);
  glfwSwapInterval(1);
  glfwSetInputMode(window, GLFW_STICKY_KEYS, GLFW_TRUE);  // so that a press between two frames is detected
  ImGui::CreateContext();
  ImGui::GetIO().IniFilename = nullptr;
  ImGui_ImplGlfw_InitForOpenGL(window, true);
  ImGui_ImplOpenGL3_Init("#version 450");

  run(window, volume_path, folder, test);
  ImGui_ImplOpenGL3_Shutdown();
  ImGui_ImplGlfw_Shutdown();
  ImGui::DestroyContext();
  glfwDestroyWindow(window);
  glfwTerminate();
  return 0;
}
