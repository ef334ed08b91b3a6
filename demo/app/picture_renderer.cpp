#include "picture_renderer.hpp"

#include <utility>

#include "picture_run.hpp"

namespace cumulet::demo {
namespace {

/// Makes a context current in this thread during its lifetime.
class CurrentContext {
 public:
  explicit CurrentContext(GLFWwindow* context) { Window::make_current(context); }
  CurrentContext(const CurrentContext&) = delete;
  CurrentContext& operator=(const CurrentContext&) = delete;
  ~CurrentContext() { Window::make_current(nullptr); }
};

}  // namespace

PictureRenderer::PictureRenderer(ViewerSetup setup)
    : setup_(std::move(setup)),
      queue_([this](const PictureJob& job, const PictureWatch& watch) { return render(job, watch); }, Window::wake) {}

void PictureRenderer::add(PictureJob job) {
  if (context_ == nullptr) context_ = Window::make_context();
  queue_.add(std::move(job));
}

std::string PictureRenderer::render(const PictureJob& job, const PictureWatch& watch) const {
  const CurrentContext current(context_.get());
  // The session is destroyed after each job, which frees its GPU memory.
  Session session(
      Window::get_proc, nullptr, [] {}, nullptr, setup_);
  return PictureRun(session, job, watch).run();
}

}  // namespace cumulet::demo
