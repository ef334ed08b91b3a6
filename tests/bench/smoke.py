"""Runs cumulet-bench on a tiny volume and checks that its output files exist and parse. Usage: smoke.py PROGRAM FOLDER
SCENE_PROGRAM"""

import csv
import pathlib
import shutil
import subprocess
import sys
import xml.etree.ElementTree


def main():
    program, folder = sys.argv[1], pathlib.Path(sys.argv[2])
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    readme = folder / "readme.md"
    readme.write_text("before\n<!-- bench:begin -->\nold\n<!-- bench:end -->\nafter\n")
    command = [program, "--quick", "--input", "ball=@noise:24", "--input", "gone/=@noise:16", "--size", "16"]
    command += ["--seconds", "0.05", "--sweep-cells", "20000", "--build-cells", "20000", "--max-cells", "100000", "--error-samples", "4"]
    command += ["--target", "0.1", "0.05", "--triangles", "2000", "--out", str(folder / "out"), "--update-readme", str(readme)]
    subprocess.run(command, check=True)

    rows = list(csv.DictReader((folder / "out/results.csv").open()))
    quantities = {(row["march"], row["quantity"]) for row in rows if row["asset"] == "ball"}
    for march in ("tet-constant", "tet-linear", "dense", "brick"):
        for quantity in ("bytes", "steps_per_path", "samples_per_second", "camera_rays_per_second"):
            assert (march, quantity) in quantities, (march, quantity)
    for march in ("tet-constant", "tet-linear"):
        for criterion in ("deviation", "range-mean"):
            assert (f"{march}/{criterion}", "sweep_depth_error") in quantities, (march, criterion)
    for light in ("full", "shadows", "none"):
        found = {row["quantity"]: float(row["value"]) for row in rows if row["march"] == f"tet-linear/surfaces-{light}"}
        assert found["samples_per_second"] > 0 and 0 < found["samples_per_second_to_alone"] < 100, found
    for mesh in ("terrain", "sphere", "soup"):
        found = {row["quantity"]: float(row["value"]) for row in rows if (row["asset"], row["march"]) == (mesh, "bvh")}
        assert 500 < found["triangles"] < 8000, found
        assert found["build_seconds_a_million"] > 0 and found["refit_seconds_a_million"] > 0, found
        # If Embree is installed, the ratios to it are measured and in the report.
        assert ("build_to_embree" in found) == ("refit_to_embree" in found), found
    for row in rows:
        value = float(row["value"])
        assert value == value and float(row["min"]) <= value * (1 + 1e-6) + 1e-12, row
    assert any(row["quantity"] == "samples_per_second" and float(row["value"]) > 0 for row in rows)

    report = (folder / "out/report.md").read_text()
    for heading in ("# Benchmark", "## Paths", "## The same grids", "## Cells", "## What surfaces", "## The triangle",
                    "## Build"):
        assert heading in report, heading
    assert "nan" not in report and "inf" not in report.replace("info", ""), report
    plots = sorted((folder / "out").glob("*.svg"))
    assert len(plots) == 4, plots
    for plot in plots:
        xml.etree.ElementTree.parse(plot)

    text = readme.read_text()
    assert text.startswith("before\n<!-- bench:begin -->\nPath tracing") and text.endswith("<!-- bench:end -->\nafter\n")
    assert "old" not in text.split() and "| ball | tet-linear |" in text
    assert "With surfaces, light `full`" in text and "| terrain | 0.0" in text

    fire = folder / "sample/explosion_0012.vdb"
    subprocess.run([sys.argv[3], str(fire.parent), "--only", "explosion", "--frame", "12", "--voxels", "20000"], check=True)
    command = [program, "--input", f"fire={fire}", "--size", "16", "--repeats", "4", "--samples", "16", "--target", "0.5"]
    for flags, first, rows in (["--costs"], "| density |", 4 + 12 + 2 + 2 + 2 * 5), (["--equal-error"], "| dense |", 3), (["--peers"], "| dense |", 7), \
            (["--peers", "--interpolation", "nearest", "linear"], "| dense, interpolated |", 13):
        table = subprocess.run([*command, *flags], check=True, capture_output=True, text=True).stdout
        lines = [line.split("|") for line in table.splitlines() if line.startswith("| ") and "Cells" not in line]
        assert first in table and len(lines) == rows and len({len(line) for line in lines}) == 1, table
        assert "nan" not in table and "inf" not in table, table

    weightless = folder / "weightless"
    weightless.mkdir()
    command = [program, "--denoise", "--settle", "--scene", "fog", "fire", "full", "lamp", "--size", "16", "--oidn-weights", str(weightless)]
    command += ["--usual-dir", str(folder / "usual"), "--sample-dir", str(folder / "nothing"), "--input", f"fire={fire}"]
    command += ["--reference-samples", "8", "--raw-samples", "64", "--frames", "3", "--flicker-samples", "1", "--flicker-reference-samples", "4"]
    command += ["--seconds", "0.1", "--repeats", "1", "--out", str(folder / "judged")]
    done = subprocess.run(command, check=True, capture_output=True, text=True)
    tables = [[line.split("|") for line in table.splitlines() if line.startswith("|")] for table in done.stdout.split("\n\n")]
    stills, passes, settled = [table for table in tables if table]
    # three scenes have a sun that cannot be rotated
    for table, rows in (stills, 3 * 3), (passes, 3), (settled, 3 * 2):
        assert len(table) == 2 + rows and len({len(line) for line in table}) == 1, done.stdout
    assert "nan" not in done.stdout and "inf" not in done.stdout, done.stdout
    assert "Skipped: full, there is no " in done.stdout and "no network: " in done.stderr, done
    for row in stills[2:]:
        if row[2].strip() == "high":
            assert row[3].strip() == "no network", row
        else:
            assert 0.0 < float(row[9]) < 1.0 and float(row[-2]) > 0.0, row  # FLIP of one sample; flicker
    names = {plot.name for plot in (folder / "judged").glob("*.svg")}
    assert "denoise.svg" in names and "denoise-fog-flip.svg" in names and "settle-lamp.svg" in names, names
    for name in names:
        xml.etree.ElementTree.parse(folder / "judged" / name)
    assert (folder / "judged/denoise-fire.png").read_bytes().startswith(b"\x89PNG")

    for wrong in (["--denoise", "--scene", "moon"], ["--input", "x"], ["--input", "x=@noise:1"], ["--size", "0"], ["--triangles", "0"], ["--interpolation", "cubic"],
                  ["--interpolation", "nearest", "linear"], ["--nonsense"]):
        assert subprocess.run([program, *wrong], capture_output=True, check=False).returncode == 2, wrong
    missing = subprocess.run([program, "--input", "x=missing.vdb", "--out", str(folder / "no")], capture_output=True,
                             text=True, check=False)
    assert missing.returncode == 1 and "missing.vdb" in missing.stderr, missing.stderr


main()
