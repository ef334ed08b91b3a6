#include "cumulet_view.hpp"

#include <QOpenGLContext>
#include <QOpenGLFramebufferObject>
#include <QOpenGLFunctions>
#include <QQuickOpenGLUtils>
#include <QQuickWindow>
#include <algorithm>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

SharedViewer::SharedViewer() {
  auto created = cumulet::Viewer::create({.log =
                                              [this](cumulet::LogLevel level, std::string_view text) {
                                                if (level >= cumulet::LogLevel::warning)
                                                  emit warned(QString::fromUtf8(text.data(), qsizetype(text.size())));
                                              },
                                          .update = [this] { emit changed(); }});
  if (!created) {
    failure = created.error().message.c_str();
    return;
  }
  viewer = std::move(created).value();
  static_cast<void>(viewer.set_sun_sky({.sun_azimuth_degrees = 60.0F,
                                        .sun_elevation_degrees = 40.0F,
                                        .sun_irradiance = {2.6F, 2.5F, 2.3F},
                                        .sky_radiance = {0.2F, 0.3F, 0.5F}}));
}

/// Lives in the thread that renders, as long as one GL context. That context is current in all its functions.
class ViewRenderer final : public QQuickFramebufferObject::Renderer {
 public:
  explicit ViewRenderer(std::shared_ptr<SharedViewer> shared) : shared_(std::move(shared)) {}
  ViewRenderer(const ViewRenderer&) = delete;
  ViewRenderer& operator=(const ViewRenderer&) = delete;
  ~ViewRenderer() override {
    if (attached_) static_cast<void>(shared_->viewer.detach());
  }

  QOpenGLFramebufferObject* createFramebufferObject(const QSize& size) override {
    return new QOpenGLFramebufferObject(size);  // Qt Quick owns it
  }

  void synchronize(QQuickFramebufferObject* from) override {
    auto* item = static_cast<CumuletView*>(from);
    scale_ = item->scale();
    input_.insert(input_.end(), item->input_.begin(), item->input_.end());
    item->input_.clear();
    next_ = item->settings_;
  }

  /// Qt Quick leaves its own state before this call, and expects the default state after it.
  void render() override {
    QQuickOpenGLUtils::resetOpenGLState();
    draw();
    QQuickOpenGLUtils::resetOpenGLState();
  }

 private:
  void draw() {
    framebufferObject()->bind();
    QOpenGLFunctions* gl = QOpenGLContext::currentContext()->functions();
    gl->glClearColor(0.12F, 0.12F, 0.13F, 1.0F);
    gl->glClear(GL_COLOR_BUFFER_BIT);  // Cumulet draws nothing before the first image
    if (!shared_->failure.isEmpty()) return input_.clear();
    if (!attached_) {
      QOpenGLContext* context = QOpenGLContext::currentContext();
      attached_ = ok(shared_->viewer.attach([context](const char* name) { return context->getProcAddress(name); }));
      if (!attached_) return;
    }
    apply();
    const QSize size = framebufferObject()->size();
    // Qt Quick takes the first row of the framebuffer for the top.
    auto frame = shared_->viewer.render({.budget_ms = 12.0,
                                         .framebuffer = framebufferObject()->handle(),
                                         .width = static_cast<std::uint32_t>(size.width()),
                                         .height = static_cast<std::uint32_t>(size.height()),
                                         .flip_y = true,
                                         .scale = scale_});
    if (!frame) return report(frame.error().message.c_str());
    if (frame->has(cumulet::RenderFlags::failed)) {
      const auto work = shared_->viewer.get_progress();
      if (work && work->message.view() != failure_) {
        failure_ = work->message.view();
        report(failure_.c_str());
      }
    }
    emit shared_->drawn(frame->progress, frame->has(cumulet::RenderFlags::converged), std::exchange(is_new_, false));
    if (frame->has(cumulet::RenderFlags::incomplete)) update();
  }

  template <class T>
  bool ok(const cumulet::Result<T>& result) {
    if (!result) report(result.error().message.c_str());
    return static_cast<bool>(result);
  }
  void report(const char* text) { emit shared_->warned(QString::fromUtf8(text)); }

  void apply() {
    cumulet::Viewer& viewer = shared_->viewer;
    for (const cumulet::Event& event : std::exchange(input_, {})) ok(viewer.input(event));
    if (!set_ || set_->samples != next_.samples)
      ok(viewer.set_sampling({.samples = static_cast<std::uint32_t>(next_.samples)}));
    if (!set_ || set_->exposure != next_.exposure)
      ok(viewer.set_display({.exposure_stops = static_cast<float>(next_.exposure)}));
    if (shared_->loaded != next_.source) {
      shared_->loaded = next_.source;
      if (next_.source.isEmpty())
        ok(viewer.set_volume(cumulet::Volume()));
      else
        ok(viewer.load_volume(next_.source.toLocalFile().toStdString()));
    }
    set_ = next_;
  }

  std::shared_ptr<SharedViewer> shared_;
  std::vector<cumulet::Event> input_;
  CumuletView::Settings next_;
  std::optional<CumuletView::Settings> set_;
  std::string failure_;
  double scale_ = 1.0;
  bool attached_ = false;
  bool is_new_ = true;
};

CumuletView::CumuletView(QQuickItem* parent)
    : QQuickFramebufferObject(parent), shared_(std::make_shared<SharedViewer>()) {
  setAcceptedMouseButtons(Qt::AllButtons);
  setFlag(ItemIsFocusScope);
  // Qt queues signals of other threads, and drops them after the item is deleted.
  connect(shared_.get(), &SharedViewer::changed, this, &QQuickItem::update);
  connect(shared_.get(), &SharedViewer::drawn, this, &CumuletView::take_frame);
  connect(shared_.get(), &SharedViewer::warned, this, &CumuletView::problem);
  // QML connects its handlers after this constructor.
  if (!shared_->failure.isEmpty())
    QMetaObject::invokeMethod(
        this, [this] { emit problem(shared_->failure); }, Qt::QueuedConnection);
}

QQuickFramebufferObject::Renderer* CumuletView::createRenderer() const { return new ViewRenderer(shared_); }

void CumuletView::set_source(const QUrl& source) {
  if (std::exchange(settings_.source, source) == source) return;
  emit source_changed();
  update();
}

void CumuletView::set_samples(int samples) {
  samples = std::max(samples, 0);
  if (std::exchange(settings_.samples, samples) == samples) return;
  emit samples_changed();
  update();
}

void CumuletView::set_exposure(double stops) {
  if (std::exchange(settings_.exposure, stops) == stops) return;
  emit exposure_changed();
  update();
}

void CumuletView::take_frame(double progress, bool converged, bool new_context) {
  progress_ = progress;
  converged_ = converged;
  ++frames_;
  if (new_context) ++contexts_;
  emit frame_done();
}

double CumuletView::scale() const { return window() == nullptr ? 1.0 : window()->effectiveDevicePixelRatio(); }

void CumuletView::keep(const cumulet::Event& event) {
  input_.push_back(event);
  update();
}

/// Qt's positions are in logical pixels, Cumulet's in physical pixels.
cumulet::Event CumuletView::at(cumulet::EventType type, QPointF position, Qt::KeyboardModifiers modifiers) const {
  cumulet::Event event{.type = type, .x = position.x() * scale(), .y = position.y() * scale()};
  if (modifiers.testFlag(Qt::ShiftModifier)) event.modifiers = event.modifiers | cumulet::Modifiers::shift;
  if (modifiers.testFlag(Qt::ControlModifier)) event.modifiers = event.modifiers | cumulet::Modifiers::ctrl;
  if (modifiers.testFlag(Qt::AltModifier)) event.modifiers = event.modifiers | cumulet::Modifiers::alt;
  return event;
}

void CumuletView::pointer(cumulet::EventType type, QMouseEvent& event) {
  held_ = event.buttons() & (Qt::LeftButton | Qt::MiddleButton | Qt::RightButton);
  cumulet::Event input = at(type, event.position(), event.modifiers());
  if (type != cumulet::EventType::pointer_move) {
    if (event.button() != Qt::LeftButton && event.button() != Qt::MiddleButton && event.button() != Qt::RightButton)
      return event.ignore();
    input.button = event.button() == Qt::LeftButton    ? cumulet::Button::left
                   : event.button() == Qt::RightButton ? cumulet::Button::right
                                                       : cumulet::Button::middle;
  }
  keep(input);
  event.accept();
}

void CumuletView::mousePressEvent(QMouseEvent* event) {
  forceActiveFocus(Qt::MouseFocusReason);
  pointer(cumulet::EventType::button_down, *event);
}
void CumuletView::mouseReleaseEvent(QMouseEvent* event) { pointer(cumulet::EventType::button_up, *event); }
void CumuletView::mouseMoveEvent(QMouseEvent* event) { pointer(cumulet::EventType::pointer_move, *event); }

/// Qt calls this after each release, too. Only buttons that are still down get no release of their own.
void CumuletView::mouseUngrabEvent() {
  if (std::exchange(held_, Qt::NoButton) != Qt::NoButton) keep({.type = cumulet::EventType::focus_lost});
}

void CumuletView::wheelEvent(QWheelEvent* event) {
  cumulet::Event input = at(cumulet::EventType::wheel, event->position(), event->modifiers());
  input.wheel = event->angleDelta().y() / 120.0;
  keep(input);
  event->accept();
}

void CumuletView::key(cumulet::EventType type, QKeyEvent& event) {
  const int code = event.key();  // letters and digits are ASCII, as in Cumulet
  cumulet::Event input = at(type, {}, event.modifiers());
  if (code == Qt::Key_Home) {
    input.key = cumulet::Key::home;
  } else if (code == Qt::Key_Left) {
    input.key = cumulet::Key::left;
  } else if (code == Qt::Key_Right) {
    input.key = cumulet::Key::right;
  } else if (code == Qt::Key_Up) {
    input.key = cumulet::Key::up;
  } else if (code == Qt::Key_Down) {
    input.key = cumulet::Key::down;
  } else if (code < 128) {
    input.key = cumulet::Key{code};
  }
  // Auto-repeat events are not sent, because Cumulet tracks held keys itself.
  event.setAccepted(input.key != cumulet::Key::none && !event.isAutoRepeat());
  if (event.isAccepted()) keep(input);
}

void CumuletView::keyPressEvent(QKeyEvent* event) { key(cumulet::EventType::key_down, *event); }
void CumuletView::keyReleaseEvent(QKeyEvent* event) { key(cumulet::EventType::key_up, *event); }

void CumuletView::focusOutEvent(QFocusEvent* event) {
  keep({.type = cumulet::EventType::focus_lost});
  QQuickFramebufferObject::focusOutEvent(event);
}
