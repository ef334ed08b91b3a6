#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "input.hpp"

struct GLFWwindow;
struct ImGuiContext;

namespace cumulet::demo {

/// The program's window: GLFW, an OpenGL 4.5 context that is current on this thread, and Dear ImGui. All coordinates
/// are in framebuffer pixels.
class Window {
  struct DestroyWindow {
    void operator()(GLFWwindow* window) const;
  };

 public:
  using Context = std::unique_ptr<GLFWwindow, DestroyWindow>;

  /// width, height: in framebuffer pixels. Throws std::runtime_error, one line, without a display or OpenGL 4.5.
  Window(int width, int height);
  Window(const Window&) = delete;
  Window& operator=(const Window&) = delete;
  ~Window();

  [[nodiscard]] std::pair<int, int> size() const;
  void resize(int width, int height);
  /// Returns the name by which the desktop's portal knows the window; "" if it has none.
  [[nodiscard]] std::string portal_name() const;
  void set_title(const std::string& title);
  /// Returns the user interface scale for this screen; 1 on an ordinary screen.
  [[nodiscard]] float content_scale() const;

  /// Processes events. Sleeps until the next event, but not longer than `seconds` (may be infinity).
  static void wait(double seconds);
  /// Ends a wait. Any thread.
  static void wake();
  [[nodiscard]] Input& input() { return input_; }

  /// Sets theme and fonts for a scale.
  static void set_ui_scale(float scale);
  /// Starts ImGui's frame with these events. frame_seconds: time step; 0: real time.
  void begin_frame(const std::vector<Event>& events, double frame_seconds);
  /// Ends ImGui's frame. Returns true if it differs from the last drawn one, or if the window system has lost the
  /// window's content. Changes of texture contents are not detected.
  [[nodiscard]] bool ui_changed();
  /// Draws ImGui's frame and stores it for the comparison.
  void draw_ui();
  void swap();

  /// Creates a context for another thread that shares objects with the window's. Create and destroy it in this thread
  /// during the window's lifetime. Throws std::runtime_error, one line.
  [[nodiscard]] Context make_shared_context() const { return make_hidden(window_.get()); }
  /// Creates a context as make_shared_context(), but one that shares no objects.
  [[nodiscard]] static Context make_context() { return make_hidden(nullptr); }
  /// Makes a context current in the calling thread; null releases it.
  static void make_current(GLFWwindow* context);
  /// Returns the address of a GL function, for cumulet.h and glad.
  static void* get_proc(void* user, const char* name);

 private:
  struct Terminate {
    Terminate();
    Terminate(const Terminate&) = delete;
    Terminate& operator=(const Terminate&) = delete;
    ~Terminate();
  };
  void listen();
  [[nodiscard]] static Context make_hidden(GLFWwindow* shared_with);
  [[nodiscard]] std::pair<double, double> pixels_per_unit() const;

  Terminate glfw_;
  Context window_;
  Input input_;
  std::string title_;
  std::vector<std::byte> drawn_ui_;
  std::vector<std::byte> ui_;
  bool damaged_ = true;  // the window's content is lost
};

}  // namespace cumulet::demo
