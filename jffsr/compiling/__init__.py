"""Compiling: the options that programs need, programs prepared beside other work, and the folder that keeps them."""

from jffsr.compiling.options import OPTIONS, jit
from jffsr.compiling.program import Program, program

__all__ = ["OPTIONS", "Program", "jit", "program"]
