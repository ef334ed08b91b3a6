"""cumulet-render --ocio: a view that only encodes is the tone map `clip`, and a view that exchanges red and blue does so.
Errors are one line. In a build without OpenColorIO the flag is refused by one line.

Usage: ocio.py RENDER CLOUD OUT_FOLDER HAS_OCIO
"""

import pathlib
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).parent))
from png import Picture

ENCODE = "!<ExponentWithLinearTransform> {gamma: [2.4, 2.4, 2.4, 1], offset: [0.055, 0.055, 0.055, 0], direction: inverse}"
EXCHANGE = "!<MatrixTransform> {matrix: [0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 0, 0, 0, 0, 1]}"
CONFIG = f"""ocio_profile_version: 2
roles: {{default: lin_rec709}}
displays:
  Screen:
    - !<View> {{name: Plain, colorspace: plain}}
    - !<View> {{name: Exchanged, colorspace: exchanged}}
colorspaces:
  - !<ColorSpace> {{name: lin_rec709}}
  - !<ColorSpace> {{name: plain, from_scene_reference: {ENCODE}}}
  - !<ColorSpace> {{name: exchanged, from_scene_reference: !<GroupTransform> {{children: [{EXCHANGE}, {ENCODE}]}}}}
"""


def main():
    render, volume, out, has_ocio = sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3]), sys.argv[4] == "1"
    out.mkdir(parents=True, exist_ok=True)
    config = out / "config.ocio"
    config.write_text(CONFIG)

    def run(name, *flags):
        return subprocess.run([render, volume, "--size", "64x40", "--spp", "4", "--denoise", "off", "--exposure", "0", "-o",
                               f"{out}/{name}.png", *flags], timeout=90, capture_output=True, text=True)

    def refused(*flags):
        ran = run("refused", *flags)
        assert ran.returncode == 1 and ran.stderr.count("\n") == 1, ran
        return ran.stderr

    if not has_ocio:
        assert "was built without OpenColorIO" in refused("--ocio", config)
        return
    for name, flags in {"clip": ["--tone-map", "clip"], "plain": ["--ocio", config],
                        "exchanged": ["--ocio", config, "--ocio-display", "Screen", "--ocio-view", "Exchanged"]}.items():
        assert run(name, *flags).returncode == 0, name
    clip, plain, exchanged = (Picture(out / f"{name}.png") for name in ("clip", "plain", "exchanged"))
    worst = 0
    for rows in zip(clip.rows, plain.rows, exchanged.rows):
        for x in range(0, clip.width * clip.channels, clip.channels):
            for channel in range(3):
                worst = max(worst, abs(rows[0][x + channel] - rows[1][x + channel]),
                            abs(rows[0][x + channel] - rows[2][x + 2 - channel]))
    print(f"greatest difference: {worst} of 255")
    assert worst <= 1, worst
    assert "is not one of Plain, Exchanged" in refused("--ocio", config, "--ocio-view", "None")
    assert "no such.ocio" in refused("--ocio", out / "no such.ocio")


if __name__ == "__main__":
    main()
