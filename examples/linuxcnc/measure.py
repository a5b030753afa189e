#!/usr/bin/python3
"""Moves the axis of a running LinuxCNC to every target from both sides and writes what a laser would
read of a machine whose screw errs: columns target, run, direction, position (mm), and error, the
position without the noise of the laser less the target."""
import math
import os
import random
import sys
import time

import hal
import linuxcnc

TARGETS = [30.0 * i for i in range(11)]
RUNS = int(os.environ.get("PROVE_RUNS", "5"))
NOISE = 0.0005  # mm
OVERRUN = 5.0  # mm


def screw(motor, direction):
    """Where the slide stands for a motor position, mm."""
    pitch = 0.012 * motor / 300.0 + 0.004 * math.sin(2.0 * math.pi * motor / 130.0)
    lost = -0.003 if direction == "forward" else 0.003
    return motor + pitch + lost


def wait(command, timeout=60.0):
    ended = command.wait_complete(timeout)
    if ended not in (linuxcnc.RCS_DONE, linuxcnc.RCS_EXEC):
        sys.exit("the controller did not do what it was told (%s)" % ended)


def start(command, status):
    command.state(linuxcnc.STATE_ESTOP_RESET)
    wait(command)
    command.state(linuxcnc.STATE_ON)
    wait(command)
    command.mode(linuxcnc.MODE_MANUAL)
    wait(command)
    command.home(0)
    for _ in range(200):
        status.poll()
        if status.homed[0]:
            break
        time.sleep(0.05)
    else:
        sys.exit("the axis was not homed")
    command.mode(linuxcnc.MODE_MDI)
    wait(command)


def settled():
    """The motor position once it has stopped changing."""
    last = hal.get_value("joint.0.motor-pos-cmd")
    still = 0
    while still < 5:
        time.sleep(0.01)
        now = hal.get_value("joint.0.motor-pos-cmd")
        still = still + 1 if now == last else 0
        last = now
    return last


def measure(command, out):
    chance = random.Random(int(os.environ.get("PROVE_SEED", "1")))

    def go(position):
        command.mdi("G0 X%.6f" % position)
        wait(command)
        return settled()

    out.write("target,run,direction,position,error\n")
    for run in range(1, RUNS + 1):
        for direction in ("forward", "backward"):
            forward = direction == "forward"
            targets = TARGETS if forward else TARGETS[::-1]
            go(targets[0] - OVERRUN if forward else targets[0] + OVERRUN)
            for target in targets:
                true = screw(go(target), direction)
                read = true + chance.gauss(0.0, NOISE)
                out.write("%.1f,%d,%s,%.7f,%.7f\n" % (target, run, direction, read, true - target))


def main():
    own = hal.component("prove")
    own.ready()
    command, status = linuxcnc.command(), linuxcnc.stat()
    start(command, status)
    with open(os.environ["PROVE_OUT"] + ".part", "w") as out:
        measure(command, out)
    os.rename(os.environ["PROVE_OUT"] + ".part", os.environ["PROVE_OUT"])


main()
