"""Servos as components of a JSBSim system, put between the autopilot's commands and the aircraft.

The command goes through JSBSim's `<actuator>`. What that is given is the command less that of the trim, so that a
deadband lies about the trim.
"""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from collections.abc import Mapping

from aircraft.actuators.actuator import NormActuator

LIMITED_SHARE = 0.999
"""A servo that moves by this share of the most it can in a step is at its rate limit."""


def insert(system: ElementTree.Element, actuators: Mapping[str, NormActuator]) -> None:
    """Puts actuators between the autopilot's commands and the aircraft.

    Each counts at `wayproof/<control>-limited` the steps in which it was at its rate limit.
    """
    for control, actuator in actuators.items():
        name = f"wayproof/{control}-norm"
        channel, component = next(
            (each, part) for each in system.findall("channel") for part in each if part.get("name") == name
        )
        outputs = component.findall("output")
        for output in outputs:
            component.remove(output)
        after = list(channel).index(component) + 1
        for part in reversed(_components(control, actuator, outputs)):
            channel.insert(after, part)


def _components(
    control: str, actuator: NormActuator, outputs: list[ElementTree.Element]
) -> list[ElementTree.Element]:
    asked, servo, before = (f"wayproof/{control}-{each}-norm" for each in ("asked", "servo", "before"))
    trim, moved = f"wayproof/trim/{control}-norm", f"fcs/{control}-cmd-norm"
    least = 0 if control == "throttle" else -1
    lag = f"<lag>{1.0 / actuator.lag_s!r}</lag>" if actuator.lag_s else ""
    rate = actuator.rate_limit_1ps
    limit = "" if rate is None else f"<rate_limit>{rate!r}</rate_limit>"
    band = f"<deadband_width>{actuator.deadband!r}</deadband_width>" if actuator.deadband else ""
    parts = [
        f"""<fcs_function name="{before}"><function><property>{servo}</property></function></fcs_function>""",
        f"""<fcs_function name="{asked}"><function><product><property>wayproof/enable</property>
        <difference><property>wayproof/{control}-norm</property><property>{trim}</property></difference>
        </product></function></fcs_function>""",
        f"""<actuator name="{servo}"><input>{asked}</input>{lag}{limit}{band}</actuator>""",
        f"""<fcs_function name="wayproof/{control}-moved-norm"><function><ifthen>
        <property>wayproof/enable</property>
        <sum><property>{trim}</property><property>{servo}</property></sum>
        <property>{moved}</property>
        </ifthen></function><clipto><min>{least}</min><max>1</max></clipto></fcs_function>""",
    ]
    if rate is not None:
        parts.append(
            f"""<fcs_function name="wayproof/{control}-limited"><function><sum>
            <property>wayproof/{control}-limited</property>
            <product><property>wayproof/enable</property><ge>
            <abs><difference><property>{servo}</property><property>{before}</property></difference></abs>
            <product><property>simulation/dt</property><value>{LIMITED_SHARE * rate!r}</value></product>
            </ge></product></sum></function></fcs_function>"""
        )
    made = [ElementTree.fromstring(part) for part in parts]
    made[3].extend(outputs)
    return made
