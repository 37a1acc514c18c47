"""What a run from Python tells and leaves: its start, its end, its stop, files of earlier runs."""

from __future__ import annotations

import io
import signal
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import peridem as pd
import pytest
from click.testing import CliRunner
from helpers import DeckFolder
from modelling_parts import two_discs
from peridem import telling
from peridem.cli import main
from peridem.interrupt import Terminated
from peridem.output import read_pvd, read_vtu
from peridem.telling import opening

DT = 1e-7  # of two_discs


class Screen(io.StringIO):
    """What takes itself for a terminal."""

    def isatty(self) -> bool:
        return True


def test_opening_names_steps_time_step_its_limit_and_sizes() -> None:
    model = two_discs()
    model.init()
    limits = model.stable_time_step()
    assert limits.contact < limits.bonds
    # two discs of 127 nodes (helpers.disc_mesh), 250 steps of 1e-7 s
    assert opening(model, 250) == (
        f"peridem: 250 steps of 1e-07 s, {DT / limits.contact:.2g} of the stable one, which "
        f"contact limits; to t = 25 us; 2 bodies, 254 nodes, {len(model.bonds.intact) // 2} bonds"
    )


def test_opening_names_springs_of_broken_bonds_where_they_limit_the_time_step() -> None:
    model = two_discs(dt=None)
    model.set_contact(stiffness_factor=0.01)
    model.init()
    limits = model.stable_time_step()
    assert limits.self_contact < 0.9 * min(limits.bonds, limits.contact)
    # the default: half of the stable one
    said = "0.5 of the stable one, which springs between the ends of broken bonds limit; to t"
    assert said in opening(model, 10)


def test_progress_is_shown_when_asked_for_and_not_in_tests(
    capsys: pytest.CaptureFixture[str],
) -> None:
    model = two_discs()
    model.run(until=1e-6)
    assert capsys.readouterr() == ("", "")
    model.run(until=3e-6, progress=True)
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith("peridem: 20 steps of 1e-07 s, ")
    model.run(until=4e-6, progress=False)
    assert capsys.readouterr() == ("", "")
    with pytest.raises(pd.InputError, match="run: progress = 'yes': must be True, False or"):
        model.run(until=5e-6, progress="yes")  # type: ignore[arg-type]


@pytest.mark.parametrize("every", [30, 3.0e-6])
def test_last_state_is_written_and_recorded_whatever_the_interval(
    tmp_path: Path, every: float
) -> None:
    model = two_discs()
    result = model.run(until=1e-5, output=tmp_path, every=every, record=["momentum"])
    entries = read_pvd(tmp_path / "output.pvd")
    assert [path.name for _, path in entries] == [f"output_{k}.vtu" for k in range(5)]
    assert [round(time / DT) for time, _ in entries] == [0, 30, 60, 90, 100]
    last = read_vtu(entries[-1][1])
    assert last["step"] == 100
    assert np.array_equal(last["arrays"]["Velocity"], model.state.v)
    assert result.series["step"].tolist() == [0, 30, 60, 90, 100]
    mass = model.state.density * model.state.volume
    assert result.momentum["py"].iloc[-1] == pytest.approx(mass @ model.state.v[:, 1], rel=1e-12)


def test_run_that_goes_on_replaces_the_state_at_the_end_of_its_first_part(tmp_path: Path) -> None:
    model = two_discs()
    model.run(until=1e-5, output=tmp_path / "parts", every=30)
    model.run(until=1.4e-5, output=tmp_path / "parts", every=30)
    two_discs().run(until=1.4e-5, output=tmp_path / "whole", every=30)
    parts, whole = (read_pvd(tmp_path / name / "output.pvd") for name in ("parts", "whole"))
    assert [round(time / DT) for time, _ in parts] == [0, 30, 60, 90, 120, 140]
    for (_, one), (_, other) in zip(parts, whole, strict=True):
        assert one.read_bytes() == other.read_bytes()


def test_deck_keeps_to_its_output_steps_and_records_the_last(
    deck_folder: DeckFolder, tmp_path: Path
) -> None:
    model = deck_folder.model(deck_folder.grains())
    result = model.run(tmp_path, steps=7, every=5, record=["kinetic_energy"])
    assert {path.name for path in tmp_path.glob("*.vtu")} == {"output_0.vtu", "output_1.vtu"}
    assert len(read_pvd(tmp_path / "output.pvd")) == 2
    assert result.series["step"].tolist() == [0, 5, 7]


@pytest.mark.parametrize("name", ["every", "record_every", "callback_every"])
def test_interval_that_the_run_does_not_reach_is_told(name: str) -> None:
    options: dict[str, Any] = {name: 1000.0, "callback": lambda model: None}
    with pytest.warns(pd.PeridemWarning, match=f"^{name} = 1000.0: is longer than the run") as told:
        result = two_discs().run(until=1e-6, record=["momentum"], **options)
    assert len(told) == 1
    assert told[0].filename == __file__
    assert repr(result).endswith("; no folder; 1 warning, see summary>")
    two_discs().run(until=1e-6, **{**options, name: 1e-6})  # just reached: no warning


def test_warnings_are_raised_once() -> None:
    model = two_discs(dt=2e-6)
    with pytest.warns(pd.PeridemWarning, match="above the estimated stable one") as told:
        model.run(steps=1)
        model.run(steps=1)
    assert len(told) == len(model.warnings) >= 1


def stopped_by(number: int, at: int) -> Callable[[pd.DEMModel], None]:
    def stop(model: pd.DEMModel) -> None:
        if model.n == at:
            signal.raise_signal(number)

    return stop


def test_ctrl_c_says_where_the_checkpoint_is_and_how_to_go_on(tmp_path: Path) -> None:
    model = two_discs()
    with pytest.raises(KeyboardInterrupt) as caught:
        model.run(until=1e-5, output=tmp_path, callback=stopped_by(signal.SIGINT, 20), every=10)
    assert str(caught.value) == (
        f"stopped after step 20 of 100, t = 2 us; {tmp_path / 'checkpoint_20.h5'} is written: run "
        "the script again with run(..., resume=True)"
    )
    assert caught.value.__suppress_context__
    with pytest.raises(KeyboardInterrupt, match=r"nothing is saved: run\(output=\.\.\.\)"):
        two_discs().run(until=1e-5, callback=stopped_by(signal.SIGINT, 20), callback_every=10)


def test_sigterm_prints_where_the_checkpoint_is(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    stop = stopped_by(signal.SIGTERM, 20)
    with pytest.raises(Terminated) as caught:
        two_discs().run(until=1e-5, output=tmp_path, callback=stop, every=10)
    assert caught.value.code == 143
    assert capsys.readouterr().err == (
        f"peridem: SIGTERM: stopped after step 20 of 100, t = 2 us; "
        f"{tmp_path / 'checkpoint_20.h5'} is written: run the script again with "
        "run(..., resume=True)\n"
    )


def test_stop_of_the_users_own_reaches_him_unchanged(tmp_path: Path) -> None:
    def stop(model: pd.DEMModel) -> None:
        raise KeyboardInterrupt("mine")

    with pytest.raises(KeyboardInterrupt, match=r"^mine$"):
        two_discs().run(until=1e-5, output=tmp_path, callback=stop)


def test_new_run_sets_checkpoints_and_series_of_an_earlier_one_aside(tmp_path: Path) -> None:
    two_discs().run(
        until=1e-5, output=tmp_path, every=10, record=["momentum"], checkpoint_every=100
    )
    series = (tmp_path / "series.csv").read_bytes()
    with pytest.warns(pd.PeridemWarning) as told:
        two_discs().run(until=2e-6, output=tmp_path, every=10)
    assert [str(one.message).partition(";")[0] for one in told] == [
        f"files of an earlier run are in {tmp_path}: series.csv, checkpoint_100.h5",
        f"vtu files of an earlier run are left in {tmp_path}: 8 (output_10.vtu, ...)",
    ]
    assert (tmp_path / "series.csv.old").read_bytes() == series
    assert not (tmp_path / "series.csv").exists()
    assert not list(tmp_path.glob("*.h5"))
    with pytest.raises(pd.InputError, match="no such file"):
        pd.plot.plot_series(tmp_path)
    # the same again: nothing that was set aside is lost
    two_discs().run(until=1e-5, output=tmp_path, every=10, record=["momentum"])
    with pytest.warns(pd.PeridemWarning, match="series.csv; renamed"):
        two_discs().run(until=1e-5, output=tmp_path, every=10)
    assert (tmp_path / "series.csv.old").read_bytes() == series
    assert (tmp_path / "series.csv.old2").read_bytes() == series


def test_command_line_says_what_it_sets_aside(tmp_path: Path) -> None:
    deck = two_discs().to_deck(tmp_path / "deck", until=1e-6)
    out = tmp_path / "out"
    command = ["run", str(deck), "--output", str(out), "--checkpoint-every", "5", "--quiet"]
    assert CliRunner().invoke(main, command).stderr == ""
    again = CliRunner().invoke(main, command)
    assert again.stderr.startswith(f"warning: files of an earlier run are in {out}: checkpoint_")
    assert again.stdout == ""


def test_series_named_without_a_folder_is_in_the_output_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    record: dict[str, Any] = {"record": ["momentum"]}
    two_discs().run(until=1e-6, output="out", record_to="numbers.parquet", **record)
    two_discs().run(until=1e-6, record_to="numbers.csv", **record)
    two_discs().run(until=1e-6, output="out", record_to="./mine/numbers.csv", **record)
    found = {str(path.relative_to(tmp_path)) for path in tmp_path.rglob("numbers.*")}
    assert found == {"out/numbers.parquet", "numbers.csv", "mine/numbers.csv"}


def test_resume_on_the_command_line_refuses_to_lose_a_recording(tmp_path: Path) -> None:
    run: dict[str, Any] = {"output": tmp_path, "every": 10}
    two_discs().run(steps=100, **run, record=["momentum", "damage"], checkpoint_every=50)
    refused = CliRunner().invoke(main, ["resume", str(tmp_path)])
    assert refused.exit_code == 2
    assert "of a Python script that records momentum, damage" in refused.stderr
    assert "resume=True), or give --without-series" in refused.stderr
    options = ["--without-series", "--steps", "0", "--quiet"]
    assert CliRunner().invoke(main, ["resume", str(tmp_path), *options]).exit_code == 0
    with pytest.warns(pd.PeridemWarning, match="has recorded momentum, damage; give the same"):
        two_discs().run(until=1.2e-5, **run, resume=True)


def test_resume_with_the_recorders_goes_on_with_the_series(tmp_path: Path) -> None:
    run: dict[str, Any] = {"output": tmp_path, "every": 10, "record": ["momentum"]}
    two_discs().run(until=1e-5, **run, checkpoint_every=50)
    result = two_discs().run(until=1.2e-5, **run, resume=True)
    assert result.series["step"].tolist() == list(range(0, 121, 10))


def test_runs_of_a_study_show_no_bars_of_their_own(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("PYTEST_CURRENT_TEST")
    monkeypatch.setattr("sys.stderr", Screen())
    watched: list[bool] = []
    pd.study(lambda a: {"b": watched.append(telling._watched()) or 1}, a=1, workers=0)
    assert watched == [False]
    assert telling._watched()  # as before
