"""A script that exits while its viewer works: ctypes_host.py LIBRARY WORK MILLISECONDS FOLDER"""

import ctypes
import sys
import time

LIBRARY, WORK, MOMENT, FOLDER = sys.argv[1], sys.argv[2], int(sys.argv[3]) / 1000.0, sys.argv[4]


class CreateDesc(ctypes.Structure):
    _fields_ = [("struct_size", ctypes.c_size_t)] + [(f"unused{i}", ctypes.c_void_p) for i in range(10)]


def main():
    library = ctypes.CDLL(LIBRARY)
    desc = CreateDesc(struct_size=ctypes.sizeof(CreateDesc))
    viewer = ctypes.c_void_p()
    if library.cumulet_create(ctypes.byref(desc), ctypes.byref(viewer), None, ctypes.c_size_t(0)) != 0:
        sys.exit("the viewer cannot be created")
    volume = f"{FOLDER}/cloud.vdb".encode()
    model = f"{FOLDER}/wave.gltf".encode()
    end = time.monotonic() + MOMENT
    while True:
        if WORK == "pose":
            library.cumulet_load_surfaces(viewer, model)
        else:
            library.cumulet_load_volume(viewer, volume, None)
        # At the end, work is in progress, and the script does not destroy the viewer.
        if time.monotonic() >= end:
            break
        library.cumulet_wait(viewer, ctypes.c_double(5.0))
    sys.exit(7)


main()
