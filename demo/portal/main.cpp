// cumulet-file-dialog: shows the file dialog of the desktop through its portal, org.freedesktop.portal.FileChooser, and
// prints the chosen path. cumulet-demo starts it. Exit status: 0 a file was chosen; 1 the user closed the dialog; 3 the
// desktop has no portal, or it failed; 4 the chosen file is not of this computer. One line on stderr for 3 and 4.

#include <gio/gio.h>

#include <algorithm>
#include <cctype>
#include <cstdio>
#include <memory>
#include <span>
#include <string>
#include <string_view>

namespace {

constexpr int chosen = 0;
constexpr int closed = 1;
constexpr int wrong_usage = 2;
constexpr int failed = 3;
constexpr int unusable = 4;

constexpr const char* portal_name = "org.freedesktop.portal.Desktop";
constexpr const char* portal_path = "/org/freedesktop/portal/desktop";
constexpr const char* chooser_interface = "org.freedesktop.portal.FileChooser";
constexpr const char* request_interface = "org.freedesktop.portal.Request";
constexpr const char* token = "cumulet";

constexpr const char* usage =
    "usage: cumulet-file-dialog open|save TITLE PARENT FOLDER NAME EXTENSION...\n"
    "  PARENT: the window above which the dialog opens, such as x11:1a2b; FOLDER, NAME: suggested; each may be empty\n";

template <auto release>
struct Release {
  template <class Object>
  void operator()(Object* object) const {
    release(object);
  }
};
using Text = std::unique_ptr<char, Release<g_free>>;
using Variant = std::unique_ptr<GVariant, Release<g_variant_unref>>;
using Connection = std::unique_ptr<GDBusConnection, Release<g_object_unref>>;
using Loop = std::unique_ptr<GMainLoop, Release<g_main_loop_unref>>;

struct Request {
  bool saves = false;
  const char* title = "";
  const char* parent = "";
  std::string_view folder;
  const char* name = "";
  std::span<char*> extensions;
};

struct Answer {
  Loop loop{g_main_loop_new(nullptr, FALSE)};
  int status = failed;
  std::string path;
  std::string cause = "cumulet-file-dialog: the portal gave no file";
};

int report(GError* error) {
  std::fprintf(stderr, "cumulet-file-dialog: %s\n", error->message);
  g_clear_error(&error);
  return failed;
}

/// Returns the text as UTF-8, which D-Bus needs: file names may have other bytes.
Text valid(const char* text) { return Text(g_utf8_make_valid(text, -1)); }

/// Returns a pattern that matches an extension in any case: "*.[vV][dD][bB]".
std::string pattern(std::string_view extension) {
  std::string text = "*";
  for (const char c : extension) {
    const auto byte = static_cast<unsigned char>(c);
    if (std::isalpha(byte) != 0)
      text += {'[', static_cast<char>(std::tolower(byte)), static_cast<char>(std::toupper(byte)), ']'};
    else
      text += c;
  }
  return text;
}

GVariant* filters(std::span<char*> extensions) {
  GVariantBuilder patterns;
  g_variant_builder_init(&patterns, G_VARIANT_TYPE("a(us)"));
  std::string names;
  for (const char* extension : extensions) {
    g_variant_builder_add(&patterns, "(us)", 0U, valid(pattern(extension).c_str()).get());
    names += (names.empty() ? "" : ", ") + std::string(extension);
  }
  GVariantBuilder list;
  g_variant_builder_init(&list, G_VARIANT_TYPE("a(sa(us))"));
  g_variant_builder_add(&list, "(sa(us))", valid(names.c_str()).get(), &patterns);
  return g_variant_builder_end(&list);
}

/// Returns the arguments of the portal's methods OpenFile and SaveFile.
GVariant* arguments(const Request& request) {
  GVariantBuilder options;
  g_variant_builder_init(&options, G_VARIANT_TYPE_VARDICT);
  g_variant_builder_add(&options, "{sv}", "handle_token", g_variant_new_string(token));
  g_variant_builder_add(&options, "{sv}", "modal", g_variant_new_boolean(TRUE));
  if (!request.extensions.empty()) g_variant_builder_add(&options, "{sv}", "filters", filters(request.extensions));
  if (!request.folder.empty()) {
    const std::string folder(request.folder);
    g_variant_builder_add(&options, "{sv}", "current_folder", g_variant_new_bytestring(folder.c_str()));
  }
  if (request.saves && *request.name != '\0')
    g_variant_builder_add(&options, "{sv}", "current_name", g_variant_new_string(valid(request.name).get()));
  return g_variant_new("(ssa{sv})", valid(request.parent).get(), valid(request.title).get(), &options);
}

/// Takes the file of a URI. Without a place for the host, g_filename_from_uri() would drop it.
void take_uri(const char* uri, Answer& answer) {
  char* named = nullptr;
  const Text path(g_filename_from_uri(uri, &named, nullptr));
  const Text host(named);
  const std::string_view of = host == nullptr ? "" : host.get();
  if (path != nullptr && (of.empty() || of == "localhost" || of == g_get_host_name())) {
    answer.status = chosen;
    answer.path = path.get();
    return;
  }
  answer.status = unusable;
  answer.cause = uri;
  std::ranges::replace_if(
      answer.cause, [](char c) { return g_ascii_iscntrl(c) != 0; }, '?');
  answer.cause += ": is not a file of this computer";
}

void take_response(GDBusConnection* /*connection*/, const char* /*sender*/, const char* /*object*/,
                   const char* /*interface*/, const char* /*signal*/, GVariant* parameters, void* user) {
  auto& answer = *static_cast<Answer*>(user);
  g_main_loop_quit(answer.loop.get());
  if (!g_variant_is_of_type(parameters, G_VARIANT_TYPE("(ua{sv})"))) return;
  guint32 response = 0;
  GVariant* results = nullptr;
  g_variant_get(parameters, "(u@a{sv})", &response, &results);
  const Variant owner(results);
  if (response == 1) answer.status = closed;
  if (response != 0) return;
  const Variant uris(g_variant_lookup_value(results, "uris", G_VARIANT_TYPE_STRING_ARRAY));
  if (uris == nullptr || g_variant_n_children(uris.get()) == 0) return;
  const char* uri = nullptr;
  g_variant_get_child(uris.get(), 0, "&s", &uri);
  take_uri(uri, answer);
}

void take_end(GDBusConnection* /*connection*/, const char* /*name*/, void* user) {
  auto& answer = *static_cast<Answer*>(user);
  g_main_loop_quit(answer.loop.get());
  answer.cause = "cumulet-file-dialog: the portal has ended";
}

guint subscribe(GDBusConnection* bus, const char* object, Answer& answer) {
  return g_dbus_connection_signal_subscribe(bus, portal_name, request_interface, "Response", object, nullptr,
                                            G_DBUS_SIGNAL_FLAGS_NONE, take_response, &answer, nullptr);
}

/// Returns the object that the portal makes for the request: its name follows from the caller's name on the bus.
std::string request_object(GDBusConnection* bus) {
  std::string sender = g_dbus_connection_get_unique_name(bus) + 1;  // without its colon
  std::ranges::replace(sender, '.', '_');
  return std::string(portal_path) + "/request/" + sender + "/" + token;
}

int show(const Request& request) {
  GError* error = nullptr;
  const Connection bus(g_bus_get_sync(G_BUS_TYPE_SESSION, nullptr, &error));
  if (bus == nullptr) return report(error);
  Answer answer;
  const std::string object = request_object(bus.get());
  const guint expected = subscribe(bus.get(), object.c_str(), answer);
  const Variant handle(g_dbus_connection_call_sync(bus.get(), portal_name, portal_path, chooser_interface,
                                                   request.saves ? "SaveFile" : "OpenFile", arguments(request),
                                                   G_VARIANT_TYPE("(o)"), G_DBUS_CALL_FLAGS_NONE, -1, nullptr, &error));
  if (handle == nullptr) return report(error);
  // Portals before 0.9 choose another name.
  const char* actual = nullptr;
  g_variant_get(handle.get(), "(&o)", &actual);
  if (object != actual) {
    g_dbus_connection_signal_unsubscribe(bus.get(), expected);
    subscribe(bus.get(), actual, answer);
  }
  // A portal that crashes sends no response.
  const guint watch = g_bus_watch_name_on_connection(bus.get(), portal_name, G_BUS_NAME_WATCHER_FLAGS_NONE, nullptr,
                                                     take_end, &answer, nullptr);
  g_main_loop_run(answer.loop.get());
  g_bus_unwatch_name(watch);
  if (answer.status == failed || answer.status == unusable) std::fprintf(stderr, "%s\n", answer.cause.c_str());
  if (answer.status == chosen) std::puts(answer.path.c_str());
  return answer.status;
}

}  // namespace

int main(int argc, char** argv) {
  const std::span<char*> given(argv, static_cast<std::size_t>(argc));
  const std::string_view mode = argc > 1 ? given[1] : "";
  if (argc < 6 || (mode != "open" && mode != "save")) {
    std::fputs(usage, stderr);
    return wrong_usage;
  }
  return show({mode == "save", given[2], given[3], given[4], given[5], given.subspan(6)});
}
