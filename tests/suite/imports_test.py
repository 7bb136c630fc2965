"""Which imports count, and as which module's: python3 tests/suite/imports_test.py."""

import tempfile
import unittest
from pathlib import Path
from unittest import mock

import imports

FILES = {
    "__init__.py": "from .top import work\nVERSION = 1\n",
    "top.py": "import os\nfrom . import low as lower\nfrom . import VERSION\n",
    "low.py": "def late():\n    from pack.parts.deep import x\n",
    "typed.py": "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    from .low import late\n",
    "parts/__init__.py": "",
    "parts/deep.py": "from .. import typed\nfrom ..low import late\nimport numpy\n",
}


class Imports(unittest.TestCase):
    def test_an_import_counts_wherever_it_stands(self) -> None:
        with tempfile.TemporaryDirectory() as root:
            folder = Path(root) / "pack"
            (folder / "parts").mkdir(parents=True)
            for name, text in FILES.items():
                (folder / name).write_text(text)
            with mock.patch.object(imports, "ROOT", Path(root)):
                graph = imports.arrows(folder, "pack")
                bare = imports.arrows(folder / "parts", "")
        found = {module: sorted(to) for module, to in graph.items()}
        wanted = {
            "pack": ["pack.top"],
            "pack.top": ["pack", "pack.low"],
            "pack.low": ["pack.parts.deep"],
            "pack.typed": ["pack.low"],
            "pack.parts": [],
            "pack.parts.deep": ["pack.low", "pack.typed"],
        }
        self.assertEqual(found, wanted)
        self.assertEqual(graph["pack.low"]["pack.parts.deep"], "pack/low.py:2 names pack.parts.deep")
        self.assertEqual(sorted(bare), ["", "deep"])


if __name__ == "__main__":
    done = unittest.main(exit=False, verbosity=0).result
    print(f"checks: {done.testsRun - len(done.failures) - len(done.errors)}")
    raise SystemExit(not done.wasSuccessful())
