"""A run in the files of other tools: missions, maps, tables, recordings."""
