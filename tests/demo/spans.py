"""Checks a trace file (--trace): JSON of Chrome's trace event format with nested spans."""

import collections
import json

ROUNDING = 0.01  # microseconds
PASSES = ("cumulet: upload", "cumulet: trace", "cumulet: surfaces only", "cumulet: draw")


def read(path):
    """Returns the spans by thread, in the order of their ends."""
    file = json.loads(path.read_text())
    assert list(file) == ["traceEvents"], list(file)
    threads = collections.defaultdict(list)
    for event in file["traceEvents"]:
        # Complete events only, so that every begin has an end.
        assert set(event) == {"name", "ph", "pid", "tid", "ts", "dur"} and event["ph"] == "X", event
        assert event["name"] and event["dur"] >= 0 and event["ts"] > 0, event
        threads[event["tid"]].append((event["ts"], event["ts"] + event["dur"], event["name"]))
    assert len({event["pid"] for event in file["traceEvents"]}) == 1
    return threads


def assert_nested(spans):
    """Spans of a thread are nested: a span ends before the next one begins, or contains it."""
    ends = [end for _, end, _ in spans]
    assert ends == sorted(ends), "not in the order in which they ended"
    open_until = []
    for begin, end, name in sorted(spans, key=lambda span: (span[0], -span[1])):
        while open_until and open_until[-1] <= begin + ROUNDING:
            open_until.pop()
        assert not open_until or end <= open_until[-1] + ROUNDING, f"{name} ends after what it is in"
        open_until.append(end)


def check(path, jobs, frames):
    """Checks that one thread has at least so many frames with their passes, and that other threads have these jobs."""
    threads = read(path)
    for spans in threads.values():
        assert_nested(spans)
    drawing = [thread for thread, spans in threads.items() if any(name == "frame" for _, _, name in spans)]
    assert len(drawing) == 1, drawing
    host = threads[drawing[0]]
    seen = [(begin, end) for begin, end, name in host if name == "frame"]
    assert len(seen) >= frames, len(seen)
    for begin, end in seen:
        inside = [name for b, e, name in host if begin - ROUNDING <= b and e <= end + ROUNDING]
        assert all(inside.count(name) <= 1 for name in PASSES), inside
        assert {"cumulet: upload", "cumulet: draw"} <= set(inside), inside
    passes = [name for _, _, name in host if name in PASSES]
    assert passes.count("cumulet: trace") > 0, passes
    assert passes.count("cumulet: draw") == len(seen), "a pass outside all frames"
    working = [name for thread, spans in threads.items() if thread != drawing[0] for _, _, name in spans]
    for job in jobs:
        assert any(job in name for name in working), (job, working)
