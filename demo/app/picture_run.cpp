#include "picture_run.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <frame_pattern.hpp>
#include <progress.hpp>
#include <stdexcept>
#include <thread>

#include "saved_picture.hpp"

namespace cumulet::demo {
namespace {

using Clock = std::chrono::steady_clock;

constexpr double budget_ms = 50.0;  // short, so that the window's images are not delayed
constexpr auto glance = std::chrono::milliseconds(20);

double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

/// Returns true if the viewer displays this frame of the sequence. Throws if the file cannot be read.
bool displays(const Status& status, std::uint32_t index) {
  if (!status.play || status.play->info.requested_frame != index) return false;
  if (!status.play->failure.empty()) throw std::runtime_error(status.play->failure);
  return status.play->info.is_displayed != 0 && status.play->info.displayed_frame == index;
}

}  // namespace

PictureRun::PictureRun(Session& session, const PictureJob& job, const PictureWatch& watch)
    : session_(session), job_(job), watch_(watch) {
  desired_.number = 1;
  desired_.scene = job.scene;
  desired_.navigation.struct_size = sizeof desired_.navigation;
  desired_.adaptive_resolution = false;
  desired_.budget_ms = budget_ms;
  desired_.width = job.scene.width;
  desired_.height = job.scene.height;
}

std::string PictureRun::run() {
  const auto start = Clock::now();
  const std::string result = job_.frames ? run_sequence() : run_picture();
  std::string text = result + " in " + format_duration(seconds_since(start));
  for (const std::string& note : notes_) text += "; " + note;
  return text;
}

std::string PictureRun::run_picture() {
  make(job_.file.path, {});
  return std::to_string(job_.scene.width) + "x" + std::to_string(job_.scene.height);
}

std::string PictureRun::run_sequence() {
  const auto pattern = FramePattern::parse(job_.file.path);
  if (!pattern) throw std::runtime_error(job_.file.path + ": has no #### for the number of the frame");
  const Play play = load_sequence();
  std::vector<std::uint32_t> indices;
  for (std::uint32_t i = 0; i < play.row.count(); ++i)
    if (play.row.number(i) >= job_.frames->first && play.row.number(i) <= job_.frames->last) indices.push_back(i);
  if (indices.empty()) throw std::runtime_error("the sequence has no such frames");
  frames_ = indices.size();
  std::vector<Moment> failed;
  for (const std::uint32_t index : indices) {
    const Frame number = play.row.number(index);
    prefix_ = "frame " + std::to_string(number) + ", ";
    go_to(play, index);
    try {
      make(pattern->file(number), index);
    } catch (const std::runtime_error& error) {
      failed.emplace_back(number);
      notes_.emplace_back(error.what());
    }
    ++frames_done_;
  }
  if (failed.size() == frames_) throw std::runtime_error("all frames failed: " + notes_.front());
  std::string text = std::to_string(frames_ - failed.size()) + " frames";
  if (!failed.empty()) text += ", failed: " + frames_text(failed);
  return text;
}

void PictureRun::make(const std::string& path, std::optional<std::uint32_t> index) {
  render(index);
  PictureFile file = job_.file;
  file.path = path;
  if (const std::string note = session_.write(file); !note.empty()) notes_.push_back(note);
}

void PictureRun::render(std::optional<std::uint32_t> index) {
  std::optional<Clock::time_point> first_sample;
  for (;;) {
    const Answer answer = turn();
    const cumulet_frame_result& frame = answer.status.frame;
    const auto& play = answer.status.play;
    // The viewer reads frames of a sequence ahead.
    const bool loads = answer.waiting || (!play && (frame.flags & CUMULET_RENDER_LOADING) != 0);
    const bool ready = !loads && (!play || displays(answer.status, index.value_or(play->info.requested_frame)));
    if (!answer.waiting && !answer.status.busy && !answer.status.has_content)
      throw std::runtime_error("the scene is empty");
    if (!ready) {
      std::this_thread::sleep_for(glance);
      continue;
    }
    if (!first_sample && frame.progress > 0.0) first_sample = Clock::now();
    const double seconds = first_sample ? seconds_since(*first_sample) : 0.0;
    report(part_done(frame.progress, seconds, job_.time_limit));
    if ((frame.flags & CUMULET_RENDER_CONVERGED) != 0) return;
    const bool late = job_.time_limit && first_sample && seconds >= *job_.time_limit;
    if (late && is_whole(frame, desired_.width, desired_.height)) return;
  }
}

Play PictureRun::load_sequence() {
  for (;;) {
    const Answer answer = turn();
    if (!answer.waiting && answer.status.play) return *answer.status.play;
    if (!answer.waiting && !answer.status.busy)
      throw std::runtime_error(notes_.empty() ? job_.scene.volume + ": is not a sequence" : notes_.back());
    std::this_thread::sleep_for(glance);
  }
}

void PictureRun::go_to(const Play& play, std::uint32_t index) {
  double seconds = 0.0;
  static_cast<void>(cumulet_sequence_set_frame(play.sequence.get(), index));
  if (cumulet_sequence_get_time_of(play.sequence.get(), index, &seconds) != CUMULET_OK) return;
  ++desired_.number;
  set_animation_time(desired_.scene, seconds);
}

Answer PictureRun::turn() {
  if (watch_.cancelled()) throw PictureCancelled();
  session_.follow(desired_);
  session_.work();
  Answer answer = session_.answer();
  for (const Answer::Notice& notice : answer.notices) {
    // Other frames of a sequence may fail too.
    if (notice.error && !job_.frames) throw std::runtime_error(notice.text);
    if (std::ranges::find(notes_, notice.text) == notes_.end()) notes_.push_back(notice.text);
  }
  if (answer.waiting)
    watch_.report(0.0, answer.status.loading.empty() ? "loading" : "loading " + answer.status.loading);
  return answer;
}

void PictureRun::report(double part) const {
  std::array<char, 64> text{};
  std::snprintf(text.data(), text.size(), "%.0f / %u samples", std::floor(part * desired_.scene.sampling.samples),
                desired_.scene.sampling.samples);
  const double pictures = static_cast<double>(frames_done_) + part;
  watch_.report(pictures / static_cast<double>(frames_), prefix_ + text.data());
}

}  // namespace cumulet::demo
