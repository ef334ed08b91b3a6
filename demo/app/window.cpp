#include "window.hpp"

#include <dlfcn.h>

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <backends/imgui_impl_glfw.h>
#include <backends/imgui_impl_opengl3.h>
#include <imgui.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <iterator>
#include <span>
#include <stdexcept>
#include <utility>

#include "ui.hpp"

namespace cumulet::demo {
namespace {

std::string glfw_error() {
  const char* text = nullptr;
  glfwGetError(&text);
  return text == nullptr ? "unknown cause" : text;
}

// Returns the data that determines the drawn image, except the contents of textures.
std::vector<std::byte> bytes_of(const ImDrawData& data) {
  std::vector<std::byte> bytes;
  const auto add = [&](const auto* values, int count) {
    const auto part = std::as_bytes(std::span(values, static_cast<std::size_t>(count)));
    bytes.insert(bytes.end(), part.begin(), part.end());
  };
  add(&data.DisplayPos, 1);
  add(&data.DisplaySize, 1);
  for (const ImDrawList* list : std::span(data.CmdLists, static_cast<std::size_t>(data.CmdListsCount))) {
    add(list->VtxBuffer.Data, list->VtxBuffer.Size);
    add(list->IdxBuffer.Data, list->IdxBuffer.Size);
    for (const ImDrawCmd& command : list->CmdBuffer) {
      add(&command.ClipRect, 1);
      add(&command.TextureId, 1);
      add(&command.ElemCount, 1);
    }
  }
  return bytes;
}

Input& input_of(GLFWwindow* window) { return static_cast<Window*>(glfwGetWindowUserPointer(window))->input(); }

Event make(Event::Type type) {
  Event event;
  event.type = type;
  event.time = glfwGetTime();
  return event;
}

}  // namespace

Window::Terminate::Terminate() {
  if (glfwInit() != GLFW_TRUE) throw std::runtime_error("no display: " + glfw_error());
}

Window::Terminate::~Terminate() { glfwTerminate(); }

void Window::DestroyWindow::operator()(GLFWwindow* window) const { glfwDestroyWindow(window); }

Window::Window(int width, int height) {
  glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 4);
  glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 5);
  glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
  glfwWindowHint(GLFW_DEPTH_BITS, 0);
  glfwWindowHint(GLFW_STENCIL_BITS, 0);
  // Same name as in cumulet-demo.desktop, so that the desktop shows its name and icon.
  glfwWindowHintString(GLFW_X11_CLASS_NAME, "cumulet-demo");
  glfwWindowHintString(GLFW_X11_INSTANCE_NAME, "cumulet-demo");
  window_.reset(glfwCreateWindow(width, height, "Cumulet", nullptr, nullptr));
  if (window_ == nullptr) throw std::runtime_error("no window with OpenGL 4.5: " + glfw_error());
  const auto [across, down] = pixels_per_unit();
  if (across != 1.0 || down != 1.0) resize(width, height);
  glfwSetWindowUserPointer(window_.get(), this);
  glfwSetWindowSizeLimits(window_.get(), 320, 240, GLFW_DONT_CARE, GLFW_DONT_CARE);
  glfwMakeContextCurrent(window_.get());
  glfwSwapInterval(1);
  listen();
  IMGUI_CHECKVERSION();
  ImGui::CreateContext();
  ImGuiIO& io = ImGui::GetIO();
  io.IniFilename = nullptr;
  io.ConfigFlags |= ImGuiConfigFlags_NavEnableKeyboard;
  io.ConfigWindowsMoveFromTitleBarOnly = true;
  ImGui_ImplGlfw_InitForOpenGL(window_.get(), false);
  ImGui_ImplOpenGL3_Init("#version 450 core");
}

Window::~Window() {
  ImGui_ImplOpenGL3_Shutdown();
  ImGui_ImplGlfw_Shutdown();
  ImGui::DestroyContext();
}

void Window::listen() {
  GLFWwindow* window = window_.get();
  glfwSetCursorPosCallback(window, [](GLFWwindow* w, double x, double y) {
    const auto [across, down] = static_cast<Window*>(glfwGetWindowUserPointer(w))->pixels_per_unit();
    Event event = make(Event::Type::move);
    event.x = x * across;
    event.y = y * down;
    input_of(w).push(event);
  });
  glfwSetMouseButtonCallback(window, [](GLFWwindow* w, int button, int action, int) {
    if (button >= Input::buttons) return;
    Event event = make(Event::Type::button);
    event.code = button;
    event.down = action == GLFW_PRESS;
    input_of(w).push(event);
  });
  glfwSetScrollCallback(window, [](GLFWwindow* w, double, double y) {
    Event event = make(Event::Type::wheel);
    event.y = y;
    input_of(w).push(event);
  });
  glfwSetKeyCallback(window, [](GLFWwindow* w, int key, int, int action, int) {
    // ImGui generates key repeats itself.
    if (key < 0 || key >= Input::keys || action == GLFW_REPEAT) return;
    Event event = make(Event::Type::key);
    event.code = key;
    event.down = action == GLFW_PRESS;
    input_of(w).push(event);
  });
  glfwSetCharCallback(window, [](GLFWwindow* w, unsigned code) {
    Event event = make(Event::Type::character);
    event.code = static_cast<int>(code);
    input_of(w).push(event);
  });
  glfwSetDropCallback(window, [](GLFWwindow* w, int count, const char** paths) {
    Event event = make(Event::Type::drop);
    event.files.assign(paths, paths + count);
    input_of(w).push(event);
  });
  glfwSetWindowRefreshCallback(
      window, [](GLFWwindow* w) { static_cast<Window*>(glfwGetWindowUserPointer(w))->damaged_ = true; });
  glfwSetWindowCloseCallback(window, [](GLFWwindow* w) { input_of(w).push(make(Event::Type::close)); });
  glfwSetWindowFocusCallback(window, [](GLFWwindow* w, int focused) {
    if (focused == GLFW_FALSE) input_of(w).push(make(Event::Type::focus_lost));
  });
}

std::pair<int, int> Window::size() const {
  int width = 0;
  int height = 0;
  glfwGetFramebufferSize(window_.get(), &width, &height);
  return {width, height};
}

std::pair<double, double> Window::pixels_per_unit() const {
  int width = 0;
  int height = 0;
  glfwGetWindowSize(window_.get(), &width, &height);
  const auto [across, down] = size();
  if (width <= 0 || height <= 0 || across <= 0 || down <= 0) return {1.0, 1.0};
  return {static_cast<double>(across) / width, static_cast<double>(down) / height};
}

void Window::resize(int width, int height) {
  const auto [across, down] = pixels_per_unit();
  glfwSetWindowSize(window_.get(), static_cast<int>(std::lround(width / across)),
                    static_cast<int>(std::lround(height / down)));
}

std::string Window::portal_name() const {
  // GLFW's build for Wayland lacks the function.
  using GetX11Window = unsigned long(GLFWwindow*);
  auto* const get = reinterpret_cast<GetX11Window*>(::dlsym(RTLD_DEFAULT, "glfwGetX11Window"));
  if (get == nullptr) return "";
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "x11:%lx", get(window_.get()));
  return text.data();
}

void Window::set_title(const std::string& title) {
  if (title == title_) return;
  title_ = title;
  glfwSetWindowTitle(window_.get(), title.c_str());
}

float Window::content_scale() const {
  float across = 1.0f;
  float down = 1.0f;
  glfwGetWindowContentScale(window_.get(), &across, &down);
  return std::clamp(std::max(across, down), 0.5f, 4.0f);
}

void Window::wait(double seconds) {
  if (seconds <= 0.0)
    glfwPollEvents();
  else if (std::isinf(seconds))
    glfwWaitEvents();
  else
    glfwWaitEventsTimeout(seconds);
}

void Window::wake() { glfwPostEmptyEvent(); }

void Window::set_ui_scale(float scale) {
  apply_theme(scale);
  load_fonts(scale);
  ImGui_ImplOpenGL3_DestroyFontsTexture();
}

void Window::begin_frame(const std::vector<Event>& events, double frame_seconds) {
  ImGuiIO& io = ImGui::GetIO();
  for (const Event& event : events) {
    switch (event.type) {
      case Event::Type::wheel:
        io.MouseWheel += static_cast<float>(event.y);
        break;
      case Event::Type::key:
        ImGui_ImplGlfw_KeyCallback(window_.get(), event.code, 0, event.down ? GLFW_PRESS : GLFW_RELEASE, 0);
        break;
      case Event::Type::character:
        io.AddInputCharacter(static_cast<unsigned>(event.code));
        break;
      case Event::Type::focus_lost:
        std::fill(std::begin(io.KeysDown), std::end(io.KeysDown), false);
        io.KeyCtrl = io.KeyShift = io.KeyAlt = io.KeySuper = false;
        break;
      case Event::Type::move:
      case Event::Type::button:
      case Event::Type::drop:
      case Event::Type::resize:
      case Event::Type::close:
        break;
    }
  }
  if (!io.Fonts->IsBuilt() || io.Fonts->TexID == nullptr) ImGui_ImplOpenGL3_CreateFontsTexture();
  ImGui_ImplOpenGL3_NewFrame();
  ImGui_ImplGlfw_NewFrame();
  // The backend polls the window system for the mouse position. Replayed positions are only in input_.
  const auto [width, height] = size();
  io.DisplaySize = {static_cast<float>(width), static_cast<float>(height)};
  io.DisplayFramebufferScale = {1.0f, 1.0f};
  io.MousePos = {static_cast<float>(input_.x()), static_cast<float>(input_.y())};
  for (int i = 0; i < Input::buttons; ++i) io.MouseDown[i] = input_.button(i);
  if (frame_seconds > 0.0) io.DeltaTime = static_cast<float>(frame_seconds);
  ImGui::NewFrame();
}

bool Window::ui_changed() {
  ImGui::Render();
  ui_ = bytes_of(*ImGui::GetDrawData());
  return damaged_ || ui_ != drawn_ui_;
}

void Window::draw_ui() {
  ImGui_ImplOpenGL3_RenderDrawData(ImGui::GetDrawData());
  drawn_ui_ = std::exchange(ui_, {});
  damaged_ = false;
}

void Window::swap() { glfwSwapBuffers(window_.get()); }

// Needs the hints that the window's constructor has set.
Window::Context Window::make_hidden(GLFWwindow* shared_with) {
  glfwWindowHint(GLFW_VISIBLE, GLFW_FALSE);
  Context context(glfwCreateWindow(1, 1, "Cumulet", nullptr, shared_with));
  glfwWindowHint(GLFW_VISIBLE, GLFW_TRUE);
  if (context == nullptr) throw std::runtime_error("no OpenGL context for the viewer: " + glfw_error());
  return context;
}

void Window::make_current(GLFWwindow* context) { glfwMakeContextCurrent(context); }

void* Window::get_proc(void*, const char* name) { return reinterpret_cast<void*>(glfwGetProcAddress(name)); }

}  // namespace cumulet::demo
