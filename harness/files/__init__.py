"""Files: strict YAML, locks, whole-file writes, errors, versions."""
