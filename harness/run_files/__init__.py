"""The run folder, and paths in and out of other tools' files; a path that cannot be flown is an InputError."""
