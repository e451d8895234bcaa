"""Guidance: laws that follow a route by commanding roll, one module a law, and the protocol that they share."""
