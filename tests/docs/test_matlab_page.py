"""The page for users of SPART: its conversions turn this package's numbers into those of SPART's own functions."""

from __future__ import annotations

import json

import numpy as np
import pytest
from documentation import ROOT, blocks

import jffsr

pytestmark = pytest.mark.docs


@pytest.fixture(scope="module")
def spart():
    """SPART's numbers, and those of the page's state in this package."""
    data = json.loads((ROOT / "tests" / "data" / "oracle" / "spart.json").read_text(encoding="utf-8"))
    return {name: np.array(value) if isinstance(value, list) else value for name, value in data.items()}


@pytest.fixture(scope="module")
def robot(spart, tmp_path_factory):
    file = tmp_path_factory.mktemp("spart") / "tender.urdf"
    file.write_text(spart["urdf"], encoding="utf-8")
    return jffsr.load_robot(file)


@pytest.fixture(scope="module")
def page():
    """What the page's first block defines."""
    names = {}
    exec(next(b.text for b in blocks("docs/how-to/come_from_matlab.md") if b.kind == "python"), names)
    return names


@pytest.fixture(scope="module")
def kin(robot, spart):
    return jffsr.kinematics(robot, jffsr.State(spart["r0"], spart["quaternion"], spart["qm"]))


def test_kinematics_are_those_of_the_table(kin, spart):
    np.testing.assert_allclose(kin.rotation[0], spart["R0"], atol=1e-15)
    for name, own in {
        "rL": kin.com[1:].T,
        "rJ": kin.anchor.T,
        "e": kin.axis.T,
        "Im": kin.inertia_I[1:],
    }.items():
        np.testing.assert_allclose(own, spart[name], atol=1e-14, err_msg=name)


def test_twists_are_those_of_the_table(kin, spart, page):
    base = page["turned"](spart["R0"]) @ spart["u0"]
    np.testing.assert_allclose(base, np.roll(spart["t0"], 3), atol=1e-15)
    arm = np.asarray(kin.com - kin.com[0])
    linear = kin.com_jacobian @ spart["um"] + base[:3] + np.cross(base[3:], arm)
    angular = kin.angular_jacobian @ spart["um"] + base[3:]
    np.testing.assert_allclose(np.vstack([angular.T, linear.T])[:, 1:], spart["tL"], atol=1e-14)


def test_dynamics_are_spart_s(robot, kin, spart, page):
    found = page["spart_forward_dynamics"](robot, kin, spart["u0"], spart["um"], spart["taum"])
    np.testing.assert_allclose(found[0], spart["u0dot_fd"], atol=1e-10)
    np.testing.assert_allclose(found[1], spart["umdot_fd"], atol=1e-10)
    # tau = H udot + C u: SPART's inverse dynamics from the inertia blocks of the page, and the bias force turned.
    S = page["turned"](spart["R0"])
    H0, H0m, Hm = page["spart_inertia"](robot, kin)
    bias = np.asarray(jffsr.bias_force(robot, kin, S @ spart["u0"], spart["um"]))
    tau0 = H0 @ spart["u0dot"] + H0m @ spart["umdot"] + S.T @ bias[:6]
    taum = H0m.T @ spart["u0dot"] + Hm @ spart["umdot"] + bias[6:]
    np.testing.assert_allclose(tau0, spart["tau0_id"], atol=1e-11)
    np.testing.assert_allclose(taum, spart["taum_id"], atol=1e-11)
