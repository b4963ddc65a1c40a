"""The replay and the report of a capture that was planned from observation, from a made-up run folder."""

from __future__ import annotations

import json

import numpy as np
import pytest
import xarray as xr
from capture_runs import SAMPLES, motion_dataset, scan_dataset
from page_tables import tables_of

from jffsr.study.config import dump_config, load_config
from jffsr.study.dataset import save_dataset
from jffsr.viz.replay.reading import replays_of
from jffsr.viz.report.report import run_report

CONFIG = "configs/capture/observed_box.yaml"
OFF = 0.05
"""m, from the predicted grasp point to the true one."""


@pytest.fixture(scope="module")
def observed(tmp_path_factory):
    """The folder of a finished capture whose prediction is off by OFF along x."""
    folder = tmp_path_factory.mktemp("observed")
    (folder / "config.yaml").write_text(dump_config(load_config(CONFIG)))
    scan, motion = scan_dataset(), motion_dataset(7)
    true = motion["grasp_error"].values.copy()
    true[:, 0] -= OFF
    dataset = xr.merge([scan, motion], combine_attrs="override").assign(
        base_twist=(("time", "twist"), np.zeros((SAMPLES, 6))),
        true_grasp_position=motion["grasp_position"] + [OFF, 0.0, 0.0],
        true_grasp_error=(("time", "error"), true),
        clearance=(("pair", "time"), np.full((2, SAMPLES), 0.05)),
    )
    dataset = dataset.assign_coords(pair=["hand and target", "link3 and target"])
    texts = {name: {"dtype": "S1"} for name, values in dataset.variables.items() if values.dtype.kind == "U"}
    save_dataset(dataset, folder / "result.nc", texts)
    summary = {
        "kind": "capture",
        "name": "observed_box",
        "robot": "servicer_7dof",
        "result": {"code": 0, "name": "captured", "sentence": "captured"},
        "notes": [],
        "cost": 0.1,
        "cost_before": None,
        "terms": {"base_disturbance": {"value": 0.1, "weighted": 0.1}},
        "grasp": "handle",
        "grasp_time": {"sentence": "grasp 'handle' at 20 s"},
        "duration": 20.0,
        "grasp_error": dict.fromkeys(
            ("position_m", "attitude_rad", "linear_velocity_m_s", "angular_velocity_rad_s"), 0.0
        ),
        "attempts": 1,
        "evaluations": {"objective": 0, "gradient": 5},
        "seconds": {"total": 1.0, "compile": 0.5},
        "verification": {
            "attitude_difference_rad": 1e-9,
            "position_difference_m": 1e-9,
            "momentum_drift_relative": 1e-9,
            "constraints": {"grasp_match": {"violation": 1e-8, "tolerance": 1e-6}},
        },
        "observation": {"exposures": 1601, "seen": 1535, "filtered": 1440, "used": 1402, "lost": False},
        "front": None,
    }  # fmt: skip
    (folder / "summary.json").write_text(json.dumps(summary))
    return folder


def test_the_replay_shows_the_predicted_and_the_true_grasp(observed):
    (replay,) = replays_of(observed)
    ways = {way.name: way.points for way in replay.ways}
    apart = ways["true grasp point's way"] - ways["grasp point's way"]
    np.testing.assert_allclose(apart, np.tile([OFF, 0.0, 0.0], (replay.frames, 1)), atol=1e-12)
    (panel,) = [panel for panel in replay.panels if panel.title == "tool from the grasp"]
    assert set(panel.curves) == {
        f"{what}, {which}" for what in ("position", "attitude") for which in ("predicted", "true")
    }
    # The tool comes to the predicted point, and so ends beside the true one.
    assert panel.curves["position, predicted"][-1] < 1e-6
    assert panel.curves["position, true"][-1] == pytest.approx(OFF)
    assert any("where the filter predicts it" in line for line in replay.legend)
    assert any("red at 0.02 m" in line for line in replay.legend)


def test_the_target_stands_where_it_is_and_is_coloured_by_its_distance(observed):
    (replay,) = replays_of(observed)
    (target,) = [solid for solid in replay.solids if solid.name == "target"]
    np.testing.assert_allclose(target.position, np.tile([2.3, 0.1, -1.0], (replay.frames, 1)))
    # 0.03 m beyond the margin, of the 0.2 m from where on bodies are near.
    np.testing.assert_allclose(target.nearness, 0.85)


def test_the_report_of_an_observed_capture_has_the_camera_and_the_constraints(observed):
    rows = [row for table in tables_of(run_report(observed, ())) for row in table]
    assert ["observation, camera, rate", "10", "Hz"] in rows
    assert ["grasp match", "1e-08", "1e-06", "–"] in rows
    assert ["target, mass", "300", "kg"] in rows
