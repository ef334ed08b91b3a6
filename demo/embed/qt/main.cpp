// A Qt 6 host: an editor window with two Cumulet viewers side by side and a dock with parameters.
//
// Copy the class Viewer: a QOpenGLWidget around a cumulet_viewer. Window is an ordinary editor window. SelfTest, at the
// end, is run by the tests.

#include <cumulet/cumulet.h>

#include <QApplication>
#include <QCheckBox>
#include <QComboBox>
#include <QCommandLineParser>
#include <QDir>
#include <QDockWidget>
#include <QDoubleSpinBox>
#include <QElapsedTimer>
#include <QFileDialog>
#include <QFormLayout>
#include <QMainWindow>
#include <QMenuBar>
#include <QMouseEvent>
#include <QOpenGLContext>
#include <QOpenGLFunctions>
#include <QOpenGLWidget>
#include <QProgressBar>
#include <QScreen>
#include <QSlider>
#include <QStatusBar>
#include <QTimer>
#include <array>
#include <cmath>
#include <cstdio>
#include <functional>
#include <stdexcept>

namespace {

/// Creates a descriptor with struct_size set and all other fields zero.
template <class T>
T make() {
  T desc{};
  desc.struct_size = sizeof desc;
  return desc;
}

/// A widget that shows one cumulet_viewer. The viewer is created detached and exists as long as the widget. The
/// widget's context does not: Qt destroys it when the widget moves to another top-level window, for example a floating
/// dock, and creates a new one.
class Viewer final : public QOpenGLWidget {
  Q_OBJECT
 public:
  Viewer() {
    setFocusPolicy(Qt::StrongFocus);
    setMinimumSize(200, 150);
    auto create = make<cumulet_create_desc>();
    create.log = on_log;
    create.log_user = this;
    create.update = on_update;
    create.update_user = this;
    std::array<char, 512> error{};
    if (cumulet_create(&create, &viewer_, error.data(), error.size()) != CUMULET_OK)
      throw std::runtime_error(error.data());
    connect(this, &Viewer::changed, this, qOverload<>(&QWidget::update));
  }

  // Disconnects here, because ~QOpenGLWidget would emit aboutToBeDestroyed to a partly destroyed Viewer. After
  // cumulet_destroy has returned, no callback is running, and Qt drops queued calls to this object.
  ~Viewer() override {
    disconnect(context_);
    makeCurrent();
    cumulet_destroy(viewer_);
    doneCurrent();
  }

  Viewer(const Viewer&) = delete;
  Viewer& operator=(const Viewer&) = delete;
  Viewer(Viewer&&) = delete;
  Viewer& operator=(Viewer&&) = delete;

  [[nodiscard]] cumulet_viewer* handle() const { return viewer_; }
  /// Sets the frame budget in milliseconds. A user interface with two viewers needs short frames.
  void set_budget(double milliseconds) { budget_ms_ = milliseconds; }
  /// Returns the result of the last frame.
  [[nodiscard]] const cumulet_frame_result& result() const { return result_; }
  [[nodiscard]] int frames() const { return frames_; }
  /// Returns the number of contexts that this widget has had.
  [[nodiscard]] int contexts() const { return contexts_; }
  /// Returns the size of the framebuffer in physical pixels.
  [[nodiscard]] QSize pixels() const { return size() * devicePixelRatioF(); }

  /// Reports a failed call of this viewer.
  bool ok(cumulet_status status) {
    if (status != CUMULET_OK) emit problem(QString::fromUtf8(cumulet_last_error(viewer_)));
    return status == CUMULET_OK;
  }

 signals:
  void problem(const QString&);
  void changed();

 protected:
  void initializeGL() override {
    ++contexts_;
    context_ = connect(
        context(), &QOpenGLContext::aboutToBeDestroyed, this,
        [this] {
          makeCurrent();
          attached_ = false;
          ok(cumulet_detach(viewer_));
          doneCurrent();
        },
        Qt::DirectConnection);
    attached_ = ok(cumulet_attach(viewer_, get_proc, context()));
  }

  void paintGL() override {
    // Qt does not keep the framebuffer's contents, and Cumulet draws nothing before the first image.
    QOpenGLFunctions* gl = context()->functions();
    gl->glClearColor(0.12F, 0.12F, 0.13F, 1.0F);
    gl->glClear(GL_COLOR_BUFFER_BIT);
    if (!attached_) return;  // initializeGL has reported the error

    auto frame = make<cumulet_frame_desc>();
    frame.budget_ms = budget_ms_;
    frame.framebuffer = defaultFramebufferObject();  // Qt's own framebuffer, never 0
    frame.width = static_cast<uint32_t>(pixels().width());
    frame.height = static_cast<uint32_t>(pixels().height());
    frame.scale = devicePixelRatioF();
    result_ = make<cumulet_frame_result>();
    ok(cumulet_render(viewer_, &frame, &result_));
    ++frames_;
    if (const GLenum error = gl->glGetError(); error != GL_NO_ERROR)
      emit problem(QString("OpenGL error 0x%1 after a frame").arg(error, 4, 16, QChar('0')));
    if ((result_.flags & CUMULET_RENDER_INCOMPLETE) != 0) update();
  }

  void mousePressEvent(QMouseEvent* event) override { pointer(CUMULET_EVENT_BUTTON_DOWN, *event); }
  void mouseReleaseEvent(QMouseEvent* event) override { pointer(CUMULET_EVENT_BUTTON_UP, *event); }
  void mouseMoveEvent(QMouseEvent* event) override { pointer(CUMULET_EVENT_POINTER_MOVE, *event); }

  void wheelEvent(QWheelEvent* event) override {
    cumulet_event input = at(CUMULET_EVENT_WHEEL, event->position(), event->modifiers());
    input.wheel = event->angleDelta().y() / 120.0;
    event->setAccepted(send(input));
  }

  void keyPressEvent(QKeyEvent* event) override { key(CUMULET_EVENT_KEY_DOWN, *event); }
  void keyReleaseEvent(QKeyEvent* event) override { key(CUMULET_EVENT_KEY_UP, *event); }

  void focusOutEvent(QFocusEvent* event) override {
    send(at(CUMULET_EVENT_FOCUS_LOST, {}, {}));
    QOpenGLWidget::focusOutEvent(event);
  }

 private:
  static void* get_proc(void* user, const char* name) {
    return reinterpret_cast<void*>(static_cast<QOpenGLContext*>(user)->getProcAddress(name));
  }

  // Both are called from any thread and must not call Cumulet. Qt queues signals that are emitted by another thread.
  static void on_update(void* user) { emit static_cast<Viewer*>(user)->changed(); }
  static void on_log(void* user, cumulet_log_level level, const char* message) {
    if (level >= CUMULET_LOG_WARNING) emit static_cast<Viewer*>(user)->problem(QString::fromUtf8(message));
  }

  /// Qt's positions are in logical pixels, Cumulet's in physical pixels.
  [[nodiscard]] cumulet_event at(cumulet_event_type type, QPointF position, Qt::KeyboardModifiers modifiers) const {
    auto input = make<cumulet_event>();
    input.type = type;
    input.x = position.x() * devicePixelRatioF();
    input.y = position.y() * devicePixelRatioF();
    if (modifiers.testFlag(Qt::ShiftModifier)) input.modifiers |= CUMULET_MODIFIER_SHIFT;
    if (modifiers.testFlag(Qt::ControlModifier)) input.modifiers |= CUMULET_MODIFIER_CTRL;
    if (modifiers.testFlag(Qt::AltModifier)) input.modifiers |= CUMULET_MODIFIER_ALT;
    return input;
  }

  bool send(const cumulet_event& input) {
    int32_t handled = 0;
    ok(cumulet_input(viewer_, &input, &handled));
    return handled != 0;
  }

  void pointer(cumulet_event_type type, QMouseEvent& event) {
    cumulet_event input = at(type, event.position(), event.modifiers());
    if (type != CUMULET_EVENT_POINTER_MOVE) {
      switch (event.button()) {
        case Qt::LeftButton:
          input.button = CUMULET_BUTTON_LEFT;
          break;
        case Qt::MiddleButton:
          input.button = CUMULET_BUTTON_MIDDLE;
          break;
        case Qt::RightButton:
          input.button = CUMULET_BUTTON_RIGHT;
          break;
        default:
          event.ignore();
          return;
      }
    }
    event.setAccepted(send(input));
  }

  void key(cumulet_event_type type, QKeyEvent& event) {
    cumulet_event input = at(type, {}, event.modifiers());
    const int key = event.key();  // letters and digits are ASCII, as in Cumulet
    if (key >= Qt::Key_0 && key <= Qt::Key_9 && event.modifiers().testFlag(Qt::KeypadModifier)) {
      input.key = CUMULET_KEY_KEYPAD_0 + key - Qt::Key_0;
    } else if (key == Qt::Key_Period && event.modifiers().testFlag(Qt::KeypadModifier)) {
      input.key = CUMULET_KEY_KEYPAD_PERIOD;
    } else if (key == Qt::Key_Home) {
      input.key = CUMULET_KEY_HOME;
    } else if (key == Qt::Key_Left) {
      input.key = CUMULET_KEY_LEFT;
    } else if (key == Qt::Key_Right) {
      input.key = CUMULET_KEY_RIGHT;
    } else if (key == Qt::Key_Up) {
      input.key = CUMULET_KEY_UP;
    } else if (key == Qt::Key_Down) {
      input.key = CUMULET_KEY_DOWN;
    } else if (key < 128) {
      input.key = key;
    }
    // Auto-repeat events are not sent, because Cumulet tracks held keys itself.
    event.setAccepted(input.key != CUMULET_KEY_NONE && !event.isAutoRepeat() && send(input));
  }

  cumulet_viewer* viewer_ = nullptr;
  cumulet_frame_result result_{};
  QMetaObject::Connection context_;
  double budget_ms_ = 8.0;
  bool attached_ = false;
  int frames_ = 0;
  int contexts_ = 0;
};

/// The editor window. Both viewers have the same settings, show one cumulet_volume and may share one cumulet_camera.
class Window final : public QMainWindow {
  Q_OBJECT
 public:
  Window() {
    setWindowTitle("Cumulet in Qt 6");
    setDockOptions(AllowNestedDocks | AllowTabbedDocks);  // not animated, because each size change restarts the image
    for (Viewer* viewer : {left, right}) connect(viewer, &Viewer::problem, this, &Window::report);
    splitDockWidget(left_dock, right_dock, Qt::Horizontal);
    add_dock("Parameters", make_parameters(), Qt::RightDockWidgetArea);
    statusBar()->addPermanentWidget(&progress_);
    progress_.setRange(0, 100);

    QMenu* file = menuBar()->addMenu("&File");
    QAction* open_action = file->addAction("&Open...", this, [this] {
      const QString path = QFileDialog::getOpenFileName(
          this, "Open a volume", {}, "Volumes (*.vdb *.nvdb *.nrrd *.nhdr *.vti *.raw *.tif *.tiff)");
      if (!path.isEmpty()) open(path);
    });
    open_action->setShortcut(QKeySequence::Open);
    file->addAction("&Stop loading", this, [this] { cumulet_cancel(left->handle()); });
    QAction* quit = file->addAction("&Quit", this, &QWidget::close);
    quit->setShortcut(QKeySequence::Quit);

    set_light();
    timer_.callOnTimeout(this, [this] { watch(); });
    timer_.start(50);
  }

  // The viewers are deleted first, because they still report to this object.
  ~Window() override {
    delete left;
    delete right;
  }

  Window(const Window&) = delete;
  Window& operator=(const Window&) = delete;
  Window(Window&&) = delete;
  Window& operator=(Window&&) = delete;

  /// Loads a volume in the left viewer. watch() passes it to the right one when it is read.
  void open(const QString& path) {
    opening_ = left->ok(cumulet_load_volume(left->handle(), path.toUtf8().constData(), nullptr));
    if (opening_) setWindowTitle(path + " - Cumulet in Qt 6");
  }

  void set_samples(uint32_t samples) const {
    auto desc = make<cumulet_sampling_desc>();
    desc.samples = samples;
    each(cumulet_set_sampling, desc);
  }

  /// Returns true until the right viewer has the volume that the left one loads.
  [[nodiscard]] bool opening() const { return opening_; }

  Viewer* left = new Viewer;
  Viewer* right = new Viewer;
  QDockWidget* left_dock = add_dock("Left", left, Qt::LeftDockWidgetArea);
  QDockWidget* right_dock = add_dock("Right", right, Qt::LeftDockWidgetArea);
  // Values are base-10 logarithms, except exposure (stops) and angles (degrees).
  QDoubleSpinBox* density = nullptr;
  QDoubleSpinBox* exposure = nullptr;
  QDoubleSpinBox* azimuth = nullptr;
  QDoubleSpinBox* elevation = nullptr;
  QDoubleSpinBox* threshold = nullptr;
  QComboBox* grid_type = nullptr;
  QCheckBox* one_camera = nullptr;
  QStringList problems;

 private:
  void report(const QString& text) {
    problems << text;
    statusBar()->showMessage(text);
    std::fprintf(stderr, "cumulet-embed-qt: %s\n", qUtf8Printable(text));
  }

  QDockWidget* add_dock(const QString& name, QWidget* widget, Qt::DockWidgetArea area) {
    auto* dock = new QDockWidget(name, this);
    dock->setObjectName(name);
    dock->setWidget(widget);
    addDockWidget(area, dock);
    return dock;
  }

  QWidget* make_parameters() {
    auto* panel = new QWidget;
    panel->setMaximumWidth(300);
    auto* form = new QFormLayout(panel);
    density = add_slider(*form, "Density scale", -2.0, 2.0, 0.0, [this] { set_medium(); });
    density->setPrefix("10 ^ ");
    exposure = add_slider(*form, "Exposure", -10.0, 10.0, 0.0, [this] { set_display(); });
    exposure->setSuffix(" stops");
    azimuth = add_slider(*form, "Sun azimuth", -180.0, 180.0, 60.0, [this] { set_light(); });
    elevation = add_slider(*form, "Sun elevation", -90.0, 90.0, 40.0, [this] { set_light(); });
    for (QDoubleSpinBox* box : {azimuth, elevation}) box->setSuffix("\u00b0");
    grid_type = new QComboBox;
    grid_type->addItems({"Tetrahedra", "Dense voxels", "Bricks"});  // in the order of cumulet_grid_type
    connect(grid_type, &QComboBox::currentIndexChanged, this, [this] { set_grid(); });
    form->addRow("Grid type", grid_type);
    threshold = add_slider(*form, "Cell threshold", -4.0, 0.0, std::log10(0.15), [this] { set_grid(); });
    threshold->setPrefix("10 ^ ");
    one_camera = new QCheckBox("One camera for both");
    connect(one_camera, &QCheckBox::toggled, this, [this](bool one) { share_camera(one); });
    form->addRow(one_camera);
    return panel;
  }

  /// Adds a slider and a spin box with the same value.
  static QDoubleSpinBox* add_slider(QFormLayout& form, const QString& name, double low, double high, double value,
                                    const std::function<void()>& changed) {
    auto* box = new QDoubleSpinBox;
    box->setRange(low, high);
    box->setSingleStep((high - low) / 40.0);
    box->setValue(value);
    auto* slider = new QSlider(Qt::Horizontal);
    slider->setRange(qRound(low * 100.0), qRound(high * 100.0));
    slider->setValue(qRound(value * 100.0));
    connect(slider, &QSlider::valueChanged, box, [box](int position) { box->setValue(position / 100.0); });
    connect(box, &QDoubleSpinBox::valueChanged, slider, [slider, changed](double number) {
      slider->setValue(qRound(number * 100.0));
      changed();
    });
    form.addRow(name, box);
    form.addRow(slider);
    return box;
  }

  template <class Desc>
  void each(cumulet_status (*set)(cumulet_viewer*, const Desc*), const Desc& desc) const {
    for (Viewer* viewer : {left, right}) viewer->ok(set(viewer->handle(), &desc));
  }

  void set_medium() const {
    auto desc = make<cumulet_medium_desc>();
    desc.density_scale = std::pow(10.0, density->value());
    each(cumulet_set_medium, desc);
  }

  void set_display() const {
    auto desc = make<cumulet_display_desc>();
    desc.exposure_stops = static_cast<float>(exposure->value());
    each(cumulet_set_display, desc);
  }

  void set_light() const {
    auto desc = make<cumulet_sun_sky_desc>();
    desc.sun_azimuth_degrees = static_cast<float>(azimuth->value());
    desc.sun_elevation_degrees = static_cast<float>(elevation->value());
    std::ranges::copy(std::array{2.6F, 2.5F, 2.3F}, desc.sun_irradiance);
    std::ranges::copy(std::array{0.1F, 0.15F, 0.25F}, desc.sky_radiance);
    each(cumulet_set_sun_sky, desc);
  }

  void set_grid() const {
    auto desc = make<cumulet_grid_desc>();
    desc.type = static_cast<cumulet_grid_type>(grid_type->currentIndex());
    desc.criterion = CUMULET_CRITERION_TRANSMITTANCE;
    desc.threshold = std::pow(10.0, threshold->value());
    each(cumulet_set_grid, desc);
  }

  /// Gives the right viewer the left one's camera, or a copy of it. The viewers hold references, so the local one is
  /// released.
  void share_camera(bool one) const {
    cumulet_camera* camera = nullptr;
    left->ok(cumulet_get_camera(left->handle(), &camera));
    if (!one) {
      auto desc = make<cumulet_camera_desc>();
      cumulet_camera_get(camera, &desc);
      cumulet_camera_release(camera);
      cumulet_camera_create(&desc, &camera);
    }
    right->ok(cumulet_set_camera(right->handle(), camera));
    cumulet_camera_release(camera);
  }

  /// Passes a newly loaded volume to the right viewer, and shows the progress of loading, building and tracing.
  void watch() {
    auto work = make<cumulet_progress>();
    left->ok(cumulet_get_progress(left->handle(), &work));
    if (opening_ && work.stage != CUMULET_STAGE_LOADING) {  // read, but the grid may not be built yet
      opening_ = false;
      cumulet_volume* volume = nullptr;
      left->ok(cumulet_get_volume(left->handle(), &volume));
      if (work.status == CUMULET_OK) right->ok(cumulet_set_volume(right->handle(), volume));
      cumulet_volume_release(volume);  // the viewers hold references
    }

    constexpr std::array stages = {"Tracing", "Loading", "Voxel statistics", "Refining", "Packing", "Uploading"};
    if (work.stage == CUMULET_STAGE_IDLE && work.status == CUMULET_OK)
      right->ok(cumulet_get_progress(right->handle(), &work));
    const bool idle = work.stage == CUMULET_STAGE_IDLE;
    const double traced = std::min(left->result().progress, right->result().progress);
    progress_.setFormat(QString(stages.at(static_cast<size_t>(work.stage))) + " %p%");
    progress_.setValue(qRound(100.0 * (idle ? traced : work.fraction)));
    if (work.message != work_message_) {  // for example an unreadable file
      work_message_ = QString::fromUtf8(work.message);
      if (!work_message_.isEmpty()) report(work_message_);
    }
  }

  bool opening_ = false;
  QProgressBar progress_;
  QString work_message_;
  QTimer timer_;
};

// ---- Self-test for the tests ----------------------------------------------------------------------------------------

/// Acts on the window like a user and writes screenshots to a folder. Throws if the host or a viewer fails. The tests
/// compare the images.
class SelfTest {
 public:
  SelfTest(Window& window, const QString& folder) : window_(window), folder_(folder) {
    if (!folder_.mkpath(".")) throw std::runtime_error("cannot create the folder " + folder.toStdString());
  }

  void run(const QString& volume) {
    window_.set_samples(4);
    for (Viewer* viewer : {window_.left, window_.right}) viewer->set_budget(100.0);  // no interaction
    window_.exposure->setValue(1.0);
    window_.resize(700, 420);
    window_.show();
    even_out();
    window_.open(volume);
    wait([this] { return !window_.opening(); }, "the volume is not loaded");
    settle();
    shoot("start");

    window_.resize(820, 360);
    even_out();
    settle();
    shoot("resized");

    // Floats the dock and docks it again: each time the context is destroyed and a new one is created.
    const QByteArray layout = window_.saveState();
    const int contexts = window_.right->contexts();
    window_.right_dock->setFloating(true);
    window_.right_dock->move(440, 20);
    settle();
    if (window_.right->contexts() != contexts + 1) throw std::runtime_error("floating did not create a new context");
    shoot("floating");
    // Moves the viewer without its dock into the other dock, which is part of the main window.
    window_.left_dock->setWidget(window_.right);
    window_.right_dock->setWidget(window_.left);
    settle();
    window_.left_dock->setWidget(window_.left);
    window_.right_dock->setWidget(window_.right);
    window_.restoreState(layout);
    even_out();
    settle();
    if (window_.right->contexts() < contexts + 4) throw std::runtime_error("re-parenting did not create a new context");
    shoot("reparented");

    // A new exposure does not restart rendering: the next frame is converged.
    window_.exposure->setValue(2.0);
    const int frames = window_.left->frames();
    wait([&] { return window_.left->frames() > frames; }, "a new exposure drew no frame");
    if ((window_.left->result().flags & CUMULET_RENDER_CONVERGED) == 0)
      throw std::runtime_error("a new exposure restarted the render");
    settle();
    shoot("brighter");

    window_.one_camera->setChecked(true);
    drag(*window_.right, {150, 60}, {70, 80});
    settle();
    shoot("orbited");
    window_.one_camera->setChecked(false);
    drag(*window_.right, {70, 80}, {150, 60});
    settle();
    shoot("apart");

    window_.grid_type->setCurrentIndex(CUMULET_GRID_BRICKS);
    settle();
    shoot("bricks");
    window_.grid_type->setCurrentIndex(CUMULET_GRID_TETRAHEDRAL);
    window_.threshold->setValue(-1.0);
    window_.density->setValue(-1.0);
    window_.azimuth->setValue(-120.0);
    window_.elevation->setValue(10.0);
    settle();
    shoot("thin");

    if (!window_.problems.isEmpty()) throw std::runtime_error("there were problems");
  }

 private:
  /// Processes events until done() returns true.
  template <class Done>
  void wait(Done done, const char* failure) {
    QElapsedTimer clock;
    clock.start();
    while (!done()) {
      QCoreApplication::processEvents(QEventLoop::WaitForMoreEvents, 20);
      if (!window_.problems.isEmpty()) throw std::runtime_error(window_.problems.join("; ").toStdString());
      if (clock.hasExpired(600'000)) throw std::runtime_error(failure);
    }
  }

  /// Waits until both viewers have converged on an image that started after this call.
  void settle() {
    for (Viewer* viewer : {window_.left, window_.right}) {
      const int frames = viewer->frames();
      wait([&] { return viewer->isVisible(); }, "a viewer is hidden");
      viewer->update();
      wait([&] { return viewer->frames() > frames && (viewer->result().flags & CUMULET_RENDER_CONVERGED) != 0; },
           "a viewer does not converge");
    }
  }

  /// Gives both viewers the same size.
  void even_out() {
    const auto time = [clock = QElapsedTimer()]() mutable {
      if (!clock.isValid()) clock.start();
      return clock.hasExpired(200);
    };
    wait(time, "");
    const int width = (window_.left->width() + window_.right->width()) / 2;
    window_.resizeDocks({window_.left_dock, window_.right_dock}, {width, width}, Qt::Horizontal);
  }

  static void drag(Viewer& viewer, QPoint from, QPoint to) {
    const auto send = [&](QEvent::Type type, QPoint at, Qt::MouseButton button, Qt::MouseButtons held) {
      QMouseEvent event(type, at, viewer.mapToGlobal(at), button, held, Qt::NoModifier);
      QCoreApplication::sendEvent(&viewer, &event);
    };
    send(QEvent::MouseButtonPress, from, Qt::LeftButton, Qt::LeftButton);
    for (int step = 1; step <= 4; ++step)
      send(QEvent::MouseMove, from + (to - from) * step / 4, Qt::NoButton, Qt::LeftButton);
    send(QEvent::MouseButtonRelease, to, Qt::LeftButton, Qt::NoButton);
  }

  /// Saves the screen, and each viewer both as on the screen and from its framebuffer.
  void shoot(const QString& name) {
    const QPixmap screen = window_.screen()->grabWindow(0);
    save(name, screen.toImage());
    for (Viewer* viewer : {window_.left, window_.right}) {
      const QString side = name + (viewer == window_.left ? "_left" : "_right");
      const qreal ratio = screen.devicePixelRatio();
      const QPointF corner = QPointF(viewer->mapToGlobal(QPoint(0, 0))) * ratio;
      save(side, screen.toImage().copy(QRect(corner.toPoint(), viewer->pixels())));
      save(side + "_framebuffer", viewer->grabFramebuffer());
    }
  }

  void save(const QString& name, const QImage& image) {
    const QString path = folder_.filePath(name + ".png");
    if (!image.convertToFormat(QImage::Format_RGB888).save(path))
      throw std::runtime_error(path.toStdString() + ": cannot be written");
  }

  Window& window_;
  QDir folder_;
};

int run(int argc, char** argv) {
  // Set before the first window is created, so that all contexts of the program suit Cumulet.
  QSurfaceFormat format = QSurfaceFormat::defaultFormat();
  format.setVersion(4, 5);
  format.setProfile(QSurfaceFormat::CoreProfile);
  QSurfaceFormat::setDefaultFormat(format);
  const QApplication application(argc, argv);
  QCommandLineParser parser;
  parser.setApplicationDescription("A Qt 6 window with two Cumulet viewers");
  parser.addHelpOption();
  parser.addOption({"volume",
                    "Volume to show (.vdb, .nvdb, .nrrd, .nhdr, .vti, .raw, .tif, .tiff), or a folder of .tif slices.",
                    "FILE"});
  parser.addOption({"test", "Run the self-test and write screenshots of the window.", "OUT_DIR"});
  parser.process(application);

  Window window;
  const QString volume = parser.value("volume");
  if (parser.isSet("test")) {
    SelfTest(window, parser.value("test")).run(volume);
    return 0;
  }
  window.resize(1280, 720);
  window.show();
  if (!volume.isEmpty()) window.open(volume);
  return QApplication::exec();
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "cumulet-embed-qt: %s\n", error.what());
    return 1;
  }
}

#include "main.moc"
