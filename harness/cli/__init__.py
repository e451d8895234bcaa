"""The command `wayproof`: its commands, and what a person sees of them on a terminal."""
