"""What `import papilla` loads, and what a name of it loads."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import papilla


def loaded(program: str) -> set[str]:
    """The modules that a program has loaded at its end, in a process of its own."""
    command = f"import sys\n{program}\nprint(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", command], capture_output=True, text=True, check=True)
    return set(done.stdout.split())


def test_every_public_name_is_there_and_known_to_type_checkers():
    tree = ast.parse(Path(papilla.__file__).read_text())
    typed = {a.name for node in ast.walk(tree) if isinstance(node, ast.ImportFrom) and node.level for a in node.names}
    assert typed == set(papilla.__all__)
    for name in papilla.__all__:
        assert getattr(papilla, name) is not None
    assert set(papilla.__all__) <= set(dir(papilla))
    assert papilla.wire.SIDE_PX == papilla.SIDE_PX
    with pytest.raises(AttributeError, match="no attribute 'sessions'"):
        _ = papilla.sessions


@pytest.mark.parametrize(
    ("program", "without"),
    [
        ("import papilla", {"numpy", "websockets", "asyncio", "urllib.request"}),
        ("import papilla; papilla.sed", {"websockets", "asyncio", "papilla.sync", "papilla.series"}),
        ("import papilla; papilla.Session", {"papilla.send_series", "papilla.save", "papilla.frames", "xarray"}),
        ("import papilla; papilla.render", {"papilla.meshes", "papilla.sensors", "xarray", "pynwb", "trimesh"}),
    ],
)
def test_a_program_loads_what_it_names(program, without):
    assert loaded(program) & without == set()
