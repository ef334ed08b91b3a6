// Spherical harmonics of the first and second order, beside the mean: the light of sky or environment on rasterized
// diffuse surfaces (Ramamoorthi and Hanrahan, "An Efficient Representation for Irradiance Environment Maps", SIGGRAPH
// 2001). Shared by GLSL and C++.
#ifndef CM_HARMONICS_GLSL
#define CM_HARMONICS_GLSL

// RGB coefficients. Radiance towards a unit w minus the mean is about the sum of each coefficient times its product of
// w's components.
struct CmHarmonics {
  vec4 x;
  vec4 y;
  vec4 z;
  vec4 xy;
  vec4 yz;
  vec4 zx;
  vec4 xx;  // x x - z z
  vec4 yy;  // y y - z z
};

// Factors by which convolution with cosine / pi scales each order.
const vec2 CM_MATTE_ORDERS = vec2(0.66666667f, 0.25f);

CM_FN vec3 cm_harmonics(CmHarmonics h, vec3 w, vec2 orders) {
  vec4 first = w.x * h.x + w.y * h.y + w.z * h.z;
  vec4 second = (w.x * w.y) * h.xy + (w.y * w.z) * h.yz + (w.z * w.x) * h.zx + (w.x * w.x - w.z * w.z) * h.xx +
                (w.y * w.y - w.z * w.z) * h.yy;
  return vec3(orders.x * first + orders.y * second);
}

#endif
