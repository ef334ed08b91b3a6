#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "gl/objects.hpp"
#include "light/lamps.hpp"

namespace cumulet::render {

/// The lamps that paths look for, on the GPU. All calls need the context current and a StateGuard around.
class LampData {
 public:
  /// groups: those of lights that the scene's are in. lit: what they may light. Throws Error(unsupported) for more than
  /// the driver binds.
  static LampData make(const gl::FunctionsPtr& gl, const gl::Limits& limits, const light::Lamps& of_host,
                       std::span<const surface::PunctualLight> of_scene, std::span<const std::uint32_t> groups,
                       std::span<const light::Lit> lit);

  void bind(const gl::Functions& gl) const;
  /// Of both.
  [[nodiscard]] std::uint32_t count() const { return count_; }
  /// Of all of them, by luminance (light::share_looks).
  [[nodiscard]] double arrives() const { return arrives_; }
  /// light::nearest_lamp, to the first of what they may light: the medium.
  [[nodiscard]] std::optional<double> nearest() const { return nearest_; }

 private:
  gl::Object records_;
  std::uint32_t count_ = 0;
  double arrives_ = 0.0;
  std::optional<double> nearest_;
};

}  // namespace cumulet::render
