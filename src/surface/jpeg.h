#pragma once

/* Private to surface/: JPEG by libjpeg-turbo. In C, since libjpeg reports errors by longjmp(), which must not leave
 * scopes of C++ objects. */

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

enum { cumulet_jpeg_text = 200 }; /* as JMSG_LENGTH_MAX */

struct cumulet_jpeg_header {
  uint32_t width;
  uint32_t height;
  int arithmetic; /* coded so; else by Huffman's codes */
};

/* What libjpeg says of a file. */
struct cumulet_jpeg_report {
  char error[cumulet_jpeg_text];  /* why it cannot be read */
  char damage[cumulet_jpeg_text]; /* why some of its pixels are wrong, or gray; "" if they are not */
};

/* Return 1, or 0 with an error in the report. */
int cumulet_jpeg_read_header(const uint8_t* bytes, size_t size, struct cumulet_jpeg_header* header,
                             struct cumulet_jpeg_report* report);
/* rgba has room for the width and height of the header, which the file must have. */
int cumulet_jpeg_decode(const uint8_t* bytes, size_t size, const struct cumulet_jpeg_header* header, uint8_t* rgba,
                        struct cumulet_jpeg_report* report);

#ifdef __cplusplus
}
#endif
