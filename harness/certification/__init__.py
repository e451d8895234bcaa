"""How often a claim holds over the days that a scenario describes, with confidence bounds."""
