#!/usr/bin/env python3
"""measurements.yaml → measurements.csv. The numbers are copied as they are written.

usage: convert.py MEASUREMENTS_YAML [OUT_CSV]         (default: measurements.csv beside this script)
"""
import re
import sys
from pathlib import Path

POSE = ["x", "y", "z", "qw", "qx", "qy", "qz"]


def main(source, out):
    # One entry per view: its time in quotes, seven named numbers, and the two joints as a list. No YAML library needed.
    text = Path(source).read_text()
    views = re.split(r"^'\d+':\n", text, flags=re.M)[1:]
    rows = ["q1,q2," + ",".join(POSE)]
    for view in views:
        joints = re.findall(r"^  - (\S+)$", view, re.M)
        pose = dict(re.findall(r"^    (\w+): (\S+)$", view, re.M))
        if len(joints) != 2 or sorted(pose) != sorted(POSE):
            sys.exit(f"not two joints and a pose:\n{view}")
        rows.append(",".join(joints + [pose[name] for name in POSE]))
    Path(out).write_text("\n".join(rows) + "\n")
    print(f"{len(views)} views → {out}", file=sys.stderr)


if __name__ == "__main__":
    if len(sys.argv) not in (2, 3):
        sys.exit(__doc__)
    main(sys.argv[1], sys.argv[2] if len(sys.argv) == 3 else Path(__file__).with_name("measurements.csv"))
