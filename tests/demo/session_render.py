"""Tests of session.py: pictures that are rendered in the background, and hints with buttons."""

import base64
import json
import os
import pathlib
import shutil
import struct
import subprocess

from demo_session import assert_alike, shot, shown, tab

DONE, FAILED, CANCELLED = 2, 3, 4


def choose(label, entry):
    return [f'click "{label}"', "frames 2", f'click "{label}/{entry}"', "frames 2"]


def enter(label, text):
    """Types into a field of the dialog. Enter in the file's field starts the picture."""
    return [f'click "{label}" 0.3 0.5', "frames 2", "key ctrl+a", "frames 1", f'text "{text}"', "frames 1", "key enter", "frames 3"]


SMALL = [*enter("Picture width", "96"), *enter("Picture height", "54"), *enter("Max samples", "4")]


def file_manager(s):
    """Makes xdg-open a script that writes its argument to a file."""
    folder = s.out / "bin"
    folder.mkdir()
    script = folder / "xdg-open"
    script.write_text(f"#!/bin/sh\necho \"$1\" >'{s.out}/opened.part' && mv '{s.out}/opened.part' '{s.out}/opened'\n")
    script.chmod(0o755)
    s.environment["PATH"] = f"{folder}:{os.environ['PATH']}"


def test_render(s):
    """F12 renders a picture in the background, while the window stays usable."""
    file_manager(s)
    s.play("replay",
           ["wait loaded", "wait converged", "key ctrl+s", "frames 2", "key ctrl+a", f'text "{s.out}/scene.json"', "key enter", "frames 3",
            "key f12", "frames 3", *shot("dialog"), *SMALL, *choose("Denoise", "Off"), *enter("Picture file", f"{s.out}/one.png"), *shot("started"),
            "drag viewport 0.3 0.5 to viewport 0.5 0.5", "frames 3", *shot("moved"), "wait rendered", "frames 3", *shot("done"),
            'click "Render 1/Show in folder"', "frames 3",
            "key f12", "frames 3", *choose("Format", "EXR"), 'click "Layer/normal"', "frames 2", *choose("Denoise", "Fast"),
            *enter("Picture file", f"{s.out}/two.exr"), "wait rendered", "frames 3",
            "key f12", "frames 3", *choose("Format", "WebP"), *enter("Picture file", f"{s.out}/three"), "wait rendered", "frames 3",
            # A picture that takes long is canceled, and a wrong path is refused.
            "key f12", "frames 3", *enter("Max samples", "60000"), *enter("Picture file", f"{s.out}/never.webp"), "frames 20", *shot("runs"),
            'click "Render 4/Cancel"', "wait rendered", "frames 3",
            "key f12", "frames 3", *enter("Picture file", "/proc/nowhere/a.webp"), *shot("refused"), "key escape", "key escape", "frames 3",
            *shot("end"),
            "key f12", "frames 3", *enter("Max samples", "60000"), *enter("Picture file", f"{s.out}/never.webp"), "frames 10",
            "key ctrl+q", "frames 3", *shot("asked"), 'click "Question/Quit anyway"', "frames 30", 'screenshot "never.png"'],
           "--volume", s.cumulus, "--spp", "4", "--shader-cache", "shaders", size=["--size", "900x600"])
    report = s.report
    assert report("dialog")["dialog"] and not report("started")["dialog"]
    assert report("moved")["scene"]["camera"] != report("dialog")["scene"]["camera"], "the window is usable"
    (entry,) = report("done")["renders"]
    assert entry["state"] == DONE and entry["part"] == 1 and "96x54" in entry["text"], entry
    assert any(m["text"].startswith("Rendered ") and m["button"] == "Show in folder" for m in report("done")["messages"])
    one = s.picture("one")
    assert [one.width, one.height] == [96, 54]
    subprocess.run([s.renderer, "--scene", "scene.json", "--size", "96x54", "--spp", "4", "--denoise", "off", "-o", "reference.png"],
                   cwd=s.out, check=True)
    assert_alike(one, s.picture("reference"), (0, 0, 96, 54))
    assert pathlib.Path((s.out / "opened").read_text().strip()).resolve() == s.out.resolve()
    header = (s.out / "two.exr").read_bytes()[:4096]
    assert header[:4] == b"\x76\x2f\x31\x01" and b"normal.X" in header and b"denoised.R" in header
    assert b"albedo" not in header, "only the chosen layers"
    webp = (s.out / "three.webp").read_bytes()
    assert webp[:4] == b"RIFF" and webp[8:12] == b"WEBP"
    assert 0 <= report("runs")["renders"][3]["part"] < 1, report("runs")["renders"]
    assert report("refused")["dialog"] and len(report("refused")["renders"]) == 4
    assert [entry["state"] for entry in report("end")["renders"]] == [DONE, DONE, DONE, CANCELLED], report("end")["renders"]
    assert [m for m in report("end")["messages"] if m["error"]] == []
    assert report("asked")["question"] == "Unfinished pictures"
    for name in ("never.webp", "never.png"):
        assert not (s.out / name).exists(), name


def test_walk(s):
    """Loads a cloud, sets the sunset, adds a light and saves 1920x1080, with buttons and with keys that the menus name."""
    typed = ["frames 2", "key ctrl+a", "frames 1"]
    hand = ['click "Start/Open"', "frames 3", *typed, f'text "{s.cumulus}"', "key enter", "frames 3", "wait loaded", "frames 3", *shot("loaded"),
            'click "Scene/Sun & sky"', "frames 2", 'drag "Time of day" 0.7 0.5 to "Time of day" 0.905 0.5', "frames 3", "wait converged", "frames 30", *shot("sunset"),
            'click "Add light"', "frames 3", *shot("lit"),
            "key f12", "frames 3", *shot("dialog"), *choose("Resolution", "Full HD 1920x1080"),
            *enter("Max samples", "2"), *enter("Picture file", f"{s.out}/walk.png"), "wait rendered", "frames 3", *shot("saved")]
    s.play("replay", hand, "--spp", "2", "--denoise", "fast", "--shader-cache", "shaders", size=["--size", "1440x900"], auto_exposure=True)
    picture = s.picture("walk")
    assert [picture.width, picture.height] == [1920, 1080]
    assert s.report("loaded")["volumes"][0]["file"].endswith("cumulus.vdb")
    assert 0.0 < s.report("sunset")["scene"]["light"]["sun"]["elevation_degrees"] < 12.0, s.report("sunset")["scene"]["light"]
    assert s.report("sunset")["scene"]["display"]["exposure_stops"] > 0.4, "the exposure follows the sun"
    (light,) = s.report("lit")["lights"]
    assert light["power"] > 0.0
    (entry,) = s.report("saved")["renders"]
    assert entry["state"] == DONE, entry
    assert [m for m in s.report("saved")["messages"] if m["error"]] == []
    actions = [command for command in hand if command.split()[0] in ("click", "drag", "key", "text")]
    assert len(actions) < 30, "three minutes at six seconds each"


def test_render_sequence(s):
    """A range of frames becomes numbered files. The clock of the window does not matter."""
    for number in range(1, 5):
        shutil.copy(s.explosion if number % 2 else s.cumulus, s.out / f"fire_{number}.vdb")
    (s.out / "fire_4.vdb").write_bytes(b"no volume")
    there = ["frames 3", "wait loaded", "wait converged", "frames 2"]
    s.play("replay", [*there, "key f12", "frames 3", *SMALL, 'click "Sequence"', "frames 2", *shot("dialog"), *enter("Picture file", f"{s.out}/out_##.png"),
                      "key .", *there, "wait rendered", "frames 3", *shot("done"),
                      "key f12", "frames 3", *enter("Max samples", "4"), 'click "Sequence"', "frames 2",
                      *enter("Picture file", f"{s.out}/single.png"), "wait rendered", "frames 3",
                      *shot("still")],
           "fire_#.vdb", "--spp", "1", "--max-bounces", "2", "--shader-cache", "shaders", size=["--size", "900x600"])
    (entry,) = s.report("done")["renders"]
    assert entry["state"] == DONE and "3 frames, failed: 4" in entry["text"] and "fire_4.vdb" in entry["text"], entry
    assert sorted(file.name for file in s.out.glob("out_*.png")) == ["out_01.png", "out_02.png", "out_03.png"]
    one, two = s.picture("out_01"), s.picture("out_02")
    assert [one.width, one.height] == [96, 54] and one.rows != two.rows, "each frame has its own picture"
    assert_alike(one, s.picture("out_03"), (0, 0, 96, 54))
    assert s.report("still")["renders"][-1]["state"] == DONE
    assert_alike(two, s.picture("single"), (0, 0, 96, 54))


def write_model(file):
    """Writes a triangle with a texture that does not exist."""
    corners = base64.b64encode(struct.pack("<9f", 0, 0, 0, 30, 0, 0, 0, 30, 0)).decode()
    file.write_text(json.dumps({
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "material": 0}]}],
        "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
        "textures": [{"source": 0}], "images": [{"uri": "gone.png"}],
        "buffers": [{"byteLength": 36, "uri": f"data:application/octet-stream;base64,{corners}"}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [30, 30, 0]}]}))


def test_hints(s):
    """Missing textures of added models are reported, and the log keeps the message."""
    for name in ("first", "second"):
        write_model(s.out / f"{name}.gltf")
    there = ["frames 3", "wait loaded", "frames 3"]
    s.play("textures", [*there, f'drop "{s.out}/first.gltf" "{s.out}/second.gltf"', *there, *shot("added"), *["key escape"] * 4, "frames 2",
                        *tab("View"), 'click "View/Messages"', "frames 3", *shot("log"), 'click "Clear log"', "frames 2", *shot("cleared")],
           "--volume", s.cumulus, "--spp", "1", size=["--size", "900x600"])
    added = s.report("added")
    assert any("second.gltf" in text and "gone.png" in text for text in added["log"]), added["log"]
    assert any("first.gltf" in text and "gone.png" in text for text in added["log"]), added["log"]
    assert s.report("log")["messages"] == [] and s.report("log")["log"] == added["log"] and s.report("cleared")["log"] == []
    folder = pathlib.Path(__file__).resolve().parents[3] / "shared/data/vdb/mantaflow_fire"
    volumes = sorted(folder.glob("*.vdb"))
    if not volumes:
        print("without ../shared/data: the up axis is not tested")
        return
    up = lambda name: s.report(name)["scene"]["volume"].get("up", "y")
    button = lambda name: [m["button"] for m in s.report(name)["messages"] if m["button"]]
    # A dropped volume stands on Z, and a button takes that back.
    s.play("dropped", ["frames 3", f'drop "{volumes[-1]}"', *there, *shot("stands"), 'click "Message/Y up"', *there, *shot("lies"), "key ctrl+z", *there,
                       *shot("undone")], "--spp", "1", size=["--size", "900x600"])
    assert [up(name) for name in ("stands", "lies", "undone")] == ["z", "y", "z"]
    assert button("stands") == ["Y up"] and button("lies") == []
    # The flags are the user's own words: Z is offered.
    s.play("flag", [*there, *shot("offer"), 'click "Message/Z up"', *there, *shot("taken")], "--volume", str(volumes[-1]), "--spp", "1",
           size=["--size", "900x600"])
    assert [up(name) for name in ("offer", "taken")] == ["y", "z"] and button("offer") == ["Z up"]


def test_sliders(s):
    """A double click types a number, also beyond the slider; a limit is named."""
    twice = lambda label: [f'click "{label}"', f'click "{label}"', "frames 2"]
    entered = lambda text: ["key ctrl+a", "frames 1", f'text "{text}"', "frames 2", "key enter", "frames 3"]
    wait = ["frames 3", "idle 0.5"]  # a later click is no double click
    s.play("replay", ["wait loaded", *shown("Render"), *shot("before"), *twice("Exposure"), *entered("1.25"), *wait, *shot("typed"),
                      "key ctrl+z", "frames 3", *shot("undone"), *twice("Exposure"), *entered("900"), *wait, *shot("limit")],
           "--volume", s.cumulus, "--spp", "1", size=["--size", "900x600"])
    exposure = lambda name: s.report(name)["scene"].get("display", {}).get("exposure_stops", 0)
    assert exposure("typed") == 1.25 and exposure("undone") == exposure("before") == 0
    assert s.report("typed")["undo_steps"] == 1, "the clicks are no steps"
    said = [m["text"] for m in s.report("limit")["messages"]]
    assert "Exposure: 900 is not from -64 to 64; set to 64" in said and exposure("limit") == 64, said
