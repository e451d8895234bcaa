"""The front door in Python: what `import wayproof` offers. See `harness/README.md`."""
