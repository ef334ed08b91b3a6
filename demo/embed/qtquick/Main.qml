// The viewer fills the window. The label is drawn by Qt Quick above it.
import QtQuick
import Cumulet

Window {
    id: window
    width: 1280
    height: 720
    visible: true
    title: "Cumulet in Qt Quick"
    color: "#1f1f21"

    // The test sets these, and reads the others from the view.
    property alias view: view

    CumuletView {
        id: view
        objectName: "view"
        anchors.fill: parent
        focus: true
        onProblem: text => console.warn(text)
    }

    Rectangle {
        id: label
        x: 8
        y: 8
        width: text.width + 16
        height: text.height + 12
        radius: 6
        color: "#c0202020"

        Text {
            id: text
            x: 8
            y: 6
            color: "white"
            font.pixelSize: 14
            text: view.converged ? "done" : Math.floor(100 * view.progress) + " %"
        }
    }
}
