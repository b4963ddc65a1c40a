"""`jax.jit` with the options that the installed version of JAX needs for rollouts on the CPU.

* Vectors of 512 bits where the processor has them; the compiler prefers 256. In a trial (AVX-512, seven axes,
  float64) an evaluation of the joint terms took 56 ns instead of 105, and in float32 30 instead of 53. Processors
  with shorter registers are not affected.
* Before 0.11 the CPU backend's fusion emitters, on by default, compute a producer again for each of its consumers:
  in a trial with jax 0.10.2, eight gradients of a seven-axis arm's index took 7.4 s with them and 3 ms without.
  Later versions neither have the option nor the fault.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TypeVar

import jax

F = TypeVar("F", bound=Callable)

OPTIONS = {"xla_cpu_prefer_vector_width": 512}
if jax.__version_info__ < (0, 11):
    OPTIONS["xla_cpu_use_fusion_emitters"] = False

# The code generator's own optimisations are half of what compiling takes. Without them a program runs about four
# times longer, which does not matter to one that runs once, in some milliseconds.
ONCE = {**OPTIONS, "xla_backend_optimization_level": 0}

jit = partial(jax.jit, compiler_options=OPTIONS)
"""`jax.jit`, to be used the same way, for whatever runs or differentiates a rollout."""


def one_program(function: F | None = None, *, static_argnames: str | tuple[str, ...] = ()) -> F:
    """A function that is one program where it is called by itself, and part of the caller's where that is traced.

    Without it each of its operations would be a program of its own, compiled at its first call: a second for the
    kinematics of one arm.
    """
    if function is None:
        return partial(one_program, static_argnames=static_argnames)
    return jax.jit(function, inline=True, static_argnames=static_argnames)
