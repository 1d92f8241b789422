"""A made-up identification problem whose truth and noise are known."""

import numpy as np

from ema.identification.noise import N_START, NoiseModel

N = 30
RNG = np.random.default_rng(5)
A = RNG.standard_normal((N, 6))
S = 1e-4 * np.eye(N)
LEVELS = np.array([0.1, 1.0]), np.array([0.3, 0.7]), np.zeros((2, 2, N, N))
NOISE = NoiseModel(S, *LEVELS, *np.zeros((2, N, N)), np.zeros((N, N_START)), np.ones(2))
