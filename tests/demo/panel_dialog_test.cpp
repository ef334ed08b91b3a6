// Dialogs and messages of cumulet-demo without a window.

#include <gtest/gtest.h>
#include <imgui.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>

#include "model.hpp"
#include "panel_fixture.hpp"
#include "support/folder.hpp"

namespace {

using namespace cumulet::demo;

class PanelDialogTest : public cumulet::test::PanelTest {};

TEST_P(PanelDialogTest, DialogListsOnlyItsFileTypes) {
  model_.preferences.recent = {"/a/cloud.vdb", "/a/sky.HDR", "/a/town.glb"};
  const auto offers = [&](const char* name) { return panel_.ui().controls().contains(std::string("Recent/") + name); };
  panel_.dialog().open("Open environment map", Action::open, {".hdr", ".exr"}, "");
  for (int i = 0; i < 3; ++i) frame();
  EXPECT_TRUE(offers("sky.HDR"));
  EXPECT_FALSE(offers("cloud.vdb") || offers("town.glb"));
  panel_.dialog().open("Add volume", Action::add_volume, {".vdb", ".nvdb"}, "");
  for (int i = 0; i < 3; ++i) frame();
  EXPECT_TRUE(offers("cloud.vdb")) << "what is added is opened, not saved";
  EXPECT_FALSE(offers("sky.HDR"));
}

TEST_P(PanelDialogTest, DialogIsTheDesktopsOrElseTheOwn) {
  const cumulet::test::Folder folder;
  const auto script = [&](const std::string& text) {
    const auto path = folder / "dialog";
    std::ofstream(path) << "#!/bin/sh\n" << text << "\n";
    std::filesystem::permissions(path, std::filesystem::perms::owner_all);
    return path.string();
  };
  const auto until_it_ends = [&] {
    for (int i = 0; i < 6000 && panel_.dialog().waits(); ++i) {
      frame();
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    frame();
  };
  const std::string cloud = (folder / "cloud.vdb").string();
  std::ofstream(cloud) << "x";
  panel_.dialog().use_desktop(script("echo " + cloud), "");
  panel_.dialog().open("Open", Action::open, {".vdb"}, folder.path().string());
  EXPECT_TRUE(panel_.dialog().is_open());
  until_it_ends();
  ASSERT_EQ(commands_.size(), 1u);
  EXPECT_EQ(commands_[0].text, cloud);
  EXPECT_FALSE(panel_.dialog().is_open());

  commands_.clear();
  panel_.dialog().use_desktop(script("exit 1"), "");
  panel_.dialog().open("Open", Action::open, {".vdb"}, folder.path().string());
  until_it_ends();
  EXPECT_FALSE(panel_.dialog().is_open()) << "the user has closed it";

  panel_.dialog().use_desktop(script("echo no portal >&2; exit 3"), "");
  panel_.dialog().open("Open", Action::open, {".vdb"}, folder.path().string());
  until_it_ends();
  frame();
  EXPECT_TRUE(panel_.ui().controls().contains("cloud.vdb")) << "the own dialog is shown";
  EXPECT_TRUE(commands_.empty());
}

TEST_P(PanelDialogTest, TypedNamesAreInTheShownFolder) {
  const cumulet::test::Folder folder;
  std::filesystem::create_directory(folder / "shots");
  const auto type = [&](const char* text) {
    for (int i = 0; i < 3; ++i) frame();  // the field has the focus, and its text is selected
    ImGui::GetIO().AddInputCharactersUTF8(text);
    for (int i = 0; i < 2; ++i) frame();
  };
  const auto press = [&](const char* button) {
    panel_.ui().bring_into_view(button);
    for (int i = 0; i < 3; ++i) frame();
    click(button);
  };
  panel_.dialog().open("Save scene", Action::save_scene_as, {".json"}, (folder / "shots/cloud-001.json").string());
  type("evening");
  press("Save file");
  ASSERT_EQ(commands_.size(), 1u);
  EXPECT_EQ(commands_[0].text, (folder / "shots/evening.json").string());
  std::ofstream(folder / "shots/a.json") << "x";
  panel_.dialog().open("Open", Action::open, {".json"}, (folder / "shots").string());
  type("../shots/a.json");
  press("Open file");
  ASSERT_EQ(commands_.size(), 2u);
  EXPECT_EQ(commands_[1].text, (folder / "shots/a.json").string());
}

TEST_P(PanelDialogTest, MessagesHaveTheirButtons) {
  show_message(model_, false, "a.vdb: Z is up", 1.0, MessageButton{"Y up", "Stands it on Y.", {Action::choose_up}});
  for (int i = 0; i < 3; ++i) frame();
  const Rectangle toast = *panel_.ui().find("Message");
  const Rectangle view = Panel::viewport(model_, static_cast<double>(ImGui::GetIO().DisplaySize.x),
                                         static_cast<double>(ImGui::GetIO().DisplaySize.y), GetParam().first);
  EXPECT_LE(toast.x + toast.width, view.x + view.width);
  click("Message/Y up");
  ASSERT_EQ(commands_.size(), 2u);
  EXPECT_EQ(commands_[0].action, Action::choose_up);
  EXPECT_EQ(commands_[1].action, Action::dismiss);
  EXPECT_EQ(commands_[1].text, "a.vdb: Z is up");
  model_.log_open = true;
  for (int i = 0; i < 3; ++i) frame();
  EXPECT_TRUE(panel_.ui().controls().contains("Clear log"));
}

TEST_P(PanelDialogTest, RenderDialogStartsAPicture) {
  const cumulet::test::Folder folder;
  model_.preferences.folder = folder.path().string();
  model_.scene.volume = "/a/cloud.vdb";
  model_.scene.sampling.samples = 32;
  panel_.render_dialog().open(model_);
  EXPECT_TRUE(panel_.dialog_open());
  for (int i = 0; i < 3; ++i) frame();
  EXPECT_EQ(panel_.render_dialog().settings().samples, 32u);
  EXPECT_EQ(panel_.render_dialog().settings().file.path, (folder / "cloud-001.png").string());
  EXPECT_FALSE(panel_.ui().controls().contains("First frame")) << "nothing plays";
  EXPECT_FALSE(panel_.ui().controls().contains("Layer/normal")) << "a PNG has no layers";
  panel_.ui().bring_into_view("Start render");
  for (int i = 0; i < 4; ++i) frame();
  click("Start render");
  ASSERT_EQ(commands_.size(), 1u);
  EXPECT_EQ(commands_[0].action, Action::render);
  frame();
  EXPECT_FALSE(panel_.dialog_open());
}

TEST_P(PanelDialogTest, RenderQueueIsListed) {
  model_.renders_open = true;
  model_.renders = {{1, "/a/one.png", RenderEntry::State::done, 1.0, {}, "1920x1080 in 0:12"},
                    {2, "/a/two.png", RenderEntry::State::running, 0.5, 10.0, "128 / 256 samples"}};
  for (int i = 0; i < 4; ++i) frame();
  click("Render 2/Cancel");
  ASSERT_EQ(commands_.size(), 1u);
  EXPECT_EQ(commands_[0].action, Action::cancel_render);
  EXPECT_EQ(commands_[0].text, "2");
  click("Render 1/Show in folder");
  ASSERT_EQ(commands_.size(), 2u);
  EXPECT_EQ(commands_[1].text, "/a/one.png");
}

INSTANTIATE_TEST_SUITE_P(Scales, PanelDialogTest, cumulet::test::panel_sizes());

}  // namespace
