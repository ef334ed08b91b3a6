// Cumulet in a GLFW window: mouse and keys are passed to the viewer, and frames are drawn while there is something new.
//
//     cumulet-embed-glfw --volume FILE [--test OUT_DIR]
//
// F frames all, Escape quits, P writes glfw-N.ppm (to OUT_DIR or the current folder) when the image has all samples.
// --test: a small window with few samples.
#include <cumulet/cumulet.hpp>

#define GL_GLEXT_PROTOTYPES
#include <GL/glcorearb.h>
#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <utility>
#include <vector>

namespace {

[[noreturn]] void fail(const std::string& cause) {
  std::fprintf(stderr, "cumulet-embed-glfw: %s\n", cause.c_str());
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

struct Host {
  cumulet::Viewer viewer;
  std::string folder = ".";
  bool picture_wanted = false;
  int pictures = 0;
};

Host& host_of(GLFWwindow* window) { return *static_cast<Host*>(glfwGetWindowUserPointer(window)); }

cumulet::Key key_of(int key) {
  if (key >= GLFW_KEY_0 && key <= GLFW_KEY_Z) return cumulet::Key{key};
  if (key >= GLFW_KEY_KP_0 && key <= GLFW_KEY_KP_9) return cumulet::Key{CUMULET_KEY_KEYPAD_0 + key - GLFW_KEY_KP_0};
  switch (key) {
    case GLFW_KEY_HOME:
      return cumulet::Key::home;
    case GLFW_KEY_LEFT:
      return cumulet::Key::left;
    case GLFW_KEY_RIGHT:
      return cumulet::Key::right;
    case GLFW_KEY_UP:
      return cumulet::Key::up;
    case GLFW_KEY_DOWN:
      return cumulet::Key::down;
    default:
      return cumulet::Key::none;
  }
}

/// Adds the modifiers and the pointer position in physical pixels.
void feed(GLFWwindow* window, cumulet::Event event) {
  int width = 0, height = 0, pixels_x = 0, pixels_y = 0;
  double x = 0.0, y = 0.0;
  glfwGetCursorPos(window, &x, &y);
  glfwGetWindowSize(window, &width, &height);
  glfwGetFramebufferSize(window, &pixels_x, &pixels_y);
  event.x = x * pixels_x / std::max(width, 1);
  event.y = y * pixels_y / std::max(height, 1);
  const auto held = [window](int left, int right, cumulet::Modifiers modifier) {
    const bool down = glfwGetKey(window, left) == GLFW_PRESS || glfwGetKey(window, right) == GLFW_PRESS;
    return down ? modifier : cumulet::Modifiers::none;
  };
  event.modifiers = held(GLFW_KEY_LEFT_SHIFT, GLFW_KEY_RIGHT_SHIFT, cumulet::Modifiers::shift) |
                    held(GLFW_KEY_LEFT_CONTROL, GLFW_KEY_RIGHT_CONTROL, cumulet::Modifiers::ctrl) |
                    held(GLFW_KEY_LEFT_ALT, GLFW_KEY_RIGHT_ALT, cumulet::Modifiers::alt);
  must(host_of(window).viewer.input(event));
}

void on_button(GLFWwindow* window, int button, int action, int) {
  if (button > GLFW_MOUSE_BUTTON_MIDDLE) return;
  feed(window, {.type = action == GLFW_PRESS ? cumulet::EventType::button_down : cumulet::EventType::button_up,
                .button = button == GLFW_MOUSE_BUTTON_LEFT    ? cumulet::Button::left
                          : button == GLFW_MOUSE_BUTTON_RIGHT ? cumulet::Button::right
                                                              : cumulet::Button::middle});
}

void on_key(GLFWwindow* window, int key, int, int action, int) {
  if (action == GLFW_REPEAT) return;
  if (key == GLFW_KEY_ESCAPE) glfwSetWindowShouldClose(window, GLFW_TRUE);
  if (key == GLFW_KEY_P && action == GLFW_PRESS) host_of(window).picture_wanted = true;
  feed(window,
       {.type = action == GLFW_PRESS ? cumulet::EventType::key_down : cumulet::EventType::key_up, .key = key_of(key)});
}

void write_picture(Host& host, int width, int height) {
  const std::string path = host.folder + "/glfw-" + std::to_string(++host.pictures) + ".ppm";
  const std::size_t row = std::size_t(width) * 3;
  std::vector<unsigned char> pixels(row * std::size_t(height));
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glReadPixels(0, 0, width, height, GL_RGB, GL_UNSIGNED_BYTE, pixels.data());
  std::FILE* file = std::fopen(path.c_str(), "wb");
  if (file == nullptr) fail(path + ": cannot be written");
  std::fprintf(file, "P6\n%d %d\n255\n", width, height);
  for (std::size_t end = pixels.size(); end > 0; end -= row) std::fwrite(&pixels[end - row], 1, row, file);
  std::fclose(file);
  host.picture_wanted = false;
}

void run(GLFWwindow* window, Host& host, const std::string& volume, bool test) {
  host.viewer =
      must(cumulet::Viewer::create({.get_proc = glfwGetProcAddress,
                                    .update = [] { glfwPostEmptyEvent(); },  // from any thread: wakes the loop
                                    .gl_state = cumulet::GlStatePolicy::host_resets}));
  must(host.viewer.set_sun_sky({.sun_azimuth_degrees = 60.0F,
                                .sun_elevation_degrees = 40.0F,
                                .sun_irradiance = {2.6F, 2.5F, 2.3F},
                                .sky_radiance = {0.2F, 0.3F, 0.5F}}));
  must(host.viewer.set_sampling({.samples = test ? 4U : 0U}));
  must(host.viewer.load_volume(volume));

  glfwSetWindowUserPointer(window, &host);
  glfwSetMouseButtonCallback(window, on_button);
  glfwSetKeyCallback(window, on_key);
  glfwSetCursorPosCallback(window,
                           [](GLFWwindow* w, double, double) { feed(w, {.type = cumulet::EventType::pointer_move}); });
  glfwSetScrollCallback(window, [](GLFWwindow* w, double, double steps) {
    feed(w, {.type = cumulet::EventType::wheel, .wheel = steps});
  });
  glfwSetWindowFocusCallback(window, [](GLFWwindow* w, int focused) {
    if (focused == GLFW_FALSE) feed(w, {.type = cumulet::EventType::focus_lost});
  });

  while (glfwWindowShouldClose(window) == GLFW_FALSE) {
    int width = 0, height = 0;
    float scale = 1.0F;
    glfwGetFramebufferSize(window, &width, &height);
    glfwGetWindowContentScale(window, &scale, nullptr);
    glDisable(GL_SCISSOR_TEST);  // GlStatePolicy::host_resets: the host sets all state that it uses
    glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    glClear(GL_COLOR_BUFFER_BIT);
    const cumulet::FrameResult frame = must(host.viewer.render({.budget_ms = 15.0,
                                                                .width = static_cast<std::uint32_t>(width),
                                                                .height = static_cast<std::uint32_t>(height),
                                                                .scale = scale}));
    if (frame.has(cumulet::RenderFlags::failed)) fail(must(host.viewer.get_progress()).message.c_str());
    if (host.picture_wanted && frame.has(cumulet::RenderFlags::converged)) {
      glBindFramebuffer(GL_READ_FRAMEBUFFER, 0);
      write_picture(host, width, height);
    }
    glfwSwapBuffers(window);
    if (frame.has(cumulet::RenderFlags::incomplete)) {
      glfwPollEvents();
    } else {
      glfwWaitEvents();
    }
  }
  host.viewer = {};  // destroyed while the context exists
}

}  // namespace

int main(int argc, char** argv) {
  Host host;
  std::string volume;
  bool test = false;
  for (int i = 1; i + 1 < argc; i += 2) {
    if (std::string(argv[i]) == "--volume") volume = argv[i + 1];
    if (std::string(argv[i]) == "--test") host.folder = argv[i + 1], test = true;
  }
  if (volume.empty()) fail("usage: cumulet-embed-glfw --volume FILE [--test OUT_DIR]");

  if (glfwInit() == GLFW_FALSE) fail("GLFW finds no display");
  glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 4);
  glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 5);
  glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
  GLFWwindow* window = glfwCreateWindow(test ? 240 : 1280, test ? 180 : 800, "Cumulet in GLFW", nullptr, nullptr);
  if (window == nullptr) fail("no window with OpenGL 4.5");
  glfwMakeContextCurrent(window);
  run(window, host, volume, test);
  glfwDestroyWindow(window);
  glfwTerminate();
  return 0;
}
