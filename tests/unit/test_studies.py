"""Parameter studies: what is run, what is kept, what is said."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pandas
import peridem as pd
import pytest

SCRIPT = """
import sys, time
from pathlib import Path
import peridem as pd

LOG = Path(sys.argv[2])

def run(a, pause=0.0):
    if a > int(sys.argv[3]):
        time.sleep(60)
    with LOG.open("a") as stream:
        stream.write(f"{a} ")
    return {"square": a * a}

print(pd.study(run, a=[1, 2, 3, 4], folder=sys.argv[1], workers=1)["square"].tolist())
"""
# no `if __name__ == "__main__"`: the processes of a study do not run the script again


def add(a: float, b: float = 1.0) -> dict[str, Any]:
    if a == 13:
        raise ValueError("unlucky\nnumber")
    return {"sum": a + b, "kind": "large" if a > 1 else "small"}


def dies(a: int) -> dict[str, Any]:
    if a == 2:
        os.kill(os.getpid(), signal.SIGKILL)
    return {"threads": os.environ["PERIDEM_THREADS"], "process": os.getpid()}


def test_study_runs_all_combinations_in_order() -> None:
    table = pd.study(add, a=[2, 1], b=np.array([0.5, 0.25]), workers=0)
    assert table["a"].tolist() == [2, 2, 1, 1]
    assert table["sum"].tolist() == [2.5, 2.25, 1.5, 1.25]
    assert table["kind"].tolist() == ["large", "large", "small", "small"]
    assert set(table["status"]) == {"done"}
    assert list(table)[:3] == ["a", "b", "sum"]


def test_study_takes_rows_of_any_kind() -> None:
    rows = [{"a": 1, "b": 2}, {"a": 3, "b": 4}]
    listed = pd.study(add, rows, workers=0)
    framed = pd.study(add, pandas.DataFrame(rows), workers=0)
    assert listed["sum"].tolist() == framed["sum"].tolist() == [3, 7]
    # numbers of NumPy, and 1.0 for 1, are the same parameters
    assert listed["id"].tolist() == framed["id"].tolist()
    crossed = pd.study(add, [{"a": 1}, {"a": 2}], b=[10, 20], workers=0)
    assert crossed["sum"].tolist() == [11, 21, 12, 22]


def test_study_records_failures_and_dead_processes() -> None:
    with pytest.warns(pd.StudyWarning, match="1 of 3 sets failed.*unlucky / number"):
        table = pd.study(add, a=[1, 13, 2], workers=0)
    assert table["status"].tolist() == ["done", "failed", "done"]
    assert table["error"][1] == "ValueError: unlucky / number"
    with pytest.warns(pd.StudyWarning, match="1 of 3 sets failed.*SIGKILL"):
        table = pd.study(dies, a=[1, 2, 3], workers=1, threads=3)
    assert table["status"].tolist() == ["done", "failed", "done"]
    assert "SIGKILL" in table["error"][1]
    assert table["threads"].tolist()[::2] == [3, 3]
    # another process has taken the place of the dead one
    assert table["process"][0] != table["process"][2]


def test_study_stops_on_error_when_asked(tmp_path: Path) -> None:
    with pytest.raises(pd.InputError, match=r"'a': 13.*unlucky"):
        pd.study(add, a=[1, 13, 2], workers=0, stop_on_error=True, folder=tmp_path)
    assert pandas.read_csv(tmp_path / "study.csv")["a"].tolist() == [1, 13]


def test_study_resumes_by_parameters(tmp_path: Path) -> None:
    calls = []

    def run(a: int, b: float) -> dict[str, float]:
        calls.append((a, b))
        if a == 0 and len(calls) < 3:
            raise ValueError("not yet")
        return {"ratio": b / 3 + a}

    with pytest.warns(pd.StudyWarning, match="not yet"):
        first = pd.study(run, a=[0, 1], b=0.1, folder=tmp_path, workers=0)
    assert first["status"].tolist() == ["failed", "done"]
    # The order is another one, a set is new, the one that failed is run again.
    again = pd.study(run, b=0.1, a=[2, 1, 0], folder=tmp_path, workers=0)
    assert calls == [(0, 0.1), (1, 0.1), (2, 0.1), (0, 0.1)]
    assert again["ratio"].tolist() == [0.1 / 3 + 2, 0.1 / 3 + 1, 0.1 / 3]  # the same bits
    assert again["id"].tolist()[::-1][:2] == first["id"].tolist()
    stored = pandas.read_csv(tmp_path / "study.csv")
    assert sorted(stored["id"]) == sorted(again["id"])
    assert again.columns.tolist() == ["b", "a", "ratio", "status", "error", "seconds", "id"]


def test_study_notes_a_changed_function(tmp_path: Path) -> None:
    pd.study(lambda a: {"b": a + 1}, a=[1], folder=tmp_path, workers=0)
    with pytest.warns(pd.StudyWarning, match="1 rows.*another source.*rerun='changed'"):
        kept = pd.study(lambda a: {"b": a + 2}, a=[1, 5], folder=tmp_path, workers=0)
    assert kept["b"].tolist() == [2, 7]
    stored = pandas.read_csv(tmp_path / "study.csv")
    assert stored["source"][0] != stored["source"][1]
    new = pd.study(lambda a: {"b": a + 3}, a=[1], folder=tmp_path, workers=0, rerun="changed")
    assert new["b"].tolist() == [4]


def test_study_survives_a_torn_row(tmp_path: Path) -> None:
    pd.study(add, a=[1, 2], folder=tmp_path, workers=0)
    path = tmp_path / "study.csv"
    whole = path.read_text()
    path.write_text(whole[: whole.rindex(",done")])
    table = pd.study(add, a=[1, 2], folder=tmp_path, workers=0)
    assert table["sum"].tolist() == [2, 3]
    assert path.read_text().count("\n") == 3


def test_study_goes_on_after_interrupt_and_kill(tmp_path: Path) -> None:
    script, log = tmp_path / "script.py", tmp_path / "log"
    script.write_text(SCRIPT)
    command = [sys.executable, str(script), str(tmp_path / "out"), str(log)]
    table = tmp_path / "out" / "study.csv"
    # The first time it hangs in the second set, the second time in the third.
    for finished, number in [(1, signal.SIGINT), (2, signal.SIGKILL)]:
        process = subprocess.Popen([*command, str(finished)], stderr=subprocess.PIPE, text=True)
        deadline = time.monotonic() + 60
        while not table.exists() or table.read_text().count("\n") <= finished:
            assert process.poll() is None
            assert time.monotonic() < deadline
            time.sleep(0.02)
        process.send_signal(number)
        _, said = process.communicate(timeout=30)
        assert process.returncode != 0
        assert ("KeyboardInterrupt" in said) == (number == signal.SIGINT)
    done = subprocess.run([*command, "9"], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[1, 4, 9, 16]"
    assert log.read_text().split() == ["1", "2", "3", "4"]


def test_study_gives_a_folder_for_output(tmp_path: Path) -> None:
    def run(a: int, output: Path) -> dict[str, str]:
        (output / "notes.txt").write_text(str(a))
        return {"where": str(output)}

    table = pd.study(run, a=[7], folder=tmp_path, workers=0)
    assert Path(table["where"][0]) == tmp_path / table["id"][0]
    assert (tmp_path / table["id"][0] / "notes.txt").read_text() == "7"


def test_study_keeps_a_second_one_out(tmp_path: Path) -> None:
    def run(a: int) -> dict[str, int]:
        if a == 1:
            pd.study(add, a=[1], folder=tmp_path, workers=0)
        return {}

    with pytest.warns(pd.StudyWarning, match="1 of 1 sets failed"):
        table = pd.study(run, a=[1], folder=tmp_path, workers=0)
    assert "another study is running there" in table["error"][0]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"a": [1], "c": 2}, "c: add.. has no such parameter; known are a, b"),
        ({"b": [1]}, "a: add.. needs it; give a value or a list of values"),
        ({"a": []}, r"a = \[\]: is empty"),
        ({}, "parameters: missing; give rows"),
        ({"a": [1, 1.0]}, r"rows\[1\].*the same as rows\[0\].*seed"),
        ({"a": [object()]}, "a = .*must be a number, text"),
        ({"a": [1], "seconds": 2}, "seconds: is the name of a column"),
        ({"rows": {"a": 1}}, "rows = .*must be a DataFrame or a list of dicts"),
        ({"rows": [3]}, r"rows\[0\] = 3: must be a dict"),
        ({"rows": [{"a": 1}], "a": 1}, "a: is a column of rows and given besides"),
        ({"a": 1, "workers": -1}, "workers = -1: must be a whole number, at least 0"),
        ({"a": 1, "rerun": "fail"}, "rerun = 'fail'.*did you mean failed"),
    ],
)
def test_study_says_what_is_wrong(arguments: dict[str, Any], message: str) -> None:
    with pytest.raises(pd.InputError, match=f"study: {message}"):
        pd.study(add, **arguments)


def test_study_says_what_results_may_be() -> None:
    for given, message in [
        (3, "returns 3: must be a dict"),
        ({"a": 1}, "result 'a': the table has such a column"),
        ({"x": np.ones(3)}, "result 'x'.*must be a number or text"),
    ]:
        with pytest.raises(pd.InputError, match=message):
            pd.study(lambda a, given=given: given, a=1, workers=0, stop_on_error=True)


def test_study_refuses_another_table(tmp_path: Path) -> None:
    (tmp_path / "study.csv").write_text("x,y\n1,2\n")
    with pytest.raises(pd.InputError, match=r"study.csv: is no table of a study.*x, y"):
        pd.study(add, a=1, folder=tmp_path, workers=0)


@pytest.mark.parametrize("method", ["latin_hypercube", "sobol", "random"])
def test_sample_fills_its_ranges(method: str) -> None:
    arguments: dict[str, Any] = {
        "mu": (0.2, 0.6), "speed": ("log", 0.1, 10.0), "n": ("whole", 1, 4), "kind": ["a", "b"],
    }  # fmt: skip
    rows = pd.sample(64, method=method, seed=3, **arguments)
    assert rows.equals(pd.sample(64, method=method, seed=3, **arguments))
    assert not rows.equals(pd.sample(64, method=method, seed=4, **arguments))
    assert rows["mu"].between(0.2, 0.6).all()
    assert rows["speed"].between(0.1, 10).all()
    assert set(rows["n"]) == {1, 2, 3, 4}
    assert set(rows["kind"]) == {"a", "b"}
    # One point in each of 64 equal parts, of the range and of its logarithm.
    strata = np.floor((rows["mu"] - 0.2) / 0.4 * 64), np.floor(np.log10(rows["speed"] * 10) * 32)
    for one in strata:
        assert (len(set(one)) == 64) == (method != "random")


def test_sample_says_what_is_wrong() -> None:
    for arguments, message in [
        ({"n": 0, "a": (0, 1)}, "n = 0: must be a whole number, at least 1"),
        ({"n": 2}, "ranges: missing"),
        ({"n": 2, "a": 1}, "a = 1: must be a range"),
        ({"n": 2, "a": (2, 1)}, "low must be below high"),
        ({"n": 2, "a": ("log", 0, 1)}, "a = 0: must be positive"),
        ({"n": 2, "a": (0, 1), "method": "sobool"}, "did you mean sobol"),
    ]:
        with pytest.raises(pd.InputError, match=message):
            pd.sample(arguments.pop("n"), **arguments)
