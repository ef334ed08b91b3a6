#include "renderer.hpp"

#include <chrono>
#include <stdexcept>
#include <utility>

#include "window.hpp"

namespace cumulet::demo {
namespace {

constexpr auto glance = std::chrono::milliseconds(100);  // interval for polling the progress
constexpr GLuint64 patience = 10'000'000'000;            // timeout for the GPU in nanoseconds

}  // namespace

Renderer::Renderer(const GladGLContext& gl, GLFWwindow* context, std::function<void()> wake, Timeline* timeline,
                   ViewerSetup setup)
    : window_gl_(&gl), context_(context), wake_(std::move(wake)), timeline_(timeline), setup_(std::move(setup)) {
  std::promise<void> ready;
  auto started = ready.get_future();
  thread_ = std::thread([this, &ready] { work(ready); });
  try {
    started.get();
  } catch (...) {
    thread_.join();
    throw;
  }
}

Renderer::~Renderer() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
    if (session_ != nullptr) session_->cancel();
  }
  changed_.notify_one();
  thread_.join();
}

void Renderer::ask(DesiredState desired, std::vector<ViewerInput> inputs, std::vector<Request> requests) {
  {
    const std::lock_guard lock(mutex_);
    next_ = std::move(desired);
    inputs_.insert(inputs_.end(), inputs.begin(), inputs.end());
    requests_.insert(requests_.end(), std::make_move_iterator(requests.begin()),
                     std::make_move_iterator(requests.end()));
  }
  changed_.notify_one();
}

std::optional<Answer> Renderer::take() {
  const std::lock_guard lock(mutex_);
  if (failure_ != nullptr) std::rethrow_exception(failure_);
  if (ready_) {
    // The fence follows all commands of the window that read the texture.
    slots_[shown_].read = window_gl_->FenceSync(GL_SYNC_GPU_COMMANDS_COMPLETE, 0);
    window_gl_->Flush();
    shown_ = *std::exchange(ready_, std::nullopt);
  }
  return std::exchange(answer_, std::nullopt);
}

void Renderer::wait_for(std::uint64_t number) {
  std::unique_lock lock(mutex_);
  answered_.wait(lock, [&] { return failure_ != nullptr || (answer_ && answer_->desired >= number); });
}

void Renderer::cancel() {
  const std::lock_guard lock(mutex_);
  if (session_ != nullptr) session_->cancel();
}

Renderer::Picture Renderer::picture() const {
  const std::lock_guard lock(mutex_);
  return slots_[shown_].picture;
}

void Renderer::work(std::promise<void>& ready) {
  Window::make_current(context_);
  bool started = false;
  try {
    gl_ = std::make_unique<GladGLContext>();
    if (gladLoadGLContextUserPtr(
            gl_.get(),
            [](void* user, const char* name) { return reinterpret_cast<GLADapiproc>(Window::get_proc(user, name)); },
            nullptr) == 0)
      throw std::runtime_error("the OpenGL functions cannot be loaded");
    auto session = std::make_unique<Session>(
        Window::get_proc, nullptr,
        [this] {
          {
            const std::lock_guard lock(mutex_);
            poked_ = true;
          }
          changed_.notify_one();
        },
        timeline_, setup_);
    {
      const std::lock_guard lock(mutex_);
      session_ = std::move(session);
    }
    started = true;
    ready.set_value();
    for (bool stopped = false; !stopped;) {
      turn();
      const std::lock_guard lock(mutex_);
      stopped = stop_;
    }
  } catch (...) {
    if (!started) {
      ready.set_exception(std::current_exception());
    } else {
      const std::lock_guard lock(mutex_);
      failure_ = std::current_exception();
      answered_.notify_all();
      wake_();
    }
  }
  std::unique_ptr<Session> session;
  {
    const std::lock_guard lock(mutex_);
    session = std::move(session_);
  }
  session.reset();
  if (started) {
    for (Slot& slot : slots_) {
      gl_->DeleteFramebuffers(1, &slot.framebuffer);
      gl_->DeleteTextures(1, &slot.picture.texture);
      if (slot.read != nullptr) gl_->DeleteSync(slot.read);
    }
  }
  Window::make_current(nullptr);
}

void Renderer::turn() {
  std::vector<ViewerInput> inputs;
  std::vector<Request> requests;
  {
    std::unique_lock lock(mutex_);
    const auto due = [this] { return stop_ || next_ || !inputs_.empty() || !requests_.empty() || poked_; };
    if (desired_.number == 0 || !session_->more()) {
      if (desired_.number != 0 && session_->busy())
        changed_.wait_for(lock, glance, due);
      else
        changed_.wait(lock, due);
    }
    if (stop_) return;
    if (next_) desired_ = *std::exchange(next_, std::nullopt);
    inputs = std::exchange(inputs_, {});
    requests = std::exchange(requests_, {});
  }
  if (desired_.number == 0) {  // no request yet
    const std::lock_guard lock(mutex_);
    poked_ = false;
    return;
  }
  session_->follow(desired_);
  for (const ViewerInput& input : inputs) session_->input(input);
  for (const Request& request : requests) session_->execute(request);

  std::size_t free = 0;
  {
    const std::lock_guard lock(mutex_);
    while (free == shown_ || free == ready_) ++free;
    poked_ = false;  // this frame handles all updates so far
  }
  const bool sized = desired_.width > 0 && desired_.height > 0;
  if (sized && session_->cold()) {
    prepare(slots_[free], desired_.width, desired_.height);
    session_->warm_up(slots_[free].framebuffer);
    publish(free, false);
    return;
  }
  session_->work();
  // A new image is drawn when it is ready. The previous one is not drawn again.
  const bool draws = sized && session_->has_news();
  if (draws) {
    prepare(slots_[free], desired_.width, desired_.height);
    draw(slots_[free]);
  }
  publish(free, draws);
}

// Only this thread accesses the slot here.
void Renderer::prepare(Slot& slot, std::uint32_t width, std::uint32_t height) {
  const GladGLContext& gl = *gl_;
  if (slot.read != nullptr) {
    gl.ClientWaitSync(slot.read, 0, patience);
    gl.DeleteSync(std::exchange(slot.read, nullptr));
  }
  if (slot.picture.width != width || slot.picture.height != height) {
    if (slot.framebuffer == 0) gl.CreateFramebuffers(1, &slot.framebuffer);
    gl.DeleteTextures(1, &slot.picture.texture);
    gl.CreateTextures(GL_TEXTURE_2D, 1, &slot.picture.texture);
    slot.picture.width = width;
    slot.picture.height = height;
    const GLuint texture = slot.picture.texture;
    gl.TextureStorage2D(texture, 1, GL_RGBA8, static_cast<GLsizei>(width), static_cast<GLsizei>(height));
    gl.TextureParameteri(texture, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
    gl.TextureParameteri(texture, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    gl.TextureParameteri(texture, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
    gl.TextureParameteri(texture, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
    gl.NamedFramebufferTexture(slot.framebuffer, GL_COLOR_ATTACHMENT0, texture, 0);
  }
}

void Renderer::draw(const Slot& slot) {
  const GladGLContext& gl = *gl_;
  constexpr float dark = 0.075f;
  constexpr std::array<float, 4> nothing = {dark, dark * 1.08f, dark * 1.2f, 1.0f};
  gl.ClearNamedFramebufferfv(slot.framebuffer, GL_COLOR, 0, nothing.data());
  session_->draw(slot.framebuffer);
  GLsync done = gl.FenceSync(GL_SYNC_GPU_COMMANDS_COMPLETE, 0);
  gl.ClientWaitSync(done, GL_SYNC_FLUSH_COMMANDS_BIT, patience);
  gl.DeleteSync(done);
}

void Renderer::publish(std::size_t slot, bool drawn) {
  Answer answer = session_->answer();
  answer.drawn = drawn;
  {
    const std::lock_guard lock(mutex_);
    if (drawn) ready_ = slot;
    if (answer_) {  // the previous answer was not taken
      answer.camera_moved |= answer_->camera_moved;
      answer.drawn |= answer_->drawn;
      if (!answer.density_scale) answer.density_scale = answer_->density_scale;
      if (!answer.look) answer.look = answer_->look;
      if (!answer.picked) answer.picked = answer_->picked;
      if (!answer.metered) answer.metered = answer_->metered;
      answer_->notices.insert(answer_->notices.end(), answer.notices.begin(), answer.notices.end());
      answer.notices = std::move(answer_->notices);
      answer_->files.insert(answer_->files.end(), answer.files.begin(), answer.files.end());
      answer.files = std::move(answer_->files);
    }
    answer_ = std::move(answer);
  }
  answered_.notify_all();
  wake_();
}

}  // namespace cumulet::demo
