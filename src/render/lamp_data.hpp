#pragma once

#include <cstdint>
#include <span>

#include "gl/objects.hpp"
#include "light/lamps.hpp"

namespace cumulet::render {

/// The lamps that paths look for, on the GPU. All calls need the context current and a StateGuard around.
class LampData {
 public:
  /// Throws Error(unsupported) for more than the driver binds.
  static LampData make(const gl::FunctionsPtr& gl, const gl::Limits& limits, const light::Lamps& of_host,
                       std::span<const surface::PunctualLight> of_scene);

  void bind(const gl::Functions& gl) const;
  /// Of both; the host's are first.
  [[nodiscard]] std::uint32_t count() const { return count_; }
  [[nodiscard]] std::uint32_t of_host() const { return of_host_; }

 private:
  gl::Object records_;
  std::uint32_t count_ = 0;
  std::uint32_t of_host_ = 0;
};

}  // namespace cumulet::render
