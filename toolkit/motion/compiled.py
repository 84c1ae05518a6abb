"""Where generated source lives, and how it becomes machine code that the next process finds ready.

The folder is PENDULAB_CACHE if that is set, else the user's cache folder, else (not writable) a temporary one. A file's
name is a hash of its content, and it is put in place by one rename: any number of processes may share the folder.
"""

from __future__ import annotations

import hashlib
import importlib.util
import os
import sys
import tempfile
from collections.abc import Callable
from functools import cache
from pathlib import Path
from types import ModuleType


def _tell_terminal(message: str) -> None:
    if sys.stderr is not None and sys.stderr.isatty():
        print(message, file=sys.stderr)


listener: Callable[[str], None] = _tell_terminal
"""Hears of what takes seconds, before it starts; an interface may put its own in its place."""


@cache
def cache_folder() -> Path:
    """The folder of generated code, made if need be."""
    wanted = os.environ.get("PENDULAB_CACHE")
    if wanted:
        candidates = [Path(wanted)]
    else:
        import platformdirs

        candidates = [Path(platformdirs.user_cache_dir("pendulab", appauthor=False)) / "equations"]
    candidates.append(Path(tempfile.gettempdir()) / f"pendulab-{os.getuid() if hasattr(os, 'getuid') else 'user'}")
    for folder in candidates:
        try:
            folder.mkdir(parents=True, exist_ok=True)
            with tempfile.TemporaryFile(dir=folder):
                return folder
        except OSError:
            continue
    return Path(tempfile.mkdtemp(prefix="pendulab-"))


def key_of(*parts: object) -> str:
    """A short name for what is compiled: the same parts give the same name."""
    return hashlib.sha256(repr(parts).encode()).hexdigest()[:20]


def place(name: str, source: str) -> Path:
    """Write a generated module whole into the cache folder."""
    path = cache_folder() / f"{name}.py"
    handle, scratch = tempfile.mkstemp(dir=path.parent, suffix=".tmp")
    with os.fdopen(handle, "w", encoding="utf-8") as file:
        file.write(source)
    os.replace(scratch, path)
    return path


def load(name: str) -> ModuleType | None:
    """The generated module of that name, or None where there is none yet (or it cannot be read)."""
    path = cache_folder() / f"{name}.py"
    if not path.exists():
        return None
    spec = importlib.util.spec_from_file_location(f"pendulab_{name}", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # Numba's cache looks it up by name
    try:
        spec.loader.exec_module(module)
    except (SyntaxError, OSError):
        return None
    return module


def jet_address(module: ModuleType) -> int:
    """The address of the module's jet(q, s, W, R, n) as machine code, compiled now or found on disk."""
    from numba import types

    from toolkit.motion.pointer import REALS

    return _address(module, "jet", [REALS] * 4 + [types.int64], {"contract", "reassoc", "nsz"})


def terms_address(module: ModuleType) -> int:
    """The address of the module's terms(q, s, out) as machine code, compiled now or found on disk."""
    from toolkit.motion.pointer import REALS

    return _address(module, "terms", [REALS] * 3)


@cache
def integrator(module: ModuleType) -> Callable[..., None]:
    """integrate() of taylor, dop853 or rodas as machine code: a C function of eleven addresses after the equation's."""
    import ctypes

    from numba import types

    from toolkit.motion.pointer import REALS, WHOLES

    address = _address(module, "integrate", [types.int64, REALS, *[WHOLES] * 3, *[REALS] * 7])
    return ctypes.CFUNCTYPE(None, ctypes.c_int64, *[ctypes.c_void_p] * 11)(address)


def _address(module: ModuleType, name: str, kinds: list[object], fastmath: object = False) -> int:
    import numba

    signature = numba.void(*kinds)
    made = numba.cfunc(signature, cache=True, error_model="numpy", fastmath=fastmath)(getattr(module, name))
    module.__dict__[f"compiled_{name}"] = made  # the machine code lives as long as the module
    address: int = made.address
    return address
