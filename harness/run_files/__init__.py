"""The run folder, and paths in and out of other tools' files."""
