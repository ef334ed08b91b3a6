#include "viewer/grid_shelf.hpp"

#include <algorithm>
#include <utility>

namespace cumulet::viewer {

namespace {

constexpr const char* what = "building the grids of several volumes";

}  // namespace

std::vector<GridShelf::Shelved>::iterator GridShelf::find(const Wish& wish) {
  return std::ranges::find_if(shelf_, [&](const Shelved& shelved) { return shelved.wish == wish; });
}

void GridShelf::wish(std::vector<Wish> wishes) {
  bool missing = false;
  bool failed = false;
  std::vector<Shelved> before;  // ends after the lock: what it holds may be large
  {
    const std::scoped_lock lock(mutex_);
    before = std::exchange(shelf_, {});
    for (Wish& wish : wishes) {
      if (find(wish) != shelf_.end()) continue;
      const auto was = std::ranges::find_if(before, [&](const Shelved& shelved) { return shelved.wish == wish; });
      shelf_.push_back({std::move(wish), {}, {}});
      if (was == before.end()) continue;
      shelf_.back().built = std::move(was->built);
      shelf_.back().failure = was->failure;
    }
    if (under_way_ && find(*under_way_) == shelf_.end()) shelf_.push_back({*under_way_, {}, {}, false});
    missing = std::ranges::any_of(shelf_, &Shelved::is_missing);
    failed = std::ranges::any_of(shelf_, [](const Shelved& shelved) { return shelved.failure.has_value(); });
  }
  if (missing) {
    worker_.post({what, Progress::Stage::refining, [this](Progress& progress) { build_missing(progress); }});
  } else if (!failed) {
    worker_.forget_failure();
  }
}

std::optional<Built> GridShelf::built(const Wish& wish) const {
  const std::scoped_lock lock(mutex_);
  const auto found = std::ranges::find_if(shelf_, [&](const Shelved& shelved) { return shelved.wish == wish; });
  return found == shelf_.end() ? std::nullopt : found->built;
}

bool GridShelf::is_under_way(const Wish& wish) const {
  const std::scoped_lock lock(mutex_);
  return under_way_ == wish;
}

void GridShelf::forget_failures() {
  const std::scoped_lock lock(mutex_);
  for (Shelved& shelved : shelf_) shelved.failure.reset();
}

void GridShelf::build_missing(Progress& progress) {
  // Nothing is under way however this ends.
  const auto rest = [this] {
    const std::scoped_lock lock(mutex_);
    under_way_.reset();
  };
  for (;;) {
    std::optional<Wish> next;
    {
      const std::scoped_lock lock(mutex_);
      const auto missing = std::ranges::find_if(shelf_, &Shelved::is_missing);
      if (missing != shelf_.end()) next = missing->wish;
      under_way_ = next;
    }
    if (!next) break;
    std::optional<Built> built;
    std::optional<Error> failure;
    try {
      progress.begin(Progress::Stage::refining);
      built = build_grid(log_, next->volume, next->settings, progress);
      progress.check();
    } catch (...) {
      failure = caught(what);
    }
    if (failure && failure->code() == ErrorCode::cancelled) {
      rest();
      throw Error(*failure);
    }
    {
      const std::scoped_lock lock(mutex_);
      under_way_.reset();
      const auto place = find(*next);
      if (place != shelf_.end()) {
        place->built = std::move(built);
        place->failure = std::move(failure);
        ++revision_;
      }
    }
    notify_();
  }
  const std::scoped_lock lock(mutex_);
  for (const Shelved& shelved : shelf_) {
    if (shelved.failure && shelved.wanted) throw Error(*shelved.failure);
  }
}

}  // namespace cumulet::viewer
