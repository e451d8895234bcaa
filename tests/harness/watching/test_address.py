"""Addresses that a flight is sent to."""

from __future__ import annotations

import socket
import threading

import pytest

from harness.files.input_file import InputError
from harness.watching import address as addresses
from harness.watching.address import Address, ground_station_address, viewer_address


@pytest.mark.parametrize(
    ("text", "url"),
    [
        ("127.0.0.1", "rerun+http://127.0.0.1:9876/proxy"),
        ("127.0.0.1:9900", "rerun+http://127.0.0.1:9900/proxy"),
        ("localhost:9900", "rerun+http://localhost:9900/proxy"),
        ("[::1]:9900", "rerun+http://[::1]:9900/proxy"),
        ("rerun+http://127.0.0.1:9900/proxy", "rerun+http://127.0.0.1:9900/proxy"),
    ],
)
def test_a_viewer_is_named_by_host_and_port_or_as_rerun_does(text: str, url: str) -> None:
    assert viewer_address(text)[1] == url


@pytest.mark.parametrize("text", ["", ":9900", "127.0.0.1:0", "127.0.0.1:65536", "127.0.0.1:x", "http://a/b"])
def test_what_is_no_address_is_refused(text: str) -> None:
    with pytest.raises(InputError, match=r"command line: --viewer: .* is no HOST:PORT"):
        viewer_address(text)


@pytest.mark.parametrize("text", ["127.0.0.1:14550", "tcp:127.0.0.1:14550", "udp", "serial:/dev/ttyS0"])
def test_a_ground_station_is_reached_over_udp_alone(text: str) -> None:
    with pytest.raises(InputError, match=r"must be as udp:127\.0\.0\.1:14550"):
        ground_station_address(text)


def test_a_ground_station_listens_where_all_do_unless_told_otherwise() -> None:
    assert ground_station_address("udp:127.0.0.1") == Address("127.0.0.1", 14550)
    assert ground_station_address("udp:127.0.0.1:14551").port == 14551


def test_another_machine_has_to_be_asked_for() -> None:
    for ask in (viewer_address, lambda text, beyond=False: ground_station_address(f"udp:{text}", beyond)):
        with pytest.raises(
            InputError, match=r"192\.0\.2\.1:9 leads beyond this machine; --beyond-this-machine"
        ):
            ask("192.0.2.1:9")
        assert ask("192.0.2.1:9", True)
        with pytest.raises(InputError, match=r"leads beyond this machine"):
            ask("0.0.0.0:9")


def test_where_nobody_listens_is_told() -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        port = taken.getsockname()[1]
        with pytest.raises(InputError, match=rf"--viewer: nothing listens at 127\.0\.0\.1:{port}"):
            Address("127.0.0.1", port).need_viewer("--viewer")


@pytest.mark.parametrize("answer", [b"", b"HTTP/1.1 400 Bad Request\r\n\r\n", b"SSH-2.0-OpenSSH_9.2\r\n"])
def test_what_is_no_viewer_is_told_before_the_flight(answer: bytes, monkeypatch: pytest.MonkeyPatch) -> None:
    """A viewer that does not answer in flight is given up after a minute: that is too late."""
    monkeypatch.setattr(addresses, "KNOCK_S", 0.5)
    with socket.create_server(("127.0.0.1", 0)) as other:
        address = Address("127.0.0.1", other.getsockname()[1])

        def answers() -> None:
            line, _ = other.accept()
            with line:
                line.sendall(answer)
                line.recv(1000)

        thread = threading.Thread(target=answers)
        thread.start()
        with pytest.raises(
            InputError, match=r"--viewer: what listens at 127\.0\.0\.1:\d+ is no rerun viewer"
        ):
            address.need_viewer("--viewer")
        thread.join()


def test_who_greets_as_http_2_does_is_taken_for_a_viewer() -> None:
    with socket.create_server(("127.0.0.1", 0)) as viewer:
        address = Address("127.0.0.1", viewer.getsockname()[1])

        def greets() -> None:
            line, _ = viewer.accept()
            with line:
                assert line.recv(1000).startswith(addresses.PREFACE)
                line.sendall(bytes((0, 0, 6, 4)) + bytes(11))

        thread = threading.Thread(target=greets)
        thread.start()
        address.need_viewer("--viewer")
        thread.join()
