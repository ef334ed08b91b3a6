#pragma once

#include <cstdint>

#include "base/parameters.hpp"
#include "gl/objects.hpp"
#include "gl/word_heap.hpp"
#include "light/environment.hpp"
#include "render/pacing/upload.hpp"

namespace cumulet::render {

/// A light::Environment (environment map) on the GPU, as paths read it. All calls need a current context and an active
/// StateGuard.
class EnvironmentData {
 public:
  void bind(const gl::Functions& gl) const;
  [[nodiscard]] const core::CmEnvironment& parameters() const { return parameters_; }
  [[nodiscard]] std::uint64_t bytes() const { return words_.bytes(); }

 private:
  friend class EnvironmentUpload;
  gl::WordHeap::Span words_;
  core::CmEnvironment parameters_{};
};

/// Uploads an environment in steps. All calls need a current context and an active StateGuard.
class EnvironmentUpload {
 public:
  /// Allocates nothing yet.
  EnvironmentUpload(gl::FunctionsPtr gl, gl::WordHeap& heap, light::EnvironmentPtr environment);
  EnvironmentUpload(const EnvironmentUpload&) = delete;
  EnvironmentUpload& operator=(const EnvironmentUpload&) = delete;
  /// Returns and throws as Upload::advance(), and throws Error(unsupported) if the data exceed a limit of the driver.
  bool advance(Deadline deadline) { return upload_.advance(deadline); }
  [[nodiscard]] double progress() const { return upload_.progress(); }
  /// Only after advance() returned true.
  EnvironmentData take() { return std::move(data_); }

 private:
  light::EnvironmentPtr environment_;
  EnvironmentData data_;
  Upload upload_;  // its steps use the members above
};

}  // namespace cumulet::render
