#pragma once

#include <qqmlintegration.h>
#include <QQuickFramebufferObject>
#include <QString>
#include <QUrl>
#include <cumulet/cumulet.hpp>
#include <memory>
#include <vector>

class ViewRenderer;

/// The viewer, and its signals for the thread of the item. Both the item and its renderer hold it: the scene graph
/// destroys the renderer later than the item, or earlier and makes another one.
class SharedViewer final : public QObject {
  Q_OBJECT
 public:
  SharedViewer();

  cumulet::Viewer viewer;
  QString failure;  // why there is no viewer; empty: there is one
  QUrl loaded;      // of the thread that renders

 signals:          // from any thread
  void changed();  // there is something to draw
  void drawn(double progress, bool converged, bool new_context);
  void warned(const QString& text);
};

/// A QML item that shows one Cumulet viewer.
///
/// All calls of the viewer are made by the thread that renders, which has the GL context. The item keeps input and
/// settings until synchronize(), during which Qt blocks the item's thread: the viewer then shows the same state as the
/// other items of the frame. (Calls without GL could also be made at once.)
class CumuletView : public QQuickFramebufferObject {
  Q_PROPERTY(QUrl source READ source WRITE set_source NOTIFY source_changed)
  Q_PROPERTY(int samples READ samples WRITE set_samples NOTIFY samples_changed)
  Q_PROPERTY(double exposure READ exposure WRITE set_exposure NOTIFY exposure_changed)
  Q_PROPERTY(double progress READ progress NOTIFY frame_done)
  Q_PROPERTY(bool converged READ converged NOTIFY frame_done)
  Q_OBJECT
  QML_ELEMENT

 public:
  explicit CumuletView(QQuickItem* parent = nullptr);

  [[nodiscard]] Renderer* createRenderer() const override;

  /// The volume, as a local file; empty: none.
  [[nodiscard]] QUrl source() const { return settings_.source; }
  void set_source(const QUrl& source);
  /// Samples per pixel; 0: the library's default.
  [[nodiscard]] int samples() const { return settings_.samples; }
  void set_samples(int samples);
  /// In stops.
  [[nodiscard]] double exposure() const { return settings_.exposure; }
  void set_exposure(double stops);
  /// The finished part of the image, 0 to 1.
  [[nodiscard]] double progress() const { return progress_; }
  [[nodiscard]] bool converged() const { return converged_; }
  /// Number of frames and of contexts so far.
  [[nodiscard]] int frames() const { return frames_; }
  [[nodiscard]] int contexts() const { return contexts_; }

 signals:
  void source_changed();
  void samples_changed();
  void exposure_changed();
  void frame_done();
  void problem(const QString& text);

 protected:
  void mousePressEvent(QMouseEvent* event) override;
  void mouseReleaseEvent(QMouseEvent* event) override;
  void mouseMoveEvent(QMouseEvent* event) override;
  void mouseUngrabEvent() override;
  void wheelEvent(QWheelEvent* event) override;
  void keyPressEvent(QKeyEvent* event) override;
  void keyReleaseEvent(QKeyEvent* event) override;
  void focusOutEvent(QFocusEvent* event) override;

 private:
  friend class ViewRenderer;

  struct Settings {
    QUrl source;
    int samples = 0;
    double exposure = 0.0;
  };

  void keep(const cumulet::Event& event);
  void key(cumulet::EventType type, QKeyEvent& event);
  void pointer(cumulet::EventType type, QMouseEvent& event);
  [[nodiscard]] cumulet::Event at(cumulet::EventType type, QPointF position, Qt::KeyboardModifiers modifiers) const;
  [[nodiscard]] double scale() const;
  void take_frame(double progress, bool converged, bool new_context);

  std::shared_ptr<SharedViewer> shared_;
  Settings settings_;
  std::vector<cumulet::Event> input_;  // since the last frame
  double progress_ = 0.0;
  bool converged_ = false;
  Qt::MouseButtons held_;  // buttons of the viewer that are down
  int frames_ = 0;
  int contexts_ = 0;
};
