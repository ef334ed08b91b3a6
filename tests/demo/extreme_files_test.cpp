// cumulet-render with files of unusual values: temperatures in kelvin, and fill values.

#include <gtest/gtest.h>
#include <sys/wait.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <functional>
#include <iterator>
#include <stdexcept>
#include <string>
#include <vector>

#include "support/folder.hpp"
#include "support/openvdb.hpp"

namespace {

using openvdb::Coord;

struct Done {
  int status = 0;
  std::string said;  // on standard error
  std::vector<float> pixels;

  [[nodiscard]] bool says(const std::string& part) const { return said.find(part) != std::string::npos; }
  [[nodiscard]] double mean() const {
    double sum = 0.0;
    for (const float value : pixels) sum += double{value};
    return sum / static_cast<double>(pixels.size());
  }
};

class ExtremeFiles : public testing::Test {
 protected:
  static void SetUpTestSuite() { openvdb::initialize(); }

  [[nodiscard]] std::string path(const std::string& name) const { return (folder_ / name).string(); }
  void write(const std::string& name, const openvdb::GridPtrVec& grids) const {
    openvdb::io::File(path(name)).write(grids);
  }
  // Renders a small image with additional flags.
  [[nodiscard]] Done render(const std::string& name, const std::string& more = "") const {
    const std::string picture = path("picture.pfm");
    Done run = command(name, picture, more);
    run.pixels = pixels_of(picture);
    return run;
  }
  [[nodiscard]] Done command(const std::string& name, const std::string& picture, const std::string& more) const {
    const std::string line = std::string("'" CUMULET_RENDER "' '") + path(name) + "' --size 16x16 --spp 16 -o '" +
                             picture + "' " + more + " 2>&1 >/dev/null";
    Done run;
    FILE* said = popen(line.c_str(), "r");
    if (said == nullptr) throw std::runtime_error("cannot run a shell");
    for (int c = std::fgetc(said); c != EOF; c = std::fgetc(said)) run.said.push_back(static_cast<char>(c));
    const int ended = pclose(said);
    run.status = WIFEXITED(ended) ? WEXITSTATUS(ended) : -1;
    EXPECT_EQ(run.status, 0) << line << "\n" << run.said;
    return run;
  }
  static std::vector<float> pixels_of(const std::string& file) {
    std::ifstream stream(file, std::ios::binary);
    std::string header;
    for (int line = 0; line < 3; ++line) std::getline(stream, header);
    const std::vector<char> bytes{std::istreambuf_iterator<char>(stream), {}};
    std::vector<float> pixels(bytes.size() / sizeof(float));
    std::memcpy(pixels.data(), bytes.data(), pixels.size() * sizeof(float));
    return pixels;
  }

 private:
  cumulet::test::Folder folder_;
};

// A ball of 20^3 voxels: 1 in its center, 0 at its edge.
openvdb::FloatGrid::Ptr ball(const std::string& name, const std::function<float(float)>& value, int size = 20,
                             double voxel = 1.0) {
  auto grid = openvdb::FloatGrid::create(0.0F);
  grid->setName(name);
  grid->setGridClass(openvdb::GRID_FOG_VOLUME);
  grid->setTransform(openvdb::math::Transform::createLinearTransform(voxel));
  const float half = 0.5F * static_cast<float>(size - 1);
  for (Coord p(0, 0, 0); p.x() < size; ++p.x()) {
    for (p.y() = 0; p.y() < size; ++p.y()) {
      for (p.z() = 0; p.z() < size; ++p.z()) {
        const float away = std::hypot(float(p.x()) - half, float(p.y()) - half, float(p.z()) - half) / half;
        const float found = value(std::max(0.0F, 1.0F - away));
        if (found != 0.0F) grid->tree().setValue(p, found);
      }
    }
  }
  return grid;
}
openvdb::FloatGrid::Ptr smoke() {
  return ball("density", [](float middle) { return middle; });
}
openvdb::FloatGrid::Ptr heat(float most, int size = 20, double voxel = 1.0) {
  return ball(
      "temperature", [=](float middle) { return most * middle; }, size, voxel);
}

void expect_same_picture(const Done& a, const Done& b) {
  ASSERT_EQ(a.pixels.size(), b.pixels.size());
  ASSERT_GT(a.pixels.size(), 0U);
  for (std::size_t i = 0; i < a.pixels.size(); ++i)
    ASSERT_NEAR(a.pixels[i], b.pixels[i], 0.02F + 0.05F * std::abs(b.pixels[i])) << i;
}

TEST_F(ExtremeFiles, KelvinFilesEmitLikeRelativeTemperatures) {
  constexpr float most = 2250.0F;
  write("kelvin.vdb", {smoke(), heat(most)});
  write("relative.vdb", {smoke(), heat(most / 1500.0F)});
  const Done kelvin = render("kelvin.vdb");
  const Done relative = render("relative.vdb");
  EXPECT_TRUE(kelvin.says("note: ") && kelvin.says("has values above 20, which are read as kelvin")) << kelvin.said;
  EXPECT_FALSE(relative.says("kelvin")) << relative.said;
  EXPECT_TRUE(kelvin.says("the volume burns") && relative.says("the volume burns")) << kelvin.said;
  expect_same_picture(kelvin, relative);
  // Explicit settings override the detection.
  EXPECT_GT(render("kelvin.vdb", "--temperature-scale 3 --blackbody 1").mean(),
            3.0 * render("kelvin.vdb", "--temperature-scale 1 --blackbody 1").mean());
}

TEST_F(ExtremeFiles, KelvinOnlyFilesAreNotOverexposed) {
  write("kelvin.vdb", {heat(2250.0F)});
  write("relative.vdb", {heat(1.5F)});
  expect_same_picture(render("kelvin.vdb"), render("relative.vdb"));
}

TEST_F(ExtremeFiles, CoarserTemperatureGridEmits) {
  write("coarse.vdb", {smoke(), heat(2250.0F, 10, 2.0)});
  const Done coarse = render("coarse.vdb");
  EXPECT_TRUE(coarse.says("the volume burns") && coarse.says("has values above 20, which are read as kelvin"))
      << coarse.said;
  // Without other light.
  EXPECT_GT(render("coarse.vdb", "--sky 0,0,0").mean(), 1e-3);
  EXPECT_EQ(render("coarse.vdb", "--sky 0,0,0 --temperature-grid none --preset explosion").mean(), 0.0);
}

TEST_F(ExtremeFiles, WarmAirDoesNotEmit) {
  write("warm.vdb", {smoke(), ball("temperature", [](float) { return 293.0F; })});
  // Its emission is omitted, but the cells stay: the noise is the same.
  for (const std::string more : {"", "--blackbody 1"}) {
    const Done warm = render("warm.vdb", more);
    EXPECT_FALSE(warm.says("the volume burns")) << warm.said;
    expect_same_picture(warm, render("warm.vdb", more + " --blackbody-tint 1e-9,1e-9,1e-9"));
  }
}

TEST_F(ExtremeFiles, SmokeIsGrayUnlessTheAlbedoIsGiven) {
  write("cloud.vdb", {smoke()});
  write("heated.vdb", {smoke(), heat(0.1F)});
  write("hot.vdb", {smoke(), heat(600.0F)});
  write("shaded.vdb", {smoke(), ball("Shadow", [](float) { return -1.0F; })});
  auto domain = smoke();
  domain->insertMeta("file_base_resolution", openvdb::Vec3IMetadata({20, 20, 20}));
  write("mantaflow.vdb", {domain});
  write("weather.vdb", {smoke(), ball("temperature", [](float) { return 271.0F; })});
  // Fitted cameras and grounds also see the temperatures.
  const std::string view = "--camera '9.5,12,45 9.5,9.5,9.5 30' --ground none ";
  const Done white = render("cloud.vdb", view);
  const Done gray = render("cloud.vdb", view + "--preset smoke");
  EXPECT_FALSE(white.says("the volume is smoke")) << white.said;
  EXPECT_LT(gray.mean(), 0.9 * white.mean());
  for (const char* file : {"heated.vdb", "hot.vdb", "shaded.vdb", "mantaflow.vdb"}) {
    const Done found = render(file, view);
    EXPECT_TRUE(found.says("the volume is smoke: using --preset smoke")) << file << found.said;
    expect_same_picture(found, gray);
    const Done given = render(file, view + "--albedo 1,1,1");
    EXPECT_FALSE(given.says("the volume is smoke")) << given.said;
    EXPECT_NEAR(given.mean() / white.mean(), 1.0, 0.05) << file;
  }
  const Done weather = render("weather.vdb", view);
  EXPECT_FALSE(weather.says("the volume is smoke")) << weather.said;
  EXPECT_NEAR(weather.mean() / white.mean(), 1.0, 0.05);
}

TEST_F(ExtremeFiles, SmokeOfASceneKeepsTheSceneAlbedo) {
  write("cloud.vdb", {smoke()});
  write("heated.vdb", {smoke(), heat(0.1F)});
  const auto scene = [&](const std::string& first, const std::string& second, const std::string& albedo) {
    const std::string medium = R"("medium": {"density_scale": "auto")" + albedo + "}";
    std::ofstream(path("scene.json")) << R"({"cumulet_scene": 3, "volumes": [{"file": ")" << first << R"(", )" << medium
                                      << R"(}, {"file": ")" << second << R"(", "translate": [25, 0, 0], )" << medium
                                      << "}]}";
    const std::string picture = path("picture.pfm");
    Done run = command(first, picture, "--scene '" + path("scene.json") + "' --camera '20,12,70 20,9.5,9.5 40'");
    run.pixels = pixels_of(picture);
    return run;
  };
  const Done white = scene("cloud.vdb", "cloud.vdb", "");
  EXPECT_NEAR(scene("heated.vdb", "heated.vdb", R"(, "albedo": [1, 1, 1])").mean() / white.mean(), 1.0, 0.05);
  EXPECT_LT(scene("cloud.vdb", "heated.vdb", "").mean(), 0.98 * white.mean()) << "the second volume is gray";
  EXPECT_LT(scene("heated.vdb", "cloud.vdb", "").mean(), 0.98 * white.mean()) << "the first volume is gray";
}

TEST_F(ExtremeFiles, ObjectsTooSmallToBeSeenAreNamed) {
  write("cloud.vdb", {smoke()});
  const auto said = [&](const std::string& second, const std::string& more) {
    std::ofstream(path("scene.json")) << R"({"cumulet_scene": 3, "volumes": [{"file": "cloud.vdb"}, )"
                                      << R"({"file": "cloud.vdb", "name": "the second", )" << second << "}]}";
    return command("cloud.vdb", path("picture.pfm"), "--scene '" + path("scene.json") + "' " + more).said;
  };
  const std::string tiny = R"("scale": [0.005, 0.005, 0.005])";
  EXPECT_NE(said(tiny, "").find("the second is 20"), std::string::npos);
  EXPECT_EQ(said(R"("scale": [0.05, 0.05, 0.05])", "").find("times smaller"), std::string::npos);
  EXPECT_EQ(said(tiny, "--camera '0,0,60 0,0,0 40'").find("times smaller"), std::string::npos) << "a chosen view";
}

// When a fire goes out, its last frames have only a few kelvin.
TEST_F(ExtremeFiles, SequenceFramesShareOneScale) {
  write("fire.0001.vdb", {smoke(), heat(2250.0F)});
  write("fire.0002.vdb", {ball("density", [](float middle) { return middle > 0.5F ? 1.0F : 0.0F; }), heat(15.0F, 6)});
  const Done run = command("fire.####.vdb", path("p.####.pfm"), "");
  EXPECT_TRUE(run.says("has values above 20, which are read as kelvin")) << run.said;
  double brightest = 0.0;
  for (const float value : pixels_of(path("p.0002.pfm"))) brightest = std::max(brightest, double{value});
  EXPECT_GT(brightest, 0.0);
  EXPECT_LT(brightest, 10.0);
}

TEST_F(ExtremeFiles, NotesOfEveryVolumeOfASceneArePrinted) {
  write("first.vdb", {smoke()});
  write("second.vdb", {smoke(), heat(2250.0F)});
  std::ofstream(path("scene.json"))
      << R"({"cumulet_scene": 2, "volumes": [{"file": "first.vdb"}, {"file": "second.vdb"}]})";
  const Done run = command("first.vdb", path("picture.pfm"), "--scene '" + path("scene.json") + "'");
  EXPECT_TRUE(run.says("second.vdb") && run.says("has values above 20, which are read as kelvin")) << run.said;
}

TEST_F(ExtremeFiles, FillValuesAreCountedAndDrawnAsNothing) {
  for (const float fill : {9.97e36F, 1e31F, 3.4e38F, -9.97e36F}) {
    auto filled = smoke();
    auto without = smoke();
    for (int x = 8; x < 10; ++x) {
      for (int y = 8; y < 10; ++y) {
        filled->tree().setValue(Coord(x, y, 9), fill);
        without->tree().setValue(Coord(x, y, 9), 0.0F);
      }
    }
    write("filled.vdb", {filled});
    write("without.vdb", {without});
    const Done run = render("filled.vdb");
    EXPECT_TRUE(run.says("warning: ") && run.says("4 voxels above 1e30")) << run.said;
    expect_same_picture(run, render("without.vdb"));
  }
}

}  // namespace
