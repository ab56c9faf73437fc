"""Speed against accuracy: what is read from the CSV, which runs are on the front, and what cannot be drawn."""

from itertools import combinations
from pathlib import Path

import pytest

from benchmarks.accuracy.chart import chart, pareto_front
from benchmarks.accuracy.measured_runs import DEFAULT, Run, Runs, read_runs
from smokelift import Settings

HEADER = "scene,run,method,frames,seconds,psnr_new,density_error,velocity_error,machine,date\n"
ROWS = (
    "a,draft,default,24,0.5,20,0.9,0.7,box,2026-01-01\n"
    "b,draft,default,24,1.5,30,0.7,0.5,box,2026-01-02\n"
    "a,paper,paper,24,6,20,1.0,0.8,box,2026-01-01\n"
    "b,paper,paper,24,8,20,1.0,0.8,box,2026-01-01\n"
    "a,billboard,baseline,24,,20,,,box,2026-01-01\n"
    "b,billboard,baseline,24,,20,,,box,2026-01-01\n"
    "a,truth,reference,24,,60,,,box,2026-01-01\n"
)


def write(folder: Path, text: str = HEADER + ROWS) -> Path:
    path = folder / "runs.csv"
    path.write_text(text)
    return path


def test_runs_are_means_over_the_scenes(tmp_path) -> None:
    found = read_runs(write(tmp_path))
    draft, paper, billboard = found.runs  # a reference is not drawn
    assert (draft.name, draft.seconds) == ("draft", 1.0)
    assert draft.errors["view_error"] == pytest.approx(10 ** (-25 / 20))
    assert paper.seconds == 7
    assert billboard.seconds is None
    assert list(billboard.errors) == ["view_error"]
    assert found.caption == "a, b; 24 frames; box; 2026-01-01, 2026-01-02"


def test_the_default_is_what_a_user_gets_who_says_nothing(tmp_path) -> None:
    assert Settings().quality == DEFAULT
    given = (HEADER + ROWS).replace("draft", "balanced")
    assert read_runs(write(tmp_path)).default is None
    assert read_runs(write(tmp_path, given)).default.name == "balanced"
    chosen = ROWS.replace("draft", "balanced:resolution=auto").splitlines(keepends=True)[:2]
    assert read_runs(write(tmp_path, given + "".join(chosen))).default.name == "balanced:resolution=auto"


def test_no_label_lies_over_another_or_leaves_its_panel() -> None:
    pytest.importorskip("matplotlib")
    crowd = [f"{quality}:resolution={n}x{n}x{n}" for quality in ("draft", "balanced", "fine") for n in (32, 48, 64, 96)]
    names = [*crowd, "balanced:resolution=auto", *(f"balanced:detail={detail}" for detail in (0, 0.25, 0.5, 0.75))]
    error = dict.fromkeys(("view_error", "patches"), 0.07)
    runs = [
        Run(name, "8x8x96", 1 + 0.02 * index, {key: value + 1e-4 * index for key, value in error.items()})
        for index, name in enumerate(names)
    ]
    figure = chart(Runs((*runs, Run("billboard", "", None, error)), "crowded"))
    panels = [axes for axes in figure.axes if axes.axison]
    assert len(panels) == 2
    for axes in panels:
        window = axes.get_window_extent()
        boxes = [text.get_window_extent() for text in axes.texts]
        assert len(boxes) == len(runs) + 1
        assert not [1 for a, b in combinations(boxes, 2) if a.overlaps(b)]
        assert all(window.x0 <= box.x0 and box.x1 <= window.x1 for box in boxes)
        assert all(window.y0 <= box.y0 and box.y1 <= window.y1 for box in boxes)


def test_the_pareto_front() -> None:
    points = [(1.0, 5.0), (2.0, 3.0), (3.0, 4.0), (2.0, 6.0), (9.0, 1.0), (9.5, 1.0)]
    assert pareto_front(points) == [0, 1, 4]
    assert pareto_front([(1.0, 2.0), (1.0, 1.0)]) == [1]
    assert pareto_front([]) == []
