"""Shows a volume in a window of PyQt6: qt_host.py VOLUME [OUT.png SAMPLES]

The left mouse button orbits, the wheel moves closer. With OUT.png the finished picture is saved and the window closes.
"""

import sys

import cumulet
from PyQt6.QtCore import Qt, QTimer, pyqtSignal
from PyQt6.QtGui import QOpenGLContext, QSurfaceFormat
from PyQt6.QtOpenGLWidgets import QOpenGLWidget
from PyQt6.QtWidgets import QApplication

BUTTONS = {Qt.MouseButton.LeftButton: "left", Qt.MouseButton.MiddleButton: "middle",
           Qt.MouseButton.RightButton: "right"}


class VolumeView(QOpenGLWidget):
    """A widget that shows a volume."""

    changed = pyqtSignal()  # from any thread to the thread of the window

    def __init__(self, path, out=None, samples=256):
        super().__init__()
        self.out = out
        self.changed.connect(self.update)
        self.viewer = cumulet.Viewer(update=self.changed.emit, gl_state="host_resets")
        self.viewer.set_sun_sky(**cumulet.DAY)
        self.viewer.set_display(denoise="fast")
        self.viewer.set_sampling(samples=samples)
        self.viewer.load_volume_file(path, suggested_density_scale=True)

    def initializeGL(self):
        context = QOpenGLContext.currentContext()
        context.aboutToBeDestroyed.connect(self.leave)
        self.viewer.attach(lambda name: context.getProcAddress(name.encode()))

    def leave(self):
        self.makeCurrent()
        self.viewer.detach()
        self.doneCurrent()

    def paintGL(self):
        ratio = self.devicePixelRatio()
        result = self.viewer.render(framebuffer=self.defaultFramebufferObject(), width=round(self.width() * ratio),
                                    height=round(self.height() * ratio), scale=ratio)
        if result.flags & cumulet.RenderFlags.INCOMPLETE:
            self.update()
        elif self.out and result.flags & cumulet.RenderFlags.CONVERGED:
            QTimer.singleShot(0, self.save)

    def save(self):
        self.grabFramebuffer().save(self.out)
        self.out = None
        QApplication.quit()

    def send(self, event, kind, **fields):
        position = event.position() * self.devicePixelRatio()
        self.viewer.input(type=kind, x=position.x(), y=position.y(), **fields)

    def mousePressEvent(self, event):
        if event.button() in BUTTONS:
            self.send(event, "button_down", button=BUTTONS[event.button()])

    def mouseReleaseEvent(self, event):
        if event.button() in BUTTONS:
            self.send(event, "button_up", button=BUTTONS[event.button()])

    def mouseMoveEvent(self, event):
        self.send(event, "pointer_move")

    def wheelEvent(self, event):
        self.send(event, "wheel", wheel=event.angleDelta().y() / 120)


def main():
    surface = QSurfaceFormat()
    surface.setVersion(4, 5)
    surface.setProfile(QSurfaceFormat.OpenGLContextProfile.CoreProfile)
    QSurfaceFormat.setDefaultFormat(surface)
    application = QApplication(sys.argv)
    view = VolumeView(sys.argv[1], *sys.argv[2:3], *map(int, sys.argv[3:4]))
    view.resize(*((64, 48) if view.out else (640, 360)))
    view.show()
    sys.exit(application.exec())


main()
