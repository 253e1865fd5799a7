//! A chain of a model with numbers in it: as declared, or as a fit has them, with how they change with what was estimated.

use nalgebra::{Const, OVector, U1};
use num_dual::{Derivative, DualSVec64};

use super::motion::Screw;
use super::motion::{Motion, Real};
use super::phi::{PhiLink, phi_motion};
use super::serial::{Kind, Serial};
use crate::compile::compile;
use crate::data::Table;
use crate::diag::{Code, Diagnostic, Diagnostics, did_you_mean};
use crate::model::{Joint, Measurement, Parameter, Reads, Text};
use crate::problem::{Options, Problem, Quantities, Selection, Undefined, Weights};
use crate::session::Session;

/// Partials carried side by side.
pub(super) const LANES: usize = 8;

/// A number with some of its partials.
pub(super) type Lanes = DualSVec64<LANES>;

/// What a joint of a model contributes, its numbers in the order of their fields.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Form {
    /// φ, d, a, b, α, β
    Phi(Option<Kind>),
    /// x, y, z, rx, ry, rz
    Rigid,
    /// the origin, if it has one, and the first two axes
    Pose { origin: bool },
    /// θ, d, a, α, β
    Row { modified: bool, kind: Option<Kind> },
}

/// A chain at some values.
#[derive(Clone, Debug)]
pub struct ChainValues {
    /// Its name.
    pub name: String,
    /// The parameters that it may change with, by name.
    pub coordinates: Vec<String>,
    /// One of each in the unit it is reported in, in internal units.
    pub factors: Vec<f64>,
    joints: Vec<(String, Form)>,
    numbers: Vec<f64>,
    /// by number, then by coordinate
    gradient: Vec<Vec<f64>>,
}

fn form(joint: &Joint, parameters: &crate::model::Map<Parameter>) -> (Form, Vec<String>) {
    let name = joint.name().as_str();
    let fields = |fields: &[&str]| fields.iter().map(|field| format!("{name}.{field}")).collect();
    let phi = ["phi", "d", "a", "b", "alpha", "beta"];
    let reads = |reads: Reads| match reads {
        Reads::Angle => Some(Kind::Revolute),
        Reads::Length => Some(Kind::Prismatic),
        Reads::Nothing => None,
    };
    let row = ["theta", "d", "a", "alpha", "beta"];
    match joint {
        Joint::Revolute(_) => (Form::Phi(Some(Kind::Revolute)), fields(&phi)),
        Joint::Prismatic(_) => (Form::Phi(Some(Kind::Prismatic)), fields(&phi)),
        Joint::Fixed(_) => (Form::Phi(None), fields(&phi)),
        Joint::Dh(of) => (Form::Row { modified: false, kind: reads(of.reads) }, fields(&row)),
        Joint::ModifiedDh(of) => (Form::Row { modified: true, kind: reads(of.reads) }, fields(&row)),
        Joint::Rigid(rigid) => match &rigid.pose {
            None => (Form::Rigid, fields(&["x", "y", "z", "rx", "ry", "rz"])),
            Some(pose) => {
                let origin = !matches!(
                    parameters.get(pose.as_str()),
                    Some(Parameter { shape: crate::model::Shape::Rotation, .. })
                );
                let mut outputs: Vec<String> = ["x", "y"].iter().map(|axis| format!("{}.{axis}", pose.value)).collect();
                if origin {
                    outputs.insert(0, format!("{}.o", pose.value));
                }
                (Form::Pose { origin }, outputs)
            }
        },
    }
}

/// The only chain of a model, or the one with a name.
///
/// # Errors
/// Where there is none, or several and no name.
pub fn chain_name(session: &Session, name: Option<&str>) -> Result<String, Box<Diagnostic>> {
    let names: Vec<&str> = session.model.chains.keys().map(Text::as_str).collect();
    match (name, &names[..]) {
        (Some(name), _) if names.contains(&name) => Ok(name.to_owned()),
        (Some(name), _) => {
            let found = Diagnostic::error(Code::UnknownChain, format!("there is no chain `{name}`"));
            Err(Box::new(found.maybe_hint(did_you_mean(name, "chains", &names))))
        }
        (None, [one]) => Ok((*one).to_owned()),
        (None, []) => Err(Box::new(Diagnostic::error(Code::UnknownChain, "the model has no chain"))),
        (None, [first, ..]) => {
            let message = format!("the model has {} chains: {}", names.len(), names.join(", "));
            let hint = format!("say which is meant: `--chain {first}`");
            Err(Box::new(Diagnostic::error(Code::UnknownChain, message).hint(hint)))
        }
    }
}

impl ChainValues {
    /// A chain at values in reported units; what is not among them is nominal. Joints up to the one named by `after` are left out.
    ///
    /// # Errors
    /// Where a value is of no parameter, or a number of the chain is undefined there.
    pub fn of(
        session: &Session,
        chain: &str,
        after: Option<&str>,
        given: &[(String, f64)],
    ) -> Result<ChainValues, Diagnostics> {
        let mut model = session.model.clone();
        chain_name(session, Some(chain)).map_err(|found| Diagnostics::from(*found))?;
        let declared = session.model.chains.get(chain).map(Vec::as_slice).unwrap_or_default();
        let mut kept = declared.iter().collect::<Vec<_>>();
        if let Some(after) = after {
            let Some(at) = kept.iter().position(|joint| joint.name().as_str() == after) else {
                let names: Vec<&str> = kept.iter().map(|joint| joint.name().as_str()).collect();
                let found =
                    Diagnostic::error(Code::UnknownChain, format!("the chain `{chain}` has no joint `{after}`"));
                return Err(found.maybe_hint(did_you_mean(after, "joints", &names)).into());
            };
            kept.drain(..=at);
        }
        let forms: Vec<(Form, Vec<String>)> = kept.iter().map(|joint| form(joint, &model.parameters)).collect();
        let joints = kept.iter().zip(&forms).map(|(joint, (form, _))| (joint.name().value.clone(), *form)).collect();
        // the numbers are read off as the outputs of a measurement that reads nothing
        let mut asked = Measurement::default();
        for (at, expression) in forms.iter().flat_map(|(_, expressions)| expressions).enumerate() {
            asked.outputs.0.push((format!("n{at}").as_str().into(), expression.as_str().into()));
        }
        model.measurements.0.push(("the chain's numbers".into(), asked));
        let (program, _) = compile(&model, &session.program.source, &[])?;
        let number = program.measurements.len().saturating_sub(1);
        let mut table = Table::new(0, 0);
        let _ = table.push(&[], &[], None);
        let selection = Selection { start: given.to_vec(), ..Selection::default() };
        let options = Options { weights: Some(Weights::Unit), selection, unconstrained: true, ..Options::default() };
        let (problem, _) = Problem::bind(&program, vec![(number, table)], &options)?;
        let point = crate::evaluate::point(&problem, given);
        let refused = |Undefined(found): Undefined| Diagnostics::from(*found);
        let mut numbers = Vec::new();
        for block in &problem.blocks {
            block
                .values(Quantities::Outputs, &problem.layout, &point, |_, found| numbers = found.to_vec())
                .map_err(refused)?;
        }
        // held ones, too: a fit may have freed them
        let coordinates: Vec<usize> = (0..problem.layout.coordinates.len()).collect();
        let mut gradient = vec![vec![0.0; coordinates.len()]; numbers.len()];
        problem
            .sensitivities(0, &point, &coordinates, |found| {
                for (row, by) in gradient.iter_mut().zip(found.by_coordinates.chunks(found.columns.len().max(1))) {
                    for (&column, &by) in found.columns.iter().zip(by) {
                        row[column] = by;
                    }
                }
            })
            .map_err(refused)?;
        let known = |c: &usize| &problem.layout.coordinates[*c];
        let factor = |c: &usize| 1.0 / program.units.to_reported(1.0, known(c).dimension);
        Ok(ChainValues {
            name: chain.to_owned(),
            coordinates: coordinates.iter().map(|c| known(c).name.clone()).collect(),
            factors: coordinates.iter().map(factor).collect(),
            joints,
            numbers,
            gradient,
        })
    }

    /// The chain in numbers.
    pub fn serial(&self) -> Serial<f64> {
        self.build(&self.numbers)
    }

    /// The same with its partials by some of the coordinates, up to [`LANES`] of them, from `first` on.
    pub(super) fn lanes(&self, first: usize) -> Serial<Lanes> {
        let number = |(value, gradient): (&f64, &Vec<f64>)| {
            let lane = |at: usize| gradient.get(first + at).copied().unwrap_or(0.0);
            let partials = OVector::<f64, Const<LANES>>::from_fn_generic(Const::<LANES>, U1, |at, _| lane(at));
            Lanes::new(*value, Derivative::some(partials))
        };
        let numbers: Vec<Lanes> = self.numbers.iter().zip(&self.gradient).map(number).collect();
        self.build(&numbers)
    }

    fn build<D: Real>(&self, numbers: &[D]) -> Serial<D> {
        let mut serial = Serial::default();
        let mut rest = numbers.iter().copied();
        let mut next = || rest.next().unwrap_or_else(|| D::from(0.0));
        for (name, form) in &self.joints {
            match *form {
                Form::Phi(kind) => {
                    let [phi, d, a, b, alpha, beta]: [D; 6] = std::array::from_fn(|_| next());
                    if let Some(kind) = kind {
                        serial.joint(name, kind);
                    }
                    serial.push(&Motion::about_z(Screw { turn: D::from(0.0), slide: d }));
                    serial.push(&phi_motion(&PhiLink { phi, a, b, alpha, beta }));
                }
                Form::Row { modified, kind } => {
                    let [turn, slide, a, alpha, beta]: [D; 5] = std::array::from_fn(|_| next());
                    let link = Motion::screw(0, alpha, a).then(&Motion::turn(1, beta));
                    if modified {
                        serial.push(&link);
                    }
                    if let Some(kind) = kind {
                        serial.joint(name, kind);
                    }
                    serial.push(&Motion::about_z(Screw { turn, slide }));
                    if !modified {
                        serial.push(&link);
                    }
                }
                Form::Rigid => {
                    let origin: [D; 3] = std::array::from_fn(|_| next());
                    let [rx, ry, rz]: [D; 3] = std::array::from_fn(|_| next());
                    serial.push(&Motion::shift(origin));
                    serial.push(&Motion::turn(0, rx).then(&Motion::turn(1, ry)).then(&Motion::turn(2, rz)));
                }
                Form::Pose { origin } => {
                    let zero = D::from(0.0);
                    let origin = if origin { std::array::from_fn(|_| next()) } else { [zero; 3] };
                    let x: [D; 3] = std::array::from_fn(|_| next());
                    let y: [D; 3] = std::array::from_fn(|_| next());
                    let z = [x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2], x[0] * y[1] - x[1] * y[0]];
                    serial.push(&Motion { rotation: std::array::from_fn(|i| [x[i], y[i], z[i]]), origin });
                }
            }
        }
        serial
    }
}

/// The partials of a number.
pub(super) fn partials(number: &Lanes) -> [f64; LANES] {
    let all = number.eps.unwrap_generic(Const::<LANES>, U1);
    std::array::from_fn(|at| all[at])
}
