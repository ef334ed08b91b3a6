// Names of the reader's host in docs/howto/vulkan.md.
#define GL_GLEXT_PROTOTYPES
#include <GL/gl.h>
#include <GL/glext.h>
#include "host.h"

extern double view[16];
extern double projection[16];
extern GLuint64 size;
extern int fd;
extern GLuint scene_done;
extern GLuint volume_done;
extern GLuint volume_texture;
extern GLuint depth_texture;
extern cumulet_frame_result result;
