"""An aircraft that differs a little from its model; its guidance and autopilot are tuned for the model.

The deviations are put into the XML of a JSBSim model when it is loaded; moments and the trim follow from that.
"""

from __future__ import annotations

import re
import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass
from typing import Final

SURFACES: Final = ("elevator", "aileron", "rudder")  # surfaces whose effect may deviate
ALPHA_PROPERTIES: Final = {"aero/alpha-rad", "aero/alpha-deg"}  # properties of the angle of attack
LIFT_AXES: Final = ("LIFT", "NORMAL", "Z")  # names of JSBSim's aerodynamic axis that has the lift
DRAG_AXES: Final = ("DRAG", "AXIAL", "X")  # names of the axis that has the drag
FLOWN_PREFIX: Final = "wayproof/flown/"
"""A property of this prefix is one of JSBSim's times its factor; the aerodynamics read it instead."""
UNITS_M: Final = {"IN": 0.0254, "FT": 0.3048, "M": 1.0}  # units of lengths in a JSBSim file


@dataclass(frozen=True)
class Deviation:
    """Deviation of the flown aircraft from its model, in shares but for the centre of gravity."""

    mass: float = 0.0  # of the empty weight, inertias included
    thrust: float = 0.0  # of engines and of external forces along the body's x axis
    drag: float = 0.0
    lift_slope: float = 0.0  # of the change of the lift with the angle of attack
    elevator: float = 0.0  # of the effect of a surface on every force and moment
    aileron: float = 0.0
    rudder: float = 0.0
    centre_of_gravity_m: float = 0.0  # behind that of the model, of the empty aircraft


AS_MODELLED: Final = Deviation()  # the deviation of an aircraft that flies exactly as its model


def deviate(root: ElementTree.Element, deviation: Deviation) -> None:
    """Changes a JSBSim model in place; ValueError if the model does not show what is to differ."""
    balance, aerodynamics = root.find("mass_balance"), root.find("aerodynamics")
    if balance is None or aerodynamics is None:
        raise ValueError("it has no <mass_balance> or no <aerodynamics>")
    _change_balance(balance, deviation)
    for name in SURFACES:
        if any(re.match(rf"fcs/.*{name}", text) for text in _texts(root)):  # a flying wing has no rudder
            positions = {text for text in _texts(aerodynamics) if re.match(rf"fcs/.*{name}-pos", text)}
            _scale_properties(aerodynamics, [aerodynamics], positions, name, 1.0 + getattr(deviation, name))
    lift = _axes(aerodynamics, LIFT_AXES)
    places = [*lift, *_functions_for(aerodynamics, lift)]
    _scale_properties(aerodynamics, places, ALPHA_PROPERTIES, "lift slope", 1.0 + deviation.lift_slope)
    if deviation.drag:
        for axis in _axes(aerodynamics, DRAG_AXES):
            for function in axis.findall("function"):
                _scale_result(function, 1.0 + deviation.drag)
    if deviation.thrust:
        _add_thrust(root, deviation.thrust)


def _axes(aerodynamics: ElementTree.Element, names: tuple[str, ...]) -> list[ElementTree.Element]:
    return [axis for axis in aerodynamics.findall("axis") if axis.get("name") in names]


def _change_balance(balance: ElementTree.Element, deviation: Deviation) -> None:
    """Scales the empty weight and its inertias, and moves the centre of gravity."""
    for name in ("emptywt", "ixx", "iyy", "izz", "ixy", "ixz", "iyz") if deviation.mass else ():
        element = balance.find(name)
        if element is not None and element.text:
            element.text = repr(float(element.text) * (1.0 + deviation.mass))
    if deviation.centre_of_gravity_m:
        location = balance.find("location[@name='CG']")
        x = None if location is None else location.find("x")
        if location is None or x is None or not x.text:
            raise ValueError("its <mass_balance> has no place of the centre of gravity")
        unit_m = UNITS_M[location.get("unit", "IN").upper()]
        x.text = repr(float(x.text) + deviation.centre_of_gravity_m / unit_m)


def _functions_for(aerodynamics: ElementTree.Element, axes: list[ElementTree.Element]) -> list[ElementTree.Element]:
    """Finds the functions that these axes read and no other axis does; drag does not count, for it follows lift."""
    left_out = axes + _axes(aerodynamics, DRAG_AXES)
    others = [each for each in aerodynamics.findall("axis") if each not in left_out]
    functions = aerodynamics.findall("function")
    alone = _read_by(axes, functions) - _read_by(others, functions)
    return [each for each in functions if each.get("name") in alone]


def _read_by(axes: list[ElementTree.Element], functions: list[ElementTree.Element]) -> set[str]:
    """All names that axes read, themselves or through functions, each of which reads only those before it."""
    names = {text for axis in axes for text in _texts(axis)}
    for each in reversed(functions):
        if each.get("name") in names:
            names |= _texts(each)
    return names


def _texts(element: ElementTree.Element) -> set[str]:
    """All texts in an element, without the sign that JSBSim takes before a property."""
    return {each.text.strip().lstrip("-") for each in element.iter() if each.text}


def _scale_properties(
    aerodynamics: ElementTree.Element,
    places: list[ElementTree.Element],
    properties: set[str],
    what: str,
    factor: float,
) -> None:
    """Has the elements of `places` read properties times a factor; `what` names the effect in an error."""
    if factor == 1.0:
        return
    found = set()
    for each in (each for place in places for each in place.iter()):
        text = (each.text or "").strip()
        if (name := text.lstrip("-")) in properties:
            found.add(name)
            each.text = text.replace(name, FLOWN_PREFIX + name)
    if not found:
        remedy = f"uncertainty.{what.replace(' ', '_')}: 0 leaves it as it is"
        raise ValueError(f"its aerodynamics do not show the effect of its {what}; {remedy}")
    for name in sorted(found):
        product = f"<product><property>{name}</property><value>{factor!r}</value></product>"
        scaled = ElementTree.fromstring(f"<function name='{FLOWN_PREFIX}{name}'>{product}</function>")
        aerodynamics.insert(0, scaled)


def _scale_result(function: ElementTree.Element, factor: float) -> None:
    product = ElementTree.fromstring(f"<product><value>{factor!r}</value></product>")
    for each in [each for each in function if each.tag != "description"]:
        function.remove(each)
        product.append(each)
    function.append(product)


def _add_thrust(root: ElementTree.Element, share: float) -> None:
    """Adds a share of all thrust along the body's x axis, and of its moments in pitch and yaw.

    It comes last, when JSBSim has added up the other external forces, an electric motor's thrust among them. The force
    acts at the origin of the structural frame; its own moments about the centre of gravity are taken off again.
    """
    if (external := root.find("external_reactions")) is None:
        external = ElementTree.SubElement(root, "external_reactions")
    thrust = "<sum><property>forces/fbx-prop-lbs</property><property>forces/fbx-external-lbs</property></sum>"
    force = f"""<force name="wayproof-thrust-deviation" frame="BODY">
        <function><product><value>{share!r}</value>{thrust}</product></function>
        <location unit="M"><x>0</x><y>0</y><z>0</z></location>
        <direction><x>1</x><y>0</y><z>0</z></direction></force>"""
    external.append(ElementTree.fromstring(force))
    for axis, arm, direction in (("m", "z", "<x>0</x><y>1</y><z>0</z>"), ("n", "y", "<x>0</x><y>0</y><z>1</z>")):
        moment = f"""<moment name="wayproof-thrust-deviation-{axis}" frame="BODY">
            <function><product><value>{share!r}</value><difference>
            <sum><property>moments/{axis}-prop-lbsft</property><property>moments/{axis}-external-lbsft</property></sum>
            <product>{thrust}<property>inertia/cg-{arm}-in</property><value>{1.0 / 12.0!r}</value></product>
            </difference></product></function>
            <direction>{direction}</direction></moment>"""
        external.append(ElementTree.fromstring(moment))
