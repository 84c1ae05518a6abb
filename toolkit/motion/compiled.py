"""Where generated source lives, and how it becomes machine code that the next process finds ready.

The folder is PENDULAB_CACHE if that is set, else the user's cache folder, else (not writable) a temporary one. A file's
name is a hash of its content, and it is put in place by one rename: any number of processes may share the folder.
"""

from __future__ import annotations

import ctypes
import gc
import hashlib
import importlib.util
import os
import sys
import tempfile
from collections.abc import Callable
from functools import cache
from pathlib import Path
from struct import Struct
from types import ModuleType
from typing import Any

from toolkit.errors import JobError


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
            folder.mkdir(mode=0o700, parents=True, exist_ok=True)
            if hasattr(os, "getuid") and folder.stat().st_uid != os.getuid():
                continue  # somebody else's: what lies there would be run
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
    _write(path, source.encode())
    return path


def _write(path: Path, content: bytes) -> None:
    handle, scratch = tempfile.mkstemp(dir=path.parent, suffix=".tmp")
    with os.fdopen(handle, "wb") as file:
        file.write(content)
    os.replace(scratch, path)


def load(name: str) -> ModuleType | None:
    """The generated module of that name, or None where there is none yet (or it cannot be read)."""
    path = cache_folder() / f"{name}.py"
    if not path.exists():
        return None
    spec = importlib.util.spec_from_file_location(f"pendulab_{name}", path)
    assert spec is not None
    assert spec.loader is not None
    module = sys.modules[spec.name] = importlib.util.module_from_spec(spec)  # Numba's cache finds it by name
    try:
        spec.loader.exec_module(module)
    except (SyntaxError, OSError):
        return None
    return module


@cache
def series(module: ModuleType, name: str) -> int:
    """The address of the module's `jet` or `more`, (q, s, W, R, n), as machine code."""

    def source() -> tuple[list[Any], Any, Any]:
        from numba import types

        from toolkit.motion.kernels.pointer import REALS

        return [REALS] * 4 + [types.int64], {"contract"}, getattr(module, name)

    return machine_code(f"{module.__name__}_{name}", source)


@cache
def terms(module: ModuleType, name: str = "terms") -> int:
    """The address of the module's `terms` or `tension`, (q, s, out), as machine code."""

    def source() -> tuple[list[Any], Any, Any]:
        from toolkit.motion.kernels.pointer import REALS

        return [REALS] * 3, False, getattr(module, name)

    return machine_code(f"{module.__name__}_{name}", source)


@cache
def kernel(name: str, module: str = "", what: str = "") -> Callable[[Any, None, Any], int]:
    """The function NAME of kernels/NAME.py, or of a `module`, as machine code: (scratch address, None, address of its
    places) -> 0. `what` it is, for who waits."""

    def source() -> tuple[list[Any], Any, Any]:
        import importlib

        from toolkit.motion.kernels.pointer import WHOLES

        return [WHOLES], False, getattr(importlib.import_module(module or f"toolkit.motion.kernels.{name}"), name)

    files = _kernel_files()
    if module:  # one kernel of a folder may use another
        file = Path(__file__).parents[2].joinpath(*module.split(".")).with_suffix(".py")
        files = [Path(__file__).parent / "kernels" / "pointer.py", *sorted(file.parent.glob("_*.py"))]
    texts = [file.read_bytes() for file in files]
    address = machine_code(f"{name}_{key_of(*texts)}", source, what or "the equation of motion")
    return ctypes.CFUNCTYPE(ctypes.c_int32, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p)(address)


@cache
def slack_search() -> int:
    """The address of `slack` of kernels/slack.py as machine code, for integrators to call."""

    def source() -> tuple[list[Any], Any, Any]:
        from numba import types

        from toolkit.motion.kernels.pointer import REALS
        from toolkit.motion.kernels.slack import slack

        return [types.int64, REALS, REALS, REALS, types.int64], False, slack

    return machine_code(f"slack_{key_of(*[file.read_bytes() for file in _kernel_files()])}", source)


def _kernel_files() -> list[Path]:
    folder = Path(__file__).parent
    return [folder / "routes.py", *sorted((folder / "kernels").glob("*.py"))]


def address(array: Any) -> int:
    """Where the numbers of a writable, contiguous array begin; four times as quick to ask as `array.ctypes.data`."""
    return ctypes.addressof(ctypes.c_char.from_buffer(array))


_PACKED = [Struct(f"{count}q").pack for count in range(20)]  # of so many addresses
_NOTHING = ctypes.create_string_buffer(8)  # where kernels put their empty results


def call(function: Callable[[Any, None, Any], int], *addresses: int) -> None:
    """Call a kernel with these addresses as its places."""
    function(_NOTHING, None, _PACKED[len(addresses)](*addresses))


def machine_code(
    name: str, source: Callable[[], tuple[list[Any], Any, Any]], what: str = "the equation of motion"
) -> int:
    """The address of a function that Numba compiles now, or that was compiled before for a processor like this one.

    source : gives its argument types, fastmath flags and Python function; called only where nothing is on the disk. A
    process that finds everything compiled imports llvmlite alone, in a tenth of the time that Numba takes.
    The function is called as Numba calls its own: first an address for its (empty) result and one for an exception.
    """
    if not keeps_objects:
        seen = cache_folder() / f"{name}.seen"
        made = _compile(source, "" if seen.exists() else what, cache=True)
        seen.touch()
        _loaded.append(made)
        address: int = made._library.get_pointer_to_function(made.native_name.removeprefix("cfunc."))
        return address
    processor = _processor()
    path = cache_folder() / f"{name}_{processor.key}.o"
    found = processor.load(path, name)
    if found is None:
        made = _compile(source, what)
        _write(path, processor.emit(made.inspect_llvm(), made.native_name.removeprefix("cfunc."), name))
        found = processor.load(path, name)
    if found is None:
        raise JobError(f"cannot keep compiled equations in {cache_folder()}; set PENDULAB_CACHE to a folder")
    return found


keeps_objects = sys.platform.startswith("linux")
"""Whether compiled code is kept as bare objects. Only Linux has been tried; elsewhere Numba's own cache is slower but safe."""

_loaded: list[Any] = []  # code must outlive its address


def _compile(source: Callable[[], tuple[list[Any], Any, Any]], what: str, cache: bool = False) -> Any:
    if what:
        listener(f"compiling {what} (once; later runs find it ready)")
    import numba

    collects = gc.isenabled()
    gc.disable()  # of the millions of objects that Numba makes, nearly all stay: looking for others takes a tenth of the time
    try:
        kinds, fastmath, function = source()
        return numba.cfunc(numba.void(*kinds), error_model="numpy", fastmath=fastmath, cache=cache)(function)
    finally:
        if collects:
            gc.enable()


_C_MATH = ("sin", "cos", "tan", "exp", "log", "sqrt", "tanh", "pow", "memcpy", "memmove", "memset")


class _Processor:
    """This processor as LLVM knows it, and the code that was loaded for it."""

    def __init__(self) -> None:
        import llvmlite  # type: ignore[import-untyped]
        import llvmlite.binding as llvm  # type: ignore[import-untyped]

        llvm.initialize_native_target()
        llvm.initialize_native_asmprinter()
        if os.name == "nt":  # elsewhere LLVM finds these in the process itself
            for name in _C_MATH:
                llvm.add_symbol(name, ctypes.cast(getattr(ctypes.cdll.ucrtbase, name), ctypes.c_void_p).value)
        self.llvm = llvm
        triple, cpu = llvm.get_process_triple(), llvm.get_host_cpu_name()
        features = llvm.get_host_cpu_features().flatten()
        self.key = key_of(llvmlite.__version__, triple, cpu, features)
        x86 = triple.split("-")[0] in ("x86_64", "amd64", "i386", "i686")
        self.machine = llvm.Target.from_triple(triple).create_target_machine(
            cpu=cpu, features=features, opt=3, reloc="static" if x86 else "default", codemodel="jitdefault", jit=True
        )
        self.engine = llvm.create_mcjit_compiler(llvm.parse_assembly(""), self.machine)

    def load(self, path: Path, name: str) -> int | None:
        try:
            code = path.read_bytes()
            self.engine.add_object_file(self.llvm.ObjectFileRef.from_data(code))
        except (OSError, RuntimeError):  # not there, or cut short
            return None
        self.engine.finalize_object()
        address: int = self.engine.get_function_address(name)
        return address or None

    def emit(self, text: str, function: str, name: str) -> bytes:
        """Machine code, under `name`, of one function of an LLVM module and of what that calls."""
        module = self.llvm.parse_assembly(text)
        for value in (*module.functions, *module.global_variables):
            if not value.is_declaration:
                value.linkage = "internal"
        kept = module.get_function(function)
        kept.linkage, kept.name = "external", name
        passes = self.llvm.create_new_module_pass_manager()
        passes.add_global_dead_code_eliminate_pass()
        passes.run(module, self.llvm.create_pass_builder(self.machine, self.llvm.create_pipeline_tuning_options()))
        called = [f.name for f in module.functions if f.is_declaration]
        unknown = [f for f in called if not f.startswith("llvm.") and f not in _C_MATH]
        if unknown:
            raise JobError(f"{name} calls {', '.join(unknown)}, which a later process would not find; report this")
        code: bytes = self.machine.emit_object(module)
        return code


@cache
def _processor() -> _Processor:
    return _Processor()
