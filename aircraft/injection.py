"""Makes a JSBSim model with the autopilot, its servos and the latency of its state, while it is being loaded.

A command goes through JSBSim's `<actuator>`, which is given what differs from the trim: a deadband lies about the trim.
"""

from __future__ import annotations

import os
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import lru_cache
from importlib.resources import files
from pathlib import Path
from tempfile import TemporaryDirectory

from aircraft.actuators import NormActuator
from aircraft.deviation import AS_MODELLED, Deviation, deviate
from aircraft.model_files import ModelFiles, whole_model

THROTTLE = "fcs/throttle-cmd-norm"  # JSBSim's property of the throttle command
READ_LATE = {
    "attitude/phi-rad": "velocities/phidot-rad_sec",
    "attitude/theta-rad": "velocities/thetadot-rad_sec",
    "velocities/vtrue-fps": None,
    "velocities/h-dot-fps": None,
    "position/h-sl-ft": None,
}
"""Properties that the autopilot reads late, each with the rate of a gyro that carries the old value on, or None."""
LEAST_INERTIA = 1e-6  # slug ft2; JSBSim takes a smaller <ixx> of a propeller for this
LIMITED_SHARE = 0.999  # a servo that moves by this share of the most it can in a step is at its rate limit


@contextmanager
def with_autopilot(
    model: Path,
    actuators: tuple[tuple[str, NormActuator], ...] = (),
    deviation: Deviation = AS_MODELLED,
    latency: tuple[float, int] = (0.0, 0),
    engines: tuple[tuple[str, Path], ...] = (),
) -> Iterator[Path]:
    """Yields a folder with <name>/<name>.xml, the model with the autopilot, until the context ends.

    The other files of the model are linked, so that references from the model resolve as before, and its engines and
    propellers, by name, to where JSBSim looks first. `latency` is the age of the state that the autopilot reads, in s
    and in steps. ValueError: it is no well-formed JSBSim model.
    """
    try:
        with_system = _with_system(ElementTree.tostring(whole_model(model)), actuators, deviation, latency)
    except ElementTree.ParseError as error:
        raise ValueError(f"{model} is not well-formed XML: {error}") from None
    with TemporaryDirectory(prefix="wayproof-") as folder:
        derived = Path(folder, model.stem)
        derived.mkdir()
        links = {item.name: item for item in model.resolve().parent.iterdir() if item.name != model.name}
        if engines:
            links.pop("Engines", None)
            links |= {f"Engines/{name}": file.resolve() for name, file in engines}
        for name, item in links.items():
            (derived / name).parent.mkdir(parents=True, exist_ok=True)
            os.symlink(item, derived / name)
        (derived / model.name).write_bytes(with_system)
        yield Path(folder)


@contextmanager
def heavier(files: ModelFiles, factor: float) -> Iterator[ModelFiles]:
    """Yields a model with so many times the moments of inertia of its propellers, until the context ends."""
    if factor == 1.0:
        yield files
        return
    with TemporaryDirectory(prefix="wayproof-") as folder:
        for name, file in files.engines:
            engine = ElementTree.parse(file)
            for inertia in engine.iter("ixx"):
                inertia.text = repr(factor * max(float(inertia.text or 0.0), LEAST_INERTIA))
            engine.write(Path(folder, name))
        yield replace(files, engines=tuple((name, Path(folder, name)) for name, _ in files.engines))


@lru_cache(maxsize=8)
def _with_system(
    model: bytes,
    actuators: tuple[tuple[str, NormActuator], ...],
    deviation: Deviation,
    latency: tuple[float, int],
) -> bytes:
    """The XML of a model that starts with the autopilot system, writes no files of its own and listens to nobody."""
    if (root := ElementTree.fromstring(model)).tag != "fdm_config":
        raise ValueError(f"it is not a JSBSim model: its root element is <{root.tag}>, not <fdm_config>")
    system = ElementTree.fromstring(files("aircraft").joinpath("systems", "autopilot.xml").read_bytes())
    if deviation != AS_MODELLED:
        deviate(root, deviation)
    for component in system.iter("fcs_function"):
        if any(output.text == THROTTLE for output in component.findall("output")):
            for index in range(1, len(root.findall("propulsion/engine"))):
                ElementTree.SubElement(component, "output").text = f"{THROTTLE}[{index}]"
    for control, actuator in actuators:
        _put_servo(system, control, actuator)
    if latency[1]:
        _delay_readings(system, *latency)
    # A model's own output would leave files where the command was given; its input would listen on the network.
    for port in (*root.findall("output"), *root.findall("input")):
        root.remove(port)
    # Systems run in document order: commands before whatever of the model reads them.
    root.insert(0, system)
    derived: bytes = ElementTree.tostring(root, encoding="utf-8", xml_declaration=True)
    return derived


def _put_servo(system: ElementTree.Element, control: str, actuator: NormActuator) -> None:
    """Adds a servo to a control; `wayproof/<control>-limited` counts the steps at its rate limit."""
    name = f"wayproof/{control}-norm"
    channel, component = next(
        (each, part) for each in system.findall("channel") for part in each if part.get("name") == name
    )
    command, servo, before = (f"wayproof/{control}-{each}-norm" for each in ("asked", "servo", "before"))
    trim, moved = f"wayproof/trim/{control}-norm", f"fcs/{control}-cmd-norm"
    rate = actuator.rate_limit_1ps
    lag = f"<lag>{1.0 / actuator.lag_s!r}</lag>" if actuator.lag_s else ""
    limit = "" if rate is None else f"<rate_limit>{rate!r}</rate_limit>"
    band = f"<deadband_width>{actuator.deadband!r}</deadband_width>" if actuator.deadband else ""
    parts = [
        f"""<fcs_function name="{before}"><function><property>{servo}</property></function></fcs_function>""",
        f"""<fcs_function name="{command}"><function><product><property>wayproof/enable</property>
        <difference><property>{name}</property><property>{trim}</property></difference>
        </product></function></fcs_function>""",
        f"""<actuator name="{servo}"><input>{command}</input>{lag}{limit}{band}</actuator>""",
        f"""<fcs_function name="wayproof/{control}-moved-norm"><function><ifthen>
        <property>wayproof/enable</property>
        <sum><property>{trim}</property><property>{servo}</property></sum>
        <property>{moved}</property>
        </ifthen></function><clipto><min>{0 if control == "throttle" else -1}</min><max>1</max></clipto>
        </fcs_function>""",
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
    for output in component.findall("output"):
        component.remove(output)
        made[3].append(output)
    after = list(channel).index(component) + 1
    channel[after:after] = made


def _delay_readings(system: ElementTree.Element, latency_s: float, steps: int) -> None:
    """Has the autopilot read its attitude, airspeed, height and climb rate late, by `latency_s`, which are `steps`.

    Gyros are not late: the old attitude is carried on to now at their present rate.
    """
    channel = ElementTree.Element("channel", name="measured")
    for name, rate in READ_LATE.items():
        old = f"wayproof/measured/{name.rpartition('/')[2]}"
        for each in system.iter():
            if each.text and each.text.strip() == name:
                each.text = old if rate is None else f"{old}-now"
        sensor = f"""<sensor name="{old}"><input>{name}</input><delay type="frames">{steps + 1}</delay></sensor>"""
        channel.append(ElementTree.fromstring(sensor))  # one of the frames is now
        if rate is not None:
            now = f"""<fcs_function name="{old}-now"><function><sum><property>{old}</property>
                <product><value>{latency_s!r}</value><property>{rate}</property></product>
                </sum></function></fcs_function>"""
            channel.append(ElementTree.fromstring(now))
    system.insert([each.tag for each in system].index("channel"), channel)
