"""Tests of session.py: volumes, sequences, surfaces and grids."""

import json
import pathlib
import shutil
import struct
import subprocess

from demo_session import ALIKE, assert_alike, assert_differ, assert_drawn, assert_saved, look, SETTLE, shot, shown, tab
from moving_model import write_moving_model
from png import difference


def test_volumes(s):
    """Volumes other than the first are hidden, removed, copied and added, and undo reverts each change."""
    far = {"places": [{"translate": [60, 0, 0]}]}
    medium = {"medium": {"density_scale": 1, "albedo": [0.8, 0.8, 0.8]}}  # dark, so that paths are short
    camera = {"eye": [20, 30, 170], "target": [20, 20, 0]}
    volumes = [{"file": s.cumulus, **medium}, {"file": s.cumulus, **medium, **far}]
    (s.out / "two.json").write_text(json.dumps({"cumulet_scene": 2, "volumes": volumes, "camera": camera}))
    # The pointer is away from controls in the images, so that no hint covers them.
    there = ["move viewport 0.5 0.03", "frames 2", "wait loaded", "wait converged", "frames 2"]
    s.play("volumes",
           ["key q", *there, *shot("both"),
            'click "Eye/Volume 2"', *there, *shot("first"),
            "key ctrl+z", *there, *shot("again"),
            'click "Eye/Volume 1"', *there, *shot("second"),
            "key ctrl+z", *shown("Volume 2"), "key delete", *there, *shot("removed"),
            "key ctrl+z", *shown("Volume 2"), "key ctrl+d", *there, *tab("Object"),
            'drag "Scale" to "Scale" 0.55 0.5', *there, 'click "Add volume"', "frames 2", "key escape", *there,
            *shot("copied")],
           "--scene", "two.json")
    both, _, area = look(s, "both")
    first, second, copied = (look(s, name)[0] for name in ("first", "second", "copied"))
    assert_drawn(both, area)
    assert_alike(both, look(s, "again")[0], area)
    assert_alike(first, look(s, "removed")[0], area)
    for other in (first, second, copied):
        assert_differ(both, other, area)
    assert_differ(first, second, area)


def test_clip(s):
    """A clip box changes no image until one of its faces is moved: in the image, or by a slider. Each drag is one undo
    step. A plane cuts as well."""
    volume = {"file": s.cumulus, "medium": {"density_scale": 1, "albedo": [0.8, 0.8, 0.8]}}
    (s.out / "one.json").write_text(json.dumps({
        "cumulet_scene": 3, "volumes": [volume], "camera": {"eye": [60, 60, 170], "target": [0, 20, 0]}}))
    # The pointer is away from handles and controls in the images, so that none is highlighted.
    there = ["move viewport 0.5 0.03", "frames 2", "wait loaded", "wait converged", "frames 2"]
    s.play("clip",
           [*there, *shown("Volume 1"), *tab("Object"), *there, *shot("whole"), 'click "Clip box"', *there, *shot("on"),
            'drag "Handle clip X max" to "Handle X"', *there, *shot("cut"), "key ctrl+z", *there, *shot("undone"),
            'drag "Clip Y max" 0.9 0.5 to "Clip Y max" 0.6 0.5', *there, *shot("slid"),
            'move "Handle clip X min"', "down", 'move "Handle clip X max"', "frames 2", 'report "held.json"', "key escape",
            "frames 2", "up", "frames 2", 'report "let_go.json"',
            'click "Clip box"', *there, 'click "Add clip plane"', *there, *shot("plane"), 'click "Remove clip plane"', *there,
            *shot("none")],
           "--scene", "one.json", "--spp", "4", "--max-bounces", "2", size=["--size", "1000x700"])
    clip = lambda name: s.report(name)["volumes"][0].get("clip", {})
    area = look(s, "whole")[2]
    image = lambda name: look(s, name)[0]
    on = clip("on")["box"]
    assert clip("whole") == {} and s.report("on")["undo_steps"] == 1
    cut = clip("cut")["box"]
    assert cut[3] < on[3] - 0.1 * (on[3] - on[0]) and cut[:3] + cut[4:] == on[:3] + on[4:], (on, cut)
    assert s.report("cut")["undo_steps"] == 2, "a drag is one step"
    assert clip("undone")["box"] == on
    assert_alike(image("on"), image("undone"), area)
    assert_differ(image("on"), image("cut"), area)
    slid = clip("slid")["box"]
    assert slid[4] < on[4] and slid[:4] + slid[5:] == on[:4] + on[5:], (on, slid)
    held = clip("held")["box"]
    assert on[0] < held[0] < held[3] == on[3], "the faces do not pass each other"
    assert clip("let_go")["box"] == slid, "Escape takes it back"
    assert list(clip("plane")) == ["planes"] and len(clip("plane")["planes"]) == 1
    assert_differ(image("plane"), image("none"), area)
    assert clip("none") == {}
    assert_alike(image("whole"), image("none"), area)


def test_handles(s):
    """Objects are selected by a click or in the list. Handles move, rotate and scale them, and each drag is one undo
    step."""
    model = "triangle.gltf"
    corners = struct.pack("<9f", 0, 0, 0, 30, 0, 0, 0, 30, 0)
    (s.out / "corners.bin").write_bytes(corners)
    (s.out / model).write_text(json.dumps({
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}], "buffers": [{"byteLength": 36, "uri": "corners.bin"}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [30, 30, 0]}]}))
    medium = {"medium": {"density_scale": 4, "albedo": [0.8, 0.8, 0.8]}}
    volumes = [{"file": s.cumulus, **medium}, {"file": s.cumulus, **medium, "places": [{"translate": [-50, 0, 0]}, {"translate": [55, 0, 0]}]}]
    lamp = {"kind": "rectangle", "position": [0, 60, 20], "power": 3000, "width": 20, "height": 10}
    (s.out / "all.json").write_text(json.dumps({
        "cumulet_scene": 2, "volumes": volumes, "environment": {"sky": {"radiance": [0.5, 0.6, 0.8]}}, "lights": [lamp], "models": [{"file": model, "translate": [-12, -8, 30]}],
        "camera": {"eye": [20, 50, 190], "target": [0, 20, 0]}}))
    there = ["frames 2", "wait loaded", "wait converged"]
    tell = lambda name: ["frames 3", "wait loaded", *shot(name)]
    s.play("handles",
           [*there, *shot("first"), "click viewport 0.5 0.45", "move viewport 0.05 0.8", *there, *shot("clicked"),
            'drag "Handle X" to viewport 0.75 0.5', *there, *shot("moved"),
            "key ctrl+z", "move viewport 0.05 0.8", *there, *shot("undone"), "key ctrl+shift+z", *tell("redone"), "key ctrl+z", *there,
            # Escape during a drag reverts it.
            'move "Handle Y"', "down", "move viewport 0.5 0.1", "frames 2", *shot("held"), "key escape", "frames 2", "up",
            *tell("let_go"),
            "key e", "frames 2", *shot("rings"), 'drag "Handle Y" to viewport 0.45 0.7', *tell("turned"),
            'key x', "key r", "frames 2", *shot("blocks"), "press ctrl", 'drag "Handle free" to viewport 0.6 0.4', "release ctrl",
            *tell("scaled"),
            'click "Scene/Volume 2, instance 2"', "key w", *tell("place"), 'drag "Handle free" to viewport 0.8 0.6', *tell("place_moved"),
            'click "Scene/Model 1"', *tell("model"), "press ctrl", 'drag "Handle Y" to viewport 0.45 0.2', "release ctrl", *tell("model_moved"),
            'click "Scene/Light 1"', *tell("lamp"), "key x", "key e", "frames 2", 'drag "Handle Z" to viewport 0.6 0.4', *tell("lamp_turned"),
            "click viewport 0.02 0.05", *tell("nothing"), "key q", *there, *shot("none")],
           "--scene", "all.json", "--spp", "2", "--max-bounces", "2", size=["--size", "1000x560"])
    report = lambda name: s.report(name)
    steps = lambda name: s.report(name)["undo_steps"]
    transforms = lambda name, i: s.report(name)["volumes"][i].get("transforms", [])
    assert report("first")["chosen"] is None and steps("first") == 0
    assert report("clicked")["chosen"] == "Volume 1" and steps("clicked") == 0, "choosing is no change"
    area = look(s, "first")[2]
    # Compares the maximum block difference, because an outline is thin.
    outlined = lambda name: difference(look(s, "first")[0], look(s, name)[0], area)[1] > 2 * ALIKE[1]
    assert outlined("clicked")
    (moved,) = transforms("moved", 0)
    assert moved[12] > 5 and abs(moved[13]) < 1e-9 and abs(moved[14]) < 1e-9, moved
    assert steps("moved") == 1, "a drag is one step"
    assert transforms("undone", 0) == [] and steps("undone") == 0 and report("undone")["chosen"] == "Volume 1"
    assert_alike(look(s, "clicked")[0], look(s, "undone")[0], area)
    assert transforms("redone", 0) == transforms("moved", 0) and steps("redone") == 1
    assert transforms("held", 0) != [] and transforms("let_go", 0) == [] and steps("let_go") == 0, "Escape takes it back"
    # A rotation about the vertical axis; the object's center does not move.
    (turned,) = transforms("turned", 0)
    assert abs(turned[5] - 1) < 1e-9 and abs(turned[0] - turned[10]) < 1e-9 and 0.1 < abs(turned[8]) < 1, turned
    assert steps("turned") == 1
    # Scales in steps of 0.1, along the object's own axes.
    (scaled,) = transforms("scaled", 0)
    size = [sum(scaled[4 * i + k] ** 2 for k in range(3)) ** 0.5 for i in range(3)]
    assert size[0] > 1.05 and abs(10 * size[0] - round(10 * size[0])) < 1e-6 and max(size) - min(size) < 1e-6, size
    assert abs(scaled[8] / size[2] - turned[8]) < 1e-6 and steps("scaled") == 2, scaled
    # Moves only the selected one of two instances.
    assert report("place")["chosen"] == "Volume 2, instance 2" and steps("place") == 2
    assert transforms("place_moved", 1)[0] == transforms("place", 1)[0] != transforms("place_moved", 1)[1], transforms("place_moved", 1)
    (model_before,), (model_moved,) = (report(name)["models"] for name in ("model", "model_moved"))
    assert report("model_moved")["chosen"] == "Model 1" and steps("model_moved") == 4
    way = [a - b for a, b in zip(model_moved["to_world"], model_before["to_world"])]
    assert way[13] > 5 and abs(2 * way[13] - round(2 * way[13])) < 1e-6 and sum(map(abs, way)) == abs(way[13]), "by steps"
    (lamp_before,), (lamp_turned,) = (report(name)["lights"] for name in ("lamp", "lamp_turned"))
    assert report("lamp")["chosen"] == "Light 1" and steps("lamp_turned") == 5
    assert lamp_turned["position"] == lamp_before["position"] and lamp_turned["width"] == lamp_before["width"]
    assert abs(lamp_turned["direction"][0]) > 0.1 and abs(lamp_turned["direction"][2]) < 1e-9, lamp_turned
    assert report("nothing")["chosen"] is None and steps("nothing") == 5
    assert report("none")["tool"] == 0


def test_timeline(s):
    """A numbered file is a single frame until the user makes it a sequence, which plays in a loop. The sequence is
    stepped, played, scrubbed, trimmed and saved. A frame that cannot be read is reported once."""
    frames = [f"fire_{number:02}.vdb" for number in range(3, 9)]
    for number, name in enumerate(frames):
        # Frame 3 is the explosion, 4 is missing, 5 the cloud, 6 corrupt, 7 the explosion, 8 the cloud.
        if name == "fire_06.vdb":
            (s.out / name).write_bytes(b"no volume")
        elif name != "fire_04.vdb":
            shutil.copy(s.cumulus if number in (2, 5) else s.explosion, s.out / name)
    there = ["frames 3", "wait loaded", "wait converged", "frames 2"]
    quick = ["--spp", "2", "--albedo", "0.5,0.5,0.5", "--max-bounces", "2"]
    size = ["--size", "640x260"]
    s.play("timeline",
           [*there, *shot("alone"), *tab("Sequence"), 'click "Play the sequence"', "frames 3", "wait loaded", "frames 60", *shot("looping"),
            'click "Last"', *there, *shot("opened"), 'click "First"', *there, 'report "begin.json"', 'click "Last"', *there,
            "key ,", "key ,", "key ,", *there, "key .", *there, *shot("next"), "key ,", "key ,", *there, *shot("missing"),
            "key o", "key ctrl+z", "frames 2", 'report "undone.json"', "key i", 'click "Loop"', "frames 2",
            'report "held.json"', 'click "Loop"', "frames 2", "key space", "frames 60", 'report "playing.json"', "key space", *there,
            'click "Playhead" 0.99 0.5', "key escape", "key escape", *there, *shot("scrubbed"), "key ctrl+s", "frames 2", "key ctrl+a",
            f'text "{s.out}/played.json"', "key enter", "frames 3",
            'click "Playhead" 0.01 0.5', *there, "key space", "frames 12", "key space", *there, 'report "again.json"'],
           "fire_05.vdb", *quick, size=size)
    alone, opened, following, missing = (s.report(name) for name in ("alone", "opened", "next", "missing"))
    assert "sequence" not in alone and alone["neighbours"] == 6, alone
    looping = s.report("looping")
    assert looping["sequence"]["playing"] and looping["sequence"]["repeat"] == 1, looping["sequence"]
    assert looping["sequence"]["clock"] > 3 * 6 / 24, f"it has played three times: {looping['sequence']}"
    assert opened["sequence"]["frame"] == opened["sequence"]["drawn"] == 8, opened["sequence"]
    assert not opened["sequence"]["playing"] and s.report("begin")["sequence"]["frame"] == 3, opened["sequence"]
    assert s.report("held")["sequence"]["repeat"] == 0, "the button turns the loop off"
    assert opened["sequence"]["first"] == 3 and opened["sequence"]["count"] == 6, opened["sequence"]
    assert opened["viewport"][3] < alone["viewport"][3], "the timeline is below the picture"
    assert following["sequence"]["frame"] == 6 and following["sequence"]["drawn"] == 5, "the one before stands in"
    assert "fire_06.vdb" in following["sequence"]["failure"], following["sequence"]
    assert missing["sequence"]["frame"] == 4 and missing["sequence"]["drawn"] == 3, missing["sequence"]
    assert missing["sequence"]["ready"] == 4 and missing["sequence"]["failed"] == 2, missing["sequence"]
    for name in ("fire_04.vdb", "fire_06.vdb"):
        assert [name in line for line in s.report("again")["log"]].count(True) == 1, (name, s.report("again")["log"])
    assert s.report("undone")["sequence"]["last_played"] is None, "the range is undone"
    assert s.report("undone")["sequence"]["frame"] == 4, "and the playhead is not"
    playing = s.report("playing")["sequence"]
    assert playing["playing"] and playing["first_played"] == 4 and playing["frame"] >= 4, playing
    assert playing["clock"] - missing["sequence"]["clock"] > 0.9, "it is by the clock of frames"
    scrubbed = s.report("scrubbed")["sequence"]
    assert scrubbed["frame"] == scrubbed["drawn"] == 8 and not scrubbed["playing"], scrubbed
    assert_differ(look(s, "missing")[0], look(s, "scrubbed")[0], look(s, "scrubbed")[2])
    assert s.report("again")["sequence"]["frame"] >= 4, "from outside it plays the range"
    # Both programs show the saved scene.
    scene = json.loads((s.out / "played.json").read_text())
    assert scene["volumes"][0]["file"] == "fire_##.vdb" and scene["sequence"]["frame"] == 8, scene
    assert scene["sequence"]["first_frame"] == 4 and scene["sequence"]["repeat"] == "loop", scene["sequence"]
    s.play("loaded", [*there, "key escape", "key escape", "frames 2", *shot("loaded")], "--scene", "played.json", "--spp", "2", size=size)
    loaded = s.report("loaded")["sequence"]
    assert loaded["frame"] == 8 and loaded["first_played"] == 4 and loaded["repeat"] == 1, loaded
    assert_alike(look(s, "loaded")[0], look(s, "scrubbed")[0], look(s, "loaded")[2])
    run = subprocess.run([s.renderer, "--scene", "played.json", "--spp", "4", "--size", "64x48", "-o", "eight.png"],
                         cwd=s.out, env=s.environment, capture_output=True, text=True, check=False)
    assert run.returncode == 0 and "frame 8 (1 of 1) done eight.png" in run.stdout, (run.stdout, run.stderr)
    run = subprocess.run([s.renderer, "--scene", "played.json", "--frames", "5,7", "--spp", "4", "--size", "64x48", "-o",
                          "other.#.png"], cwd=s.out, env=s.environment, capture_output=True, text=True, check=False)
    assert run.returncode == 0 and (s.out / "other.5.png").exists() and (s.out / "other.7.png").exists(), run.stderr
    # A file that cannot be read does not replace the playing sequence. If playback has stopped at the end, it restarts
    # at the beginning.
    (s.out / "cut.vdb").write_bytes(b"no volume")
    for number in (1, 2):
        (s.out / f"cut_{number}.vdb").write_bytes(b"no volume")
    mountains = pathlib.Path(s.cumulus).with_name("mountains.glb")
    s.play("kept", [*there, 'drop "cut.vdb"', *there, 'report "cut.json"', 'drop "cut_#.vdb"', *there, 'report "all.json"',
                    *(["key .", "frames 3"] * 5), *there,
                    "key ctrl+s", "frames 2", "key ctrl+a", f'text "{s.out}/beside.json"', "key enter", "frames 3",
                    'click "Loop"', "frames 2", "key space", "frames 3", 'report "begun.json"'],
           "fire_##.vdb", "--gltf", str(mountains), "--spp", "1", size=size)
    for name, cause in (("cut", "cut.vdb"), ("all", "cut_1.vdb")):
        report = s.report(name)
        assert report["sequence"]["count"] == 6 and report["sequence"]["drawn"] == 3, report["sequence"]
        assert any(m["error"] and cause in m["text"] for m in report["messages"]), report["messages"]
    begun = s.report("begun")["sequence"]
    assert begun["playing"] and begun["frame"] < 8, begun
    beside = json.loads((s.out / "beside.json").read_text())
    assert beside["sequence"]["frame"] == 8 and abs(beside["models"][0]["time"] - 5 / 24) < 1e-6, beside


def test_surfaces(s):
    """A model that was opened has the rows, the eye and the gizmo of every model."""
    away = ["move viewport 0.02 0.5", "frames 2"]  # no tooltip covers the picture
    mountains = str(pathlib.Path(s.cumulus).with_name("mountains.glb"))
    s.play("replay", [*SETTLE, *shot("first"), *shown("Render"), *tab("Advanced"), 'drag "Indirect roughness" 0.02 0.5 to "Indirect roughness" 0.6 0.5', *SETTLE,
                      *shot("soft"), 'click "Surface lighting"', "frames 2", 'click "Surface lighting/Rasterized"', *SETTLE, *shot("none"),
                      *shown("Model 1"), *shown("Model 1", "Eye/"), *away, *SETTLE, *shot("hidden"), *shown("Model 1", "Eye/"), "key delete",
                      *away, *SETTLE, *shot("removed"), "key ctrl+z", *SETTLE, *shot("back")],
           "--volume", s.cumulus, "--gltf", mountains, "--spp", "2")
    first, report, area = look(s, "first")
    assert report["models"][0]["indirect_roughness"] == 0
    soft, soft_report, _ = look(s, "soft")
    assert 0.4 < soft_report["models"][0]["indirect_roughness"] < 0.8, soft_report["models"]
    assert difference(first, soft, area) != (0, 0), "the same samples find rougher surfaces"
    none, none_report, _ = look(s, "none")
    assert none_report["models"][0]["lighting"] == "rasterized"
    assert difference(soft, none, area) != (0, 0)
    hidden, hidden_report, _ = look(s, "hidden")
    assert [one["file"] for one in hidden_report["models"]] == [mountains] and hidden_report["undo_steps"] > 0, hidden_report["models"]
    assert_differ(none, hidden, area)
    removed, removed_report, _ = look(s, "removed")
    assert removed_report["models"] == []
    assert_differ(none, removed, area)
    assert_alike(none, look(s, "back")[0], area)


def test_animated_model(s):
    """A model has rows for its animation, the time in it and its material variant. While a sequence is shown, the time is
    that of its clock."""
    write_moving_model(s.out / "rising.gltf")
    camera = {"eye": [-5, 4, 44], "target": [-5, 4, 0]}
    light = {"environment": {"sun": {"azimuth_degrees": 20, "irradiance": [3, 3, 3]}, "sky": {"radiance": [0.4, 0.5, 0.6]}}}
    still = {"cumulet_scene": 2, "models": [{"file": "rising.gltf"}, {"file": "rising.gltf", "translate": [-15, 0, 1]}], "camera": camera, **light}
    (s.out / "still.json").write_text(json.dumps(still))
    there = ["frames 3", "wait loaded", "wait converged", "frames 2"]
    choose = lambda label, entry: [f'click "{label}"', "frames 2", f'click "{label}/{entry}"', *there, "move viewport 0.02 0.5", *there]
    rows = lambda name: [f'click "Scene/{name}"', *there]
    s.play("models",
           [*there, *rows("Model 2"), *shot("before"), 'drag "Time" 0.01 0.5 to "Time" 0.5 0.5', *there, *shot("risen"),
            *choose("Animation", "slide"), *shot("slid"), *choose("Variant", "green"), *shot("green"), "key ctrl+z", *there, *shot("undone")],
           "--scene", "still.json", "--spp", "4", size=["--size", "1000x700"])
    model = lambda name: s.report(name)["models"][1]
    area = look(s, "before")[2]
    image = lambda name: look(s, name)[0]
    risen = model("risen")["time"]
    assert 0.7 < risen < 1.3, f"the slider ends at the animation's 2 s: {risen}"
    assert "time" not in model("before") and model("slid")["animation"] == 1 and model("slid")["time"] == risen
    assert model("green")["variant"] == "green" and "variant" not in model("undone")
    for one, other in (("before", "risen"), ("risen", "slid"), ("slid", "green")):
        assert_differ(image(one), image(other), area)
    assert_alike(image("slid"), image("undone"), area)
    for number in (1, 2, 3):
        shutil.copy(s.explosion, s.out / f"fire_{number}.vdb")
    (s.out / "playing.json").write_text(json.dumps({**still, "volumes": [{"file": "fire_#.vdb", "medium": {"density_scale": 0.2, "max_bounces": 2}}],
                                                    "sequence": {"frame": 1, "frames_per_second": 2}}))
    s.play("playing", [*there, *rows("Model 1"), *shot("first"), 'click "Last"', *there, *shot("last"),
                       'drag "Time" 0.5 0.5 to "Time" 0.1 0.5', *there, *shot("dragged")],
           "--scene", "playing.json", "--spp", "4", size=["--size", "1000x700"])
    assert_differ(image("first"), image("last"), look(s, "last")[2])
    assert_alike(image("last"), image("dragged"), look(s, "last")[2])
    assert s.report("dragged")["undo_steps"] == 0, "the row is disabled"


def test_negative_frames(s):
    """A sequence with negative frame numbers plays from its first frame."""
    for number in (-2, -1, 0, 1):
        shutil.copy(s.explosion if number < 0 else s.cumulus, s.out / f"fire.{'%04d' % number}.vdb")
    there = ["frames 3", "wait loaded", "wait converged", "frames 2"]
    s.play("replay", [*there, *shot("first"), "key .", *there, "key i", "key .", *there, *shot("third"), "key ctrl+s", "frames 2",
                      "key ctrl+a", f'text "{s.out}/played.json"', "key enter", "frames 3"],
           "fire.####.vdb", "--spp", "1", "--max-bounces", "2", size=["--size", "640x260"])
    first, third = s.report("first")["sequence"], s.report("third")["sequence"]
    assert first["first"] == -2 and first["count"] == 4 and first["frame"] == first["drawn"] == -2, first
    assert third["frame"] == third["drawn"] == 0 and third["first_played"] == -1 and third["failed"] == 0, third
    scene = json.loads((s.out / "played.json").read_text())
    assert scene["sequence"]["first_frame"] == -1 and scene["sequence"]["frame"] == 0, scene["sequence"]


def test_bad_files(s):
    volume = pathlib.Path(s.cumulus).read_bytes()
    (s.out / "cut.vdb").write_bytes(volume[: len(volume) // 2])
    (s.out / "empty.vdb").write_bytes(b"")
    (s.out / "text.nvdb").write_text("this is no volume")
    (s.out / "bad.json").write_text('{"cumulet_scene": 1, "medium": {"albedo": 1}}')
    names = ["cut.vdb", "empty.vdb", "text.nvdb", "bad.json", "missing.vdb"]
    replay = ["wait loaded", "wait converged", *shot("before")]
    for name in names:
        replay += [f'drop "{s.out}/{name}"', "frames 2", "wait loaded", *shot(name), "key escape", "frames 2"]
    s.play("replay", [*replay, "wait converged", *shot("after")], "--volume", s.cumulus)
    for name in names:
        (message,) = [m for m in s.report(name)["messages"] if m["error"]]
        assert name in message["text"] and "\n" not in message["text"], message
    before, report, area = look(s, "before")
    after, after_report, _ = look(s, "after")
    assert after_report["messages"] == [], "a message can be dismissed"
    assert after_report["scene"] == report["scene"]
    assert_alike(before, after, area)


def test_grids(s):
    """The panel lists a file's grids and shows each of them, with a suitable density scale."""
    s.play("replay", ["wait loaded", *shot("opened"), *tab("Grids"), 'click "Inspect grids"', "frames 2", "idle 3", *shot("picker"),
                      'click "Grids/temperature"', "frames 3", "wait loaded", *shot("temperature"),
                      *tab("Material"), 'drag "Density" 0.5 0.5 to "Density" 0.9 0.5', "frames 3", *shot("dense"),
                      'click "Auto density"', "frames 5", *shot("auto"), "key ctrl+z", "frames 5", *shot("undone"),
                      "key ctrl+z", "frames 3", "key ctrl+z", "frames 3", "wait loaded", *shot("back")],
           "--density-scale", "auto", "--volume", s.explosion)
    scale = lambda name: s.report(name)["scene"]["medium"]["density_scale"]
    grid = lambda name: s.report(name)["scene"]["volume"].get("grid", "")
    assert [s.report(name)["grid"] for name in ("opened", "temperature", "back")] == ["density", "temperature", "density"]
    assert scale("opened") not in (0, 1), "a scale that suits it"
    assert s.report("picker")["dialog"] and not s.report("temperature")["dialog"]
    assert grid("temperature") == "temperature", s.report("temperature")["scene"]["volume"]
    assert scale("temperature") != scale("opened")
    assert scale("dense") > 2 * scale("temperature")
    assert scale("auto") == scale("temperature") and scale("undone") == scale("dense")
    assert scale("back") == scale("opened") and grid("back") == "", "undo takes grid and scale back together"


def test_unnamed_grids(s):
    """A file with several grids and none called density opens a dialog. One grid is shown until the user selects
    another."""
    bytes_of = pathlib.Path(s.explosion).read_bytes()
    unknown = bytes_of.replace(b"density", b"mystery").replace(b"temperature", b"warmthiness").replace(b"flame", b"other")
    (s.out / "unknown.vdb").write_bytes(unknown)
    (s.out / "fire.vdb").write_bytes(bytes_of.replace(b"density", b"mystery"))
    # The grid shown at first, and the grid selected instead.
    for file, first, second in (("unknown", "mystery", "warmthiness"), ("fire", "flame", "mystery")):
        s.play(file, ["frames 3", f'drop "{s.out}/{file}.vdb"', "frames 3", "wait loaded", "frames 2", "idle 3",
                      *shot("asked"), f'click "Grids/{second}"', "frames 3", "wait loaded", *shot("chosen"), "key ctrl+z",
                      "frames 3", "wait loaded", *shot("back")])
        asked, chosen, back = (s.report(name) for name in ("asked", "chosen", "back"))
        assert asked["dialog"] and asked["has_volume"] and asked["grid"] == first, (asked["dialog"], asked["grid"])
        assert not chosen["dialog"] and chosen["grid"] == second, (chosen["dialog"], chosen["grid"])
        assert chosen["scene"]["volume"]["grid"] == second
        assert back["grid"] == first and "grid" not in back["scene"]["volume"], back["scene"]["volume"]
    # A file with a density grid opens no dialog.
    s.play("named", ["frames 3", f'drop "{s.explosion}"', "frames 3", "wait loaded", "frames 2", "idle 1", *shot("named")])
    assert not s.report("named")["dialog"] and s.report("named")["grid"] == "density"


def test_clip_turns(s):
    """A clip turns with the up axis of its volume, as part of the same undo step."""
    clip = {"box": [-9, -8, -7, 4, 5, 6], "planes": [[0, -1, 0, 2]]}
    (s.out / "one.json").write_text(json.dumps({
        "cumulet_scene": 3, "volumes": [{"file": s.explosion, "clip": clip}], "camera": {"eye": [0, 5, 30], "target": [0, 3, 0]}}))
    up = lambda axis, name: ['click "Up axis"', "frames 2", f'click "Up axis/{axis}"', "frames 3", "wait loaded", "frames 2",
                             f'report "{name}.json"']
    s.play("replay", ["wait loaded", *tab("Grids"), *up("Z", "z"), *up("Y", "y"), "key ctrl+z", "frames 3", "wait loaded",
                      'report "undone.json"'], "--scene", "one.json", "--spp", "1")
    volume = lambda name: s.report(name)["volumes"][0]
    turned = {"box": [-9, -7, -5, 4, 6, 8], "planes": [[0, 0, 1, 2]]}
    assert volume("z")["up"] == "z" and volume("z")["clip"] == turned, volume("z")
    assert volume("y").get("up", "y") == "y" and volume("y")["clip"] == clip, volume("y")
    assert volume("undone")["clip"] == turned and s.report("undone")["undo_steps"] == 1, volume("undone")


def test_added_fails(s):
    """An object that is added is removed again if its file cannot be opened, and is no undo step. A later one is
    added."""
    for name in ("bad.vdb", "bad.glb"):
        (s.out / name).write_bytes(b"nothing")
    add = lambda kind, file, report: [f'click "Add {kind}"', "frames 3", "key ctrl+a", f'text "{file}"', "key enter", "frames 3",
                                      "wait loaded", "frames 3", f'report "{report}.json"', "key escape", "frames 2"]
    s.play("replay", ["wait loaded", "frames 3", *add("volume", s.out / "bad.vdb", "volume"), *add("model", s.out / "bad.glb", "model"),
                      *add("volume", s.explosion, "added")], "--volume", s.cumulus, "--spp", "1")
    for name, file in (("volume", "bad.vdb"), ("model", "bad.glb")):
        report = s.report(name)
        assert [m["text"] for m in report["messages"] if m["error"] and file in m["text"]], report["messages"]
        assert len(report["volumes"]) == 1 and report["models"] == [] and report["undo_steps"] == 0, report["volumes"]
    added = s.report("added")
    assert len(added["volumes"]) == 2 and added["undo_steps"] == 1 and added["chosen"] == "Volume 2", added["volumes"]


def test_up_axis(s):
    """The up axis is selected, displayed, saved and undone; cumulet-render shows the same image."""
    s.play("replay", ["wait loaded", "wait converged", *shot("y"), *tab("Grids"), 'click "Up axis"', "frames 2", 'click "Up axis/Z"', "frames 3",
                      "move viewport 0.5 0.5", "wait loaded", "wait converged", *shot("z"), "key ctrl+s", "frames 2", "key ctrl+a", f'text "{s.out}/scene.json"',
                      "key enter", "frames 3", "key escape", "frames 2", "key ctrl+z", "frames 3", "wait loaded",
                      "wait converged", *shot("back")],
           "--volume", s.explosion)
    up = lambda name: s.report(name)["scene"]["volume"].get("up", "y")
    assert [up(name) for name in ("y", "z", "back")] == ["y", "z", "y"]
    assert json.loads((s.out / "scene.json").read_text())["volumes"][0]["up"] == "z"
    standing, report, area = look(s, "y")
    lying = look(s, "z")[0]
    assert_differ(standing, lying, area)
    assert_alike(standing, look(s, "back")[0], area)
    subprocess.run([s.renderer, "--scene", "scene.json", "-o", "rendered.png"], cwd=s.out, check=True)
    assert_saved(lying, s.picture("rendered"), area)
