"""A pytest fixture for screenshot tests: it renders a scene and compares it with a stored picture.

    pytest --update-screenshots     stores the pictures as references
    pytest                          compares
"""

import pathlib

import cumulet
import numpy
import pytest

WEIGHTS = (0.2126, 0.7152, 0.0722)  # of luminance
BLOCK = 4  # pixels: means of blocks have less noise, so smaller differences are found
MARGIN = 1.5  # the noise of a picture is itself an estimate


def pytest_addoption(parser):
    parser.addoption("--update-screenshots", action="store_true", help="store the pictures as references")
    parser.addoption("--references", default=None, help="folder of the references (default: beside the tests)")


def blocks(linear):
    """Mean luminances of blocks."""
    rows, columns = (extent // BLOCK for extent in linear.shape[:2])
    luminance = linear[:rows * BLOCK, :columns * BLOCK, :3] @ WEIGHTS
    return luminance.reshape(rows, BLOCK, columns, BLOCK).mean(axis=(1, 3))


def difference(picture, reference):
    """The root mean square of the difference of blocks, relative to the mean luminance."""
    ours, theirs = blocks(picture), blocks(reference)
    return numpy.sqrt(numpy.mean((ours - theirs) ** 2)) / numpy.mean(theirs)


@pytest.fixture
def screenshot(request):
    """A function that renders with the arguments of cumulet.render and compares the picture by its noise."""
    folder = pathlib.Path(request.config.getoption("--references") or pathlib.Path(request.fspath).parent)

    def check(name, source, **arguments):
        picture = cumulet.render(source, progress=False, **arguments)
        file = folder / f"{name}.npz"
        if request.config.getoption("--update-screenshots"):
            numpy.savez_compressed(file, linear=picture.numpy(), noise=picture.noise)
            return
        stored = numpy.load(file)
        # Two pictures with independent noise differ by the root of the sum of the squares.
        allowed = MARGIN * numpy.hypot(picture.noise, stored["noise"]) / BLOCK
        found = difference(picture.numpy(), stored["linear"])
        if found > allowed:
            picture.save(folder / f"{name}.failed.png")
        assert found <= allowed, f"{name}: the difference is {found:.3f}, the noise allows {allowed:.3f}"

    return check
