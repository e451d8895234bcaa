"""Where a flight that is watched is sent to: on this machine, unless somebody says otherwise."""

from __future__ import annotations

import ipaddress
import socket
from dataclasses import dataclass
from typing import Final

from harness.files.input_file import InputError

VIEWER_PORT: Final = 9876
"""Where rerun's viewer listens unless it is told otherwise."""
GROUND_STATION_PORT: Final = 14550
"""Where ground stations listen for MAVLink."""

KNOCK_S: Final = 3.0
"""Who listens takes a connection, and greets, within this wall time."""
PREFACE: Final = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n"
SETTINGS: Final = bytes((0, 0, 0, 4, 0, 0, 0, 0, 0))
"""What both sides of HTTP/2 begin with, the client after the preface (RFC 9113, 3.4): a frame of type 4, byte 3."""

_SCHEMES: Final = ("rerun+http://", "rerun+https://", "rerun://")


@dataclass(frozen=True)
class Address:
    """A host and a port."""

    host: str
    port: int

    @property
    def text(self) -> str:
        """As people write it."""
        return f"[{self.host}]:{self.port}" if ":" in self.host else f"{self.host}:{self.port}"

    def need_viewer(self, option: str, secure: bool = False) -> None:
        """Refuses an address where nobody takes a connection, or what does speaks no HTTP/2, as viewers do.

        Args:
            option: of the command line.
            secure: over TLS, of which nothing more is asked.

        Raises:
            InputError: nobody does, or something else.
        """
        try:
            with socket.create_connection((self.host, self.port), KNOCK_S) as line:
                greeting = SETTINGS if secure else _greeted(line)
        except OSError as error:
            raise InputError(
                f"command line: {option}: nothing listens at {self.text}; start it first"
            ) from error
        if greeting[3:4] != SETTINGS[3:4]:
            raise InputError(f"command line: {option}: what listens at {self.text} is no rerun viewer")


def _greeted(line: socket.socket) -> bytes:
    """What the other side of a connection says to one who speaks HTTP/2; nothing where it keeps silent."""
    line.settimeout(KNOCK_S)
    try:
        line.sendall(PREFACE + SETTINGS)
        return line.recv(len(SETTINGS))
    except OSError:
        return b""


def viewer_address(text: str, beyond: bool = False) -> tuple[Address, str]:
    """Where a running viewer listens, and its address as rerun writes it.

    Args:
        text: HOST, HOST:PORT, or an address as rerun prints it, such as rerun+http://127.0.0.1:9876/proxy.
        beyond: it may lead beyond this machine.

    Raises:
        InputError: it is no such address, or leads beyond this machine and may not.
    """
    scheme = next((each for each in _SCHEMES if text.startswith(each)), _SCHEMES[0])
    address = _parsed(text.removeprefix(scheme).removesuffix("/proxy"), VIEWER_PORT, "--viewer", text)
    _need_this_machine(address, beyond, "--viewer")
    return address, f"{scheme}{address.text}/proxy"


def ground_station_address(text: str, beyond: bool = False) -> Address:
    """Where a ground station listens for MAVLink.

    Args:
        text: udp:HOST or udp:HOST:PORT.
        beyond: it may lead beyond this machine.

    Raises:
        InputError: it is no such address, or leads beyond this machine and may not.
    """
    kind, colon, rest = text.partition(":")
    if kind != "udp" or not colon:
        raise InputError(f"command line: --mavlink: is {text[:60]!r}; must be as udp:127.0.0.1:14550")
    address = _parsed(rest, GROUND_STATION_PORT, "--mavlink", text)
    _need_this_machine(address, beyond, "--mavlink")
    return address


def _parsed(text: str, port: int, option: str, given: str) -> Address:
    """HOST or HOST:PORT; an IPv6 host with a port stands in brackets."""
    bracket = text.startswith("[") and "]" in text
    host, _, tail = text[1:].partition("]") if bracket else text.partition(":")
    digits = tail.removeprefix(":") if bracket else tail
    whole = digits.isdecimal() and 0 < int(digits) < 2**16
    if not host or not (whole or not digits) or "/" in text:
        raise InputError(
            f"command line: {option}: {given[:60]!r} is no HOST:PORT, with a port from 1 to 65535"
        )
    return Address(host, int(digits) if digits else port)


def _need_this_machine(address: Address, beyond: bool, option: str) -> None:
    """Refuses an address that leads elsewhere, unless it may.

    Raises:
        InputError: it does, or nobody knows the host.
    """
    try:
        found = {place[4][0] for place in socket.getaddrinfo(address.host, address.port)}
    except OSError as error:
        raise InputError(f"command line: {option}: no host {address.host!r} ({error.strerror})") from error
    if not beyond and not all(
        ipaddress.ip_address(str(host).partition("%")[0]).is_loopback for host in found
    ):
        raise InputError(
            f"command line: {option}: {address.text} leads beyond this machine; --beyond-this-machine lets it"
        )
