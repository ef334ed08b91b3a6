"""Tests of session.py: light, environments, emission and the display of colors."""

import json
import math
import subprocess

from demo_session import assert_alike, assert_differ, assert_drawn, assert_saved, look, SETTLE, shot, shown, tab
from ocio import CONFIG
from png import Picture, difference


def write_environment(path, bright, stops=0):
    """Writes a Radiance image with 64 columns: blue, and orange where bright(column). stops: makes it brighter."""
    orange, blue = bytes([0xc0, 0x60, 0x20, 0x83 + stops]), bytes([0x20, 0x40, 0x80, 0x80 + stops])
    rows = b"".join(orange if bright(x) else blue for _ in range(32) for x in range(64))
    path.write_bytes(b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 32 +X 64\n" + rows)


def test_environment(s):
    """An environment is dropped, rotated by dragging its thumbnail and rotated back. A corrupt file does not replace
    it, and undo works."""
    write_environment(s.out / "left.hdr", lambda x: x < 16)
    write_environment(s.out / "middle.hdr", lambda x: 24 <= x < 40)
    (s.out / "bad.hdr").write_bytes(b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 32 +X 64\n")
    turn = 'drag "Environment view" 0.25 0.5 to "Environment view"'
    there = ["frames 3", "wait loaded", "frames 2"]
    s.play("replay", [*SETTLE, *shot("day"), *shown("Environment"), 'drop "left.hdr"', *there, *SETTLE, *shot("left"), f"{turn} 0.5 0.5",
                      *SETTLE, *shot("turned"), 'drop "bad.hdr"', *SETTLE, *shot("bad"), 'drop "none.exr"', *there,
                      *shot("none"), 'drop "middle.hdr"', *there, *SETTLE, *shot("middle"), "key ctrl+z", *there,
                      *shot("undone"), 'click "Environment view"', 'click "Environment view"', *there, *shot("back"),
                      "key ctrl+z", *there, f"{turn} 0.99 0.5", "frames 20", f"{turn} 0.99 0.5", *there,
                      *shot("around"), 'click "Remove environment"', *there, *shot("removed"), "key ctrl+z", *there,
                      *shot("again"), 'drag "Strength" 0.5 0.5 to "Strength" 0.7 0.5', *there,
                      *shot("strong")],
           "--volume", s.cumulus, "--spp", "4")
    day, report, area = look(s, "day")
    environment = lambda name: s.report(name)["scene"]["environment"]
    assert report["scene"]["light"]["sky"]["model"] == "physical" and report["undo_steps"] == 0
    left, report, _ = look(s, "left")
    assert environment("left")["file"].endswith("left.hdr") and report["undo_steps"] == 1, report["undo_steps"]
    assert max(report["scene"]["light"]["sun"]["irradiance"]) == 0.0, "no sun of the default daylight beside it"
    assert report["recent"][0].endswith("left.hdr")
    assert_differ(day, left, area)
    turned, report, _ = look(s, "turned")
    assert abs(environment("turned")["rotation_degrees"] + 90.0) < 4.0, environment("turned")
    assert report["undo_steps"] == 2, "a drag is one step"
    assert_differ(left, turned, area)
    # The environment stays in the image, in the scene and in the undo history.
    for name, cause in (("bad", "bad.hdr: truncated Radiance file"),
                        ("none", "none.exr: No such file or directory")):
        bad, report, _ = look(s, name)
        assert any(m["error"] and cause in m["text"] for m in report["messages"]), report["messages"]
        assert environment(name) == environment("turned") and report["undo_steps"] == 2
    assert len(s.report("none")["messages"]) == 2, "each told once"
    assert_alike(s.picture("turned"), s.picture("bad"), (area[0], area[1], area[2], area[3] - 90))
    assert environment("middle")["file"].endswith("middle.hdr")
    assert_differ(turned, s.picture("middle"), (area[0], area[1], area[2], area[3] - 90))
    assert environment("undone") == environment("turned")
    assert environment("back")["rotation_degrees"] == 0.0 and s.report("back")["undo_steps"] == 3
    # Two drags of almost a full turn each: the angle has no limit.
    assert abs(abs(environment("around")["rotation_degrees"]) - 98.0) < 30.0, environment("around")
    removed = s.report("removed")["scene"]
    assert "environment" not in removed or not removed["environment"].get("file"), removed
    assert removed["light"]["sky"]["model"] == "physical", "it is day again"
    again = environment("again")
    assert again["file"].endswith("left.hdr") and again["rotation_degrees"] == environment("around")["rotation_degrees"]
    assert environment("strong")["strength"] > 2.0
    # The panel shows its thumbnail, which is three quarters blue.
    def blue(name):
        picture = s.picture(name)
        n, left = picture.channels, sum(s.report(name)["viewport"][::2])
        pixels = ((row[x * n], row[x * n + 2]) for row in picture.rows for x in range(int(left), picture.width))
        return sum(b > r + 40 for r, b in pixels)

    assert blue("turned") > 15000 > 3 * blue("day"), (blue("turned"), blue("day"))


def test_lamps(s):
    """A light is added, made a spot light, dimmed and removed. Each is a step that can be undone and redone."""
    there = ["frames 3", "wait loaded", "frames 2"]
    # Hides handles and icons, because the images are compared.
    s.play("replay", ["key q", *SETTLE, *shot("day"), 'click "Add light"', "move viewport 0.5 0.5", *SETTLE, *shot("point"), 'click "Light type"', "frames 2",
                      'click "Light type/Spot"', *there, 'report "spot.json"', 'click "Color by"', "frames 2", 'click "Color by/Temperature"', "frames 2",
                      'drag "Color temperature" 0.5 0.5 to "Color temperature" 0.05 0.5', *there, 'report "warm.json"', "key ctrl+z", "key ctrl+z", *there, 'drag "Power" 0.5 0.5 to "Power" 0.3 0.5', "move viewport 0.5 0.5",
                      *SETTLE, *shot("dim"), "key ctrl+z", *there, 'report "bright.json"', "key ctrl+z", "key ctrl+z", *there,
                      'report "undone.json"', "key ctrl+shift+z", *SETTLE, *shot("redone"), "key delete",
                      *SETTLE, *shot("removed"), "key ctrl+z", *there, 'report "again.json"',
                      # Typed values may be beyond the slider.
                      *shown("Light 1"), "press ctrl", 'click "Power"', "release ctrl", "frames 2", "key ctrl+a", 'text "5e9"', "key enter",
                      *there, 'report "typed.json"'],
           "--volume", s.cumulus, "--sky", "0.05,0.05,0.05", "--spp", "4")
    day, report, area = look(s, "day")
    lights = lambda name: s.report(name)["lights"]
    steps = lambda name: s.report(name)["undo_steps"]
    assert lights("day") == [] and steps("day") == 0
    (point,) = lights("point")
    assert point["kind"] == "point" and point["power"] > 0.0 and steps("point") == 1, point
    target = report["scene"]["camera"]["target"]
    to_target = [b - a for a, b in zip(point["position"], target)]
    length = math.hypot(*to_target)
    assert point["position"][1] > target[1], (point, target)
    assert all(abs(a - b / length) < 1e-6 for a, b in zip(point["direction"], to_target)), (point, target)
    shone = look(s, "point")[0]
    assert_differ(day, shone, area)
    (spot,) = lights("spot")
    assert spot == dict(point, kind="spot", angle_degrees=45.0) and steps("spot") == 2, spot
    (warm,) = lights("warm")
    red, green, blue = warm["color"]
    assert red > green > blue and warm == dict(spot, color=warm["color"]) and steps("warm") == 4, warm
    (dim,) = lights("dim")
    assert 0.0 < dim["power"] < 0.1 * spot["power"] and dim == dict(spot, power=dim["power"]), dim
    assert steps("dim") == 3, "a drag is one step"
    assert_differ(shone, look(s, "dim")[0], area)
    assert lights("bright") == [spot] and steps("bright") == 2
    assert lights("undone") == [] and steps("undone") == 0
    assert lights("redone") == [point] and steps("redone") == 1
    assert_alike(shone, look(s, "redone")[0], area)
    assert lights("removed") == [] and steps("removed") == 2
    assert_alike(day, look(s, "removed")[0], area)
    assert lights("again") == [point]
    (typed,) = lights("typed")
    assert typed["power"] == 5e9, typed


def test_sky_and_ground(s):
    """The physical sky's haze, the uniform sky, the ground's color and height, and no ground: set in the panel, undone
    and redone."""
    drag = lambda row, x: f'drag "{row}" 0.5 0.5 to "{row}" {x} 0.5'
    choose = lambda row, entry: [f'click "{row}"', "frames 2", f'click "{row}/{entry}"']
    there = ["frames 3", "wait loaded", "frames 2"]
    tell = lambda name: [*there, f'report "{name}.json"']
    s.play("replay", [*SETTLE, *shot("day"), *shown("Sun & sky"), drag("Haze", 0.95), *SETTLE, *shot("haze"), *choose("Sky", "Constant"), *SETTLE,
                      *shot("constant"), "key ctrl+z", *tell("hazy"), "key ctrl+z",
                      "move viewport 0.5 0.5", *SETTLE, *shot("undone"),
                      "key ctrl+shift+z", "key ctrl+shift+z", *tell("redone"), *choose("Sky", "Physical"), *tell("physical"),
                      *shown("Ground"), *choose("Ground", "At a height"), "move viewport 0.5 0.5", *SETTLE, *shot("at_0"),
                      drag("Ground height", 0.4), *tell("lower"), "key ctrl+z", "move viewport 0.5 0.5", *SETTLE, *shot("raised"), *choose("Ground", "None"), *SETTLE, *shot("none"), "key ctrl+z",
                      *tell("there"), "key ctrl+shift+z", *tell("gone")],
           "--volume", s.cumulus, "--spp", "4")
    day, report, area = look(s, "day")
    sky = lambda name: s.report(name)["scene"]["light"]["sky"]
    sun = lambda name: s.report(name)["scene"]["light"]["sun"]
    ground = lambda name: s.report(name)["scene"]["ground"]
    steps = lambda name: s.report(name)["undo_steps"]
    assert sky("day")["model"] == "physical" and sky("day")["turbidity"] == 2.5 and ground("day")["place"] == "below"
    assert 8.0 < sky("haze")["turbidity"] <= 10.0 and steps("haze") == 1, sky("haze")
    assert_differ(day, look(s, "haze")[0], area)
    assert sky("constant") == dict(sky("haze"), model="constant") and sun("constant") == sun("day"), "nothing else"
    assert steps("constant") == 2
    assert_differ(look(s, "haze")[0], look(s, "constant")[0], area)
    assert sky("hazy") == sky("haze") and sky("undone") == sky("day") and steps("undone") == 0
    assert_alike(day, look(s, "undone")[0], area)
    assert sky("redone") == sky("constant") and steps("redone") == 2
    assert sky("physical") == sky("haze")
    assert ground("at_0") == dict(ground("day"), place="at-height") and ground("at_0")["height"] == 0.0, ground("at_0")
    assert ground("lower")["height"] < -10.0 and steps("lower") == steps("at_0") + 1, ground("lower")
    assert ground("raised") == ground("at_0")
    assert_alike(look(s, "at_0")[0], look(s, "raised")[0], area)
    assert ground("none")["place"] == "none"
    assert_differ(look(s, "at_0")[0], look(s, "none")[0], area)
    assert ground("there") == ground("at_0") and ground("gone") == ground("none")


def test_glow(s):
    s.play("replay", [*SETTLE, *shot("dark"), *shown("Emission", "Material/"), 'drag "Emission" 0.02 0.5 to "Emission" 0.6 0.5', *SETTLE, *shot("glowing"), "key ctrl+z",
                      *SETTLE, *shot("undone")], "--volume", s.explosion, "--flame-grid", "none", "--spp", "16")
    dark, report, area = look(s, "dark")
    glowing, glowing_report, _ = look(s, "glowing")
    assert report["scene"]["medium"]["emission"] == [0, 0, 0]
    red, green, blue = glowing_report["scene"]["medium"]["emission"]
    assert red > green > blue > 0, "a glow begins in the colour of fire"
    assert glowing.mean(area) > dark.mean(area) + 5
    assert_alike(dark, look(s, "undone")[0], area)


def test_preset(s):
    s.play("replay", [*SETTLE, *shot("first"), 'click "Preset"', "frames 2", 'click "Preset/Explosion"', *SETTLE, *shot("explosion"),
                      "key ctrl+z", *SETTLE, *shot("undone")], "--volume", s.explosion, "--density-scale", "9", "--spp", "4")
    first, report, area = look(s, "first")
    exploded, exploded_report, _ = look(s, "explosion")
    medium, before = exploded_report["scene"]["medium"], report["scene"]["medium"]
    assert medium["blackbody"] == 12 and medium["density_scale"] == before["density_scale"] == 9, medium
    assert_differ(first, exploded, area)
    assert look(s, "undone")[1]["scene"]["medium"] == before


def test_fire(s):
    """A burning volume looks like fire by default, whether opened in the window or by the command line, as in
    cumulet-render."""
    plain, dropped = ["--density-scale", "auto"], f'drop "{s.explosion}"'
    s.play("replay", [*SETTLE, *shot("cloud"), dropped, *SETTLE, *shot("dropped"), 'click "Message/Daylight"', *SETTLE,
                      'report "day.json"', "key ctrl+z", *SETTLE, "key ctrl+z", *SETTLE, *shot("undone"),
                      "key ctrl+shift+z", *SETTLE, *shot("redone"), f'drop "{s.cumulus}"', *SETTLE, *shot("cloud_again")],
           *plain, "--volume", s.cumulus)
    s.play("named", ["wait loaded", *SETTLE, *shot("named")], *plain, "--volume", s.explosion)
    s.play("said", [*SETTLE, dropped, *SETTLE, *shot("said")], *plain, "--anisotropy", "0.5", "--volume", s.cumulus)
    cloud, report, area = look(s, "cloud")
    medium = lambda name: s.report(name)["scene"]["medium"]
    assert medium("cloud")["blackbody"] == 0, medium("cloud")
    burning, burning_report, _ = look(s, "dropped")
    assert medium("dropped")["blackbody"] > 0 and medium("dropped")["albedo"][0] < 0.5, medium("dropped")
    assert burning_report["undo_steps"] == report["undo_steps"] + 1, "the look comes with the file, in one step"
    daylight = lambda name: (s.report(name)["scene"]["light"], s.report(name)["scene"]["display"])
    elevation = lambda name: s.report(name)["scene"]["light"]["sun"]["elevation_degrees"]
    assert elevation("dropped") == 3 and elevation("cloud") == 40, daylight("dropped")
    assert daylight("dropped")[1]["tone_map"] == "filmic" and daylight("dropped")[1]["exposure_stops"] == 1, daylight("dropped")
    assert [m["button"] for m in burning_report["messages"] if "dusk" in m["text"]] == ["Daylight"], burning_report["messages"]
    assert daylight("day") == daylight("cloud") and medium("day") == medium("dropped"), "the button changes the light alone"
    assert daylight("undone") == daylight("cloud") and daylight("redone") == daylight("dropped") and daylight("cloud_again") == daylight("cloud")
    warmest = max(b[0] - b[2] for b in burning.blocks(area))
    assert warmest > 60, f"fire, no white smoke: {warmest}"
    undone, undone_report, _ = look(s, "undone")
    assert medium("undone") == medium("cloud") and undone_report["undo_steps"] == report["undo_steps"]
    assert_alike(cloud, undone, area)
    assert medium("redone") == medium("dropped")
    # Above the message of the first.
    assert_alike(burning, look(s, "redone")[0], (area[0], area[1], area[2], area[3] - 100))
    assert medium("cloud_again") == medium("cloud"), "a look that nobody chose goes with its file"
    assert s.report("named")["undo_steps"] == 0 and medium("named") == medium("dropped"), medium("named")
    assert medium("said")["blackbody"] == 0 and medium("said")["anisotropy"] == 0.5, medium("said")
    done = subprocess.run([s.renderer, s.explosion, "--size", "32x32", "--spp", "1", "-o", "rendered.png"], cwd=s.out,
                          stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert done.returncode == 0, done.stderr
    assert f'--flame-strength {medium("named")["flame_strength"]:g}' in done.stderr, (done.stderr, medium("named"))


def test_smoke(s):
    """Smoke is gray by default. A button makes it white, and the choice stays with a saved scene."""
    saves = ["key ctrl+s", "frames 2", "key ctrl+a", f'text "{s.out}/saved.json"', "key enter", "frames 3"]
    smoke = ["--density-scale", "auto", "--temperature-grid", "none", "--flame-grid", "none"]
    s.play("replay", [*SETTLE, *shot("gray"), 'click "Message/White"', *SETTLE, *shot("white"), *saves, *SETTLE, "key ctrl+z", *SETTLE,
                      'report "undone.json"', f'drop "{s.cumulus}"', *SETTLE, 'report "cloud.json"', f'drop "{s.out}/saved.json"', *SETTLE,
                      'report "again.json"'], *smoke, "--volume", s.explosion)
    albedo = lambda name: s.report(name)["scene"]["medium"]["albedo"]
    messages = [m for m in s.report("gray")["messages"] if "smoke" in m["text"]]
    assert [m["button"] for m in messages] == ["White"], messages
    assert albedo("gray") == albedo("undone") == [0.5] * 3, albedo("gray")
    assert albedo("white") == albedo("cloud") == albedo("again") == [1] * 3, albedo("white")
    assert_differ(look(s, "gray")[0], look(s, "white")[0], look(s, "gray")[2])
    s.play("given", ["wait loaded", *SETTLE, 'report "given.json"'], *smoke, "--albedo", "1,1,1", "--volume", s.explosion)
    assert albedo("given") == [1] * 3 and s.report("given")["messages"] == [], s.report("given")["messages"]


def test_ramps(s):
    """A ramp with the grid's own values changes nothing. Points are dragged, added by clicks and removed by right
    clicks."""
    curve = '"Temperature ramp curve"'
    away = "move viewport 0.5 0.03"  # no hint covers the image
    s.play("replay", [*SETTLE, *shot("plain"), *shown("Ramps", "Material/"), 'click "Temperature ramp"', away, *SETTLE, *shot("same"),
                      'move "Temperature point"', f"drag {curve} 0.02 0.95 to {curve} 0.6 0.97", *SETTLE, *shot("dragged"),
                      f"click {curve} 0.8 0.97", *SETTLE, *shot("added"), "key ctrl+z", *SETTLE, *shot("undone"), "key ctrl+shift+z", *SETTLE, 'report "redone.json"',
                      f"click {curve} 0.8 0.97 right", *SETTLE, 'report "removed.json"', 'click "Temperature ramp"', away, *SETTLE,
                      *shot("off")],
           "--volume", s.explosion, "--preset", "explosion", "--density-scale", "9", "--spp", "4", size=["--size", "640x460"])
    plain, report, area = look(s, "plain")
    ramp = lambda name: s.report(name)["scene"]["medium"].get("temperature_ramp")
    assert ramp("plain") is None
    first, last = ramp("same")
    assert first == [0, 0] and last[0] == last[1] > 0.5, "as far as the grid's values go"
    assert_alike(plain, look(s, "same")[0], area)
    (value, result), end = ramp("dragged")
    assert end == last and 0.5 * last[0] < value < 0.7 * last[0] and result < 0.1 * last[0], ramp("dragged")
    dragged, added = look(s, "dragged")[0], look(s, "added")[0]
    assert len(ramp("added")) == 3 and ramp("added")[0] == ramp("dragged")[0], ramp("added")
    x, y, width, height = area
    fire = (x + width // 4, y + height // 3, width // 2, height // 3)
    assert added.mean(fire) < plain.mean(fire) - 2, "what is below the new point is cold"
    assert ramp("undone") == ramp("dragged") and ramp("redone") == ramp("added")
    assert_alike(dragged, look(s, "undone")[0], area)
    assert ramp("removed") == ramp("dragged")
    assert ramp("off") is None
    assert_alike(plain, look(s, "off")[0], area)


def test_ramp_shapes(s):
    """A ramp takes a common shape from a list, and is copied to another grid, each as one step."""
    there = ["frames 2", "wait loaded", "frames 2"]
    s.play("replay", ["wait loaded", "frames 3", *shown("Ramps", "Material/"), 'click "Temperature ramp"', *there, *shot("on"), 'click "Temperature shape"', "frames 2", *shot("list"),
                      'click "Temperature shape/Contrast"', *there, *shot("shaped"), 'click "Copy##temperature"', "frames 2",
                      'click "Flame ramp"', *there, 'click "Paste##flame"', *there, *shot("pasted"), "key ctrl+z", *there,
                      'report "undone.json"'],
           "--volume", s.explosion, "--preset", "explosion", "--spp", "1", size=["--size", "900x700"])
    ramp = lambda name, grid: s.report(name)["scene"]["medium"].get(f"{grid}_ramp")
    shaped = ramp("shaped", "temperature")
    assert len(shaped) == 5 and shaped[0] == [0, 0] and shaped[2][0] == shaped[2][1] < shaped[3][1], shaped
    assert shaped[1][1] < shaped[1][0], "small values are lower"
    assert ramp("pasted", "flame") == shaped
    assert len(ramp("undone", "flame")) == 2 and ramp("undone", "temperature") == shaped


def test_color_ramps(s):
    """Fire takes colors from a list instead of those of black bodies. They are copied to the flame, and a right click
    removes a stop, each as one step. The Delete key removes the selected stop and not the volume."""
    there = ["frames 2", "wait loaded", "wait converged", "frames 2"]
    bar = '"Flame colors bar"'
    s.play("replay", [*there, *shot("plain"), *shown("Ramps", "Material/"), 'click "Temperature colors"', *there, 'click "Palette##Temperature colors"', "frames 2",
                      'click "Palette##Temperature colors/Gas"', *there, 'click "Copy##Temperature colors"', "frames 2",
                      'click "Flame colors"', *there, 'report "first.json"', 'click "Paste##Flame colors"', *there, *shot("pasted"),
                      f"click {bar} 0.5 0.5 right", *there, 'report "removed.json"', f"click {bar} 0.3 0.3", "key delete", *there,
                      'report "deleted.json"', "key ctrl+z", *there, 'report "undone.json"'],
           "--volume", s.explosion, "--preset", "explosion", "--density-scale", "9", "--spp", "4", size=["--size", "900x700"])
    ramp = lambda name, grid: s.report(name)["scene"]["medium"].get(f"{grid}_color_ramp")
    gas = ramp("pasted", "temperature")
    assert len(gas) == 5 and gas[0] == [0, 0, 0, 0] and gas[2][3] > gas[2][1], gas
    first = ramp("first", "flame")
    assert len(first) == 2 and first[0][1:] == first[1][1:] and first[0][1] > first[0][3], "the color of the preset"
    assert ramp("pasted", "flame") == gas
    assert ramp("removed", "flame") == gas[:2] + gas[3:]
    assert ramp("deleted", "flame") == ramp("removed", "flame"), "the added stop, and not the volume"
    hue = lambda picture, area: [sum(block[i] for block in picture.blocks(area)) for i in (0, 2)]
    plain, report, area = look(s, "plain")
    red, blue = hue(plain, area)
    assert red > blue, "fire"
    red, blue = hue(look(s, "pasted")[0], area)
    assert blue > red, "gas"


def test_auto_exposure(s):
    """A dark environment is exposed once after its load, as an undo step and without a change to save. An exposure that
    the user has set stays; the button replaces it. A flag, a scene file and the menu disable the automatic one."""
    write_environment(s.out / "dark.hdr", lambda x: x < 16, stops=-5)
    write_environment(s.out / "bright.hdr", lambda x: x < 16, stops=6)
    there = ["frames 3", "wait loaded", "wait converged", "frames 12"]
    s.play("alone", ["wait loaded", "frames 3", 'drop "dark.hdr"', *there, *shot("alone")], "--spp", "2", auto_exposure=True)
    s.play("replay", [*there, *shot("day"), 'drop "dark.hdr"', *there, *shot("dark"), "key ctrl+z", *there, *shot("undone"),
                      "key ]", *there, 'drop "bright.hdr"', *there, *shot("kept"), 'click "Tool/Auto exposure"', "idle 4",
                      *shot("asked"), *tab("Render"), 'click "Render/Auto exposure after loading"', "frames 3",
                      'drop "dark.hdr"', *there, *shot("off")],
           "--volume", s.cumulus, "--spp", "2", auto_exposure=True)
    stops = lambda name: s.report(name)["scene"].get("display", {}).get("exposure_stops", 0)
    texts = lambda name: s.report(name)["log"]
    assert stops("alone") > 1.5 and not s.report("alone")["modified"], "a file that is only viewed needs no saving"
    assert stops("day") == 0 and not texts("day"), "the default day suits the default exposure"
    assert stops("dark") > 1.5, stops("dark")
    assert f"Auto exposure: {stops('dark'):+.1f} stops" in texts("dark"), texts("dark")
    assert stops("undone") == 0
    assert abs(stops("kept") - 1 / 3) < 1e-5, "the user has set it"
    assert stops("asked") < -1, stops("asked")
    assert stops("off") == stops("asked"), "the menu has disabled it"
    dark, report, area = look(s, "dark")
    assert dark.mean(area) > look(s, "undone")[0].mean(area) + 30, "the image is brighter"
    s.play("given", [*there, 'drop "dark.hdr"', *there, *shot("given")], "--volume", s.cumulus, "--spp", "2")
    assert stops("given") == 0, "--exposure 0 is given"
    s.play("scene", [*there, 'drop "dark.hdr"', *there, *shot("scene")], "--scene", f"{s.scene}/sample.json", "--spp", "1",
           auto_exposure=True)
    assert stops("scene") == 0.5, "that of the scene file"


def test_first_view(s):
    """Scenes without a camera are seen from the left, and fit the image, also in cumulet-render."""
    there = ["frames 3", "wait loaded", "wait converged", "frames 2"]
    s.play("volume", [*there, *shot("volume")], "--volume", s.cumulus, "--spp", "8", size=["--size", "900x600"])
    s.play("model", [*there, *shot("model")], "--gltf", f"{s.scene}/mountains.glb", "--spp", "2", size=["--size", "900x600"])
    for name in ("volume", "model"):
        camera = s.report(name)["scene"]["camera"]
        x, y, z = (a - b for a, b in zip(camera["eye"], camera["target"]))
        assert abs(math.degrees(math.atan2(x, z)) + 40) < 0.1, camera
        assert 5 < math.degrees(math.atan2(y, math.hypot(x, z))) < 15, f"the horizon is in the picture: {camera}"
    picture, report, area = look(s, "volume")
    x, y, width, height = report["viewport"]
    file = s.out / "volume-render.png"
    subprocess.run([s.renderer, s.cumulus, "--density-scale", "1", "--max-bounces", "8", "--denoise", "off", "--spp", "8",
                    "--size", f"{int(width)}x{int(height)}", "-o", file], check=True, timeout=600)
    assert_saved(picture, Picture(file), area)


def test_ocio(s):
    """A view of OpenColorIO replaces the tone map, is an undo step and part of the scene. A configuration that cannot
    be read is one message."""
    (s.out / "config.ocio").write_text(CONFIG)
    (s.out / "wrong.ocio").write_text("ocio_profile_version: 2\ndisplays: [")
    s.environment["OCIO"] = str(s.out / "config.ocio")
    opened = lambda file: ['click "Open configuration"', "frames 3", f'text "{s.out}/{file}"', "key enter", *SETTLE, "frames 3"]
    chosen = lambda label: [f'click "{label.split("/")[0]}"', "frames 2", f'click "{label}"', *SETTLE, "frames 3"]
    s.play("replay", ["wait loaded", "wait converged", *shown("Render"), *chosen("Tone map/Clip"), *shot("clip"), *opened("config.ocio"), *shot("plain"),
                      *chosen("Display view/Exchanged"), *shot("exchanged"), "key ctrl+z", *SETTLE, *shot("undone"), "key ctrl+shift+z", *SETTLE,
                      *opened("wrong.ocio"), *shot("wrong"), 'click "Remove configuration"', *SETTLE, *shot("removed"),
                      'click "Use $OCIO"', *SETTLE, "frames 3", *shot("variable")],
           "--volume", s.cumulus)
    view = lambda name: s.report(name)["ocio"]
    assert view("clip") is None and view("plain") == {"config": "config.ocio"}, view("plain")
    assert view("exchanged")["view"] == "Exchanged" and view("undone") == view("plain") == view("variable"), view("undone")
    assert view("wrong") == view("exchanged"), "the configuration in use stays"
    errors = [m["text"] for m in s.report("wrong")["messages"] if m["error"]]
    assert len(errors) == 1 and "wrong.ocio" in errors[0], errors
    assert view("removed") is None
    clip, report, area = look(s, "clip")
    area = (area[0], area[1], area[2], 100)  # above the messages
    assert difference(clip, look(s, "plain")[0], area)[1] <= 1, "the view only encodes"
    assert_alike(look(s, "plain")[0], look(s, "undone")[0], area)
    red, blue = (sum(b[i] for b in look(s, "exchanged")[0].blocks(area)) for i in (0, 2))
    plain_red, plain_blue = (sum(b[i] for b in clip.blocks(area)) for i in (0, 2))
    assert abs(red - plain_blue) < 0.02 * plain_blue and abs(blue - plain_red) < 0.02 * plain_red and plain_blue > plain_red, (red, blue)
    assert s.report("exchanged")["samples"] == report["samples"], "a view restarts nothing"
    (s.out / "scene.json").write_text(json.dumps({"cumulet_scene": 3, "volumes": [{"file": s.cumulus}],
                                                  "display": {"ocio": {"config": "config.ocio", "view": "Exchanged"}}}))
    s.play("saved", ["wait loaded", "frames 3", *shot("saved")], "--scene", str(s.out / "scene.json"))
    assert view("saved") == view("exchanged"), "scene files have the view"


def test_exposure(s):
    s.play("replay", ["wait loaded", "wait converged", *shot("first"), *shown("Render"), 'drag "Exposure" to "Exposure" 0.6 0.5', "frames 3",
                      *shot("bright"), "key ctrl+z", "frames 3", *shot("undone")], "--volume", s.cumulus)
    first, report, area = look(s, "first")
    bright, bright_report, _ = look(s, "bright")
    assert bright_report["samples"] == report["samples"] and bright_report["converged"], "exposure restarts nothing"
    assert bright.mean(area) > first.mean(area) + 10
    undone = look(s, "undone")[0]
    assert difference(first, undone, area) == (0, 0), "the same samples make the same picture"


def test_looks(s):
    """Takes screenshots for inspection, at 1x and 2x. Checks only that the panels are drawn."""
    for name, scale, size in (("1x", "1", "1440x900"), ("2x", "2", "1680x1040"), ("small", "1", "640x400")):
        parts = [*shot(f"{name}_top"), *shown("Render"), *tab("Advanced"), 'move "Grid type"', "frames 60", *shot(f"{name}_grid"), 'move "Renderer"',
                 "frames 3", *shot(f"{name}_statistics"), 'drop "/nowhere/cloud.vdb"', "frames 3", "key f1", "frames 3",
                 *shot(f"{name}_help"), "key f1", "key ctrl+o", "frames 3", *shot(f"{name}_open")]
        s.play(name, ["frames 3", *shot(f"{name}_empty"), f'drop "{s.cumulus}"', "wait loaded", "frames 30", *parts],
               "--ui-scale", scale, size=["--size", size])
        for part in ("top", "grid", "statistics", "help", "open"):
            picture, report, _ = look(s, f"{name}_{part}")
            x, _, width, height = report["viewport"]
            assert_drawn(picture, (x + width, 0, picture.width - x - width, height))
