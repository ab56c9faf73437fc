"""An engine that computes nothing: it has the command line, the files and the manners of the real one.

Its input is a JSON file: ``frames``; ``seconds`` of a frame; ``memory`` that it foretells; ``ends``: what ends the run
before a frame, by the frame's number (``"crash"``, ``"refuse"`` or a path: the disk is full while that exists; a crash
happens once); ``stubborn``: whether neither the end of its input nor a signal that can be ignored ends it. Every
finished frame is written down in ``NAME.ledger`` beside the sequence.
"""

import json
import os
import signal
import sys
import threading
import time
from pathlib import Path

COMMITTING = threading.Lock()
"""Held while a frame and its line in the ledger are written, which no end may come between."""


def end_with_input():
    while os.read(0, 4096):
        pass
    with COMMITTING:
        os._exit(130)


def say(event, **fields):
    print(json.dumps({"event": event, **fields}), flush=True)


def main(words):
    task = json.loads(Path(words[1]).read_text())
    if task["stubborn"]:
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, signal.SIG_IGN)
    else:
        threading.Thread(target=end_with_input, daemon=True).start()
    if words[0] == "inspect":
        return say("done", text="Known.", frames=task["frames"], seconds=2.0 * task["frames"], memory=task["memory"])
    out = Path(words[words.index("--out") + 1])
    out.mkdir(exist_ok=True)
    index = out / "sequence.json"
    there = json.loads(index.read_text())["frames"] if index.exists() else {}
    say("note", text="A fake.")
    for number in range(len(there) + 1, task["frames"] + 1):
        end = task.get("ends", {}).get(str(number))
        if end == "refuse":
            say("error", text="It cannot be done.", status=2, later=False)
            sys.exit(2)
        if end == "crash":
            mark = out.parent / f"{out.name}.crashed-{number}"
            if not mark.exists():
                mark.touch()
                os.abort()
        elif end and Path(end).exists():
            say("error", text="The disk is full.", status=2, later=True)
            sys.exit(2)
        time.sleep(task["seconds"])
        there[str(number)] = {"psnr": 30.0, "seconds_density": task["seconds"], "seconds_velocity": 0.0}
        written = {"format": 1, "scene": {}, "settings": {}, "choices": [], "provenance": [], "frames": there}
        written |= {"sources": {}, "checksums": {}, "versions": {}}
        temporary = out / ".aside.tmp"
        temporary.write_text(json.dumps({**written, "complete": number == task["frames"]}))
        with COMMITTING, (out.parent / f"{out.name}.ledger").open("a") as ledger:
            temporary.replace(index)
            ledger.write(f"{number}\n")
            ledger.flush()
    return say("done", text="Finished.")


if __name__ == "__main__":
    main(sys.argv[1:])
