"""The files of a checkout, for checks that read sources and documents."""

import os
import pathlib
import subprocess


def listed_by_git(root):
    """Paths that git tracks or would track, or nothing if git cannot list them."""
    if not (root / ".git").exists():
        return []
    command = ["git", "-C", str(root), "-c", f"safe.directory={root}", "ls-files", "-z", "--cached", "--others",
               "--exclude-standard"]
    try:
        listing = subprocess.run(command, check=True, capture_output=True).stdout
    except (OSError, subprocess.CalledProcessError):
        return []
    return [os.fsdecode(name) for name in listing.split(b"\0") if name]


def walked(root):
    """All paths below a folder, without hidden folders and build folders."""
    for folder, folders, names in os.walk(root):
        here = pathlib.Path(folder)
        folders[:] = [f for f in folders if not f.startswith(".") and not (here == root and f in ("build", "shared"))]
        for name in names:
            yield (here / name).relative_to(root).as_posix()


def files(root):
    """Sorted paths of a checkout's files, relative to `root`: from git if it is a git checkout, else by walking."""
    root = pathlib.Path(root).resolve()
    names = listed_by_git(root) or walked(root)
    return sorted(name for name in set(names) if (root / name).is_file())
