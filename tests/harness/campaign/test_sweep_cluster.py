"""Campaigns on a real Dask cluster on this machine: the same bytes, a worker killed in mid-run included."""

import os
import re
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from harness.cli.app import main
from harness.recording.viewer import LOCALHOST, free_port
from tests.faults.command import ROOT, wait_until
from tests.harness.campaign.test_sweep import CAMPAIGN, begun, journal_lines, results, written
from tests.processes import python
from tests.refusals import refused


class Cluster:
    """A scheduler with two workers, each a process of its own."""

    def __init__(self, folder: Path, stack: ExitStack) -> None:
        self._folder, self._stack = folder, stack
        self._begin()

    def _begin(self) -> None:
        port = free_port()
        self.address = f"tcp://{LOCALHOST}:{port}"
        self.scheduler = self._run("scheduler", "--host", LOCALHOST, "--port", str(port), "--no-dashboard")
        self.workers: list[subprocess.Popen[bytes]] = []

    def make_whole(self) -> None:
        """Begins anew what does not live."""
        if self.scheduler.poll() is not None:
            for worker in self.workers:
                worker.kill()
            self._begin()
        self.workers = [worker for worker in self.workers if worker.poll() is None]
        missing = range(2 - len(self.workers))
        registered = self.log("worker").count("Registered to") + len(missing)
        self.workers += [self._add_worker() for _ in missing]
        wait_until(lambda: self.log("worker").count("Registered to") == registered)

    def _add_worker(self) -> subprocess.Popen[bytes]:
        """One flight at a time; it ends with its first death, as a machine does."""
        words = ("--host", LOCALHOST, "--nthreads", "1", "--no-nanny", "--no-dashboard")
        return self._run("worker", self.address, *words)

    def _run(self, *arguments: str) -> subprocess.Popen[bytes]:
        log = self._stack.enter_context((self._folder / f"{arguments[0]}.log").open("ab"))
        process = subprocess.Popen(
            [sys.executable, "-m", "dask", *arguments],
            cwd=self._folder,
            env={**os.environ, "PYTHONPATH": str(ROOT)},
            stdout=log,
            stderr=log,
        )
        self._stack.callback(process.wait, timeout=30)
        self._stack.callback(process.kill)
        return process

    def log(self, of: str) -> str:
        path = self._folder / f"{of}.log"
        return path.read_text() if path.exists() else ""


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return written(tmp_path_factory.mktemp("cluster"), CAMPAIGN.replace("draws: 2", "draws: 4"))


@pytest.fixture(scope="module")
def whole(place: Path) -> bytes:
    assert main(["sweep", str(place / "campaign.yaml"), "--out", str(place / "whole")]) == 0
    return results(place / "whole")


@pytest.fixture(scope="module")
def processes(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Cluster]:
    with ExitStack() as stack:
        yield Cluster(tmp_path_factory.mktemp("processes"), stack)


@pytest.fixture
def cluster(processes: Cluster) -> Cluster:
    """A whole one, though a test before has killed a part of it."""
    processes.make_whole()
    return processes


@pytest.mark.flights
def test_a_cluster_gives_the_same_bytes_with_a_worker_killed_in_mid_run(
    place: Path, whole: bytes, cluster: Cluster
) -> None:
    flying = begun(place, 4, "--scheduler", cluster.address)
    cluster.workers[0].kill()
    flying.wait(timeout=120)
    told, said = flying.communicate()
    assert flying.returncode == 0
    assert re.search(r"^wayproof: the Dask worker tcp://\S+ has gone; others fly its runs again$", said, re.M)
    assert "Traceback" not in said
    assert "reached" in told
    assert cluster.workers[1].poll() is None
    assert results(place / "out") == whole


@pytest.mark.flights
def test_whatever_stops_it_what_is_done_is_kept_and_gone_on_with(
    whole: bytes, cluster: Cluster, tmp_path: Path, place: Path
) -> None:
    for name in ("short.yaml", "campaign.yaml"):
        (tmp_path / name).write_text((place / name).read_text())
    out = tmp_path / "out"
    flying = begun(tmp_path, 2, "--scheduler", cluster.address)
    for worker in cluster.workers:
        worker.send_signal(signal.SIGSTOP)  # else all may be flown before it is interrupted
    flying.send_signal(signal.SIGINT)
    told, said = flying.communicate(timeout=60)
    for worker in cluster.workers:
        worker.send_signal(signal.SIGCONT)
    assert (flying.returncode, told) == (130, "")
    assert said.splitlines()[-1] == "wayproof: interrupted; what is done is in out, --resume goes on"

    kept = journal_lines(out)
    flying = begun(tmp_path, kept + 1, "--scheduler", cluster.address, "--resume", "--quiet")
    cluster.scheduler.kill()
    told, said = flying.communicate(timeout=60)
    assert (flying.returncode, told) == (1, "")
    assert said == "wayproof: the Dask scheduler has gone; what is done is in out, --resume goes on\n"

    assert kept < journal_lines(out) < 16
    assert main(["sweep", str(tmp_path / "campaign.yaml"), "--out", str(out), "--resume"]) == 0
    assert results(out) == whole


@pytest.mark.flights
def test_beyond_this_machine_a_scheduler_needs_tls_or_a_word(place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """192.0.2.1 is an address for documentation (RFC 5737): nobody's, so not of this machine."""
    out = place / "beyond"

    def knocked(*_: object) -> None:
        raise OSError

    monkeypatch.setattr("harness.campaign.workers.socket.create_connection", knocked)

    def said(*arguments: str) -> str:
        told = refused("sweep", place / "campaign.yaml", "--out", out, *arguments)
        assert not out.exists()
        return told

    for address in ("tcp://192.0.2.1:8786", "ws://192.0.2.1:8786", "tcp://[2001:db8::1]:8786"):
        told = f"wayproof: {address} leads beyond this machine without encryption"
        assert said("--scheduler", address).startswith(told)
        assert "no Dask scheduler answers" in said("--scheduler", address, "--unencrypted")
    for address in ("tls://192.0.2.1:8786", "tcp://localhost:1", "tcp://127.0.0.1:1"):
        assert "no Dask scheduler answers" in said("--scheduler", address)
    assert "--unencrypted goes with --scheduler" in said("--unencrypted")


@pytest.mark.flights
def test_without_a_scheduler_nothing_is_flown(place: Path) -> None:
    address = f"tcp://{LOCALHOST}:{free_port()}"
    out = place / "nowhere"
    said = refused("sweep", place / "campaign.yaml", "--scheduler", address, "--out", out)
    assert f"no Dask scheduler answers at {address}" in said
    assert not out.exists()
    words = "sweep campaign.yaml --scheduler tcp://no-such-host:8786 --unencrypted --out nowhere"
    nobody = python("-m", "harness", *words.split(), folder=place)
    line = "wayproof: no Dask scheduler answers at tcp://no-such-host:8786; start one there\n"
    assert (nobody.returncode, nobody.stderr) == (2, line), "no traceback at its end"
    for options, said in (
        (["--scheduler", address, "--workers", "2"], "--workers goes with this machine"),
        (["--scheduler", "foo"], "--scheduler foo: is no address; give it as tcp://HOST:PORT"),
        (["--scheduler", "nonsense://x", "--unencrypted"], "no Dask scheduler answers at nonsense://x"),
    ):
        assert said in refused("sweep", place / "campaign.yaml", "--out", out, *options)
