"""The work on one shot: nothing is lost, and nothing is done twice."""

import functools
import os
import signal
import subprocess
import sys
import threading
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import pytest

import smokelift
from smokelift.batch.shots import BatchShot, Record, is_finished, read_index, read_record
from smokelift.batch.work import finish_shot, has_room, inspect_shot, run_here

SECONDS = 120.0
"""Longest wait for a batch to end, for a machine that does much else."""

PYTHON = (sys.executable, "-c")


def finished(shot: BatchShot) -> bool:
    return is_finished(shot, read_record(shot))


@pytest.fixture
def finish(fake):
    """Work on a shot with the fake engine until it comes to an end."""
    return functools.partial(finish_shot, stop=threading.Event(), engine=fake)


def test_a_finished_shot_is_run_again_only_if_its_options_or_its_clip_changed(make_shot, finish, ledger) -> None:
    shot = make_shot(frames=3)
    record = finish(shot)
    assert (record.status, record.sentence, record.notes) == ("done", "Finished.", ["A fake."])
    again = finish(shot)
    assert (again.runs, ledger(shot)) == (1, [1, 2, 3])
    assert finished(shot) and not finished(replace(shot, options=("--quality=fine",)))
    shot.input.write_text(shot.input.read_text() + " ")
    assert not finished(shot)


@pytest.mark.parametrize(
    ("end", "status", "runs", "sentence", "done"),
    [("crash", "done", 2, "Finished.", [1, 2, 3, 4]), ("refuse", "refused", 1, "It cannot be done.", [1, 2])],
)
def test_a_crash_is_tried_again_and_a_refusal_is_not(make_shot, finish, ledger, end, status, runs, sentence, done):
    shot = make_shot(frames=4, n3=end)
    record = finish(shot)
    assert (record.status, record.runs, record.sentence) == (status, runs, sentence)
    assert ledger(shot) == done


def test_a_crash_is_tried_again_twice(make_shot) -> None:
    code = "import sys; print('loading', flush=True); print('no such thing', file=sys.stderr); sys.exit(5)"
    shot = make_shot()
    record = finish_shot(shot, threading.Event(), engine=(*PYTHON, code))
    assert (record.status, record.runs) == ("crashed", 3)
    assert record.sentence == "The engine ended by itself (status 5): no such thing"
    assert shot.file("log").read_text().count("no such thing") == 3


def test_a_full_disk_is_waited_for(make_shot, finish, tmp_path, ledger) -> None:
    full = tmp_path / "full"
    full.touch()
    shot = make_shot(n2=str(full))
    said: list[str] = []

    def hear(text: str) -> None:
        said.append(text)
        if len(said) == 2:
            full.unlink()

    record = finish(shot, say=hear, pause=0.05)
    assert (record.status, ledger(shot)) == ("done", [1, 2, 3])
    assert said[0] == "shot: The disk is full. It is tried again in 0 s."


def test_a_full_disk_is_waited_for_as_long_as_frames_come(make_shot, finish, tmp_path, ledger) -> None:
    """One try is allowed here without a new frame."""
    first, second = tmp_path / "first", tmp_path / "second"
    first.touch(), second.touch()
    shot = make_shot(n2=str(first), n3=str(second))
    said: list[str] = []

    def hear(text: str) -> None:
        said.append(text)
        first.unlink(missing_ok=True)

    record = finish(shot, say=hear, pause=0.0, retries={"stuck": 1})
    assert (record.status, record.runs, len(said), ledger(shot)) == ("stuck", 3, 2, [1, 2])


def test_two_that_work_on_one_shot_do_it_once(make_shot, finish, ledger) -> None:
    shot = make_shot(frames=4, seconds=0.05)
    with ThreadPoolExecutor(3) as pool:
        records = list(pool.map(functools.partial(finish, pause=0.05), [shot] * 3))
    assert [record.status for record in records] == ["done"] * 3
    assert ledger(shot) == [1, 2, 3, 4]


def test_a_stopped_shot_ends_and_its_frames_stay(make_shot, fake, engines, until) -> None:
    shot = make_shot(frames=1000, seconds=0.02)
    stop = threading.Event()
    with ThreadPoolExecutor() as pool:
        ended = pool.submit(finish_shot, shot, stop, engine=fake)
        until(lambda: read_index(shot).frames)
        stop.set()
    assert ended.result().status == "cancelled"
    assert not engines()
    assert 0 < len(read_index(shot).frames) < 1000


def test_a_shot_is_forecast_once(make_shot, fake) -> None:
    shot = make_shot(frames=5, memory=300)
    record = inspect_shot(shot, threading.Event(), fake)
    assert read_record(shot).forecast == {"frames": 5, "seconds": 10, "memory": 300}
    assert inspect_shot(shot, threading.Event(), ("no such command",)) == record
    assert finish_shot(shot, threading.Event(), engine=fake).forecast == record.forecast


def test_a_storage_that_fails_before_a_forecast_is_said(make_shot, fake) -> None:
    shot = make_shot()
    shot.folder.write_text("a file where the folder should be")
    record = inspect_shot(shot, threading.Event(), fake)
    assert (record.status, record.forecast) == ("stuck", None)
    assert str(shot.folder) in record.sentence


def test_a_log_that_cannot_be_written_stops_nothing(make_shot) -> None:
    if not Path("/dev/full").exists():
        pytest.skip("there is no full device here")
    shot = make_shot()
    shot.folder.mkdir()
    shot.file("log").symlink_to("/dev/full")
    engine = (*PYTHON, """print('{"event": "done", "text": "Made."}')""")
    assert finish_shot(shot, threading.Event(), engine=engine).sentence == "Made."


# shots side by side on one machine

DONE = Record(of={}, status="done")


@pytest.fixture
def shots(make_shot):
    """Make shots that need so much memory each."""
    return lambda *needs: {make_shot(f"shot{n}"): memory for n, memory in enumerate(needs)}


@pytest.mark.parametrize(
    ("needed", "taken", "room"),
    [(10, [], True), (40, [], True), (10, [10, 10], True), (11, [10, 10], False), (1, [1, 1, 1], False)],
)
def test_a_shot_starts_where_memory_and_a_worker_are_left_and_alone_whatever_it_needs(needed, taken, room) -> None:
    assert has_room(needed, taken, memory=30, workers=3) == room


@pytest.mark.parametrize(("memory", "at_a_time", "most"), [(30, 8, 3), (100, 2, 2), (5, 8, 1)])
def test_as_many_run_as_there_is_room_for(shots, memory, at_a_time, most) -> None:
    """None ends before so many have begun."""
    together = threading.Barrier(most)

    def work(_shot: BatchShot, _stop: threading.Event) -> Record:
        together.wait(SECONDS)
        return DONE

    ended = list(run_here(shots(*[10] * 6), work, memory, at_a_time))
    assert sorted(shot.name for shot, _ in ended) == [f"shot{n}" for n in range(6)]


def test_a_small_shot_overtakes_a_large_one(shots) -> None:
    order, both = [], threading.Barrier(2)

    def work(shot: BatchShot, _stop: threading.Event) -> Record:
        order.append(shot.name)
        if shot.name != "shot1":
            both.wait(SECONDS)
        return DONE

    list(run_here(shots(60, 60, 30), work, 100, 8))
    assert sorted(order[:2]) == ["shot0", "shot2"]


def test_leaving_early_ends_the_engines(make_shot, fake, engines, until) -> None:
    """The caller leaves after the first shot; of the others an engine has to be killed."""
    quick, gentle = make_shot("quick", frames=1), make_shot("gentle", frames=1000, seconds=0.02)
    stubborn = make_shot("stubborn", frames=1000, seconds=0.02, stubborn=True)
    task = functools.partial(finish_shot, engine=fake, grace=0.1)
    ended = run_here(dict.fromkeys((quick, gentle, stubborn), 0), task, 1, 3)
    assert next(ended)[0] == quick
    until(lambda: read_index(gentle).frames and read_index(stubborn).frames)
    assert len(engines()) == 2
    ended.close()
    assert not engines()
    assert not read_index(gentle).complete and not read_index(stubborn).complete


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no signals to send")
@pytest.mark.parametrize("number", ["SIGTERM", "SIGKILL"])
def test_a_batch_that_is_interrupted_leaves_no_engine(make_shot, engines, until, tmp_path, number) -> None:
    """Only the batch gets the signal. An engine that does not end by itself is killed, unless the batch is."""
    killed = number == "SIGKILL"
    shots = [make_shot(f"shot{n}", frames=1000, seconds=0.02, stubborn=n == 0 and not killed) for n in range(2)]
    path = tmp_path / "shots.toml"
    path.write_text("".join(f'[[shots]]\ninput = "{shot.input.name}"\n' for shot in shots))
    command = [sys.executable, str(Path(__file__).with_name("command_driver.py")), "batch", str(path), "--workers", "2"]
    environment = {**os.environ, "PYTHONPATH": str(Path(smokelift.__file__).parents[1])}
    with subprocess.Popen(command, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE) as batch:
        try:
            until(lambda: all(read_index(shot).frames for shot in shots))
            assert len(engines()) == 2
            batch.send_signal(signal.Signals[number])
            _, said = batch.communicate(timeout=SECONDS)
        finally:
            batch.kill()
    if killed:
        until(lambda: not engines())
    else:
        assert not engines()
        assert (batch.returncode, said) == (130, b"Cancelled.\n")
        assert [read_record(shot).status for shot in shots] == ["cancelled"] * 2
    assert not any(read_index(shot).complete for shot in shots)
