"""What shares no shapes: planned by processes of their own, of which one may die."""

from __future__ import annotations

import os

import numpy as np
import pytest
from sweep_runs import sweep, write_base

from jffsr import cli
from jffsr.study.dataset import open_dataset
from jffsr.study.sweep import worker

TERMS = """\
import os, signal, sys
import jax.numpy as jnp

def calm(robot, motion):
    return jnp.max(motion.joint_velocity**2)

def deadly(robot, motion):
    print("a user's own print goes to nobody's results")
    if os.environ.get("DEADLY") and "jffsr.study.sweep.worker" in sys.orig_argv:
        os.kill(os.getpid(), signal.SIGKILL)
    return calm(robot, motion)
"""


@pytest.mark.sweep
def test_one_that_dies_takes_no_other_with_it_and_is_tried_again(tmp_path, monkeypatch, capsys):
    base = write_base(tmp_path)
    (tmp_path / "own_terms.py").write_text(TERMS)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    terms = "objective.terms=[{call: own_terms.deadly}],[{call: own_terms.calm}]"
    arguments = [terms, "rollout.num_steps=4", "optimizer.evaluations=8", "--workers", "1"]
    monkeypatch.setenv("DEADLY", "yes")
    assert sweep(base, *arguments, out=tmp_path / "s") == cli.DEFECT
    assert "its process ended (signal 9)" in capsys.readouterr().err
    first = open_dataset(tmp_path / "s/sweep.nc")
    np.testing.assert_array_equal(first["code"].values == -1, [True, False])
    monkeypatch.delenv("DEADLY")
    assert sweep(base, *arguments, out=tmp_path / "s") == cli.NOT_MET
    assert "1 of them done already" in capsys.readouterr().out
    second = open_dataset(tmp_path / "s/sweep.nc")
    # The two terms are the same, so are the plans, in whichever process.
    assert second["cost"].values[0] == second["cost"].values[1] == first["cost"].values[1]
    assert {"calm", "deadly"} <= set(second["term"].values)
    np.testing.assert_array_equal(np.isnan(second["term_value"].sel(term="deadly")), [False, True])


def test_a_worker_ends_when_its_input_closes(monkeypatch):
    ends = []
    reading, writing = os.pipe()
    os.write(writing, (3).to_bytes(8, "little") + b"abc")
    os.close(writing)
    passed = worker.queue.SimpleQueue()

    def end(status):
        ends.append(status)
        raise SystemExit

    monkeypatch.setattr(worker.os, "_exit", end)
    with open(reading, "rb") as source, pytest.raises(SystemExit):
        worker._read(source, passed)
    assert passed.get_nowait() == b"abc"
    assert ends == [0]
