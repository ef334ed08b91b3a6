// The decisions of a viewer, recorded without a GL context: which work it requests from its workers and in which order,
// the scenes and flags of its frames, failures and messages. Each script of stage_scripts has a record in
// stage_records. CUMULET_BLESS=1 writes the records of the present behavior.

#include <gtest/gtest.h>

#include <cstdlib>
#include <exception>
#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>

#include "stage_scripts/scripts.hpp"
#include "support/file_bytes.hpp"

namespace {

using cumulet::test::StageRecorder;
using cumulet::test::StageScript;

std::vector<StageScript> all_scripts() {
  std::vector<StageScript> all;
  for (const auto& some :
       {cumulet::test::volume_scripts(), cumulet::test::instance_scripts(), cumulet::test::limit_scripts(),
        cumulet::test::sequence_scripts(), cumulet::test::dynamic_volume_scripts(), cumulet::test::surface_scripts(),
        cumulet::test::light_scripts(), cumulet::test::camera_scripts(), cumulet::test::error_scripts()})
    all.insert(all.end(), some.begin(), some.end());
  return all;
}

std::filesystem::path file_of(const std::string& name) {
  return std::filesystem::path(CUMULET_STAGE_RECORDS) / (name + ".txt");
}

// The first line that differs, with the step that it belongs to; "" if the texts are equal.
std::string difference(const std::string& expected, const std::string& text) {
  std::istringstream before(expected);
  std::istringstream now(text);
  std::string step;
  for (int number = 1;; ++number) {
    std::string old_line;
    std::string new_line;
    const bool has_old = static_cast<bool>(std::getline(before, old_line));
    const bool has_new = static_cast<bool>(std::getline(now, new_line));
    if (!has_old && !has_new) return "";
    if (has_old != has_new || old_line != new_line) {
      return "line " + std::to_string(number) + " after \"" + step +
             "\"\n  record: " + (has_old ? old_line : "(ends)") + "\n  now:    " + (has_new ? new_line : "(ends)");
    }
    if (new_line.starts_with("#")) step = new_line;
  }
}

struct Record {
  std::string text;
  std::optional<std::string> skipped;
};

Record record(const StageScript& script) {
  StageRecorder recorder;
  script.run(recorder);
  return {recorder.text(), recorder.skipped()};
}

class StageRecord : public testing::TestWithParam<StageScript> {};

TEST_P(StageRecord, IsTheSame) {
  const Record first = record(GetParam());
  if (first.skipped) GTEST_SKIP() << *first.skipped;
  const std::filesystem::path path = file_of(GetParam().name);
  const char* bless = std::getenv("CUMULET_BLESS");
  if (bless == nullptr || std::string(bless) != "1") {
    ASSERT_TRUE(std::filesystem::exists(path)) << path << ": CUMULET_BLESS=1 writes it";
    const std::string expected = cumulet::test::bytes_of(path);
    std::string differs = difference(expected, first.text);
    // Rarely, a short job ends within the frame that requests it. Other decisions differ each time.
    for (int i = 0; i < 3 && !differs.empty(); ++i) differs = difference(expected, record(GetParam()).text);
    EXPECT_EQ(differs, "") << path;
    return;
  }
  // A record must not depend on time.
  for (int i = 0; i < 2; ++i) ASSERT_EQ(difference(first.text, record(GetParam()).text), "");
  std::filesystem::create_directories(path.parent_path());
  std::ofstream(path, std::ios::binary) << first.text;
}

INSTANTIATE_TEST_SUITE_P(Scripts, StageRecord, testing::ValuesIn(all_scripts()),
                         [](const testing::TestParamInfo<StageScript>& one) { return std::string(one.param.name); });

TEST(StageRecords, BelongToScripts) {
  std::set<std::string> names;
  for (const StageScript& script : all_scripts()) EXPECT_TRUE(names.insert(script.name).second) << script.name;
  EXPECT_GE(names.size(), 40U);
  const std::filesystem::path folder(CUMULET_STAGE_RECORDS);
  if (!std::filesystem::exists(folder)) return;
  for (const auto& entry : std::filesystem::directory_iterator(folder))
    EXPECT_TRUE(names.contains(entry.path().stem().string())) << entry.path() << " belongs to no script";
}

}  // namespace
