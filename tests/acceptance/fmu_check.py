#!/usr/bin/env python3
"""Validates and simulates FMUs of `upright export --fmu` with FMPy, which knows nothing of upright.

  fmu_check.py UPRIGHT CONFIG FOLDER

For each plant: FMPy's validation finds nothing; at steps of 1 ms the FMU under the voltages of a run in virtual time has
the counts of that run, without a difference; a state that was saved and set again leads to the same bits; parameters
change the motion, and wrong ones are refused. Ends with 1 and a line for each finding.
"""
import csv
import pathlib
import subprocess
import sys

import numpy
from fmpy import extract, read_model_description, simulate_fmu
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import FMU2Slave
from fmpy.validation import validate_fmu

upright, config, folder = sys.argv[1], pathlib.Path(sys.argv[2]).resolve(), pathlib.Path(sys.argv[3]).resolve()
findings = []


def expect(condition, text):
    if not condition:
        findings.append(text)


def run_upright(*words):
    done = subprocess.run([upright, *map(str, words)], capture_output=True, text=True)
    if done.returncode not in (0, 3):  # a run whose pendulum fell is a run
        sys.exit(f"{words}: {done.stderr}")
    return done.stdout.split("\n")


def slave_of(fmu):
    """An instance, and its variables by name."""
    description = read_model_description(fmu)
    slave = FMU2Slave(guid=description.guid, unzipDirectory=extract(fmu),
                      modelIdentifier=description.coSimulation.modelIdentifier, instanceName="one")
    slave.instantiate()
    return slave, {v.name: v.valueReference for v in description.modelVariables}


def begin(fmu, **parameters):
    slave, names = slave_of(fmu)
    slave.setupExperiment(startTime=0.0)
    slave.enterInitializationMode()
    for name, value in parameters.items():
        slave.setReal([names[name.replace("__", ".")]], [value])
    slave.exitInitializationMode()
    return slave, names


def outputs(slave, names):
    return slave.getReal([names[n] for n in ("cart_m", "theta_rad", "cart_velocity_mps", "pendulum_rate_radps",
                                             "motor_force_n", "other_force_n") if n in names])


def check_against_run(fmu, plant, theta_rad):
    rig = (config / "rigs/simulated.yaml").read_text().replace("../plants/exponential.yaml", str(plant))
    rig = rig.replace("quantise: true", "quantise: false")
    (folder / "rig.yaml").write_text(rig)
    directory = run_upright("run", "--fast", "--rig", folder / "rig.yaml", "--gains", config / "gains/exponential.yaml",
                            "--theta0-deg", 3, "--duration", 5, "--force", "--out", folder)[-2]
    rows = list(csv.DictReader(open(pathlib.Path(directory) / "samples.csv")))
    expect(len(rows) > 100, f"{plant}: the run has {len(rows)} rows only")
    per_count = 2.27485e-5 / 1024, 2 * numpy.pi / 4096 / 1024  # counts of a rig without quantisation
    slave, names = begin(fmu, initial_theta_rad=theta_rad)
    for k, row in enumerate(rows):
        shown = slave.getReal([names["cart_m"], names["theta_rad"]])
        counts = [int(numpy.rint(value / size)) for value, size in zip(shown, per_count)]
        logged = [int(row["cart_counts"]), int(row["pendulum_counts"])]
        if counts != logged:
            findings.append(f"{plant}: row {k}: the FMU has the counts {counts}, the run {logged}")
            return
        slave.setReal([names["voltage_v"]], [float(row["voltage_v"])])
        slave.doStep(currentCommunicationPoint=k * 1e-3, communicationStepSize=1e-3)


def check_state(fmu):
    slave, names = begin(fmu)

    def go_on(first, last):
        for k in range(first, last):
            slave.setReal([names["voltage_v"]], [3.0 if k % 200 < 100 else -2.0])
            slave.doStep(currentCommunicationPoint=k * 1e-3, communicationStepSize=1e-3)
        return outputs(slave, names)

    go_on(0, 300)
    saved = slave.getFMUState()
    once = go_on(300, 900)
    slave.setFMUState(saved)
    expect(go_on(300, 900) == once, f"{fmu}: a state that was set again leads elsewhere")
    slave.freeFMUState(saved)
    slave.reset()
    slave.setupExperiment(startTime=0.0)
    slave.enterInitializationMode()
    slave.exitInitializationMode()
    go_on(0, 300)
    expect(go_on(300, 900) == once, f"{fmu}: after a reset it leads elsewhere")
    slave.terminate()
    slave.freeInstance()


def check_parameters(fmu):
    def after(**parameters):
        slave, names = begin(fmu, **parameters)
        slave.setReal([names["voltage_v"]], [5.0])
        slave.doStep(currentCommunicationPoint=0.0, communicationStepSize=0.5)
        return outputs(slave, names)

    plain = after()
    expect(after(cart_mass_kg=2.0) != plain, f"{fmu}: the mass changes nothing")
    expect(after(coulomb_friction__force_n=1.5) != plain, f"{fmu}: the friction changes nothing")
    expect(abs(plain[4]) > 0.0 and plain[5] < 0.0, f"{fmu}: forces {plain[4:]}: the motor pushes, friction resists")
    for wrong in ({"cart_mass_kg": -1.0}, {"coulomb_friction__force_n": -1.0}, {"initial_cart_m": float("nan")}):
        try:
            after(**wrong)
            findings.append(f"{fmu}: takes {wrong}")
        except FMICallException:
            pass


plants = {"exponential": config / "plants/exponential.yaml", "dynamic": config / "plants/dynamic.yaml"}
lagged = folder / "late and lagged.yaml"
lagged.write_text((config / "plants/exponential.yaml").read_text().rstrip() +
                  "\n    - {kind: input_delay, delay_s: 0.0034}\n    - {kind: motor_lag, time_constant_s: 0.004}\n"
                  "    - {kind: angle_scale, scale: 1.02}\n    - {kind: constant_force, force_n: 0.1}\n")
for plant in (*plants.values(), lagged):
    fmu = str(folder / (plant.stem + ".fmu"))
    run_upright("export", plant, "--fmu", "--out", fmu)
    problems = validate_fmu(fmu)
    expect(not problems, f"{fmu}: FMPy's validation: {problems}")
    check_against_run(fmu, plant, numpy.float64(3.0) / numpy.float64(180.0 / numpy.pi))
    check_state(fmu)
    check_parameters(fmu)
    time_s = numpy.arange(0, 2, 0.001)
    voltage = numpy.array(list(zip(time_s, numpy.sign(numpy.sin(3 * time_s)))),
                          dtype=[("time", float), ("voltage_v", float)])
    result = simulate_fmu(fmu, stop_time=2.0, input=voltage, output=["cart_m", "theta_rad"])
    expect(len(result) > 100 and numpy.ptp(result["cart_m"]) > 1e-3, f"{fmu}: simulate_fmu moved nothing")
for finding in findings:
    print(finding)
sys.exit(1 if findings else 0)
