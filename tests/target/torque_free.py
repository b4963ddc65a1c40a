"""Torque-free rotation by Jacobi's elliptic functions in SciPy, sharing no code with the package."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from scipy.integrate import quad
from scipy.special import ellipj, ellipk


class EllipticRotation:
    """Body with principal moments J1 > J2 > J3 whose w2 is zero and w1, w3 positive at time zero (Landau, section 37).

    With L^2 > 2 E J2 (about axis 1) w1 = a1 dn, w2 = a2 sn, w3 = a3 cn; else (about axis 3) cn and dn change places.
    """

    def __init__(self, moments, first, third):
        self.moments = np.asarray(moments, dtype=float)
        j1, j2, j3 = self.moments
        self.start = np.array([first, 0.0, third])
        self.twice_energy = j1 * first**2 + j3 * third**2
        self.momentum = np.hypot(j1 * first, j3 * third)
        squared = self.momentum**2
        above, below = squared - self.twice_energy * j3, self.twice_energy * j1 - squared
        self.about_first = squared > self.twice_energy * j2
        if self.about_first:
            self.second = np.sqrt(below / (j2 * (j1 - j2)))
            self.rate = np.sqrt((j2 - j1) * (j3 - j1) / (j2 * j3)) * first
            self.m = below * (j2 - j3) / (above * (j1 - j2))
        else:
            self.second = np.sqrt(above / (j2 * (j2 - j3)))
            self.rate = np.sqrt((j1 - j3) * (j2 - j3) / (j1 * j2)) * third
            self.m = above * (j1 - j2) / (below * (j2 - j3))
        self.period = 4 * ellipk(self.m) / self.rate

    def angular_velocity(self, time):
        sn, cn, dn, _ = ellipj(self.rate * np.asarray(time), self.m)
        first, third = (dn, cn) if self.about_first else (cn, dn)
        # dw2/dt at time zero has the sign of (J3 - J1) w3 w1.
        return np.stack([self.start[0] * first, -self.second * sn, self.start[2] * third], axis=-1)

    def solid_angle(self):
        """Area on the unit sphere that the momentum's direction in the body sweeps in a period, seen from the axis
        that it goes round: the integral of (1 - cos) d(azimuth), signed as the azimuth turns."""
        axis = 0 if self.about_first else 2
        a, b = (axis + 1) % 3, (axis + 2) % 3

        def rate(time):
            w = self.angular_velocity(time)
            h = self.moments * w
            change = np.cross(h, w)
            azimuth = (h[a] * change[b] - h[b] * change[a]) / (h[a] ** 2 + h[b] ** 2)
            return (1 - h[axis] / self.momentum) * azimuth

        quarter = self.period / 4
        return sum(
            quad(rate, k * quarter, (k + 1) * quarter, epsabs=1e-13, epsrel=1e-13)[0] for k in range(4)
        )

    def precession(self, time):
        """Angle, rad, that the body's first axis, or third, turns about the momentum in `time`, by quadrature."""
        axis = 0 if self.about_first else 2
        a, b = (axis + 1) % 3, (axis + 2) % 3

        def rate(t):
            w = self.angular_velocity(t)
            h = self.moments * w
            return self.momentum * (h[a] * w[a] + h[b] * w[b]) / (h[a] ** 2 + h[b] ** 2)

        knots = np.append(np.arange(0, time, self.period / 4), time)
        return sum(quad(rate, x, y, epsabs=1e-13, epsrel=1e-13)[0] for x, y in pairwise(knots))
