// Reflectance of a thin film on an interface (KHR_materials_iridescence). Light reflected by its two sides interferes,
// wavelength by wavelength. The result in linear Rec. 709 has a closed form in Fourier space (Belcour and Barla, "A
// Practical Extension to Microfacet Theory for the Modeling of Varying Iridescence", SIGGRAPH 2017). As in the
// extension, reflectances are Schlick's and polarization is ignored. Shared by GLSL and C++.
#ifndef CM_FILM_GLSL
#define CM_FILM_GLSL
#include "surface/ggx.glsl"

struct CmFilm {
  float weight;     // 0: no film; between 0 and 1 the results with and without it are mixed
  float ior;        // at least 1
  float thickness;  // nanometers
  float outside;    // index of refraction of the medium above it
};

CM_FN float cm_square(float v) { return v * v; }

// Response of the eye, in linear Rec. 709, to cos(k D + shift) over all wavenumbers k, for an optical path difference
// D. Each CIE curve is a Gaussian, or two, in k.
CM_FN vec3 cm_film_response(float ways, vec3 shift) {
  float phase = 6.28318531e-9f * ways;  // meters
  float falls = phase * phase;
  vec3 xyz = vec3(0.846590f, 1.000222f, 1.001122f) * cos(vec3(1.6810e+06f, 1.7953e+06f, 2.2084e+06f) * phase + shift) *
             exp(vec3(-4.3278e+09f, -9.3046e+09f, -6.6121e+09f) * falls);
  xyz.x += 0.153868f * cos(2.2399e+06f * phase + shift.x) * exp(-4.5282e+09f * falls);
  return vec3(3.2404542f * xyz.x - 1.5371385f * xyz.y - 0.4985314f * xyz.z,
              -0.9692660f * xyz.x + 1.8760108f * xyz.y + 0.0415560f * xyz.z,
              0.0556434f * xyz.x - 0.2040259f * xyz.y + 1.0572252f * xyz.z);
}

// Weight of the film's reflectance. It fades to 0 with the thickness.
CM_FN float cm_film_share(CmFilm film) {
  float thin = clamp(film.thickness / 0.03f, 0.0f, 1.0f);
  return film.weight * thin * thin * (3.0f - 2.0f * thin);
}

// Reflectance at this cosine of an interface that has reflectance f0 in air without the film.
CM_FN vec3 cm_film_fresnel(CmFilm film, vec3 f0, float cosine) {
  float ior = film.ior;
  float sine2 = cm_square(film.outside / ior) * (1.0f - cosine * cosine);
  if (sine2 >= 1.0f) return vec3(1.0f);
  float inner_cosine = sqrt(1.0f - sine2);
  float first_f0 = cm_square((ior - film.outside) / (ior + film.outside));
  float first = first_f0 + (1.0f - first_f0) * cm_schlick(cosine);
  vec3 root = sqrt(clamp(f0, 0.0f, 0.9999f));
  vec3 base_ior = (1.0f + root) / (1.0f - root);
  vec3 ratio = (base_ior - ior) / (base_ior + ior);
  vec3 second = ratio * ratio;
  second += (1.0f - second) * cm_schlick(inner_cosine);
  const float half_turn = 3.14159265f;
  float shift = ior < film.outside ? 0.0f : half_turn;
  vec3 shifts = vec3(shift) + mix(vec3(0.0f), vec3(half_turn), lessThan(base_ior, vec3(ior)));
  float ways = 2.0f * ior * film.thickness * inner_cosine;
  vec3 both = clamp(first * second, 0.0f, 0.9999f);
  vec3 amplitude = sqrt(both);
  float through = 1.0f - first;
  vec3 inner = (through * through) * second / (1.0f - both);
  vec3 sum = first + inner;
  vec3 term = inner - through;
  for (int m = 1; m <= 2; ++m) {
    term *= amplitude;
    sum += term * 2.0f * cm_film_response(float(m) * ways, float(m) * shifts);
  }
  return clamp(sum, 0.0f, 1.0f);
}

#endif
