// A light that no shader of the library has: a distant disc of finite angle, with the interface that
// glsl/light/light.glsl needs. The includer declares
//   cm_disc_to           vec3, unit direction to its center, in world space
//   cm_disc_cosine       float, cosine of its half angle
//   cm_disc_radiance_in  vec3, its radiance
#ifndef CM_DISC_LIGHT_GLSL
#define CM_DISC_LIGHT_GLSL

CM_FN vec3 cm_disc_radiance(vec3 w) {
  return dot(w, cm_disc_to) > cm_disc_cosine ? cm_disc_radiance_in : vec3(0.0f, 0.0f, 0.0f);
}

CM_FN float cm_disc_pdf(CmLightHit hit) {
  return dot(hit.w, cm_disc_to) > cm_disc_cosine ? 1.0f / (6.28318531f * (1.0f - cm_disc_cosine)) : 0.0f;
}

CM_FN CmLightSample cm_disc_sample(CM_INOUT(CmPath) p, vec3 here, vec3 u) {
  float cosine = 1.0f - u.x * (1.0f - cm_disc_cosine);
  vec3 w = cm_around(cm_disc_to, cosine, 6.28318531f * u.y);
  return CmLightSample(CM_LIGHT_OTHER, cm_disc_radiance_in, w, 3.0e38f,
                       1.0f / (6.28318531f * (1.0f - cm_disc_cosine)));
}

#endif
