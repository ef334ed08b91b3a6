"""A checkout in a temporary folder, for tests of the checks that read sources and documents."""

import pathlib
import tempfile
import unittest


class Checkout(unittest.TestCase):
    """Has an empty folder for each test; root is the path of the checkout in it."""

    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.folder = pathlib.Path(temporary.name)
        self.root = self.folder / "checkout"

    def write(self, files):
        """Writes {path: text} into the checkout."""
        for name, text in files.items():
            file = self.root / name
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(text)
