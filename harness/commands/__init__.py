"""The commands of `wayproof`, a file for those that belong together; `harness.cli` puts them under one name."""
