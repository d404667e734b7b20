"""Tests of tables, plots and the page of results, for policies in Python and built-in ones."""

import json
import logging
import re
import subprocess

import pytest
from test_evaluation import command, suite, write

from pogema_rs.toolbox.views import show

VIEWS = {
    "Means": {"type": "tabular", "drop_keys": ["seed", "map_name"]},
    "Costs": {"type": "plot", "x": "num_agents", "y": "SoC", "extension": "svg"},
}


@pytest.fixture(scope="module")
def played(tmp_path_factory):
    """A folder with results of LaCAM and of two policies in Python, one of which fails in half of the episodes."""
    folder = tmp_path_factory.mktemp("views")
    more = {
        "Crowd": {"name": "Crowded", "parallel_backend": "sequential"},
        "LaCAM": {"name": "LaCAM", "nodes": 100},
    }
    write(folder, {**suite(num_seeds=2, **more), "results_views": VIEWS})
    done = subprocess.run(
        [*command(folder), "", str(folder / "page.html")], capture_output=True, text=True, timeout=300
    )
    assert "EvaluationError: 4 episodes could not be played" in done.stderr, done.stderr
    return folder, done


def test_evaluation_prints_tables_and_writes_plots(played):
    folder, done = played
    assert done.stdout.startswith("Means\n")
    assert re.search(r"8 +┆ +LaCAM", done.stdout), done.stdout
    assert (folder / "out" / "views" / "Costs.svg").read_text().startswith("<svg")


def test_page_has_replays_of_policies_in_python(played):
    folder, _ = played
    page = (folder / "page.html").read_text()
    # Crowd is left out because some of its episodes failed, and the page says so.
    labels = re.findall(r'aria-label="replay episode (\d+) of ([^"]+)"', page)
    assert [name for _, name in labels] == ["A star"] * 6 + ["LaCAM"] * 6, labels
    assert "the replay differs" not in page
    assert "Crowd has 0 of 8" in page
    assert "Python 3." in page


def test_views_respect_their_options(played, tmp_path, caplog):
    folder, _ = played
    logger = logging.getLogger("pogema_rs.toolbox")
    logger.propagate = True
    with caplog.at_level(logging.WARNING, logger="pogema_rs.toolbox"):
        (means,) = show(folder / "out", names=["Means"], table_format="csv", out=tmp_path)
    assert "`Crowd` is not finished" in caplog.text
    head, *lines = means.tables[0].splitlines()
    assert head.startswith("Number of Agents,Algorithm,ISR,ISR low,ISR high,ISR n")
    assert len(lines) == 4 and means.files == []
    rows = json.loads((folder / "out" / "LaCAM.json").read_text())
    expected = sum(row["metrics"]["SoC"] for row in rows if row["env_grid_search"]["num_agents"] == 8) / 4
    (line,) = (line.split(",") for line in lines if line.startswith("8,LaCAM"))
    assert float(line[head.split(",").index("SoC")]) == expected
    (costs,) = show(folder / "out", names=["Costs"], plot_format="png", out=tmp_path)
    assert costs.files == [tmp_path / "Costs.png"] and costs.files[0].read_bytes().startswith(b"\x89PNG")


def test_wrong_options_are_reported(played, tmp_path):
    folder, _ = played
    for wrong, message in [
        ({"names": ["Mean"]}, "no view `Mean`; did you mean `Means`?"),
        ({"table_format": "word"}, "`table_format` is `word`, expected one of `terminal`"),
        ({"plot_format": "gif"}, "`plot_format` is `gif`, expected one of `svg`"),
        ({"six": "mine"}, "`six` is `mine`, expected one of `published`"),
        ({"config": tmp_path / "no.yaml"}, "no.yaml"),
    ]:
        with pytest.raises((ValueError, OSError), match=re.escape(message)):
            show(folder / "out", **wrong)
    with pytest.raises(ValueError, match="at least one folder"):
        show()
    with pytest.raises(ValueError, match="no views"):
        show(tmp_path)
