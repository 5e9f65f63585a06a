"""How each page's commands are run, for scripts/check_commands.py and scripts/list_commands.py.

A stage says what is there when the page begins, and what is run in place of what the page says: names that a reader
puts in, addresses and devices, and shorter durations. Nothing else is replaced.
"""
import dataclasses


@dataclasses.dataclass
class Stage:
    setup: str = ""  # in bash, with the functions of bench.sh
    replaced: tuple = ()  # pairs: a regular expression of what the page says, and what is run
    stopped: tuple = ()  # commands that end with 3 or 4 where no human, card or real-time kernel is: expressions
    real_time: bool = False  # a stall of the machine may end a run: the block is then tried again


FAST = (r"upright run (?=--rig my-rig)", "upright run --fast --theta0-deg 5 ")
FAST_EXPERIMENT = (r"upright experiment .*(?=--rig my-rig)", r"\g<0>--fast ")
SHORT_DOCTOR = (r"upright doctor (?=--rig)", "upright doctor --seconds 0.2 --hand-wait 0.1 ")
# The verdict is bad on a machine that cannot do real time.
DOCTOR = r"upright doctor .*"

STAGES = {
    "CONTRIBUTING.md": Stage(setup="cp $source/.pre-commit-config.yaml ."),
    "README.md": Stage(
        setup="tcp_rig; tcp_device 3 0.5",
        replaced=((r"--duration 30", "--duration 2 --unchecked"),),
        real_time=True),
    "docs/architecture.md": Stage(
        # The program that is built stands in for that of each architecture (bin/cmake).
        setup="sed -i 's/--duration 20/--duration 2/' scripts/check-same-bits.sh",
        replaced=((r"scripts/check-same-bits\.sh", "UPRIGHT_SKIP_PAPER=1 scripts/check-same-bits.sh"),)),
    "docs/explanation/delay.md": Stage(
        replaced=((r"PLANT --delay S", "config/plants/viscous.yaml --delay 0.02"),)),
    "docs/explanation/diagnosis.md": Stage(
        setup="example_runs 3",
        replaced=((r"PLANT --data RUN\.\.\. --out DIR", "config/plants/exponential.yaml --data runs/* --out diagnosis"),)),
    "docs/how-to/build-a-board.md": Stage(
        setup="board_device 180 0",
        replaced=((r" --seconds 1$", ""), SHORT_DOCTOR, (r"--wait 120", "--wait 0.1"),
                  (r"upright run (.*) --duration 30", r"board_device 3 1 && upright run \1 --duration 2")),
        # A hanging pendulum counts as fallen.
        stopped=(DOCTOR, r"upright run .* --wait 120 --unchecked"),
        real_time=True),
    "docs/how-to/choose-a-delay.md": Stage(
        setup="simulated_rig", replaced=(SHORT_DOCTOR,), stopped=(DOCTOR,)),
    "docs/how-to/find-a-missing-effect.md": Stage(
        # The demonstration with three shorter runs in place of six: its search takes a quarter of the time.
        setup="sed -i '/^viscous [45]/d; /^exponential 3/d; s/--duration 8/--duration 4/' scripts/diagnose-demo.sh; "
              "example_runs 3; cp config/plants/exponential.yaml my-plant.yaml",
        replaced=((r"RUN RUN RUN", "runs/*"),)),
    "docs/how-to/first-rig.md": Stage(
        setup="tcp_rig; tcp_device 180 0; touch $bench/comedi0",
        replaced=(
            (r"/dev/comedi0", "$bench/comedi0"),
            SHORT_DOCTOR,
            # Enter four times, yes, and Enter; a card that is pretended, and hands that are not there.
            (r"scripts/quanser-first-day.sh my-rig.yaml my-gains.yaml",
             r"quanser_rig && printf '\\n\\n\\n\\ny\\n\\n' | UPRIGHT=operator scripts/quanser-first-day.sh "
             r"quanser.yaml my-gains.yaml && grep '^All steps passed' quanser-first-day-*/proof.txt && tcp_device 180 0"),
            (r"--out my-gains.yaml", "--out my-own-gains.yaml"),
            (r"experiment config/experiments/sign-check.yaml", r"\g<0> --rate 200"),
            (r"upright run --rig my-rig.yaml --gains my-gains.yaml --duration 30",
             "tcp_device 3 1 && upright run --rig my-rig.yaml --gains my-gains.yaml --duration 2"),
            (r"upright virtual-rig --rig config/rigs/modbus-tcp.yaml --tcp 127.0.0.1:1502 --theta0-deg 3 --hang 5",
             "tcp_device 3 1"),
            (r"--rig config/rigs/modbus-tcp.yaml --gains config/gains/exponential.yaml --duration 30",
             "--rig my-rig.yaml --gains my-gains.yaml --duration 2"),
        ),
        # A hanging pendulum counts as fallen.
        stopped=(DOCTOR, r"upright run .* --wait 0 --unchecked"),
        real_time=True),
    "docs/how-to/identify-parameters.md": Stage(setup="simulated_rig", replaced=(FAST_EXPERIMENT,)),
    "docs/how-to/improve-a-controller.md": Stage(
        setup="simulated_rig; cp config/gains/viscous.yaml my-gains.yaml; example_runs 2",
        replaced=(FAST,)),
    "docs/how-to/optimise-gains.md": Stage(
        # Fewer and shorter runs: seconds in place of minutes.
        setup="sed -i 's/samples: 40/samples: 4/; s/duration_s: 6/duration_s: 3/' config/sweeps/optimise-exponential.yaml",
        replaced=((r"upright optimise \S+", r"\g<0> --evaluations 30"),)),
    "docs/how-to/run-sweeps.md": Stage(
        replaced=((r"mpirun -n 64 (.*)", r"mpirun --allow-run-as-root --oversubscribe -n 2 \1 --overwrite"),)),
    "docs/how-to/watch-remotely.md": Stage(
        setup="simulated_rig",
        replaced=((r"upright run (.*) --live", r"upright run \1 --live=0 --duration 1"),
                  (r"upright run (.*) --stream", r"upright run \1 --duration 1 --stream"),
                  (r"experiments/pivot.yaml (.*) --live", r"experiments/sign-check.yaml \1 --live=0")),
        real_time=True),
    "docs/reference/commands.md": Stage(replaced=((r"COMMAND", "run"),)),
    "docs/reference/dataset-files.md": Stage(replaced=((r"FILE", "config/plants/viscous.yaml"),)),
    "docs/reference/experiment-files.md": Stage(
        setup="simulated_rig; sed 's/hold_s: 30/hold_s: 3/; s/: 5,/: 2,/; s/3, 4, 5]/]/; s/, ]/]/' "
              "config/experiments/compare-controllers.yaml >config/experiments/turns.yaml",
        replaced=((r"experiment FILE", "experiment config/experiments/turns.yaml --out turns"),
                  (r"FOLDER", "turns"), FAST_EXPERIMENT)),
    "docs/reference/files.md": Stage(replaced=((r"FILES\.\.\.", "config/plants/*.yaml config/gains/*.yaml"),)),
    "docs/reference/rig-files.md": Stage(replaced=((r"FILE", "config/rigs/modbus-tcp.yaml"),)),
    "docs/reference/run-directory.md": Stage(
        setup="example_runs 2", replaced=((r"RUN\.\.\.", "runs/*"), (r"replay RUN", "replay runs/*-data1"))),
    "docs/results/real-data.md": Stage(
        setup="free_decay data/uw/single_pendulum_free_swing.csv",
        replaced=((r"real-data\.sh DATA", "real-data.sh data results uw"),)),
    "docs/results/soak.md": Stage(
        replaced=((r"scripts/soak\.sh(?= +#)", "scripts/soak.sh --virtual-hours 0.01667 --real-minutes 0"),
                  (r"--real-minutes 60", "--real-minutes 0.1 --busy")), real_time=True),
    "docs/tutorial/first-hour.md": Stage(
        replaced=((r"git clone <address of the repository> upright", "git clone --quiet $source upright"),)),
}

# Run by something else: an expression of the command, who runs it, the file that says so, and what stands there.
ELSEWHERE = (
    (r"scripts/api-reference\.sh", ".ci/run, step 'reference of the library'", ".ci/run", "scripts/api-reference.sh"),
    (r"cmake -DUPRIGHT_EXTRA_EFFECTS=FILE", ".ci/run, step 'Debian package': the example own-effect",
     "examples/own-effect/CMakeLists.txt", "UPRIGHT_EXTRA_EFFECTS"),
    (r"scripts/(package|test-package)\.sh", ".ci/run, step 'Debian package'", ".ci/run", "scripts/test-package.sh"),
    (r"sudo apt-get install \./upright_\*_amd64\.deb", ".ci/run, step 'Debian package'", "scripts/test-package.sh",
     "apt-get install -y --no-install-recommends"),
    (r"sudo adduser \$USER upright", ".ci/run, step 'Debian package'", "scripts/test-package.sh", "adduser --quiet student upright"),
    (r"upright run --rig /usr/share/upright/config/.*", ".ci/run, step 'Debian package'", "scripts/test-package.sh",
     'as_user "upright run --rig $share/rigs/simulated.yaml'),
    (r"upright schema .*", "new_file_test", "tests/acceptance/new_file_test.cpp", '"schema gains --out'),
    (r"upright doctor --fix", "doctor_command_test", "tests/acceptance/doctor_command_test.cpp", '"doctor --fix"'),
    (r"cmake --install( build/release --prefix ~/\.local)?", ".ci/run, step 'Debian package': cpack runs the same rules",
     "cmake/install.cmake", "What `cmake --install` and the package contain"),
    (r"\.ci/run", "continuous integration, for each commit", ".ci/run", "Everything that must hold for a commit"),
    (r"scripts/build\.sh .*", ".ci/run, step 'build'", ".ci/run", "scripts/build.sh ci"),
    (r"scripts/test\.sh( ci)?", ".ci/run, step 'tests'", ".ci/run", "scripts/test.sh ci"),
    (r"ctest (--preset ci )?-L \w+", ".ci/run, step 'tests': all labels", "scripts/test.sh", 'ctest --preset "$preset"'),
    (r"scripts/install-deps\.sh( --dev)?", ".ci/run, step 'packages'", ".ci/run", "scripts/install-deps.sh --dev"),
    (r"scripts/check_(includes|sizes|docs|keys|prose)\.py", ".ci/run", ".ci/run", r"scripts/check_\1.py"),
    (r"scripts/check_includes\.py --write", "check_includes_test", "tests/unit/check_includes_test.py", "--write"),
    (r"scripts/check_commands\.py --upright PROGRAM PAGE\.\.\.", "tutorial_test", "tests/CMakeLists.txt",
     "scripts/check_commands.py"),
    (r"scripts/list_commands\.py", "page_commands_listed", "tests/unit/CMakeLists.txt", "scripts/list_commands.py"),
    (r"scripts/check_key_tables\.py --upright PROGRAM", "key_tables_test", "tests/acceptance/CMakeLists.txt",
     "scripts/check_key_tables.py --upright"),
    (r"scripts/write_reference\.py --upright PROGRAM", "reference_test", "tests/acceptance/CMakeLists.txt",
     "scripts/write_reference.py --upright"),
    (r"scripts/render-docs\.sh", ".ci/run, step 'documents as web pages'", ".ci/run", "scripts/render-docs.sh"),
    (r"scripts/test-kernel\.sh", ".ci/run, step 'GPIO and Comedi'", ".ci/run", "scripts/test-kernel.sh"),
    (r"scripts/fuzz\.sh SECONDS", ".ci/run, step 'fuzzing'", ".ci/run", "scripts/fuzz.sh 60"),
    (r"scripts/lint\.sh", ".ci/run, step 'clang-tidy'", ".ci/run", "scripts/lint.sh"),
    (r"scripts/count_retries\.py", ".ci/run, step 'retries and skips'", ".ci/run", "scripts/count_retries.py"),
    (r"scripts/improve-demo\.sh FOLDER", "improve_demo_test", "tests/acceptance/improve_demo_test.cpp",
     '"/scripts/improve-demo.sh"'),
    (r"upright identify( .*)?", "identify_command_test: minutes on these two experiments",
     "tests/acceptance/identify_command_test.cpp", '"identify --data"'),
    (r"upright effects", "reference_test", "scripts/write_reference.py", '"effects", "--json"'),
    (r"scripts/reproduce-paper\.sh", "paper_command_test", "tests/acceptance/paper_command_test.cpp",
     '"/scripts/reproduce-paper.sh"'),
    (r"scripts/(cross-tables|side-by-side)\.sh DATA", "comparison_test", "studies/comparison/comparison_test.py", r"scripts/\1.sh"),
    (r"scripts/real_data\.py", "diagnosis_pages_test: scripts/real-data.sh", "scripts/real-data.sh", "scripts/real_data.py"),
    (r"upright paper", "paper_command_test", "tests/acceptance/paper_command_test.cpp", '"paper --config "'),
)
