"""Compiling: the options that programs need, programs prepared beside other work, and the folder that keeps them."""

from jffsr.compiling.options import ONCE, OPTIONS, jit
from jffsr.compiling.program import Program, forget, program

__all__ = ["ONCE", "OPTIONS", "Program", "forget", "jit", "program"]
