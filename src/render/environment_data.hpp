#pragma once

#include <cstdint>

#include "base/parameters.hpp"
#include "gl/objects.hpp"
#include "gl/word_heap.hpp"
#include "light/environment.hpp"
#include "render/upload.hpp"

namespace cumulet::render {

/// What paths read of a light::Environment on the GPU. All calls need the context current and a StateGuard around.
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

/// Brings one to GL piece by piece. All calls need the context current and a StateGuard around.
class EnvironmentUpload {
 public:
  /// Allocates nothing yet.
  EnvironmentUpload(gl::FunctionsPtr gl, gl::WordHeap& heap, light::EnvironmentPtr environment);
  EnvironmentUpload(const EnvironmentUpload&) = delete;
  EnvironmentUpload& operator=(const EnvironmentUpload&) = delete;
  /// As Upload has them. Throws Error(unsupported) for more than the driver binds.
  bool advance(Deadline deadline) { return upload_.advance(deadline); }
  [[nodiscard]] double progress() const { return upload_.progress(); }
  /// Only after advance returned true.
  EnvironmentData take() { return std::move(data_); }

 private:
  light::EnvironmentPtr environment_;
  EnvironmentData data_;
  Upload upload_;  // its steps use the above
};

}  // namespace cumulet::render
