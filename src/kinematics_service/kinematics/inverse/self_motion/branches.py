"""
Branch switching where curves of solutions cross (Allgower and Georg, sections 8.1 and 8.3).

J is the derivative of a target's rows. At a simple bifurcation point J has two null vectors, the
columns of N, and one left null vector e. The tangents N a of the curves that cross there are the
roots of the quadratic form a^T N^T (e . J') N a = 0, where J' is the derivative of J. A step along
each root, both ways, leads to the next seeds.
"""

import numpy as np

from .... import kernel
from ....kernel import Floats

# Step of the central differences of J, rad or m: the cube root of the round-off of a double.
DIFFERENCE = 1e-5
# Step from the crossing to a seed on a curve, rad: half the first step of a curve that is traced.
STEP_TO_SEED = 0.01
# A singular value below this share of the largest is 0: Newton's method ends 1e-8 rad, the root of
# round-off, beside a singular solution.
SINGULAR = 1e-6


def near_crossing(point: kernel.CurvePoint, q: Floats) -> Floats:
    """Return joint positions (m, n) near the curves that cross at a singular solution (n,)."""
    e_left, _, null = np.linalg.svd(_jacobian(point, q))
    e, N = e_left[:, -1], null[-2:]
    ahead = [_jacobian(point, q + DIFFERENCE * way) for way in N]
    behind = [_jacobian(point, q - DIFFERENCE * way) for way in N]
    form = np.array([e @ (a - b) @ N.T for a, b in zip(ahead, behind)])
    # Eigenvalues of opposite signs have two real roots: a^2 low + b^2 high = 0 along the axes.
    (low, high), axes = np.linalg.eigh(0.5 * (form + form.T))
    if not low < 0.0 < high:
        return np.empty((0, len(q)))
    root = np.sqrt([high, -low]) / np.sqrt(high - low)
    tangents = [(axes @ (root * signs)) @ N for signs in ((1.0, 1.0), (1.0, -1.0))]
    return q + STEP_TO_SEED * np.array([*tangents, *(-one for one in tangents)])


def _jacobian(point: kernel.CurvePoint, q: Floats) -> Floats:
    J = np.empty((len(q) - 1, len(q)))
    kernel.write_derivative(point, np.ascontiguousarray(q), J)
    return J


def null_vectors(point: kernel.CurvePoint, q: Floats) -> Floats:
    """Return orthonormal null vectors (k, n) of J at a solution (n,): one where it is regular."""
    _, sigma, null = np.linalg.svd(_jacobian(point, q))
    return np.asarray(null[np.count_nonzero(sigma > SINGULAR * sigma[0]) :])
