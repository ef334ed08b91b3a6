// Writes the seeds of array_fuzz into a folder: NRRD, VTK images and TIFF stacks.

#include <tiffio.h>
#include <zlib.h>

#include <cstdint>
#include <string>
#include <vector>

#include "fuzz/seed_folder.hpp"
#include "support/base64.hpp"

namespace {

constexpr int side = 9;

std::string bytes_of_values() {
  std::string bytes;
  for (int i = 0; i < side * side * side; ++i) bytes += static_cast<char>(i % 7);
  return bytes;
}

/// Compresses with a header of zlib, or of gzip.
std::string packed(const std::string& bytes, bool gzip) {
  z_stream zip{};
  deflateInit2(&zip, Z_BEST_COMPRESSION, Z_DEFLATED, gzip ? MAX_WBITS + 16 : MAX_WBITS, 8, Z_DEFAULT_STRATEGY);
  std::string in = bytes;
  std::string out(deflateBound(&zip, in.size()), '\0');
  zip.next_in = reinterpret_cast<Bytef*>(in.data());
  zip.avail_in = static_cast<uInt>(in.size());
  zip.next_out = reinterpret_cast<Bytef*>(out.data());
  zip.avail_out = static_cast<uInt>(out.size());
  deflate(&zip, Z_FINISH);
  out.resize(zip.total_out);
  deflateEnd(&zip);
  return out;
}

std::string number(std::size_t value) {
  std::string text;
  for (unsigned shift = 0; shift < 32; shift += 8) text += static_cast<char>(value >> shift & 0xFFU);
  return text;
}

/// attributes: of <VTKFile>. format: of the array. values: between its tags. after: behind <ImageData>.
std::string vti(const std::string& attributes, const std::string& format, const std::string& values,
                const std::string& after = "") {
  return "<VTKFile type=\"ImageData\" byte_order=\"LittleEndian\" header_type=\"UInt32\"" + attributes +
         "><ImageData WholeExtent=\"0 8 0 8 0 8\" Origin=\"0 0 0\" Spacing=\"1 1 2\"><Piece Extent=\"0 8 0 8 0 8\">"
         "<PointData><DataArray type=\"UInt8\" Name=\"density\" format=" +
         format + ">" + values + "</DataArray></PointData></Piece></ImageData>" + after + "</VTKFile>";
}

std::string appended(const std::string& encoding, const std::string& data) {
  return "<AppendedData encoding=\"" + encoding + "\">_" + data + "</AppendedData>";
}

/// Writes a stack of two pages. tile: side of tiles; 0: strips.
void write_tiff(const std::string& file, const char* mode, std::uint16_t bits, std::uint16_t compression,
                std::uint16_t predictor, std::uint32_t tile) {
  TIFF* tiff = TIFFOpen(file.c_str(), mode);
  for (int page = 0; page < 2; ++page) {
    TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, side);
    TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, side);
    TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, bits);
    TIFFSetField(tiff, TIFFTAG_SAMPLEFORMAT, bits == 32 ? SAMPLEFORMAT_IEEEFP : SAMPLEFORMAT_UINT);
    TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, 1);
    TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK);
    TIFFSetField(tiff, TIFFTAG_COMPRESSION, compression);
    if (predictor > 1) TIFFSetField(tiff, TIFFTAG_PREDICTOR, predictor);
    TIFFSetField(tiff, TIFFTAG_XRESOLUTION, 4.0F);
    TIFFSetField(tiff, TIFFTAG_YRESOLUTION, 4.0F);
    TIFFSetField(tiff, TIFFTAG_IMAGEDESCRIPTION, "ImageJ=1.53t\nimages=2\nspacing=0.5\nunit=mm\n");
    if (tile > 0) {
      TIFFSetField(tiff, TIFFTAG_TILEWIDTH, tile);
      TIFFSetField(tiff, TIFFTAG_TILELENGTH, tile);
    } else {
      TIFFSetField(tiff, TIFFTAG_ROWSPERSTRIP, 4);
    }
    const std::uint32_t parts = tile > 0 ? TIFFNumberOfTiles(tiff) : TIFFNumberOfStrips(tiff);
    for (std::uint32_t part = 0; part < parts; ++part) {
      std::vector<char> bytes(static_cast<std::size_t>(tile > 0 ? TIFFTileSize(tiff) : TIFFStripSize(tiff)), 0x3C);
      if (tile > 0) {
        TIFFWriteEncodedTile(tiff, part, bytes.data(), static_cast<tmsize_t>(bytes.size()));
      } else {
        TIFFWriteEncodedStrip(tiff, part, bytes.data(), static_cast<tmsize_t>(bytes.size()));
      }
    }
    TIFFWriteDirectory(tiff);
  }
  TIFFClose(tiff);
}

}  // namespace

int main(int argc, char** argv) {
  const cumulet::test::SeedFolder folder(argc, argv);
  const std::string values = bytes_of_values();
  const std::string nrrd = "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 9 9 9\nspacings: 1 1 2\n";
  folder.write("raw.nrrd", nrrd + "encoding: raw\n\n" + values);
  folder.write("gzip.nrrd", nrrd + "encoding: gzip\n\n" + packed(values, true));
  folder.write("vectors.nrrd",
               "NRRD0005\ntype: short\ndimension: 4\nsizes: 3 3 9 9\nkinds: vector domain domain domain\nendian: big\n"
               "space directions: none (1,0,0) (0,1,0) (0,0,1)\nspace origin: (1,2,3)\nencoding: gzip\n\n" +
                   packed(values + values, true));
  std::string text;
  for (const char value : values) text += std::to_string(static_cast<int>(value)) + ' ';
  folder.write("ascii.nrrd", nrrd + "encoding: ascii\n\n" + text);
  const std::string zlib = " compressor=\"vtkZLibDataCompressor\"";
  const std::string first = "\"appended\" offset=\"0\"";
  const std::string counted = number(values.size()) + values;
  folder.write("raw.vti", vti("", first, "", appended("raw", counted)));
  folder.write("inline.vti", vti("", "\"binary\"", cumulet::test::base64(counted)));
  folder.write("ascii.vti", vti("", "\"ascii\"", text));
  const std::string block = packed(values, false);
  const std::string table = number(1) + number(values.size()) + number(0) + number(block.size());
  folder.write("zlib.vti", vti(zlib, first, "", appended("raw", table + block)));
  folder.write("base64.vti",
               vti(zlib, first, "", appended("base64", cumulet::test::base64(table) + cumulet::test::base64(block))));
  const auto tiff = [&](const char* name) { return (folder.path() / name).string(); };
  write_tiff(tiff("plain.tif"), "wl", 8, COMPRESSION_NONE, 1, 0);
  write_tiff(tiff("lzw.tif"), "wb", 16, COMPRESSION_LZW, 2, 0);
  write_tiff(tiff("tiles.tif"), "wl8", 16, COMPRESSION_ADOBE_DEFLATE, 1, 16);
  write_tiff(tiff("floats.tif"), "wl", 32, COMPRESSION_ADOBE_DEFLATE, 3, 0);
  write_tiff(tiff("packbits.tif"), "wb8", 8, COMPRESSION_PACKBITS, 1, 0);
  return 0;
}
