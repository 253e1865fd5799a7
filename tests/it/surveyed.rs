//! The instruments of the paper's survey, each a file in `models/`: read without a warning, of full rank with the datum they ship and
//! of the rank that theory says without, fitted, and honest over many seeds. `PHICAL_SEEDS=1000` makes more of them.

use std::fs;

use serde_json::Value;

use crate::cli::{ends, json, model, phical};
use crate::shared::project;

/// A model, and what its README says of what cannot be seen.
struct Surveyed {
    /// The folder.
    name: &'static str,
    /// What it holds as datum, or else what a free-standing version would free besides.
    datum: &'static [&'static str],
    /// How many directions are invisible without it.
    directions: usize,
    /// Parameters that take part in them, among others.
    among: &'static [&'static str],
}

const ALL: &[Surveyed] = &[
    Surveyed {
        name: "whitney_bar",
        datum: &["bar.z", "J1.theta", "J1.d", "J2.d", "J6.theta", "J6.d", "J6.a", "J6.alpha"],
        directions: 8,
        among: &["bar.z", "J2.a", "J1.theta", "J3.d"],
    },
    Surveyed {
        name: "jarvis_line",
        datum: &["L1.b", "L1.alpha", "R1.b", "R1.alpha"],
        directions: 4,
        among: &["L1.b", "R1.b"],
    },
    Surveyed {
        name: "driels_cmm",
        datum: &["L0.phi", "L0.d", "L1.phi", "L1.d", "L2.phi", "L2.d"],
        directions: 6,
        among: &["L0.phi", "L1.d", "L2.b"],
    },
    Surveyed {
        name: "judd_two_theodolites",
        datum: &["L1.b", "J6.phi", "J6.d"],
        directions: 3,
        among: &["L1.b", "R1.b", "J1.b", "point.x"],
    },
    Surveyed {
        name: "everett_beam",
        datum: &["J1.theta", "J1.d", "J2.d", "J2.a", "J6.theta", "J6.d", "J6.a", "J6.alpha", "radius"],
        directions: 9,
        among: &["J2.a", "radius", "late", "J3.d"],
    },
    Surveyed {
        name: "vincze_tracker",
        datum: &["pan.b", "pan.alpha", "J1.b", "J1.alpha", "J6.d", "J6.phi"],
        directions: 6,
        among: &["base.z", "base.rz", "hand.y", "hand.rz"],
    },
    Surveyed {
        name: "nakamura_tracker",
        datum: &["station[A]", "beam.z", "pan.phi", "pan.d"],
        directions: 9,
        among: &["beam.z", "dead"],
    },
    Surveyed {
        name: "preising_camera",
        datum: &["pitch", "J1.theta", "J1.d", "J2.d", "J6.theta", "J6.d", "J6.a", "J6.alpha"],
        directions: 8,
        among: &["pitch", "J2.a", "J3.d"],
    },
    Surveyed {
        name: "tang_line",
        datum: &["base.x", "base.y", "base.z", "base.rx", "J1.alpha", "J1.b"],
        directions: 6,
        among: &["base.x", "base.z", "J1.b"],
    },
    Surveyed {
        name: "legnani_scara",
        datum: &["base.x", "base.y", "base.z", "base.rz", "P3.phi", "R4.phi"],
        directions: 6,
        among: &["base.x", "R1.phi", "reflector.x"],
    },
    Surveyed {
        name: "mooring_cmm",
        datum: &["stretch_x", "J1.theta", "J1.d", "J2.d", "J6.theta", "J6.d", "J6.a", "J6.alpha"],
        directions: 8,
        among: &["stretch_x", "J2.a", "J3.d"],
    },
    Surveyed { name: "stone_ultrasound", datum: &["J2.a", "J1.b", "J1.alpha"], directions: 3, among: &["J1.b"] },
    Surveyed {
        name: "sultan_axes",
        datum: &["J6.phi", "J6.d"],
        directions: 2,
        among: &["J6.phi", "J6.d", "target[A].x"],
    },
    Surveyed { name: "epipolar_pair", datum: &["base.x"], directions: 1, among: &["base.x", "base.y", "base.z"] },
];

fn strings(value: &Value) -> Vec<String> {
    value.as_array().unwrap().iter().map(|v| v.as_str().unwrap().to_owned()).collect()
}

#[test]
fn every_one_reads_without_a_warning_and_in_150_lines() {
    for of in ALL {
        let checked = phical(&["check", &model(of.name)]);
        let said = String::from_utf8(checked.stderr).unwrap();
        assert!(checked.status.success() && said.is_empty(), "{}: {said}", of.name);
        let folder = project("models").join(of.name);
        for file in fs::read_dir(&folder).unwrap().map(|file| file.unwrap().path()) {
            if file.extension().is_some_and(|extension| extension == "ron") {
                let lines = fs::read_to_string(&file).unwrap().lines().count();
                assert!(lines <= 150, "{}: {lines} lines", file.display());
            }
        }
        assert!(folder.join("README.md").exists(), "{}", of.name);
    }
}

#[test]
fn the_datum_cures_what_theory_says_and_nothing_else() {
    for of in ALL {
        let file = model(of.name);
        let shipped = json(0, &["identify", &file, "--structural"]);
        assert_eq!(shipped["rank"], shipped["free"], "{}", of.name);
        let free: Vec<&str> = of.datum.iter().flat_map(|name| ["--free", *name]).collect();
        let freed = json(1, &[&["identify", &file, "--structural"][..], &free].concat());
        let rank = |found: &Value| found["rank"].as_u64().unwrap();
        assert_eq!(freed["free"].as_u64().unwrap() - rank(&freed), of.directions as u64, "{}", of.name);
        assert_eq!(freed["null_directions"].as_array().unwrap().len(), of.directions, "{}", of.name);
        let takes_part = |name: &str| {
            let of = |direction: &Value| direction["combination"].as_object().unwrap().contains_key(name);
            freed["null_directions"].as_array().unwrap().iter().any(of)
        };
        for name in of.among {
            assert!(takes_part(name), "{}: {name} in {}", of.name, freed["null_directions"]);
        }
    }
}

#[test]
fn the_data_beside_them_are_their_scenario_and_are_fitted() {
    let directory = tempfile::tempdir().unwrap();
    for of in ALL {
        let out = directory.path().join(of.name);
        ends(0, &["simulate", &model(of.name), "--out", out.to_str().unwrap()]);
        for made in fs::read_dir(&out).unwrap().map(|file| file.unwrap().path()) {
            let beside = project("models").join(of.name).join(made.file_name().unwrap());
            assert_eq!(
                fs::read_to_string(&made).unwrap(),
                fs::read_to_string(&beside).unwrap(),
                "{}",
                beside.display()
            );
        }
        let fit = json(0, &["calibrate", &model(of.name)]);
        assert_eq!(
            (&fit["trustworthy"], &fit["rank"]),
            (&true.into(), &fit["parameters"].as_array().unwrap().len().into()),
            "{}",
            of.name
        );
    }
}

/// Over many seeds: χ² by its degrees of freedom about one, and intervals that hold the truth as often as they say.
#[test]
fn every_one_is_honest_over_many_seeds() {
    let seeds: usize = std::env::var("PHICAL_SEEDS").map_or(10, |seeds| seeds.parse().unwrap());
    for of in ALL {
        let found = json(0, &["coverage", &model(of.name), "--seeds", &seeds.to_string()]);
        let number = |value: &Value| value.as_f64().unwrap();
        assert_eq!((&found["failed"], &found["not_simulated"]), (&0.into(), &0.into()), "{}", of.name);
        assert!(strings(&found["not_estimable"]).is_empty(), "{}", of.name);
        let parameters = found["parameters"].as_array().unwrap();
        let coverage: Vec<f64> = parameters.iter().map(|p| number(&p["coverage"])).collect();
        let overall = coverage.iter().sum::<f64>() / coverage.len() as f64;
        let (least, most) =
            (coverage.iter().copied().fold(1.0, f64::min), coverage.iter().copied().fold(0.0, f64::max));
        let chi = number(&found["chi_squared_per_dof"]["median"]);
        eprintln!("{}: χ²/dof {chi:.3}, coverage {least:.3} to {most:.3}, overall {overall:.4}", of.name);
        assert!((0.9..=1.1).contains(&chi), "{}: χ²/dof {chi}", of.name);
        if seeds >= 1000 {
            assert!((0.935..=0.965).contains(&overall), "{}: {overall}", of.name);
            assert!(0.91 <= least && most <= 0.99, "{}: {least} to {most}", of.name);
        } else {
            // runs are independent and parameters of a run are not: as few as so many intervals
            let spread = (0.95 * 0.05 / seeds as f64).sqrt();
            assert!(overall > 0.95 - 4.0 * spread, "{}: {overall}", of.name);
        }
    }
}

/// The table of `models/README.md`, but for the times. `PHICAL_UPDATE=1` does not write it: the command above it does.
#[test]
fn the_table_is_true() {
    let text = fs::read_to_string(project("models/README.md")).unwrap();
    let said: Vec<Vec<&str>> =
        text.lines().filter(|line| line.starts_with("| models/")).map(|line| line.split(" | ").collect()).collect();
    assert!(said.len() >= ALL.len(), "{}", said.len());
    let files: Vec<String> = said.iter().map(|line| line[0].trim_start_matches("| ").to_owned()).collect();
    for of in ALL {
        assert!(files.contains(&format!("models/{}/model.ron", of.name)), "{}", of.name);
    }
    let paths: Vec<String> = files.iter().map(|file| project(file).display().to_string()).collect();
    let mut arguments = vec!["overview"];
    arguments.extend(paths.iter().map(String::as_str));
    let found = ends(0, &arguments).replace(&project("").display().to_string(), "");
    for (said, found) in said.iter().zip(found.lines().skip(2)) {
        let found: Vec<&str> = found.split(" | ").collect();
        assert_eq!(said[..said.len() - 1], found[..found.len() - 1]);
    }
}

/// Parameters by name: value and standard uncertainty.
fn estimates(fit: &Value) -> Vec<(String, f64, f64)> {
    let one = |p: &Value| Some((p["name"].as_str()?.to_owned(), p["value"].as_f64()?, p["sigma"].as_f64()?));
    fit["parameters"].as_array().unwrap().iter().filter_map(one).collect()
}

fn of<'e>(all: &'e [(String, f64, f64)], name: &str) -> &'e (String, f64, f64) {
    all.iter().find(|(known, ..)| known == name).unwrap_or_else(|| panic!("{name}"))
}

/// `driels_cmm`: a theodolite in the φ-model and in Hayati's form is one instrument.
#[test]
fn two_conventions_are_one_calibration() {
    let directory = tempfile::tempdir().unwrap();
    let routes = ["model.ron", "hayati.ron"].map(|file| {
        let model = project("models/driels_cmm").join(file).display().to_string();
        let out = directory.path().join(file).with_extension("json").display().to_string();
        let fit = json(0, &["calibrate", &model, "--out", &out]);
        (fit, json(0, &["evaluate", &model, "--fit", &out]))
    });
    let [(phi, by_phi), (hayati, by_hayati)] = routes;
    let cost = |fit: &Value| fit["sum_of_squares"].as_f64().unwrap();
    assert!((cost(&phi) / cost(&hayati) - 1.0).abs() < 1e-9, "{} {}", cost(&phi), cost(&hayati));
    assert_eq!(phi["dof"], hayati["dof"]);
    let numbers = |found: &Value, pointer: &str| -> Vec<f64> {
        let outputs = found["measurements"]["point"]["outputs"].as_array().unwrap();
        let of = |output: &Value| output.pointer(pointer).unwrap().as_array().unwrap().clone();
        outputs.iter().flat_map(of).map(|number| number.as_f64().unwrap()).collect()
    };
    for (pointer, allowed) in [("/values", 1e-8), ("/uncertainty/sigma", 1e-9)] {
        let (one, other) = (numbers(&by_phi, pointer), numbers(&by_hayati, pointer));
        assert_eq!(one.len(), 120);
        assert!(one.iter().zip(&other).all(|(a, b)| (a - b).abs() < allowed), "{pointer}");
    }
}

/// `sultan_axes`: axis by axis, then the chain with what is known of the axes, against everything at once.
#[test]
fn axes_one_by_one_lead_where_the_joint_fit_does() {
    let directory = tempfile::tempdir().unwrap();
    let at = |file: &str| project("models/sultan_axes").join(file).display().to_string();
    let axes = directory.path().join("axes.json").display().to_string();
    json(0, &["calibrate", &at("axes.ron"), "--out", &axes]);
    let by_axes = estimates(&json(0, &["calibrate", &at("chain.ron"), "--known", &axes]));
    let joint = estimates(&json(0, &["calibrate", &at("model.ron")]));
    let chain: Vec<_> = joint.iter().filter(|(name, ..)| name.starts_with('J')).collect();
    assert_eq!(chain.len(), 24);
    for (name, value, sigma) in chain {
        let (_, other, wider) = of(&by_axes, name);
        assert!((value - other).abs() < 3.0 * wider, "{name}: {value} {other} ± {wider}");
        assert!(*sigma < 1.001 * wider, "{name}: ± {sigma} and ± {wider}");
    }
}

/// `judd_two_theodolites`: the module alone, then the robot with the module's covariance, is the common fit; without it, sigmas lie.
#[test]
fn a_cascade_with_its_covariance_is_the_common_fit() {
    let directory = tempfile::tempdir().unwrap();
    let module = directory.path().join("module.json").display().to_string();
    let judd = model("judd_two_theodolites");
    let bars = format!("vo_line={}", project("models/judd_two_theodolites/vo_line.csv").display());
    json(0, &["calibrate", &model("two_theodolite"), "--data", &bars, "--out", &module]);
    let common = estimates(&json(0, &["calibrate", &judd]));
    let second = ["calibrate", &judd, "--without", "vo_line"];
    let cascade = estimates(&json(0, &[&second[..], &["--known", &module]].concat()));
    for (name, value, sigma) in &common {
        let (_, other, after) = of(&cascade, name);
        assert!((value - other).abs() < 0.1 * sigma, "{name}: {value} ± {sigma}, {other}");
        assert!((after / sigma - 1.0).abs() < 0.05, "{name}: {sigma} {after}");
    }
    let exact: Vec<String> = ["L0", "L1", "L2", "R0", "R1", "R2"].map(|joint| format!("--fix={joint}.*")).to_vec();
    let exact: Vec<&str> = exact.iter().map(String::as_str).collect();
    let output = phical(&[&second[..], &["--start", &module, "--format", "json"], &exact].concat());
    let ignorant = estimates(&serde_json::from_slice(&output.stdout).unwrap());
    let (_, there, sigma) = of(&common, "J0.a");
    let (_, claimed, narrow) = of(&ignorant, "J0.a");
    assert!(5.0 * narrow < *sigma && (there - claimed).abs() > 5.0 * narrow, "{there} ± {sigma}, {claimed} ± {narrow}");
}
