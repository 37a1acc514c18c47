"""Pictures of what runs write: fragments, force chains, units, and room for all words."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas
import peridem as pd
import pytest
from click.testing import CliRunner
from modelling_parts import two_discs
from peridem.cli import main
from peridem.diagnostics import contact_network, fragments
from peridem.errors import InputError
from peridem.plot import Snapshot, plot_series, render
from peridem.plot.chains import THICKEST

TAGS = ("Displacement", "Particle_ID", "Damage_Z", "Fragment_ID", "Contact_Network")


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> tuple[pd.DEMModel, Any]:
    """Two discs that hit each other at 20 m/s, the outputs of it, and the model at its end."""
    model = two_discs(velocity=(0.2, -20.0))
    folder = tmp_path_factory.mktemp("run") / "out"
    result = model.run(until=2e-5, every=50, output=folder, tags=TAGS, record=["kinetic_energy"])
    return model, result


def test_outputs_have_the_fragments_of_the_diagnostics(run: tuple[pd.DEMModel, Any]) -> None:
    model, result = run
    found = fragments(model)
    assert len(found) > 2  # more than the two discs: something has broken off
    state = Snapshot.from_vtu(result.folder / "output_4.vtu")
    np.testing.assert_array_equal(state.fields["Fragment_ID"], found.labels)
    first = Snapshot.from_vtu(result.folder / "output_0.vtu")
    np.testing.assert_array_equal(first.fields["Fragment_ID"], first.fields["Particle_ID"])
    figure: Any = render(result, "fragment")
    assert figure.axes[0].get_legend().get_title().get_text() == "Fragment"
    same: Any = render(model, "fragments")
    colours = [one.axes[0].collections[0].get_facecolor() for one in (figure, same)]
    np.testing.assert_array_equal(*colours)


def test_outputs_have_the_contacts_of_the_diagnostics(run: tuple[pd.DEMModel, Any]) -> None:
    model, result = run
    written = pandas.read_csv(result.folder / "contact_network_4.csv")
    network = contact_network(model).to_frame()
    pandas.testing.assert_frame_equal(written, network, check_dtype=False, rtol=1e-15)
    assert len(network) == 1 and network["normal_force"].iloc[0] > 0


def chain_lines(figure: Any) -> list[tuple[np.ndarray, float]]:
    """Corners and widths of the force chains in each picture."""
    found = []
    for axes in figure.axes:
        lines = [one for one in axes.collections if one.get_zorder() == 4]
        found += [
            (np.asarray(corners), width)
            for one in lines
            for corners, width in zip(one.get_segments(), one.get_linewidths(), strict=True)
        ]
    return found


def test_chains_of_a_model_and_of_its_outputs_are_the_contact_network(
    run: tuple[pd.DEMModel, Any],
) -> None:
    model, result = run
    network = contact_network(model)
    for source in (model, result):
        figure: Any = render(source, chains=True)
        ((corners, width),) = chain_lines(figure)
        # from mean place to mean place of the nodes, over the place of contact, in mm
        np.testing.assert_allclose(corners[1], 1e3 * network.places[0, :2], rtol=1e-12)
        assert width == THICKEST
        texts = [text.get_text() for text in figure.legends[0].get_texts()]
        assert f"{network.normal_force[0] / 1e3:.3g} kN/m" in texts


def test_chains_of_several_states_are_each_states_on_one_scale(
    run: tuple[pd.DEMModel, Any],
) -> None:
    _, result = run
    forces = []
    for k in range(5):
        table = pandas.read_csv(result.folder / f"contact_network_{k}.csv")
        forces += table.loc[table["normal_force"] > 0, "normal_force"].tolist()
    assert len(set(forces)) > 1
    widths = [width for _, width in chain_lines(render(result, chains=True, every=1))]
    np.testing.assert_allclose(widths, THICKEST * np.array(forces) / max(forces), rtol=1e-12)


def test_chains_end_at_walls_that_are_hidden() -> None:
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 2, 0], [1, 2, 0], [0, 3, 0]]) * 1e-3
    state = Snapshot(
        points,
        {"Damage_Z": np.zeros(6), "Particle_ID": np.repeat([0, 1], 3)},
        [("triangle", np.array([[0, 1, 2], [3, 4, 5]]))],
        np.repeat([True, False], 3),
        contacts=pandas.DataFrame({"i": [0], "j": [1], "force": [2.0]}),
    )
    ((corners, _),) = chain_lines(render(state, walls="hidden", chains=True))
    np.testing.assert_allclose(corners[0], [0, 1], atol=1e-12)  # the wall's nearest node, in mm


def test_outputs_without_contacts_are_refused_with_a_remedy(tmp_path: Path) -> None:
    two_discs().run(steps=2, output=tmp_path, tags=["Particle_ID", "Damage_Z"])
    with pytest.raises(InputError, match="have no forces of contact; run with the tag Contact_Net"):
        render(tmp_path, chains=True)
    assert render(tmp_path, chains=False) is not None


def test_contacts_of_an_earlier_run_go_with_its_outputs(tmp_path: Path) -> None:
    two_discs().run(steps=4, every=2, output=tmp_path, tags=TAGS)
    assert len(list(tmp_path.glob("contact_network_*.csv"))) == 3
    with pytest.warns(pd.PeridemWarning, match="vtu files of an earlier run are left"):
        two_discs().run(steps=2, every=2, output=tmp_path, tags=["Particle_ID"])
    assert [path.name for path in tmp_path.glob("contact_network_*.csv")] == [
        "contact_network_2.csv"  # its output is still there
    ]


def test_command_draws_chains_and_fragments(run: tuple[pd.DEMModel, Any], tmp_path: Path) -> None:
    _, result = run
    path = tmp_path / "p.png"
    options = ["--field", "fragment", "--size", "600", "400", "-o", str(path)]
    done = CliRunner().invoke(main, ["render", str(result.folder), *options])
    assert done.exit_code == 0, done.output
    without = path.read_bytes()
    done = CliRunner().invoke(main, ["render", str(result.folder), *options, "--chains"])
    assert done.exit_code == 0, done.output
    assert path.read_bytes() != without


def test_series_have_the_units_of_their_dimension(run: tuple[pd.DEMModel, Any]) -> None:
    _, result = run
    for source, unit in (
        (result, "J/m"),
        (result.folder, "J/m"),
        (result.series, "J, in 2D J/m"),
    ):
        figure: Any = plot_series(source)
        assert figure.axes[0].get_title(loc="left") == f"kinetic energy [{unit}]"


@pytest.mark.parametrize(
    "options",
    [
        {},
        {"walls": "hidden"},
        {"zoom": (-1e-3, 0, 1e-3, 0.3e-3)},
        {"zoom": (0, -1e-3, 0.3e-3, 3e-3)},
        {"size": (1200, 300)},
        {"size": (300, 900)},
        {"every": 2},
        {"every": 2, "chains": True},
        {"field": "fragment"},
    ],
    ids=str,
)
def test_titles_and_labels_stay_on_the_page(
    run: tuple[pd.DEMModel, Any], options: dict[str, Any]
) -> None:
    figure: Any = render(run[1], **options)
    figure.canvas.draw()
    renderer = figure.canvas.get_renderer()
    page = figure.bbox
    for part in (*figure.axes, *figure.legends):
        box = part.get_tightbbox(renderer)
        assert box.x0 >= page.x0 and box.y0 >= page.y0
        assert box.x1 <= page.x1 and box.y1 <= page.y1
