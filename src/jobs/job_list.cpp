#include "jobs/job_list.hpp"

#include <algorithm>

namespace cumulet::viewer {

template <class Visit>
void JobList::for_each(Visit&& visit) const {
  for (const Own& own : own_) visit(own.kind, *own.source);
  const std::scoped_lock lock(mutex_);
  for (const auto& player : players_) visit(ContentKind::instances, *player);
}

void JobList::set_players(std::vector<std::shared_ptr<JobSource>> players) {
  const std::scoped_lock lock(mutex_);
  players_.swap(players);  // the previous ones are destroyed after the lock is released
}

JobContext JobList::context(JobLog::Player player) const {
  JobContext context = context_;
  context.player = player;
  return context;
}

void JobList::cancel() {
  for_each([](ContentKind /*kind*/, JobSource& source) { source.cancel(); });
}

void JobList::rebuild() {
  for_each([](ContentKind /*kind*/, JobSource& source) { source.rebuild(); });
}

void JobList::set_job_log(JobLog* log) {
  context_.job_log = log;
  for_each([&](ContentKind /*kind*/, JobSource& source) { source.set_job_log(log); });
}

bool JobList::wait(Until until) const {
  if (!std::ranges::all_of(own_, [&](const Own& own) { return own.source->wait(until); })) return false;
  // Without the lock, so that other threads can make calls.
  std::unique_lock lock(mutex_);
  const std::vector<std::weak_ptr<JobSource>> players(players_.begin(), players_.end());
  lock.unlock();
  return std::ranges::all_of(players, [&](const auto& player) {
    const std::shared_ptr<JobSource> held = player.lock();
    return !held || wait_while_listed(*held, until);
  });
}

// Waits in short steps: a player that is dropped meanwhile ends only when its last holder lets it go.
bool JobList::wait_while_listed(const JobSource& player, Until until) const {
  using Clock = std::chrono::steady_clock;
  constexpr auto step = std::chrono::milliseconds(20);
  const auto is_listed = [&] {
    const std::scoped_lock lock(mutex_);
    return std::ranges::any_of(players_, [&](const auto& listed) { return listed.get() == &player; });
  };
  while (is_listed()) {
    const Clock::time_point next = Clock::now() + step;
    const bool is_last = until && *until <= next;
    if (player.wait(is_last ? *until : next)) return true;
    if (is_last) return false;
  }
  return true;
}

bool JobList::busy() const {
  bool busy = false;
  for_each([&](ContentKind /*kind*/, const JobSource& source) { busy = busy || source.busy(); });
  return busy;
}

bool JobList::busy(ContentKind kind) const {
  bool busy = false;
  for_each([&](ContentKind of, const JobSource& source) { busy = busy || (of == kind && source.busy()); });
  return busy;
}

JobList::Status JobList::status() const {
  Status all;
  std::optional<std::pair<bool, ContentKind>> rank_shown;  // players have the last rank
  const auto add = [&](ContentKind kind, bool is_player, const Worker::Status& status) {
    if (std::optional<Error>& failure = all.failures[kind]; !failure) failure = status.failure;
    const std::pair rank(is_player, kind);
    if (status.stage == Progress::Stage::idle || (rank_shown && *rank_shown <= rank)) return;
    rank_shown = rank;
    all.stage = status.stage;
    all.fraction = status.fraction;
  };
  for (const Own& own : own_) add(own.kind, false, own.source->status());
  const std::scoped_lock lock(mutex_);
  for (const auto& player : players_) add(ContentKind::instances, true, player->status());
  return all;
}

}  // namespace cumulet::viewer
