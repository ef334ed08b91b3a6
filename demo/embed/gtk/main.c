/*
 * A GTK 4 host in C: a window with a Cumulet viewer in a GtkGLArea, an exposure slider and a status line.
 *
 * Copy the first half. The self-test at the end is run by the tests.
 */
#include <cumulet/cumulet.h>
#include <epoxy/egl.h>
#include <epoxy/gl.h>
#include <epoxy/glx.h>
#include <gdk/x11/gdkx.h>
#include <gtk/gtk.h>

typedef struct Host {
  cumulet_viewer* viewer; /* created detached; exists as long as the window, independent of the area's contexts */
  GtkWindow* window;
  GtkGLArea* area;
  GtkRange* exposure;
  GtkLabel* status;
  guint timer;
  guint tick; /* tick callback that requests another frame; 0: none */
  cumulet_frame_result result;
  double budget_ms; /* frame budget; 0: Cumulet's default */
  guint frames;
  guint contexts;
  gint problems; /* atomic, because warnings come from any thread */
  char* volume;
  char* test_folder;
} Host;

static gboolean self_test(gpointer user);

/* Reports a failed call. */
static gboolean ok(Host* host, cumulet_status status) {
  if (status == CUMULET_OK) return TRUE;
  g_atomic_int_inc(&host->problems);
  g_printerr("cumulet-embed-gtk: %s\n", cumulet_last_error(host->viewer));
  gtk_label_set_text(host->status, cumulet_last_error(host->viewer));
  return FALSE;
}

/* ---- The viewer's callbacks ------------------------------------------------------------------------------------- */

/* GTK creates an EGL or a GLX context for the area. */
static void* get_proc(void* user, const char* name) {
  (void)user;
  union {
    void (*function)(void);
    void* address; /* ISO C has no cast from a function pointer to void* */
  } proc;
  if (eglGetCurrentContext() != EGL_NO_CONTEXT)
    proc.function = eglGetProcAddress(name);
  else
    proc.function = glXGetProcAddressARB((const GLubyte*)name);
  return proc.address;
}

static gboolean draw_again(gpointer user) {
  gtk_gl_area_queue_render(((Host*)user)->area);
  return G_SOURCE_REMOVE;
}

/* Called from any thread. Only g_idle_add is allowed here; GTK and Cumulet must not be called. on_destroy removes
 * pending sources. */
static void on_update(void* user) { g_idle_add(draw_again, user); }

static void on_log(void* user, cumulet_log_level level, const char* message) {
  if (level < CUMULET_LOG_WARNING) return;
  g_atomic_int_inc(&((Host*)user)->problems);
  g_printerr("cumulet-embed-gtk: %s\n", message);
}

/* ---- The area's context and frames ------------------------------------------------------------------------------ */

/* The area has a new context: at the start, and whenever it moves to another window. */
static void on_realize(GtkWidget* widget, gpointer user) {
  Host* host = user;
  (void)widget;
  gtk_gl_area_make_current(host->area);
  const GError* error = gtk_gl_area_get_error(host->area);
  if (error) {
    g_atomic_int_inc(&host->problems);
    gtk_label_set_text(host->status, error->message);
    g_printerr("cumulet-embed-gtk: %s\n", error->message);
    return;
  }
  host->contexts++;
  ok(host, cumulet_attach(host->viewer, get_proc, NULL));
}

/* The context is destroyed after this call and is current for the last time. Volume, settings and camera are kept. */
static void on_unrealize(GtkWidget* widget, gpointer user) {
  Host* host = user;
  if (host->tick) gtk_widget_remove_tick_callback(widget, host->tick);
  host->tick = 0;
  gtk_gl_area_make_current(host->area);
  if (!gtk_gl_area_get_error(host->area)) ok(host, cumulet_detach(host->viewer));
}

static gboolean on_tick(GtkWidget* widget, GdkFrameClock* clock, gpointer user) {
  Host* host = user;
  (void)widget;
  (void)clock;
  host->tick = 0;
  gtk_gl_area_queue_render(host->area);
  return G_SOURCE_REMOVE;
}

static gboolean on_render(GtkGLArea* area, GdkGLContext* context, gpointer user) {
  Host* host = user;
  (void)context;
  /* GTK binds its own framebuffer, never 0, with the size in physical pixels. Cumulet draws nothing before the first
   * image. */
  GLint framebuffer = 0;
  glGetIntegerv(GL_DRAW_FRAMEBUFFER_BINDING, &framebuffer);
  glClearColor(0.12F, 0.12F, 0.13F, 1.0F);
  glClear(GL_COLOR_BUFFER_BIT);

  GtkWidget* widget = GTK_WIDGET(area);
  const int scale = gtk_widget_get_scale_factor(widget);
  cumulet_frame_desc frame = {.struct_size = sizeof frame};
  frame.budget_ms = host->budget_ms;
  frame.framebuffer = (uint32_t)framebuffer;
  frame.width = (uint32_t)(gtk_widget_get_width(widget) * scale);
  frame.height = (uint32_t)(gtk_widget_get_height(widget) * scale);
  frame.scale = scale;
  host->result = (cumulet_frame_result){.struct_size = sizeof host->result};
  ok(host, cumulet_render(host->viewer, &frame, &host->result));
  host->frames++;
  const GLenum error = glGetError();
  if (error != GL_NO_ERROR) {
    g_atomic_int_inc(&host->problems);
    g_printerr("cumulet-embed-gtk: OpenGL error 0x%04x after a frame\n", error);
  }
  /* gtk_gl_area_queue_render has no effect during a frame, so the next frame is requested by a tick callback. */
  if ((host->result.flags & CUMULET_RENDER_INCOMPLETE) && !host->tick)
    host->tick = gtk_widget_add_tick_callback(widget, on_tick, host, NULL);
  return TRUE;
}

/* ---- Input ------------------------------------------------------------------------------------------------------ */

/* GTK's positions are in logical pixels, Cumulet's in physical pixels. */
static cumulet_event event_at(Host* host, cumulet_event_type type, double x, double y, GdkModifierType state) {
  const int scale = gtk_widget_get_scale_factor(GTK_WIDGET(host->area));
  cumulet_event event = {.struct_size = sizeof event, .type = type, .x = x * scale, .y = y * scale};
  if (state & GDK_SHIFT_MASK) event.modifiers |= CUMULET_MODIFIER_SHIFT;
  if (state & GDK_CONTROL_MASK) event.modifiers |= CUMULET_MODIFIER_CTRL;
  if (state & GDK_ALT_MASK) event.modifiers |= CUMULET_MODIFIER_ALT;
  return event;
}

static gboolean send(Host* host, const cumulet_event* event) {
  int32_t handled = 0;
  ok(host, cumulet_input(host->viewer, event, &handled));
  return handled != 0;
}

static void on_motion(GtkEventController* controller, double x, double y, gpointer user) {
  const cumulet_event event =
      event_at(user, CUMULET_EVENT_POINTER_MOVE, x, y, gtk_event_controller_get_current_event_state(controller));
  send(user, &event);
}

static void send_button(GtkGestureSingle* click, cumulet_event_type type, double x, double y, Host* host) {
  cumulet_event event =
      event_at(host, type, x, y, gtk_event_controller_get_current_event_state(GTK_EVENT_CONTROLLER(click)));
  switch (gtk_gesture_single_get_current_button(click)) {
    case GDK_BUTTON_PRIMARY:
      event.button = CUMULET_BUTTON_LEFT;
      break;
    case GDK_BUTTON_MIDDLE:
      event.button = CUMULET_BUTTON_MIDDLE;
      break;
    case GDK_BUTTON_SECONDARY:
      event.button = CUMULET_BUTTON_RIGHT;
      break;
    default:
      return;
  }
  send(host, &event);
}

static void on_pressed(GtkGestureSingle* click, int count, double x, double y, gpointer user) {
  (void)count;
  gtk_widget_grab_focus(GTK_WIDGET(((Host*)user)->area)); /* otherwise the area gets no keys */
  send_button(click, CUMULET_EVENT_BUTTON_DOWN, x, y, user);
}

static void on_released(GtkGestureSingle* click, int count, double x, double y, gpointer user) {
  (void)count;
  send_button(click, CUMULET_EVENT_BUTTON_UP, x, y, user);
}

static gboolean on_scroll(GtkEventController* controller, double dx, double dy, gpointer user) {
  (void)dx;
  cumulet_event event =
      event_at(user, CUMULET_EVENT_WHEEL, 0.0, 0.0, gtk_event_controller_get_current_event_state(controller));
  event.wheel = -dy;
  return send(user, &event);
}

static gboolean send_key(Host* host, cumulet_event_type type, guint keyval, GdkModifierType state) {
  cumulet_event event = event_at(host, type, 0.0, 0.0, state);
  const guint upper = gdk_keyval_to_upper(keyval); /* for letters and digits: their ASCII code */
  if (upper >= GDK_KEY_KP_0 && upper <= GDK_KEY_KP_9)
    event.key = CUMULET_KEY_KEYPAD_0 + (int32_t)(upper - GDK_KEY_KP_0);
  else if (upper == GDK_KEY_KP_Decimal)
    event.key = CUMULET_KEY_KEYPAD_PERIOD;
  else if (upper == GDK_KEY_Home)
    event.key = CUMULET_KEY_HOME;
  else if (upper == GDK_KEY_Left)
    event.key = CUMULET_KEY_LEFT;
  else if (upper == GDK_KEY_Right)
    event.key = CUMULET_KEY_RIGHT;
  else if (upper == GDK_KEY_Up)
    event.key = CUMULET_KEY_UP;
  else if (upper == GDK_KEY_Down)
    event.key = CUMULET_KEY_DOWN;
  else if (upper < 128)
    event.key = (int32_t)upper;
  return event.key != CUMULET_KEY_NONE && send(host, &event);
}

static gboolean on_key_pressed(GtkEventController* controller, guint keyval, guint code, GdkModifierType state,
                               gpointer user) {
  (void)controller;
  (void)code;
  return send_key(user, CUMULET_EVENT_KEY_DOWN, keyval, state);
}

static void on_key_released(GtkEventController* controller, guint keyval, guint code, GdkModifierType state,
                            gpointer user) {
  (void)controller;
  (void)code;
  send_key(user, CUMULET_EVENT_KEY_UP, keyval, state);
}

static void on_focus_lost(GtkEventController* controller, gpointer user) {
  (void)controller;
  const cumulet_event event = event_at(user, CUMULET_EVENT_FOCUS_LOST, 0.0, 0.0, 0);
  send(user, &event);
}

static void add_input(Host* host) {
  GtkWidget* widget = GTK_WIDGET(host->area);
  gtk_widget_set_focusable(widget, TRUE);
  GtkEventController* motion = gtk_event_controller_motion_new();
  g_signal_connect(motion, "motion", G_CALLBACK(on_motion), host);
  gtk_widget_add_controller(widget, motion);
  GtkGesture* click = gtk_gesture_click_new();
  gtk_gesture_single_set_button(GTK_GESTURE_SINGLE(click), 0); /* any button */
  g_signal_connect(click, "pressed", G_CALLBACK(on_pressed), host);
  g_signal_connect(click, "released", G_CALLBACK(on_released), host);
  gtk_widget_add_controller(widget, GTK_EVENT_CONTROLLER(click));
  GtkEventController* scroll = gtk_event_controller_scroll_new(GTK_EVENT_CONTROLLER_SCROLL_VERTICAL);
  g_signal_connect(scroll, "scroll", G_CALLBACK(on_scroll), host);
  gtk_widget_add_controller(widget, scroll);
  GtkEventController* key = gtk_event_controller_key_new();
  g_signal_connect(key, "key-pressed", G_CALLBACK(on_key_pressed), host);
  g_signal_connect(key, "key-released", G_CALLBACK(on_key_released), host);
  gtk_widget_add_controller(widget, key);
  GtkEventController* focus = gtk_event_controller_focus_new();
  g_signal_connect(focus, "leave", G_CALLBACK(on_focus_lost), host);
  gtk_widget_add_controller(widget, focus);
}

/* ---- The window ------------------------------------------------------------------------------------------------- */

static void load(Host* host, const char* path) { ok(host, cumulet_load_volume(host->viewer, path, NULL)); }

static void on_exposure(GtkRange* range, gpointer user) {
  Host* host = user;
  cumulet_display_desc display = {.struct_size = sizeof display};
  display.exposure_stops = (float)gtk_range_get_value(range);
  ok(host, cumulet_set_display(host->viewer, &display));
}

static void on_chosen(GtkNativeDialog* dialog, int response, gpointer user) {
  if (response == GTK_RESPONSE_ACCEPT) {
    GFile* file = gtk_file_chooser_get_file(GTK_FILE_CHOOSER(dialog));
    char* path = g_file_get_path(file);
    if (path) load(user, path);
    g_free(path);
    g_object_unref(file);
  }
  g_object_unref(dialog);
}

static void on_open(GtkButton* button, gpointer user) {
  Host* host = user;
  (void)button;
  GtkFileChooserNative* dialog =
      gtk_file_chooser_native_new("Open a volume", host->window, GTK_FILE_CHOOSER_ACTION_OPEN, NULL, NULL);
  g_signal_connect(dialog, "response", G_CALLBACK(on_chosen), host);
  gtk_native_dialog_show(GTK_NATIVE_DIALOG(dialog));
}

static gboolean on_timer(gpointer user) {
  static const char* const stages[] = {"Tracing", "Loading", "Voxel statistics", "Refining", "Packing", "Uploading"};
  Host* host = user;
  cumulet_progress progress = {.struct_size = sizeof progress};
  ok(host, cumulet_get_progress(host->viewer, &progress));
  const double fraction = progress.stage == CUMULET_STAGE_IDLE ? host->result.progress : progress.fraction;
  char text[600];
  g_snprintf(text, sizeof text, "%s %d %%  %s", stages[progress.stage], (int)(100.0 * fraction), progress.message);
  gtk_label_set_text(host->status, text);
  return G_SOURCE_CONTINUE;
}

/* The window is destroyed, and its area is unrealized by now: the viewer is detached and needs no context. After
 * cumulet_destroy has returned, no callback is running. */
static void on_destroy(GtkWidget* window, gpointer user) {
  Host* host = user;
  (void)window;
  g_source_remove(host->timer);
  cumulet_destroy(host->viewer);
  while (g_idle_remove_by_data(host)) {
  }
}

static GtkGLArea* make_area(Host* host) {
  GtkWidget* area = gtk_gl_area_new();
  gtk_gl_area_set_required_version(GTK_GL_AREA(area), 4, 5);
  gtk_widget_set_hexpand(area, TRUE);
  gtk_widget_set_vexpand(area, TRUE);
  g_signal_connect(area, "realize", G_CALLBACK(on_realize), host);
  g_signal_connect(area, "unrealize", G_CALLBACK(on_unrealize), host);
  g_signal_connect(area, "render", G_CALLBACK(on_render), host);
  return GTK_GL_AREA(area);
}

static gboolean make_host(Host* host, GtkApplication* application) {
  char error[512];
  cumulet_create_desc create = {.struct_size = sizeof create};
  create.log = on_log;
  create.log_user = host;
  create.update = on_update;
  create.update_user = host;
  if (cumulet_create(&create, &host->viewer, error, sizeof error) != CUMULET_OK) {
    g_printerr("cumulet-embed-gtk: %s\n", error);
    return FALSE;
  }
  cumulet_sun_sky_desc light = {.struct_size = sizeof light,
                                .sun_azimuth_degrees = 60.0F,
                                .sun_elevation_degrees = 40.0F,
                                .sun_irradiance = {2.6F, 2.5F, 2.3F},
                                .sky_radiance = {0.1F, 0.15F, 0.25F}};
  host->status = GTK_LABEL(gtk_label_new(""));
  ok(host, cumulet_set_sun_sky(host->viewer, &light));

  host->window = GTK_WINDOW(gtk_application_window_new(application));
  gtk_window_set_title(host->window, "Cumulet in GTK 4");
  gtk_window_set_default_size(host->window, 960, 600);
  g_signal_connect(host->window, "destroy", G_CALLBACK(on_destroy), host);
  host->area = make_area(host);
  add_input(host);

  GtkWidget* open = gtk_button_new_with_mnemonic("_Open...");
  gtk_widget_set_valign(open, GTK_ALIGN_CENTER);
  g_signal_connect(open, "clicked", G_CALLBACK(on_open), host);
  GtkWidget* exposure = gtk_scale_new_with_range(GTK_ORIENTATION_HORIZONTAL, -10.0, 10.0, 0.1);
  gtk_scale_set_draw_value(GTK_SCALE(exposure), TRUE);
  gtk_widget_set_hexpand(exposure, TRUE);
  host->exposure = GTK_RANGE(exposure);
  g_signal_connect(exposure, "value-changed", G_CALLBACK(on_exposure), host);
  gtk_range_set_value(host->exposure, 1.0);
  GtkWidget* bar = gtk_box_new(GTK_ORIENTATION_HORIZONTAL, 8);
  gtk_box_append(GTK_BOX(bar), open);
  gtk_box_append(GTK_BOX(bar), gtk_label_new("Exposure"));
  gtk_box_append(GTK_BOX(bar), exposure);
  GtkWidget* box = gtk_box_new(GTK_ORIENTATION_VERTICAL, 4);
  gtk_box_append(GTK_BOX(box), bar);
  gtk_box_append(GTK_BOX(box), GTK_WIDGET(host->area));
  gtk_label_set_xalign(host->status, 0.0F);
  gtk_box_append(GTK_BOX(box), GTK_WIDGET(host->status));
  gtk_window_set_child(host->window, box);
  host->timer = g_timeout_add(100, on_timer, host);
  return TRUE;
}

static void on_activate(GtkApplication* application, gpointer user) {
  Host* host = user;
  if (!make_host(host, application)) return;
  if (host->test_folder) gtk_window_set_default_size(host->window, 320, 300);
  gtk_window_present(host->window);
  if (host->volume) load(host, host->volume);
  if (host->test_folder) g_idle_add(self_test, host);
}

int main(int argc, char** argv) {
  Host host = {0};
  const GOptionEntry entries[] = {
      {"volume", 0, 0, G_OPTION_ARG_FILENAME, &host.volume,
       "Volume to show (.vdb, .nvdb, .nrrd, .nhdr, .vti, .raw, .tif, .tiff), or a folder of .tif slices", "FILE"},
      {"test", 0, 0, G_OPTION_ARG_FILENAME, &host.test_folder, "Run the self-test and write screenshots", "OUT_DIR"},
      {0}};
  GtkApplication* application = gtk_application_new(NULL, G_APPLICATION_NON_UNIQUE);
  g_application_add_main_option_entries(G_APPLICATION(application), entries);
  g_signal_connect(application, "activate", G_CALLBACK(on_activate), &host);
  const int status = g_application_run(G_APPLICATION(application), argc, argv);
  g_object_unref(application);
  g_free(host.volume);
  g_free(host.test_folder);
  return status != 0 || g_atomic_int_get(&host.problems) != 0;
}

/* ---- Self-test for the tests ------------------------------------------------------------------------------------- */

/* Acts on the window like a user, and writes screenshots of the X server's screen to a folder. The tests compare the
 * images. */

static gboolean fail(Host* host, const char* cause) {
  g_atomic_int_inc(&host->problems);
  g_printerr("cumulet-embed-gtk: %s\n", cause);
  return FALSE;
}

/* Waits until an image that started after this call has converged. */
static gboolean settle(Host* host) {
  const gint64 end = g_get_monotonic_time() + 600 * G_TIME_SPAN_SECOND;
  const guint frames = host->frames;
  double low[3];
  double high[3];
  gtk_gl_area_queue_render(host->area);
  while (host->frames == frames || !(host->result.flags & CUMULET_RENDER_CONVERGED) ||
         cumulet_get_bounds(host->viewer, low, high) != CUMULET_OK) {
    g_main_context_iteration(NULL, TRUE);
    cumulet_progress progress = {.struct_size = sizeof progress};
    if (ok(host, cumulet_get_progress(host->viewer, &progress)) && progress.status != CUMULET_OK)
      return fail(host, progress.message);
    if (g_atomic_int_get(&host->problems)) return FALSE;
    if (g_get_monotonic_time() > end) return fail(host, "the viewer does not converge");
  }
  return TRUE;
}

/* Saves a rectangle of a drawable on the screen. */
static gboolean save(Host* host, const char* name, Drawable drawable, int x, int y, int width, int height) {
  Display* display = gdk_x11_display_get_xdisplay(gtk_widget_get_display(GTK_WIDGET(host->window)));
  XImage* image = XGetImage(display, drawable, x, y, (unsigned)width, (unsigned)height, AllPlanes, ZPixmap);
  if (!image) return fail(host, "the screen cannot be read");
  guchar* rgb = g_malloc_n((gsize)width * (gsize)height, 3);
  for (int row = 0; row < height; ++row) {
    for (int column = 0; column < width; ++column) {
      const unsigned long pixel = XGetPixel(image, column, row);
      guchar* to = rgb + ((gsize)row * (gsize)width + (gsize)column) * 3;
      to[0] = (guchar)(pixel >> 16);
      to[1] = (guchar)(pixel >> 8);
      to[2] = (guchar)pixel;
    }
  }
  XDestroyImage(image);
  GBytes* bytes = g_bytes_new_take(rgb, (gsize)width * (gsize)height * 3);
  GdkTexture* texture = gdk_memory_texture_new(width, height, GDK_MEMORY_R8G8B8, bytes, (gsize)width * 3);
  char* file = g_strconcat(name, ".png", NULL);
  char* path = g_build_filename(host->test_folder, file, NULL);
  const gboolean written = gdk_texture_save_to_png(texture, path);
  g_free(path);
  g_free(file);
  g_object_unref(texture);
  g_bytes_unref(bytes);
  return written || fail(host, "a screenshot cannot be written");
}

/* Returns the rectangle of the area in its window, in physical pixels. */
static GdkRectangle image_area(Host* host) {
  GtkWidget* widget = GTK_WIDGET(host->area);
  GtkNative* native = gtk_widget_get_native(widget);
  const int scale = gtk_widget_get_scale_factor(widget);
  double x = 0.0;
  double y = 0.0;
  double left = 0.0;
  double top = 0.0;
  gtk_widget_translate_coordinates(widget, GTK_WIDGET(native), 0.0, 0.0, &x, &y);
  gtk_native_get_surface_transform(native, &left, &top);
  return (GdkRectangle){(int)(x + left) * scale, (int)(y + top) * scale, gtk_widget_get_width(widget) * scale,
                        gtk_widget_get_height(widget) * scale};
}

static Window xid(Host* host) {
  return gdk_x11_surface_get_xid(gtk_native_get_surface(gtk_widget_get_native(GTK_WIDGET(host->area))));
}

/* Saves the screen and the area. */
static gboolean shoot(Host* host, const char* name) {
  /* Drawn frames reach the screen with a delay. */
  const gint64 end = g_get_monotonic_time() + G_TIME_SPAN_SECOND / 5;
  while (g_get_monotonic_time() < end) g_main_context_iteration(NULL, TRUE);
  Display* display = gdk_x11_display_get_xdisplay(gtk_widget_get_display(GTK_WIDGET(host->window)));
  const GdkRectangle area = image_area(host);
  char screen[64];
  g_snprintf(screen, sizeof screen, "%s_screen", name);
  return save(host, screen, DefaultRootWindow(display), 0, 0, DisplayWidth(display, DefaultScreen(display)),
              DisplayHeight(display, DefaultScreen(display))) &&
         save(host, name, xid(host), area.x, area.y, area.width, area.height);
}

/* Sends real X events. x and y are fractions of the area. */
static gboolean point(Host* host, double x, double y, const char* action) {
  const GdkRectangle area = image_area(host);
  char command[256];
  g_snprintf(command, sizeof command, "xdotool mousemove --window %lu %d %d %s", xid(host),
             area.x + (int)(x * area.width), area.y + (int)(y * area.height), action);
  int status = 0;
  if (!g_spawn_command_line_sync(command, NULL, NULL, &status, NULL) || !g_spawn_check_wait_status(status, NULL))
    return fail(host, "xdotool fails");
  for (int i = 0; i < 10; ++i) { /* GTK delivers motion once per frame */
    g_usleep(10000);
    while (g_main_context_iteration(NULL, FALSE)) {
    }
  }
  return TRUE;
}

/* Moves the area to a box of another window, where it gets another context. */
static void move(Host* host, GtkBox* box) {
  GtkWidget* area = GTK_WIDGET(host->area);
  g_object_ref(area);
  gtk_box_remove(GTK_BOX(gtk_widget_get_parent(area)), area);
  gtk_box_insert_child_after(box, area, gtk_widget_get_first_child(GTK_WIDGET(box)));
  g_object_unref(area);
}

static gboolean act(Host* host) {
  if (!GDK_IS_X11_DISPLAY(gtk_widget_get_display(GTK_WIDGET(host->window)))) return fail(host, "needs GDK_BACKEND=x11");
  if (g_mkdir_with_parents(host->test_folder, 0777) != 0) return fail(host, "cannot create the folder for screenshots");
  cumulet_sampling_desc sampling = {.struct_size = sizeof sampling, .samples = 4};
  if (!ok(host, cumulet_set_sampling(host->viewer, &sampling))) return FALSE;
  host->budget_ms = 100.0; /* there is no interaction, so frames may be long */
  if (!settle(host) || !shoot(host, "start")) return FALSE;

  gtk_window_set_default_size(host->window, 420, 240);
  if (!settle(host) || !shoot(host, "resized")) return FALSE;

  GtkBox* home = GTK_BOX(gtk_widget_get_parent(GTK_WIDGET(host->area)));
  GtkWidget* away = gtk_window_new();
  GtkWidget* box = gtk_box_new(GTK_ORIENTATION_VERTICAL, 0);
  gtk_window_set_child(GTK_WINDOW(away), box);
  gtk_window_set_default_size(GTK_WINDOW(away), 300, 300);
  gtk_window_present(GTK_WINDOW(away));
  move(host, GTK_BOX(box));
  if (!settle(host) || !shoot(host, "away")) return FALSE;
  move(host, home);
  gtk_window_destroy(GTK_WINDOW(away));
  if (!settle(host) || !shoot(host, "reparented")) return FALSE;
  if (host->contexts != 3) return fail(host, "re-parenting did not create a new context");

  /* A new exposure does not restart rendering: the next frame is converged. */
  const guint frames = host->frames;
  gtk_range_set_value(host->exposure, 2.0);
  while (host->frames == frames) g_main_context_iteration(NULL, TRUE);
  if (!(host->result.flags & CUMULET_RENDER_CONVERGED)) return fail(host, "a new exposure restarted the render");
  if (!shoot(host, "brighter")) return FALSE;

  if (!point(host, 0.7, 0.3, "mousedown 1") || !point(host, 0.5, 0.4, "") || !point(host, 0.3, 0.5, "mouseup 1") ||
      !settle(host) || !shoot(host, "orbited"))
    return FALSE;
  if (!point(host, 0.5, 0.5, "click 4 click 4 click 4") || !settle(host) || !shoot(host, "near")) return FALSE;
  char focus[64];
  g_snprintf(focus, sizeof focus, "windowfocus --sync %lu key f", xid(host));
  return point(host, 0.5, 0.5, focus) && settle(host) && shoot(host, "framed");
}

static gboolean self_test(gpointer user) {
  Host* host = user;
  act(host);
  gtk_window_destroy(host->window);
  return G_SOURCE_REMOVE;
}
