"""XML of others is read without trust, and what we serve is for this machine alone; ruff's S rules see to the rest."""

import os
import shutil
import socket
import struct
from pathlib import Path

import pytest

import aircraft
from aircraft.frames import LocalPlane
from aircraft.jsbsim_loading import load, trim
from aircraft.model_files import AircraftError, model_files
from aircraft.start import StartConditions
from tests.faults.command import FOREST
from tests.pictures import served
from tests.refusals import refused

MODEL = Path(aircraft.__path__[0], "aerosonde")


def sockets(pids: list[int]) -> list[tuple[str, int]]:
    """Address and port of every socket on which processes wait for others (proc_net_tcp(5))."""
    nodes = set()
    for pid in pids:
        for link in Path(f"/proc/{pid}/fd").iterdir():
            try:
                nodes.add(os.readlink(link))
            except OSError:
                continue  # closed meanwhile
    found = []
    for name in ("tcp", "tcp6", "udp", "udp6"):
        for row in Path(f"/proc/net/{name}").read_text().splitlines()[1:]:
            _, local, _, state, *cells = row.split()
            if f"socket:[{cells[5]}]" in nodes and state in ("0A", "07"):
                number, port = local.split(":")
                words = [struct.pack("=I", int(number[i : i + 8], 16)) for i in range(0, len(number), 8)]
                family = socket.AF_INET6 if len(words) > 1 else socket.AF_INET
                found.append((socket.inet_ntop(family, b"".join(words)), int(port, 16)))
    return found


def test_the_viewer_is_served_to_this_machine_alone(a_run: Path, tmp_path: Path) -> None:
    with served(a_run / "flight.rrd") as (viewer, address):
        listening = sockets([viewer.pid, os.getpid()])
        assert len(listening) >= 2
        assert {host for host, _ in listening} == {"127.0.0.1"}
        assert any(f":{port}/" in address for _, port in listening)


@pytest.mark.parametrize("name", ["737", "c172x"])
def test_a_model_that_would_listen_does_not(name: str) -> None:
    """Both ask for a port on all addresses by which their controls can be moved."""
    files = model_files(name)
    assert "<input" in files.model.read_text()
    before = sockets([os.getpid()])
    fdm = load(files)
    start = StartConditions(0.0, 0.0, 1000.0, 0.0, 150.0 if name == "737" else 50.0)
    trim(fdm, name, LocalPlane(47.0, 8.0), start, 0.0)
    assert fdm.run()
    assert sockets([os.getpid()]) == before


@pytest.fixture
def model(tmp_path: Path) -> Path:
    """A copy of a model's folder; its main file."""
    shutil.copytree(MODEL, tmp_path / "mine")
    return (tmp_path / "mine" / "aerosonde.xml").rename(tmp_path / "mine" / "mine.xml")


DOCTYPE = '<?xml version="1.0"?>\n<!DOCTYPE fdm_config [{}]>\n'
BOMB = "".join(f'<!ENTITY {b} "{f"&{a};" * 10}">' for a, b in zip("abcdefghi", "bcdefghij", strict=True))
HOSTILE = {
    "entity bomb": (f'<!ENTITY a "{"x" * 50}">{BOMB}', "declares the entity b"),
    "long entity": (f'<!ENTITY a "{"x" * 10_000}">', "declares the entity a"),
    "external entity": ('<!ENTITY a SYSTEM "file:///etc/passwd">', "declares the entity a"),
    "parameter entity": ('<!ENTITY % a "<!ELEMENT b ANY>">', "declares the entity a"),
}


@pytest.mark.parametrize("where", ["mine.xml", "motor.xml", "Systems/more.xml"])
@pytest.mark.parametrize(("declared", "sentence"), HOSTILE.values(), ids=HOSTILE)
def test_entities_are_refused(declared: str, sentence: str, where: str, model: Path) -> None:
    path = model.parent / where
    path.parent.mkdir(exist_ok=True)
    text = path.read_text() if path.exists() else '<?xml version="1.0"?>\n<system name="a"/>'
    path.write_text(DOCTYPE.format(declared) + text.partition("?>")[2])
    with pytest.raises(AircraftError, match=sentence) as refused:
        model_files(str(model.parent))
    assert str(refused.value).startswith(f"{path}:2: ")


SPOILT = {
    "file above": ('<system file="../../secret"/>', "leads out of the folder"),
    "file anywhere": ('<system file="/etc/passwd"/>', "leads out of the folder"),
    "deep": ("<a>" * 100_000 + "</a>" * 100_000, "is nested deeper than 60 elements"),
}


@pytest.mark.parametrize(("added", "sentence"), SPOILT.values(), ids=SPOILT)
def test_a_model_that_reaches_too_far_is_refused_by_the_command(
    added: str, sentence: str, model: Path, tmp_path: Path
) -> None:
    model.write_text(model.read_text().replace("</fdm_config>", f"{added}</fdm_config>"))
    said = refused(*["fly", str(FOREST), "--aircraft", str(model.parent), "--out", str(tmp_path / "run")])
    assert sentence in said
    assert str(model) in said
    assert not (tmp_path / "run").exists()


def test_a_huge_file_and_a_crowded_folder_are_refused(model: Path) -> None:
    assert model_files(str(model.parent)).model == model
    (model.parent / "big.xml").write_text("<a>" + " " * 6_000_000 + "</a>")
    with pytest.raises(AircraftError, match="is larger than 5 MB"):
        model_files(str(model.parent))
    (model.parent / "big.xml").unlink()
    for number in range(1001):
        (model.parent / f"{number}.txt").touch()
    with pytest.raises(AircraftError, match="more than 1000 files"):
        model_files(str(model.parent))


@pytest.mark.parametrize("path", ["file/below", "x" * 300, "\udcff", "a\nb"])
def test_where_a_run_cannot_be_written(path: str, tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    said = refused("fly", FOREST, "--out", tmp_path / path)
    assert said.startswith("wayproof: cannot write the run folder ")
    assert len(said.splitlines()) == 1
    assert [entry.name for entry in tmp_path.iterdir()] == ["file"]


@pytest.mark.parametrize("out", ["/proc/run", "/sys/run"])
def test_a_file_system_that_takes_nothing(out: str) -> None:
    assert refused("fly", FOREST, "--out", out).startswith(f"wayproof: cannot write the run folder {out}: ")


@pytest.mark.parametrize("kind", ["pipe", "loop", "device", "folder", "long"])
@pytest.mark.parametrize("command", ["fly", "validate", "check"])
def test_what_is_no_file_is_refused_at_once(command: str, kind: str, tmp_path: Path) -> None:
    path = tmp_path / ("x" * 300 if kind == "long" else "given.csv")
    if kind == "pipe":
        os.mkfifo(path)
    elif kind == "folder":
        path.mkdir()
    elif kind != "long":
        path.symlink_to(path if kind == "loop" else "/dev/zero")
    path = path.with_suffix(".csv")
    said = refused(command, path, *{"check": ["--aircraft", "aerosonde"]}.get(command, []))
    assert said.startswith(f"{path}: ")
    assert len(said.splitlines()) == 1
