"""Make every sample again from its scene:  python data/samples/make.py [NAME ...]

NAME.toml with a [camera] becomes NAME.mp4 and NAME.truth.csv; steel_bob.csv is simulated with noise of a known seed;
pendulum.theta.csv is what our own tracker measures on pendulum.mp4.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parents[1]))

from toolkit import Scene, ThetaSeries, calibrate, render, simulate, track  # noqa: E402

SIGMA_RAD, RATE_HZ, LENGTH_S, SEED = 1e-3, 20, 300, 1


def make_clip(name: str) -> None:
    """Render NAME.toml."""
    render(Scene.from_toml(HERE / f"{name}.toml"), HERE / f"{name}.mp4")


def make_steel_bob() -> None:
    """Simulate, add Gaussian noise, and keep its σ in the file."""
    scene = Scene.from_toml(HERE / "steel_bob.toml")
    t_s = np.arange(LENGTH_S * RATE_HZ) / RATE_HZ
    noise = SIGMA_RAD * np.random.default_rng(SEED).standard_normal(t_s.size)
    theta = np.round(simulate(scene, t_s).theta_rad + noise, 6)
    ThetaSeries(t_s, theta, np.full(t_s.size, SIGMA_RAD)).to_csv(HERE / "steel_bob.csv")


def make_pendulum_theta() -> None:
    """Track pendulum.mp4 and keep θ(t) with its error bars."""
    calibrate(track(HERE / "pendulum.mp4")).to_csv(HERE / "pendulum.theta.csv")


MAKERS = {
    "pendulum": lambda: make_clip("pendulum"),
    "classroom": lambda: make_clip("classroom"),
    "steel_bob": make_steel_bob,
    "pendulum.theta": make_pendulum_theta,
}

if __name__ == "__main__":
    for name in sys.argv[1:] or MAKERS:
        MAKERS[name]()
        print(name)
