"""Slow numpy versions of how signs and lengths of limbs are judged: every choice of signs is tried."""

from itertools import product

import numpy as np


def depth_sizes(planar, length):
    """What a limb of ``length`` that is drawn ``planar`` long has along the view."""
    return np.sqrt(np.maximum(np.square(length) - np.square(planar), 0))


def depth_variance(planar, noise, length):
    """Variance of the depth by that of the drawn length: (noise planar / depth)^2, bounded near the picture plane."""
    least = np.maximum(2 * noise * length, 1e-12)
    return (noise * planar) ** 2 / np.maximum(np.maximum(np.square(length) - np.square(planar), 0), least)


def sign_cost(depths, variance, clip, jolt, doubt):
    """The clip's errors, capped, and pseudo-Huber jolts."""
    cost = np.sum(np.minimum((depths - clip) ** 2 / (doubt**2 + variance), 4))
    spread = jolt_spread(variance, jolt)
    return cost + np.sum(2 * (np.sqrt(1 + np.diff(depths, 2) ** 2 / spread) - 1))


def jolt_spread(variance, jolt):
    """Variance of a second difference: motion's own, and half of what independent marks would give."""
    return jolt**2 + 0.5 * (variance[2:] + 4 * variance[1:-1] + variance[:-2])


def best_depths(planar, clip, noise, jolt, doubt, length):
    """The depths of least cost among all choices of signs, and that cost."""
    sizes, variance = depth_sizes(planar, length), depth_variance(planar, noise, length)
    choices = [sizes * signs for signs in product([-1, 1], repeat=len(planar))]
    costs = [sign_cost(depths, variance, clip, jolt, doubt) for depths in choices]
    return choices[int(np.argmin(costs))], min(costs)


def length_cost(planar, clip, noise, jolt, doubt, length):
    """Minus twice the log likelihood of the drawn lengths: depths' cost, its normaliser, and the slope of the change
    of variables from drawn length to depth; drawn lengths beyond the limb's are outliers at 3 deviations."""
    length = np.broadcast_to(length, np.shape(planar)).astype(float)
    cost = best_depths(planar, clip, noise, jolt, doubt, length)[1]
    cost += 0.7 * np.sum(np.log(jolt_spread(depth_variance(planar, noise, length), jolt) / jolt**2))
    error = np.maximum(noise, 0.003 * length)
    cost += np.sum(np.minimum((np.maximum(planar - length, 0) / error) ** 2, 9))
    return cost + np.sum(np.log(np.maximum(1 - (planar / length) ** 2, 2 * error / length)))
