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

/// The one window: GLFW, an OpenGL 4.5 context current on this thread, and Dear ImGui in it. Everything is in
/// framebuffer pixels.
class Window {
  struct DestroyWindow {
    void operator()(GLFWwindow* window) const;
  };

 public:
  using Context = std::unique_ptr<GLFWwindow, DestroyWindow>;

  /// width and height in framebuffer pixels. Throws std::runtime_error, one line, without a display or OpenGL 4.5.
  Window(int width, int height);
  Window(const Window&) = delete;
  Window& operator=(const Window&) = delete;
  ~Window();

  [[nodiscard]] bool should_close() const;
  [[nodiscard]] std::pair<int, int> size() const;
  void resize(int width, int height);
  void set_title(const std::string& title);
  /// How much larger than on an ordinary screen things are to be drawn.
  [[nodiscard]] float content_scale() const;

  /// Takes what has happened; sleeps until something happens, for at most so many seconds (infinity: for ever).
  static void wait(double seconds);
  /// Ends a wait. From any thread.
  static void wake();
  [[nodiscard]] Input& input() { return input_; }

  /// The theme and the fonts for this scale.
  static void set_ui_scale(float scale);
  /// Begins ImGui's frame with these events. frame_seconds: 0 for the time that has passed.
  void begin_frame(const std::vector<Event>& events, double frame_seconds);
  /// Ends ImGui's frame. Whether it would look other than the last that was drawn, or the window system has lost that:
  /// textures are taken for what they were.
  [[nodiscard]] bool ui_changed();
  /// Draws what ImGui has, and remembers it.
  void draw_ui();
  void swap();

  /// Another context that shares objects with the window's, for another thread. Made, and let go, in this one, while
  /// the window lives. Throws std::runtime_error, one line.
  [[nodiscard]] Context make_shared_context() const;
  /// Makes it current in the calling thread; null: none.
  static void make_current(GLFWwindow* context);
  /// Of a GL function, for cumulet.h and glad.
  static void* get_proc(void* user, const char* name);

 private:
  struct Terminate {
    Terminate();
    Terminate(const Terminate&) = delete;
    Terminate& operator=(const Terminate&) = delete;
    ~Terminate();
  };
  void listen();
  [[nodiscard]] std::pair<double, double> pixels_per_unit() const;

  Terminate glfw_;
  Context window_;
  Input input_;
  std::string title_;
  std::vector<std::byte> drawn_ui_;
  std::vector<std::byte> ui_;
  bool damaged_ = true;  // what was drawn is not on the screen
};

}  // namespace cumulet::demo
