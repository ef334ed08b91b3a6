#pragma once

#include <glad/gl.h>

#include <array>
#include <condition_variable>
#include <cstdint>
#include <exception>
#include <functional>
#include <future>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "session.hpp"

struct GLFWwindow;

namespace cumulet::demo {

/// The viewer in a thread of its own, with a GL context of its own that shares objects with the window's: whoever draws
/// the window sends wishes and takes answers and pictures, and never waits. All calls of the viewer are in that thread
/// but for cancel's.
///
/// Pictures are drawn into three textures in turn: one is on the window, one may be ready, one is being drawn. A
/// picture is told of once the GPU has finished it; a texture is drawn over once the GPU has finished reading it.
///
/// All calls from one thread, which has the window's context current.
class Renderer {
 public:
  /// gl: the window's. context shares objects with it, is current in no thread, and outlives the renderer. wake is
  /// called from any thread when there is an answer to take. timeline, or null: is told of the viewer's work.
  /// shader_cache, shaders: folders, or "". Throws std::runtime_error.
  Renderer(const GladGLContext& gl, GLFWwindow* context, std::function<void()> wake, Timeline* timeline,
           std::string shader_cache, std::string shaders);
  Renderer(const Renderer&) = delete;
  Renderer& operator=(const Renderer&) = delete;
  /// Stops what is under way, soon.
  ~Renderer();

  /// The newest wish counts; inputs and requests are all carried out, in their order.
  void ask(Wish wish, std::vector<ViewerInput> inputs, std::vector<Request> requests);
  /// What came since the last time, with its picture; rethrows what ended the thread.
  [[nodiscard]] std::optional<Answer> take();
  /// Waits until there is an answer to the wish of this number.
  void wait_for(std::uint64_t number);
  /// Stops loading and building.
  void cancel();

  /// A texture as OpenGL has pictures, the first row at the bottom.
  struct Picture {
    unsigned texture = 0;  // 0: there is none yet
    std::uint32_t width = 0;
    std::uint32_t height = 0;
  };
  /// Of the answer last taken; stays as it is until the next is.
  [[nodiscard]] Picture picture() const;

 private:
  struct Slot {
    Picture picture;
    unsigned framebuffer = 0;  // of the thread's context
    GLsync read = nullptr;     // passed once the window's drawing of it is done
  };
  void work(std::promise<void>& ready);
  void turn();
  // Makes it a picture of that size, to be drawn over.
  void prepare(Slot& slot, std::uint32_t width, std::uint32_t height);
  void draw(const Slot& slot);
  void publish(std::size_t slot, bool drawn);

  const GladGLContext* window_gl_;
  GLFWwindow* context_;
  std::function<void()> wake_;
  Timeline* timeline_;
  std::string shader_cache_;
  std::string shaders_;

  // The thread's own.
  std::unique_ptr<GladGLContext> gl_;
  std::unique_ptr<Session> session_;
  Wish wish_;

  mutable std::mutex mutex_;  // the rest
  std::condition_variable changed_;
  std::condition_variable answered_;
  std::optional<Wish> next_;
  std::vector<ViewerInput> inputs_;
  std::vector<Request> requests_;
  bool poked_ = false;  // the viewer has something new
  bool stop_ = false;
  std::optional<Answer> answer_;
  std::exception_ptr failure_;
  std::array<Slot, 3> slots_;
  std::size_t shown_ = 0;             // on the window
  std::optional<std::size_t> ready_;  // to be shown next

  std::thread thread_;  // last: it uses the above
};

}  // namespace cumulet::demo
