"""How the base is held while the joints move: not at all, in attitude, or altogether.

`floating`: no external force or torque acts, both momenta are conserved. `attitude_held`: reaction wheels or
thrusters in pairs keep the attitude and push nowhere, so that only linear momentum is conserved. `fixed`: the
base keeps its pose. The order of a twist, [linear; angular], makes the freedom of the base its first 6, 3 or
0 numbers.
"""

from __future__ import annotations

from jffsr.errors import InputError
from jffsr.reading.did_you_mean import hint

FLOATING, ATTITUDE_HELD, FIXED = "floating", "attitude_held", "fixed"
BASE_MODES = (FLOATING, ATTITUDE_HELD, FIXED)

_FREEDOM = {FLOATING: 6, ATTITUDE_HELD: 3, FIXED: 0}


def base_freedom(base_mode: str) -> int:
    """How many of the first numbers of the base twist are free: 6, 3 or 0; InputError for another name."""
    if base_mode not in _FREEDOM:
        raise InputError(
            f"base_mode is {base_mode!r}; allowed are {', '.join(BASE_MODES)}{hint(str(base_mode), BASE_MODES)}"
        )
    return _FREEDOM[base_mode]
