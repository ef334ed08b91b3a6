// Least-squares linear fit of a field over a cell; include after cell.glsl. Shared by GLSL and C++.
#ifndef CM_CELL_FIT_GLSL
#define CM_CELL_FIT_GLSL

struct CmFit {
  vec3 gradient;    // along the cell's frame axes, per unit
  float explained;  // part of the variance that the fit removes
};

// Inverse of the covariance of position over a tetrahedron of this class, sum (v - c)(v - c)^T / 20.
CM_FN mat3 cm_inverse_covariance(uint cell_class) {
  if (cell_class == 0u) return mat3(10.0f, 0.0f, 0.0f, 0.0f, 30.0f, -20.0f, 0.0f, -20.0f, 40.0f);
  if (cell_class == 1u) return mat3(40.0f, -20.0f, 0.0f, -20.0f, 40.0f, -20.0f, 0.0f, -20.0f, 40.0f);
  return mat3(10.0f, -5.0f, 5.0f, -5.0f, 10.0f, -5.0f, 5.0f, -5.0f, 30.0f);
}

// covariance: of position and field over the cell, in its frame, per unit. The gradient is scaled so that the fit about
// the mean is nowhere negative.
CM_FN CmFit cm_fit_linear(uint cell_class, vec3 covariance, float mean) {
  vec3 gradient = cm_inverse_covariance(cell_class) * covariance;
  vec3 middle = cm_frame_centroid(cell_class);
  float lowest = 0.0f;
  for (uint i = 0u; i < 4u; ++i) lowest = min(lowest, dot(gradient, cm_frame_vertex(cell_class, i) - middle));
  float scale = lowest < 0.0f && mean < -lowest ? mean / -lowest : 1.0f;
  CmFit fit;
  fit.gradient = scale * gradient;
  // Residual of the scaled fit: var - (2 s - s^2) g.cov
  fit.explained = (2.0f - scale) * scale * dot(gradient, covariance);
  return fit;
}

#endif
