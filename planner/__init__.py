"""Local path planners for unknown environments; knows only what a sensor has returned."""
