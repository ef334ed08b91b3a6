// Sequences: frames by ranges and by file names.

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <string>
#include <vector>

#include "frame_pattern.hpp"
#include "frame_plan.hpp"
#include "frame_row.hpp"
#include "support/folder.hpp"

namespace {

using namespace cumulet::demo;
using Frames = std::vector<Frame>;
using Moments = std::vector<Moment>;
using cumulet::test::Folder;

/// The error message of a rejected call, "" if it succeeds.
template <class Call>
std::string refusal(Call&& call) {
  try {
    static_cast<void>(call());
    return "";
  } catch (const UsageError& error) {
    return error.what();
  }
}

std::string file(const std::string& pattern, Frame frame) {
  const auto parsed = FramePattern::parse(pattern);
  return parsed ? parsed->file(frame) : "none";
}

std::string neighbour(const std::string& path, Frame frame) {
  const auto found = FramePattern::of_file(path);
  return found ? found->file(frame) : "none";
}

void write(const std::filesystem::path& path, const std::string& text) { std::ofstream(path) << text; }

TEST(Frames, RangesAreReadInTheirOrder) {
  EXPECT_EQ(parse_frames("5"), (Moments{5}));
  EXPECT_EQ(parse_frames("0"), (Moments{0}));
  EXPECT_EQ(parse_frames("0012"), (Moments{12}));
  EXPECT_EQ(parse_frames("1-4"), (Moments{1, 2, 3, 4}));
  EXPECT_EQ(parse_frames("3-3"), (Moments{3}));
  EXPECT_EQ(parse_frames("1-10x3"), (Moments{1, 4, 7, 10}));
  EXPECT_EQ(parse_frames("1-9x3"), (Moments{1, 4, 7}));
  EXPECT_EQ(parse_frames("1-3,7"), (Moments{1, 2, 3, 7}));
  EXPECT_EQ(parse_frames("7,1-3"), (Moments{7, 1, 2, 3}));
  EXPECT_EQ(parse_frames("1-20x10,1-3"), (Moments{1, 11, 2, 3})) << "each once";
  EXPECT_EQ(parse_frames("9999998-9999999"), (Moments{9999998, 9999999}));
}

TEST(Frames, InvalidRangesAreRejectedByName) {
  EXPECT_EQ(refusal([] { return parse_frames("10-1"); }), "'10-1' is a descending range");
  EXPECT_EQ(refusal([] { return parse_frames("1-3,9-8"); }), "'9-8' is a descending range");
  EXPECT_EQ(refusal([] { return parse_frames("1-9x0"); }), "'1-9x0' has a step of 0");
  EXPECT_EQ(refusal([] { return parse_frames("1-9x0.000"); }), "'1-9x0.000' has a step of 0");
  EXPECT_EQ(refusal([] { return parse_frames("1-9x0.0625"); }), "'1-9x0.0625' has more than three decimals");
  EXPECT_EQ(refusal([] { return parse_frames("9999999.5"); }), "'9999999.5' has a frame above 9999999");
  EXPECT_EQ(refusal([] { return parse_frames("5x2"); }), "'5x2' has a step, but is not a range");
  EXPECT_EQ(refusal([] { return parse_frames("1-10000000"); }), "'1-10000000' has a frame above 9999999");
  EXPECT_EQ(refusal([] { return parse_frames("99999999999999999999"); }),
            "'99999999999999999999' has a frame above 9999999");
  EXPECT_EQ(refusal([] { return parse_frames("-10000000"); }), "'-10000000' has a frame below -9999999");
  EXPECT_EQ(refusal([] { return parse_frames("1--3"); }), "'1--3' is a descending range");
  EXPECT_EQ(refusal([] { return parse_frames("1-3x-1"); }), "'1-3x-1' has a negative step");
  for (const char* text :
       {"",      "a",    "1-",      "-",  "--5", "-5-",   "-1---3", "-5x2",   "-a", "- 5", "1,", ",1",
        "1-2-3", "1-3x", "1-3x2x2", "1.", ".5",  "1.5.5", "1-2x.5", "1.0005", " 1", "1:5", "+1"})
    EXPECT_NE(refusal([&] { return parse_frames(text); }), "") << text;
}

TEST(Frames, SubframesAreReadAsDecimals) {
  EXPECT_EQ(parse_frames("1-3x0.5"), (Moments{1, {1, 500}, 2, {2, 500}, 3}));
  EXPECT_EQ(parse_frames("1.5"), (Moments{{1, 500}}));
  EXPECT_EQ(parse_frames("0.9-1.3x0.1"), (Moments{{0, 900}, 1, {1, 100}, {1, 200}, {1, 300}}));
  EXPECT_EQ(parse_frames("7,7.0,7.125"), (Moments{7, {7, 125}})) << "each once";
  EXPECT_EQ(parse_frames("1-2x0.333"), (Moments{1, {1, 333}, {1, 666}, {1, 999}}));
  EXPECT_EQ(Moment(3, 50).text(), "3.05");
  EXPECT_EQ(Moment(3, 500).text(), "3.5");
  EXPECT_EQ(Moment(3).text(), "3");
  EXPECT_EQ(frames_text({1, 2, 3, {3, 500}, 4, {1, 500}}), "1, 1.5, 2, 3, 3.5, 4");
  EXPECT_EQ(FramePattern::parse("out.####.exr")->file(Moment(12, 250)), "out.0012.25.exr");
  EXPECT_EQ(FramePattern::parse("out.####.exr")->file(Moment(12), 2), "out.0012.00.exr");
  EXPECT_EQ(FramePattern::parse("out.####.exr")->file(Moment(12, 125), 2), "out.0012.125.exr");
}

TEST(Frames, MayBeNegative) {
  EXPECT_EQ(parse_frames("-5"), (Moments{-5}));
  EXPECT_EQ(parse_frames("-0"), (Moments{0}));
  EXPECT_EQ(parse_frames("-2-2"), (Moments{-2, -1, 0, 1, 2}));
  EXPECT_EQ(parse_frames("-3--1"), (Moments{-3, -2, -1}));
  EXPECT_EQ(parse_frames("-4-4x2"), (Moments{-4, -2, 0, 2, 4}));
  EXPECT_EQ(parse_frames("-4--2,0-1"), (Moments{-4, -3, -2, 0, 1}));
  EXPECT_EQ(parse_frames("-9999999"), (Moments{first_frame}));
  EXPECT_EQ(parse_frames("-1-0.5x0.5"), (Moments{-1, {-1, 500}, 0, {0, 500}}));
  EXPECT_EQ(parse_frames("-1.25"), (Moments{{-2, 750}}));
  EXPECT_EQ(Moment(-2, 750).text(), "-1.25");
  EXPECT_EQ(Moment(-1, 500).text(), "-0.5");
  EXPECT_EQ(Moment(-1).text(), "-1");
  EXPECT_LT(Moment(-2, 750), Moment(-1));
  EXPECT_EQ(frames_text({2, -2, -1, 0, 1, {-4, 500}}), "-3.5, -2-2");
  EXPECT_EQ(parse_frames(frames_text({-3, -2, -1})), (Moments{-3, -2, -1})) << "as it is written it is read";
}

TEST(Frames, ArePrintedCompactly) {
  EXPECT_EQ(frames_text({}), "");
  EXPECT_EQ(frames_text({4}), "4");
  EXPECT_EQ(frames_text({5, 4}), "4, 5");
  EXPECT_EQ(frames_text({20, 1, 2, 3, 7, 21, 22, 23}), "1-3, 7, 20-23");
}

TEST(FramePattern, SupportsSeveralNotations) {
  for (const char* pattern : {"a/fire.####.vdb", "a/fire.%04d.vdb", "a/fire.$F4.vdb", "a/fire.<frame04>.vdb",
                              "a/fire.<frame4>.vdb", "a/fire.%4d.vdb"}) {
    EXPECT_EQ(file(pattern, 12), "a/fire.0012.vdb") << pattern;
    EXPECT_EQ(file(pattern, 12345), "a/fire.12345.vdb") << pattern;
    EXPECT_EQ(FramePattern::parse(pattern)->text(), "a/fire.####.vdb");
  }
  for (const char* pattern : {"fire#.vdb", "fire%d.vdb", "fire$F.vdb", "fire<frame>.vdb"}) {
    EXPECT_EQ(file(pattern, 7), "fire7.vdb") << pattern;
    EXPECT_EQ(file(pattern, 107), "fire107.vdb") << pattern;
  }
  EXPECT_EQ(file("##", 3), "03");
}

TEST(FramePattern, RejectsNamesWithNoneOrSeveralPatterns) {
  for (const char* name : {"cloud.vdb", "cloud_0012.vdb", "100%.vdb", "%s.vdb", "a%04x.vdb", "<frames>.vdb", "$G4.vdb",
                           "####/cloud.vdb", "a %d/$F4/cloud.vdb", ""})
    EXPECT_FALSE(FramePattern::parse(name)) << name;
  EXPECT_EQ(refusal([] { return FramePattern::parse("a.##.b.##.vdb"); }),
            "'a.##.b.##.vdb' has two placeholders for the frame number");
  EXPECT_NE(refusal([] { return FramePattern::parse("a.##.%d.vdb"); }), "");
  EXPECT_EQ(refusal([] { return FramePattern::parse("a.%10d.vdb"); }),
            "'a.%10d.vdb' has a number of more than 9 digits");
  EXPECT_NE(refusal([] { return FramePattern::parse("a.$F99999999999999999999999"); }), "");
}

TEST(FramePattern, FindsNeighborsOfAFile) {
  EXPECT_EQ(neighbour("a/fluid_data_0010.vdb", 9), "a/fluid_data_0009.vdb");
  EXPECT_EQ(neighbour("fire7.vdb", 10), "fire10.vdb");
  EXPECT_EQ(neighbour("shot2_fire.0010.nvdb", 3), "shot2_fire.0003.nvdb") << "the last number counts";
  EXPECT_EQ(neighbour("fire.0010.v2a.vdb", 3), "fire.0010.v3a.vdb");
  EXPECT_EQ(neighbour("12/cloud.vdb", 3), "none") << "a folder's number is none";
  EXPECT_EQ(neighbour("cloud.vdb", 3), "none");
  EXPECT_EQ(neighbour("cloud.1234567890.vdb", 3), "none");
  EXPECT_EQ(neighbour("0012", 3), "0003");
  EXPECT_EQ(neighbour("smoke-0010.vdb", 9), "smoke-0009.vdb") << "the minus separates words";
  EXPECT_EQ(neighbour("neg.-002.vdb", 1), "neg.0001.vdb") << "here it is a sign";
  EXPECT_EQ(neighbour("neg.-2.vdb", -10), "neg.-10.vdb");
}

// In C, Houdini and ffmpeg the sign counts as a digit. In Blender it does not.
TEST(FramePattern, PadsNegativeNumbersLikeExistingFiles) {
  EXPECT_EQ(file("out.####.exr", -2), "out.-002.exr");
  EXPECT_EQ(file("out.%04d.exr", -12345), "out.-12345.exr");
  EXPECT_EQ(file("out.#.exr", -2), "out.-2.exr");
  EXPECT_EQ(FramePattern::parse("out.####.exr")->file(Moment(-2, 500)), "out.-001.5.exr");
  const Folder folder;
  for (const char* name : {"c.-002.vdb", "c.-001.vdb", "c.0000.vdb", "c.0001.vdb", "b.-0002.vdb", "b.-0001.vdb",
                           "b.0000.vdb", "b.0001.vdb"})
    write(folder / name, "x");
  for (const char* name : {"c.####.vdb", "b.####.vdb"}) {
    auto pattern = FramePattern::parse(folder / name);
    pattern->adopt_padding();
    EXPECT_EQ(pattern->frames_there(), (Frames{-2, -1, 0, 1})) << name;
    EXPECT_EQ(pattern->passed_over(), "");
  }
  for (const char* name : {"c.-002.vdb", "c.-001.vdb", "c.0000.vdb", "b.-0002.vdb", "b.0001.vdb"}) {
    const auto row = FrameRow::around(folder / name);
    ASSERT_TRUE(row) << name;
    EXPECT_EQ(row->count(), 4U) << name;
    EXPECT_EQ(row->number(0), -2) << name;
    EXPECT_TRUE(std::filesystem::exists(row->file(0))) << row->file(0);
    EXPECT_EQ(row->index_of(-1), 1U);
    EXPECT_EQ(row->index_of(-9), 0U);
    EXPECT_EQ(row->position_of({-2, 500}), 0.5);
  }
}

TEST(FramePattern, ReportsSkippedFiles) {
  const Folder folder;
  for (const char* name : {"f.0001.vdb", "f.0002.vdb", "f.3.vdb", "f.04.vdb", "f.-1.vdb", "f.a.vdb", "f.0005.tmp"})
    write(folder / name, "x");
  const auto pattern = FramePattern::parse(folder / "f.####.vdb");
  EXPECT_EQ(pattern->passed_over(), (folder / "f.####.vdb").string() +
                                        ": files ignored because their frame numbers have another padding: f.-1.vdb, "
                                        "f.04.vdb, f.3.vdb");
  for (int i = 10; i < 20; ++i) write(folder / ("f." + std::to_string(i) + ".vdb"), "x");
  EXPECT_TRUE(pattern->passed_over().ends_with("f.11.vdb, f.12.vdb and 8 more")) << pattern->passed_over();
}

// In k_1001_v2.vdb the version is the last number. The frame number is the one that differs between files.
TEST(FramePattern, FrameNumberIsTheOneThatVaries) {
  const Folder folder;
  for (const char* name : {"k_1001_v2.vdb", "k_1002_v2.vdb", "k_1003_v2.vdb", "k_1003_v1.vdb"})
    write(folder / name, "x");
  EXPECT_EQ(neighbour(folder / "k_1001_v2.vdb", 1002), folder / "k_1002_v2.vdb");
}

TEST(FramePattern, LeadingZerosFollowExistingFiles) {
  const Folder folder;
  EXPECT_EQ(neighbour(folder / "a.100.vdb", 9), folder / "a.9.vdb");
  write(folder / "a.099.vdb", "");
  EXPECT_EQ(neighbour(folder / "a.100.vdb", 9), folder / "a.009.vdb");
}

TEST(FramePattern, FindsItsFramesAndNoOthers) {
  const Folder folder;
  for (const char* name : {"f.0010.vdb", "f.0002.vdb", "f.12345.vdb", "f.3.vdb", "f.00004.vdb", "f.0005.vdb.tmp",
                           "f..vdb", "g.0006.vdb", "f.-001.vdb", "f.00a7.vdb", "f.vdb"})
    write(folder / name, "x");
  EXPECT_EQ(FramePattern::parse(folder / "f.####.vdb")->frames_there(), (Frames{-1, 2, 10, 12345}));
  EXPECT_EQ(FramePattern::parse(folder / "f.#.vdb")->frames_there(), (Frames{3, 12345}));
  EXPECT_EQ(FramePattern::parse(folder / "none/f.####.vdb")->frames_there(), Frames{});
}

/// A plan of a folder's files.
class FrameSelection : public ::testing::Test {
 protected:
  FrameSelection() { options.output = "out.####.exr"; }
  void there(const char* name, std::size_t bytes) const { write(folder / name, std::string(bytes, 'x')); }
  std::string said() {
    try {
      plan = plan_frames(options);
      return "";
    } catch (const std::runtime_error& error) {
      return error.what();
    }
  }

  Folder folder;
  RenderOptions options;
  std::optional<FramePlan> plan;
};

TEST_F(FrameSelection, PatternSelectsAllExistingFrames) {
  there("f.0003.vdb", 10);
  there("f.0001.vdb", 30);
  there("f.0002.vdb", 30);
  options.scene.volume = folder / "f.%04d.vdb";
  options.stats = "s.$F.json";
  ASSERT_EQ(said(), "");
  ASSERT_TRUE(plan);
  ASSERT_EQ(plan->frames.size(), 3u);
  EXPECT_EQ(plan->frames[2].number, 3);
  EXPECT_EQ(plan->frames[2].volume, folder / "f.0003.vdb");
  EXPECT_EQ(plan->frames[2].output, "out.0003.exr");
  EXPECT_EQ(plan->frames[2].stats, "s.3.json");
  // Ordered by size, largest first; equal sizes in frame order. Independent of the requested frames.
  const std::vector<std::string> judged{folder / "f.0001.vdb", folder / "f.0002.vdb", folder / "f.0003.vdb"};
  EXPECT_EQ(plan->analyzed_by, judged);
  options.frames = {3, 9};
  ASSERT_EQ(said(), "");
  EXPECT_EQ(plan->analyzed_by, judged);
  ASSERT_EQ(plan->frames.size(), 2u);
  EXPECT_EQ(plan->frames[1].volume, folder / "f.0009.vdb") << "missing, which is reported in its turn";
}

TEST_F(FrameSelection, FileWithFramesSelectsItsNeighbors) {
  there("f_0003.vdb", 10);
  options.scene.volume = folder / "f_0003.vdb";
  ASSERT_EQ(said(), "");
  EXPECT_FALSE(plan);
  options.frames = {2};
  ASSERT_EQ(said(), "");
  EXPECT_EQ(plan->frames.at(0).volume, folder / "f_0002.vdb");
  EXPECT_EQ(plan->frames.at(0).output, "out.0002.exr");
}

TEST_F(FrameSelection, FileNameMayLookLikeAPattern) {
  there("cloud#1.vdb", 10);
  options.scene.volume = folder / "cloud#1.vdb";
  ASSERT_EQ(said(), "");
  EXPECT_FALSE(plan);
}

TEST_F(FrameSelection, SeveralFramesNeedANumberInTheOutput) {
  there("f.1.vdb", 10);
  there("f.2.vdb", 10);
  options.scene.volume = folder / "f.#.vdb";
  options.output = "out/pic.exr";
  EXPECT_EQ(said(),
            "--output: the name 'out/pic.exr' is used for 2 frames and needs a placeholder for the frame number, "
            "such as pic.####.exr");
  options.frames = {2};
  ASSERT_EQ(said(), "");
  EXPECT_EQ(plan->frames.at(0).output, "out/pic.exr");
  options.frames = {};
  options.output = "a.##.##.exr";
  EXPECT_EQ(said(), "--output: 'a.##.##.exr' has two placeholders for the frame number");
  options.output = "a.##.exr";
  options.stats = "s.json";
  EXPECT_NE(said().find("--stats: the name 's.json'"), std::string::npos);
}

TEST_F(FrameSelection, NonSequencesAreRejected) {
  options.scene.volume = folder / "f.####.vdb";
  EXPECT_EQ(said(), options.scene.volume + ": no matching file exists");
  options.scene.volume = folder / "cloud.vdb";
  options.frames = {1};
  EXPECT_NE(said().find("cloud.vdb' has no frame number and no placeholder"), std::string::npos);
  options.scene.volume = "";
  EXPECT_EQ(said(), "--frames needs a volume, but the scene has none");
  options.frames = {};
  ASSERT_EQ(said(), "");
  EXPECT_FALSE(plan);
  options.overwrite = true;
  EXPECT_NE(said().find("--overwrite"), std::string::npos);
}

TEST_F(FrameSelection, SceneFrameIsSelected) {
  for (const char* name : {"f.1.vdb", "f.2.vdb", "f.3.vdb"}) there(name, 10);
  options.scene.volume = folder / "f.#.vdb";
  options.scene.sequence.frame = 2;
  options.output = "pic.exr";
  ASSERT_EQ(said(), "");
  ASSERT_EQ(plan->frames.size(), 1U);
  EXPECT_EQ(plan->frames[0].number, 2);
  options.frames = {1, 3};
  options.output = "pic.#.exr";
  ASSERT_EQ(said(), "");
  EXPECT_EQ(plan->frames.size(), 2U);
}

TEST_F(FrameSelection, SubframesNeedBothFiles) {
  for (const char* name : {"f.0010.vdb", "f.0012.vdb", "f.0014.vdb"}) there(name, 10);
  options.scene.volume = folder / "f.####.vdb";
  options.scene.sequence.playback.frames_per_second = 10.0;
  options.frames = {10, {10, 500}, {11, 250}, {14, 500}};
  ASSERT_EQ(said(), "");
  ASSERT_EQ(plan->frames.size(), 4U);
  EXPECT_FALSE(plan->frames[0].next);
  const auto& quarter = plan->frames[1];
  EXPECT_EQ(quarter.volume, folder / "f.0010.vdb");
  EXPECT_EQ(quarter.output, "out.0010.50.exr");
  std::vector<std::string> outputs;
  for (const PlannedFrame& frame : plan->frames) outputs.push_back(frame.output);
  EXPECT_EQ(outputs.front(), "out.0010.00.exr");
  EXPECT_TRUE(std::ranges::is_sorted(outputs)) << "by name they come as they are played";
  ASSERT_TRUE(quarter.next);
  EXPECT_EQ(quarter.next->volume, folder / "f.0012.vdb");
  EXPECT_EQ(quarter.next->part, 1U);
  EXPECT_EQ(quarter.next->parts, 4U);
  EXPECT_EQ(quarter.next->frames, 2U);
  EXPECT_DOUBLE_EQ(quarter.seconds, 0.025);
  EXPECT_EQ(plan->frames[2].next->part, 5U);
  EXPECT_EQ(plan->frames[2].next->parts, 8U);
  EXPECT_EQ(plan->frames[3].volume, folder / "f.0014.vdb");
  EXPECT_EQ(plan->frames[3].next->volume, folder / "f.0016.vdb") << "missing, which is reported in its turn";
  options.frames = {{10, 333}};
  EXPECT_EQ(said(), "frame 10.333: the files are 2 frames apart, and this is not a multiple of 1/1000 of that");
}

TEST_F(FrameSelection, NegativeFramesAreSupported) {
  for (const char* name : {"n.-002.vdb", "n.-001.vdb", "n.0000.vdb", "n.0001.vdb", "n.0002.vdb"}) there(name, 10);
  options.scene.volume = folder / "n.####.vdb";
  ASSERT_EQ(said(), "");
  std::vector<std::string> outputs;
  for (const PlannedFrame& frame : plan->frames) outputs.push_back(frame.output);
  EXPECT_EQ(outputs,
            (std::vector<std::string>{"out.-002.exr", "out.-001.exr", "out.0000.exr", "out.0001.exr", "out.0002.exr"}));
  EXPECT_EQ(plan->passed_over, "");
  EXPECT_EQ(plan->analyzed_by.size(), 5U);
  EXPECT_DOUBLE_EQ(plan->frames[2].seconds, 2.0 / 24.0) << "the clock begins with the first";
  options.frames = parse_frames("-2-0x0.5");
  ASSERT_EQ(said(), "");
  ASSERT_EQ(plan->frames.size(), 5U);
  EXPECT_EQ(plan->frames[1].volume, folder / "n.-002.vdb") << "-1.5 is between -2 and -1";
  EXPECT_EQ(plan->frames[1].next->volume, folder / "n.-001.vdb");
  EXPECT_EQ(plan->frames[1].output, "out.-001.5.exr");
  options.frames = {};
  options.scene.sequence.frame = -1;
  ASSERT_EQ(said(), "");
  ASSERT_EQ(plan->frames.size(), 1U);
  EXPECT_EQ(plan->frames[0].volume, folder / "n.-001.vdb");
  there("n.-1.vdb", 10);
  ASSERT_EQ(said(), "");
  EXPECT_NE(plan->passed_over.find("n.-1.vdb"), std::string::npos);
}

TEST_F(FrameSelection, RangesMayHaveGapsAndSteps) {
  for (const char* name : {"f.0010.vdb", "f.0014.vdb", "f.0012.vdb", "f.0020.vdb", "other.0011.vdb"}) there(name, 10);
  const auto row = FrameRow::of_name(folder / "f.####.vdb");
  ASSERT_TRUE(row);
  EXPECT_EQ(row->count(), 6U);
  EXPECT_EQ(row->number(1), 12);
  EXPECT_EQ(row->file(3), (folder / "f.0016.vdb").string());
  EXPECT_EQ(row->index_of(12), 1U);
  EXPECT_EQ(row->index_of(3), 0U);
  EXPECT_EQ(row->index_of(99), 5U);
  EXPECT_EQ(row->position_of(12), 1.0);
  EXPECT_EQ(row->position_of({12, 500}), 1.25);
  EXPECT_EQ(row->position_of({20, 500}), 5.0);
  EXPECT_EQ(by_size(row->files()).size(), 6U);
  EXPECT_EQ(FrameRow::around(folder / "f.0012.vdb")->count(), 6U);
  EXPECT_FALSE(FrameRow::around(folder / "other.0011.vdb")) << "it is alone";
  EXPECT_FALSE(FrameRow::of_name(folder / "f.0012.vdb"));
  EXPECT_FALSE(FrameRow::of_name(""));
  EXPECT_THROW(static_cast<void>(FrameRow::of_name(folder / "none.####.vdb")), std::runtime_error);
  for (const char* name : {"far.1.vdb", "far.2.vdb", "far.9000000.vdb"}) there(name, 10);
  EXPECT_THROW(static_cast<void>(FrameRow::of_name(folder / "far.#.vdb")), std::runtime_error);
  EXPECT_FALSE(FrameRow::around(folder / "far.1.vdb"));
}

TEST(FrameLine, PrintsEachState) {
  EXPECT_EQ(frame_line(12, 3, 20, FrameState::done, "out.0012.exr in 8.21 s"),
            "frame 12 (3 of 20) done out.0012.exr in 8.21 s");
  EXPECT_EQ(frame_line(1, 1, 1, FrameState::kept, "a.exr"), "frame 1 (1 of 1) kept a.exr");
  EXPECT_EQ(frame_line(1, 1, 1, FrameState::failed, "a\nb.vdb: no"), "frame 1 (1 of 1) failed a b.vdb: no");
}

TEST(FrameOutput, EmptyFileDoesNotCount) {
  const Folder folder;
  EXPECT_FALSE(is_made(folder / "a.exr"));
  write(folder / "a.exr", "");
  EXPECT_FALSE(is_made(folder / "a.exr"));
  write(folder / "a.exr", "x");
  EXPECT_TRUE(is_made(folder / "a.exr"));
  EXPECT_FALSE(is_made(folder.path()));
}

}  // namespace
