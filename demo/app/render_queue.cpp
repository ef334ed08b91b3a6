#include "render_queue.hpp"

#include <algorithm>
#include <chrono>
#include <exception>

namespace cumulet::demo {
namespace {

double seconds_now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

}  // namespace

RenderQueue::~RenderQueue() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  changed_.notify_one();
  if (thread_.joinable()) thread_.join();
}

void RenderQueue::add(PictureJob job) {
  {
    const std::lock_guard lock(mutex_);
    RenderEntry entry;
    entry.number = ++last_number_;
    entry.path = job.file.path;
    jobs_.push_back({std::move(entry), std::move(job)});
  }
  if (!thread_.joinable()) thread_ = std::thread([this] { work(); });
  changed_.notify_one();
}

void RenderQueue::cancel(std::uint64_t number) {
  const std::lock_guard lock(mutex_);
  Job* job = find(number);
  if (job == nullptr) return;
  if (job->entry.state == RenderEntry::State::running) stopping_ = number;
  if (job->entry.state == RenderEntry::State::waiting) job->entry.state = RenderEntry::State::cancelled;
}

void RenderQueue::clear() {
  const std::lock_guard lock(mutex_);
  std::erase_if(jobs_, [](const Job& job) { return job.entry.has_ended(); });
}

std::vector<RenderEntry> RenderQueue::entries() const {
  const std::lock_guard lock(mutex_);
  std::vector<RenderEntry> entries;
  entries.reserve(jobs_.size());
  for (const Job& job : jobs_) entries.push_back(job.entry);
  return entries;
}

std::vector<RenderEntry> RenderQueue::take_ended() {
  const std::lock_guard lock(mutex_);
  std::vector<RenderEntry> ended;
  for (Job& job : jobs_)
    if (job.entry.has_ended() && !std::exchange(job.taken, true)) ended.push_back(job.entry);
  return ended;
}

std::size_t RenderQueue::unfinished() const {
  const std::lock_guard lock(mutex_);
  return static_cast<std::size_t>(std::ranges::count_if(jobs_, [](const Job& job) { return !job.entry.has_ended(); }));
}

RenderQueue::Job* RenderQueue::find(std::uint64_t number) {
  const auto found = std::ranges::find(jobs_, number, [](const Job& job) { return job.entry.number; });
  return found == jobs_.end() ? nullptr : &*found;
}

void RenderQueue::work() {
  const auto is_waiting = [](const Job& job) { return job.entry.state == RenderEntry::State::waiting; };
  for (;;) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return stop_ || std::ranges::any_of(jobs_, is_waiting); });
    if (stop_) return;
    Job& next = *std::ranges::find_if(jobs_, is_waiting);
    next.entry.state = RenderEntry::State::running;
    time_left_.rest();
    const std::uint64_t number = next.entry.number;
    const PictureJob picture = next.picture;
    lock.unlock();
    wake_();
    carry_out(number, picture);
    wake_();
  }
}

void RenderQueue::carry_out(std::uint64_t number, const PictureJob& picture) {
  const PictureWatch watch{[this, number] {
                             const std::lock_guard lock(mutex_);
                             return stop_ || stopping_ == number;
                           },
                           [this, number](double part, const std::string& text) { report(number, part, text); }};
  try {
    end(number, RenderEntry::State::done, render_(picture, watch));
  } catch (const PictureCancelled&) {
    end(number, RenderEntry::State::cancelled, "");
  } catch (const std::exception& error) {
    end(number, RenderEntry::State::failed, error.what());
  }
}

void RenderQueue::report(std::uint64_t number, double part, const std::string& text) {
  constexpr double wake_period = 0.2;  // each wake draws the window
  const double now = seconds_now();
  {
    const std::lock_guard lock(mutex_);
    Job* job = find(number);
    if (job == nullptr) return;
    if (part > 0.0) time_left_.see(part, now);
    job->entry.part = std::clamp(part, 0.0, 1.0);
    const std::optional<PictureJob::Range>& frames = job->picture.frames;
    const double pictures = frames ? static_cast<double>(frames->last) - static_cast<double>(frames->first) + 1.0 : 1.0;
    job->entry.seconds_left = time_left_.seconds(part_of_a_sample(job->picture.scene.sampling) / pictures);
    job->entry.text = text;
    if (now - woken_at_ < wake_period) return;
    woken_at_ = now;
  }
  wake_();
}

void RenderQueue::end(std::uint64_t number, RenderEntry::State state, const std::string& text) {
  const std::lock_guard lock(mutex_);
  Job* job = find(number);
  if (job == nullptr) return;
  job->entry.state = state;
  job->entry.text = text;
  job->entry.seconds_left.reset();
  if (state == RenderEntry::State::done) job->entry.part = 1.0;
}

}  // namespace cumulet::demo
