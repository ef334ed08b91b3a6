#pragma once

/* Private to surface/: JPEG decoding with libjpeg-turbo. It is in C because libjpeg reports errors by longjmp(),
 * which must not leave scopes of C++ objects. */

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

enum { cumulet_jpeg_text = 200 }; /* same as JMSG_LENGTH_MAX */

struct cumulet_jpeg_header {
  uint32_t width;
  uint32_t height;
  int arithmetic; /* 1: arithmetic coding; 0: Huffman coding */
};

/* Messages of libjpeg about a file. */
struct cumulet_jpeg_report {
  char error[cumulet_jpeg_text];  /* why it cannot be read */
  char damage[cumulet_jpeg_text]; /* why some of its pixels are wrong or gray; "": none are */
};

/* Returns 1, or 0 with an error in the report. */
int cumulet_jpeg_read_header(const uint8_t* bytes, size_t size, struct cumulet_jpeg_header* header,
                             struct cumulet_jpeg_report* report);
/* rgba must have room for the header's width and height. The file must have the same size. */
int cumulet_jpeg_decode(const uint8_t* bytes, size_t size, const struct cumulet_jpeg_header* header, uint8_t* rgba,
                        struct cumulet_jpeg_report* report);

#ifdef __cplusplus
}
#endif
