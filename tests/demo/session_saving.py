"""Tests of session.py: unsaved changes and the recovery file."""

import json
import os
import signal
import subprocess
import time

from demo_session import SIZE, shot, shown

def save_as(s):
    """Types a name into the open dialog."""
    return ["frames 2", "key ctrl+a", f'text "{s.out}/scene.json"', "key enter", "frames 3"]



def scene(name, cumulus):
    """Writes a small scene file."""
    name.write_text(json.dumps({"cumulet_scene": 2, "volumes": [{"file": cumulus, "medium": {"density_scale": 2}}],
                                "camera": {"eye": [20, 30, 170], "target": [20, 20, 0]}}))


def test_unsaved(s):
    """The title marks unsaved changes. Closing the window, quitting and opening another scene ask about them."""
    scene(s.out / "other.json", s.cumulus)
    there = ["frames 3", "wait loaded", "frames 2"]
    s.play("unsaved",
           ["frames 3", *shot("empty"), f'drop "{s.cumulus}"', *there, "drag viewport 0.4 0.5 to viewport 0.6 0.4", "frames 40", *shot("viewed"),
            "key ]", "frames 3", *shot("brighter"), "key ctrl+z", "frames 3", *shot("undone"), "key ]", "frames 3",
            "close", "frames 2", *shot("asked"), 'click "Question/Cancel"', "frames 3", *shot("stayed"),
            # A dialog that is closed without saving keeps the window open.
            "close", "frames 2", "key enter", "frames 3", *shot("dialog"), "key escape", "frames 3", *shot("not_saved"),
            "key ctrl+s", *save_as(s), *shot("saved"),
            "key ]", "frames 3", f'drop "{s.out}/other.json"', "frames 2", *shot("opening"), "key escape", "frames 3", *shot("kept"),
            f'drop "{s.out}/other.json"', "frames 2", 'click "Question/Discard"', *there, *shot("opened"),
            "key ]", "frames 3", "key ctrl+n", "frames 2", 'click "Question/Discard"', *there, *shot("new"),
            'click "Add light"', "frames 3", *shot("untitled"), f'drop "{s.out}/other.json"', "frames 2", 'click "Question/Discard"', *there,
            "key ]", "frames 3", "key ctrl+q", "frames 2", 'click "Question/Save"', "frames 30", 'screenshot "never.png"'])
    report = s.report
    title = lambda name: s.report(name)["title"]
    assert [title(name) for name in ("empty", "viewed", "brighter")] == ["Cumulet", "cumulus.vdb - Cumulet", "*cumulus.vdb - Cumulet"]
    assert report("viewed")["undo_steps"] > 0 and not report("viewed")["modified"], "a turned view is no change"
    assert report("brighter")["modified"] and not report("undone")["modified"], "an undone change is none"
    assert report("asked")["question"] == "Unsaved changes" and report("stayed")["question"] is None
    assert report("dialog")["dialog"] and report("not_saved")["modified"] and not report("not_saved")["dialog"]
    assert title("saved") == "scene.json - Cumulet" and (s.out / "scene.json").exists()
    assert report("opening")["question"] and title("opening") == title("kept") == "*scene.json - Cumulet"
    assert title("opened") == "other.json - Cumulet" and not report("opened")["modified"]
    assert title("new") == "Cumulet" and not report("new")["has_content"]
    assert [volume["file"] for volume in report("new")["volumes"]] == [""], "its own volume is empty"
    assert title("untitled") == "*Untitled - Cumulet"
    assert not (s.out / "never.png").exists(), "a saved scene is closed"
    assert json.loads((s.out / "other.json").read_text())["display"]["exposure_stops"] > 0.3
    assert not list((s.out / "state").glob("cumulet/*.json")), "nothing is left after a normal end"
    recent = json.loads((s.out / "config/cumulet/demo.json").read_text())["recent"]
    assert [os.path.basename(file) for file in recent if file.endswith(".json")] == ["other.json", "scene.json"], recent
    # The user still holds the slider when the window is closed.
    s.play("held", ["frames 3", *shown("Render"), 'move "Exposure" 0.8 0.5', "down", "frames 2", "close", "frames 3", *shot("held"),
                    "up", "frames 2", 'click "Question/Discard"', "frames 30", 'screenshot "never.png"'])
    assert report("held")["question"] == "Unsaved changes"
    assert not (s.out / "never.png").exists(), "the changes are discarded"


def killed(s, name, *arguments):
    """Starts the demo, changes the exposure, and kills the demo as soon as the change is in the recovery file."""
    (s.out / f"{name}.replay").write_text("\n".join(["frames 3", "wait loaded", "frames 3", "key ]", "frames 3", "idle 60"]))
    demo = subprocess.Popen([s.demo, *SIZE, "--spp", "1", *arguments, "--replay", f"{name}.replay"], cwd=s.out, env=s.environment)
    copy = s.out / "state/cumulet/recovery-1.json"
    try:
        began = time.monotonic()
        while not copy.exists():
            assert demo.poll() is None and time.monotonic() - began < 120, "there is no copy"
            time.sleep(0.05)
        # The copy is replaced atomically, so it is whole at any time.
        assert json.loads(copy.read_text())["display"]["exposure_stops"] > 0.3
    finally:
        demo.send_signal(signal.SIGKILL)
        demo.wait()
    return copy


def test_ended(s):
    """A signal, such as that of the desktop's logout, ends the program without a loss: the recent files and the unsaved
    changes are kept, and no unfinished file."""
    (s.out / "ended.replay").write_text("\n".join(["frames 3", "wait loaded", "frames 3", "key ]", "frames 9", 'report "live.json"', "idle 60"]))
    demo = subprocess.Popen([s.demo, *SIZE, "--spp", "1", "--exposure", "0", s.cumulus, "--replay", "ended.replay"], cwd=s.out, env=s.environment)
    try:
        while not (s.out / "live.json").exists():
            assert demo.poll() is None
            time.sleep(0.05)
        config = s.out / "config/cumulet/demo.json"
        assert json.loads(config.read_text())["recent"] == [s.cumulus], "a crash keeps the recent files"
        config.unlink()
        began = time.monotonic()
        demo.send_signal(signal.SIGTERM)
        assert demo.wait(timeout=120) == 0
        assert time.monotonic() - began < 30, "it does not wait for the end of the replay"
    finally:
        demo.kill()
    assert json.loads(config.read_text())["recent"] == [s.cumulus]
    copy = s.out / "state/cumulet/recovery-1.json"
    assert json.loads(copy.read_text())["display"]["exposure_stops"] > 0.3
    s.play("next", ["frames 3", *shot("asked"), 'click "Question/Recover"', "frames 3", "wait loaded", "frames 3", *shot("recovered")])
    assert s.report("asked")["question"] == "Recover unsaved changes"
    assert s.report("recovered")["modified"]


def test_recovery(s):
    """After a crash the next start offers the unsaved changes."""
    config = s.out / "config/cumulet/demo.json"
    config.parent.mkdir(parents=True)
    config.write_text('{"autosave_seconds": 1}')
    scene(s.out / "scene.json", s.cumulus)
    before = (s.out / "scene.json").read_text()
    there = ["frames 3", "wait loaded", "frames 3"]
    copy = killed(s, "first", "--scene", "scene.json")
    changed = copy.read_text()
    s.play("later", ["frames 5", *shot("offer"), 'click "Question/Later"', "frames 3", "key ]", "idle 2", *shot("later")], "--spp", "1")
    assert s.report("offer")["question"] == "Recover unsaved changes" and s.report("later")["question"] is None
    assert copy.read_text() == changed, "it is kept until the user decides"
    s.play("recovered", ["frames 5", 'click "Question/Recover"', *there, *shot("recovered"), "key ctrl+s", *there, *shot("saved")], "--spp", "1")
    recovered, saved = s.report("recovered"), s.report("saved")
    assert recovered["title"] == "*scene.json - Cumulet" and recovered["scene"]["display"]["exposure_stops"] > 0.3, recovered["title"]
    assert recovered["has_volume"] and recovered["volumes"][0]["file"].endswith("cumulus.vdb"), recovered["volumes"]
    assert saved["title"] == "scene.json - Cumulet" and (s.out / "scene.json").read_text() != before
    assert not copy.exists(), "saved changes need no copy"
    # A scene without a file, whose copy is deleted.
    killed(s, "second", s.cumulus, "--exposure", "0")
    s.play("discarded", ["frames 5", *shot("nameless"), 'click "Question/Discard"', "frames 3", *shot("discarded")], "--spp", "1")
    assert s.report("nameless")["question"] and not s.report("discarded")["has_content"] and not copy.exists()
