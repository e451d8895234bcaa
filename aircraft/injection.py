"""Makes a JSBSim model with the autopilot inside, for the time of loading it."""

from __future__ import annotations

import os
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator
from contextlib import contextmanager
from functools import lru_cache
from importlib.resources import files
from pathlib import Path
from tempfile import TemporaryDirectory

from aircraft.actuators.actuator import NormActuator
from aircraft.actuators.components import insert
from aircraft.deviation import AS_MODELLED, Deviation, deviate

THROTTLE = "fcs/throttle-cmd-norm"
ESTIMATED = {
    "attitude/phi-rad": "velocities/phidot-rad_sec",
    "attitude/theta-rad": "velocities/thetadot-rad_sec",
    "velocities/vtrue-fps": None,
    "velocities/h-dot-fps": None,
    "position/h-sl-ft": None,
}
"""What the autopilot reads of the state that its navigation estimates, and the gyro that tells how it changes."""


@contextmanager
def with_autopilot(
    model: Path,
    actuators: tuple[tuple[str, NormActuator], ...] = (),
    deviation: Deviation = AS_MODELLED,
    latency: tuple[float, int] = (0.0, 0),
) -> Iterator[Path]:
    """Derives an aircraft folder whose model starts with the autopilot system.

    The other files of the model are linked, so that references from the model resolve as before.

    Yields:
        A folder that holds <name>/<name>.xml, gone when the context ends.

    Raises:
        ValueError: if the model is not well-formed XML or not a JSBSim model.
    """
    try:
        with_system = _with_system(model.read_bytes(), actuators, deviation, latency)
    except ElementTree.ParseError as error:
        raise ValueError(f"{model} is not well-formed XML: {error}") from None
    except _NoModel as error:
        raise ValueError(f"{model} is not a JSBSim model: {error}") from None
    with TemporaryDirectory(prefix="wayproof-") as folder:
        derived = Path(folder, model.stem)
        derived.mkdir()
        for item in model.resolve().parent.iterdir():
            if item.name != model.name:
                os.symlink(item, derived / item.name)
        (derived / model.name).write_bytes(with_system)
        yield Path(folder)


class _NoModel(ValueError):
    """XML that is no JSBSim model."""


@lru_cache(maxsize=8)
def _with_system(
    model: bytes,
    actuators: tuple[tuple[str, NormActuator], ...],
    deviation: Deviation,
    latency: tuple[float, int],
) -> bytes:
    """The XML of a model that starts with the autopilot system, writes no files of its own and listens to nobody."""
    root = ElementTree.fromstring(model)
    if root.tag != "fdm_config":
        raise _NoModel(f"its root element is <{root.tag}>, not <fdm_config>")
    system = ElementTree.fromstring(files("aircraft").joinpath("systems", "autopilot.xml").read_bytes())
    if deviation.any:
        deviate(root, deviation)
    engines = len(root.findall("propulsion/engine"))
    for component in system.iter("fcs_function"):
        if any(output.text == THROTTLE for output in component.findall("output")):
            for index in range(1, engines):
                ElementTree.SubElement(component, "output").text = f"{THROTTLE}[{index}]"
    insert(system, dict(actuators))
    if latency[1]:
        _age(system, *latency)
    # A model's own output would leave files where the command was given; its input would listen on the network.
    for port in (*root.findall("output"), *root.findall("input")):
        root.remove(port)
    # Systems run in document order: commands before whatever of the model reads them.
    root.insert(0, system)
    derived: bytes = ElementTree.tostring(root, encoding="utf-8", xml_declaration=True)
    return derived


def _age(system: ElementTree.Element, latency_s: float, steps: int) -> None:
    """Has the autopilot read an older attitude, airspeed, height and climb.

    Gyros are new: the attitude is that of then and what the rate of now makes of it since.
    """
    channel = ElementTree.Element("channel", name="measured")
    for name, rate in ESTIMATED.items():
        old = f"wayproof/measured/{name.rpartition('/')[2]}"
        for each in system.iter():
            if each.text and each.text.strip() == name:
                each.text = old if rate is None else f"{old}-now"
        sensor = ElementTree.SubElement(channel, "sensor", name=old)
        ElementTree.SubElement(sensor, "input").text = name
        ElementTree.SubElement(sensor, "delay", type="frames").text = str(steps + 1)  # one is now
        if rate is not None:
            channel.append(
                ElementTree.fromstring(
                    f"""<fcs_function name="{old}-now"><function><sum><property>{old}</property>
                    <product><value>{latency_s!r}</value><property>{rate}</property></product>
                    </sum></function></fcs_function>"""
                )
            )
    system.insert([each.tag for each in system].index("channel"), channel)
