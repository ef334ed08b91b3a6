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

/// Runs the viewer in a thread with its own GL context, which shares objects with the window's. The thread that draws
/// the window sends requests and takes answers and images without waiting. All viewer calls happen in the viewer's
/// thread, except cancel().
/// Images are drawn into three textures in rotation: one is displayed, one may be ready, one is being drawn. An image
/// is published when the GPU has finished it. A texture is reused when the GPU has finished reading it.
/// All calls from one thread, which has the window's context current.
class Renderer {
 public:
  /// gl: the window's functions. context: shares objects with the window's, is current in no thread, and must outlive
  /// the renderer. wake: called from any thread when there is an answer. timeline: receives trace events, or null.
  /// Throws std::runtime_error.
  Renderer(const GladGLContext& gl, GLFWwindow* context, std::function<void()> wake, Timeline* timeline,
           ViewerSetup setup);
  Renderer(const Renderer&) = delete;
  Renderer& operator=(const Renderer&) = delete;
  /// Cancels running work and stops the thread.
  ~Renderer();

  /// Sends a request. Only the latest `desired` is processed; all inputs and requests are processed, in order.
  void ask(DesiredState desired, std::vector<ViewerInput> inputs, std::vector<Request> requests);
  /// Returns the answer since the last call, and switches to its image. Rethrows the error that ended the thread.
  [[nodiscard]] std::optional<Answer> take();
  /// Waits for the answer to the request with this number.
  void wait_for(std::uint64_t number);
  /// Cancels loading and building.
  void cancel();

  /// A texture with the first row at the bottom, as in OpenGL.
  struct Picture {
    unsigned texture = 0;  // 0: no image yet
    std::uint32_t width = 0;
    std::uint32_t height = 0;
  };
  /// Returns the image of the last taken answer. It stays valid until the next take().
  [[nodiscard]] Picture picture() const;

 private:
  struct Slot {
    Picture picture;
    unsigned framebuffer = 0;  // object of the viewer thread's context
    GLsync read = nullptr;     // signaled when the window's drawing of the texture is done
  };
  void work(std::promise<void>& ready);
  void turn();
  // Makes the slot an unused image of this size.
  void prepare(Slot& slot, std::uint32_t width, std::uint32_t height);
  void draw(const Slot& slot);
  void publish(std::size_t slot, bool drawn);

  const GladGLContext* window_gl_;
  GLFWwindow* context_;
  std::function<void()> wake_;
  Timeline* timeline_;
  ViewerSetup setup_;

  // Used only by the viewer's thread.
  std::unique_ptr<GladGLContext> gl_;
  std::unique_ptr<Session> session_;
  DesiredState desired_;

  mutable std::mutex mutex_;  // protects the members below
  std::condition_variable changed_;
  std::condition_variable answered_;
  std::optional<DesiredState> next_;
  std::vector<ViewerInput> inputs_;
  std::vector<Request> requests_;
  bool poked_ = false;  // the viewer has an update
  bool stop_ = false;
  std::optional<Answer> answer_;
  std::exception_ptr failure_;
  std::array<Slot, 3> slots_;
  std::size_t shown_ = 0;             // slot that is displayed
  std::optional<std::size_t> ready_;  // slot that is displayed next

  std::thread thread_;  // last member: the thread uses those above
};

}  // namespace cumulet::demo
