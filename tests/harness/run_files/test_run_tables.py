"""Tables of a run are written without pandas and pyarrow's functions, which take longer to import than to write."""

import subprocess
import sys


def test_tables_bring_neither_in() -> None:
    code = """if True:
        import sys
        import numpy as np
        from harness.flight.record import AcceptedPlan
        from harness.run_files.run_tables import plan_rows, plans_table
        from planner.interface import Path, Plan, PlanStatus
        path = Path(np.array([[0.0, 0.0, 0.0, 1.0, 0.0, 50.0]]))
        plan = Plan(PlanStatus.FOUND, "straight on: café ✓", np.array([[0.0, 50.0]]), path)
        table = plans_table([AcceptedPlan(0, 1.5, 2.5, plan)])
        assert {"pandas", "pyarrow.compute"}.isdisjoint(sys.modules)
        row, = plan_rows(table)
        assert (row.plan_index, row.time_s, row.reason, row.loiter) == (0, 1.5, "straight on: café ✓", False)
        assert row.segments.tolist() == path.segments.tolist()
        assert row.path_m[-1].tolist() == [0.0, 50.0]
    """
    subprocess.run([sys.executable, "-c", code], check=True)
