// VTK's image data as volumes.

#include <gtest/gtest.h>
#include <zlib.h>

#include <cstdint>
#include <string>
#include <vector>

#include "support/array_files.hpp"
#include "support/base64.hpp"
#include "volume/inspection.hpp"

namespace {

using namespace cumulet;
using test::base64;
using test::bytes_of;
using test::in_grid;
using volume::ScalarVolume;

class VtiFile : public test::ArrayFile {
 protected:
  /// The cause of a failure to read a file with this content.
  [[nodiscard]] std::string cause(const std::string& content) const { return refusal(content, "bad.vti"); }
};

std::string number_bytes(std::uint64_t number, std::size_t bytes, bool swapped = false) {
  std::string text;
  for (std::size_t i = 0; i < bytes; ++i) text += static_cast<char>(number >> (8 * i) & 0xFFU);
  return swapped ? std::string(text.rbegin(), text.rend()) : text;
}

std::string zlib_block(const std::string& bytes) {
  std::string out(compressBound(bytes.size()), '\0');
  uLongf size_of_out = out.size();
  EXPECT_EQ(compress(reinterpret_cast<Bytef*>(out.data()), &size_of_out, reinterpret_cast<const Bytef*>(bytes.data()),
                     bytes.size()),
            Z_OK);
  out.resize(size_of_out);
  return out;
}

/// How a file holds its values.
struct Form {
  std::size_t width = 4;  ///< bytes of the numbers before the values
  bool compressed = false;
  bool coded = false;  ///< base64
  bool swapped = false;
};

/// Returns values as VTK writes them; compressed in blocks of 64 bytes.
std::string data_of(const std::string& bytes, const Form& form) {
  const auto coded = [&](const std::string& part) { return form.coded ? base64(part) : part; };
  const auto number = [&](std::uint64_t n) { return number_bytes(n, form.width, form.swapped); };
  if (!form.compressed) return coded(number(bytes.size()) + bytes);
  constexpr std::size_t block = 64;
  const std::size_t count = (bytes.size() + block - 1) / block;
  std::string table = number(count) + number(block) + number(bytes.size() % block);
  std::string blocks;
  for (std::size_t i = 0; i < count; ++i) {
    const std::string packed = zlib_block(bytes.substr(i * block, block));
    table += number(packed.size());
    blocks += packed;
  }
  return coded(table) + coded(blocks);
}

/// The attributes of <VTKFile>.
std::string attributes_of(const Form& form) {
  return std::string(form.swapped ? R"(byte_order="BigEndian")" : R"(byte_order="LittleEndian")") +
         (form.width == 8 ? R"( header_type="UInt64")" : "") +
         (form.compressed ? R"( compressor="vtkZLibDataCompressor")" : "");
}

std::string vti(const std::string& file, const std::string& arrays, const std::string& after = "",
                const std::string& extent = "2 6 0 3 0 2") {
  return "<?xml version=\"1.0\"?>\n<VTKFile type=\"ImageData\" " + file + ">\n <ImageData WholeExtent=\"" + extent +
         "\" Origin=\"1 2 3\" Spacing=\"0.5 2 1\">\n" +
         "<FieldData><DataArray type=\"Float64\" Name=\"TimeValue\" format=\"ascii\">1</DataArray></FieldData>" +
         "  <Piece Extent=\"" + extent + "\">" + arrays + "</Piece></ImageData>\n" + after + "</VTKFile>";
}

/// Returns an array of points. attributes: without the name.
std::string points(const std::string& attributes, const std::string& text = "") {
  return "<PointData Scalars='density'><DataArray Name=\"density\" " + attributes + ">" + text +
         "</DataArray></PointData>";
}

std::string appended(const std::string& encoding, const std::string& data) {
  return "<AppendedData encoding=\"" + encoding + "\">\n _" + data + "\n</AppendedData>";
}

const std::string raw_array = points(R"(type="UInt8" format="appended" offset="0")");

TEST_F(VtiFile, PlacesPointsAndCells) {
  const std::string floats = data_of(bytes_of<float>(), {});
  ScalarVolume got =
      read(write("a.vti", vti("header_type=\"UInt32\"", points(R"(type="Float32" format="appended" offset="4")"),
                              appended("raw", "junk" + floats))));
  expect_values(got);
  EXPECT_EQ(got.index_to_world, glm::dmat4(0.5, 0, 0, 0, 0, 2, 0, 0, 0, 0, 1, 0, 2, 2, 3, 1));

  const std::string cells =
      "<CellData><DataArray type=\"UInt16\" Name=\"density\" NumberOfComponents=\"1\" "
      "format=\"appended\" offset=\"0\"></DataArray></CellData>";
  const Form form{.width = 8, .compressed = true};
  got = read(write("b.vti", vti(attributes_of(form), cells, appended("raw", data_of(bytes_of<std::uint16_t>(), form)),
                                "0 5 0 4 0 3")));
  expect_values(got);
  EXPECT_EQ(got.index_to_world[3], glm::dvec4(1.25, 3, 3.5, 1));
}

TEST_F(VtiFile, ReadsEachEncoding) {
  for (const std::size_t width : {4U, 8U}) {
    for (const bool compressed : {false, true}) {
      for (const bool swapped : {false, true}) {
        SCOPED_TRACE(testing::Message() << width << " " << compressed << " " << swapped);
        Form form{.width = width, .compressed = compressed, .coded = true, .swapped = swapped};
        const std::string file = attributes_of(form);
        const std::string bytes = bytes_of<std::int16_t>(swapped);
        const std::string coded = data_of(bytes, form);
        expect_values(
            read(write("a.vti", vti(file, points(R"(type="Int16" format="binary")", "\n  " + coded + "\n ")))));
        // A second array begins behind the characters of the first.
        const std::string other = data_of(std::string(60, '\0'), form);
        const std::string second =
            points("type=\"Int16\" format=\"appended\" offset=\"" + std::to_string(other.size()) + "\"");
        expect_values(read(write("a.vti", vti(file, second, appended("base64", other + coded)))));
        form.coded = false;
        const std::string array = points(R"(type="Int16" format="appended" offset="0")");
        expect_values(read(write("a.vti", vti(file, array, appended("raw", data_of(bytes, form))))));
      }
    }
  }
}

std::string text_of_values() {
  std::string text;
  for (int i = 0; i < 60; ++i)
    text += std::to_string(test::value_of({i % 5, i / 5 % 4, i / 20})) + (i % 6 == 5 ? "\n" : " ");
  return text;
}

TEST_F(VtiFile, ReadsText) {
  // The compressor does not concern text.
  const std::string file = "compressor=\"vtkZLibDataCompressor\"";
  expect_values(read(write("a.vti", vti(file, points(R"(type="Float64" format="ascii")", text_of_values())))));
  expect_values(read(write("a.vti", vti(file, points(R"(type="Float64")", text_of_values())))));
  std::string tiny = "4.9e-324 -1e-60 2.5";
  for (int i = 3; i < 60; ++i) tiny += " 0";
  const ScalarVolume got = read(write("a.vti", vti("", points(R"(type="Float64" format="ascii")", tiny))));
  EXPECT_EQ(got.max_value, 2.5F);
}

TEST_F(VtiFile, HasInlineAndAppendedArrays) {
  const auto array = [](const std::string& name, const std::string& attributes, const std::string& text) {
    return "<DataArray type=\"UInt8\" Name=\"" + name + "\" " + attributes + ">" + text + "</DataArray>";
  };
  const Form form{.coded = true};
  const std::string values = data_of(bytes_of<std::uint8_t>(), form);
  const std::string arrays = "<PointData>" + array("pairs", "NumberOfComponents=\"2\" format=\"binary\"", "AAAA") +
                             array("first", "format=\"binary\"", values) +
                             array("second", "format=\"appended\" offset=\"0\"", "") +
                             array("third", "format=\"ascii\"", text_of_values()) + "</PointData>";
  volume::Inspection inspection{FilePath(write("a.vti", vti("", arrays, appended("base64", values))))};
  ASSERT_EQ(inspection.grids().size(), 3U);
  for (std::size_t i = 0; i < 2; ++i) {
    ASSERT_TRUE(inspection.statistics(i).values);
    EXPECT_EQ(inspection.statistics(i).values->max, test::value_of({4, 3, 2}));
  }
}

TEST_F(VtiFile, TagsAreFoundAcrossPieces) {
  const std::string array =
      points(R"(type="UInt8" format="binary")", data_of(bytes_of<std::uint8_t>(), {.coded = true}));
  const std::size_t begin = vti("", array).find("<DataArray Name");
  constexpr std::size_t piece = std::size_t{1} << 18U;
  for (const std::size_t before : {std::size_t{0}, std::size_t{1}, std::size_t{20}, std::size_t{200}}) {
    // The piece ends so many characters behind the tag's begin.
    expect_values(read(write("a.vti", vti("", std::string(piece - begin - before, ' ') + array))));
  }
}

TEST_F(VtiFile, BadFilesAreOneLine) {
  EXPECT_EQ(cause(vti("compressor=\"vtkLZ4DataCompressor\"", raw_array)),
            "is compressed by vtkLZ4DataCompressor; vtkZLibDataCompressor is supported");
  EXPECT_EQ(cause(vti("", points(R"(type="UInt8" format="bits")"))),
            "has an array in the format bits; ascii, binary and appended are supported");
  EXPECT_EQ(cause(vti("", points(R"(type="String" format="appended" offset="0")"))),
            "has no array of numbers with 1 or 3 components");
  EXPECT_EQ(cause(vti("", raw_array, "", "2 x 0 3 0 2")), "cannot read Extent=\"2 x 0 3 0 2\"");
  EXPECT_EQ(cause(vti("", raw_array, appended("raw", ""), "2 1 0 3 0 2")),
            "its size is (0, 4, 3); each side is from 1 to 1048576");
  EXPECT_EQ(cause("<VTKFile type=\"PolyData\">"), "is a VTK file of the type PolyData, not ImageData");
  EXPECT_EQ(cause(vti("", raw_array)), "has an array whose values are appended, but no appended data");
  EXPECT_EQ(cause(vti("", raw_array, appended("base85", "AAAA"))),
            "has appended data in the encoding base85; raw and base64 are supported");
  EXPECT_EQ(cause(vti("", raw_array, "<AppendedData encoding=\"raw\"> AAAA")),
            "the file is damaged: its appended data do not begin with \"_\"");
  EXPECT_EQ(cause("<VTKFile type=\"ImageData\"><Piece Extent=\"0 1 0 1 0 1\"" + std::string(2 << 20U, ' ')),
            "the file is damaged: a tag has no end");
  std::string many;
  for (int i = 0; i < 5000; ++i) many += R"(<DataArray type="UInt8" Name="a" format="ascii">1</DataArray>)";
  EXPECT_EQ(cause(vti("", "<PointData>" + many + "</PointData>", "", "0 0 0 0 0 0")), "has more than 4096 arrays");
}

TEST_F(VtiFile, DamagedValuesAreOneLine) {
  const std::string undecodable = in_grid + "the file is damaged: its compressed values cannot be decoded";
  const std::string not_base64 = in_grid + "the file is damaged: its values are not base64";
  const std::string truncated = in_grid + "the file is truncated or damaged: unexpected end of file";
  const auto binary = [&](const Form& form, const std::string& data) {
    return cause(vti(attributes_of(form), points(R"(type="UInt8" format="binary")", data)));
  };
  const std::string bytes = bytes_of<std::uint8_t>();
  const Form plain{.coded = true};
  std::string data = data_of(bytes, plain);
  EXPECT_EQ(binary(plain, data), "no error");
  EXPECT_EQ(binary(plain, data.substr(0, 60)), in_grid + "the file is truncated: it has 41 of 60 values");
  EXPECT_EQ(binary(plain, data.substr(0, 83)), in_grid + "the file is truncated: it has 58 of 60 values");
  EXPECT_EQ(binary(plain, "AA"), in_grid + "the file is truncated: it has 0 of 60 values");
  EXPECT_EQ(binary(plain, ""), in_grid + "the file is truncated: it has 0 of 60 values");
  data[40] = '*';
  EXPECT_EQ(binary(plain, data), not_base64);
  data[40] = '=';
  EXPECT_EQ(binary(plain, data), not_base64);
  EXPECT_EQ(binary(plain, base64(number_bytes(59, 4) + bytes)),
            in_grid + "the file is damaged: it declares 59 bytes for the 60 of its values");

  const Form packed{.compressed = true, .coded = true};
  const auto numbers = [](const std::vector<std::uint64_t>& all) {
    std::string text;
    for (const std::uint64_t number : all) text += number_bytes(number, 4);
    return base64(text);
  };
  const std::string block = zlib_block(bytes);
  EXPECT_EQ(binary(packed, numbers({1, 60, 0, block.size()}) + base64(block)), "no error");
  EXPECT_EQ(binary(packed, numbers({1, 60, 0, block.size()}).substr(0, 22) + base64(block)), not_base64);
  EXPECT_EQ(binary(packed, numbers({1, 60, 0, block.size()})), truncated);
  EXPECT_EQ(binary(packed, numbers({1, 60, 0})), truncated);
  // Numbers that the file cannot have are refused before memory is allocated.
  EXPECT_EQ(binary(packed, numbers({0xFFFFFFFF, 60, 0, block.size()}) + base64(block)), undecodable);
  EXPECT_EQ(binary(packed, numbers({1, 0xFFFFFFFF, 0, block.size()}) + base64(block)), undecodable);
  EXPECT_EQ(binary(packed, numbers({1, 60, 0, 0xFFFFFFFF}) + base64(block)), truncated);
  const Form wide{.width = 8, .compressed = true};
  std::string damaged = data_of(bytes, wide);
  damaged[36] = static_cast<char>(damaged[36] ^ 0x55);
  EXPECT_EQ(cause(vti(attributes_of(wide), raw_array, appended("raw", damaged))), undecodable);
  EXPECT_NE(cause(vti(attributes_of(wide), raw_array, appended("raw", damaged.substr(0, 30)))), "no error");
  EXPECT_EQ(cause(vti("", points(R"(type="UInt8" format="ascii")", "1 2 3"), "", "0 1048575 0 1048575 0 1048575")),
            in_grid + "the file is truncated: it has 5 of 1152921504606846976 values");
  EXPECT_EQ(cause(vti("", points(R"(type="UInt8" format="ascii")", "1 two " + text_of_values()))),
            in_grid + "cannot read the value 'two'");
}

}  // namespace
