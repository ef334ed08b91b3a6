// Metadata of an image's OpenEXR file, read with OpenEXR's own library.

#include <ImfArray.h>
#include <ImfChannelList.h>
#include <ImfDoubleAttribute.h>
#include <ImfFrameBuffer.h>
#include <ImfInputFile.h>
#include <ImfStandardAttributes.h>
#include <ImfStringAttribute.h>
#include <ImfVecAttribute.h>
#include <cumulet/cumulet.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdio>
#include <layers.hpp>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <vector>

#include "aovs.hpp"
#include "headless.hpp"
#include "merge.hpp"
#include "metadata.hpp"
#include "object_name.hpp"
#include "support/folder.hpp"

namespace {

using cumulet::demo::SceneOptions;
using cumulet::headless::Backend;
using cumulet::headless::Context;

constexpr std::uint32_t width = 96;
constexpr std::uint32_t height = 64;
// Position of the only voxel.
constexpr std::array<double, 3> position{3.0, -1.0, 2.0};

struct Destroy {
  void operator()(cumulet_viewer* viewer) const { cumulet_destroy(viewer); }
};

class RenderedExr : public testing::TestWithParam<Backend> {
 protected:
  RenderedExr() : context_(Context::create(GetParam())) {
    cumulet_create_desc desc{};
    desc.struct_size = sizeof desc;
    desc.get_proc = Context::get_proc;
    desc.get_proc_user = &context_;
    cumulet_viewer* viewer = nullptr;
    std::array<char, 1024> error{};
    EXPECT_EQ(cumulet_create(&desc, &viewer, error.data(), error.size()), CUMULET_OK) << error.data();
    viewer_.reset(viewer);
    const float value = 1.0F;
    cumulet_dense_desc dense{};
    dense.struct_size = sizeof dense;
    dense.values = &value;
    dense.value_count = 1;
    dense.size[0] = dense.size[1] = dense.size[2] = 1;
    const std::array<double, 16> to_world{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, position[0], position[1], position[2], 1};
    std::copy(to_world.begin(), to_world.end(), dense.index_to_world);
    cumulet_volume* volume = nullptr;
    EXPECT_EQ(cumulet_volume_from_dense(&dense, &volume, error.data(), error.size()), CUMULET_OK) << error.data();
    EXPECT_EQ(cumulet_set_volume(viewer, volume), CUMULET_OK);
    cumulet_volume_release(volume);
    scene_.camera.eye[0] = 1.0;
    scene_.camera.eye[2] = 14.0;
    scene_.camera.target[0] = 2.0;
    scene_.camera.up[0] = 0.6;
    scene_.camera.up[1] = 0.8;
    scene_.camera.fovy_degrees = 35.0;
    scene_.medium.density_scale = 8.0;
    scene_.light.sky_radiance[0] = scene_.light.sky_radiance[1] = 1.0F;
    scene_.sampling.samples = 4;
    scene_.sampling.seed = 3000000000U;
    scene_.sampling.preview = CUMULET_PREVIEW_OFF;
  }

  void render() {
    cumulet_camera* camera = nullptr;
    ASSERT_EQ(cumulet_get_camera(viewer_.get(), &camera), CUMULET_OK);
    ASSERT_EQ(cumulet_camera_set(camera, &scene_.camera), CUMULET_OK);
    cumulet_camera_release(camera);
    ASSERT_EQ(cumulet_set_medium(viewer_.get(), &scene_.medium), CUMULET_OK);
    ASSERT_EQ(cumulet_set_sun_sky(viewer_.get(), &scene_.light), CUMULET_OK);
    ASSERT_EQ(cumulet_set_sampling(viewer_.get(), &scene_.sampling), CUMULET_OK);
    ASSERT_EQ(cumulet_wait(viewer_.get(), -1.0), CUMULET_OK);
    cumulet_frame_desc frame{};
    frame.struct_size = sizeof frame;
    frame.target = CUMULET_TARGET_NONE;
    frame.width = width;
    frame.height = height;
    frame.budget_ms = 100.0;
    cumulet_frame_result result{};
    result.struct_size = sizeof result;
    while ((result.flags & CUMULET_RENDER_CONVERGED) == 0) {
      ASSERT_EQ(cumulet_render(viewer_.get(), &frame, &result), CUMULET_OK) << cumulet_last_error(viewer_.get());
    }
  }

  std::string write(const char* name) {
    std::vector<float> rgba(std::size_t{4} * width * height);
    EXPECT_EQ(cumulet_read_linear(viewer_.get(), rgba.data(), rgba.size()), CUMULET_OK);
    const std::string file = (folder_ / name).string();
    cumulet::demo::ObjectName object_name;
    if (mattes_) {
      object_name = [&](cumulet_object_kind kind, std::uint64_t tag) {
        return cumulet::demo::object_name(scene_, {}, kind, tag);
      };
    }
    cumulet::demo::write_exr(viewer_.get(), file, cumulet::demo::windows_of(scene_.sampling.region, width, height),
                             {.beauty = rgba, .light_groups = scene_.light_groups, .object_name = object_name}, aovs_,
                             cumulet::demo::metadata_of(viewer_.get(), scene_, width, height));
    return file;
  }

  // The alpha-weighted mean position in OpenEXR's NDC.
  static Imath::V2d middle(Imf::InputFile& file) {
    std::vector<float> alpha(std::size_t{width} * height);
    Imf::FrameBuffer pixels;
    pixels.insert("A",
                  Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(alpha.data()), sizeof(float), sizeof(float) * width));
    file.setFrameBuffer(pixels);
    file.readPixels(0, static_cast<int>(height) - 1);
    Imath::V2d sum(0.0, 0.0);
    double all = 0.0;
    for (std::size_t y = 0; y < height; ++y) {
      for (std::size_t x = 0; x < width; ++x) {
        const double a = alpha[y * width + x];
        all += a;
        sum += a * Imath::V2d((double(x) + 0.5) / width, (double(y) + 0.5) / height);
      }
    }
    return sum / all;
  }

  SceneOptions scene_;
  std::vector<cumulet_aov> aovs_;
  bool mattes_ = false;
  Context context_;
  std::unique_ptr<cumulet_viewer, Destroy> viewer_;
  cumulet::test::Folder folder_;
};

TEST_P(RenderedExr, NoiseOfOneSampleIsUnknown) {
  cumulet_stats stats{};
  stats.struct_size = sizeof stats;
  ASSERT_EQ(cumulet_get_stats(viewer_.get(), &stats), CUMULET_OK);
  EXPECT_TRUE(std::isinf(stats.noise)) << "there is no picture yet";
  scene_.sampling.samples = 1;
  scene_.sampling.noise_target_percent = 5.0F;
  render();
  double noise = 0.0;
  ASSERT_EQ(cumulet_measure_noise(viewer_.get(), &noise), CUMULET_OK);
  EXPECT_TRUE(std::isinf(noise) && noise > 0.0) << "so it is below no target: " << noise;
  ASSERT_EQ(cumulet_get_stats(viewer_.get(), &stats), CUMULET_OK);
  EXPECT_TRUE(std::isinf(stats.noise));
  const std::string path = write("one.exr");
  EXPECT_EQ(Imf::InputFile(path.c_str()).header().findTypedAttribute<Imf::DoubleAttribute>("cumulet:noise"), nullptr);
}

TEST_P(RenderedExr, MetadataDescribesTheRendering) {
  render();
  const std::string path = write("a.exr");
  const Imf::InputFile file(path.c_str());
  const Imf::Header& header = file.header();
  const auto text = [&](const char* name) { return header.typedAttribute<Imf::StringAttribute>(name).value(); };
  const auto number = [&](const char* name) { return header.typedAttribute<Imf::DoubleAttribute>(name).value(); };
  const auto three = [&](const char* name) { return header.typedAttribute<Imf::V3dAttribute>(name).value(); };
  ASSERT_TRUE(Imf::hasComments(header));
  EXPECT_EQ(Imf::comments(header), "Cumulet " + text("cumulet:version") + ", 4 samples per pixel");
  EXPECT_EQ(text("cumulet:grid_type"), "tetrahedral");
  EXPECT_EQ(number("cumulet:samples"), 4.0);
  EXPECT_EQ(number("cumulet:seed"), 3e9);
  double noise = 0.0;
  ASSERT_EQ(cumulet_measure_noise(viewer_.get(), &noise), CUMULET_OK);
  EXPECT_GT(noise, 0.0);
  EXPECT_EQ(number("cumulet:noise"), noise);
  EXPECT_EQ(three("cumulet:eye"), Imath::V3d(1.0, 0.0, 14.0));
  EXPECT_EQ(three("cumulet:target"), Imath::V3d(2.0, 0.0, 0.0));
  EXPECT_EQ(number("cumulet:fovy_degrees"), 35.0);
  EXPECT_FALSE(Imf::hasCapDate(header)) << "the same picture is the same file";
  EXPECT_FALSE(Imf::hasOwner(header));

  // Samples and seed do not affect the scene's hash; all other settings do.
  const std::string hash = text("cumulet:scene");
  EXPECT_EQ(hash.size(), 16U);
  SceneOptions other = scene_;
  other.sampling.samples = 7;
  other.sampling.seed = 1;
  EXPECT_EQ(cumulet::demo::scene_hash(other), hash);
  other.medium.density_scale = 9.0;
  EXPECT_NE(cumulet::demo::scene_hash(other), hash);
}

// Compared with the renderer's own image. (merge_test compares with samples.)
TEST_P(RenderedExr, SevenMergedPartsEqualTheFullRendering) {
  scene_.sampling.separate_volume_aov = 1;
  aovs_ = {CUMULET_AOV_VOLUME, CUMULET_AOV_TRANSMITTANCE, CUMULET_AOV_VOLUME_DEPTH, CUMULET_AOV_VELOCITY,
           CUMULET_AOV_ERROR};
  std::vector<std::string> parts;
  for (const std::uint32_t samples : {5U, 1U, 8U, 2U, 1U, 4U, 3U}) {
    scene_.sampling.samples = samples;
    render();
    parts.push_back(write(("part" + std::to_string(parts.size()) + ".exr").c_str()));
    scene_.sampling.first_sample += samples;
  }
  scene_.sampling.first_sample = 0;
  scene_.sampling.samples = 24;
  render();
  const std::string whole = write("whole.exr");
  const std::string merged = (folder_ / "merged.exr").string();
  EXPECT_EQ(cumulet::demo::merge(parts, merged).samples, 24u);

  namespace layers = cumulet::image::layers;
  const auto expect_alike = [&](const cumulet::image::LayerName& layer, double tolerance) {
    const std::vector<float> wanted = cumulet::image::read_exr(whole, layer).values;
    const std::vector<float> made = cumulet::image::read_exr(merged, layer).values;
    ASSERT_EQ(made.size(), wanted.size());
    for (std::size_t i = 0; i < made.size(); ++i)
      EXPECT_NEAR(made[i], wanted[i], tolerance * (1.0 + std::abs(wanted[i]))) << layer.name << " " << i;
  };
  expect_alike(layers::beauty, 1e-6);
  expect_alike(layers::volume, 1e-6);
  expect_alike(layers::transmittance, 0.0);
  expect_alike(layers::volume_depth, 0.0);
  // The renderer's own error is computed from moments in single precision.
  expect_alike(layers::error, 1e-3);
  const auto said = [](const std::string& file) { return cumulet::image::read_contents(file); };
  EXPECT_EQ(said(merged).channels, said(whole).channels);
  const auto ours = said(merged).attributes;
  const auto its = said(whole).attributes;
  ASSERT_EQ(ours.size(), its.size());
  for (std::size_t i = 0; i < ours.size(); ++i) {
    EXPECT_EQ(ours[i].name, its[i].name);
    if (ours[i].name == "cumulet:noise") {
      EXPECT_NEAR(std::get<double>(ours[i].value), std::get<double>(its[i].value), 1e-4);
    } else {
      EXPECT_EQ(ours[i].value, its[i].value) << ours[i].name;
    }
  }
  // Samples other than 0 to 4, of another scene.
  scene_.sampling = SceneOptions().sampling;
  scene_.sampling.preview = CUMULET_PREVIEW_OFF;
  scene_.sampling.samples = 3;
  scene_.sampling.first_sample = 24;
  scene_.sampling.seed = 3000000000U;
  scene_.medium.density_scale = 3.0;
  aovs_ = {};
  render();
  EXPECT_THROW(cumulet::demo::merge({parts[0], write("other.exr")}, merged), std::runtime_error);
}

TEST_P(RenderedExr, LightGroupLayersSumToTheImage) {
  scene_.light.sun_group = 1;
  for (float& value : scene_.light.sun_irradiance) value = 2.0F;
  scene_.sampling.light_groups = 2;
  scene_.light_groups = {"sky", "key_light"};
  render();
  const std::string whole = write("whole.exr");
  scene_.sampling.first_sample = scene_.sampling.samples;
  render();
  const std::string merged = (folder_ / "merged.exr").string();
  cumulet::demo::merge({whole, write("next.exr")}, merged);
  for (const std::string& file : {whole, merged}) {
    const std::vector<float> sky = cumulet::image::read_exr(file, {"Combined_sky", "RGB"}).values;
    const std::vector<float> key = cumulet::image::read_exr(file, {"Combined_key_light", "RGB"}).values;
    const std::vector<float> all = cumulet::image::read_exr(file, cumulet::image::layers::beauty).values;
    double sun = 0.0;
    for (std::size_t i = 0; i < sky.size(); ++i) {
      ASSERT_NEAR(sky[i] + key[i], all[i / 3 * 4 + i % 3], 1e-5) << file << ' ' << i;
      sun += double{key[i]};
    }
    EXPECT_GT(sun, 1.0);
  }
}

// As Cryptomatte's specification requires, read with OpenEXR's library and a JSON parser.
TEST_P(RenderedExr, HasCryptomattesByName) {
  scene_.name = "a \"cloud\" of \xc3\xa4ther";
  scene_.ground.mode = CUMULET_GROUND_AT_HEIGHT;
  scene_.ground.height = -3.0;
  ASSERT_EQ(cumulet_set_ground(viewer_.get(), &scene_.ground), CUMULET_OK);
  mattes_ = true;
  render();
  const std::string path = write("mattes.exr");
  Imf::InputFile file(path.c_str());
  const auto text = [&](const std::string& name) {
    return file.header().typedAttribute<Imf::StringAttribute>("cryptomatte/3ae39a5/" + name).value();
  };
  EXPECT_EQ(text("name"), "CryptoObject");
  EXPECT_EQ(text("hash"), "MurmurHash3_32");
  EXPECT_EQ(text("conversion"), "uint32_to_float32");
  const nlohmann::json manifest = nlohmann::json::parse(text("manifest"));
  std::array<char, 9> digits{};
  std::snprintf(digits.data(), digits.size(), "%08x", cumulet_cryptomatte_id(scene_.name.c_str()));
  EXPECT_EQ(manifest, (nlohmann::json{{"ground", "c5b51ede"}, {scene_.name, digits.data()}}));
  EXPECT_EQ(cumulet_cryptomatte_id("CryptoObject") >> 4U, 0x3ae39a5U);

  std::array<std::vector<float>, 12> channels;
  Imf::FrameBuffer pixels;
  for (std::size_t i = 0; i < channels.size(); ++i) {
    channels.at(i).resize(std::size_t{width} * height);
    const std::string name =
        std::string("CryptoObject0").append(std::to_string(i / 4)).append(".").append(1, "RGBA"[i % 4]);
    ASSERT_NE(file.header().channels().findChannel(name), nullptr) << name;
    EXPECT_EQ(file.header().channels()[name].type, Imf::FLOAT);
    pixels.insert(name, Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(channels.at(i).data()), sizeof(float),
                                   sizeof(float) * width));
  }
  file.setFrameBuffer(pixels);
  file.readPixels(0, static_cast<int>(height) - 1);
  std::map<std::uint32_t, double> sums;
  for (std::size_t rank = 0; rank < 6; ++rank) {
    for (std::size_t i = 0; i < channels[0].size(); ++i)
      sums[std::bit_cast<std::uint32_t>(channels.at(2 * rank)[i])] += double(channels.at(2 * rank + 1)[i]);
  }
  EXPECT_EQ(sums.size(), 3U) << "and nothing";
  EXPECT_EQ(sums[0], 0.0);
  EXPECT_GT(sums[cumulet_cryptomatte_id("ground")], 100.0);
  EXPECT_GT(sums[cumulet_cryptomatte_id(scene_.name.c_str())], 4.0);

  // Partial renders have the same metadata, and so has their merged image.
  scene_.sampling.first_sample = scene_.sampling.samples;
  render();
  const std::string merged = (folder_ / "merged.exr").string();
  cumulet::demo::merge({path, write("next.exr")}, merged);
  for (const char* name : {"CryptoObject00", "CryptoObject01", "CryptoObject02"}) {
    const cumulet::image::LayerName layer{name, "RGBA"};
    const auto wanted = cumulet::image::read_exr(path, layer).values;
    EXPECT_EQ(cumulet::image::read_exr(merged, layer).values, wanted);
    EXPECT_EQ(cumulet::image::read_exr((folder_ / "next.exr").string(), layer).values, wanted);
  }
}

TEST(ObjectName, ComesFromTheSceneOrTheFile) {
  SceneOptions scene;
  const cumulet::demo::Instances others;
  const auto name = [&](cumulet_object_kind kind, std::uint64_t tag) {
    return cumulet::demo::object_name(scene, others, kind, tag);
  };
  scene.volume = "folder/cloud.vdb";
  scene.surfaces = "folder/house.glb";
  scene.models.resize(2);
  scene.models[0].file = "folder/tree.glb";
  scene.models[1].name = "oak";
  EXPECT_EQ(name(CUMULET_OBJECT_VOLUME, 0), "cloud.vdb");
  EXPECT_EQ(name(CUMULET_OBJECT_SURFACES, 0), "house.glb");
  EXPECT_EQ(name(CUMULET_OBJECT_SURFACES, 1), "tree.glb");
  EXPECT_EQ(name(CUMULET_OBJECT_SURFACES, 2), "oak");
  EXPECT_EQ(name(CUMULET_OBJECT_GROUND, 0), "ground");
  scene.name = "steam";
  EXPECT_EQ(name(CUMULET_OBJECT_VOLUME, 0), "steam");
}

// Pixels of a render region equal those of the whole image, and its partial renders can be merged.
TEST_P(RenderedExr, RegionIsAWindowOfTheFullImage) {
  namespace layers = cumulet::image::layers;
  aovs_ = {CUMULET_AOV_VOLUME_DEPTH};
  render();
  const std::string whole = write("whole.exr");
  constexpr std::array region{0.25F, 0.5F, 0.5F, 0.25F};
  std::ranges::copy(region, scene_.sampling.region);
  render();
  const std::string part = write("part.exr");
  const cumulet::image::Windows windows = cumulet::image::read_contents(part).windows;
  EXPECT_EQ(windows, (cumulet::image::Windows{width / 2, height / 4, width / 4, height / 2, width, height}));
  for (const cumulet::image::LayerName& layer : {layers::beauty, layers::volume_depth}) {
    const std::vector<float> all = cumulet::image::read_exr(whole, layer).values;
    const std::vector<float> made = cumulet::image::read_exr(part, layer).values;
    const std::size_t channels = layer.channels.size();
    ASSERT_EQ(made.size(), channels * windows.width * windows.height);
    for (std::size_t i = 0; i < made.size(); ++i) {
      const std::size_t x = windows.left + i / channels % windows.width;
      const std::size_t y = windows.top + i / channels / windows.width;
      ASSERT_EQ(made[i], all[(y * width + x) * channels + i % channels]) << layer.name << ' ' << x << ", " << y;
    }
  }
  const auto samples = [](const std::string& file) {
    const auto said = cumulet::image::read_contents(file).attributes;
    return std::get<double>(std::ranges::find(said, "cumulet:samples", &cumulet::image::Attribute::name)->value);
  };
  EXPECT_EQ(samples(part), samples(whole));
  scene_.sampling.first_sample = scene_.sampling.samples;
  render();
  const std::string merged = (folder_ / "merged.exr").string();
  EXPECT_EQ(cumulet::demo::merge({part, write("next.exr")}, merged).samples, 2U * scene_.sampling.samples);
  EXPECT_EQ(cumulet::image::read_contents(merged).windows, windows);
  EXPECT_THROW(cumulet::demo::merge({whole, write("next.exr")}, merged), std::runtime_error);
}

TEST_P(RenderedExr, MatricesProjectTheVolumeIntoTheImage) {
  for (const bool orthographic : {false, true}) {
    if (orthographic) scene_.camera.orthographic_height = 9.0;
    render();
    const std::string path = write("a.exr");
    Imf::InputFile file(path.c_str());
    ASSERT_TRUE(Imf::hasWorldToCamera(file.header()) && Imf::hasWorldToNDC(file.header()));
    const Imath::V3d at(position[0], position[1], position[2]);
    const Imath::M44d to_camera(Imf::worldToCamera(file.header()));
    const Imath::M44d to_ndc(Imf::worldToNDC(file.header()));
    const Imath::V3d ndc = at * to_ndc;
    const Imath::V2d seen = middle(file);
    EXPECT_NEAR(ndc.x, seen.x, 0.02) << orthographic;
    EXPECT_NEAR(ndc.y, seen.y, 0.02) << orthographic;
    EXPECT_GT(std::abs(seen.x - 0.5) + std::abs(seen.y - 0.5), 0.1) << "a mirrored picture would pass";
    // In camera space the eye is at the origin, the target ahead, and objects on the right are on the right.
    const Imath::V3d eye = Imath::V3d(1.0, 0.0, 14.0) * to_camera;
    EXPECT_NEAR(eye.length(), 0.0, 1e-5);
    const Imath::V3d target = Imath::V3d(2.0, 0.0, 0.0) * to_camera;
    EXPECT_NEAR(target.z, std::sqrt(197.0), 1e-4);
    EXPECT_NEAR(std::hypot(target.x, target.y), 0.0, 1e-5);
    const Imath::V3d volume = at * to_camera;
    EXPECT_EQ(volume.x > 0.0, seen.x > 0.5);
    EXPECT_EQ(volume.y > 0.0, seen.y < 0.5);
    if (orthographic) continue;
    // The image's upper right corner, at unit distance, projects to the corner of the window.
    const Imath::V2f center = file.header().screenWindowCenter();
    const double side = file.header().screenWindowWidth();
    const Imath::V3d corner(center.x + 0.5 * side, center.y + 0.5 * side * height / width, 1.0);
    const Imath::V3d at_corner = corner * to_camera.inverse() * to_ndc;
    EXPECT_NEAR(at_corner.x, 1.0, 1e-5);
    EXPECT_NEAR(at_corner.y, 0.0, 1e-5);
  }
}

INSTANTIATE_TEST_SUITE_P(Gl, RenderedExr, testing::Values(Backend::egl, Backend::osmesa),
                         [](const auto& given) { return given.param == Backend::egl ? "egl" : "osmesa"; });

}  // namespace
