"""Reads the image tests (ctest --show-only=json-v1) from standard input. Copies the reference images to the folder, and
prints a line per image with three fields: its name, the limits and the flags of cumulet-render. Fields are separated by
tabs, flags by `|`. @SCENE@ is the folder of the sample scene."""
import json
import pathlib
import shutil
import sys

folder = pathlib.Path(sys.argv[1])
tests = json.load(sys.stdin)["tests"]
scene = next(test["command"][1] for test in tests if test["name"] == "image.scene")
for test in tests:
    values = dict(word[2:].split("=", 1) for word in test["command"] if word.startswith("-D") and "=" in word)
    if values.get("GOLDEN", "") and not values.get("DRIVER"):
        # Every image is made by the driver of the machine, not by OSMesa.
        flags = values["FLAGS_A"].replace("|--backend|osmesa", "").replace(scene, "@SCENE@")
        shutil.copy(values["GOLDEN"], folder)
        print(values["NAME"], values["LIMITS"], flags, sep="\t")
