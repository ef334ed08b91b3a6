#include "surface/jpeg.h"

#include <setjmp.h>
#include <stdio.h>
#include <string.h>

/* Needs the headers above. */
#include <jpeglib.h>
/* Needs jpeglib.h. */
#include <jerror.h>

/* A legal progressive file may have one scan per coefficient and component. More scans would only take time. */
enum { max_scans = 64 * 4 };

/* Functions that call setjmp() only have a pointer to this struct, so its members are not clobbered. */
struct decoder {
  struct jpeg_decompress_struct info;
  struct jpeg_error_mgr errors;
  struct jpeg_progress_mgr progress;
  jmp_buf failed;
  struct cumulet_jpeg_report* report;
};

static void fail(j_common_ptr info) {
  struct decoder* const decoder = info->client_data;
  info->err->format_message(info, decoder->report->error);
  longjmp(decoder->failed, 1);
}

/* Returns true for warnings about missing or wrong pixels; other warnings concern data around them. */
static int is_damage(const struct decoder* decoder) {
  switch (decoder->errors.msg_code) {
    case JWRN_ARITH_BAD_CODE:
    case JWRN_BOGUS_PROGRESSION:
    case JWRN_HIT_MARKER:
    case JWRN_HUFF_BAD_CODE:
    case JWRN_MUST_RESYNC:
      return 1;
    case JWRN_JPEG_EOF:
      /* A missing end after the only scan has no visible effect. */
      return decoder->info.progressive_mode || decoder->info.comps_in_scan < decoder->info.num_components;
    default:
      return 0;
  }
}

static void hear(j_common_ptr info, int level) {
  struct decoder* const decoder = info->client_data;
  if (level >= 0) return;
  ++info->err->num_warnings;
  if (decoder->report->damage[0] == '\0' && is_damage(decoder)) {
    info->err->format_message(info, decoder->report->damage);
  }
}

static void say_nothing(j_common_ptr info) { (void)info; }

static void count_scans(j_common_ptr info) {
  struct decoder* const decoder = info->client_data;
  if (decoder->info.input_scan_number <= max_scans) return;
  (void)snprintf(decoder->report->error, sizeof decoder->report->error, "more than %d scans", (int)max_scans);
  longjmp(decoder->failed, 1);
}

static void begin(struct decoder* decoder, struct cumulet_jpeg_report* report) {
  memset(decoder, 0, sizeof *decoder);
  memset(report, 0, sizeof *report);
  decoder->report = report;
  decoder->info.client_data = decoder;
  decoder->info.err = jpeg_std_error(&decoder->errors);
  decoder->errors.error_exit = fail;
  decoder->errors.emit_message = hear;
  decoder->errors.output_message = say_nothing;
  decoder->progress.progress_monitor = count_scans;
}

/* Adobe's programs write the complement of inks, with their own marker. */
static void inks_to_rgba(uint8_t* row, uint32_t width, int complement) {
  for (uint32_t x = 0; x < width; ++x, row += 4) {
    const unsigned black = complement ? row[3] : 255U - row[3];
    for (int c = 0; c < 3; ++c) {
      const unsigned ink = complement ? row[c] : 255U - row[c];
      row[c] = (uint8_t)((ink * black + 127U) / 255U);
    }
    row[3] = 255;
  }
}

/* Reads up to the first scan. */
static void read_markers(struct decoder* decoder, const uint8_t* bytes, size_t size) {
  struct jpeg_decompress_struct* const info = &decoder->info;
  jpeg_create_decompress(info);
  info->progress = &decoder->progress;
  jpeg_mem_src(info, bytes, (unsigned long)size);
  (void)jpeg_read_header(info, TRUE);
}

static int try_header(struct decoder* decoder, const uint8_t* bytes, size_t size, struct cumulet_jpeg_header* header) {
  if (setjmp(decoder->failed) != 0) return 0;
  read_markers(decoder, bytes, size);
  header->width = decoder->info.image_width;
  header->height = decoder->info.image_height;
  header->arithmetic = decoder->info.arith_code;
  return 1;
}

static int try_decode(struct decoder* decoder, const uint8_t* bytes, size_t size,
                      const struct cumulet_jpeg_header* header, uint8_t* rgba) {
  struct jpeg_decompress_struct* const info = &decoder->info;
  if (setjmp(decoder->failed) != 0) return 0;
  read_markers(decoder, bytes, size);
  if (info->image_width != header->width || info->image_height != header->height) return 0;
  const int inks = info->jpeg_color_space == JCS_CMYK || info->jpeg_color_space == JCS_YCCK;
  info->out_color_space = inks ? JCS_CMYK : JCS_EXT_RGBA;
  (void)jpeg_start_decompress(info);
  while (info->output_scanline < info->output_height) {
    JSAMPROW row = rgba + (size_t)info->output_scanline * header->width * 4;
    (void)jpeg_read_scanlines(info, &row, 1);
    if (inks) inks_to_rgba(row, header->width, info->saw_Adobe_marker);
  }
  return 1;
}

int cumulet_jpeg_read_header(const uint8_t* bytes, size_t size, struct cumulet_jpeg_header* header,
                             struct cumulet_jpeg_report* report) {
  struct decoder decoder;
  begin(&decoder, report);
  const int good = try_header(&decoder, bytes, size, header);
  jpeg_destroy_decompress(&decoder.info);
  return good;
}

int cumulet_jpeg_decode(const uint8_t* bytes, size_t size, const struct cumulet_jpeg_header* header, uint8_t* rgba,
                        struct cumulet_jpeg_report* report) {
  struct decoder decoder;
  begin(&decoder, report);
  const int good = try_decode(&decoder, bytes, size, header, rgba);
  jpeg_destroy_decompress(&decoder.info);
  return good;
}
