#pragma once

// A host whose GL calls and allocations are counted and can fail.

#include <cumulet/cumulet.h>
#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <exception>
#include <vector>

#include "support/c_host.hpp"
#include "support/fake_gl.hpp"

namespace cumulet::test {

using Picture = std::vector<std::uint8_t>;

#if defined(__SANITIZE_ADDRESS__)
inline constexpr bool sanitized = true;
#else
inline constexpr bool sanitized = false;
#endif

inline constexpr int host_side = 24;

/// A context in which every GL call of the library is counted.
struct Host {
  headless::Context context = headless::Context::create(headless::Backend::automatic);
  FakeGl fake{headless::Context::get_proc, &context};
  HostTarget target{fake.real(), host_side, host_side};

  [[nodiscard]] ViewerPtr viewer(std::uint32_t samples = 1) {
    return make_viewer({.get_proc = FakeGl::get_proc, .user = &fake, .samples = samples});
  }
  [[nodiscard]] cumulet_status attach(cumulet_viewer* v) { return cumulet_attach(v, FakeGl::get_proc, &fake); }
};

/// A color that no image has, so that pixels that are not drawn are noticed.
inline constexpr std::array<float, 4> marker{1.0F, 0.0F, 1.0F, 1.0F};

/// The image that the next frame draws, whatever status it returns.
inline Picture shown(const Host& host, cumulet_viewer* viewer, cumulet_status* status = nullptr,
                     double budget_ms = -1.0, std::uint32_t* flags = nullptr) {
  host.target.clear(marker);
  cumulet_frame_desc frame = host.target.frame();
  frame.budget_ms = budget_ms;
  auto result = make_desc<cumulet_frame_result>();
  const cumulet_status got = cumulet_render(viewer, &frame, &result);
  if (status != nullptr) *status = got;
  if (flags != nullptr) *flags = result.flags;
  return host.target.pixels();
}

inline void light_surfaces(cumulet_viewer* viewer, cumulet_surface_lighting light) {
  auto settings = make_desc<cumulet_surface_settings_desc>();
  settings.lighting = light;
  ASSERT_EQ(cumulet_set_surface_settings(viewer, &settings), CUMULET_OK);
}

inline void preview(cumulet_viewer* viewer, cumulet_preview preview) {
  auto sampling = make_desc<cumulet_sampling_desc>();
  sampling.samples = 1;
  sampling.preview = preview;
  ASSERT_EQ(cumulet_set_sampling(viewer, &sampling), CUMULET_OK);
}

inline void change_medium(cumulet_viewer* viewer, double density_scale) {
  auto medium = make_desc<cumulet_medium_desc>();
  medium.density_scale = density_scale;
  ASSERT_EQ(cumulet_set_medium(viewer, &medium), CUMULET_OK);
}

/// Renders until the image is converged, and some frames after a failure. Returns the failures. `frames` is the
/// maximum.
inline std::vector<cumulet_status> render_all(cumulet_viewer* viewer, const cumulet_frame_desc& frame,
                                              int frames = 400) {
  std::vector<cumulet_status> failures;
  auto result = make_desc<cumulet_frame_result>();
  cumulet_wait(viewer, -1.0);
  for (int i = 0; i < frames; ++i) {
    const cumulet_status status = cumulet_render(viewer, &frame, &result);
    if (status != CUMULET_OK) failures.push_back(status);
    if (status == CUMULET_ERROR_CONTEXT_LOST || status == CUMULET_ERROR_DETACHED) break;
    // After a failure, a few frames more, because it may be returned only once.
    if (!failures.empty() && i + 4 < frames) i = frames - 4;
    if (status == CUMULET_OK && failures.empty() && (result.flags & CUMULET_RENDER_CONVERGED) != 0) break;
  }
  return failures;
}

/// converge() as an assertion.
inline testing::AssertionResult converges(cumulet_viewer* viewer, const HostTarget& target) {
  try {
    converge(viewer, target.frame());
    return testing::AssertionSuccess();
  } catch (const std::exception& error) {
    return testing::AssertionFailure() << error.what();
  }
}

}  // namespace cumulet::test
