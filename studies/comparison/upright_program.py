"""Calls of the program: diagnose and simulate."""
import json
import subprocess
import time


def run(command):
    """Its output and the seconds of the wall clock. Throws with its message where it fails."""
    start = time.monotonic()
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise RuntimeError(f"{' '.join(map(str, command))}: {done.stderr or done.stdout}")
    return done.stdout, time.monotonic() - start


def diagnose(upright, plant, data, folder, validate=()):
    """The result of a diagnosis; what `folder` holds already is not computed again."""
    if not (folder / "diagnosis.json").exists():
        command = [upright, "diagnose", "--model", plant, "--data", *data, "--out", folder]
        if validate:
            command += ["--validate", *validate]
        _, seconds = run(command)
        (folder / "seconds.txt").write_text(f"{seconds:.1f}\n")
    return json.loads((folder / "diagnosis.json").read_text())


def seconds_of(folder):
    return float((folder / "seconds.txt").read_text())
