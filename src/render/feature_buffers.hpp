#pragma once

#include <cstddef>
#include <cstdint>

namespace cumulet::render {

/// Noise-free feature buffers (AOVs); documented in glsl/aovs.comp.
enum class FeatureBuffer { transmittance, surface_z, volume_z, normal, albedo, velocity, motion, volume_motion };
constexpr std::size_t channels_of(FeatureBuffer feature) {
  if (feature == FeatureBuffer::motion || feature == FeatureBuffer::volume_motion) return 2;
  return feature == FeatureBuffer::normal || feature == FeatureBuffer::albedo || feature == FeatureBuffer::velocity ? 3
                                                                                                                    : 1;
}
/// Feature buffers that are rendered together: denoiser guides, or velocity and motion vectors as well.
enum class FeatureSet { guides, all };

/// Feature rays per pixel when feature buffers are read back; the denoiser starts with fewer. In pixels whose rays
/// differ, as with triangles or shadows finer than a pixel, more rays improve denoising, up to max_feature_rays.
constexpr std::uint32_t feature_rays = 16;
constexpr std::uint32_t max_feature_rays = 64;

}  // namespace cumulet::render
