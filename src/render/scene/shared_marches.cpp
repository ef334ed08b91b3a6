#include "render/scene/shared_marches.hpp"

#include <algorithm>
#include <utility>

namespace cumulet::render {

namespace {

constexpr int max_frames_in_vain = 4;

}  // namespace

SharedMarches::~SharedMarches() {
  if (!gl_->abandoned && !programs_->is_current()) abandon();
}

MarchDataPtr SharedMarches::find(const Sources& sources, std::int64_t page_texels) {
  const auto found = std::ranges::find_if(
      kept_, [&](const Kept& one) { return one.complete && one.data->is_of(sources, page_texels); });
  if (found == kept_.end()) return nullptr;
  found->uploaded.order();
  found->shared = true;
  return found->data;
}

MarchDataPtr SharedMarches::add(MarchData data) {
  kept_.push_back({std::make_shared<const MarchData>(std::move(data)), gl::Fence(gl_)});
  return kept_.back().data;
}

SharedMarches::Kept* SharedMarches::kept(const MarchDataPtr& data) {
  const auto found = std::ranges::find(kept_, data, &Kept::data);
  return found == kept_.end() ? nullptr : &*found;
}

void SharedMarches::use(const MarchDataPtr& data) {
  Kept* found = kept(data);
  if (found == nullptr || !found->shared) return;
  if (found->uploaded.passed()) {
    found->uploaded = {};
  } else {
    found->uploaded.order();
  }
}

void SharedMarches::release(const MarchDataPtr& data) {
  const Kept* found = kept(data);
  if (found != nullptr && found->shared) released_.emplace_back(gl_);
}

void SharedMarches::collect() {
  std::erase_if(released_, [](const gl::Fence& fence) { return fence.passed(); });
  for (const gl::Fence& fence : released_) fence.order();
  std::erase_if(kept_, [](const Kept& one) { return one.data.use_count() == 1; });
  for (gl::WordHeap& heap : left_) heap.keep_pages(false);
  left_.clear();
}

void SharedMarches::leave(gl::WordHeap heap, std::optional<MarchData> unfinished) {
  heap.keep_pages(true);
  left_.push_back(std::move(heap));
  if (unfinished) kept_.push_back({std::make_shared<const MarchData>(*std::move(unfinished)), {}, false});
}

SharedMarches::InProgressPtr SharedMarches::begin(const Sources& sources, std::int64_t page_texels) {
  std::erase_if(in_progress_, [](const std::weak_ptr<InProgress>& one) { return one.expired(); });
  auto made = std::make_shared<InProgress>(InProgress{sources, page_texels});
  in_progress_.push_back(made);
  return made;
}

bool SharedMarches::is_coming(const Sources& sources, std::int64_t page_texels, Wait& wait) {
  bool any = false;
  std::uint64_t steps = 0;
  for (const std::weak_ptr<InProgress>& weak : in_progress_) {
    const InProgressPtr one = weak.lock();
    if (!one || one->page_texels != page_texels || one->of != sources) continue;
    any = true;
    steps += one->steps;
    wait.progress = one->progress;
  }
  wait.frames_in_vain = std::exchange(wait.steps, steps) == steps ? wait.frames_in_vain + 1 : 0;
  return any && wait.frames_in_vain < max_frames_in_vain;
}

}  // namespace cumulet::render
