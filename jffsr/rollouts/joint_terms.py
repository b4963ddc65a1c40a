"""What the base's attitude needs of the joints, for a whole time grid at once.

Resolved in the base frame, the locked inertia I_B(q) about the system centre of mass and the angular
momentum h_B(q, qd) that the joints carry with the base held do not depend on the attitude:
w_B = I_B^-1 (R' L - h_B). So they are evaluated for every grid point in one go, outside the integration: by
`hot_path`, or by `plain_path`, which reads like the textbook.
"""

from __future__ import annotations

from dataclasses import dataclass

from jffsr.pytrees import register_dataclass
from jffsr.spatial.components import Components, Symmetric, subtract, symmetric_times


@register_dataclass
@dataclass(frozen=True)
class JointTerms:
    """Base-frame terms on a grid of G points; every component has shape (G,).

    inverse_inertia, 1/(kg m^2), of the locked inertia about the system centre of mass; joint_rate, rad/s,
    I_B^-1 h_B, the base rate that cancels the joints' momentum; com, m, and com_velocity, m/s, of the system
    centre of mass relative to the base.
    """

    inverse_inertia: Symmetric
    joint_rate: Components
    com: Components
    com_velocity: Components

    def base_rate(self, angular_momentum_B: Components) -> Components:
        """Angular velocity of the base in B, rad/s, under an angular momentum resolved in B."""
        return subtract(symmetric_times(self.inverse_inertia, angular_momentum_B), self.joint_rate)
