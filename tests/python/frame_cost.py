"""Measures how much longer a frame takes by Viewer.render than by the C function, in pairs: frame_cost.py [PAIRS]

It is the time of the calling thread on a processor, which other programs on the machine hardly change.
"""

import ctypes
import statistics
import sys
import time

import viewer_test
from cumulet import api

FRAMES = 100  # per pair


def seconds(work):
    start = time.thread_time()
    for _ in range(FRAMES):
        work()
    return time.thread_time() - start


def microseconds(pairs):
    """The median of the differences per frame."""
    viewer = viewer_test.viewer_of_box()
    viewer.render_picture((16, 12), progress=False)
    frame = api.cumulet_frame_desc(width=16, height=12, budget_ms=-1, target=api.FrameTarget.NONE)
    result = api.cumulet_frame_result()
    arguments = viewer._pointer, ctypes.byref(frame), ctypes.byref(result)
    more = []
    for _ in range(pairs):
        in_c = seconds(lambda: api.cumulet_render(*arguments))
        in_python = seconds(lambda: viewer.render(width=16, height=12, budget_ms=-1, target="none", scale=1.0))
        more.append((in_python - in_c) / FRAMES * 1e6)
    viewer.close()
    return statistics.median(more)


def main():
    pairs = int(sys.argv[1]) if len(sys.argv) > 1 else 40
    print(f"{microseconds(pairs):.1f} us more per frame (median of {pairs} pairs)")


if __name__ == "__main__":
    main()
