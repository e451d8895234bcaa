"""An agent that does well enough: towards the goal, and away from what is near ahead."""

from typing import Any

import gymnasium
import numpy as np


def flown(env: gymnasium.Env[Any, Any], seed: int, blind: bool = False) -> tuple[int, float, dict[str, Any]]:
    """Steps, total reward and the last info of an episode; blind: whatever the scan shows."""
    beams = env.observation_space["scan"].shape[0]  # type: ignore[index]
    angle = np.linspace(-np.pi, np.pi, beams, endpoint=False)
    away = -np.stack([np.sin(angle), np.cos(angle)])
    seen, info = env.reset(seed=seed)
    steps, total, over = 0, 0.0, False
    while not over:
        right, ahead = seen["state"][[2, 1]] + (0.0 if blind else 0.5 * away @ (1.0 - seen["scan"]) ** 4)
        seen, reward, ended, cut, info = env.step(np.clip([right, ahead], -1.0, 1.0).astype(np.float32))
        steps, total, over = steps + 1, total + float(reward), ended or cut
    return steps, total, info
