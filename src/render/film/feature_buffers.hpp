#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "gl/bindings.hpp"
#include "render/film/film.hpp"

namespace cumulet::render {

namespace film_layers {
inline constexpr FilmLayer normal{"normal", GL_RGBA32F, 16};
inline constexpr FilmLayer albedo{"albedo", GL_RGBA32F, 16};
/// Transmittance of the volume, the fraction of the pixel that surfaces cover, the number of feature rays, and their
/// spread.
inline constexpr FilmLayer transmittance{"transmittance", GL_RGBA32F, 16};
inline constexpr FilmLayer surface_z{"surface z", GL_R32F, 4};
/// View depth of the volume at half opacity, and the fraction of the pixel that the ground covers.
inline constexpr FilmLayer volume_z{"volume z", GL_RG32F, 8};
inline constexpr FilmLayer emission{"emission", GL_RGBA32F, 16};
inline constexpr FilmLayer velocity{"velocity", GL_RGBA32F, 16};
/// Motion vectors of surfaces (or of the background where there is none), and of the volume.
inline constexpr FilmLayer motion{"motion", GL_RGBA32F, 16};
}  // namespace film_layers

/// Feature buffers that are rendered together: denoiser guides, or velocity and motion vectors as well.
enum class FeatureSet { guides, all };

/// A noise-free feature buffer, which glsl/features/aovs.comp writes and documents.
struct FeatureBuffer {
  FilmLayer layer;
  GLuint image;  ///< image unit
  GLenum access = GL_READ_WRITE;
  FeatureSet set = FeatureSet::guides;  ///< the smallest set that has it
};
inline constexpr std::array feature_buffers{
    FeatureBuffer{film_layers::normal, core::CM_IMAGE_NORMAL},
    FeatureBuffer{film_layers::albedo, core::CM_IMAGE_ALBEDO},
    FeatureBuffer{film_layers::transmittance, core::CM_IMAGE_TRANSMITTANCE},
    FeatureBuffer{film_layers::surface_z, core::CM_IMAGE_SURFACE_Z, GL_WRITE_ONLY},
    FeatureBuffer{film_layers::volume_z, core::CM_IMAGE_VOLUME_Z},
    FeatureBuffer{film_layers::emission, core::CM_IMAGE_EMISSION},
    FeatureBuffer{film_layers::velocity, core::CM_IMAGE_VELOCITY, GL_READ_WRITE, FeatureSet::all},
    FeatureBuffer{film_layers::motion, core::CM_IMAGE_MOTION, GL_READ_WRITE, FeatureSet::all}};
/// Returns null if the layer is none of them.
[[nodiscard]] const FeatureBuffer* feature_buffer_of(const FilmLayer& layer);

/// AOVs, with the numbers of cumulet_aov.
enum class Aov {
  beauty,
  volume,
  transmittance,
  surface_depth,
  volume_depth,
  normal,
  albedo,
  error,
  velocity,
  motion,
  volume_motion
};

/// The values of an AOV: consecutive components of a layer's texels, or a result of the layer.
struct AovValues {
  FilmLayer layer;
  std::size_t count;      ///< floats per pixel
  std::size_t first = 0;  ///< the first component
};
/// In the order of Aov.
inline constexpr std::array aov_values{
    AovValues{film_layers::radiance, 4},  AovValues{film_layers::volume, 4},   AovValues{film_layers::transmittance, 1},
    AovValues{film_layers::surface_z, 1}, AovValues{film_layers::volume_z, 1}, AovValues{film_layers::normal, 3},
    AovValues{film_layers::albedo, 3},    AovValues{film_layers::moments, 1},  AovValues{film_layers::velocity, 3},
    AovValues{film_layers::motion, 2},    AovValues{film_layers::motion, 2, 2}};

/// Feature rays per pixel when feature buffers are read back; the denoiser starts with fewer. In pixels whose rays
/// differ, as with triangles or shadows finer than a pixel, more rays improve denoising, up to max_feature_rays.
constexpr std::uint32_t feature_rays = 16;
constexpr std::uint32_t max_feature_rays = 64;

}  // namespace cumulet::render
