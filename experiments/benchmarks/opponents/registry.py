"""All opponents by name, and how each is asked for a program."""

from __future__ import annotations

import importlib
from collections.abc import Callable
from dataclasses import dataclass
from types import ModuleType

from experiments.benchmarks.cases import Case
from experiments.benchmarks.opponents import integrate
from experiments.benchmarks.opponents.program import Program, Unsupported, called, compiled

ROLLOUT, GRADIENT, TWIST = "rollout", "gradient", "base twist"
FAST, KERNEL, PLAIN, OBVIOUS = "jffsr", "C++ kernel", "plain path", "obvious JAX"
PINOCCHIO, SHARED = "Pinocchio C++", "Pinocchio C++, shared"
DIFFRAX, MJX, FRAX, ADAM, PINOCCHIO_PYTHON = "diffrax", "MJX", "frax", "adam", "Pinocchio Python"


@dataclass(frozen=True)
class Opponent:
    """largest is the most work in one call, in steps times rollouts, that does not take too long; None: no limit.

    own marks what is part of this package: where it fails, the benchmark does.
    """

    name: str
    module: str
    note: str
    largest: int | None = 409_600
    on_accelerators: bool = True
    options: tuple[tuple[str, object], ...] = ()
    own: bool = False

    def load(self) -> ModuleType:
        """Its module."""
        return importlib.import_module(f"experiments.benchmarks.opponents.{self.module}")

    def program(self, work: str, case: Case, threads: int) -> Program:
        """What does this work; Unsupported or ImportError say why there is none."""
        module = self.load()
        if hasattr(module, "rollouts"):
            if work == GRADIENT:
                raise Unsupported("no gradient of a rollout")
            options = dict(self.options) if work == ROLLOUT else {}
            make = module.rollouts if work == ROLLOUT else module.twists
            return make(self._cut(work, case), threads, **options)
        return self._jax_program(module, work, self._cut(work, case))

    def _cut(self, work: str, case: Case) -> Case:
        if self.largest is None or work == TWIST:
            return case
        most = max(1, self.largest // case.steps // (8 if work == GRADIENT else 1))
        return case.varied(batch=min(case.batch, most))

    def _jax_program(self, module: ModuleType, work: str, case: Case) -> Program:
        import jax

        make = called if getattr(module, "IN_CHUNKS", False) else compiled
        if work == TWIST:
            if not (hasattr(module, "twists") or hasattr(module, "twist")):
                raise Unsupported("an integrator: it has no base twist of its own")
            many = module.twists(case) if hasattr(module, "twists") else jax.vmap(module.twist(case))
            return compiled(many, *case.postures, batch=case.batch, precision_name=case.precision)
        final = module.final_attitude(case)
        function = final if work == ROLLOUT else jax.value_and_grad(integrate.loss(final))
        batched: Callable = module.batched(function)
        return make(batched, case.free, batch=case.batch, precision_name=case.precision)


OPPONENTS = {
    opponent.name: opponent
    for opponent in (
        Opponent(FAST, "jffsr_fast", "`jffsr.rollout` through `jffsr.map_batch`", largest=None, own=True),
        Opponent(
            PLAIN, "plain_path", "`jffsr.reference_rollout`: a 6 x 6 solve in each stage; one vmap", own=True
        ),
        Opponent(
            OBVIOUS,
            "obvious_jax",
            "everything in the scan, 3-vectors, four stages written out, a 3 x 3 solve in each; one vmap",
            own=True,
        ),
        Opponent(
            DIFFRAX,
            "diffrax",
            "constant steps, classical RK4 as a tableau, obvious right-hand side; one vmap",
        ),
        Opponent(
            MJX,
            "mjx",
            "mass matrix (kinematics, com_pos, crb) in each stage, the stages a loop; one vmap",
            largest=12_800,
        ),
        Opponent(FRAX, "frax", "`mass_matrix` in each stage; one vmap", largest=51_200),
        Opponent(ADAM, "adam", "`mass_matrix` in each stage; its own batch axis", largest=51_200),
        Opponent(
            PINOCCHIO_PYTHON,
            "pinocchio_python",
            "`crba` in each stage, NumPy around it; a rollout at a time",
            on_accelerators=False,
        ),
        Opponent(
            PINOCCHIO,
            "pinocchio_cpp",
            "`crba` in each of the four stages, joints about z, g++ -O3 -march=native; a rollout at a time",
            on_accelerators=False,
        ),
        Opponent(
            SHARED,
            "pinocchio_cpp",
            "the same with two `crba` a step: at zero momentum the rate in the base's frame does not depend on the "
            "attitude, which whoever writes it has to notice",
            on_accelerators=False,
            options=(("shared", True),),
        ),
        Opponent(
            KERNEL,
            "c_kernel",
            "the ceiling: jffsr's arithmetic in C++, the batch in the lanes of vector registers",
            largest=None,
            on_accelerators=False,
        ),
    )
}
