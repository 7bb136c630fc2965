"""Which module of a Python package imports which: at the top of a file, in a function or for types alone."""

import ast
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
# A folder is a package, or holds modules that import each other by their bare names.
PACKAGES = ["clients/python/papilla", "model-export/trainer/papilla_trainer"]
FOLDERS = ["tests/suite"]

Graph = dict[str, dict[str, str]]


def modules(folder: Path, package: str) -> dict[str, Path]:
    """Each module by the name that others import it by; a package is its `__init__`.

    A native module stands as its stub (`.pyi`).
    """
    found = {}
    for path in sorted(folder.rglob("*.py*")):
        if path.suffix not in (".py", ".pyi"):
            continue
        parts = [*package.split("."), *path.relative_to(folder).with_suffix("").parts]
        found[".".join(p for p in parts if p and p != "__init__")] = path
    return found


def imported(module: str, path: Path, tree: ast.Module) -> Iterator[tuple[int, str, str]]:
    """Line, module and name of each import; the name is empty where a whole module is meant."""
    package = module.split(".") if path.name == "__init__.py" else module.split(".")[:-1]
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            for alias in node.names:
                yield node.lineno, alias.name, ""
        elif isinstance(node, ast.ImportFrom):
            above = package[: len(package) - node.level + 1] if node.level else []
            base = ".".join([*above, *([node.module] if node.module else [])])
            for alias in node.names:
                yield node.lineno, base, alias.name


def arrows(folder: Path, package: str) -> Graph:
    """The modules that each module imports, each with one place.

    `from . import a` is an import of the module `a` where there is one, else of what the package
    itself defines.
    """
    known = modules(folder, package)
    graph: Graph = {name: {} for name in known}
    for module, path in known.items():
        tree = ast.parse(path.read_text(encoding="utf-8"), str(path))
        for line, base, name in imported(module, path, tree):
            target = f"{base}.{name}" if f"{base}.{name}" in known else base
            if target in known and target != module:
                graph[module].setdefault(target, f"{path.relative_to(ROOT)}:{line} names {target}")
    return graph
