"""Calls of the program: diagnose and simulate."""
import json
import os
import subprocess


def processor_seconds():
    """Of this program and of those that it has run: what a busy machine does not change."""
    times = os.times()
    return times.user + times.system + times.children_user + times.children_system


def run(command):
    """Its output. Throws with its message where it fails."""
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise RuntimeError(f"{' '.join(map(str, command))}: {done.stderr or done.stdout}")
    return done.stdout


def diagnose(upright, plant, data, folder, validate=()):
    """The result of a diagnosis; what `folder` holds already is not computed again."""
    if not (folder / "diagnosis.json").exists():
        command = [upright, "diagnose", "--model", plant, "--data", *data, "--out", folder]
        if validate:
            command += ["--validate", *validate]
        before = processor_seconds()
        run(command)
        (folder / "seconds.txt").write_text(f"{processor_seconds() - before:.1f}\n")
    return json.loads((folder / "diagnosis.json").read_text())


def seconds_of(folder):
    return float((folder / "seconds.txt").read_text())
