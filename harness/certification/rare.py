"""The probability of a rare failure by importance sampling over days.

A day is a point of a standard normal distribution, one number for each quantity that is drawn, and a seed. A first
pass climbs to the failures: at each level of severity the less severe half gives way to copies of the others, and all
take steps that leave the distribution of days above the level unchanged (subset simulation: Au and Beck, Probabilistic
Engineering Mechanics 16, 2001). It does not count. Then days are drawn from a mixture of the true distribution and of
Gaussians about the days of that pass, and each counts with the ratio of the true density to that of the mixture
(Owen and Zhou, Journal of the American Statistical Association 95, 2000). The mean is an unbiased estimate, whatever
the first pass found; no day counts for more than 1 / `TRUE_SHARE`. Failures far from all those days are met only
by the share that is drawn from the true distribution: the interval, Student's, does not know what it has not seen.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final, TypeAlias

import numpy as np

from harness.certification.bounds import clopper_pearson
from harness.flight.record import FloatArray

PARTICLES: Final = 100
KEPT: Final = 0.3
"""Share of the days above the next level in the first pass."""
ENOUGH: Final = 0.5
"""The first pass ends once this share of its days fails."""
ACCEPTED: Final = (0.25, 0.45)
"""Below the first share of accepted steps their size is made smaller, above the second larger."""
MOVES: Final = 2
"""Steps of every day at each level of the first pass."""
SEED_SHARE: Final = 0.5
"""Share of the steps that draw the seed anew."""
MOST_LEVELS: Final = 40
DRAWN: Final = 1000
"""Days that count."""
TRUE_SHARE: Final = 0.2
"""Share of them that is drawn from the true distribution."""
VARIANCE: Final = 0.5
"""Of the Gaussians about the days of the first pass; that of the true distribution is 1."""


@dataclass(frozen=True, eq=False)
class Point:
    """A day.

    Attributes:
        normal: (n,) standard normal numbers, one for each quantity that is drawn.
        seed: of all that is random in the flight.
    """

    normal: FloatArray
    seed: int


Severity: TypeAlias = Callable[[Sequence[Point]], Sequence[float]]
"""Flies days and says how near to failing each came; infinity where it failed."""


@dataclass(frozen=True)
class Estimate:
    """The probability of a failure.

    Attributes:
        probability: unbiased.
        low: lower bound.
        high: upper bound, each at the confidence asked for.
        flights: how many were flown.
    """

    probability: float
    low: float
    high: float
    flights: int


def rare(severity: Severity, keys: int, seed: int, confidence: float) -> Estimate:
    """Estimates the probability of a failure.

    Args:
        severity: flies days; called with all days that can be flown at a time.
        keys: number of quantities that are drawn.
        seed: root of all random numbers.
        confidence: of each bound by itself.
    """
    flights = 0

    def counted(points: Sequence[Point]) -> FloatArray:
        nonlocal flights
        flights += len(points)
        return np.array(severity(points), dtype=np.float64)

    rng = np.random.default_rng(seed)
    centres = _climbed(counted, rng, keys)
    points, weights = _drawn(rng, keys, centres)
    counts = weights * np.isposinf(counted(points))
    mean, error = float(counts.mean()), float(counts.std(ddof=1)) / math.sqrt(DRAWN)
    if not mean:
        return Estimate(0.0, 0.0, 1.0 - clopper_pearson(len(points), len(points), confidence)[0], flights)
    return Estimate(mean, *_interval(counts, mean, error, confidence), flights)


def _interval(counts: FloatArray, mean: float, error: float, confidence: float) -> tuple[float, float]:
    """Both bounds of a mean of skewed numbers, on a logarithmic scale.

    Degrees of freedom are Kish's effective number of failures less one: few heavy ones make wide bounds.
    """
    from scipy import special

    effective = float(counts.sum() ** 2 / (counts**2).sum())
    quantile = float(special.stdtrit(max(effective - 1.0, 0.5), confidence))
    spread = math.exp(quantile * error / mean)
    return mean / spread, min(1.0, mean * spread)


def _drawn(rng: np.random.Generator, keys: int, centres: FloatArray) -> tuple[list[Point], FloatArray]:
    """Days that count, and the ratio of their true density to that from which they were drawn."""
    share = TRUE_SHARE if len(centres) else 1.0
    normals = rng.standard_normal((DRAWN, keys))
    seeds = rng.integers(2**53, size=DRAWN).tolist()
    if len(centres) and keys:
        about = rng.random(DRAWN) >= share
        chosen = centres[rng.integers(len(centres), size=DRAWN)]
        normals = np.where(about[:, None], chosen + math.sqrt(VARIANCE) * normals, normals)
        apart = ((normals[:, None, :] - centres[None]) ** 2).sum(axis=2) / VARIANCE
        logs = 0.5 * ((normals**2).sum(axis=1)[:, None] - apart - keys * math.log(VARIANCE))
        weights = 1.0 / (share + (1.0 - share) * np.exp(logs).mean(axis=1))
    else:
        weights = np.ones(DRAWN)
    return [Point(*each) for each in zip(normals, seeds, strict=True)], weights


Counted: TypeAlias = Callable[[Sequence[Point]], FloatArray]


@dataclass
class _Particles:
    """Days that are moved on together.

    Attributes:
        rng: draws all that is random about them.
        points: the days.
        severities: of each.
    """

    rng: np.random.Generator
    points: list[Point]
    severities: FloatArray

    def select(self, level: float) -> float:
        """Replaces the days that are not above a level by copies of those that are; returns the share of these."""
        above = np.flatnonzero(self.severities > level)
        below = np.flatnonzero(self.severities <= level)
        if len(above):
            for place, parent in zip(below, self.rng.choice(above, len(below)), strict=True):
                self.points[place], self.severities[place] = self.points[parent], self.severities[parent]
        return len(above) / len(self.points)

    def move(self, severity: Counted, level: float, size: float) -> float:
        """Lets every day take a step that stays above the level; returns the share that could."""
        moved = [self._step(point, size) for point in self.points]
        found = severity(moved)
        accepted = found > level
        for place in np.flatnonzero(accepted):
            self.points[place], self.severities[place] = moved[place], found[place]
        return float(accepted.mean())

    def _step(self, point: Point, size: float) -> Point:
        """A step of a size from 0 to 1 (an independent day) that leaves the distribution of days unchanged."""
        fresh = _independent(self.rng, len(point.normal))
        normal = math.sqrt(1.0 - size * size) * point.normal + size * fresh.normal
        keeps = len(point.normal) and self.rng.random() >= SEED_SHARE
        return Point(normal, point.seed if keeps else fresh.seed)


def _independent(rng: np.random.Generator, keys: int) -> Point:
    return Point(rng.standard_normal(keys), int(rng.integers(2**53)))


def _climbed(severity: Counted, rng: np.random.Generator, keys: int) -> FloatArray:
    """(n, keys) days of the first pass, from every level: those that fail, and those on the way there."""
    found: list[FloatArray] = []
    points = [_independent(rng, keys) for _ in range(PARTICLES)]
    particles = _Particles(rng, points, severity(points))
    size = 1.0
    for _ in range(MOST_LEVELS):
        failed = np.isposinf(particles.severities)
        level = float(np.quantile(particles.severities, 1.0 - KEPT, method="lower"))
        level = min(level, float(np.max(particles.severities[~failed], initial=-math.inf)))
        if failed.mean() >= ENOUGH or not (particles.severities > level).any():
            break
        particles.select(level)
        for _ in range(MOVES):
            accepted = particles.move(severity, level, size)
            size *= 0.6 if accepted < ACCEPTED[0] else 1.3 if accepted > ACCEPTED[1] else 1.0
            size = min(size, 1.0)
        found += [each.normal for each in particles.points]
    return np.array(found).reshape(-1, keys)
