#!/usr/bin/env python3
"""Checks that the tables of keys in the documents state what the program's schemas state.

  scripts/check_key_tables.py --upright PROGRAM [--root FOLDER]

A table of keys has the columns "key", "unit", "range" and "default". Each key of `upright schema` must have a row, with the
unit that its name ends with, its range and its default, and each row must be of a key. A key that depends on others has several
ranges or defaults, and all are stated.
The exit code is 1, with a line for each finding.
"""
import argparse
import json
import math
import pathlib
import re
import subprocess
import sys
from dataclasses import dataclass, field

PAGES = {"docs/reference/files.md": None,  # the kind follows from the heading
         "docs/reference/rig-files.md": "rig", "docs/reference/dataset-files.md": "dataset",
         "docs/reference/experiment-files.md": "experiment", "docs/explanation/quiet-control.md": "gains"}
KINDS = {"Plant file": "plant", "Gain file": "gains", "Sweep file": "sweep"}
# docs/reference/effects.md has the parameters of effects, written from the registry.
ELSEWHERE = {"plant": ("plant.effects.",)}
# Maps that are described by the rows of their keys, the forms of a grid, and the names of the user's own controllers.
NO_ROW = {"from", "to", "count", "spacing"}
# The unit that the end of a name means.
UNITS = {"_m": "m", "_kg": "kg", "_s": "s", "_us": "us", "_v": "V", "_rad": "rad", "_deg": "degree", "_hz": "Hz", "_mps": "m/s",
         "_radps": "rad/s", "_mps2": "m/s²", "_kgm2": "kg m²", "_bits": "bit", "_per_v": "1/V", "_n_per_volt": "N/V",
         "_per_volt_n": "N/V", "_n_per_mps": "N s/m", "_v_per_m": "V/m", "_v_per_rad": "V/rad", "_v_per_s": "V/s",
         "_v_per_mps": "V s/m", "_v_per_radps": "V s/rad",
         "_n2_per_s": "N²/s", "_rad2_per_s": "rad²/s", "_m2_per_s3": "m²/s³", "_rad2_per_s3": "rad²/s³",
         "_edges_per_s": "1/s", "m_per_count": "m", "_per_count": "s", "_mps2_per_v": "m/s²/V"}


@dataclass
class Accepted:
    """What the schema says of a key: all its ranges, and whether it must be there."""
    ranges: set = field(default_factory=set)
    defaults: set = field(default_factory=set)
    statuses: set = field(default_factory=set)
    is_map: bool = False


def number_text(value):
    """As the pages write numbers: 1e-9, 0.001, 65535, π."""
    if value in (math.pi, 2 * math.pi):
        return "π" if value == math.pi else "2π"
    if value == int(value) and abs(value) < 1e5:
        return str(int(value))
    if isinstance(value, int):
        return str(value)
    text = f"{value:.15g}" if 1e-3 <= abs(value) < 1e5 else f"{value:.0e}" if float(f"{value:.0e}") == value else repr(value)
    return re.sub(r"e([+-])0*", lambda match: "e-" if match[1] == "-" else "e", text)


def range_text(schema):
    low, high = schema.get("minimum"), schema.get("maximum")
    if "anyOf" in schema:  # zero, or from a number on
        low = max(part.get("minimum", 0) for part in schema["anyOf"])
    if schema.get("not") == {"const": 0} and (low, high) == (-1, 1):
        return "1, -1"
    if schema.get("not") == {"const": 0}:
        return "any but 0"
    if "exclusiveMinimum" in schema:
        above = "above " + number_text(schema["exclusiveMinimum"])
        return above if high is None else f"{above}, at most {number_text(high)}"
    if low is None:
        return "any"
    return f"at least {number_text(low)}" if high is None else f"{number_text(low)} to {number_text(high)}"


class Keys:
    """The keys of a schema with their paths, such as "modbus.counters.table"."""

    def __init__(self, schema):
        self.root, self.found = schema, {}
        self.collect(schema, "")

    def resolved(self, schema):
        return self.root["definitions"][schema["$ref"].rsplit("/", 1)[1]] if "$ref" in schema else schema

    def alternatives(self, schema):
        schema = self.resolved(schema)
        if "anyOf" not in schema or schema.get("type") == "number":
            return [schema]
        outer = {key: value for key, value in schema.items() if key != "anyOf"}
        return [{**part, **outer} for alternative in schema["anyOf"] for part in self.alternatives(alternative)]

    @staticmethod
    def sometimes_required(schema, key):
        for rule in schema.get("allOf", ()):
            for part in (rule.get("then"), rule.get("else")):
                if isinstance(part, dict) and (key in part.get("required", ()) or Keys.sometimes_required(part, key)):
                    return True
        return False

    def collect(self, schema, prefix):
        for key, property_schema in schema.get("properties", {}).items():
            for part in self.alternatives(property_schema):
                accepted = self.found.setdefault(prefix + key, Accepted())
                is_required = key in schema.get("required", ()) or self.sometimes_required(schema, key)
                accepted.statuses.add("required" if is_required else "optional")
                self.note(accepted, part, prefix + key)

    def note(self, accepted, part, path):
        if "default" in part:
            default = part["default"]
            accepted.defaults.add(f"`{str(default).lower()}`" if isinstance(default, (bool, str)) else number_text(default))
        if part.get("type") == "array":
            for item in self.alternatives(part["items"]):
                self.note(accepted, item, path)
            return
        if part.get("type") == "object":
            accepted.is_map = True
            self.collect(part, path + ".")
        elif "enum" in part:
            accepted.ranges.update(f"`{word}`" for word in part["enum"])
        elif "const" in part:
            accepted.ranges.add(f"`{part['const']}`")
        elif part.get("type") == "boolean":
            accepted.ranges.update(("`true`", "`false`"))
        elif part.get("type") in ("number", "integer"):
            accepted.ranges.add(range_text(part))


def unit_of(key):
    ends = [end for end in UNITS if key.endswith(end)]
    return UNITS[max(ends, key=len)] if ends else None


def states(cell, wanted):
    """Whether a cell states a range or a default: not as a part of another number."""
    return re.search(rf"(?<![\w.]){re.escape(wanted)}(?![\w.])" if wanted[0] != "`" else re.escape(wanted), cell) is not None


def rows_of(page, text):
    """The rows of tables of keys: line, kind, path as it is written, unit, range, default."""
    kind, section, columns = PAGES[page], "", None
    for number, line in enumerate(text.split("\n"), 1):
        if line.startswith("## ") and PAGES[page] is None:
            kind = KINDS.get(line[3:].strip())
        if not line.startswith("|"):
            columns = None
            continue
        cells = [cell.strip() for cell in line.strip().strip("|").split("|")]
        if cells[0].startswith("key"):
            columns = {name: at for at, name in enumerate(cells)} if "range" in cells and "default" in cells else None
            codes = re.findall(r"`([^`]+)`", cells[0])
            section = codes[0] + "." if codes else ""
        elif columns and not line.startswith("|---"):
            for key in re.findall(r"`([^`]+)`", cells[0]):
                yield number, kind, section + key, cells[columns["unit"]], cells[columns["range"]], cells[columns["default"]]


def matching(found, written):
    """The paths that a row means: exactly the one that it writes, or those that end like it."""
    if written in found:
        return [written]
    section, _, key = written.rpartition(".")
    ends = [path for path in found if path.endswith("." + written)]
    inside = [path for path in found if path.endswith("." + key) and (not section or path.startswith(section.split(".")[0] + "."))]
    return ends or inside


def findings_of_row(where, key, accepted, stated_range, otherwise):
    for text in accepted.ranges:
        if not states(stated_range, text):
            yield f"{where}: {key}: the program accepts {text}, the page says '{stated_range}'"
    for text in accepted.defaults:
        if not states(otherwise, text):
            yield f"{where}: {key}: the default is {text}, the page says '{otherwise}'"
    if "required" in accepted.statuses and "required" not in otherwise:
        yield f"{where}: {key}: it is required, the page says '{otherwise}'"
    if accepted.statuses == {"optional"} and otherwise in ("required", ""):
        yield f"{where}: {key}: it may be left out, the page says '{otherwise}'"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--upright", required=True, type=pathlib.Path)
    parser.add_argument("--root", type=pathlib.Path, default=pathlib.Path(__file__).resolve().parent.parent)
    options = parser.parse_args()
    kinds = sorted({*KINDS.values(), *filter(None, PAGES.values())})
    keys = {kind: Keys(json.loads(subprocess.run([options.upright, "schema", kind], capture_output=True, check=True).stdout)).found
            for kind in kinds}
    described, findings = {kind: set() for kind in kinds}, []
    for page in PAGES:
        for number, kind, written, unit, stated_range, otherwise in rows_of(page, (options.root / page).read_text()):
            paths = matching(keys[kind], written)
            wanted = unit_of(written)
            if wanted and wanted not in unit.split(", ") and not any(keys[kind][path].is_map for path in paths):
                findings.append(f"{page}:{number}: {written} is in {wanted}, the page says '{unit}'")
            if not paths:
                findings.append(f"{page}:{number}: has the key {written}, which no {kind} file has")
            for path in paths:
                described[kind].add(path)
                findings += findings_of_row(f"{page}:{number}", path, keys[kind][path], stated_range, otherwise)
    for kind in kinds:
        for path, accepted in keys[kind].items():
            is_elsewhere = path.startswith(ELSEWHERE.get(kind, ("\0",))) or path.rsplit(".", 1)[-1] in NO_ROW and not accepted.is_map
            if path not in described[kind] and not accepted.is_map and not is_elsewhere:
                findings.append(f"no page has a row for {path} of a {kind} file")
    for finding in findings:
        print(finding, file=sys.stderr)
    sys.exit(1 if findings else 0)


if __name__ == "__main__":
    main()
