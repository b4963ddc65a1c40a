"""How many bytes a function of one candidate keeps alive at once, read off its jaxpr without running it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import jax
from jax.extend.core import ClosedJaxpr, Jaxpr, Literal


def live_bytes(jaxpr: Jaxpr) -> int:
    """Peak of the bytes of all live values that depend on the inputs of a jaxpr, inputs and outputs included.

    Under `jax.vmap` those are the values that get a batch axis, so this is what one more item costs; what does
    not depend on the inputs is shared. The compiler fuses neighbours, so the true need is smaller.
    Residuals of derivatives and the stacked outputs of loops are values like any other.
    """
    peak, _ = _peak(jaxpr, [True] * len(jaxpr.invars))
    return peak


def _peak(jaxpr: Jaxpr, given: Sequence[bool]) -> tuple[int, list[bool]]:
    """Peak in bytes, and which outputs depend on those inputs for which `given` is true."""
    equations = _needed(jaxpr)
    last_use = {}
    for number, equation in enumerate(equations):
        for variable in _variables(equation.invars):
            last_use[variable] = number
    for variable in _variables(jaxpr.outvars):
        last_use[variable] = len(equations)
    alive = {variable for variable, batched in zip(jaxpr.invars, given, strict=True) if batched}
    total = peak = sum(_size(variable) for variable in alive)
    depend = set(alive)
    for number, equation in enumerate(equations):
        batched = [not isinstance(x, Literal) and x in depend for x in equation.invars]
        if not any(batched):
            continue
        within, outputs = _inside(equation, batched)
        own = [v for v, flag in zip(equation.outvars, outputs, strict=True) if flag]
        depend.update(own)
        # A body counts its own inputs and outputs; they are at most those that are counted here already.
        added = sum(_size(variable) for variable in own)
        peak = max(peak, total + max(added, within))
        total += added
        alive.update(own)
        for variable in {*_variables(equation.invars), *own}:
            if variable in alive and last_use.get(variable, -1) <= number:
                alive.remove(variable)
                total -= _size(variable)
    return peak, [not isinstance(x, Literal) and x in depend for x in jaxpr.outvars]


def _needed(jaxpr: Jaxpr) -> list[Any]:
    """The equations that the outputs need: the compiler drops the others."""
    wanted, kept = set(_variables(jaxpr.outvars)), []
    for equation in reversed(jaxpr.eqns):
        if equation.effects or any(variable in wanted for variable in equation.outvars):
            kept.append(equation)
            wanted.update(_variables(equation.invars))
    return kept[::-1]


def _inside(equation: Any, batched: list[bool]) -> tuple[int, list[bool]]:
    """Bytes alive inside an equation that holds functions of its own, and which of its outputs depend on the input."""
    everything = [True] * len(equation.outvars)
    bodies = [body for value in equation.params.values() for body in _bodies(value)]
    if len(bodies) != 1 or len(bodies[0].invars) != len(batched):
        # Branches, and loops with a test of their own: all of what goes in counts.
        return max((_peak(body, [True] * len(body.invars))[0] for body in bodies), default=0), everything
    body, flags = bodies[0], list(batched)
    if equation.primitive.name != "scan":
        return _peak(body, flags)
    # What is looped over, and what is stacked, has an axis more outside than inside; constants come before the carry.
    stacked = [_more_axes(*pair) for pair in zip(equation.outvars, body.outvars, strict=True)]
    sliced = [_more_axes(*pair) for pair in zip(equation.invars, body.invars, strict=True)]
    carries = stacked.count(False)
    carry = slice(sliced.count(False) - carries, sliced.count(False))
    while True:
        inside, outputs = _peak(body, flags)
        carried = [a or b for a, b in zip(flags[carry], outputs[:carries], strict=True)]
        if carried == flags[carry]:
            break
        flags[carry] = carried
    alive = sum(
        _size(v) for v, flag in zip(equation.outvars[carries:], outputs[carries:], strict=True) if flag
    )
    return inside + alive, outputs


def _more_axes(outer: Any, inner: Any) -> bool:
    return len(outer.aval.shape) > len(inner.aval.shape)


def _bodies(value: Any) -> list[Jaxpr]:
    if isinstance(value, ClosedJaxpr):
        return [value.jaxpr]
    if isinstance(value, Jaxpr):
        return [value]
    if isinstance(value, tuple | list):
        return [body for item in value for body in _bodies(item)]
    return []


def _variables(atoms: Sequence[Any]) -> list[Any]:
    return [atom for atom in atoms if not isinstance(atom, Literal)]


def _size(variable: Any) -> int:
    aval = variable.aval
    if not hasattr(aval, "shape"):
        return 0
    # The random keys of JAX are two 32-bit words.
    width = 8 if jax.dtypes.issubdtype(aval.dtype, jax.dtypes.prng_key) else aval.dtype.itemsize
    return aval.size * width
