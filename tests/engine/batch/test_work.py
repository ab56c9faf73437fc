"""The work on one shot: nothing is lost, and nothing is done twice."""

import json
import threading
import time
from dataclasses import replace

import psutil

from smokelift.batch import finish_shot, finished_frames, look_at_shot, read_state
from smokelift.batch.work import Patience

SHORT = Patience(pause=0.05, longest_pause=0.05, total=5.0)


def test_a_finished_shot_is_not_run_again(make_shot, fake, ledger) -> None:
    shot = make_shot(frames=3)
    record = finish_shot(shot, threading.Event(), engine=fake)
    assert (record.status, record.sentence, record.notes) == ("done", "Finished.", ("A fake.",))
    assert read_state(shot).finished
    again = finish_shot(shot, threading.Event(), engine=fake)
    assert (again.runs, ledger(shot)) == (1, [1, 2, 3])


def test_a_shot_whose_options_changed_is_run_again(make_shot, fake) -> None:
    shot = make_shot()
    finish_shot(shot, threading.Event(), engine=fake)
    assert not read_state(replace(shot, options=("--quality=fine",))).finished
    shot.input.write_text(shot.input.read_text() + " ")
    assert not read_state(shot).finished


def test_after_a_crash_the_next_run_goes_on(make_shot, fake, ledger) -> None:
    shot = make_shot(frames=4, n3="crash")
    record = finish_shot(shot, threading.Event(), engine=fake)
    assert record.status == "crashed"
    assert "signal 6" in record.sentence
    assert finish_shot(shot, threading.Event(), engine=fake).status == "done"
    assert ledger(shot) == [1, 2, 3, 4]


def test_what_the_engine_refuses_is_not_tried_again(make_shot, fake) -> None:
    shot = make_shot(n2="refuse")
    record = finish_shot(shot, threading.Event(), engine=fake)
    assert (record.status, record.runs, record.sentence) == ("refused", 1, "It cannot be done.")


def test_a_full_disk_is_waited_for(make_shot, fake, tmp_path, ledger) -> None:
    full = tmp_path / "full"
    full.touch()
    shot = make_shot(n2=str(full))
    said: list[str] = []

    def hear(text: str) -> None:
        said.append(text)
        if len(said) == 2:
            full.unlink()

    record = finish_shot(shot, threading.Event(), hear, SHORT, fake)
    assert (record.status, ledger(shot)) == ("done", [1, 2, 3])
    assert said[0] == "shot: The disk is full. It is tried again in 0 s."


def test_two_that_work_on_one_shot_do_it_once(make_shot, fake, ledger) -> None:
    shot = make_shot(frames=4, seconds=0.05)
    records = []
    threads = [
        threading.Thread(
            target=lambda: records.append(finish_shot(shot, threading.Event(), patience=SHORT, engine=fake))
        )
        for _ in range(3)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert [record.status for record in records] == ["done"] * 3
    assert ledger(shot) == [1, 2, 3, 4]


def test_a_stopped_shot_ends_and_its_frames_stay(make_shot, fake) -> None:
    shot = make_shot(frames=1000, seconds=0.02)
    stop = threading.Event()
    threading.Timer(0.4, stop.set).start()
    assert finish_shot(shot, stop, engine=fake).status == "cancelled"
    there = finished_frames(shot).count
    assert 0 < there < 1000
    time.sleep(0.1)
    assert finished_frames(shot).count == there
    assert not [child for child in psutil.Process().children() if "fake_engine" in " ".join(child.cmdline())]


def test_a_shot_is_forecast_once(make_shot, fake) -> None:
    shot = make_shot(frames=5, memory=300)
    record = look_at_shot(shot, threading.Event(), fake)
    assert json.loads((shot.folder / "shot.json").read_text())["forecast"] == {
        "frames": 5,
        "seconds": 10,
        "memory": 300,
    }
    assert look_at_shot(shot, threading.Event(), ("no such command",)) == record
    assert finish_shot(shot, threading.Event(), engine=fake).forecast == record.forecast
