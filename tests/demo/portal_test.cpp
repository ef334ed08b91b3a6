// cumulet-file-dialog with a portal of the test's own, on a message bus of its own.

#include <gio/gio.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "desktop_dialog.hpp"

namespace {

using cumulet::demo::DesktopDialog;
using Outcome = DesktopDialog::Result::Outcome;

constexpr const char* interface_description =
    "<node><interface name='org.freedesktop.portal.FileChooser'>"
    "<method name='OpenFile'><arg type='s' direction='in'/><arg type='s' direction='in'/>"
    "<arg type='a{sv}' direction='in'/><arg type='o' direction='out'/></method>"
    "<method name='SaveFile'><arg type='s' direction='in'/><arg type='s' direction='in'/>"
    "<arg type='a{sv}' direction='in'/><arg type='o' direction='out'/></method>"
    "</interface></node>";

/// A portal that answers each request at once.
class PortalTest : public testing::Test {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists("/usr/bin/dbus-daemon")) GTEST_SKIP() << "dbus-daemon is missing";
    bus_ = g_subprocess_new(G_SUBPROCESS_FLAGS_STDOUT_PIPE, nullptr, "/usr/bin/dbus-daemon", "--session", "--nofork",
                            "--print-address", nullptr);
    ASSERT_NE(bus_, nullptr);
    GDataInputStream* const output = g_data_input_stream_new(g_subprocess_get_stdout_pipe(bus_));
    char* const line = g_data_input_stream_read_line(output, nullptr, nullptr, nullptr);
    g_object_unref(output);
    ASSERT_NE(line, nullptr);
    address_ = line;
    g_free(line);
    g_setenv("DBUS_SESSION_BUS_ADDRESS", address_.c_str(), TRUE);
  }
  void TearDown() override {
    if (bus_ == nullptr) return;
    if (connection_ != nullptr) {
      g_dbus_connection_close_sync(connection_, nullptr, nullptr);
      g_object_unref(connection_);
    }
    g_subprocess_force_exit(bus_);
    g_subprocess_wait(bus_, nullptr, nullptr);
    g_object_unref(bus_);
  }

  void offer_portal() {
    connection_ = g_dbus_connection_new_for_address_sync(
        address_.c_str(),
        static_cast<GDBusConnectionFlags>(G_DBUS_CONNECTION_FLAGS_AUTHENTICATION_CLIENT |
                                          G_DBUS_CONNECTION_FLAGS_MESSAGE_BUS_CONNECTION),
        nullptr, nullptr, nullptr);
    ASSERT_NE(connection_, nullptr);
    GDBusNodeInfo* const node = g_dbus_node_info_new_for_xml(interface_description, nullptr);
    static constexpr GDBusInterfaceVTable calls = {take_call, nullptr, nullptr, {}};
    ASSERT_NE(g_dbus_connection_register_object(connection_, "/org/freedesktop/portal/desktop", node->interfaces[0],
                                                &calls, this, nullptr, nullptr),
              0U);
    g_dbus_node_info_unref(node);
    GVariant* const owned = g_dbus_connection_call_sync(connection_, "org.freedesktop.DBus", "/org/freedesktop/DBus",
                                                        "org.freedesktop.DBus", "RequestName",
                                                        g_variant_new("(su)", "org.freedesktop.portal.Desktop", 0U),
                                                        nullptr, G_DBUS_CALL_FLAGS_NONE, -1, nullptr, nullptr);
    ASSERT_NE(owned, nullptr);
    g_variant_unref(owned);
  }

  static void take_call(GDBusConnection* connection, const char* sender, const char* /*object*/,
                        const char* /*interface*/, const char* method, GVariant* parameters,
                        GDBusMethodInvocation* invocation, void* user) {
    auto& test = *static_cast<PortalTest*>(user);
    test.method_ = method;
    char* const text = g_variant_print(parameters, FALSE);
    test.parameters_ = text;
    g_free(text);
    std::string name = sender + 1;
    for (char& c : name)
      if (c == '.') c = '_';
    const std::string handle = "/org/freedesktop/portal/desktop/request/" + name + "/cumulet";
    g_dbus_method_invocation_return_value(invocation, g_variant_new("(o)", handle.c_str()));
    if (test.crashes_) {
      g_dbus_connection_flush_sync(connection, nullptr, nullptr);  // the reply
      g_dbus_connection_close(connection, nullptr, nullptr, nullptr);
      return;
    }
    GVariantBuilder results;
    g_variant_builder_init(&results, G_VARIANT_TYPE_VARDICT);
    if (test.response_ == 0) {
      const char* const uris[] = {test.uri_.c_str(), nullptr};
      g_variant_builder_add(&results, "{sv}", "uris", g_variant_new_strv(uris, -1));
    }
    g_dbus_connection_emit_signal(connection, sender, handle.c_str(), "org.freedesktop.portal.Request", "Response",
                                  g_variant_new("(ua{sv})", test.response_, &results), nullptr);
  }

  DesktopDialog::Result ask(const DesktopDialog::Request& request) {
    DesktopDialog dialog(CUMULET_FILE_DIALOG);
    EXPECT_TRUE(dialog.open(request));
    std::optional<DesktopDialog::Result> result;
    while (!result) {
      g_main_context_iteration(nullptr, FALSE);
      result = dialog.take();
      g_usleep(1000);
    }
    return *result;
  }

  GSubprocess* bus_ = nullptr;
  std::string address_;
  GDBusConnection* connection_ = nullptr;
  guint32 response_ = 0;
  bool crashes_ = false;  // while its dialog is open
  std::string uri_ = "file:///a%20b/c%231.vdb";
  std::string method_;
  std::string parameters_;
};

TEST_F(PortalTest, OpensAFile) {
  offer_portal();
  const auto result = ask({false, "Open", "x11:1f", "/a b", "", {".vdb", ".nvdb"}});
  ASSERT_EQ(result.outcome, Outcome::chosen) << result.cause;
  EXPECT_EQ(result.path, "/a b/c#1.vdb");
  EXPECT_EQ(method_, "OpenFile");
  EXPECT_TRUE(parameters_.starts_with("('x11:1f', 'Open', {")) << parameters_;
  EXPECT_NE(parameters_.find("[('.vdb, .nvdb', [(uint32 0, '*.[vV][dD][bB]'), (0, '*.[nN][vV][dD][bB]')])]"),
            std::string::npos)
      << parameters_;
  EXPECT_NE(parameters_.find("'current_folder': <b'/a b'>"), std::string::npos) << parameters_;
  EXPECT_EQ(parameters_.find("current_name"), std::string::npos);
}

TEST_F(PortalTest, SavesAFile) {
  offer_portal();
  const auto result = ask({true, "Save", "", "", "cloud.json", {".json"}});
  EXPECT_EQ(result.outcome, Outcome::chosen) << result.cause;
  EXPECT_EQ(method_, "SaveFile");
  EXPECT_NE(parameters_.find("'current_name': <'cloud.json'>"), std::string::npos) << parameters_;
}

TEST_F(PortalTest, TellsCancellingFromAFailure) {
  offer_portal();
  response_ = 1;
  EXPECT_EQ(ask({}).outcome, Outcome::closed);
  response_ = 2;
  const auto failed = ask({});
  EXPECT_EQ(failed.outcome, Outcome::failed);
  EXPECT_EQ(failed.cause, "cumulet-file-dialog: the portal gave no file");
}

TEST_F(PortalTest, TakesLocalFilesOnly) {
  offer_portal();
  uri_ = "file://localhost/a%FF%0Ab.vdb";
  const auto local = ask({});
  EXPECT_EQ(local.outcome, Outcome::chosen) << local.cause;
  EXPECT_EQ(local.path, "/a\xff\nb.vdb") << "the bytes of the file's name";
  uri_ = std::string("file://") + g_get_host_name() + "/cloud.vdb";
  EXPECT_EQ(ask({}).path, "/cloud.vdb");
  for (const char* uri : {"file://another.example/cloud.vdb", "smb://server/cloud.vdb", "https://example.org/cloud.vdb",
                          "file:///a%2Fb.vdb", "file:///a%00.vdb", "cloud.vdb", ""}) {
    uri_ = uri;
    const auto result = ask({});
    EXPECT_EQ(result.outcome, Outcome::unusable) << uri;
    EXPECT_EQ(result.cause, uri + std::string(": is not a file of this computer"));
  }
}

TEST_F(PortalTest, SuggestsANameThatIsNotUtf8) {
  offer_portal();
  const auto result = ask({true, "Save \xff", "", "", "wolke\xe9.json", {".json"}});
  EXPECT_EQ(result.outcome, Outcome::chosen) << result.cause;
  EXPECT_NE(parameters_.find("'current_name': <'wolke\xef\xbf\xbd.json'>"), std::string::npos) << parameters_;
}

TEST_F(PortalTest, APortalThatEndsClosesTheDialog) {
  offer_portal();
  crashes_ = true;
  const auto result = ask({});
  EXPECT_EQ(result.outcome, Outcome::failed);
  EXPECT_EQ(result.cause, "cumulet-file-dialog: the portal has ended");
}

TEST_F(PortalTest, WithoutAPortalTheCauseIsOneLine) {
  const auto result = ask({});
  EXPECT_EQ(result.outcome, Outcome::failed);
  EXPECT_NE(result.cause.find("org.freedesktop.portal.Desktop"), std::string::npos) << result.cause;
  EXPECT_EQ(result.cause.find('\n'), std::string::npos);
}

}  // namespace
