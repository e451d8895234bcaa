"""The rolling-window planner of the paper, made safe and convergent."""
