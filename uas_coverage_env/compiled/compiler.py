"""How kernels are compiled in less than half of the time that numba takes by itself.

Numba makes everything that it compiles callable from Python, from C and from other kernels: wrapped
twice, optimised, turned into machine code, and then optimised again as a part of each kernel above.
Of the hundred kernels of a step, one is called from Python. Here a kernel that is called by others
stays in LLVM's intermediate form, and is optimised and turned into machine code once, together with
all the rest of the kernel that Python calls. The result is the same to the last bit.
"""

import gc
from collections.abc import Callable
from functools import cached_property
from typing import Any

from llvmlite import binding
from numba.core.caching import CompileResultCacheImpl
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler, Flags, compile_result
from numba.core.registry import CPUDispatcher

from uas_coverage_env.compiled.cache import keep_as
from uas_coverage_env.compiled.progress import COMPILATIONS


class _Dispatcher(CPUDispatcher):
    """Numba's, with a notice to who waits for a compilation."""

    def compile(self, sig: Any) -> Any:
        """Compile, or load from the disk."""
        # a compilation keeps most of what it makes: to look for garbage takes a fifth of its time
        collecting = gc.isenabled()
        gc.disable()
        try:
            with COMPILATIONS.one(lambda: len(called_by(self))):
                return super().compile(sig)
        finally:
            if collecting:
                gc.enable()


class KernelDispatcher(_Dispatcher):
    """A kernel: compiled for Python where Python calls it, and as a part where a kernel calls it.

    Most kernels are one or the other, so that what compiles a part is made when it is asked for.
    """

    def __init__(
        self,
        py_func: Callable[..., Any],
        locals: Any = None,
        targetoptions: Any = None,
        pipeline_class: type[Compiler] | None = None,
    ) -> None:
        super().__init__(
            py_func, locals, dict(targetoptions or {}), pipeline_class or _KernelCompiler
        )

    @cached_property
    def part(self) -> CPUDispatcher:
        """What other kernels call."""
        # threads call machine code
        in_threads = self.targetoptions.get("parallel")
        return self._inside(
            CPUDispatcher, _KernelCompiler if in_threads else _PartCompiler, PartCacheImpl
        )

    @cached_property
    def at_address(self) -> CPUDispatcher:
        """What they call at its address (`calls.py`).

        Python cannot: to take a hundred arrays out of Python's objects is more machine code than
        most of these kernels.
        """
        return self._inside(_Dispatcher, _KernelCompiler, AddressCacheImpl)

    def _inside(
        self,
        dispatcher: type[CPUDispatcher],
        compiler: type[Compiler],
        form: type[CompileResultCacheImpl],
    ) -> CPUDispatcher:
        options = {**self.targetoptions, "no_cpython_wrapper": True}
        made = dispatcher(self.py_func, self.locals, options, compiler)
        keep_as(form, made, self)
        return made

    def get_call_template(self, args: Any, kws: Any) -> Any:
        """What numba asks for where a kernel calls this one."""
        template = self.part.get_call_template(args, kws)
        COMPILATIONS.made(self)
        return template

    def get_overload(self, sig: Any) -> Any:
        """What numba asks for where a kernel calls this one."""
        return self.part.get_overload(sig)

    @property
    def is_compiling(self) -> Any:
        """Whether a call in a kernel is one of a function to itself."""
        return self.part.is_compiling


def called_by(kernel: CPUDispatcher) -> set[KernelDispatcher]:
    """All kernels that a kernel calls by their names, directly or not."""
    reached: set[KernelDispatcher] = set()
    found: list[CPUDispatcher] = [kernel]
    while found:
        function = found.pop().py_func
        cells = (cell.cell_contents for cell in function.__closure__ or ())
        named = (function.__globals__.get(name) for name in function.__code__.co_names)
        called = {one for one in (*named, *cells) if isinstance(one, KernelDispatcher)} - reached
        reached |= called
        found += called
    return reached


class _Flags(Flags):
    """Numba's flags with a hash: a compilation looks them up a hundred thousand times."""

    __slots__ = ("_key",)

    def __init__(self, copy_from: Any = None) -> None:
        super().__init__(copy_from)
        self._key = tuple(sorted((name, repr(value)) for name, value in self._values.items()))

    def __hash__(self) -> int:
        return hash(self._key)

    def __eq__(self, other: object) -> bool:
        return self._key == other._key if isinstance(other, _Flags) else super().__eq__(other)


class _KernelCompiler(Compiler):
    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        self.state.flags.no_cfunc_wrapper = True  # nothing is called from C
        self.state.flags = _Flags(self.state.flags)
        COMPILATIONS.begun()


class _PartCompiler(_KernelCompiler):
    def _compile_bytecode(self) -> Any:
        state = self.state
        state.library = _PartLibrary(state.targetctx.codegen(), state.func_id.func_qualname)
        return super()._compile_bytecode()


class _PartLibrary(JITCodeLibrary):
    """Code that other code is made from: linked, but neither optimised nor made executable."""

    def finalize(self) -> None:
        """Take in what this code calls."""
        self._raise_if_finalized()
        for library in dict.fromkeys(self._linking_libraries):
            self._reload_init.update(library._reload_init)
            self._final_module.link_in(library._get_module_for_linking(), preserve=True)
        self._simplify()
        self._make_known()

    def _simplify(self) -> None:
        """Inline and shorten; vectors and the rest are left to the kernel that this is a part of.

        What is linked is smaller than it would be otherwise, and the machine code faster.
        """
        manager, builder = self._codegen._module_pass_manager(
            loop_vectorize=False,
            slp_vectorize=False,
            opt=self._codegen._opt_level,
            cost="cheap",
        )
        manager.run(self._final_module, builder)

    def _make_known(self) -> None:
        """Define the variables in which numba keeps the environment of each function."""
        self._finalize_dynamic_globals()
        engine: Any = self._codegen._engine
        missing = [
            variable.name
            for variable in self._final_module.global_variables
            if variable.name.startswith("_ZN08NumbaEnv")
            and not engine.is_symbol_defined(variable.name)
        ]
        if missing:
            module = self._codegen._create_empty_module(self.name)
            lines = (f'@"{name}" = common global i8* null' for name in missing)
            self._codegen._add_module(binding.parse_assembly("\n".join((str(module), *lines))))
            engine.finalize_object()
        self._finalized = True

    def get_pointer_to_function(self, name: str) -> int:
        """Nowhere: this code lies in the machine code of others."""
        self._ensure_finalized()
        return 0

    def serialize_using_object_code(self) -> Any:
        """As `PartCacheImpl` reads it."""
        return self.name, "part", self._get_module_for_linking().as_bitcode()

    @classmethod
    def read(cls, codegen: Any, name: str, bitcode: bytes) -> "_PartLibrary":
        """A library as it was written."""
        library = cls(codegen, name)
        library._final_module = library._shared_module = binding.parse_bitcode(bitcode)
        library._make_known()
        return library


class AddressCacheImpl(CompileResultCacheImpl):
    """As numba's: how kernels that are called at their address are kept, apart from others."""


class PartCacheImpl(CompileResultCacheImpl):
    """How parts are read from the disk."""

    def rebuild(self, target_context: Any, payload: Any) -> Any:
        """A part from what numba's `CompileResult._reduce` has written."""
        (name, kind, bitcode), *rest = payload
        if kind != "part":
            return super().rebuild(target_context, payload)
        descriptor, environment, signature, objectmode, lifted, annotation, init, others = rest
        for function in init:
            function()
        codegen = target_context.codegen()
        part = _PartLibrary.read(codegen, name, bitcode)
        entry = target_context.get_executable(part, descriptor, environment)
        for other in others:
            codegen.set_env(other.env_name, other)
        return compile_result(
            target_context=target_context,
            typing_context=target_context.typing_context,
            library=part,
            environment=environment,
            entry_point=entry,
            fndesc=descriptor,
            type_annotation=annotation,
            signature=signature,
            objectmode=objectmode,
            lifted=lifted,
            reload_init=init,
            referenced_envs=others,
            typing_error=None,
        )
