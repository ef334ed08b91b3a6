#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <vector>

#include "gl/objects.hpp"
#include "gl/span_allocator.hpp"

namespace cumulet::gl {

/// Buffers, pages, that many things share: each has a span of one, found by an offset that shaders are told, so that
/// things cost no bindings. Shaders read pages as texture buffers of RGBA32UI: storage buffers are slower by 15 % on
/// Mesa's llvmpipe where surfaces are traced. All calls, and the ends of spans and of the heap, need the context
/// current.
class WordHeap {
 public:
  struct Sizes {
    std::size_t page_bytes = std::size_t{4} << 20U;                      ///< of a page, unless one span needs a larger
    std::size_t largest_page = std::numeric_limits<std::size_t>::max();  ///< that the driver can bind
    std::size_t most_bytes = std::numeric_limits<std::size_t>::max();    ///< of all pages
  };
  /// Where spans begin and end: whole 16-byte words, on a cache line of any GPU.
  static constexpr std::size_t alignment = 256;

 private:
  struct Page {
    Page(Object made, Object view, std::size_t bytes)
        : buffer(std::move(made)), texture(std::move(view)), units(bytes / alignment) {}
    Object buffer;
    Object texture;
    SpanAllocator units;
  };
  struct Pages {
    std::vector<std::unique_ptr<Page>> all;
    std::size_t usual_units = 0;  // of a page
    // Those without a span, but for one: what changes all the time finds it again. None that is large beside what is in
    // use.
    void drop_empty(bool all_of_them);
  };

 public:
  /// Part of a page, which it gives back at its end. It may outlive the heap.
  class Span {
   public:
    Span() = default;
    Span(Span&& other) noexcept { swap(other); }
    Span& operator=(Span&& other) noexcept {
      Span moved(std::move(other));
      swap(moved);
      return *this;
    }
    Span(const Span&) = delete;
    Span& operator=(const Span&) = delete;
    ~Span();

    explicit operator bool() const { return page_ != nullptr; }
    /// The page, as shaders read it.
    [[nodiscard]] GLuint texture() const { return page_->texture.name(); }
    /// Filled by glNamedBufferSubData.
    [[nodiscard]] GLuint buffer() const { return page_->buffer.name(); }
    /// Where it begins in the buffer.
    [[nodiscard]] std::size_t offset() const { return first_ * alignment; }
    /// As many as were asked for, or up to the next whole units.
    [[nodiscard]] std::size_t bytes() const { return units_ * alignment; }

   private:
    friend class WordHeap;
    void swap(Span& other) noexcept {
      std::swap(pages_, other.pages_);
      std::swap(page_, other.page_);
      std::swap(first_, other.first_);
      std::swap(units_, other.units_);
    }
    std::shared_ptr<Pages> pages_;
    Page* page_ = nullptr;
    std::size_t first_ = 0;
    std::size_t units_ = 0;
  };

  WordHeap(FunctionsPtr gl, Sizes sizes) : gl_(std::move(gl)), sizes_(sizes), pages_(std::make_shared<Pages>()) {
    pages_->usual_units = sizes_.page_bytes / alignment;
  }

  /// Of undefined content. what: "creating the surfaces' tables". Throws Error(unsupported) for more than the driver
  /// binds at once, Error(out_of_memory) beyond most_bytes or where GL has no more, and then nothing has changed but
  /// that pages without a span are gone. O(pages + gaps).
  Span take(std::size_t wanted, const char* what);
  /// The same, from the beginning of a page that nothing else is in.
  Span take_page(std::size_t wanted, const char* what);

  [[nodiscard]] std::size_t pages() const { return pages_->all.size(); }
  /// Of all pages.
  [[nodiscard]] std::uint64_t bytes() const;
  /// Of those, without a span.
  [[nodiscard]] std::uint64_t free_bytes() const;

 private:
  Span take_of(Page& page, std::size_t units) const;
  // The page has usual units where that is more.
  Span take_of_new_page(std::size_t units, std::size_t usual, const char* what);

  FunctionsPtr gl_;
  Sizes sizes_;
  std::shared_ptr<Pages> pages_;
};

}  // namespace cumulet::gl
