"""Cache of the functions that numba compiles, by content.

Numba's own caches compile a function again when its module changes, but not when the module of a function
that it calls changes. Here a function is stored under the content of its module and of all modules that this
imports. So mutants share the machine code that they do not change.
"""

from __future__ import annotations

import ast
import hashlib
import os
from functools import cache
from pathlib import Path

from numba.core.caching import UserProvidedCacheLocator


class ByContent(UserProvidedCacheLocator):
    """Locator of a function's machine code below `NUMBA_CACHE_DIR` (for `NUMBA_CACHE_LOCATOR_CLASSES`)."""

    def get_cache_path(self) -> str:
        """Folder of the module's functions."""
        return str(Path(os.environ["NUMBA_CACHE_DIR"]) / digest(Path(self._py_file)))


@cache
def digest(module: Path) -> str:
    """Hash of a module and of the workbench's modules that it imports, directly or not."""
    root = next(folder.parent for folder in module.parents if folder.name == "workbench")
    texts = {path.relative_to(root): path.read_bytes() for path in _imported(root, module)}
    return hashlib.sha256(repr(sorted(texts.items())).encode()).hexdigest()


def _imported(root: Path, module: Path) -> set[Path]:
    found: set[Path] = set()
    left = {module}
    while left:
        found |= left
        left = {path for file in left for path in _imports(root, file)} - found
    return found


def _imports(root: Path, module: Path) -> set[Path]:
    """Files of the modules that a module imports by name (`from package.module import name`)."""
    froms = (node for node in ast.walk(ast.parse(module.read_bytes())) if isinstance(node, ast.ImportFrom))
    names = (f"{node.module}.{alias.name}" for node in froms for alias in node.names)
    parts = [tuple(name.split(".")) for name in names if name.startswith("workbench.")]
    files = {root.joinpath(*part[:end]).with_suffix(".py") for part in parts for end in (-1, None)}
    return {file for file in files if file.is_file()}
