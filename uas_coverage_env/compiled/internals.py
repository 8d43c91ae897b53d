"""All that this project uses of numba beyond what numba documents for its extensions.

Numba makes everything that it compiles callable from Python, from C and from other kernels: wrapped
twice, optimised, turned into machine code, and then optimised again as a part of each kernel above.
Of the hundred kernels of a step, one is called from Python. Here a kernel that is called by others
stays in LLVM's intermediate form, and is optimised and turned into machine code once, together with
all the rest of the kernel that Python calls: two to three times as fast, and the same to the bit.
"""

import contextlib
import gc
import glob
import hashlib
import itertools
import os
import pickle
import sys
import uuid
from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Any

import numba
from llvmlite import binding
from numba import types
from numba.core.bytecode import FunctionIdentity
from numba.core.caching import CompileResultCacheImpl
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler, Flags, compile_result
from numba.core.registry import CPUDispatcher
from numba.core.serialize import dumps
from numba.np.arrayobj import np_cfarray

from uas_coverage_env.compiled.digest import MACHINERY, digest_of
from uas_coverage_env.compiled.shipped import Processor, at_level, shipped

PRIVATE = {
    "np_cfarray": "arrays that own nothing: what numba.carray does, which a GPU does not know",
    "make_array": "where an array that a kernel is handed begins",
    "call_conv": "how numba calls functions, for a call at an address:",
    "get_function_type": "the type of what lies there",
    "call_function": "the call",
    "return_status_propagate": "an exception in it goes on to the caller",
    "CPUDispatcher": "a kernel is known to numba by its type",
    "get_compile_result": "compiles for given types",
    "get_pointer_to_function": "where the machine code lies; nowhere, of a part",
    "llvm_func_name": "the name that it has there",
    "_nrt": "no counting of references: 1.45 times as fast (kernels.py)",
    "forceinline": "kernels become part of their callers: 2.3 times as fast (kernels.py)",
    "no_cpython_wrapper": "not callable from Python: half of the time to compile",
    "no_cfunc_wrapper": "nor from C",
    "Compiler": "numba's pipeline, with another library:",
    "Flags": "what is looked up a hundred thousand times in a compilation: a tenth of it",
    "_values": "those that are set",
    "JITCodeLibrary": "what it writes code into; parts skip the following two",
    "_optimize_final_module": "is called to optimise: parts are only shortened",
    "_finalize_final_module": "is called to make machine code",
    "_finalized": "says that a library is complete",
    "finalize": "completes it",
    "_final_module": "its code, for the disk",
    "_codegen": "what makes passes and machine code:",
    "_module_pass_manager": "the passes of a part",
    "_add_module": "makes the variable known in which numba keeps the environment of a function",
    "set_env": "is called to fill it",
    "codegen": "where numba looks for that",
    "serialize_using_object_code": "is called to write a library",
    "compile_result": "what numba expects of a part that is read",
    "get_executable": "what it keeps of one",
    "_cache": "where a dispatcher looks before it compiles",
    "CompileResultCacheImpl": "how it writes and reads machine code:",
    "_locator": "the folder: __pycache__, NUMBA_CACHE_DIR or the user's cache",
    "check_cachable": "whether code holds addresses of this process",
    "reduce": "to what can be written",
    "rebuild": "and back",
    "dumps": "writes it",
    "FunctionIdentity": "numbers the functions of a process,",
    "_unique_ids": "from here on",
    "magic_tuple": "of the processor that it is for",
    "refresh": "makes known what code that is read may call",
}
"""Names, and what for; at most 42. `tests/compiled/test_internals.py` looks for others."""

_VERSIONS = 64
"""Compiled versions of a function that are kept where it is built around others, or numbers."""


def _number_functions() -> None:
    """Let the numbers by which numba tells closures apart in machine code begin anywhere.

    Each process begins at 1, and code of several processes is linked: of two closures of a function
    that have one number, the code of the first would stand for both.
    """
    FunctionIdentity._unique_ids = itertools.count(int.from_bytes(os.urandom(6), "big"))


_number_functions()
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_number_functions)


def array_at(context: Any, builder: Any, array: types.Array, pointer: Any, shape: Any) -> Any:
    """LLVM's value of an array at a pointer to bytes; `shape` is that of a tuple of intp."""
    sizes = types.UniTuple(types.intp, array.ndim)
    return np_cfarray(context, builder, array(types.voidptr, sizes), [pointer, shape])


def parts_of(context: Any, builder: Any, array: types.Array, value: Any) -> Any:
    """The parts of an array (`data`, `shape`, `strides`, ...), from LLVM's value of it."""
    return context.make_array(array)(context, builder, value)


def call_at(
    context: Any, builder: Any, address: Any, result: Any, kinds: Sequence[Any], values: Any
) -> Any:
    """Call what `address_of` returned, as any kernel."""
    convention = context.call_conv
    code = convention.get_function_type(result, kinds)
    at = builder.inttoptr(address, code.as_pointer())
    status, value = convention.call_function(builder, at, result, kinds, values)
    with builder.if_then(status.is_error, likely=False):
        convention.return_status_propagate(builder, status)
    return value


def address_of(kernel: Any, signature: Any) -> tuple[int, Any]:
    """Compile a kernel to be called at its address: that, and the type of what it returns."""
    compiled = getattr(kernel, "at_address", kernel).get_compile_result(signature)
    code = compiled.library.get_pointer_to_function(compiled.fndesc.llvm_func_name)
    return code, compiled.signature.return_type


class KernelDispatcher(CPUDispatcher):
    """What kernels call of a kernel: a part of them, which Python cannot call.

    Most kernels are called from Python or from kernels, not both, so that what compiles the other
    form is made when it is asked for.
    """

    def __init__(
        self, py_func: Callable, locals: Any = None, targetoptions: Any = None, _: Any = None
    ) -> None:
        options = {**(targetoptions or {}), "no_cpython_wrapper": True, "no_cfunc_wrapper": True}
        # threads call machine code
        whole = options.get("parallel", False)
        super().__init__(py_func, locals or {}, options, _Compiler if whole else _PartCompiler)
        self._cache = _Disk(self, CompileResultCacheImpl if whole else _PartCacheImpl, "part")

    def __call__(self, *arguments: Any) -> Any:
        """Call it from Python."""
        return self.for_python(*arguments)

    @cached_property
    def for_python(self) -> CPUDispatcher:
        """What Python calls."""
        return MachineCode(self, "python", no_cpython_wrapper=False)

    @cached_property
    def at_address(self) -> CPUDispatcher:
        """What kernels call at its address (`calls.py`).

        Python cannot: to take a hundred arrays out of Python's objects is more machine code than
        most of these kernels.
        """
        return MachineCode(self, "address")


class MachineCode(CPUDispatcher):
    """Compiles a kernel to machine code."""

    def __init__(self, kernel: KernelDispatcher, form: str, **options: bool) -> None:
        options = {**kernel.targetoptions, **options}
        super().__init__(kernel.py_func, kernel.locals, options, _Compiler)
        self._cache = _Disk(kernel, CompileResultCacheImpl, form)

    def compile(self, sig: Any) -> Any:
        """Compile, or load from the disk."""
        # a compilation keeps most of what it makes: to look for garbage takes a fifth of its time
        collecting = gc.isenabled()
        gc.disable()
        try:
            return super().compile(sig)
        finally:
            if collecting:
                gc.enable()


class _Flags(Flags):
    """Numba's flags with a hash."""

    __slots__ = ("_key",)

    def __init__(self, copy_from: Any = None) -> None:
        super().__init__(copy_from)
        self._key = tuple(sorted((name, repr(value)) for name, value in self._values.items()))

    def __hash__(self) -> int:
        return hash(self._key)

    def __eq__(self, other: object) -> bool:
        return self._key == other._key if isinstance(other, _Flags) else super().__eq__(other)


class _Compiler(Compiler):
    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        self.state.flags = _Flags(self.state.flags)


class _PartCompiler(_Compiler):
    def __init__(self, typing_context: Any, target: Any, _: Any, *others: Any) -> None:
        super().__init__(typing_context, target, _Part(target.codegen(), "part"), *others)


class _Part(JITCodeLibrary):
    """Code that other code is made from: linked, but neither optimised nor made executable."""

    def _optimize_final_module(self) -> None:
        """Inline and shorten; vectors and the rest are left to the kernel that this is a part of.

        What is linked is smaller than it would be otherwise, and the machine code faster.
        """
        passes, builder = self._codegen._module_pass_manager(
            opt=0, loop_vectorize=False, slp_vectorize=False, cost="cheap"
        )
        passes.run(self._final_module, builder)

    def _finalize_final_module(self) -> None:
        self._finalized = True

    def get_pointer_to_function(self, name: str) -> int:
        """Nowhere: this code lies in the machine code of others."""
        if not self._finalized:
            self.finalize()
        return 0

    @property
    def codegen(self) -> Any:
        """Where numba calls `set_env`."""
        return self

    def set_env(self, name: str, environment: Any) -> None:
        """Define the variable of an environment, which machine code would."""
        variable = binding.parse_assembly(f'@"{name}" = common global i8* null')
        codegen: Any = self._codegen
        codegen._add_module(variable)
        codegen.set_env(name, environment)

    def serialize_using_object_code(self) -> Any:
        """As `_PartCacheImpl` reads it."""
        return self.name, self._final_module.as_bitcode()

    @classmethod
    def read(cls, codegen: Any, name: str, bitcode: bytes) -> "_Part":
        """A part as it was written."""
        part = cls(codegen, name)
        part._final_module, part._finalized = binding.parse_bitcode(bitcode), True
        return part


class _PartCacheImpl(CompileResultCacheImpl):
    """How parts are read from the disk."""

    def rebuild(self, target_context: Any, payload: Any) -> Any:
        """A part from what numba has made of it."""
        code, descriptor, environment, signature, *_, begin, others = payload
        for function in begin:
            function()
        part = _Part.read(target_context.codegen(), *code)
        entry = target_context.get_executable(part, descriptor, environment)
        return compile_result(
            target_context=target_context,
            typing_context=target_context.typing_context,
            library=part,
            environment=environment,
            entry_point=entry,
            fndesc=descriptor,
            signature=signature,
            objectmode=False,
            lifted=(),
            reload_init=begin,
            referenced_envs=others,
        )


class _Disk:
    """The compiled versions of a kernel in one form, a file each.

    Numba's own cache compares the file of a function alone: where a function that it calls is
    edited, it goes on to load the old code. Here each file's name says what it was compiled from,
    so that an edit anywhere below is noticed, what is unaffected stays, and files that processes
    write at the same time never mix. What is not there is looked for among what the package brings
    (`shipped.py`). Where a kernel has no file (typed into a prompt) or no folder can be written to,
    it is compiled anew in each process.
    """

    cache_path = None  # each kernel has its own

    def __init__(self, kernel: Any, form: type[CompileResultCacheImpl], name: str) -> None:
        self._kernel, self._form, self._name = kernel, form, name

    @cached_property
    def _written(self) -> Any:
        try:
            return self._form(self._kernel.py_func)
        except (OSError, RuntimeError, TypeError):
            return None

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """A version from the disk, or one that the package brings; None: it has to be compiled."""
        target_context.refresh()
        processor = target_context.codegen().magic_tuple()
        for read, compiled_for in ((self._kept, processor), (self._brought, at_level(processor))):
            name = self._name_of(sig, compiled_for)
            try:
                if name is not None and (content := read(name)) is not None:
                    return self._form.rebuild(self._written, target_context, pickle.loads(content))
            except Exception:  # not there, or cut off: compiled anew and replaced
                continue
        return None

    def save_overload(self, sig: Any, cres: Any) -> None:
        """Write a version; a full disk costs the next process a compilation, not this its work."""
        name = self._name_of(sig, cres.target_context.codegen().magic_tuple())
        if name is None or self._written is None or not self._written.check_cachable(cres):
            return
        path, unfinished = self._path(*name), f"{self._path(name[0])}.tmp.{uuid.uuid4().hex[:16]}"
        with contextlib.suppress(OSError):
            try:
                with open(unfinished, "wb") as file:
                    file.write(dumps(self._written.reduce(cres)))
                os.replace(unfinished, path)
            finally:
                _remove(unfinished)
            self._remove_outdated(*name)

    def _kept(self, name: tuple[str, str, str]) -> bytes | None:
        if self._written is None:
            return None
        with open(self._path(*name), "rb") as file:
            return file.read()

    def _brought(self, name: tuple[str, str, str]) -> bytes | None:
        return shipped("".join(name))

    def _name_of(self, sig: Any, compiled_for: Processor | None) -> tuple[str, str, str] | None:
        """Name of a version: function, what that is made from, what it is compiled for."""
        digest = digest_of(self._kernel)
        key = repr((sig, compiled_for, self._name))
        if compiled_for is None or digest is None or " at 0x" in key:
            return None  # it depends on what only this process knows by its address
        function = self._kernel.py_func
        module = os.path.splitext(os.path.basename(function.__code__.co_filename))[0]
        name = f"{module}.{function.__qualname__}".replace("<", "").replace(">", "")
        made_by = f"{sys.implementation.cache_tag} {numba.__version__} {MACHINERY}"
        stamp = hashlib.sha256(f"{made_by} {digest}".encode()).hexdigest()
        version = hashlib.sha256(key.encode()).hexdigest()
        return name, f".{stamp[:16]}", f".{version[:16]}.{self._name}.nbc"

    def _path(self, *name: str) -> str:
        return os.path.join(self._written._locator.get_cache_path(), "".join(name))

    def _remove_outdated(self, function: str, stamp: str, _: str) -> None:
        """Delete what a function was before; of one that is built around others, long before."""
        stem = self._path(function)
        paths = glob.glob(f"{glob.escape(stem)}.*.*.nbc")
        others = [path for path in paths if not path.startswith(f"{stem}{stamp}.")]
        kept = _VERSIONS if self._kernel.py_func.__closure__ else 0
        for path in sorted(others, key=_written_ns, reverse=True)[kept:]:
            _remove(path)


def _written_ns(path: str) -> int:
    try:
        return os.stat(path).st_mtime_ns
    except OSError:  # another process has removed it
        return 0


def _remove(path: str) -> None:
    with contextlib.suppress(OSError):
        os.remove(path)
