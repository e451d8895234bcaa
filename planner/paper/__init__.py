"""The paper's planner and nothing else: *Real-time Path Planning In Completely Unknown Environment for UAV*.

The files in the paper's order:

* 2.1, equations (1) to (3); 2.2, cost of a track; 2.3, Definition 1 and Definition 2: `model`
* 3.2, M and N, fan-shaped sectors, equation (4), selection, refinement: `sectors`
* 3.2, Figure 1, flight along the guide vector or in a sector, and multi-step search: `multi_step_search`
* 3.2, route optimisation: `route_optimisation`
* 3.3, the rolling window: `rolling`

`config` has what the paper leaves open: its symbols as keys, with a default for each.
"""
