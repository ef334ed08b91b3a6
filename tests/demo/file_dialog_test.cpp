// The file dialogs of cumulet-demo: the list of a folder, and the program that shows the desktop's dialog.

#include <gtest/gtest.h>
#include <signal.h>  // NOLINT(modernize-deprecated-headers): kill() and SIGCHLD are of POSIX
#include <sys/types.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "desktop_dialog.hpp"
#include "file_facts.hpp"
#include "folder_list.hpp"
#include "support/folder.hpp"

namespace {

using namespace cumulet::demo;
namespace fs = std::filesystem;
using Outcome = DesktopDialog::Result::Outcome;

void write(const fs::path& path, std::size_t bytes, int age_hours) {
  std::ofstream(path) << std::string(bytes, 'x');
  fs::last_write_time(path, fs::file_time_type::clock::now() - std::chrono::hours(age_hours));
}

std::vector<std::string> names(const std::vector<FolderEntry>& entries) {
  std::vector<std::string> all;
  for (const FolderEntry& entry : entries) all.push_back(entry.name);
  return all;
}

using Names = std::vector<std::string>;

class FolderListTest : public testing::Test {
 protected:
  void SetUp() override {
    fs::create_directory(folder_ / "smoke");
    fs::create_directory(folder_ / ".hidden");
    write(folder_ / "b.vdb", 3000, 30);
    write(folder_ / "A.VDB", 20, 10);
    write(folder_ / "c.nvdb", 1500000, 20);
    write(folder_ / "notes.txt", 5, 1);
    write(folder_ / ".secret.vdb", 5, 1);
  }

  cumulet::test::Folder folder_;
  const std::vector<std::string> extensions_ = {".vdb", ".nvdb"};
};

TEST_F(FolderListTest, HasFoldersAndFilesWithTheExtensions) {
  auto entries = list_folder(folder_.path().string(), extensions_);
  sort_entries(entries, FolderOrder::name, false);
  EXPECT_EQ(names(entries), Names({"smoke", "A.VDB", "b.vdb", "c.nvdb"}));
  EXPECT_TRUE(entries[0].folder);
  EXPECT_EQ(entries[0].size, "");
  EXPECT_EQ(entries[3].size, "1.5 MB");
  EXPECT_EQ(entries[3].date, written_text((folder_ / "c.nvdb").string()));
}

TEST_F(FolderListTest, IsSortedByEachColumnWithFoldersFirst) {
  auto entries = list_folder(folder_.path().string(), extensions_);
  sort_entries(entries, FolderOrder::size, false);
  EXPECT_EQ(names(entries), Names({"smoke", "A.VDB", "b.vdb", "c.nvdb"}));
  sort_entries(entries, FolderOrder::size, true);
  EXPECT_EQ(names(entries), Names({"smoke", "c.nvdb", "b.vdb", "A.VDB"}));
  sort_entries(entries, FolderOrder::date, true);
  EXPECT_EQ(names(entries), Names({"smoke", "A.VDB", "c.nvdb", "b.vdb"}));
}

TEST_F(FolderListTest, AMissingFolderGivesOneLine) {
  try {
    static_cast<void>(list_folder((folder_ / "nowhere").string(), extensions_));
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_EQ(error.what(), (folder_ / "nowhere").string() + ": No such file or directory");
  }
}

TEST(FolderSearch, NeedsAllWordsInAnyCase) {
  EXPECT_TRUE(matches("Explosion_0012.vdb", ""));
  EXPECT_TRUE(matches("Explosion_0012.vdb", " 12  expl"));
  EXPECT_FALSE(matches("Explosion_0012.vdb", "12 smoke"));
}

TEST(FolderPlaces, AreTheUsersFoldersAndThoseOfRecentFiles) {
  const cumulet::test::Folder home;
  fs::create_directory(home / "Downloads");
  fs::create_directory(home / "shots");
  ::setenv("HOME", home.path().c_str(), 1);
  const Names recent = {(home / "shots/a.vdb").string(), (home / "shots/b.vdb").string(), (home / "c.vdb").string(),
                        (home / "gone/d.vdb").string()};
  Names labels;
  for (const Place& place : places(recent)) labels.push_back(place.label);
  EXPECT_EQ(labels, Names({"Home", "Downloads", "Working folder", "File system", "shots"}));
}

TEST(FileFacts, SizesAreShort) {
  EXPECT_EQ(size_text(0), "0 B");
  EXPECT_EQ(size_text(999), "999 B");
  EXPECT_EQ(size_text(1000), "1.0 kB");
  EXPECT_EQ(size_text(999949), "999.9 kB");
  EXPECT_EQ(size_text(999950), "1.0 MB");
  EXPECT_EQ(size_text(UINT64_MAX), "18.4 EB");
}

/// A program in place of cumulet-file-dialog: a shell script.
class DesktopDialogTest : public testing::Test {
 protected:
  std::string script(const std::string& text) {
    const fs::path path = folder_ / "dialog";
    std::ofstream(path) << "#!/bin/sh\n" << text << "\n";
    fs::permissions(path, fs::perms::owner_all);
    return path.string();
  }
  static DesktopDialog::Result result_of(DesktopDialog& dialog) {
    std::optional<DesktopDialog::Result> result;
    while (!result) {
      result = dialog.take();
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    EXPECT_FALSE(dialog.is_open());
    return *result;
  }

  cumulet::test::Folder folder_;
};

TEST_F(DesktopDialogTest, ReturnsTheChosenPathAndPassesTheRequest) {
  DesktopDialog dialog(script("printf '%s|' \"$@\" > \"$0.arguments\"; echo '/a b/c#1.vdb'"));
  ASSERT_TRUE(dialog.open({true, "Save scene", "x11:1f", "/a b", "c.vdb", {".vdb", ".nvdb"}}));
  EXPECT_TRUE(dialog.is_open());
  const auto result = result_of(dialog);
  EXPECT_EQ(result.outcome, Outcome::chosen);
  EXPECT_EQ(result.path, "/a b/c#1.vdb");
  std::string arguments;
  std::getline(std::ifstream(folder_ / "dialog.arguments"), arguments);
  EXPECT_EQ(arguments, "save|Save scene|x11:1f|/a b|c.vdb|.vdb|.nvdb|");
}

TEST_F(DesktopDialogTest, TellsAClosedDialogFromAFailure) {
  DesktopDialog closed(script("exit 1"));
  ASSERT_TRUE(closed.open({}));
  EXPECT_EQ(result_of(closed).outcome, Outcome::closed);
  DesktopDialog failed(script("echo 'no portal' >&2; exit 3"));
  ASSERT_TRUE(failed.open({}));
  const auto failure = result_of(failed);
  EXPECT_EQ(failure.outcome, Outcome::failed);
  EXPECT_EQ(failure.cause, "no portal");
  DesktopDialog killed(script("kill -9 $$"));
  ASSERT_TRUE(killed.open({}));
  EXPECT_NE(result_of(killed).cause.find("ended unexpectedly"), std::string::npos);
  DesktopDialog missing((folder_ / "nothing").string());
  EXPECT_FALSE(missing.open({}));
}

TEST_F(DesktopDialogTest, TellsAChoiceThatCannotBeUsed) {
  DesktopDialog dialog(script("echo 'smb://a/b.vdb: is not a file of this computer' >&2; exit 4"));
  ASSERT_TRUE(dialog.open({}));
  const auto result = result_of(dialog);
  EXPECT_EQ(result.outcome, Outcome::unusable);
  EXPECT_EQ(result.cause, "smb://a/b.vdb: is not a file of this computer");
}

// Libraries may write any number of warnings.
TEST_F(DesktopDialogTest, AProgramThatWritesMuchEnds) {
  DesktopDialog dialog(script("head -c 300000 /dev/zero | tr '\\0' 'w' >&2; echo /a.vdb"));
  ASSERT_TRUE(dialog.open({}));
  const auto result = result_of(dialog);
  EXPECT_EQ(result.outcome, Outcome::chosen);
  EXPECT_EQ(result.path, "/a.vdb");
  DesktopDialog failing(script("for i in 1 2 3; do echo \"warning $i\" >&2; done; echo 'no portal' >&2; exit 3"));
  ASSERT_TRUE(failing.open({}));
  EXPECT_EQ(result_of(failing).cause, "no portal");
}

// For example a message bus that it has started.
TEST_F(DesktopDialogTest, WaitsForNoProgramThatItLeavesBehind) {
  const auto began = std::chrono::steady_clock::now();
  DesktopDialog dialog(script("sleep 60 & echo $! > \"$0.left\"; echo /a.vdb"));
  ASSERT_TRUE(dialog.open({}));
  EXPECT_EQ(result_of(dialog).path, "/a.vdb");
  EXPECT_LT(std::chrono::steady_clock::now() - began, std::chrono::seconds(30));
  pid_t left = 0;
  std::ifstream(folder_ / "dialog.left") >> left;
  ASSERT_GT(left, 0);
  ::kill(left, SIGKILL);
}

// Its parent may have started this program so that it ignores the end of children.
TEST_F(DesktopDialogTest, AStatusThatIsLostIsAFailure) {
  const auto before = ::signal(SIGCHLD, SIG_IGN);
  DesktopDialog dialog(script("exit 1"));
  ASSERT_TRUE(dialog.open({}));
  EXPECT_EQ(result_of(dialog).outcome, Outcome::failed);
  ::signal(SIGCHLD, before);
}

TEST_F(DesktopDialogTest, ClosingEndsTheProgram) {
  const auto began = std::chrono::steady_clock::now();
  {
    DesktopDialog dialog(script("exec sleep 60"));
    ASSERT_TRUE(dialog.open({}));
    EXPECT_FALSE(dialog.take());
  }
  EXPECT_LT(std::chrono::steady_clock::now() - began, std::chrono::seconds(30));
}

}  // namespace
