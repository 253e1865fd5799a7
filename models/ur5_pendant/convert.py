#!/usr/bin/env python3
"""The controller's own geometry as phical parameters: nominal + delta, in mm and rad.

usage: convert.py CONTROLLER_FOLDER > deltas.json     (the folder with urcontrol.conf.UR5 and calibration.conf)
"""
import json
import re
import sys
from pathlib import Path


def table(path):
    """The `[delta_]symbol = [six numbers]` lines of a controller file."""
    lines = re.findall(r"^((?:delta_)?(?:theta|d|a|alpha)) = \[(.*)\]", Path(path).read_text(), re.M)
    return {name: [float(v) for v in values.split(",")] for name, values in lines}


def main(folder):
    nominal = table(Path(folder) / "urcontrol.conf.UR5")
    delta = table(Path(folder) / "calibration.conf")
    scale = {"theta": 1, "d": 1000, "a": 1000, "alpha": 1}      # metres to millimetres
    values = {}
    for joint in range(6):
        for symbol, unit in scale.items():
            start = nominal.get(symbol, [0] * 6)[joint]         # the controller has no nominal theta
            values[f"J{joint + 1}.{symbol}"] = (start + delta["delta_" + symbol][joint]) * unit
    json.dump(values, sys.stdout, indent=2)
    print()


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    main(sys.argv[1])
