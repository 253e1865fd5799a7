#!/usr/bin/env python3
"""NIST StRD, nonlinear regression: certified.json → one model folder per set, beside this script.

usage: convert.py NIST_FOLDER       (the folder with certified.json and the .dat files)
"""
import json
import re
import sys
from pathlib import Path

MODEL = """\
Model(
    name: "{name}",
    source: "NIST StRD, nonlinear regression, {name}.dat",
    description: "{about}",

    parameters: {{
{parameters}
    }},

    measurements: {{
        "{measurement}": (
            data: "data.csv",
            inputs: {{ {inputs} }},
            residuals: {{ "r": "{residual}" }},
        ),
    }},
)
"""

README = """\
# {name}

{about}, {n_obs} observations, {n_par} parameters, NIST level of difficulty: {level}. Residual: `{model}`

    phical check models/nist/{name}/model.ron
    phical calibrate models/nist/{name}/model.ron
    phical calibrate models/nist/{name}/model.ron --start models/nist/{name}/start2.json

| parameter | start 1 (model.ron) | start 2 | certified | its standard deviation |
|---|---|---|---|---|
{rows}

Certified residual sum of squares {rss}, residual standard deviation {resid_sd}, {dof} degrees of freedom.
{note}
Source: NIST Statistical Reference Datasets, public domain. Written by `models/nist/convert.py`.
"""

NOTES = {
    "Lanczos1": "The data are exact to rounding, so the residuals are rounding errors: compare the parameters, not their standard deviations.\n",
    "Nelson": "The response is log(y).\n",
}


def in_phical(model):
    """A NIST formula in the residual language; the response is what stands left of `=`, or y."""
    model = re.sub(r"\s+\(two predictors.*", "", model)
    response, _, formula = model.rpartition("=")
    formula = formula.strip().replace("arctan", "atan")
    formula = re.sub(r"\^(-[0-9.]+)", r"^(\1)", formula)
    return f"{response.strip() or 'y'} - ({formula})"


def described(dat):
    """What the .dat file says of its difficulty, its data and its formula."""
    patterns = r"(\w+) Level of Difficulty", r"(Observed|Generated) Data", r"(\w+) Class"
    difficulty, kind, form = (re.search(pattern, dat)[1].lower() for pattern in patterns)
    return difficulty, f"{kind.capitalize()} data, {form} class"


def main(folder):
    here = Path(__file__).parent
    for s in json.loads((Path(folder) / "certified.json").read_text()):
        name, columns = s["name"], ["x"] if len(s["x"][0]) == 1 else ["x1", "x2"]
        b = [f"b{i + 1}" for i in range(s["n_par"])]
        difficulty, about = described((Path(folder) / f"{name}.dat").read_text())
        out = here / name
        out.mkdir(exist_ok=True)
        # repr is the shortest text that reads back as the same double.
        (out / "data.csv").write_text("".join(
            ",".join(row) + "\n" for row in [columns + ["y"]] + [[repr(v) for v in [*x, y]] for x, y in zip(s["x"], s["y"])]))
        (out / "start2.json").write_text(json.dumps(dict(zip(b, s["start2"])), indent=2) + "\n")
        (out / "model.ron").write_text(MODEL.format(
            name=name, about=about, measurement="observation", residual=in_phical(s["model"]),
            parameters="\n".join(f'        "{p}": Scalar(Free({v!r})),' for p, v in zip(b, s["start1"])),
            inputs=", ".join(f'"{c}": ()' for c in columns + ["y"])))
        rows = zip(b, s["start1"], s["start2"], s["certified"], s["certified_sd"])
        (out / "README.md").write_text(README.format(
            **{k: s[k] for k in ("n_obs", "n_par", "rss", "resid_sd", "dof")}, name=name, about=about, level=difficulty,
            model=in_phical(s["model"]), rows="\n".join("| " + " | ".join(map(str, r)) + " |" for r in rows), note=NOTES.get(name, "")))


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    main(sys.argv[1])
