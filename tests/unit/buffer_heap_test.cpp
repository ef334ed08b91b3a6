// Allocation of spans in shared pages: no overlaps and no leaks in any order.

#include "gl/word_heap.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <optional>
#include <random>
#include <utility>
#include <vector>

#include "base/error.hpp"
#include "headless.hpp"
#include "support/fake_gl.hpp"
#include "support/gl_state.hpp"

namespace {

using namespace cumulet;
using gl::SpanAllocator;
using gl::WordHeap;

TEST(SpanAllocator, MatchesASimpleModel) {
  constexpr std::size_t size = 1000;
  struct Taken {
    std::size_t first, size;
  };
  std::mt19937 engine(7);
  const auto below = [&](std::size_t n) { return std::uniform_int_distribution<std::size_t>(0, n - 1)(engine); };
  SpanAllocator spans(size);
  std::vector<char> used(size, 0);
  std::vector<Taken> taken;
  for (int i = 0; i < 20000; ++i) {
    if (taken.empty() || below(100) < 52) {
      const std::size_t wanted = below(20) == 0 ? 1 + below(300) : 1 + below(30);
      // Best fit: the smallest gap that is large enough, and the first of equal ones.
      std::size_t best = size;
      std::size_t best_gap = size + 1;
      for (std::size_t at = 0; at < size; ++at) {
        if (used[at] != 0) continue;
        std::size_t end = at;
        while (end < size && used[end] == 0) ++end;
        if (end - at >= wanted && end - at < best_gap) {
          best = at;
          best_gap = end - at;
        }
        at = end;
      }
      const auto got = spans.take(wanted);
      ASSERT_EQ(got.has_value(), best < size) << i;
      if (!got) continue;
      ASSERT_EQ(*got, best) << i;
      std::fill_n(used.begin() + static_cast<std::ptrdiff_t>(best), wanted, 1);
      taken.push_back({best, wanted});
    } else {
      std::swap(taken[below(taken.size())], taken.back());
      const Taken last = taken.back();
      taken.pop_back();
      spans.give_back(last.first, last.size);
      std::fill_n(used.begin() + static_cast<std::ptrdiff_t>(last.first), last.size, 0);
    }
    ASSERT_EQ(spans.free(), static_cast<std::size_t>(std::ranges::count(used, 0))) << i;
    std::size_t gaps = used[0] == 0 ? 1 : 0;
    for (std::size_t at = 1; at < size; ++at) gaps += used[at] == 0 && used[at - 1] != 0 ? 1 : 0;
    ASSERT_EQ(spans.gaps(), gaps) << "gaps that touch are one";
  }
  for (const Taken& last : taken) spans.give_back(last.first, last.size);
  EXPECT_TRUE(spans.empty());
  EXPECT_EQ(spans.take(size), 0U);
}

class BufferHeap : public test::GlTest {
 protected:
  static ErrorCode code_of(WordHeap& heap, std::size_t bytes) {
    try {
      const WordHeap::Span span = heap.take(bytes, "creating what a test asks for");
    } catch (const Error& error) {
      return error.code();
    }
    ADD_FAILURE() << "no error";
    return ErrorCode::internal;
  }
  WordHeap::Span filled(WordHeap& heap, std::size_t words, std::uint32_t value) {
    WordHeap::Span span = heap.take(words * 4, "creating what a test asks for");
    const std::vector<std::uint32_t> values(words, value);
    gl_->NamedBufferSubData(span.buffer(), static_cast<GLintptr>(span.offset()), static_cast<GLsizeiptr>(words * 4),
                            values.data());
    return span;
  }
  void expect_full(const WordHeap::Span& span, std::size_t words, std::uint32_t value) {
    std::vector<std::uint32_t> values(words);
    gl_->GetNamedBufferSubData(span.buffer(), static_cast<GLintptr>(span.offset()), static_cast<GLsizeiptr>(words * 4),
                               values.data());
    ASSERT_EQ(values, std::vector<std::uint32_t>(words, value));
  }
};
CUMULET_ON_BACKENDS(BufferHeap);

TEST_P(BufferHeap, SpansDoNotOverlap) {
  WordHeap heap(gl_, {.page_bytes = 1U << 16U});
  struct Thing {
    WordHeap::Span span;
    std::size_t words;
    std::uint32_t value;
  };
  std::vector<Thing> things;
  std::mt19937 engine(3);
  for (std::uint32_t i = 0; i < 400; ++i) {
    const std::size_t words = 1 + engine() % (i % 50 == 0 ? 40000 : 2000);
    things.push_back({filled(heap, words, i), words, i});
    EXPECT_EQ(things.back().span.offset() % WordHeap::alignment, 0U);
    if (things.size() > 20) things.erase(things.begin() + static_cast<std::ptrdiff_t>(engine() % things.size()));
  }
  std::uint64_t bytes = 0;
  for (const Thing& thing : things) {
    expect_full(thing.span, thing.words, thing.value);
    bytes += thing.span.bytes();
  }
  EXPECT_EQ(heap.bytes() - heap.free_bytes(), bytes);
  things.clear();
  EXPECT_EQ(heap.pages(), 0U) << "what is gone leaves nothing";
}

// Two spans at a time, as when poses are replaced: pages are reused instead of created.
TEST_P(BufferHeap, PagesAreReused) {
  WordHeap heap(gl_, {.page_bytes = 1U << 12U});
  WordHeap::Span shown = heap.take(100000, "creating");
  std::vector<GLuint> buffers;
  for (int i = 0; i < 10; ++i) {
    WordHeap::Span next = heap.take(100000, "creating");
    EXPECT_EQ(heap.pages(), 2U);
    buffers.push_back(next.buffer());
    shown = std::move(next);
  }
  for (std::size_t i = 2; i < buffers.size(); ++i) EXPECT_EQ(buffers[i], buffers[i - 2]);
}

// A large span is freed while small ones remain: its page is not kept for them.
TEST_P(BufferHeap, LargePageIsNotKeptForSmallSpans) {
  WordHeap heap(gl_, {.page_bytes = 1U << 12U});
  WordHeap::Span small = heap.take(1000, "creating");
  WordHeap::Span large = heap.take(1000000, "creating");
  const WordHeap::Span beside = heap.take(4000, "creating");
  EXPECT_NE(beside.buffer(), large.buffer());
  large = {};
  EXPECT_LE(heap.bytes(), 2U << 12U);
}

TEST_P(BufferHeap, LargeSpanHasItsOwnPage) {
  WordHeap heap(gl_, {.page_bytes = 1U << 14U, .largest_page = 1U << 16U});
  const WordHeap::Span before = filled(heap, 100, 1);
  const WordHeap::Span page = heap.take_page(5000, "creating");
  EXPECT_EQ(page.offset(), 0U);
  EXPECT_NE(page.buffer(), before.buffer());
  const WordHeap::Span after = filled(heap, 100, 2);
  EXPECT_NE(after.buffer(), page.buffer());
  EXPECT_THROW((void)heap.take_page((1U << 16U) + 1, "creating"), Error);
}

TEST_P(BufferHeap, ExceededLimitsAreErrorsAndLeakNothing) {
  WordHeap heap(gl_, {.page_bytes = 1U << 14U, .largest_page = 1U << 16U, .max_bytes = 80000});
  EXPECT_EQ(code_of(heap, (1U << 16U) + 1), ErrorCode::unsupported);
  const WordHeap::Span first = filled(heap, 3000, 1);
  const WordHeap::Span second = filled(heap, 12000, 2);
  EXPECT_EQ(code_of(heap, 60000), ErrorCode::out_of_memory);
  // Uses the rest of the limit, although it is less than a page.
  const WordHeap::Span third = filled(heap, 3000, 3);
  EXPECT_LE(heap.bytes(), 80000U);
  EXPECT_EQ(code_of(heap, 10000), ErrorCode::out_of_memory);
  expect_full(first, 3000, 1);
  expect_full(second, 12000, 2);
  expect_full(third, 3000, 3);
}

// The owner of spans may lose its context while others use pages of the heap.
TEST(BufferHeapMemory, KeptPagesNeedNoContext) {
  auto context = headless::Context::create(headless::Backend::egl);
  test::FakeGl fake(headless::Context::get_proc, &context);
  const gl::FunctionsPtr gl = gl::load_functions(test::FakeGl::get_proc, &fake);
  {
    std::optional<WordHeap> heap(std::in_place, gl, WordHeap::Sizes{.page_bytes = 1U << 12U});
    WordHeap::Span shared = heap->take(100, "creating");
    WordHeap::Span alone = heap->take(100000, "creating");
    EXPECT_EQ(heap->pages(), 2U);
    const std::uint64_t calls = fake.calls();
    WordHeap left = *heap;
    left.keep_pages(true);
    alone = {};
    heap.reset();
    EXPECT_EQ(fake.calls(), calls);
    left.keep_pages(false);
    EXPECT_EQ(left.pages(), 1U);
    EXPECT_EQ(left.bytes(), 1U << 12U);
    shared = {};
    EXPECT_EQ(left.pages(), 0U);
  }
  EXPECT_TRUE(fake.alive().empty());
  EXPECT_EQ(fake.wrong_deletes(), 0U);
}

TEST(BufferHeapMemory, OutOfMemoryLeaksNothing) {
  auto context = headless::Context::create(headless::Backend::egl);
  test::FakeGl fake(headless::Context::get_proc, &context);
  const gl::FunctionsPtr gl = gl::load_functions(test::FakeGl::get_proc, &fake);
  {
    WordHeap heap(gl, {.page_bytes = 1U << 12U});
    const WordHeap::Span kept = heap.take(4000, "creating");
    fake.fail_storage(true);
    try {
      const WordHeap::Span none = heap.take(8000, "creating");
      ADD_FAILURE() << "no error";
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::out_of_memory);
    }
    EXPECT_EQ(heap.pages(), 1U);
    fake.fail_storage(false);
    EXPECT_TRUE(static_cast<bool>(heap.take(8000, "creating")));
  }
  EXPECT_TRUE(fake.alive().empty());
  EXPECT_EQ(fake.wrong_deletes(), 0U);
}

}  // namespace
