"""An aircraft that is a little other than its model: what its guidance and autopilot are tuned for is the model.

The deviations are put into the XML of a JSBSim model when it is loaded; moments and the trim follow from that.
"""

from __future__ import annotations

import math
import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass, fields
from typing import Final

SURFACES: Final = ("elevator", "aileron", "rudder")
ALPHA: Final = ("aero/alpha-rad", "aero/alpha-deg")
LIFT_AXES: Final = ("LIFT", "NORMAL", "Z")
DRAG_AXES: Final = ("DRAG", "AXIAL", "X")
PREFIX: Final = "wayproof/flown/"
"""Properties of an aircraft's aerodynamics that stand for those of JSBSim, times their factor."""
THRUST: Final = "wayproof-thrust-deviation"
UNITS_M: Final = {"IN": 0.0254, "FT": 0.3048, "M": 1.0}


@dataclass(frozen=True)
class Deviation:
    """By how much the flown aircraft differs from its model.

    Attributes:
        mass: share of the empty weight, inertias included.
        thrust: share of the thrust of engines and of external forces along the body's x axis.
        drag: share of all drag.
        lift_slope: share of the change of the lift with the angle of attack.
        elevator, aileron, rudder: share of the effect of a surface on every force and moment.
        centre_of_gravity_m: how far behind that of the model the centre of gravity of the empty aircraft is.
    """

    mass: float = 0.0
    thrust: float = 0.0
    drag: float = 0.0
    lift_slope: float = 0.0
    elevator: float = 0.0
    aileron: float = 0.0
    rudder: float = 0.0
    centre_of_gravity_m: float = 0.0

    def __post_init__(self) -> None:
        for each in fields(self):
            value = getattr(self, each.name)
            if not math.isfinite(value) or (each.name != "centre_of_gravity_m" and value <= -1.0):
                raise ValueError(f"{each.name} must be finite, a share above -1; got {value}")

    @property
    def any(self) -> bool:
        """Whether anything differs."""
        return any(getattr(self, each.name) for each in fields(self))


AS_MODELLED: Final = Deviation()
"""Nothing differs."""


def deviate(root: ElementTree.Element, deviation: Deviation) -> None:
    """Changes a JSBSim model in place.

    Raises:
        ValueError: the model does not show what is to differ.
    """
    balance, aerodynamics = root.find("mass_balance"), root.find("aerodynamics")
    if balance is None or aerodynamics is None:
        raise ValueError("it has no <mass_balance> or no <aerodynamics>")
    _scale_mass(balance, 1.0 + deviation.mass)
    _shift_centre_of_gravity(balance, deviation.centre_of_gravity_m)
    factors = [(name, 1.0 + getattr(deviation, name)) for name in SURFACES]
    for name, factor in factors:
        if not any(f"fcs/{name}" in text for text in _texts(root)):
            continue  # a flying wing has no rudder to differ
        _scale_properties(aerodynamics, [aerodynamics], _positions(aerodynamics, name), name, factor)
    lift = _axes(aerodynamics, LIFT_AXES)
    shared = _functions_for(aerodynamics, lift)
    _scale_properties(aerodynamics, [*lift, *shared], list(ALPHA), "lift slope", 1.0 + deviation.lift_slope)
    if deviation.drag:
        for function in (
            each for axis in _axes(aerodynamics, DRAG_AXES) for each in axis.findall("function")
        ):
            _wrap(function, 1.0 + deviation.drag)
    if deviation.thrust:
        _add_thrust(root, deviation.thrust)


def _scale_mass(balance: ElementTree.Element, factor: float) -> None:
    if factor == 1.0:
        return
    for name in ("emptywt", "ixx", "iyy", "izz", "ixy", "ixz", "iyz"):
        element = balance.find(name)
        if element is not None and element.text:
            element.text = repr(float(element.text) * factor)


def _shift_centre_of_gravity(balance: ElementTree.Element, metres: float) -> None:
    if not metres:
        return
    location = next((each for each in balance.findall("location") if each.get("name") == "CG"), None)
    x = None if location is None else location.find("x")
    if location is None or x is None or not x.text:
        raise ValueError("its <mass_balance> has no place of the centre of gravity")
    x.text = repr(float(x.text) + metres / UNITS_M[location.get("unit", "IN").upper()])


def _axes(aerodynamics: ElementTree.Element, names: tuple[str, ...]) -> list[ElementTree.Element]:
    return [axis for axis in aerodynamics.findall("axis") if axis.get("name") in names]


def _functions_for(
    aerodynamics: ElementTree.Element, axes: list[ElementTree.Element]
) -> list[ElementTree.Element]:
    """Functions outside the axes that these read and no other axis does, drag left out: it follows from the lift."""
    others = [each for each in aerodynamics.findall("axis") if each not in axes]
    others = [each for each in others if each.get("name") not in DRAG_AXES]
    read, elsewhere = ({text for axis in some for text in _texts(axis)} for some in (axes, others))
    return [each for each in aerodynamics.findall("function") if each.get("name") in read - elsewhere]


def _texts(element: ElementTree.Element) -> set[str]:
    return {each.text.strip() for each in element.iter() if each.text}


def _positions(aerodynamics: ElementTree.Element, surface: str) -> list[str]:
    """Properties that tell where a surface is, as far as the aerodynamics read them."""
    return sorted(
        text
        for text in _texts(aerodynamics)
        if text.startswith("fcs/") and f"{surface}-pos" in text and " " not in text
    )


def _scale_properties(
    aerodynamics: ElementTree.Element,
    places: list[ElementTree.Element],
    properties: list[str],
    what: str,
    factor: float,
) -> None:
    """Has some elements read a property times a factor, which is computed first of all aerodynamics."""
    if factor == 1.0:
        return
    found = set()
    for each in (each for place in places for each in place.iter()):
        if each.text and each.text.strip() in properties:
            found.add(each.text.strip())
            each.text = PREFIX + each.text.strip()
    if not found:
        raise ValueError(f"its aerodynamics do not show the effect of its {what}")
    for name in sorted(found):
        function = ElementTree.Element("function", name=PREFIX + name)
        product = ElementTree.SubElement(function, "product")
        ElementTree.SubElement(product, "property").text = name
        ElementTree.SubElement(product, "value").text = repr(factor)
        aerodynamics.insert(0, function)


def _wrap(function: ElementTree.Element, factor: float) -> None:
    """Multiplies what a function gives."""
    inner = [each for each in function if each.tag not in ("description",)]
    product = ElementTree.Element("product")
    ElementTree.SubElement(product, "value").text = repr(factor)
    for each in inner:
        function.remove(each)
        product.append(each)
    function.append(product)


def _add_thrust(root: ElementTree.Element, share: float) -> None:
    """A force along the body's x axis, a share of all thrust.

    It comes last, when JSBSim has added up the other external forces, an electric motor's thrust among them.
    """
    external = root.find("external_reactions")
    if external is None:
        external = ElementTree.SubElement(root, "external_reactions")
    force = ElementTree.SubElement(external, "force", name=THRUST, frame="BODY")
    function = ElementTree.SubElement(force, "function")
    product = ElementTree.SubElement(function, "product")
    ElementTree.SubElement(product, "value").text = repr(share)
    total = ElementTree.SubElement(product, "sum")
    for name in ("forces/fbx-prop-lbs", "forces/fbx-external-lbs"):
        ElementTree.SubElement(total, "property").text = name
    for tag, x in (("location", None), ("direction", "1")):
        vector = ElementTree.SubElement(force, tag, {"unit": "M"} if x is None else {})
        for axis in "xyz":
            ElementTree.SubElement(vector, axis).text = x if x and axis == "x" else "0"
