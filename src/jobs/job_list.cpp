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
  {
    const std::scoped_lock lock(mutex_);
    if (players == players_) return;
    players_.swap(players);
    // wait() may hold a player that is dropped. One that stays must be awaited all the time.
    const auto set_awaited = [](const auto& changed, const auto& others, bool awaited) {
      for (const auto& player : changed)
        if (std::ranges::find(others, player) == others.end()) player->set_awaited(awaited);
    };
    set_awaited(players, players_, false);
    set_awaited(players_, players, true);
  }
  // The previous ones are destroyed without the lock.
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
    return !held || held->wait(until);  // set_players() ends the wait for a player that it drops
  });
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
