"""The schemas of `upright schema` hold for every YAML file that upright ships, and refuse what `upright check` refuses.

  schema_check.py UPRIGHT CONFIG FOLDER [--mutants COUNT] [--seed SEED]

Each shipped file is changed in one place COUNT times: a key renamed or removed, a value of another type, out of range,
or another word. The program checks each mutant, and so does the schema. What the program accepts the schema must accept.
What the program refuses the schema must refuse, unless the reason is one that docs/reference/files.md lists as beyond a
schema.
"""
import argparse
import copy
import json
import pathlib
import random
import re
import shutil
import subprocess
import sys

import jsonschema
import yaml

KIND_BY_KEY = {"plant": "plant", "gains": "gains", "backend": "rig", "sweep": "sweep", "experiment": "experiment",
               "dataset": "dataset"}


class CoreLoader(yaml.SafeLoader):
    """YAML 1.2's core schema, as editors read it: `1e-3` is a number, `on` and a date are texts."""


CoreLoader.yaml_implicit_resolvers = {}
for tag, pattern, first in (
        ("bool", r"^(?:true|True|TRUE|false|False|FALSE)$", "tTfF"),
        ("null", r"^(?:~|null|Null|NULL|)$", ["~", "n", "N", ""]),
        ("int", r"^[-+]?[0-9]+$", "-+0123456789"),
        ("float", r"^(?:[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?|[-+]?\.(?:inf|Inf|INF)|\.(?:nan|NaN|NAN))$",
         "-+0123456789.")):
    CoreLoader.add_implicit_resolver(f"tag:yaml.org,2002:{tag}", re.compile(pattern), list(first))
CoreLoader.add_constructor("tag:yaml.org,2002:float", lambda loader, node: float(loader.construct_scalar(node).lower().replace(".inf", "inf").replace(".nan", "nan")))
CoreLoader.add_constructor("tag:yaml.org,2002:int", lambda loader, node: int(loader.construct_scalar(node)))

# Reasons that no schema can state (docs/reference/files.md): files, relations of numbers, and what is counted over a list.
BEYOND = re.compile("|".join((
    r"\(No such file or directory\)", r"there is no column", r"is a directory",
    r"\bkind appears twice: keep one", r"cannot be simulated", r"smaller than the inertia of a point mass", r"has no pendulum",
    r"above voltage_limit_v", r"(?:is not|not) (?:above|below) \w+: ", r"beyond travel_m", r"does not contain zero volts",
    r"is not increasing", r"makes the (?:piece|experiment) last", r"does not fit into a 16-bit register", r"shares a register",
    r"breakaway_v\.to is .*out of range", r"is too (?:small|large) for", r"is less than amplifier\.limit_v", r"is not a range",
    r"is the same channel", r"is also the line", r"is already in use", r"_counts is .*out of range", r"which a \w+ does not have",
    r"more counts than the calibration's", r"counters of \d+ bits", r"is 1, but from and to differ", r"counts as fallen",
    r"which is not supported: use a standard rate", r"a \w+ supports", r"ends beyond register", r"within 125 registers",
    r"is not finite", r"must be above 0 for spacing: log", r"record\.csv[: ]",
    r"is '[-+.0-9e]+': the name is used for folders",  # the spelling of a number
)))

DATASETS = {
    "counts.yaml": """
dataset:
  file: record.csv
  header: true
  delimiter: semicolon
  decimal: point
  missing: skip
  from_s: 0.0
  to_s: 0.03
  cart_locked: false
  columns:
    time_s: {column: t, unit: ms, period_s: 0.001}
    voltage_v: {column: u, scale: 2, offset: 0.1, delay_s: 0.001}
    cart_m: {column: x, unit: counts, m_per_count: 1.0e-5}
    theta_rad: {column: a, unit: "[Deg]", offset: 3.1, mirrored: false, folded_every_rad: 6.28}
  resolution: {cart_m: 1.0e-5, theta_rad: 0.01}
""",
    "plain.yaml": """
dataset:
  file: record.csv
  columns: {time_s: {column: t, scale: 0.001}, voltage_v: u, cart_m: {column: x, scale: 1.0e-5},
            theta_rad: {column: a, unit: counts, counts_per_revolution: 4096}}
"""}
SWEEP = """
sweep:
  plant: ../plants/exponential.yaml
  gains: ../gains/exponential.yaml
  loop: continuous
  theta0_deg: {from: 1, to: 5, count: 3, spacing: log}
  delay_s: {from: 0.0, to: 0.1, count: 5}
  duration_s: 5
  outcome: {stable_below_rad: 0.001, fell_above_rad: 1.5}
  engine: fast
  smoothing: 0
"""


def load(text):
    return yaml.load(text, CoreLoader)


def write_more_files(upright, config):
    """Files that have what the shipped ones leave out: a dataset, a grid, every effect."""
    folder = config / "data"
    folder.mkdir()
    rows = "".join(f"{i};{0.1 * i};{3 * i};{5 * i}\n" for i in range(40))
    (folder / "record.csv").write_text("t;u;x;a\n" + rows)
    for name, text in DATASETS.items():
        (folder / name).write_text(text)
    (config / "sweeps" / "grid.yaml").write_text(SWEEP)
    plant = load((config / "plants" / "exponential.yaml").read_text())
    effects = json.loads(subprocess.run([upright, "effects", "--json"], capture_output=True, check=True).stdout)["effects"]
    for effect in effects:
        values = {p["name"]: p["words"][int(p["typical"])] if "words" in p else p["typical"] for p in effect["parameters"]}
        level = [] if effect["kind"] == "coulomb_friction" else [{"kind": "coulomb_friction", "force_n": 0.5}]
        plant["plant"]["effects"] = [*level, {"kind": effect["kind"], **values}]
        (config / "plants" / f"with-{effect['kind']}.yaml").write_text(json.dumps(plant))


def places(node, path=()):
    """Every place of a document: the paths of its values."""
    if path:
        yield path
    for key, inner in node.items() if isinstance(node, dict) else enumerate(node) if isinstance(node, list) else ():
        yield from places(inner, (*path, key))


def parent_of(document, path):
    for key in path[:-1]:
        document = document[key]
    return document


class Mutator:
    def __init__(self, documents, seed):
        self.random = random.Random(seed)
        found = [(path, parent_of(d, path)[path[-1]]) for d in documents for path in places(d)]
        self.keys = sorted({path[-1] for path, _ in found if isinstance(path[-1], str)})
        self.words = sorted({value for _, value in found if isinstance(value, str) and "/" not in value and len(value) < 30})

    def value(self, old):
        pick = self.random.choice
        number = old if isinstance(old, (int, float)) and not isinstance(old, bool) else 1.0
        return pick(([], {}, [1.0, 2.0], {"kind": "none"}, True, None, "", "text", pick(self.words), 0, -1, 1, 1.5, 16, 1e12, 1e-20,
                     -number, number * 10, number * 1000, number / 1000, int(number)))

    def mutant(self, document):
        copied = copy.deepcopy(document)
        path = self.random.choice(list(places(copied)))
        parent, key = parent_of(copied, path), path[-1]
        what = self.random.randrange(8)
        if what == 0:
            del parent[key]
        elif what == 1 and isinstance(parent, dict):
            parent[self.random.choice((str(key) + "x", self.random.choice(self.keys)))] = parent.pop(key)
        elif what == 2 and isinstance(parent, dict):
            parent[self.random.choice(self.keys)] = self.value(1.0)
        elif what == 3 and isinstance(parent, list):
            parent.insert(0, copy.deepcopy(parent[key]))
        elif what <= 5 and isinstance(parent[key], str):
            parent[key] = self.random.choice(self.words)
        else:
            parent[key] = self.value(parent[key])
        return copied


def checked(upright, files):
    """What the program says of each file: None where it accepts it."""
    done = subprocess.run([upright, "check", "--json", *map(str, files)], capture_output=True, text=True)
    return [finding["error"] for finding in json.loads(done.stdout)["files"]]


def schemas_of(upright, shipped):
    """The validators by kind, and which files of `shipped` are not what the program writes."""
    schemas, wrong = {}, []
    for kind in KIND_BY_KEY.values():
        text = subprocess.run([upright, "schema", kind], capture_output=True, check=True).stdout
        file = shipped / f"{kind}.json"
        if not file.exists() or file.read_bytes() != text:
            wrong.append(f"{file} is not what the program writes: run 'upright schema {kind} --out {file}'")
        jsonschema.Draft7Validator.check_schema(json.loads(text))
        schemas[kind] = jsonschema.Draft7Validator(json.loads(text))
    return schemas, wrong


def wrong_links(config):
    """Shipped files whose first line does not name the schema of their kind."""
    for file in sorted(config.rglob("*.yaml")):
        text = file.read_text()
        link = re.match(r"# yaml-language-server: \$schema=(.*)\n", text)
        wanted = (config / "schema" / f"{kind_of(load(text))}.json").resolve()
        if not link or (file.parent / link[1]).resolve() != wanted:
            yield f"{file}: its first line does not name the schema {wanted}"


def kind_of(document):
    return next((kind for key, kind in KIND_BY_KEY.items() if key in document), None)


def compare(upright, schemas, mutants):
    """Mutants on which program and schema disagree, and how many both refuse."""
    wrong, refused = [], 0
    for at in range(0, len(mutants), 100):
        part = mutants[at:at + 100]
        for file, document in part:
            file.write_text(json.dumps(document))
        for (file, document), error in zip(part, checked(upright, [file for file, _ in part])):
            kind = kind_of(document)
            if kind is None:
                continue
            by_schema = next(schemas[kind].iter_errors(document), None)
            refused += error is not None and by_schema is not None
            if error is None and by_schema is not None:
                wrong.append(f"the schema refuses what the program accepts: {file}: {by_schema.json_path} {by_schema.message[:200]}: {json.dumps(document)[:2000]}")
            if error is not None and by_schema is None and not BEYOND.search(error):
                wrong.append(f"the schema accepts what the program refuses: {error}")
    return wrong, refused


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("upright")
    parser.add_argument("config", type=pathlib.Path)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--mutants", type=int, default=12, help="of each file")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    config = options.folder / "config"
    shutil.copytree(options.config, config)
    write_more_files(options.upright, config)
    files = sorted(config.rglob("*.yaml"))
    documents = {file: load(file.read_text()) for file in files}
    schemas, wrong = schemas_of(options.upright, options.config / "schema")
    wrong += wrong_links(options.config)
    wrong += [f"{file}: {error}" for file, error in zip(files, checked(options.upright, files)) if error]
    for file, document in documents.items():
        wrong += [f"{file}: the schema refuses it: {e.json_path} {e.message[:300]}"
                  for e in schemas[kind_of(document)].iter_errors(document)]
    mutator = Mutator(documents.values(), options.seed)
    mutants = [(file.with_name(f"mutant-{i}-{file.name}"), mutator.mutant(document))
               for file, document in documents.items() for i in range(options.mutants)]
    more, refused = compare(options.upright, schemas, mutants)
    wrong += more
    print(f"{len(files)} files, {len(mutants)} mutants, of which both refuse {refused}; {len(wrong)} wrong")
    for line in wrong:
        print(line)
    sys.exit(1 if wrong or refused == 0 else 0)


if __name__ == "__main__":
    main()
