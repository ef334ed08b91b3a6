// A Qt 6 host: an editor window with two Cumulet viewers side by side and a dock with parameters.
//
// Viewer is what to copy: a QOpenGLWidget around a cumulet_viewer. Window is an editor as any other. self_test, at the
// end, is what the tests run.

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

/// A descriptor: struct_size set, the rest zero.
template <class T>
T make() {
  T desc{};
  desc.struct_size = sizeof desc;
  return desc;
}

/// Shows one cumulet_viewer. The viewer is made detached and lives as long as the widget; the widget's context does
/// not: Qt destroys it when the widget moves to another top-level window (a dock that is floated, say), and makes a new
/// one.
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

  // Here, not later: ~QOpenGLWidget would emit aboutToBeDestroyed to what is a Viewer no more. Once cumulet_destroy
  // has returned no callback is running, and Qt drops those calls that still are in this object's queue.
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
  /// Milliseconds a frame may take: an interface that two viewers draw in wants short ones.
  void set_budget(double milliseconds) { budget_ms_ = milliseconds; }
  /// Of the last frame.
  [[nodiscard]] const cumulet_frame_result& result() const { return result_; }
  [[nodiscard]] int frames() const { return frames_; }
  /// How many contexts this widget has had.
  [[nodiscard]] int contexts() const { return contexts_; }
  /// Of the framebuffer, in physical pixels.
  [[nodiscard]] QSize pixels() const { return size() * devicePixelRatioF(); }

  /// Reports a call of this viewer that failed.
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
    // Qt does not keep the framebuffer's contents, and before there is a picture Cumulet draws nothing.
    QOpenGLFunctions* gl = context()->functions();
    gl->glClearColor(0.12F, 0.12F, 0.13F, 1.0F);
    gl->glClear(GL_COLOR_BUFFER_BIT);
    if (!attached_) return;  // initializeGL has told why

    auto frame = make<cumulet_frame_desc>();
    frame.budget_ms = budget_ms_;
    frame.framebuffer = defaultFramebufferObject();  // a texture of Qt's, never 0
    frame.width = static_cast<uint32_t>(pixels().width());
    frame.height = static_cast<uint32_t>(pixels().height());
    frame.scale = devicePixelRatioF();
    result_ = make<cumulet_frame_result>();
    ok(cumulet_render(viewer_, &frame, &result_));
    ++frames_;
    if (const GLenum error = gl->glGetError(); error != GL_NO_ERROR)
      emit problem(QString("OpenGL error 0x%1 after a frame").arg(error, 4, 16, QChar('0')));
    if ((result_.flags & CUMULET_RENDER_MORE) != 0) update();
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

  // Both come from any thread, and must not call Cumulet. Qt queues the signals that another thread emits.
  static void on_update(void* user) { emit static_cast<Viewer*>(user)->changed(); }
  static void on_log(void* user, cumulet_log_level level, const char* message) {
    if (level >= CUMULET_LOG_WARNING) emit static_cast<Viewer*>(user)->problem(QString::fromUtf8(message));
  }

  /// Qt's positions are logical pixels, Cumulet's are physical ones.
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
    const int key = event.key();  // letters and digits are ASCII, as Cumulet has them
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
    // What auto-repeat sends is no news to Cumulet, which knows what is held.
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

/// The editor. Both viewers have the same settings, show one cumulet_volume and may look through one cumulet_camera.
class Window final : public QMainWindow {
  Q_OBJECT
 public:
  Window() {
    setWindowTitle("Cumulet in Qt 6");
    setDockOptions(AllowNestedDocks | AllowTabbedDocks);  // not animated: each size is a picture of its own
    for (Viewer* viewer : {left, right}) connect(viewer, &Viewer::problem, this, &Window::report);
    splitDockWidget(left_dock, right_dock, Qt::Horizontal);
    add_dock("Parameters", make_parameters(), Qt::RightDockWidgetArea);
    statusBar()->addPermanentWidget(&progress_);
    progress_.setRange(0, 100);

    QMenu* file = menuBar()->addMenu("&File");
    QAction* open_action = file->addAction("&Open...", this, [this] {
      const QString path = QFileDialog::getOpenFileName(this, "Open a volume", {}, "Volumes (*.vdb *.nvdb)");
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

  // The viewers first: they still report to this.
  ~Window() override {
    delete left;
    delete right;
  }

  Window(const Window&) = delete;
  Window& operator=(const Window&) = delete;
  Window(Window&&) = delete;
  Window& operator=(Window&&) = delete;

  /// The left viewer loads; the right one is given the volume once it is read (watch).
  void open(const QString& path) {
    opening_ = left->ok(cumulet_load_volume(left->handle(), path.toUtf8().constData(), nullptr));
    if (opening_) setWindowTitle(path + " - Cumulet in Qt 6");
  }

  void set_samples(uint32_t samples) const {
    auto desc = make<cumulet_sampling_desc>();
    desc.samples = samples;
    each(cumulet_set_sampling, desc);
  }

  /// Whether the right viewer has still to be given what the left one loads.
  [[nodiscard]] bool opening() const { return opening_; }

  Viewer* left = new Viewer;
  Viewer* right = new Viewer;
  QDockWidget* left_dock = add_dock("Left", left, Qt::LeftDockWidgetArea);
  QDockWidget* right_dock = add_dock("Right", right, Qt::LeftDockWidgetArea);
  // Logarithms to base 10, but for exposure (stops) and the angles (degrees).
  QDoubleSpinBox* density = nullptr;
  QDoubleSpinBox* exposure = nullptr;
  QDoubleSpinBox* azimuth = nullptr;
  QDoubleSpinBox* elevation = nullptr;
  QDoubleSpinBox* threshold = nullptr;
  QComboBox* march = nullptr;
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
    march = new QComboBox;
    march->addItems({"Tetrahedra", "Dense voxels", "Bricks"});  // in the order of cumulet_march
    connect(march, &QComboBox::currentIndexChanged, this, [this] { set_grid(); });
    form->addRow("March", march);
    threshold = add_slider(*form, "Cell threshold", -4.0, 0.0, std::log10(0.15), [this] { set_grid(); });
    threshold->setPrefix("10 ^ ");
    one_camera = new QCheckBox("One camera for both");
    connect(one_camera, &QCheckBox::toggled, this, [this](bool one) { share_camera(one); });
    form->addRow(one_camera);
    return panel;
  }

  /// A slider and a spin box that say the same.
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
    auto desc = make<cumulet_light_desc>();
    desc.sun_azimuth_degrees = static_cast<float>(azimuth->value());
    desc.sun_elevation_degrees = static_cast<float>(elevation->value());
    std::ranges::copy(std::array{2.6F, 2.5F, 2.3F}, desc.sun_irradiance);
    std::ranges::copy(std::array{0.1F, 0.15F, 0.25F}, desc.sky_radiance);
    each(cumulet_set_light, desc);
  }

  void set_grid() const {
    auto desc = make<cumulet_grid_desc>();
    desc.march = static_cast<cumulet_march>(march->currentIndex());
    desc.criterion = CUMULET_CRITERION_TRANSMITTANCE;
    desc.threshold = std::pow(10.0, threshold->value());
    each(cumulet_set_grid, desc);
  }

  /// The right viewer gets the left one's camera, or a copy of it. Viewers keep their cameras: ours are let go.
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

  /// Passes a newly loaded volume on, and says how loading, building and tracing go.
  void watch() {
    auto work = make<cumulet_progress>();
    left->ok(cumulet_get_progress(left->handle(), &work));
    if (opening_ && work.stage != CUMULET_STAGE_LOADING) {  // it is read, though its grid may not be built yet
      opening_ = false;
      cumulet_volume* volume = nullptr;
      left->ok(cumulet_get_volume(left->handle(), &volume));
      if (work.status == CUMULET_OK) right->ok(cumulet_set_volume(right->handle(), volume));
      cumulet_volume_release(volume);  // the viewers keep it
    }

    constexpr std::array stages = {"Tracing", "Loading", "Voxel statistics", "Refining", "Records", "Uploading"};
    if (work.stage == CUMULET_STAGE_IDLE && work.status == CUMULET_OK)
      right->ok(cumulet_get_progress(right->handle(), &work));
    const bool idle = work.stage == CUMULET_STAGE_IDLE;
    const double traced = std::min(left->result().progress, right->result().progress);
    progress_.setFormat(QString(stages.at(static_cast<size_t>(work.stage))) + " %p%");
    progress_.setValue(qRound(100.0 * (idle ? traced : work.fraction)));
    if (work.message != work_message_) {  // a file that cannot be read, say
      work_message_ = QString::fromUtf8(work.message);
      if (!work_message_.isEmpty()) report(work_message_);
    }
  }

  bool opening_ = false;
  QProgressBar progress_;
  QString work_message_;
  QTimer timer_;
};

// ---- What the tests run ---------------------------------------------------------------------------------------------

/// Acts on the window as a user would and writes pictures of what is on the screen into a folder. Throws if the host
/// or a viewer fails; whether the pictures are right is for the tests to say.
class SelfTest {
 public:
  SelfTest(Window& window, const QString& folder) : window_(window), folder_(folder) {
    if (!folder_.mkpath(".")) throw std::runtime_error("cannot make the folder " + folder.toStdString());
  }

  void run(const QString& volume) {
    window_.set_samples(4);
    for (Viewer* viewer : {window_.left, window_.right}) viewer->set_budget(100.0);  // nobody waits for the mouse
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

    // Into a window of its own and back: a context lost and made anew, each time.
    const QByteArray layout = window_.saveState();
    const int contexts = window_.right->contexts();
    window_.right_dock->setFloating(true);
    window_.right_dock->move(440, 20);
    settle();
    if (window_.right->contexts() != contexts + 1) throw std::runtime_error("floating made no new context");
    shoot("floating");
    // The viewer alone, into another dock: the one of the main window.
    window_.left_dock->setWidget(window_.right);
    window_.right_dock->setWidget(window_.left);
    settle();
    window_.left_dock->setWidget(window_.left);
    window_.right_dock->setWidget(window_.right);
    window_.restoreState(layout);
    even_out();
    settle();
    if (window_.right->contexts() < contexts + 4) throw std::runtime_error("re-parenting made no new context");
    shoot("reparented");

    // Exposure restarts nothing: the first frame after it is a finished one.
    window_.exposure->setValue(2.0);
    const int frames = window_.left->frames();
    wait([&] { return window_.left->frames() > frames; }, "a new exposure draws no frame");
    if ((window_.left->result().flags & CUMULET_RENDER_CONVERGED) == 0)
      throw std::runtime_error("a new exposure restarts the picture");
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

    window_.march->setCurrentIndex(CUMULET_MARCH_BRICK);
    settle();
    shoot("bricks");
    window_.march->setCurrentIndex(CUMULET_MARCH_TET);
    window_.threshold->setValue(-1.0);
    window_.density->setValue(-1.0);
    window_.azimuth->setValue(-120.0);
    window_.elevation->setValue(10.0);
    settle();
    shoot("thin");

    if (!window_.problems.isEmpty()) throw std::runtime_error("there were problems");
  }

 private:
  /// Handles events until done.
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

  /// Until both viewers have finished a picture that was begun after now.
  void settle() {
    for (Viewer* viewer : {window_.left, window_.right}) {
      const int frames = viewer->frames();
      wait([&] { return viewer->isVisible(); }, "a viewer is hidden");
      viewer->update();
      wait([&] { return viewer->frames() > frames && (viewer->result().flags & CUMULET_RENDER_CONVERGED) != 0; },
           "a viewer does not converge");
    }
  }

  /// Both viewers at the same size.
  void even_out() {
    const auto time = [clock = QElapsedTimer(), this]() mutable {
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

  /// The screen, and each viewer as it is there and as its framebuffer has it.
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
  // Before the first window: every context of the program is to be one that Cumulet can use.
  QSurfaceFormat format = QSurfaceFormat::defaultFormat();
  format.setVersion(4, 5);
  format.setProfile(QSurfaceFormat::CoreProfile);
  QSurfaceFormat::setDefaultFormat(format);
  const QApplication application(argc, argv);
  QCommandLineParser parser;
  parser.setApplicationDescription("A Qt 6 window with two Cumulet viewers");
  parser.addHelpOption();
  parser.addOption({"volume", "Volume to show (.vdb, .nvdb).", "FILE"});
  parser.addOption({"test", "Act by itself and write pictures of the window.", "OUT_DIR"});
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
