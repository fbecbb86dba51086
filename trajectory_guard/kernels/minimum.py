"""The smaller of two doubles as one instruction that vectorises and lets NaN through."""

from llvmlite import ir
from numba import types
from numba.extending import intrinsic


@intrinsic
def minimum(typing_context, a, b):
    """
    Return the smaller of two doubles, NaN if either is NaN (IEEE 754-2019 minimum).

    A comparison would drop a NaN, and a reduction written with comparisons is compiled to a scalar
    loop.
    """

    def codegen(context, builder, signature, arguments):
        double = context.get_value_type(types.float64)
        function = builder.module.declare_intrinsic(
            'llvm.minimum', [double], ir.FunctionType(double, [double, double])
        )
        return builder.call(function, arguments)

    return types.float64(types.float64, types.float64), codegen
