/*
 * Cumulet from C with EGL only: no window and no toolkit. Renders a volume into a framebuffer.
 *
 *     cumulet-embed-egl --volume FILE [--test OUT_DIR]      writes egl.ppm to OUT_DIR or the current folder
 */
#include <EGL/egl.h>
#include <EGL/eglext.h>
#include <GL/glcorearb.h>
#include <cumulet/cumulet.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { width = 240, height = 180 };

static void fail(const char* cause) {
  fprintf(stderr, "cumulet-embed-egl: %s\n", cause);
  exit(1);
}

/* Creates an OpenGL 4.5 core context without a surface on the first EGL device that supports it. */
static void make_context(void) {
  PFNEGLQUERYDEVICESEXTPROC query_devices = (PFNEGLQUERYDEVICESEXTPROC)eglGetProcAddress("eglQueryDevicesEXT");
  EGLDeviceEXT devices[16];
  EGLint count = 0;
  if (query_devices == NULL || !query_devices(16, devices, &count)) fail("EGL lists no devices");
  const EGLint attributes[] = {
      EGL_CONTEXT_MAJOR_VERSION,           4,       EGL_CONTEXT_MINOR_VERSION, 5, EGL_CONTEXT_OPENGL_PROFILE_MASK,
      EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT, EGL_NONE};
  for (EGLint i = 0; i < count; ++i) {
    EGLDisplay display = eglGetPlatformDisplay(EGL_PLATFORM_DEVICE_EXT, devices[i], NULL);
    if (!eglInitialize(display, NULL, NULL) || !eglBindAPI(EGL_OPENGL_API)) continue;
    EGLContext context = eglCreateContext(display, EGL_NO_CONFIG_KHR, EGL_NO_CONTEXT, attributes);
    if (context != EGL_NO_CONTEXT && eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, context)) return;
  }
  fail("no EGL device has OpenGL 4.5 core");
}

static void* get_proc(void* user, const char* name) {
  (void)user;
  union { /* ISO C has no cast from a function pointer to void* */
    __eglMustCastToProperFunctionPointerType function;
    void* pointer;
  } address = {eglGetProcAddress(name)};
  return address.pointer;
}

int main(int argc, char** argv) {
  const char* volume = NULL;
  const char* folder = ".";
  for (int i = 1; i + 1 < argc; i += 2) {
    if (strcmp(argv[i], "--volume") == 0) volume = argv[i + 1];
    if (strcmp(argv[i], "--test") == 0) folder = argv[i + 1];
  }
  if (volume == NULL) fail("usage: cumulet-embed-egl --volume FILE [--test OUT_DIR]");

  make_context();
  PFNGLCREATETEXTURESPROC create_textures = (PFNGLCREATETEXTURESPROC)eglGetProcAddress("glCreateTextures");
  PFNGLTEXTURESTORAGE2DPROC texture_storage = (PFNGLTEXTURESTORAGE2DPROC)eglGetProcAddress("glTextureStorage2D");
  PFNGLCREATEFRAMEBUFFERSPROC create_framebuffers =
      (PFNGLCREATEFRAMEBUFFERSPROC)eglGetProcAddress("glCreateFramebuffers");
  PFNGLNAMEDFRAMEBUFFERTEXTUREPROC framebuffer_texture =
      (PFNGLNAMEDFRAMEBUFFERTEXTUREPROC)eglGetProcAddress("glNamedFramebufferTexture");
  PFNGLBINDFRAMEBUFFERPROC bind_framebuffer = (PFNGLBINDFRAMEBUFFERPROC)eglGetProcAddress("glBindFramebuffer");
  PFNGLREADPIXELSPROC read_pixels = (PFNGLREADPIXELSPROC)eglGetProcAddress("glReadPixels");
  GLuint texture = 0;
  GLuint framebuffer = 0;
  create_textures(GL_TEXTURE_2D, 1, &texture);
  texture_storage(texture, 1, GL_RGBA8, width, height);
  create_framebuffers(1, &framebuffer);
  framebuffer_texture(framebuffer, GL_COLOR_ATTACHMENT0, texture, 0);

  char error[256];
  cumulet_viewer* viewer = NULL;
  const cumulet_create_desc create = {.struct_size = sizeof create, .get_proc = get_proc};
  if (cumulet_create(&create, &viewer, error, sizeof error) != CUMULET_OK) fail(error);
  const cumulet_sun_sky_desc light = {.struct_size = sizeof light,
                                      .sun_azimuth_degrees = 60,
                                      .sun_elevation_degrees = 40,
                                      .sun_irradiance = {2.6f, 2.5f, 2.3f},
                                      .sky_radiance = {0.2f, 0.3f, 0.5f}};
  const cumulet_sampling_desc sampling = {.struct_size = sizeof sampling, .samples = 16};
  if (cumulet_set_sun_sky(viewer, &light) != CUMULET_OK || cumulet_set_sampling(viewer, &sampling) != CUMULET_OK ||
      cumulet_load_volume(viewer, volume, NULL) != CUMULET_OK || cumulet_wait(viewer, -1.0) != CUMULET_OK)
    fail(cumulet_last_error(viewer));

  const cumulet_frame_desc frame = {.struct_size = sizeof frame,
                                    .budget_ms = 100,
                                    .framebuffer = framebuffer,
                                    .width = width,
                                    .height = height,
                                    .flip_y = 1};
  cumulet_frame_result result = {.struct_size = sizeof result};
  do {
    if (cumulet_render(viewer, &frame, &result) != CUMULET_OK) fail(cumulet_last_error(viewer));
  } while (!(result.flags & CUMULET_RENDER_CONVERGED));

  static unsigned char pixels[width * height * 3];
  bind_framebuffer(GL_READ_FRAMEBUFFER, framebuffer);
  read_pixels(0, 0, width, height, GL_RGB, GL_UNSIGNED_BYTE, pixels);
  cumulet_destroy(viewer);

  char path[4096];
  snprintf(path, sizeof path, "%s/egl.ppm", folder);
  FILE* file = fopen(path, "wb");
  if (file == NULL) fail("egl.ppm cannot be written");
  fprintf(file, "P6\n%d %d\n255\n", width, height);
  fwrite(pixels, 1, sizeof pixels, file);
  return fclose(file) == 0 ? 0 : 1;
}
