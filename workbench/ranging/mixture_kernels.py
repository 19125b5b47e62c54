"""Compiled loops of the posterior over shapes. Imported only inside functions: numba takes long to load."""

from __future__ import annotations

import math

import numpy as np

from workbench.model.arrays import FloatArray, IndexArray
from workbench.spots.kernels.compiled import compiled

NEGLIGIBLE = 1e-4
"""Weight of a component, relative to the largest, below which its closest range is not computed."""
GRID = 64
"""Steps of the search for the minimum of a polynomial of degree above 3; refined by a parabola."""
SEARCH_STEPS = 60
"""Largest number of steps of a quantile's search; it takes some 5."""
PRECISION = 1e-3
"""Of a quantile's probability, relative."""
MERGED = 0.3
"""Largest distance of merged nodes, in their deviations."""


@compiled
def _cholesky(matrix: FloatArray, size: int, root: FloatArray) -> bool:
    """Lower triangular root of the leading (size, size) block; False where it is not positive definite."""
    for i in range(size):
        for j in range(i + 1):
            total = matrix[i, j]
            for k in range(j):
                total -= root[i, k] * root[j, k]
            if i > j:
                root[i, j] = total / root[j, j]
            elif total > 0.0:
                root[i, i] = math.sqrt(total)
            else:
                return False
    return True


@compiled
def _back(root: FloatArray, size: int, vector: FloatArray) -> None:
    """Replace `vector` by the solution of root^T solution = vector."""
    for i in range(size - 1, -1, -1):
        for k in range(i + 1, size):
            vector[i] -= root[k, i] * vector[k]
        vector[i] /= root[i, i]


@compiled
def _forward(root: FloatArray, size: int, vector: FloatArray) -> None:
    """Replace `vector` by the solution of root solution = vector."""
    for i in range(size):
        for k in range(i):
            vector[i] -= root[i, k] * vector[k]
        vector[i] /= root[i, i]


@compiled
def _value(amplitudes: FloatArray, degree: int, t: float) -> float:
    """Sum of amplitudes[k] t^k, k from 1."""
    total = 0.0
    for k in range(degree, 0, -1):
        total = (total + amplitudes[k]) * t
    return total


@compiled
def lowest(amplitudes: FloatArray, degree: int) -> tuple[float, float]:
    """Smallest value of sum of amplitudes[k] t^k, k from 1, over t from -1 to 1, and its t."""
    at = -1.0 if _value(amplitudes, degree, -1.0) < _value(amplitudes, degree, 1.0) else 1.0
    value = _value(amplitudes, degree, at)
    inside = _searched(amplitudes, degree) if degree > 3 else _turn(amplitudes, degree)
    if -1.0 < inside < 1.0 and _value(amplitudes, degree, inside) < value:
        return _value(amplitudes, degree, inside), inside
    return value, at


@compiled
def _turn(amplitudes: FloatArray, degree: int) -> float:
    """Position t of the minimum of a polynomial of degree up to 3; 2 where there is none.

    It is the root of slope + 2 curvature t + 3 third t^2 at which the derivative of this is positive: there
    that derivative is 2 sqrt(discriminant).
    """
    if degree < 2:
        return 2.0
    slope, curvature = amplitudes[1], amplitudes[2]
    third = amplitudes[3] if degree > 2 else 0.0
    discriminant = curvature * curvature - 3.0 * third * slope
    if discriminant < 0.0:
        return 2.0
    root = math.sqrt(discriminant)
    if curvature >= 0.0:
        return -slope / (curvature + root) if curvature + root > 0.0 else 2.0
    return (root - curvature) / (3.0 * third) if third != 0.0 else 2.0


@compiled
def _searched(amplitudes: FloatArray, degree: int) -> float:
    """Position t of the smallest value inside the front, by a grid and a parabola through three values."""
    values = np.empty(GRID + 1)
    for i in range(GRID + 1):
        values[i] = _value(amplitudes, degree, 2.0 * i / GRID - 1.0)
    i = min(max(int(np.argmin(values)), 1), GRID - 1)
    bend = values[i - 1] - 2.0 * values[i] + values[i + 1]
    shift = 0.5 * (values[i - 1] - values[i + 1]) / bend if bend > 0.0 else 0.0
    return 2.0 * (i + min(max(shift, -1.0), 1.0)) / GRID - 1.0


@compiled
def posterior(
    t: FloatArray,
    estimate: FloatArray,
    depth: FloatArray,
    weight: FloatArray,
    chi2: FloatArray,
    degree: IndexArray,
    log_mass: FloatArray,
    mean: FloatArray,
    sd: FloatArray,
    nodes: FloatArray,
    counts: IndexArray,
    floor: float,
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Log evidence of C prior components, and nodes of the closest range.

    The parameters of degree d are theta = (a, amplitudes). Their likelihood is Gaussian about the fit:
    -2 log = chi2[d] + (theta - estimate[d])^T H (theta - estimate[d]). H = J^T weight[d] J, J the derivatives
    of the inverse depths. Given the amplitudes, a is Gaussian with the deviation 1 / sqrt(H[0, 0]), and so is
    the closest range; the amplitudes are nodes.

    Args:
        t: (n,) positions of the spots, in half fronts from the middle.
        estimate: (D + 1, D + 1) fit of each degree, mm, zeros beyond it.
        depth: (D + 1, n) fitted depths, mm.
        weight: (D + 1, n, n) inverse covariance of the inverse depths.
        chi2: (D + 1,) of the fits; NaN where there is none.
        degree: (C,) of each component.
        log_mass: (C,) log prior probability.
        mean: (C, D) mean of the amplitudes, mm.
        sd: (C, D) deviation of the amplitudes, mm.
        nodes: (D + 1, M, D) standard normal nodes for each degree.
        counts: (D + 1,) number of nodes of each degree.
        floor: smallest possible range, mm.

    Returns:
        log evidence (C,), -inf where there is none; (C, M) range of each node, mm; (C, M) its weight.
        (C,) Deviation given the amplitudes, mm. Nodes below the floor have weight 0; without these, the
        weights of a component sum to 1.
    """
    components, size = len(degree), estimate.shape[1]
    evidence = np.full(components, -np.inf)
    closest, share = np.zeros((components, nodes.shape[1])), np.zeros((components, nodes.shape[1]))
    own = np.ones(components)
    hessians = np.zeros((len(chi2), size, size))
    scale = np.empty(len(chi2))
    for d in range(len(chi2)):
        scale[d] = _hessian(t, depth[d], weight[d], d + 1, hessians[d]) if math.isfinite(chi2[d]) else 0.0
    root = np.zeros((size, size))
    roots, modes = np.zeros((components, size, size)), np.zeros((components, size))
    for c in range(components):
        d = degree[c]
        if not math.isfinite(chi2[d]):
            continue
        evidence[c] = (
            log_mass[c]
            + scale[d]
            + _evidence(estimate[d], hessians[d], chi2[d], mean[c], sd[c], d, root, modes[c])
        )
        roots[c] = root
        own[c] = 1.0 / root[0, 0]
    best = evidence.max()
    theta = np.empty(size)
    for c in range(components):
        d = degree[c]
        if not evidence[c] > best + math.log(NEGLIGIBLE):
            continue
        total = 0.0
        mirror = _mirror(roots[c], modes[c], d)
        for m in range(counts[d]):
            theta[0] = 0.0
            along = np.sum(mirror[:d] * nodes[d, m, :d])
            for k in range(d):
                theta[k + 1] = nodes[d, m, k] - 2.0 * along * mirror[k]
            _back(roots[c], d + 1, theta)
            for k in range(d + 1):
                theta[k] += modes[c, k]
            closest[c, m] = theta[0] + lowest(theta, d)[0]
            if closest[c, m] > floor:
                share[c, m] = 1.0 / counts[d]
                total += share[c, m]
        evidence[c] += math.log(total) if total > 0.0 else -np.inf
    return evidence, closest, share, own


@compiled
def _mirror(root: FloatArray, mode: FloatArray, degree: int) -> FloatArray:
    """Unit vector (degree,) of the reflection of the first node coordinate.

    It is turned to the direction in which the closest range varies, because it has the finest steps; zeros
    where it is that direction already.
    """
    gradient = np.ones(degree + 1)
    at = lowest(mode, degree)[1]
    for k in range(1, degree + 1):
        gradient[k] = gradient[k - 1] * at
    _forward(root, degree + 1, gradient)
    turned = gradient[1:].copy()
    length = math.sqrt(np.sum(turned * turned))
    if length > 0.0:
        turned /= length
    if degree > 0:
        turned[0] -= 1.0
    length = math.sqrt(np.sum(turned * turned))
    return turned / length if length > 1e-9 else np.zeros(degree)


@compiled
def _hessian(t: FloatArray, depth: FloatArray, weight: FloatArray, size: int, out: FloatArray) -> float:
    """Write H of the leading `size` parameters; returns half the log determinant of the weight."""
    n = len(t)
    powers = np.ones((n, size))
    for i in range(n):
        powers[i, 0] = 1.0 / (depth[i] * depth[i])
        for k in range(1, size):
            powers[i, k] = powers[i, k - 1] * t[i]
    for i in range(size):
        for j in range(i + 1):
            total = 0.0
            for k in range(n):
                for m in range(n):
                    total += powers[k, i] * weight[k, m] * powers[m, j]
            out[i, j] = total
            out[j, i] = total
    root = np.zeros((n, n))
    if not _cholesky(weight, n, root):
        return -np.inf
    return float(np.sum(np.log(np.diag(root))))


@compiled
def _evidence(
    estimate: FloatArray,
    hessian: FloatArray,
    chi2: float,
    mean: FloatArray,
    sd: FloatArray,
    degree: int,
    root: FloatArray,
    mode: FloatArray,
) -> float:
    """Log of the integral of likelihood times prior, without (2 pi)^(1/2).

    Writes the root of the posterior's inverse covariance, and the posterior's mean `mode`.
    """
    size = degree + 1
    total = hessian.copy()
    value = 0.0
    for i in range(size):
        mode[i] = 0.0
        for j in range(size):
            mode[i] += hessian[i, j] * estimate[j]
    for k in range(degree):
        precision = 1.0 / (sd[k] * sd[k])
        total[k + 1, k + 1] += precision
        mode[k + 1] += precision * mean[k]
        value -= math.log(sd[k])
    if not _cholesky(total, size, root):
        return -np.inf
    _forward(root, size, mode)
    _back(root, size, mode)
    misfit = chi2
    for i in range(size):
        value -= math.log(root[i, i])
        for j in range(size):
            misfit += (mode[i] - estimate[i]) * hessian[i, j] * (mode[j] - estimate[j])
    for k in range(degree):
        misfit += ((mode[k + 1] - mean[k]) / sd[k]) ** 2
    return value - 0.5 * misfit


@compiled
def quantiles(depth: FloatArray, sd: FloatArray, weight: FloatArray, probabilities: FloatArray) -> FloatArray:
    """Quantiles of a mixture of depths whose inverse depths are Gaussian, mm; they may be infinite.

    Args:
        depth: (m,) of each node, mm.
        sd: (m,) 1 sigma, mm.
        weight: (m,) of each node, 1 in total.
        probabilities: (p,) of a smaller depth.
    """
    depth, sd, weight = _merged(depth, sd, weight)
    inverse, slope = 1.0 / depth, depth * depth / sd
    low_start, high_start = 0.0, inverse.max() + 8.0 / slope.min()
    found = np.empty(len(probabilities))
    for i in range(len(probabilities)):
        if _below(inverse, slope, weight, 0.0)[0] < probabilities[i]:
            found[i] = np.inf
            continue
        low, high = low_start, high_start
        at = float(np.sum(weight * inverse))
        for _ in range(SEARCH_STEPS):
            below, density = _below(inverse, slope, weight, at)
            excess = below - probabilities[i]
            if abs(excess) < PRECISION * probabilities[i] * (1.0 - probabilities[i]):
                break
            if excess > 0.0:
                low = at
            else:
                high = at
            at += excess / density if density > 0.0 else np.inf
            if not low < at < high:
                at = 0.5 * (low + high)
        found[i] = 1.0 / at
    return found


@compiled
def _merged(
    depth: FloatArray, sd: FloatArray, weight: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Nodes of a mixture, those closer than `MERGED` of the smallest deviation merged; moments are kept."""
    order = np.argsort(depth)
    width = MERGED * sd.min()
    start, total = np.zeros(len(depth)), np.zeros(len(depth))
    mean, square = np.zeros(len(depth)), np.zeros(len(depth))
    last = -1
    for m in order:
        if last < 0 or depth[m] > start[last] + width:
            last += 1
            start[last] = depth[m]
        beyond = depth[m] - start[last]
        total[last] += weight[m]
        mean[last] += weight[m] * beyond
        square[last] += weight[m] * (beyond * beyond + sd[m] * sd[m])
    total, start = total[: last + 1], start[: last + 1]
    mean, square = mean[: last + 1] / total, square[: last + 1] / total
    return start + mean, np.sqrt(square - mean * mean), total


@compiled
def _below(inverse: FloatArray, slope: FloatArray, weight: FloatArray, at: float) -> tuple[float, float]:
    """Probability of a depth below 1 / at, and minus its derivative by `at`."""
    total, density = 0.0, 0.0
    for m in range(len(inverse)):
        z = (inverse[m] - at) * slope[m]
        total += weight[m] * 0.5 * math.erfc(-z * math.sqrt(0.5))
        density += weight[m] * slope[m] * math.exp(-0.5 * z * z) / math.sqrt(2.0 * math.pi)
    return total, density
