"""Units of the numbers in summaries and configurations, which carry them in their names or nowhere."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

_ENDINGS = {
    "_rad_s": "rad/s",
    "_m_s": "m/s",
    "_rad": "rad",
    "_deg": "deg",
    "_kg": "kg",
    "_m": "m",
    "_s": "s",
    "_relative": "relative",
}
_NAMES = {
    "momentum_drift": "N s, N m s",
    "boundary_error": "rad or m, s",
    "duration": "s",
    "window": "s",
    "time": "s",
    "predicted_to": "s",
    "settled": "s",
    "period": "s",
    "base_position": "m",
    "position": "m",
    "velocity": "m/s",
    "linear_velocity": "m/s",
    "angular_velocity": "rad/s",
    "linear_momentum": "N s",
    "angular_momentum": "N m s",
    "linear_impulse": "N s",
    "angular_impulse": "N m s",
    "energy_lost": "J",
    "mass": "kg",
    "inertia": "kg m^2",
    "base_quaternion": "w, x, y, z",
    "quaternion": "w, x, y, z",
    "goal_attitude": "w, x, y, z",
    "angles": "rad",
    "base_rate": "rad/s",
    "largest_base_rate": "rad/s",
    "turned": "rad",
    "peak_rate": "rad/s",
    "base_excursion": "rad",
    "margin": "m",
    "attitude_difference": "rad",
    "position_difference": "m",
    "tool_attitude_difference": "rad",
    "tool_position_difference": "m",
    "attitude_error": "rad",
    "position_error": "m",
    "end_attitude_error": "rad",
    "end_position_error": "m",
    "position_peak": "m",
    "position_rms": "m",
    "position_end": "m",
    "attitude_peak": "rad",
    "attitude_rms": "rad",
    "attitude_end": "rad",
    "position_overrun": "relative",
    "rate_overrun": "relative",
    "acceleration_overrun": "relative",
    "largest_overrun": "relative",
}
_PLACES = {
    "hold.rate": "Hz",
    "hold.gains.rate": "",
    "hold.gains.position": "",
    "hold.excitation.amplitude": "rad/s",
    "hold.excitation.slowest": "Hz",
    "hold.excitation.fastest": "Hz",
    "hold.sensors.gyro": "rad/s",
    "hold.sensors.encoder": "rad or m",
    "hold.sensors.rate": "rad/s or m/s",
    "constraints.clearance.tolerance": "m",
    "constraints.final_attitude.tolerance": "rad",
    "task.duration.min": "s",
    "task.duration.max": "s",
    "target.shapes.size": "m",
    "path.blend_radius": "m",
    "observation.camera.rate": "Hz",
    "observation.camera.delay": "s",
    "observation.camera.position_deviation": "m",
    "observation.prior.angular_velocity_deviation_deg": "deg/s",
    "observation.prior.velocity_deviation": "m/s",
    "observation.prior.offset_deviation": "m",
    "observation.convergence.angular_velocity_deg": "deg/s",
}
NO_UNIT = "–"


def name_and_unit(path: str) -> tuple[str, str]:
    """A number's name in words, its way down a tree parted by dots, and its unit; no unit is an empty text.

    An ending such as `_m` is a unit and is taken off, of whichever part of the way has it.
    """
    parts, unit = path.split("."), ""
    for place, part in enumerate(parts):
        for ending, found in _ENDINGS.items():
            if part.endswith(ending):
                parts[place], unit = part.removesuffix(ending), found
                break
    plain = ".".join(part for part in path.split(".") if not part.isdecimal())
    unit = _PLACES[plain] if plain in _PLACES else unit or _NAMES.get(plain.rpartition(".")[2], "")
    return ", ".join(part.replace("_", " ") for part in parts), unit


def term_unit(name: str, term: Mapping[str, Any]) -> str:
    """The unit of a term's value, of a tracking error by its name; a dash where the summary says none."""
    return term.get("unit") or name_and_unit(name)[1] or NO_UNIT
