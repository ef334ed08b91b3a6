#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <vector>

#include "gl/objects.hpp"
#include "gl/span_allocator.hpp"

namespace cumulet::gl {

/// Suballocates GPU buffers (pages): each user has a span of a page, which shaders address by an offset, so that users
/// need no bindings of their own. Shaders read pages as texture buffers of RGBA32UI: storage buffers are 15 % slower on
/// Mesa's llvmpipe where surfaces are traced. All calls, and the destruction of spans and of the heap, need the context
/// current. Copies of a heap have the same pages.
class WordHeap {
 public:
  struct Sizes {
    std::size_t page_bytes = std::size_t{4} << 20U;                      ///< of a page, unless one span needs more
    std::size_t largest_page = std::numeric_limits<std::size_t>::max();  ///< maximum size that the driver can bind
    std::size_t max_bytes = std::numeric_limits<std::size_t>::max();     ///< total of all pages
  };
  /// Alignment of spans: whole 16-byte words, on a cache line of any GPU.
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
    bool kept = false;            // without a context no page can be freed
    // Frees pages without a span. Unless all_of_them is set, one page is kept for spans that are recreated often, if it
    // is not large compared with the used space.
    void drop_empty(bool all_of_them);
  };

 public:
  /// A part of a page, returned to it on destruction. It may outlive the heap.
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
    /// The page's texture buffer for shaders.
    [[nodiscard]] GLuint texture() const { return page_->texture.name(); }
    /// Binds it. gl: may be another table than the heap's.
    void bind(const Functions& gl, GLuint unit) const { gl.BindTextureUnit(unit, texture(), GL_TEXTURE_BUFFER); }
    /// The page's buffer, to be filled with glNamedBufferSubData.
    [[nodiscard]] GLuint buffer() const { return page_->buffer.name(); }
    /// Byte offset of the span in the buffer.
    [[nodiscard]] std::size_t offset() const { return first_ * alignment; }
    /// The requested size, rounded up to whole units.
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

  /// Allocates a span of undefined content. what: the step, such as "creating the surfaces' tables". Throws
  /// Error(unsupported) for more than the driver can bind at once, and Error(out_of_memory) beyond max_bytes or if GL
  /// is out of memory. After an error only pages without a span may be gone. O(pages + gaps).
  Span take(std::size_t wanted, const char* what);
  /// Like take(), but at the beginning of a new page.
  Span take_page(std::size_t wanted, const char* what);

  /// keep: spans that are returned free no pages, so that they can be destroyed without a context. Pages without a span
  /// are freed by the call with false, which needs one.
  void keep_pages(bool keep) {
    pages_->kept = keep;
    pages_->drop_empty(true);
  }

  /// The functions that own its buffers.
  [[nodiscard]] const FunctionsPtr& functions() const { return gl_; }
  [[nodiscard]] std::size_t pages() const { return pages_->all.size(); }
  /// Total size of all pages.
  [[nodiscard]] std::uint64_t bytes() const;
  /// Free bytes in all pages.
  [[nodiscard]] std::uint64_t free_bytes() const;

 private:
  Span take_of(Page& page, std::size_t units) const;
  // Creates a page of `usual` units, or `units` if that is more, limited by the remaining memory.
  Span take_of_new_page(std::size_t units, std::size_t usual, const char* what);

  FunctionsPtr gl_;
  Sizes sizes_;
  std::shared_ptr<Pages> pages_;
};

}  // namespace cumulet::gl
