#include "gl/word_heap.hpp"

#include <algorithm>
#include <string>

#include "base/error.hpp"

namespace cumulet::gl {

namespace {

constexpr std::size_t whole(std::size_t bytes) {
  return (std::max<std::size_t>(bytes, 1) + WordHeap::alignment - 1) / WordHeap::alignment * WordHeap::alignment;
}

}  // namespace

void WordHeap::Pages::drop_empty(bool all_of_them) {
  if (kept) return;
  std::size_t used = 0;
  for (const auto& page : all) used += page->units.size() - page->units.free();
  std::size_t most = all_of_them || used == 0 ? 0 : std::max(usual_units, 2 * used);
  std::erase_if(all, [&](const std::unique_ptr<Page>& page) {
    if (!page->units.empty()) return false;
    if (page->units.size() > most) return true;
    most = 0;
    return false;
  });
}

WordHeap::Span::~Span() {
  if (page_ == nullptr) return;
  page_->units.give_back(first_, units_);
  pages_->drop_empty(false);
}

WordHeap::Span WordHeap::take_of(Page& page, std::size_t units) const {
  const auto first = page.units.take(units);
  Span span;
  if (!first) return span;
  span.pages_ = pages_;
  span.page_ = &page;
  span.first_ = *first;
  span.units_ = units;
  return span;
}

WordHeap::Span WordHeap::take(std::size_t wanted, const char* what) {
  const std::size_t units = whole(wanted) / alignment;
  const std::size_t usual = whole(sizes_.page_bytes) / alignment;
  for (const auto& page : pages_->all) {
    // A small span must not keep a large page alive.
    if (page->units.size() > std::max(usual, 4 * units)) continue;
    if (Span span = take_of(*page, units)) return span;
  }
  return take_of_new_page(units, usual, what);
}

WordHeap::Span WordHeap::take_page(std::size_t wanted, const char* what) {
  return take_of_new_page(whole(wanted) / alignment, 0, what);
}

WordHeap::Span WordHeap::take_of_new_page(std::size_t units, std::size_t usual, const char* what) {
  const std::size_t needed = units * alignment;
  if (needed > sizes_.largest_page) {
    throw Error(ErrorCode::unsupported, std::string(what) + " needs " + std::to_string(needed) +
                                            " bytes; this driver's GL_MAX_TEXTURE_BUFFER_SIZE holds " +
                                            std::to_string(sizes_.largest_page));
  }
  pages_->drop_empty(true);
  const std::uint64_t room = sizes_.max_bytes - std::min<std::uint64_t>(bytes(), sizes_.max_bytes);
  if (needed > room) {
    throw Error(ErrorCode::out_of_memory, std::string(what) + " needs " + std::to_string(needed) + " bytes; " +
                                              std::to_string(room) + " are available of " +
                                              std::to_string(sizes_.max_bytes));
  }
  const std::size_t most = std::min<std::uint64_t>(sizes_.largest_page, room) / alignment;
  const std::size_t size = std::max(units, std::min(usual, most)) * alignment;
  Object buffer = make_buffer(gl_, size, nullptr, GL_DYNAMIC_STORAGE_BIT, what);
  Object texture = make_texture_buffer(gl_, GL_RGBA32UI, buffer, what);
  auto page = std::make_unique<Page>(std::move(buffer), std::move(texture), size);
  return take_of(*pages_->all.emplace_back(std::move(page)), units);
}

std::uint64_t WordHeap::bytes() const {
  std::uint64_t sum = 0;
  for (const auto& page : pages_->all) sum += page->units.size() * alignment;
  return sum;
}

std::uint64_t WordHeap::free_bytes() const {
  std::uint64_t sum = 0;
  for (const auto& page : pages_->all) sum += page->units.free() * alignment;
  return sum;
}

}  // namespace cumulet::gl
