// The sources of a build without optional features refuse their files by one line that names the option.
#include <gtest/gtest.h>

#include <array>
#include <functional>
#include <string>

#include "ocio_lut.hpp"
#include "surface/draco_mesh.hpp"
#include "surface/meshopt.hpp"
#include "surface/webp.hpp"
#include "volume/array_file.hpp"
#include "volume/import_detail.hpp"

namespace {

using namespace cumulet::surface::detail;

std::string error_of(const std::function<void()>& call) {
  try {
    call();
  } catch (const std::exception& error) {
    return error.what();
  }
  return "no error";
}

TEST(WithoutFeatures, FilesAreRefusedWithTheOption) {
  Budget budget({}, nullptr);
  EXPECT_EQ(error_of([] { (void)cumulet::volume::detail::open_vdb(nullptr, nullptr); }),
            "is an OpenVDB file, which this build of Cumulet does not read (CUMULET_OPENVDB=OFF)");
  EXPECT_EQ(error_of([] { (void)cumulet::volume::detail::open_nanovdb(nullptr, nullptr); }),
            "is a NanoVDB file, which this build of Cumulet does not read (CUMULET_NANOVDB=OFF)");
  EXPECT_EQ(error_of([] { (void)cumulet::volume::detail::open_tiff(nullptr, nullptr); }),
            "is a TIFF file, which this build of Cumulet does not read (CUMULET_TIFF=OFF)");
  EXPECT_EQ(error_of([] { (void)cumulet::volume::detail::open_tiff_slices({}, nullptr); }),
            "is a folder of TIFF files, which this build of Cumulet does not read (CUMULET_TIFF=OFF)");
  EXPECT_EQ(error_of([&] { (void)decode_draco({}, nullptr, "mesh 0", budget); }),
            "mesh 0 is compressed by Draco, which this build of Cumulet does not read (CUMULET_DRACO=OFF)");
  EXPECT_EQ(error_of([&] { (void)decode_meshopt({}, {}, nullptr, "buffer view 1", budget); }),
            "buffer view 1 is compressed by meshoptimizer, which this build of Cumulet does not read "
            "(CUMULET_MESHOPT=OFF)");
  const std::string webp = "is a WebP image, which this build of Cumulet does not read (CUMULET_WEBP=OFF)";
  EXPECT_EQ(error_of([] { (void)read_webp_size({}); }), webp);
  EXPECT_EQ(error_of([] { (void)decode_webp({}, {}); }), webp);
  const std::string ocio = "--ocio a.ocio: this program was built without OpenColorIO (CUMULET_OCIO)";
  EXPECT_EQ(error_of([] { (void)cumulet::demo::bake_ocio_view({.config = "a.ocio"}); }), ocio);
  EXPECT_EQ(error_of([] { (void)cumulet::demo::ocio_displays("a.ocio"); }), ocio);
}

}  // namespace
