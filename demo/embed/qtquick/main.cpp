// A Qt Quick host: Main.qml shows the item CumuletView of cumulet_view.hpp in a window. Copy these files and the QML
// module of CMakeLists.txt. SelfTest, at the end, is run by the tests.
//
//     cumulet-embed-qtquick --volume FILE [--test OUT_DIR]

#include <QCommandLineParser>
#include <QDir>
#include <QElapsedTimer>
#include <QGuiApplication>
#include <QImage>
#include <QMouseEvent>
#include <QPixmap>
#include <QQmlApplicationEngine>
#include <QQuickWindow>
#include <QScreen>
#include <QSurfaceFormat>
#include <QThread>
#include <atomic>
#include <cstdio>
#include <stdexcept>

#include "cumulet_view.hpp"

namespace {

/// Acts on the window like a user and writes screenshots to a folder. Throws if the host or the viewer fails. The tests
/// compare the images.
class SelfTest {
 public:
  SelfTest(QQuickWindow& window, CumuletView& view, const QString& folder)
      : window_(window), view_(view), folder_(folder) {
    if (!folder_.mkpath(".")) throw std::runtime_error("cannot create the folder " + folder.toStdString());
    QObject::connect(&view, &CumuletView::problem, &view, [this](const QString& text) { problems_ << text; });
    QObject::connect(
        &window, &QQuickWindow::beforeRendering, &view,
        [this, gui = QThread::currentThread()] { threaded_ = QThread::currentThread() != gui; }, Qt::DirectConnection);
  }

  void run() {
    view_.set_samples(4);
    window_.resize(420, 300);
    settle();
    if (!threaded_) throw std::runtime_error("Qt Quick does not render in a thread of its own");
    shoot("start");
    window_.resize(520, 280);
    settle();
    shoot("resized");

    // A hidden window that keeps nothing destroys its context, and the next one creates another.
    window_.setPersistentGraphics(false);
    window_.setPersistentSceneGraph(false);
    const int contexts = view_.contexts();
    window_.hide();
    wait([this] { return !window_.isExposed(); }, "the window is not hidden");
    window_.show();
    settle();
    if (view_.contexts() != contexts + 1) throw std::runtime_error("hiding did not create a new context");
    shoot("shown_again");

    view_.set_exposure(1.0);
    settle();
    shoot("brighter");
    drag({260, 140}, {180, 160});
    settle();
    shoot("orbited");
  }

 private:
  template <class Done>
  void wait(Done done, const char* failure) {
    QElapsedTimer clock;
    clock.start();
    while (!done()) {
      QCoreApplication::processEvents(QEventLoop::WaitForMoreEvents, 20);
      if (!problems_.isEmpty()) throw std::runtime_error(problems_.join("; ").toStdString());
      if (clock.hasExpired(600'000)) throw std::runtime_error(failure);
    }
  }

  /// Waits for images with all samples that were drawn after this call.
  void settle() {
    wait([this] { return window_.isExposed(); }, "the window is hidden");
    // The first frame may have begun before the call, and the window may still change its size.
    for (int i = 0; i < 3; ++i) {
      const int frames = view_.frames();
      view_.update();
      wait([&] { return view_.frames() > frames && view_.converged(); }, "the viewer does not converge");
    }
  }

  void drag(QPointF from, QPointF to) {
    const auto send = [this](QEvent::Type type, QPointF at, Qt::MouseButton button, Qt::MouseButtons held) {
      QMouseEvent event(type, at, window_.mapToGlobal(at), button, held, Qt::NoModifier);
      QCoreApplication::sendEvent(&window_, &event);
    };
    send(QEvent::MouseButtonPress, from, Qt::LeftButton, Qt::LeftButton);
    for (int step = 1; step <= 4; ++step)
      send(QEvent::MouseMove, from + (to - from) * step / 4, Qt::NoButton, Qt::LeftButton);
    send(QEvent::MouseButtonRelease, to, Qt::LeftButton, Qt::NoButton);
  }

  /// Saves the window, as on the screen and as Qt Quick renders it.
  void shoot(const QString& name) {
    const QPixmap screen = window_.screen()->grabWindow(0);
    const qreal ratio = screen.devicePixelRatio();
    const QPointF corner = QPointF(window_.mapToGlobal(QPoint(0, 0))) * ratio;
    save(name, screen.toImage().copy(QRect(corner.toPoint(), (window_.size() * ratio))));
    save(name + "_grabbed", window_.grabWindow());
  }

  void save(const QString& name, const QImage& image) {
    const QString path = folder_.filePath(name + ".png");
    if (!image.convertToFormat(QImage::Format_RGB888).save(path))
      throw std::runtime_error(path.toStdString() + ": cannot be written");
  }

  QQuickWindow& window_;
  CumuletView& view_;
  QDir folder_;
  QStringList problems_;
  std::atomic<bool> threaded_ = false;
};

int run(int argc, char** argv) {
  // Before the first window: Qt Quick renders with OpenGL, and its contexts suit Cumulet.
  QQuickWindow::setGraphicsApi(QSGRendererInterface::OpenGL);
  QSurfaceFormat format = QSurfaceFormat::defaultFormat();
  format.setVersion(4, 5);
  format.setProfile(QSurfaceFormat::CoreProfile);
  QSurfaceFormat::setDefaultFormat(format);
  const QGuiApplication application(argc, argv);
  QCommandLineParser parser;
  parser.setApplicationDescription("A Qt Quick window with a Cumulet viewer");
  parser.addHelpOption();
  parser.addOption({"volume",
                    "Volume to show (.vdb, .nvdb, .nrrd, .nhdr, .vti, .raw, .tif, .tiff), or a folder of .tif slices.",
                    "FILE"});
  parser.addOption({"test", "Run the self-test and write screenshots of the window.", "OUT_DIR"});
  parser.process(application);

  QQmlApplicationEngine engine;
  engine.addImportPath("qrc:/qt/qml");
  engine.load(QUrl("qrc:/qt/qml/Cumulet/Main.qml"));
  if (engine.rootObjects().isEmpty()) throw std::runtime_error("Main.qml cannot be loaded");
  auto* window = qobject_cast<QQuickWindow*>(engine.rootObjects().constFirst());
  auto* view = window == nullptr ? nullptr : window->findChild<CumuletView*>("view");
  if (view == nullptr) throw std::runtime_error("Main.qml has no view");
  if (parser.isSet("volume")) view->set_source(QUrl::fromLocalFile(QDir().absoluteFilePath(parser.value("volume"))));
  if (!parser.isSet("test")) return QGuiApplication::exec();
  SelfTest(*window, *view, parser.value("test")).run();
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "cumulet-embed-qtquick: %s\n", error.what());
    return 1;
  }
}
