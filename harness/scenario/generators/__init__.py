"""Worlds drawn from a seed: what a campaign file names under `worlds`."""
