"""Jobs: what they make of everything that an engine can say or do. The engines here are scripts of a few lines."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from textwrap import indent

import pytest

import smokelift_command
from addon import job as module
from addon.job import EngineMissingError, Job, Queue, engine_command

PATIENCE = 30.0

FRAMES = """
import json
def say(event, **fields):
    print(json.dumps({"event": event, **fields}), flush=True)
say("note", text="Light not given.", doubt=False)
say("note", text="A cut.", doubt=True)
say("start", total=3, done=0)
for n in (1, 2, 3):
    say("frame", frame=n, done=n, total=3, seconds_left=2.0 * (3 - n), figures={"psnr": 40.0})
say("note", text="No smoke found.", doubt=True)
say("done", text="3 frames.", frames=3)
"""

POLITE = """
import json, sys, time
try:
    print(json.dumps({"event": "start", "total": 9, "done": 2}), flush=True)
    while True:
        time.sleep(0.01)
except KeyboardInterrupt:
    print(json.dumps({"event": "error", "text": "Cancelled.", "status": 130}), flush=True)
    sys.exit(130)
"""


@pytest.fixture
def log(tmp_path) -> Path:
    """Where jobs keep what was said."""
    return tmp_path / "logs" / "job.log"


@pytest.fixture
def engine(log) -> Iterator[Callable[[str], Job]]:
    """Makes jobs that run a script; none outlives its test."""
    made = []

    def make(script: str) -> Job:
        made.append(Job([sys.executable, "-I", "-c", script], log))
        return made[-1]

    yield make
    for job in made:
        job.kill()


@pytest.fixture
def own_engine(tmp_path, monkeypatch, log) -> Iterator[Callable[[str], Job]]:
    """Makes jobs that start a script in the engine's place as the add-on starts the engine."""
    made = []

    def make(script: str) -> Job:
        package = tmp_path / "site" / "smokelift"
        (package / "app").mkdir(parents=True)
        for folder in (package, package / "app"):
            (folder / "__init__.py").touch()
        (package / "app" / "cli.py").write_text(f"def main():\n{indent(script, '    ')}")
        shutil.copytree(Path(smokelift_command.__file__).parent, tmp_path / "site" / "smokelift_command")

        class Found:
            origin = str(package / "__init__.py")

        monkeypatch.setattr(module.importlib.util, "find_spec", lambda name: Found)
        made.append(Job(engine_command(["one", "two words"]), log))
        return made[-1]

    yield make
    for job in made:
        job.kill()


def until(condition: Callable[[], bool]) -> None:
    """Wait until something is so, but not for ever."""
    end = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < end, "nothing happened"
        time.sleep(0.005)


def finished(job: Job) -> Job:
    """Poll a job to its end."""
    if job.outcome == "waiting":
        job.start()
    until(lambda: (job.poll(), job.ended)[1])
    return job


# what an engine says


def test_progress(engine, log) -> None:
    """Frames, time left, notes and the last word; all of it in the log."""
    job = engine(FRAMES)
    assert (job.outcome, job.done, job.total, job.seconds_left) == ("waiting", 0, 0, None)
    finished(job)
    assert (job.outcome, job.status) == ("done", 0)
    assert (job.done, job.total, job.seconds_left) == (3, 3, 0.0)
    assert job.notes == ["Light not given.", "A cut.", "No smoke found."]
    assert job.warnings == ["A cut.", "No smoke found."]
    assert job.sentence == "3 frames."
    assert job.details == {"text": "3 frames.", "frames": 3}
    text = log.read_text()
    assert "Light not given." in text
    assert "frame 2: 2 of 3" in text
    assert text.endswith("[done, status 0]\n")


def test_polling_says_whether_anything_changed(engine) -> None:
    """So that nothing is drawn in vain."""
    job = engine("import json, sys; print(json.dumps({'event': 'note', 'text': 'x'}), flush=True); sys.stdin.read()")
    job.start()
    until(job.poll)
    assert not any(job.poll() for _ in range(20))
    assert job.outcome == "running"


def test_a_refusal_is_the_sentence(engine) -> None:
    """The engine's own words, and its status."""
    job = finished(
        engine("import json, sys; print(json.dumps({'event': 'error', 'text': 'No clip.', 'status': 2})); sys.exit(2)")
    )
    assert (job.outcome, job.status, job.sentence) == ("failed", 2, "No clip.")


def test_an_engine_that_breaks(engine, log) -> None:
    """The last line of its traceback is the sentence; the whole is in the log."""
    job = finished(engine("def f():\n    raise RuntimeError('the cat sat on it')\nf()"))
    assert (job.outcome, job.status) == ("failed", 1)
    assert job.sentence == "The engine stopped with an error of its own: RuntimeError: the cat sat on it"
    assert "Traceback" in log.read_text()


def test_an_engine_that_says_nothing_and_fails(engine) -> None:
    """There is still a sentence."""
    job = finished(engine("import sys; sys.exit(7)"))
    assert (job.outcome, job.sentence) == ("failed", "The engine stopped with an error of its own: status 7")


def test_lines_that_are_no_messages_go_to_the_log(engine, log) -> None:
    """Text, broken JSON, JSON of another kind, fields of other types, bytes that are no text, half a line."""
    rubbish = [
        b"[Taichi] hello\n",
        b'{"event": "frame", \n',
        b"[1, 2]\n",
        b"3\n",
        b'"event"\n',
        b"null\n",
        b'{"no": "event"}\n',
        b'{"event": "start"}\n',
        b'{"event": "frame", "frame": 1, "done": "many", "total": 3, "seconds_left": 1}\n',
        b'{"event": ["note"], "text": "?"}\n',
        b'{"event": "surprise", "text": "new in a later version"}\n',
        b"\xff\xfe caf\xe9\n",
        b"\n",
    ]
    script = f"import sys; sys.stdout.buffer.write({b''.join(rubbish)!r}); sys.stdout.flush()\n{FRAMES}"
    job = finished(engine(script + "\nimport sys; sys.stdout.write('half a line')"))
    assert (job.outcome, job.done, job.sentence) == ("done", 3, "3 frames.")
    text = log.read_text(encoding="utf-8")
    for word in ("[Taichi] hello", "many", "surprise", "caf", "half a line"):
        assert word in text


def test_a_poll_reads_a_bounded_number_of_lines(engine) -> None:
    """A poll takes a bounded part, nothing is lost, and the engine waits meanwhile."""
    count = 20 * module.LINES_A_POLL
    job = engine(
        f"import json\nfor n in range({count}):\n"
        f"    print(json.dumps({{'event': 'frame', 'frame': n, 'done': n, 'total': {count}, 'seconds_left': 0}}))\n"
    )
    job.start()
    before = 0
    while not job.ended:
        job.poll()
        assert job.done - before <= module.LINES_A_POLL
        before = job.done
    assert (job.outcome, job.done) == ("done", count - 1)


def test_a_line_without_an_end(engine) -> None:
    """Ten megabytes of it."""
    job = finished(engine(f"import sys; sys.stdout.write('x' * 10_000_000 + chr(10))\n{FRAMES}"))
    assert (job.outcome, job.done) == ("done", 3)


def test_what_is_said_last_is_heard(engine) -> None:
    """Also when the process has ended before anybody looked."""
    for _ in range(5):
        job = engine(FRAMES)
        job.start()
        assert job._process is not None
        job._process.wait()
        assert finished(job).sentence == "3 frames."


# how an engine ends


def test_cancelling_a_polite_engine(own_engine) -> None:
    """Closing its input interrupts it; it says its last word and is resumable."""
    job = own_engine(POLITE)
    job.start()
    until(lambda: job.poll() and job.total == 9)
    job.cancel()
    job.cancel()
    finished(job)
    assert (job.outcome, job.status) == ("cancelled", 130)
    assert job.sentence == "Cancelled; finished frames stay: 2."


def test_cancelling_at_once(own_engine) -> None:
    """Before the engine has even begun."""
    job = own_engine(POLITE)
    job.start()
    job.cancel()
    assert finished(job).outcome == "cancelled"


def test_cancelling_an_engine_that_does_not_listen(own_engine, monkeypatch) -> None:
    """It is given some time, then ended."""
    monkeypatch.setattr(module, "GRACE_SECONDS", 0.3)
    job = own_engine(
        "import json, time\n"
        "print(json.dumps({'event': 'start', 'total': 9, 'done': 4}), flush=True)\n"
        "while True:\n    try:\n        time.sleep(60)\n    except KeyboardInterrupt:\n        pass\n"
    )
    job.start()
    until(lambda: job.poll() and job.total == 9)
    job.cancel()
    assert finished(job).outcome == "cancelled"
    assert job.sentence == "Cancelled; finished frames stay: 4."


def test_an_engine_that_finishes_although_cancelled(engine) -> None:
    """What is done is done."""
    job = engine(f"import sys; sys.stdin.read()\n{FRAMES}")
    job.start()
    job.cancel()
    assert finished(job).outcome == "done"


def test_killing_does_not_wait_for_manners(engine) -> None:
    """Afterwards the process is gone."""
    job = engine("import time\nwhile True:\n    time.sleep(60)")
    job.start()
    job.kill()
    assert job.outcome == "cancelled"
    assert job._process is not None
    assert job._process.returncode is not None


def test_killing_in_the_middle_of_a_flood(engine) -> None:
    """The reader, which waits for room, ends too."""
    job = engine("while True:\n    print('x' * 1000)")
    job.start()
    until(lambda: job._lines.full())
    job.kill()
    assert job.outcome == "cancelled"


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no signals")
def test_an_engine_that_is_killed_from_outside(engine) -> None:
    """As the system does when memory runs out."""
    job = finished(engine(f"import os, signal; os.kill(os.getpid(), {int(signal.SIGKILL)})"))
    assert (job.outcome, job.status) == ("failed", -signal.SIGKILL)
    assert job.sentence == "The engine was ended from outside (signal 9), perhaps for lack of memory."


@pytest.mark.skipif(sys.platform == "win32", reason="the grandchild is POSIX's")
def test_a_grandchild_that_keeps_the_pipe_open(engine, monkeypatch) -> None:
    """The job ends with its own process."""
    monkeypatch.setattr(module, "DRAIN_SECONDS", 0.1)
    job = finished(engine(f"import subprocess, sys; subprocess.Popen(['sleep', '1.5'])\n{FRAMES}"))
    assert (job.outcome, job.done) == ("done", 3)


def test_a_program_that_is_not_there(log, tmp_path) -> None:
    """An outcome like others."""
    job = Job([str(tmp_path / "no-python")], log)
    job.start()
    assert job.outcome == "failed"
    assert job.sentence.startswith("The engine could not be started")
    assert not job.poll()


def test_a_log_that_cannot_be_written(tmp_path) -> None:
    """Said, instead of raised into Blender."""
    (tmp_path / "file").write_text("in the way")
    job = Job([sys.executable, "-c", ""], tmp_path / "file" / "job.log")
    job.start()
    assert (job.outcome, "could not be started" in job.sentence) == ("failed", True)


@pytest.mark.skipif(sys.platform == "win32", reason="asks for a process by POSIX's means")
def test_the_engine_ends_with_its_parent(own_engine, log) -> None:
    """However the parent ends: nothing has to be done for it."""
    job = own_engine("import os, time\nprint(os.getpid(), flush=True)\nwhile True:\n    time.sleep(0.01)")
    parent = (
        "import os, subprocess, sys\n"
        f"child = subprocess.Popen({job._command!r}, stdin=subprocess.PIPE, stdout=subprocess.PIPE)\n"
        "print(child.stdout.readline().decode(), flush=True)\n"
        "os._exit(1)"
    )
    done = subprocess.run([sys.executable, "-c", parent], capture_output=True, text=True, check=False, timeout=PATIENCE)
    child = int(done.stdout)

    def gone() -> bool:
        try:
            os.kill(child, 0)
        except ProcessLookupError:
            return True
        return Path(f"/proc/{child}/stat").read_text().split(")")[1].split()[0] == "Z"  # nobody's child any more

    until(gone)


# how an engine is started


def test_the_engine_gets_its_arguments_and_its_own_folder(own_engine, log, monkeypatch) -> None:
    """And nothing of the user's own settings of Python."""
    monkeypatch.setenv("PYTHONPATH", "/somewhere/else")
    monkeypatch.setenv("PYTHONSTARTUP", "/somewhere/else.py")
    job = finished(own_engine("import sys\nprint(sys.argv[1:], sys.path[0], '/somewhere/else' in sys.path)"))
    assert job.outcome == "done"
    site = log.parents[1] / "site"
    assert f"['one', 'two words'] {site} False" in log.read_text()


def test_no_engine(monkeypatch) -> None:
    """What to do is said."""
    monkeypatch.setattr(module.importlib.util, "find_spec", lambda name: None)
    with pytest.raises(EngineMissingError, match="install the extension again"):
        engine_command([])


def test_libraries_that_are_shipped_come_first(tmp_path, monkeypatch) -> None:
    """The engine's own, and Taichi's where its extension lies beside."""
    monkeypatch.setattr(module, "HOME", tmp_path / "smokelift")
    own, gpu = (tmp_path / name / module.LIBRARIES for name in ("smokelift", "smokelift_gpu"))
    own.mkdir(parents=True)
    assert str(own) in engine_command([])
    gpu.mkdir(parents=True)
    assert os.pathsep.join(map(str, (own, gpu))) in engine_command([])


def test_the_zip_for_another_blender(tmp_path, monkeypatch) -> None:
    """It says which it is."""
    (tmp_path / "python3.9").mkdir()
    monkeypatch.setattr(module, "HOME", tmp_path)
    with pytest.raises(EngineMissingError, match=r"Blenders with python3\.9, and this one has python3"):
        engine_command([])


# queues


def test_jobs_run_one_after_the_other(engine) -> None:
    """In the order in which they came; one that fails does not stop the next."""
    queue = Queue()
    jobs = [engine(FRAMES), engine("import sys; sys.exit(2)"), engine(FRAMES)]
    for job in jobs:
        queue.add(job)
    seen = []
    while not queue.ended:
        for job in queue.poll():
            seen.append((jobs.index(job), job.outcome))
            assert sum(other.outcome == "running" for other in jobs) <= 1
    assert [job.outcome for job in jobs] == ["done", "failed", "done"]
    assert [number for number, _ in seen] == sorted(number for number, _ in seen)


def test_a_waiting_job_can_be_cancelled(engine) -> None:
    """It never starts."""
    queue = Queue()
    first, second = engine("import sys; sys.stdin.read()"), engine("raise SystemExit('never')")
    queue.add(first)
    queue.add(second)
    queue.poll()
    assert queue.current is first
    second.cancel()
    assert (second.outcome, second.sentence) == ("cancelled", "Cancelled before it began.")
    first.cancel()
    until(lambda: (queue.poll(), queue.ended)[1])
    assert second.status is None


def test_killing_a_queue(engine) -> None:
    """The running job and the waiting ones."""
    queue = Queue()
    for _ in range(3):
        queue.add(engine("import sys; sys.stdin.read()"))
    queue.poll()
    queue.kill()
    assert queue.ended
    assert [job.outcome for job in queue.jobs] == ["cancelled"] * 3
