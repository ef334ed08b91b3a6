#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "gl/objects.hpp"
#include "light/analytic_lights.hpp"

namespace cumulet::render {

/// The analytic lights that paths sample by NEE, on the GPU. All calls need a current context and an active StateGuard.
class AnalyticLightData {
 public:
  /// groups: light groups of the scene's lights. lit: bounds of the objects that the lights may light. Throws
  /// Error(unsupported) if the lights exceed a limit of the driver.
  static AnalyticLightData make(const gl::FunctionsPtr& gl, const gl::Limits& limits,
                                const light::AnalyticLights& of_host, std::span<const surface::PunctualLight> of_scene,
                                std::span<const std::uint32_t> groups, std::span<const light::Lit> lit);

  void bind(const gl::Functions& gl) const;
  /// Number of lights of the host and of the scene.
  [[nodiscard]] std::uint32_t count() const { return count_; }
  /// Luminance that arrives from all of them (light::share_looks).
  [[nodiscard]] double arrives() const { return arrives_; }
  /// light::nearest_analytic_light() for the first of `lit`, the medium.
  [[nodiscard]] std::optional<double> nearest() const { return nearest_; }

 private:
  gl::Object records_;
  std::uint32_t count_ = 0;
  double arrives_ = 0.0;
  std::optional<double> nearest_;
};

}  // namespace cumulet::render
