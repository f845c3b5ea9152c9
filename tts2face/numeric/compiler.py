"""Compilation of kernels with numba, which is imported in this module only: when a kernel is not in the cache.

Compilation delays a first run by up to half a minute; it is logged at the level INFO.
"""

import gc
import importlib
import time
from types import FunctionType
from typing import Any

import llvmlite.binding as llvm
import numba
from llvmlite import ir
from numba.core import entrypoints, event, lowering, typed_passes, types, untyped_passes
from numba.core.codegen import CPUCodeLibrary
from numba.core.compiler import CompilerBase
from numba.core.compiler_lock import global_compiler_lock
from numba.core.compiler_machinery import PassManager, register_pass
from numba.core.errors import NumbaError
from numba.core.imputils import impl_ret_borrowed
from numba.core.registry import cpu_target
from numba.core.runtime import rtsys
from numba.core.types.containers import BaseTuple
from numba.extending import intrinsic
from numba.np import linalg
from numba.np.arrayobj import populate_array

from tts2face.numeric.kernels import BLOCK, ENTRY, LOG, Compiled, Intrinsic

REPORT_S = 5.0  # between two messages of a compilation
# Extensions of other packages are not loaded: no kernel uses their types, and looking for them takes 20 ms of a start.
entrypoints._already_initialized = True
# Nor is scipy.linalg, for 130 ms, to see whether it is there: it is one of this program's own requirements.
_ensure_blas, linalg.ensure_blas = linalg.ensure_blas, lambda: None
importlib.import_module("numba.np.arraymath")
linalg.ensure_blas = _ensure_blas
_dispatchers: dict[tuple[Any, bool], Any] = {}  # by kernel, and whether references to arrays are counted
# Names of numpy's functions that make arrays. Where a kernel uses none, numba counts no references to its arrays,
# unless it says that it must: for expressions with whole arrays.
ALLOCATING = {"zeros", "ones", "full", "empty_like", "zeros_like", "full_like", "copy"}
CODES = {
    types.boolean: "?", types.int8: "b", types.int16: "h", types.int32: "i", types.int64: "q",
    types.uint8: "B", types.uint16: "H", types.uint32: "I", types.uint64: "Q", types.float32: "f", types.float64: "d",
}  # fmt: skip


class KernelLibrary(CPUCodeLibrary):  # type: ignore[misc]
    """Optimised code that others are linked with; only a whole kernel becomes machine code, in an object file."""

    is_whole = False  # others are optimised within what calls them

    def _optimize_final_module(self) -> None:
        if self.is_whole:
            super()._optimize_final_module()

    def _finalize_final_module(self) -> None:
        self._finalized = True


@register_pass(mutates_CFG=True, analysis_only=False)
class KernelLowering(typed_passes.BaseNativeLowering):  # type: ignore[misc]
    """Lowering of a function that is called by others only; machine code is made for whole kernels."""

    _name = "kernel_lowering"
    lowering_class = lowering.Lower

    def run_pass(self, state: Any) -> bool:
        """As numba asks for a pass."""
        state.flags.no_compile = True
        state.library = KernelLibrary(state.targetctx.codegen(), state.func_id.func_qualname)
        super().run_pass(state)
        lowered = state["cr"]
        key = object().__sizeof__  # by which numba finds the function, in place of what Python would call: any built-in
        state.targetctx.insert_user_function(key, lowered.fndesc, [state.library])
        state["cr"] = lowered._replace(cfunc=key)
        return True


class KernelCompiler(CompilerBase):  # type: ignore[misc]
    """numba's compiler without the passes that change nothing in a kernel.

    Those are for closures, exceptions, expressions over whole arrays, and literal arguments. After each pass numba
    analyses the function again, which takes a tenth of the time of compiling it.
    """

    PASSES = (
        untyped_passes.TranslateByteCode,
        untyped_passes.FixupArgs,
        untyped_passes.IRProcessing,
        untyped_passes.GenericRewrites,
        untyped_passes.InlineInlinables,
        untyped_passes.ReconstructSSA,
        typed_passes.NopythonTypeInference,
        typed_passes.PreLowerStripPhis,
        typed_passes.IRLegalization,
        KernelLowering,
        typed_passes.NoPythonBackend,
    )

    def define_pipelines(self) -> list[Any]:
        """As numba asks for the passes."""
        passes = PassManager("kernel")
        for step in self.PASSES:
            passes.add_pass(step, step.__name__)
        passes.finalize()
        return [passes]


def compile_kernel(kernel: Any, arguments: tuple[Any, ...]) -> Compiled:
    """Compile a kernel for the types of its arguments."""
    with global_compiler_lock:
        signature = tuple(numba.typeof(value) for value in arguments)
        try:
            found = _overload(_dispatcher(kernel, _allocates(kernel)), signature)
        except NumbaError as error:
            # kernels are compiled without numba's runtime; those that make arrays need it
            if "NRT required" not in str(error):
                raise
            found = _overload(_dispatcher(kernel, True), signature)
        context, library = found.target_context, found.library
        if library._finalized:  # another kernel, which calls this one, has taken it
            library = KernelLibrary(context.codegen(), ENTRY)
            library.add_linking_library(found.library)
        module, codes, results = _entry(context, found.fndesc)
        library.add_ir_module(module)
        library.is_whole = True
        library.finalize()
        code = context.codegen()._tm.emit_object(library._final_module)
        return Compiled(codes, results, isinstance(found.fndesc.restype, BaseTuple), code)


def _overload(dispatcher: Any, signature: tuple[Any, ...]) -> Any:
    dispatcher.compile(signature)
    return dispatcher.overloads[signature]


def _dispatcher(kernel: Any, counts: bool) -> Any:
    """Numba's object for a kernel; the kernels that it calls are replaced by theirs."""
    if (kernel, counts) not in _dispatchers:
        function, known = kernel.py_func, dict(kernel.py_func.__globals__)
        for name in function.__code__.co_names:
            if isinstance(known.get(name), type(kernel)):
                known[name] = _dispatcher(known[name], counts)
            elif isinstance(known.get(name), Intrinsic):
                known[name] = INTRINSICS[known[name].name]
        copy = FunctionType(function.__code__, known, function.__name__, function.__defaults__, function.__closure__)
        options: dict[str, Any] = {"inline": "always"} if kernel.is_inlined else {"fastmath": kernel.reorders_sums}
        _dispatchers[kernel, counts] = numba.njit(
            _nrt=counts,
            error_model="numpy",
            no_cfunc_wrapper=True,
            no_cpython_wrapper=True,
            pipeline_class=KernelCompiler,
            **options,
        )(copy)
    return _dispatchers[kernel, counts]


def _allocates(kernel: Any) -> bool:
    """Whether a kernel, or one that it calls, allocates arrays."""
    names, known = kernel.py_func.__code__.co_names, kernel.py_func.__globals__
    called = [known[name] for name in names if isinstance(known.get(name), type(kernel))]
    return not ALLOCATING.isdisjoint(names) or any(map(_allocates, called))


def _entry(context: Any, described: Any) -> tuple[Any, str, str]:
    """Module with a function that takes arrays as numpy's objects, calls a kernel and stores its results."""
    module = context.create_module(ENTRY)
    call, pointer = context.call_conv, ir.IntType(8).as_pointer()
    kernel = ir.Function(
        module, call.get_function_type(described.restype, described.argtypes), described.llvm_func_name
    )
    leaves = [leaf for given in described.argtypes for leaf in _leaves(given)]
    results = _leaves(described.restype) if described.restype != types.none else []
    # an array is passed as numpy's object, whose fields the entry reads (decision 199)
    passed = [pointer if isinstance(leaf, types.Array) else context.get_argument_type(leaf) for leaf in leaves]
    entry = ir.Function(module, ir.FunctionType(ir.IntType(32), [*passed, *([pointer] if results else [])]), ENTRY)
    builder = ir.IRBuilder(entry.append_basic_block())
    values = iter([_value(context, builder, leaf, given) for leaf, given in zip(leaves, entry.args, strict=False)])

    def whole(kind: Any) -> Any:
        if isinstance(kind, BaseTuple):
            return context.make_tuple(builder, kind, [whole(member) for member in kind])
        return next(values)

    whole_values = [whole(kind) for kind in described.argtypes]
    status, found = call.call_function(
        builder, kernel, described.restype, described.argtypes, whole_values, attrs=("noinline",)
    )
    with builder.if_then(status.is_error, likely=False):
        builder.ret(ir.Constant(ir.IntType(32), 1))
    for n, leaf in enumerate(results):
        value = builder.extract_value(found, n) if isinstance(described.restype, BaseTuple) else found
        wide = types.float64 if isinstance(leaf, types.Float) else types.int64
        value = context.cast(builder, value, leaf, wide)
        place = builder.gep(entry.args[-1], [ir.Constant(ir.IntType(64), 8 * n)])
        builder.store(value, builder.bitcast(place, value.type.as_pointer()))
    builder.ret(ir.Constant(ir.IntType(32), 0))
    return module, "".join(map(_argument_code, leaves)), "".join(map(_result_code, results))


def _leaves(kind: Any) -> list[Any]:
    """Types that a type consists of."""
    return [leaf for member in kind for leaf in _leaves(member)] if isinstance(kind, BaseTuple) else [kind]


def _argument_code(kind: Any) -> str:
    if (kind.dtype if isinstance(kind, types.Array) else kind) not in CODES:
        raise TypeError(f"a kernel takes arrays, numbers and tuples of them, not {kind}")
    return "O" if isinstance(kind, types.Array) else CODES[kind]


def _result_code(kind: Any) -> str:
    return "?7x" if kind == types.boolean else "d" if isinstance(kind, types.Float) else "q"


def _value(context: Any, builder: Any, kind: Any, given: Any) -> Any:
    """An argument as numba's code takes it: of an array its place, shape and strides, which numpy's object begins with.

    ``PyArrayObject_fields`` of numpy's C API: the head of an object, data, number of dimensions, shape, strides.
    """
    if not isinstance(kind, types.Array):
        return context.data_model_manager[kind].from_argument(builder, given)
    size, word = ir.IntType(64), ir.IntType(64)

    def field(n: int, of: Any) -> Any:
        place = builder.gep(given, [ir.Constant(size, object.__basicsize__ + 8 * n)])
        return builder.load(builder.bitcast(place, of.as_pointer()))

    lengths, steps = field(2, word.as_pointer()), field(3, word.as_pointer())
    shape, strides = (
        [builder.load(builder.gep(first, [ir.Constant(size, axis)])) for axis in range(kind.ndim)]
        for first in (lengths, steps)
    )
    array = context.make_array(kind)(context, builder)
    data = builder.bitcast(field(0, ir.IntType(8).as_pointer()), array.data.type)
    width = context.get_abi_sizeof(context.get_data_type(kind.dtype))
    populate_array(array, data, shape, strides, ir.Constant(word, width), meminfo=None)
    return array._getvalue()


def symbol_address(name: str) -> int:
    """Address of a function of numba's run time, by which kernels allocate memory."""
    rtsys.initialize(cpu_target.target_context)
    return int(llvm.address_of_symbol(name) or 0)


@intrinsic
def flat_view(_: Any, array: Any) -> Any:
    """View (n,) of a contiguous array of any shape; numba's own calls its run time."""

    def view(context: Any, builder: Any, signature: Any, given: Any) -> Any:
        kind, of = signature.return_type, signature.args[0]
        whole = context.make_array(of)(context, builder, given[0])
        width = context.get_constant(types.intp, context.get_abi_sizeof(context.get_data_type(of.dtype)))
        found = context.make_array(kind)(context, builder)
        populate_array(found, whole.data, [whole.nitems], [width], width, meminfo=whole.meminfo)
        return impl_ret_borrowed(context, builder, kind, found._getvalue())

    return types.Array(array.dtype, 1, "C", readonly=not array.mutable)(array), view


@intrinsic
def write_larger(_: Any, array: Any, at: Any, count: Any, value: Any, step: Any) -> Any:
    """Write value + i step to the first `count` of `BLOCK` entries from the one at a place on, where it is larger.

    For kernels: a contiguous array of int64, whose first entry is at 0, and four of int64. A loop would be unrolled
    before the vectoriser sees it: it takes three times as long.
    """

    def write(context: Any, builder: Any, signature: Any, given: Any) -> Any:
        numbers = ir.VectorType(ir.IntType(64), BLOCK)
        none, every = ir.Constant(numbers, None), ir.Constant(ir.VectorType(ir.IntType(32), BLOCK), None)
        index = ir.Constant(numbers, list(range(BLOCK)))
        held, first, n, start, more = given
        entries = builder.gep(context.make_array(signature.args[0])(context, builder, held).data, [first])
        entries = builder.bitcast(entries, numbers.as_pointer())
        count, value, step = (
            builder.shuffle_vector(builder.insert_element(none, number, ir.IntType(32)(0)), none, every)
            for number in (n, start, more)
        )
        own = builder.add(value, builder.mul(step, index))
        own = builder.select(builder.icmp_signed("<", index, count), own, none)
        old = builder.load(entries, align=8)
        builder.store(builder.select(builder.icmp_signed(">", own, old), own, old), entries, align=8)
        return context.get_dummy_value()

    return types.void(array, *[types.int64] * 4), write


INTRINSICS = {"flat_view": flat_view, "write_larger": write_larger}


class _Compilations(event.Listener):  # type: ignore[misc]
    """Logs that functions are compiled: the first one, and now and then how many there have been.

    Meanwhile no garbage is collected: a compilation makes 100,000 of objects that live as long as it, and searching
    through them takes a tenth of its time. numba lets one thread compile at a time.
    """

    def __init__(self) -> None:
        self.n_functions, self._next_s = 0, 0.0
        self._depth, self._collects = 0, False

    def on_start(self, event: Any) -> None:
        """Count the function whose compilation begins; functions from the disk cache never come here."""
        self.n_functions += 1
        if self._depth == 0:
            self._collects = gc.isenabled()
            gc.disable()
        self._depth += 1
        if time.monotonic() >= self._next_s:
            so_far = "" if self.n_functions == 1 else f": {self.n_functions} functions so far"
            LOG.info(
                "compiling kernels, once on this machine%s", so_far, extra={"fields": {"functions": self.n_functions}}
            )
            self._next_s = time.monotonic() + REPORT_S

    def on_end(self, event: Any) -> None:
        """Collect garbage again after the outermost function."""
        self._depth -= 1
        if self._depth == 0 and self._collects:
            gc.enable()


COMPILATIONS = _Compilations()
event.register("numba:compile", COMPILATIONS)
