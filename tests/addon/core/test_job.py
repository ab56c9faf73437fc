"""Jobs: what they make of everything that an engine can say or do. The engines here are scripts of a few lines."""

import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from textwrap import indent
from types import SimpleNamespace

import pytest

import addon
import smokelift_command
from addon.core import ShotError
from addon.core import job as module
from addon.core.job import Job, engine_command

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

DEAF = """
import json, time
while True:
    try:
        print(json.dumps({"event": "start", "total": 9, "done": 2}), flush=True)
        time.sleep(60)
    except KeyboardInterrupt:
        pass
"""


@pytest.fixture
def log(tmp_path) -> Path:
    return tmp_path / "logs" / "job.log"


@pytest.fixture
def start(log) -> Iterator[Callable[[list[str]], Job]]:
    """Makes jobs; none outlives its test."""
    made = []

    def make(command: list[str]) -> Job:
        made.append(Job(command, log))
        return made[-1]

    yield make
    for job in made:
        job.kill()


@pytest.fixture
def engine(start) -> Callable[[str], Job]:
    """Makes jobs that run a script."""
    return lambda script: start([sys.executable, "-I", "-c", script])


@pytest.fixture
def own_engine(tmp_path, monkeypatch, start) -> Callable[[str], Job]:
    """Makes jobs that start a script in the engine's place as the add-on starts the engine."""

    def make(script: str) -> Job:
        package = tmp_path / "site" / "smokelift"
        (package / "app").mkdir(parents=True)
        for folder in (package, package / "app"):
            (folder / "__init__.py").touch()
        (package / "app" / "cli.py").write_text(f"def main():\n{indent(script, '    ')}")
        shutil.copytree(Path(smokelift_command.__file__).parent, tmp_path / "site" / "smokelift_command")

        found = SimpleNamespace(origin=str(package / "__init__.py"))
        monkeypatch.setattr(module.importlib.util, "find_spec", lambda name: found)
        return start(engine_command(["one", "two words"]))

    return make


def until(condition: Callable[[], bool]) -> None:
    """Wait until something is so, but not for ever."""
    end = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < end, "nothing happened"
        time.sleep(0.005)


def finished(job: Job) -> Job:
    if job.outcome == "waiting":
        job.start()
    until(lambda: (job.poll(), job.ended)[1])
    return job


# what an engine says


def test_progress(engine, log) -> None:
    job = engine(FRAMES)
    assert (job.outcome, job.done, job.total, job.seconds_left) == ("waiting", 0, 0, None)
    finished(job)
    assert (job.outcome, job.status) == ("done", 0)
    assert (job.done, job.total, job.seconds_left) == (3, 3, 0.0)
    assert job.notes == ["Light not given.", "A cut.", "No smoke found."]
    assert job.doubts == [("", "A cut."), ("", "No smoke found.")]
    assert job.sentence == "3 frames."
    assert job.details == {"text": "3 frames.", "frames": 3}
    assert {"Light not given.", "frame 2: 2 of 3", "[done, status 0]"} <= set(log.read_text().splitlines())


def test_a_run_that_goes_on_counts_what_was_finished(engine, log) -> None:
    """Also where it is cancelled before it has said so; and it knows the forecast before its first frame."""
    job = Job([sys.executable, "-c", "import time; time.sleep(60)"], log, done=7)
    assert (job.done, job.total) == (7, 0)
    job.start()
    job.kill()
    assert job.sentence == "Cancelled; finished frames stay: 7."
    job = finished(engine('print(\'{"event": "start", "total": 9, "done": 2, "seconds_left": 21.5}\')'))
    assert (job.done, job.total, job.seconds_left) == (2, 9, 21.5)


@pytest.mark.parametrize(
    ("script", "status", "sentence"),
    [
        ("import json, sys; print(json.dumps({'event': 'error', 'text': 'No clip.'})); sys.exit(2)", 2, "No clip."),
        ("raise RuntimeError('no cat')", 1, "The engine stopped with an error of its own: RuntimeError: no cat"),
        ("import sys; sys.exit(7)", 7, "The engine stopped with an error of its own: status 7"),
        pytest.param(
            f"import os; os.kill(os.getpid(), {int(getattr(signal, 'SIGKILL', 9))})",
            -9,
            "The engine was ended from outside (signal 9), perhaps for lack of memory: choose a lower quality.",
            marks=pytest.mark.skipif(sys.platform == "win32", reason="Windows has no signals"),
        ),
    ],
)
def test_an_engine_that_fails(engine, log, script, status, sentence) -> None:
    job = finished(engine(script))
    assert (job.outcome, job.status, job.sentence) == ("failed", status, sentence)
    assert ("Traceback" in log.read_text()) == (status == 1)


def test_lines_that_are_no_messages_go_to_the_log(engine, log) -> None:
    """Text, broken JSON, JSON of another kind, fields of other types, bytes that are no text, half a line."""
    rubbish = b"""[Taichi] hello
{"event": "frame",
[1, 2]
3
"event"
null
{"no": "event"}
{"event": "start"}
{"event": "frame", "frame": 1, "done": "many", "total": 3, "seconds_left": 1}
{"event": ["note"], "text": "?"}
{"event": "surprise", "text": "new in a later version"}
\xff\xfe caf\xe9

"""
    script = f"import sys; sys.stdout.buffer.write({rubbish!r}); sys.stdout.flush()\n{FRAMES}"
    job = finished(engine(script + "\nimport sys; sys.stdout.write('half a line')"))
    assert (job.outcome, job.done, job.sentence) == ("done", 3, "3 frames.")
    text = log.read_text(encoding="utf-8")
    for word in ("[Taichi] hello", "many", "surprise", "caf", "half a line"):
        assert word in text


def test_a_poll_reads_a_bounded_number_of_lines(engine) -> None:
    count = 20 * module.LINES_PER_POLL
    job = engine(
        f"import json\nfor n in range({count}):\n"
        f"    print(json.dumps({{'event': 'frame', 'frame': n, 'done': n, 'total': {count}, 'seconds_left': 0}}))\n"
    )
    job.start()
    before = 0
    while not job.ended:
        job.poll()
        assert job.done - before <= module.LINES_PER_POLL
        before = job.done
    assert (job.outcome, job.done) == ("done", count - 1)


# how an engine ends


@pytest.mark.parametrize(("script", "listens"), [(POLITE, True), (DEAF, False)])
def test_cancelling_an_engine(own_engine, script, listens) -> None:
    job = own_engine(script)
    job.grace_seconds = module.GRACE_SECONDS if listens else 0.3
    job.start()
    until(lambda: job.poll() and job.total == 9)
    assert not job.stopping
    job.cancel()
    job.cancel()
    assert job.stopping
    finished(job)
    assert job.outcome == "cancelled" and (job.status == 130) == listens
    assert job.sentence == "Cancelled; finished frames stay: 2."


def test_an_engine_that_finishes_although_cancelled(engine) -> None:
    job = engine(f"import sys; sys.stdin.read()\n{FRAMES}")
    job.start()
    job.cancel()
    assert finished(job).outcome == "done"


def test_killing_in_the_middle_of_a_flood(engine) -> None:
    job = engine("while True:\n    print('x' * 1000)")
    job.start()
    until(lambda: job._lines.full())
    job.kill()
    assert job.outcome == "cancelled"


@pytest.mark.skipif(sys.platform == "win32", reason="the grandchild is POSIX's")
def test_a_grandchild_that_keeps_the_pipe_open(engine) -> None:
    job = engine(f"import subprocess, sys; subprocess.Popen(['sleep', '1.5'])\n{FRAMES}")
    job.drain_seconds = 0.1
    finished(job)
    assert (job.outcome, job.done) == ("done", 3)


def test_a_program_that_is_not_there(log, tmp_path) -> None:
    job = Job([str(tmp_path / "no-python")], log)
    job.start()
    assert job.outcome == "failed"
    assert job.sentence.startswith("The engine could not be started")
    assert not job.poll()


@pytest.mark.skipif(sys.platform == "win32", reason="asks for a process by POSIX's means")
def test_the_engine_ends_with_its_parent(own_engine, log) -> None:
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
    monkeypatch.setenv("PYTHONPATH", "/somewhere/else")
    monkeypatch.setenv("PYTHONSTARTUP", "/somewhere/else.py")
    job = finished(own_engine("import sys\nprint(sys.argv[1:], sys.path[0], '/somewhere/else' in sys.path)"))
    assert job.outcome == "done"
    site = log.parents[1] / "site"
    assert f"['one', 'two words'] {site} False" in log.read_text()


def test_no_engine(monkeypatch) -> None:
    monkeypatch.setattr(module.importlib.util, "find_spec", lambda name: None)
    with pytest.raises(ShotError, match="missing"):
        engine_command([])


def test_libraries_that_are_shipped_come_first(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(module, "HOME", tmp_path / "smokelift")
    own, gpu = (tmp_path / name / module.LIBRARIES for name in ("smokelift", "smokelift_gpu"))
    own.mkdir(parents=True)
    assert str(own) in engine_command([])
    gpu.mkdir(parents=True)
    assert os.pathsep.join(map(str, (own, gpu))) in engine_command([])


@pytest.mark.parametrize(
    ("folder", "platform", "blender", "said"),
    [
        ("python3.9", "linux-x64", ("python3.11", "linux"), r"Python 3\.9, .*-1\.2\.3-blender4\.2-5\.0-linux_x64\.zip"),
        ("python3.11", "windows-x64", ("python3.11", "linux"), r"for windows-x64 .*-1\.2\.3-.*-linux_x64\.zip"),
        ("python3.11", "linux-x64", ("python3.14", "linux"), r"with Python 3\.14, for which there is none"),
        ("python3.11", "linux-x64", ("python3.11", "linux"), None),
        ("python3.13", "windows-x64", ("python3.13", "win32"), None),  # Blender for x64 on an ARM
    ],
)
def test_the_zip_for_another_blender_is_not_enabled(tmp_path, monkeypatch, folder, platform, blender, said) -> None:
    """The error names the one that fits; a run says the same."""
    (tmp_path / folder).mkdir()
    (tmp_path / "blender_manifest.toml").write_text(f'version = "1.2.3"\nplatforms = ["{platform}"]\n')
    python, system = blender
    monkeypatch.setattr(module, "HOME", tmp_path)
    monkeypatch.setattr(module, "LIBRARIES", python)
    monkeypatch.setattr(module.sys, "platform", system)
    monkeypatch.setattr(module.sysconfig, "get_platform", lambda: "win-amd64")
    monkeypatch.setattr(module.platform, "machine", lambda: "x86_64" if system == "linux" else "ARM64")
    if said is None:
        assert str(tmp_path / folder) in engine_command([])
        return
    for ask in (addon.register, lambda: engine_command([])):
        with pytest.raises(ShotError, match=said):
            ask()


def test_a_waiting_job_can_be_cancelled(engine) -> None:
    job = engine("raise SystemExit('never')")
    job.cancel()
    assert (job.outcome, job.status) == ("cancelled", None)
