"""The command `peridem`: exit codes, what it prints, logs and writes. The physics is faked."""

from __future__ import annotations

import errno
import io
import os
import re
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner, Result
from peridem import __version__, cli, runlog
from peridem.cli import DEMO_DECK
from peridem.errors import InputError, NumericalError
from peridem.interrupt import Terminated
from peridem.memory import MemoryPrediction, ZoneMemory
from peridem.model import DEMModel
from peridem.output import OutputWriter, read_vtu
from peridem.runlog import RunLog, show_progress
from peridem.summary import bytes_text, time_text, timing_rows
from rich.console import Console
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

ESCAPE = "\x1b"
N_STEPS, INTERVAL, DT = 20, 5, 1e-6


class FakeModel:
    """Two bodies of three nodes that fly along x; every outside part like a DEMModel's."""

    failure: BaseException | None = None
    """Raised at step 7."""
    warnings: Sequence[str] = ()
    last_checkpoint: Path | None = None
    stop_reason: str | None = None

    def __init__(self, path: Path, compatibility: str | None, threads: int | None) -> None:
        self.compatibility = compatibility or "corrected"
        self.threads = threads or 4
        self.n, self.dt, self.n_steps, self.n_nodes, self.dimension = 0, DT, N_STEPS, 6, 2
        self.memory_bytes = 12_345
        self.notes = ["input.yaml:9: Hpx: without effect"]
        output = SimpleNamespace(
            path=path.parent / "out", tags=("Velocity", "Particle_ID"), tag_pp="", perform_out=True,
            output_interval=INTERVAL,
        )  # fmt: skip
        self.deck = SimpleNamespace(
            path=path.absolute(), sha256="5" * 64, output=output,
            model=SimpleNamespace(discretization_type=SimpleNamespace(time="velocity_verlet")),
            zones=[SimpleNamespace(is_wall=False), SimpleNamespace(is_wall=True)],
            particles=[SimpleNamespace(type="circle"), None],
            materials=[SimpleNamespace(type="PDState"), SimpleNamespace(type="PMBBond")],
        )  # fmt: skip
        body = {"n_bonds": 6, "horizon": 4e-4}
        self.particles = [
            SimpleNamespace(zone=0, type="particle", start=0, stop=3, mesh_size=1e-4, **body),
            SimpleNamespace(zone=1, type="wall", start=3, stop=6, mesh_size=2e-4, **body),
        ]
        self.cells = [("triangle", np.array([[0, 1, 2]])), ("triangle", np.array([[3, 4, 5]]))]
        self.timings = {"peridynamic": 0.5, "contact_search": 0.25, "external": 0.0}

    @property
    def time(self) -> float:
        return self.n * self.dt

    @classmethod
    def from_deck(
        cls,
        path: Path,
        threads: int | None = None,
        compatibility: str | None = None,
        **checks: bool,
    ) -> FakeModel:
        if path.read_text().startswith("bad"):
            raise InputError("input.yaml:1: Model = bad: must be a block; write it\nsecond line")
        return cls(path, compatibility, threads)

    def init(self) -> None:
        pass

    def stable_time_step(self) -> SimpleNamespace:
        return SimpleNamespace(bonds=1e-5, contact=2e-6, self_contact=3e-6)

    def summary(self) -> dict[str, Any]:
        known = {"bonds": 6, "broken_bonds": 2, "compatibility": self.compatibility}
        return {**known, "stop_reason": self.stop_reason}

    def run(
        self, output: Path, steps: int | None, progress: Any, checkpoint_every: int | None
    ) -> None:
        last = self.n_steps if steps is None else steps
        arrays = {"Velocity": np.ones((6, 3)), "Particle_ID": np.arange(6) // 3}
        with OutputWriter(output, tags=list(arrays), interval=INTERVAL, cells=self.cells) as writer:
            for self.n in range(last + 1):
                if self.n % INTERVAL == 0:
                    x = np.random.default_rng(1).random((6, 3)) + self.time
                    writer.write(self.n // INTERVAL, self.n, self.time, arrays, points=x)
                if self.n == 7 and self.failure is not None:
                    raise self.failure
                progress(self)


@pytest.fixture
def deck(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(cli, "DEMModel", FakeModel)
    predicted = MemoryPrediction((ZoneMemory(0, 1, 3, 8.0, 7e3), ZoneMemory(1, 1, 3, 4.0, 5e3)))
    monkeypatch.setattr(cli, "predict_memory", lambda _: predicted)
    path = tmp_path / "case" / "input.yaml"
    path.parent.mkdir()
    path.write_text("good")
    return path


def peridem(*arguments: object) -> Result:
    result = CliRunner().invoke(cli.main, [str(a) for a in arguments], prog_name="peridem")
    assert "Traceback" not in result.output
    assert ESCAPE not in result.output
    return result


def test_version_is_the_package_s() -> None:
    result = peridem("--version")
    assert (result.exit_code, result.output) == (0, f"peridem, version {__version__}\n")


def test_run_writes_into_the_deck_s_folder_and_says_so(deck: Path) -> None:
    result = peridem("run", deck)
    assert result.exit_code == 0
    assert "Finished after step 20, t = 20 us; 2 of 6 bonds are broken" in result.stdout
    assert "5 vtu files in" in result.stdout and "open output.pvd in ParaView" in result.stdout
    assert result.stderr == "note: input.yaml:9: Hpx: without effect\n"
    folder = deck.parent / "out"
    want = {"output.pvd", "peridem.log", *(f"output_{k}.vtu" for k in range(5))}
    assert {path.name for path in folder.iterdir()} == want
    assert read_vtu(folder / "output_4.vtu")["step"] == 20


def test_run_closes_with_the_table_of_times(deck: Path) -> None:
    out = peridem("run", deck).stdout
    rows: dict[str, tuple[float, ...]] = {}
    for line in out.splitlines():
        match = re.match(r" ([a-z ]+?) +([\d.]+) +([\d.]+) % +([\d.]+)", line)
        if match:
            rows[match[1]] = tuple(float(match[k]) for k in (2, 3, 4))
    assert list(rows) == ["peridynamic", "contact search", "total"]
    # 0.5 s and 0.25 s over 20 steps
    assert (rows["peridynamic"][0], rows["peridynamic"][2]) == (0.5, 25_000.0)
    assert (rows["contact search"][0], rows["contact search"][2]) == (0.25, 12_500.0)


def test_run_options_reach_the_model(deck: Path, tmp_path: Path) -> None:
    folder = tmp_path / "a" / "b"
    result = peridem(
        "run", deck, "--threads", 3, "--steps", 5, "--compatibility", "original", "--output", folder
    )  # fmt: skip
    assert result.exit_code == 0
    assert {path.name for path in folder.glob("*.vtu")} == {"output_0.vtu", "output_1.vtu"}
    log = (folder / "peridem.log").read_text()
    assert "threads: 3" in log
    assert "compatibility original" in log
    assert "steps asked for: 5" in log


def test_run_of_no_steps_writes_the_start(deck: Path) -> None:
    result = peridem("run", deck, "--steps", 0)
    assert result.exit_code == 0
    assert (deck.parent / "out" / "output_0.vtu").exists()
    assert "us/step" not in result.stdout  # nothing to divide by


def test_quiet_run_prints_nothing(deck: Path) -> None:
    result = peridem("run", deck, "--quiet")
    assert (result.exit_code, result.output) == (0, "")
    assert "finished after step 20" in (deck.parent / "out" / "peridem.log").read_text()


def test_log_holds_deck_facts_notes_and_times(deck: Path) -> None:
    peridem("run", deck)
    lines = (deck.parent / "out" / "peridem.log").read_text().splitlines()
    assert lines[0] == f"peridem {__version__}"
    assert lines[1] == f"deck: {deck} (sha256 {'5' * 64})"
    assert "bodies: 2 (1 particle, 1 wall)" in lines
    assert "note: input.yaml:9: Hpx: without effect" in lines
    assert "finished after step 20, t = 20 us; 2 of 6 bonds are broken" in lines
    assert any(re.match(r"time: peridynamic +0\.500 s .* 25000\.0 us/step", line) for line in lines)


def test_warnings_are_printed_by_a_quiet_run_too(
    deck: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(FakeModel, "warnings", ["input.yaml:3: time step = 1: is above 0.5"])
    line = "warning: input.yaml:3: time step = 1: is above 0.5\n"
    assert peridem("run", deck, "--quiet").stderr == line
    assert line in (deck.parent / "out" / "peridem.log").read_text()
    assert line in peridem("check", deck).stdout


def test_files_of_an_earlier_run_are_named_and_kept(deck: Path) -> None:
    peridem("run", deck)
    out = peridem("run", deck, "--steps", 5).stdout
    assert "Note: 3 vtu files of an earlier run are left in the folder (output_2.vtu, ...)" in out
    assert (deck.parent / "out" / "output_4.vtu").exists()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["run"], "Missing argument 'DECK'"),
        (["run", "nowhere.yaml"], "'nowhere.yaml' does not exist"),
        (["run", "DECK", "--threads", "0"], "0 is not in the range x>=1"),
        (["run", "DECK", "--threads", "two"], "'two' is not a valid integer"),
        (["run", "DECK", "--steps", "-1"], "-1 is not in the range x>=0"),
        (["run", "DECK", "--compatibility", "new"], "'new' is not one of 'original', 'corrected'"),
        (["run", "DECK", "--outputs", "x"], "No such option"),
        (["rum", "DECK"], "No such command 'rum'"),
    ],
)
def test_wrong_usage_is_exit_code_2(deck: Path, arguments: list[str], message: str) -> None:
    result = peridem(*(deck if a == "DECK" else a for a in arguments))
    assert result.exit_code == 2
    assert message in result.stderr
    assert result.stdout == ""


@pytest.mark.parametrize("command", ["run", "check"])
def test_bad_deck_is_exit_code_2_with_the_message_on_stderr(deck: Path, command: str) -> None:
    deck.write_text("bad")
    result = peridem(command, deck)
    assert result.exit_code == 2
    assert result.stdout == ""
    assert result.stderr == (
        "peridem: error: input.yaml:1: Model = bad: must be a block; write it\nsecond line\n"
    )
    assert not (deck.parent / "out").exists()


def test_folder_that_cannot_be_made_is_exit_code_2(deck: Path, tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    result = peridem("run", deck, "--output", tmp_path / "file" / "out")
    assert result.exit_code == 2
    assert "cannot be written" in result.stderr and "--output" in result.stderr


@pytest.mark.parametrize(
    ("failure", "code", "ending"),
    [
        (NumericalError("step 8: node 3: speed = nan"), 3, "Stopped by a numerical failure"),
        (KeyboardInterrupt(), 130, "Stopped by Ctrl-C"),
        (InputError("output_1.vtu: disk full; free some"), 2, "Stopped by an error"),
        (MemoryError(), 2, "Stopped by an error"),
        (Terminated(), 143, "Stopped by SIGTERM"),  # 128 + 15, the shell's code
    ],
)
def test_failure_in_a_run_says_what_was_written(
    deck: Path, monkeypatch: pytest.MonkeyPatch, failure: BaseException, code: int, ending: str
) -> None:
    monkeypatch.setattr(FakeModel, "failure", failure)
    result = peridem("run", deck, "--quiet")
    assert result.exit_code == code
    assert f"{ending} after step 7, t = 7 us" in result.stderr
    assert "2 vtu files in" in result.stderr
    if isinstance(failure, ValueError | NumericalError):
        assert str(failure) in result.stderr
    log = (deck.parent / "out" / "peridem.log").read_text()
    assert f"{ending[0].lower()}{ending[1:]} after step 7" in log


def test_interrupted_before_the_first_file_does_not_claim_older_ones(
    deck: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    peridem("run", deck)

    def run(self: FakeModel, **_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(FakeModel, "run", run)
    assert "No vtu files were written" in peridem("run", deck).stderr


def test_check_describes_the_deck_and_writes_nothing(deck: Path) -> None:
    result = peridem("check", deck)
    assert result.exit_code == 0
    out = result.stdout
    for text in (
        "bodies: 2 (1 particle, 1 wall)",
        "nodes: 6",
        "memory: 12.3 kB",
        "memory predicted before the bonds: about 12 kB, 6 nodes and 6 bonds "
        "(Zone_1 7 kB, Zone_2 5 kB)",
        "time: 20 steps of 1e-06 s, up to 20 us",
        "stable time step: about 1e-05 s; the deck's is 0.1 times that",
        # 6 nodes, 5 files, 3 coordinates and 4 values of 8 bytes each
        "output: 5 vtu files, one every 5 steps, at most about 1.68 kB in all",
        "note: input.yaml:9: Hpx: without effect",
    ):
        assert text in out
    assert re.search(r"Zone_1 +particle +circle +PDState +1 +3 +3 +0\.0001 +0\.0004 +4 ", out)
    assert re.search(r"Zone_2 +wall +- +PMBBond +1 +3 +3 +0\.0002 +0\.0004 +2 ", out)
    assert "h [m]" in out and "horizon [m]" in out
    assert sorted(path.name for path in deck.parent.iterdir()) == ["input.yaml"]


def test_check_refuses_a_deck_larger_than_the_machine_before_it_builds_bonds(
    deck: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def init(self: FakeModel) -> None:
        raise AssertionError("bonds are built")

    monkeypatch.setattr(FakeModel, "init", init)
    monkeypatch.setattr(cli, "machine_memory", lambda: 11_999.0)
    result = peridem("check", deck)
    assert result.exit_code == 2
    assert "most of it Zone_1 with 3 nodes of about 3 neighbours" in result.stderr


def test_demo_breaks_the_struck_grain_in_two(tmp_path: Path) -> None:
    models = []

    class Spy(DEMModel):
        def run(self, *arguments: Any, **options: Any) -> None:
            models.append(self)
            super().run(*arguments, **options)

    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(tmp_path)
        patch.setattr(cli, "DEMModel", Spy)
        result = peridem("demo")
    assert result.exit_code == 0
    files = {"peridem_demo.png", "output_demo.pvd", "output_demo_bodies.csv", "peridem.log"}
    files |= {f"output_demo_{k}.vtu" for k in range(41)}  # 5200 steps, one file every 130
    assert {path.name for path in tmp_path.iterdir()} == files
    assert "Look at peridem_demo.png" in result.stdout
    assert "In ParaView open output_demo.pvd" in result.stdout
    # Pieces: nodes that intact bonds hold together. The two halves of the drum, about 350
    # nodes each, and the whole disc are large; the rest is dust.
    (model,) = models
    bonds, (drum, disc) = model.bonds, model.particles
    graph = csr_array(tuple(map(np.array, (bonds.intact, bonds.indices, bonds.offsets))))
    graph.eliminate_zeros()
    piece = connected_components(graph, directed=False)[1]
    assert len(set(piece[disc.start : disc.stop])) == 1
    sizes = np.sort(np.bincount(piece[drum.start : drum.stop]))[::-1]
    assert sizes[1] > 250
    assert sizes[2] < 30


def test_progress_without_a_terminal_is_a_line_now_and_then(
    deck: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(runlog, "LINE_SECONDS", 0.0)
    lines = [line for line in peridem("run", deck).stderr.splitlines() if "steps/s" in line]
    assert len(lines) == N_STEPS + 1
    assert re.fullmatch(r"step 20 of 20, t = 20 us, \d+ steps/s, 0 s left", lines[-1])


def test_progress_on_a_terminal_is_a_bar() -> None:
    screen = io.StringIO()
    console = Console(file=screen, force_terminal=True, width=120)
    with show_progress(console, 0, 20) as progress:
        progress(SimpleNamespace(n=10, time=1e-5))
    text = re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", screen.getvalue())
    assert "10/20 steps" in text and "t = 10 us" in text and "steps/s" in text


COMMAND = [sys.executable, "-c", "from peridem.cli import main; main()"]


@pytest.mark.parametrize("arguments", [["check", DEMO_DECK], ["--version"], ["check", "--help"]])
def test_full_standard_output_is_one_line(arguments: list[object]) -> None:
    with Path("/dev/full").open("w") as full:  # every write there fails with "no space left"
        result = subprocess.run(
            [*COMMAND, *map(str, arguments)],
            stdout=full,
            stderr=subprocess.PIPE,
            text=True,
            check=False,
        )
    assert result.returncode == 2
    assert result.stderr == (
        "peridem: error: the standard output: No space left on device; free some space, or write "
        "elsewhere\n"
    )


def test_closed_pipe_ends_quietly() -> None:
    read, written = os.pipe()
    os.close(read)
    result = subprocess.run(
        [*COMMAND, "check", str(DEMO_DECK)],
        stdout=written,
        stderr=subprocess.PIPE,
        text=True,
        check=False,
    )
    os.close(written)
    assert (result.returncode, result.stderr) == (1, "")


def test_full_output_does_not_hide_why_a_run_failed(
    deck: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(FakeModel, "failure", NumericalError("step 8: node 3: speed = nan"))

    def no_space(*_: object, **__: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(cli, "timing_table", no_space)
    result = peridem("run", deck)
    assert result.exit_code == 3
    assert "node 3: speed = nan" in result.stderr
    assert "time: total" in (deck.parent / "out" / "peridem.log").read_text()


def test_deck_refused_by_init_leaves_the_log_of_an_earlier_run(
    deck: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    peridem("run", deck)
    log = deck.parent / "out" / "peridem.log"
    before = log.read_bytes()

    def overlap(self: FakeModel) -> None:
        raise InputError("input.yaml: bodies 0 and 1: overlap at the start; move them apart")

    monkeypatch.setattr(FakeModel, "init", overlap)
    result = peridem("run", deck)
    assert (result.exit_code, result.stdout) == (2, "")
    assert log.read_bytes() == before


def test_run_that_its_criterion_stopped_does_not_ask_to_go_on(
    deck: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(FakeModel, "stop_reason", "Output_Criteria: far enough")
    monkeypatch.setattr(FakeModel, "last_checkpoint", deck.parent / "out" / "checkpoint_5.h5")
    result = peridem("run", deck, "--steps", 5)
    assert result.exit_code == 0
    assert "Stopped by Output_Criteria after step 5" in result.stdout
    assert "peridem resume" not in result.stdout


def test_log_continues_where_it_is_told_to(tmp_path: Path) -> None:
    for append in (False, False, True):
        with RunLog(tmp_path / "a.log", append=append) as log:
            log.write("line")
    assert (tmp_path / "a.log").read_text() == "line\nline\n"


def test_log_survives_a_full_disk() -> None:
    with RunLog(Path("/dev/full")) as log:  # every write there fails with "no space left"
        log.write("line")


def test_timing_rows_add_up_to_the_wall_time() -> None:
    rows = timing_rows({"a_b": 1.0, "c": 2.0, "d": 0.0}, 4.0, 100)
    assert rows == [
        ("c", 2.0, 0.5, 20_000.0),
        ("a b", 1.0, 0.25, 10_000.0),
        ("other", 1.0, 0.25, 10_000.0),
        ("total", 4.0, 1.0, 40_000.0),
    ]


@pytest.mark.parametrize(
    ("seconds", "text"),
    [(0.0, "0 s"), (2.5, "2.5 s"), (1.25e-3, "1.25 ms"), (8e-5, "80 us"), (3e-8, "30 ns")],
)
def test_time_text_has_a_fitting_unit(seconds: float, text: str) -> None:
    assert time_text(seconds) == text


@pytest.mark.parametrize(
    ("count", "text"),
    [(12, "12 bytes"), (951_678, "952 kB"), (4e6, "4 MB"), (2.5e12, "2.5e+03 GB")],
)
def test_bytes_text_has_a_fitting_unit(count: float, text: str) -> None:
    assert bytes_text(count) == text
