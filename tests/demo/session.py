"""Drives cumulet-demo by replay files on its own virtual display (Xvfb), and checks its screenshots and reports.

Usage: session.py DEMO RENDER XVFB SCENE_FOLDER OUT_FOLDER TEST
Screenshots, reports and replay files stay in OUT_FOLDER/TEST.
"""

import json
import os
import pathlib
import shutil
import struct
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).parent))
import session_content
import session_input
import session_light
import session_render
import session_saving
import spans
from demo_session import assert_alike, assert_differ, assert_drawn, assert_saved, look, Session, SETTLE, shot, shown, SIZE, tab


def test_orbit_undo(s):
    orbit = ["drag viewport 0.4 0.5 to viewport 0.7 0.4"]
    converge = ["wait loaded", "wait converged"]
    s.play("replay", [*converge, *shot("first"), *orbit, *converge, *shot("orbited"), "key ctrl+z", *converge,
                      *shot("undone"), "key ctrl+shift+z", *converge, *shot("redone"), "wheel 3", "wheel 2",
                      "move viewport 0.5 0.5", *converge, *shot("closer"), "key f", *converge, *shot("framed")],
           "--volume", s.cumulus)
    first, report, area = look(s, "first")
    assert report["converged"] and report["undo_steps"] == 0, report
    assert_drawn(first, area)
    orbited, report, _ = look(s, "orbited")
    assert report["undo_steps"] == 1, "a drag is one step"
    assert_differ(first, orbited, area)
    undone, report, _ = look(s, "undone")
    assert report["undo_steps"] == 0
    assert report["scene"]["camera"] == s.report("first")["scene"]["camera"]
    assert_alike(first, undone, area)
    assert_alike(orbited, look(s, "redone")[0], area)
    near, far = (s.report(n)["scene"]["camera"] for n in ("closer", "redone"))
    distance = lambda c: sum((e - t) ** 2 for e, t in zip(c["eye"], c["target"]))
    assert distance(near) < 0.8 * distance(far), "the wheel comes closer"


def test_region(s):
    s.play("replay", [*SETTLE, *shot("whole"), "key ctrl+b", "drag viewport 0.25 0.25 to viewport 0.75 0.75", *SETTLE,
                      *shot("part"), "key ctrl+alt+b", *SETTLE, *shot("again"), "key ctrl+z", *SETTLE, *shot("undone"),
                      "key ctrl+b", "key escape", "drag viewport 0.4 0.5 to viewport 0.7 0.4", *SETTLE, *shot("given_up")],
           "--volume", s.cumulus)
    whole, report, (x, y, width, height) = look(s, "whole")
    assert "region" not in report["scene"]["picture"], report["scene"]["picture"]
    part, report, _ = look(s, "part")
    region = report["scene"]["picture"]["region"]
    assert all(abs(a - b) < 0.02 for a, b in zip(region, [0.25, 0.25, 0.5, 0.5])), region
    assert report["scene"]["camera"] == s.report("whole")["scene"]["camera"], "the drag is not the camera's"
    samples = report["samples"] / s.report("whole")["samples"]
    assert 0.2 < samples < 0.3, samples
    # The whole viewport, which includes the line of text.
    left, top, across, down = report["viewport"]
    inside = (left + across // 4 + 8, top + down // 4 + 8, across // 2 - 16, down // 2 - 16)
    assert_alike(whole, part, inside)
    assert_differ(whole, part, (x, y, width, height // 4 - 8))
    again, report, area = look(s, "again")
    assert "region" not in report["scene"]["picture"]
    assert_alike(whole, again, area)
    assert s.report("undone")["scene"]["picture"]["region"] == region
    assert s.report("given_up")["scene"]["picture"]["region"] == region
    assert s.report("given_up")["scene"]["camera"] != s.report("whole")["scene"]["camera"]


def test_change(s):
    s.play("replay", [*SETTLE, *shot("first"), 'drag "Density" 0.5 0.5 to "Density" 0.3 0.5',
                      "move viewport 0.5 0.5", *SETTLE, *shot("thin"), "key ctrl+z", *SETTLE, *shot("thick"), "key n", *SETTLE, *shot("wide"), "key n",
                      *shown("Sun & sky"), 'drag "Sun dial" 0.66 0.53 to "Sun dial" 0.3 0.5', *SETTLE, *shot("sun"), *shown("Render"), 'click "Tone map"',
                      "frames 2", 'click "Tone map/Filmic"', "frames 2", *shot("filmic"), *tab("Advanced"),
                      'drag "Threshold" to "Threshold" 0.95 0.5', *SETTLE, *shot("coarse"), "key 2", *SETTLE, *shot("cells"),
                      "key 3", *SETTLE, *shot("steps"), "key 5", *SETTLE, *shot("wireframe"), "key 1"],
           "--volume", s.cumulus)
    first, report, area = look(s, "first")
    thin, thin_report, _ = look(s, "thin")
    assert thin_report["scene"]["medium"]["density_scale"] < 0.5 * report["scene"]["medium"]["density_scale"]
    assert thin_report["undo_steps"] == 1, "a drag of a control is one step"
    assert thin_report["cells"] < report["cells"], "cells are those of the density scale, by a factor of 2"
    assert_differ(first, thin, area)
    assert_alike(first, look(s, "thick")[0], area)
    wide = s.report("wide")["viewport"]
    assert wide[2] == 640, "without the panel the picture has all of the window"
    sun = s.report("sun")["scene"]["light"]["sun"]
    assert -150 < sun["azimuth_degrees"] < -60 and 20 < sun["elevation_degrees"] < 60, sun
    assert_differ(first, look(s, "sun")[0], area)
    assert s.report("filmic")["scene"]["display"]["tone_map"] == "filmic"
    assert s.report("coarse")["cells"] < 0.5 * report["cells"], "a larger threshold makes fewer cells"
    views = [look(s, name)[0] for name in ("coarse", "cells", "steps", "wireframe")]
    for i, a in enumerate(views):
        assert_drawn(a, area)
        for b in views[:i]:
            assert_differ(a, b, area)


def test_warm_up(s):
    s.play("replay", ["wait loaded", *shot("loaded"), "wait converged", *shot("first"), "key n", *SETTLE, *shot("later")],
           "--volume", s.cumulus)
    first, report, area = look(s, "first")
    assert_drawn(first, area)
    parts = s.report("loaded")["compiled_percent"]
    assert parts == sorted(parts) and parts[-1] == 100, parts
    assert s.report("later")["compiled_percent"] == parts, "once"


def roughness(picture, area):
    """Returns the mean difference between neighboring pixels of a row, a measure of noise."""
    x, y, width, height = (int(v) for v in area)
    n = picture.channels
    total = 0
    for row in picture.rows[y: y + height]:
        greens = row[x * n + 1: (x + width) * n: n]
        total += sum(abs(a - b) for a, b in zip(greens, greens[1:]))
    return total / ((width - 1) * height)


def test_first_start(s):
    """The panel's settings apply from the first image on: Denoise is Fast, and the image has no noise."""
    choose = lambda name: ['click "Denoise"', "frames 2", f'click "Denoise/{name}"', "frames 3", "wait converged", "frames 20"]
    s.play("replay", ["wait loaded", "wait converged", "frames 20", *shot("first"), *shown("Render"), *choose("Off"), *shot("off"), *choose("Fast"),
                      *shot("again")], "--volume", s.cumulus, "--spp", "4", "--denoise", "fast")
    first, report, area = look(s, "first")
    off, again = look(s, "off")[0], look(s, "again")[0]
    assert report["scene"]["display"]["denoise"] == "fast", report["scene"]["display"]
    rough = {name: roughness(picture, area) for name, picture in (("first", first), ("off", off), ("again", again))}
    assert rough["again"] < 0.7 * rough["off"], f"the filter does nothing: {rough}"
    assert rough["first"] < 0.7 * rough["off"], f"it is off at first: {rough}"


def window(path):
    """Returns the size of an OpenEXR file's data window."""
    header = path.read_bytes()[:4096]
    at = header.index(b"dataWindow\0box2i\0") + len(b"dataWindow\0box2i\0") + 4
    left, top, right, bottom = struct.unpack("<4i", header[at: at + 16])
    return [right - left + 1, bottom - top + 1]


def save_as(key, name):
    return [f"key {key}", "frames 2", "key ctrl+a", f'text "{name}"', "key enter", "frames 1"]


def test_alone(s):
    """A single model or environment is a scene: it has a title, a state, an entry in the list and an image to save."""
    mountains = pathlib.Path(s.cumulus).with_name("mountains.glb")
    session_light.write_environment(s.out / "sky.hdr", lambda x: x < 8)
    for name, file in (("model", mountains), ("environment", s.out / "sky.hdr")):
        s.play(name, ["frames 5", *shot(f"{name}_empty"), f'drop "{file}"', "frames 3", "wait loaded", "wait converged", "key escape",
                      "frames 2", *shot(name), *save_as("ctrl+f12", f"{s.out}/{name}_saved.png"), "frames 3", "key escape", "key escape",
                      *save_as("shift+f12", f"{s.out}/{name}_saved.exr"), "frames 3", "wait converged", *shot(f"{name}_end")], "--spp", "2")
        empty, report, end = s.report(f"{name}_empty"), s.report(name), s.report(f"{name}_end")
        assert not empty["has_content"] and empty["title"] == "Cumulet" and empty["state"] == "", empty
        assert report["has_content"] and report["title"] == f"{file.name} - Cumulet", report["title"]
        assert "2 samples" in report["state"], report["state"]
        assert [m for m in end["messages"] if m["error"]] == [], end["messages"]
        picture, _, area = look(s, name)
        saved = s.picture(f"{name}_saved")
        assert [saved.width, saved.height] == report["viewport"][2:] == window(s.out / f"{name}_saved.exr")
        assert_saved(picture, saved, area)
    assert_drawn(look(s, "model")[0], look(s, "model")[2])


def test_dropped_together(s):
    """Files that are dropped together are all shown, and frames as their sequence. The names of patterns are shown
    whole."""
    mountains = pathlib.Path(s.cumulus).with_name("mountains.glb")
    for number in (1, 2, 3):
        shutil.copy(s.explosion, s.out / f"blast_{number}.vdb")
    there = ["frames 3", "wait loaded", "frames 2"]
    s.play("several", ["frames 3", f'drop "{mountains}" "{s.cumulus}" "{s.explosion}"', *there, *shot("several"),
                       f'drop "{s.out}/blast_3.vdb" "{s.out}/blast_1.vdb"', *there, 'report "plays.json"', "key escape",
                       'click "Playhead" 0.05 0.5', "frames 3", "key .", *there, *shot("frames"),
                       *tab("Grids"), 'click "Up axis"', "frames 2", 'click "Up axis/Z"', *there, "key ctrl+s", "frames 2", "key ctrl+a",
                       f'text "{s.out}/saved.json"', "key enter", *there, *shot("saved")],
           "--spp", "1")
    several, frames = s.report("several"), s.report("frames")
    assert [pathlib.Path(volume["file"]).name for volume in several["volumes"]] == ["cumulus.vdb", "explosion_0012.vdb"], several
    assert "mountains.glb" in json.dumps(several["models"]) and not [m for m in several["messages"] if m["error"]], several
    assert frames["sequence"]["count"] == 3 and "blast_#.vdb" in json.dumps(frames["volumes"][0]), frames
    assert pathlib.Path(frames["volumes"][1]["file"]).name == "explosion_0012.vdb", frames["volumes"]
    assert s.report("plays")["sequence"]["clock"] > 0, "a dropped sequence plays"
    saved = s.report("saved")
    assert saved["sequence"]["frame"] == frames["sequence"]["frame"] == 2, "another up axis keeps the frame"
    assert frames["title"] == "*blast_#.vdb - Cumulet" and saved["title"] == "saved.json - Cumulet", saved["title"]


def test_save_whole(s):
    """Saving during a preview saves the first full-resolution image after it. The status line says so meanwhile."""
    # The view changes right before the dialog opens, and no samples are traced while the dialog is open.
    view = lambda x: ["move viewport 0.3 0.5", "down left", f"move viewport {x} 0.5", "up left"]
    s.play("replay", ["wait loaded", "frames 10", *view(0.4), *save_as("ctrl+f12", f"{s.out}/early.png"), 'report "early.json"', "frames 1",
                      "wait converged", "key escape", "frames 2", *shot("rest"),
                      *view(0.5), *save_as("shift+f12", f"{s.out}/early.exr"), "wait converged", "frames 2", 'report "exr.json"',
                      "key n", *save_as("shift+f12", f"{s.out}/wide.exr"), "wait converged", "frames 2", *shot("wide"),
                      "key t", "frames 3", *save_as("ctrl+f12", f"{s.out}/turning.png"), "frames 300", 'report "turning.json"', "key t",
                      *view(0.4), *save_as("ctrl+f12", f"{s.out}/never.png"), *["key escape"] * 4, "wait converged", "frames 3", 'report "end.json"'],
           "--volume", s.cumulus, "--spp", "1", size=["--size", "760x240"])
    early = s.report("early")
    assert early["preview"] and early["picture"] != early["viewport"][2:], "it was a whole picture already"
    assert early["saving"].endswith("early.png") and "saving early.png" in early["state"], (early["saving"], early["state"])
    rest, report, area = look(s, "rest")
    saved = s.picture("early")
    assert [saved.width, saved.height] == report["viewport"][2:] and report["saving"] == "", report["saving"]
    assert_saved(rest, saved, area)
    assert window(s.out / "early.exr") == s.report("exr")["viewport"][2:]
    wide = s.report("wide")
    assert window(s.out / "wide.exr") == wide["viewport"][2:] != report["viewport"][2:], wide["viewport"]
    turning = s.picture("turning")
    assert [turning.width, turning.height] == wide["viewport"][2:]
    assert s.report("turning")["saving"] == "" and s.report("turning")["turntable"] != 0
    assert not (s.out / "never.png").exists(), "Escape takes it back"
    assert [m for m in s.report("end")["messages"] if m["error"]] == [], s.report("end")["messages"]


def test_scene_file(s):
    # A camera is saved, left and selected again.
    view = [*shown("Camera"), 'click "Camera name"', "frames 2", 'text "near"', "key enter", "frames 3", "drag viewport 0.5 0.5 to viewport 0.3 0.3",
            "frames 3", 'click "Saved camera"', "frames 2", 'click "Saved camera/near"', "frames 3"]
    s.play("save", ["wait loaded", 'drag "Density" to "Density" 0.55 0.5', "drag viewport 0.3 0.5 to viewport 0.5 0.6",
                    *view, "key ]", "key ctrl+s", "frames 2", "key ctrl+a", f'text "{s.out}/scene.json"', "key enter", "frames 3",
                    "wait loaded", "wait converged", "key escape", "frames 2", *shot("saved"), "key ctrl+f12", "frames 2",
                    "key ctrl+a", f'text "{s.out}/picture.png"', "key enter", "frames 3", "key shift+f12", "frames 2", "key ctrl+a", f'text "{s.out}/picture.exr"', "key enter",
                    "frames 3", *shot("messages")],
           "--volume", s.cumulus)
    assert [m for m in s.report("messages")["messages"] if m["error"]] == []
    assert (s.out / "picture.exr").read_bytes()[:4] == b"\x76\x2f\x31\x01"
    scene = json.loads((s.out / "scene.json").read_text())
    medium = scene["volumes"][0]["medium"]
    assert scene["display"]["exposure_stops"] > 0.3 and medium["density_scale"] > 1, scene
    assert scene["camera"] == "near" and [camera["name"] for camera in scene["cameras"]] == ["near"], scene
    saved, report, area = look(s, "saved")
    x, y, width, height = report["viewport"]
    assert [scene["picture"]["width"], scene["picture"]["height"]] == [width, height]
    assert_saved(saved, s.picture("picture"), area)
    subprocess.run([s.renderer, "--scene", "scene.json", "-o", "rendered.png"], cwd=s.out, check=True)
    assert_saved(saved, s.picture("rendered"), area)
    s.play("open", ["wait loaded", f'drop "{s.out}/scene.json"', "wait loaded", "wait converged", "key escape", "frames 2",
                    *shot("opened"), "key ctrl+shift+s", "frames 2", "key ctrl+a", f'text "{s.out}/again.json"', "key enter", "frames 3",
                    "key ctrl+z", "wait loaded", *shot("back")], "--volume", s.explosion)
    assert_alike(saved, look(s, "opened")[0], area)
    assert s.report("opened")["volumes"][0]["medium"] == medium
    again = json.loads((s.out / "again.json").read_text())
    assert [again["camera"], again["cameras"]] == ["near", scene["cameras"]], again
    assert s.report("back")["scene"]["volume"]["file"].endswith("explosion_0012.vdb"), "opening a scene can be undone"


def test_moving(s):
    drag = ["move viewport 0.3 0.5", "down left"]
    for i in range(12):
        drag += [f"move viewport {0.3 + 0.03 * i:.2f} 0.5"]
    s.play("replay", ["wait loaded", "frames 10", *drag, *shot("moving"), "up left", "wait converged", *shot("rest")],
           "--volume", s.cumulus, "--spp", "2", size=["--size", "1172x600"])
    moving, report, area = look(s, "moving")
    assert report["preview"] and report["picture"][0] < report["viewport"][2], "a moving picture is coarser"
    assert_drawn(moving, area)
    rest = s.report("rest")
    assert rest["picture"] == rest["viewport"][2:] and not rest["preview"], rest
    times = sorted(report["frame_ms"][-12:])
    print(f"median frame while moving: {times[len(times) // 2]:.1f} ms")


def test_idle(s):
    s.play("replay", ["wait loaded", "wait converged", "frames 5", "idle 1.5", "idle 3", *shot("idle")], "--volume",
           s.cumulus)
    assert s.report("idle")["idle_frames"] <= 3, s.report("idle")["idle_frames"]


def test_unchanged(s):
    """A frame that looks like the one before is not drawn. A change in the panel is drawn even without a new image."""
    s.play("replay", ["wait loaded", "wait converged", "frames 60", 'report "before.json"', "frames 60",
                      'report "after.json"', "key f1", "frames 5", 'report "help.json"'], "--volume", s.cumulus)
    before, after = s.report("before"), s.report("after")
    assert after["frames"] - before["frames"] >= 60
    assert after["drawn_frames"] - before["drawn_frames"] <= 3, (before["drawn_frames"], after["drawn_frames"])
    assert s.report("help")["drawn_frames"] > after["drawn_frames"]


def test_record(s):
    steps = ["wait loaded", "drag viewport 0.4 0.5 to viewport 0.6 0.6", "frames 5", "key ]", 'click "View"', "frames 3",
             'click "View/Steps"', "frames 3", "key ctrl+o", "frames 3", f'text "{s.explosion}"', "key enter", "wait loaded"]
    high = ["--size", "640x500"]
    s.play("replay", [*steps, *shot("played")], "--volume", s.cumulus, "--record", "recorded.replay", size=high)
    recorded = (s.out / "recorded.replay").read_text().splitlines()
    assert recorded[-1] == "quit"
    s.play("again", [*recorded[:-1], *shot("again")], "--volume", s.cumulus, size=high)
    a, b = s.report("played")["scene"], s.report("again")["scene"]
    for section in ("volume", "camera", "display", "picture"):
        assert a[section] == b[section], (section, a[section], b[section])


def test_status(s):
    """The interface for scripts: one line on standard error, and the exit status."""
    (s.out / "bad.replay").write_text("frames 1\nclick nowhere\n")
    (s.out / "gone.replay").write_text('click "No such control"\n')
    (s.out / "bad.json").write_text("{")
    cases = [(["--grid-type", "fast"], 2, "--grid-type"), (["--ui-scale", "9"], 2, "--ui-scale"), (["a", "b"], 2, "b"),
             (["a.vdb", "--volume", "b.vdb"], 2, "a.vdb"), (["--replay", "bad.replay"], 1, "bad.replay:2"),
             (["--replay", "gone.replay"], 1, "No such control"), (["--replay", "missing"], 1, "missing"),
             (["--scene", "bad.json"], 1, "bad.json")]
    for arguments, status, named in cases:
        done = s.start(arguments)
        lines = done.stderr.splitlines()
        assert done.returncode == status and len(lines) == 1 and named in lines[0], (arguments, done)
    s.environment.pop("DISPLAY")
    s.environment.pop("WAYLAND_DISPLAY", None)
    done = s.start([])
    assert done.returncode == 1 and len(done.stderr.splitlines()) == 1, done
    done = s.start(["--help"])
    assert done.returncode == 0 and "--replay" in done.stdout and "--scene" in done.stdout, done


def test_timers(s):
    """The graph of GPU time adds up to the growth of the statistics, and --trace writes the same session."""
    # So few frames that the graph still has all of them.
    s.play("replay", ["wait loaded", "frames 20", *shot("early"), "key 2", "frames 20", *shot("late")],
           "--volume", s.cumulus, "--trace", "trace.json")
    for name in ("early", "late"):
        report = s.report(name)
        graph, passes = report["device_ms"], report["pass_seconds"]
        assert 0 < len(graph) < 160, "the graph forgets what is older"
        assert all(ms > 0 for ms in graph), graph
        assert sum(graph) < 1.0001 * 1000 * sum(passes.values()), (sum(graph), passes)
        assert passes["trace"] > 0 and passes["display"] > 0, passes
    early, late = s.report("early"), s.report("late")
    # The graph shows the time of a reported frame only with the next frame.
    known, total = len(early["device_ms"]), 1000 * sum(early["pass_seconds"].values())
    assert late["device_ms"][:known] == early["device_ms"], "what is drawn stays"
    sums = [sum(late["device_ms"][:count]) for count in (known, known + 1)]
    assert min(abs(ms - total) for ms in sums) < 1e-4 * total, (sums, total)
    assert all(late["pass_seconds"][name] >= seconds for name, seconds in early["pass_seconds"].items())
    assert late["pass_seconds"]["inspect"] > early["pass_seconds"]["inspect"] == 0, "views of the grid take time"
    spans.check(s.out / "trace.json", ["computing the sky", "cumulus.vdb"], 4)


def test_convergence(s):
    """The line below the image gives the correct state when the rendering has finished."""
    s.play("replay", ["wait loaded", "idle 25", *shot("rest")], "--volume", s.cumulus, "--spp", "4",
           size=["--size", "400x240"])
    report = s.report("rest")
    assert report["converged"], "25 s are enough for 200 x 240 x 4 samples"
    assert report["state"].startswith("4 samples"), report["state"]


def test_failures(s):
    """Files of the command line that cannot be shown cause a message on standard error, too, and are not added to the
    recent files."""
    (s.out / "cut.vdb").write_bytes(pathlib.Path(s.cumulus).read_bytes()[:5000])
    (s.out / "bad.json").write_text("{")
    for name in ("missing.vdb", "cut.vdb", "bad.json", "missing.glb"):
        (s.out / "replay.replay").write_text('frames 3\nwait loaded\nframes 3\nreport "report.json"\n')
        done = s.start([*SIZE, name, "--replay", "replay.replay"])
        lines = done.stderr.splitlines()
        assert done.returncode == 0 and len(lines) == 1 and name in lines[0], (name, done)
        report = s.report("report")
        assert [m["text"] for m in report["messages"] if m["error"] and name in m["text"]], report["messages"]
        assert report["recent"] == [], report["recent"]
    mountains = pathlib.Path(s.cumulus).with_name("mountains.glb")
    (s.out / "replay.replay").write_text('frames 3\nwait loaded\nframes 3\nreport "report.json"\n')
    done = s.start([*SIZE, "--gltf", str(mountains), "--gltf-animation", "99", "--replay", "replay.replay"])
    assert "mountains.glb: no animation 99; the file has " in done.stderr, done
    report = s.report("report")
    assert [m for m in report["messages"] if m["error"] and "animation 99" in m["text"]], report["messages"]
    assert report["models"] == [] and report["recent"] == [], report
    s.play("later", ["wait loaded", f'drop "{s.out}/cut.vdb"', "frames 3", "wait loaded", *shot("later")], "--volume",
           s.cumulus)
    assert s.report("later")["recent"] == [s.cumulus], s.report("later")["recent"]
    # One file fails and the other is loaded. A slow failure is also one line.
    text = b'{"asset": {"version": "2.0"}, "x": "' + b"a" * 40_000_000 + b'"'
    text += b" " * (-len(text) % 4)
    (s.out / "late.glb").write_bytes(struct.pack("<4sIIII", b"glTF", 2, 20 + len(text), len(text), 0x4E4F534A) + text)
    for volume, surfaces, there, missing in ((s.cumulus, "late.glb", s.cumulus, "late.glb"),
                                             (s.cumulus, "missing.glb", s.cumulus, "missing.glb"),
                                             ("missing.vdb", str(mountains), str(mountains), "missing.vdb")):
        done = s.start([*SIZE, volume, "--gltf", surfaces, "--replay", "replay.replay"])
        lines = done.stderr.splitlines()
        assert done.returncode == 0 and len(lines) == 1 and missing in lines[0], done
        report = s.report("report")
        assert [m["text"] for m in report["messages"] if m["error"] and missing in m["text"]], report["messages"]
        assert report["recent"][0] == there and missing not in " ".join(report["recent"]), report["recent"]
        assert report["has_volume"] == (there == volume) and bool(report["models"]) == (there == surfaces), report


def test_settings(s):
    s.play("replay", ["wait loaded", *shown("Camera"), 'click "Navigation"', "frames 2", 'click "Navigation/Maya"', "frames 2"], "--volume",
           s.cumulus)
    file = s.out / "config/cumulet/demo.json"
    kept = json.loads(file.read_text())
    assert kept["navigation"] == "maya" and kept["recent"][0].endswith("cumulus.vdb"), kept
    s.play("again", ["wait loaded", *tab("File"), *tab("File/Open recent"), 'click "Recent/cumulus.vdb"', "wait loaded", *shot("recent"),
                     "drag viewport 0.3 0.5 to viewport 0.6 0.5", "frames 2", *shot("plain"), "press alt",
                     "drag viewport 0.3 0.5 to viewport 0.6 0.5", "release alt", "frames 2", *shot("alt")])
    assert s.report("recent")["has_volume"]
    eye = lambda name: s.report(name)["scene"]["camera"]["eye"]
    assert eye("plain") == eye("recent"), "Maya's left button alone does nothing"
    assert eye("alt") != eye("plain")
    file.write_text("{ damaged")
    s.play("damaged", ["frames 3", *shot("damaged")])
    json.loads(file.read_text())


def main():
    demo, render, xvfb, scene, out, test = sys.argv[1:]
    out = pathlib.Path(out) / test
    shutil.rmtree(out, ignore_errors=True)
    out.mkdir(parents=True)
    session = Session(demo, render, scene, out)
    read, write = os.pipe()
    server = subprocess.Popen([xvfb, "-displayfd", str(write), "-screen", "0", "1800x1200x24", "-nolisten", "tcp", "-fbdir", str(out)],
                              pass_fds=[write], stderr=subprocess.DEVNULL)
    os.close(write)
    try:
        with os.fdopen(read) as display:
            session.environment["DISPLAY"] = ":" + display.readline().strip()
        tests = {**vars(session_content), **vars(session_input), **vars(session_light), **vars(session_render), **vars(session_saving), **globals()}
        tests[f"test_{test}"](session)
    finally:
        server.terminate()
        server.wait()


main()
