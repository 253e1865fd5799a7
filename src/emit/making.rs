//! From a measurement to its functions.

use super::line::Line;
use super::point::Point;
use super::routine::{Array, Function, Kind, Number, Routine};
use super::signed::{Signed, Value};
use crate::compile::{Measurement, Residual, Role, Slot};
use crate::graph::{Derived, Graph, Node, NodeId, Scalar, Varies, View, differentiate};
use crate::problem::Problem;

/// A measurement, while its functions are made.
struct Making<'p> {
    problem: &'p Problem<'p>,
    measurement: &'p Measurement,
    /// leaves of the measurement's graph, and the numbers of q that they are
    of_parameters: Vec<(u32, usize)>,
    graph: Graph,
}

/// Which numbers of a parameter, or of any member of a family, are free.
fn free(problem: &Problem, parameter: usize) -> Vec<bool> {
    let layout = &problem.layout;
    let mut free = vec![false; problem.program.parameters[parameter].shape.dimension()];
    for group in layout.groups.iter().filter(|group| group.parameter == parameter) {
        for (k, free) in free.iter_mut().enumerate() {
            *free |= layout.coordinates[group.first + k].role == Role::Free;
        }
    }
    free
}

/// Which numbers of a parameter change when it is estimated: a rotation turns as a whole.
fn moving(problem: &Problem, parameter: usize) -> Vec<bool> {
    let mut moving = free(problem, parameter);
    if let Some(first) = problem.program.parameters[parameter].shape.rotation()
        && moving[first..].contains(&true)
    {
        moving[first..].fill(true);
    }
    moving
}

impl Routine {
    /// The functions of a measurement of a problem, at whose start the held parameters stand.
    pub(super) fn new<'p>(problem: &'p Problem<'p>, measurement: &'p Measurement) -> Routine {
        let program = problem.program;
        let units = &program.units;
        let mut making = Making { problem, measurement, of_parameters: Vec::new(), graph: Graph::new() };

        let (mut parameters, mut columns, mut held, mut constants) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        for group in problem.layout.groups.iter().filter(|group| !program.parameters[group.parameter].family) {
            let (free, moving) = (free(problem, group.parameter), moving(problem, group.parameter));
            let slot = measurement.slots.iter().find(|slot| slot.parameter == group.parameter);
            for k in 0..free.len() {
                let coordinate = &problem.layout.coordinates[group.first + k];
                let number = Number::new(coordinate.name.clone(), coordinate.dimension, units);
                let (leaf, value) = (slot.map(|slot| (slot.first_leaf + k) as u32), problem.start[group.first + k]);
                if moving[k] {
                    making.of_parameters.extend(leaf.map(|leaf| (leaf, parameters.len())));
                    columns.extend(free[k].then_some(parameters.len()));
                    parameters.push(number);
                } else if let Some(leaf) = leaf {
                    constants.push((leaf, value));
                    held.push((number.name, units.to_reported(value, number.dimension), number.unit));
                }
            }
        }
        let inputs: Vec<Number> = measurement
            .inputs
            .iter()
            .map(|input| Number::new(input.name.clone(), input.unit.dimension, units))
            .collect();
        let (mut members, mut member_columns, mut gathered) = (Vec::new(), Vec::new(), Vec::new());
        for slot in measurement.slots.iter().filter(|slot| program.parameters[slot.parameter].family) {
            let parameter = &program.parameters[slot.parameter];
            let keys: Vec<&str> = slot.keys.iter().map(|&key| measurement.keys[key].as_str()).collect();
            let free = free(problem, slot.parameter);
            for (k, suffix) in parameter.shape.suffixes().iter().enumerate() {
                gathered.push(((slot.first_leaf + k) as u32, (inputs.len() + members.len()) as u32));
                member_columns.extend(free[k].then_some(members.len()));
                let name = format!("{}[{}]{suffix}", parameter.name, keys.join("/"));
                members.push(Number::new(name, parameter.dimensions[k], units));
            }
        }
        let of_residual = |r: &Residual| Number::new(r.name.clone(), r.dimension, units);
        let residuals: Vec<Number> = measurement.residuals.iter().map(of_residual).collect();

        let mut routine = Routine {
            measurement: measurement.name.clone(),
            parameters,
            columns,
            inputs,
            members,
            member_columns,
            residuals,
            held,
            formulas: formulas(problem, measurement),
            graph: Graph::new(),
            prepared: Vec::new(),
            prepare: Line::default(),
            functions: Vec::new(),
            point: None,
        };
        let view = View { gathered, zeros: zeros(problem, measurement), constants, ..View::default() };
        let mut kinds = vec![Kind::Residuals];
        if routine.arrays(Kind::Jacobian).count() > 1 && !routine.inputs.is_empty() {
            kinds.push(Kind::Jacobian);
        }
        if routine.arrays(Kind::Derivatives).count() > 1 {
            kinds.push(Kind::Derivatives);
        }
        let outputs: Vec<Vec<Scalar>> = kinds.iter().map(|&kind| making.outputs(&routine, kind, &view)).collect();
        routine.graph = making.graph;
        let graph = &routine.graph;
        let uniform =
            |id: NodeId| graph.node_varies(id) < Varies::PerRow && !matches!(graph.node(id), Node::Constant(_));
        let mut prepared = Vec::new();
        for (&kind, outputs) in kinds.iter().zip(&outputs) {
            let zero = |at: usize| graph.value(outputs[at]) == Some(0.0);
            let order: Vec<(usize, Scalar)> = order(&routine, outputs.len())
                .into_iter()
                .filter(|&at| at < routine.residuals.len() || !zero(at))
                .map(|at| (at, outputs[at]))
                .collect();
            let line = Line::new(graph, &order, &uniform);
            line.reads(|id| {
                if uniform(id) {
                    prepared.push(id);
                }
            });
            let zeros = (routine.residuals.len()..outputs.len()).filter(|&at| zero(at)).collect();
            let function = Function { kind, line, zeros };
            let rows = (kind == Kind::Jacobian).then(|| Function { kind: Kind::JacobianRows, ..function.clone() });
            routine.functions.push(function);
            routine.functions.extend(rows);
        }
        prepared.sort_unstable();
        prepared.dedup();
        let outputs: Vec<(usize, Scalar)> = prepared.iter().map(|&id| Scalar(id)).enumerate().collect();
        routine.prepare = Line::new(graph, &outputs, &|_| false);
        routine.prepared = prepared;
        routine.point = Point::find(problem, measurement, &routine);
        routine
    }
}

impl<'p> Making<'p> {
    /// The outputs of a function, in the order of the arrays, as nodes of the common graph.
    fn outputs(&mut self, routine: &Routine, kind: Kind, view: &View) -> Vec<Scalar> {
        let graph = &self.measurement.graph;
        let program = self.problem.program;
        let units = &program.units;
        // for each column, the leaf where there is one, and what one reported unit of it is inside
        let mut columns: Vec<(Option<Scalar>, f64)> = Vec::new();
        let tangent = |slot: &Slot, k: usize| {
            let shape = program.parameters[slot.parameter].shape;
            graph.known_parameter((slot.first_leaf + shape.tangent_leaf(k)) as u32)
        };
        let inside = |number: &Number| units.to_internal(1.0, units.unit(number.dimension));
        for array in routine.arrays(kind) {
            match array {
                Array::R => {}
                Array::ByParameters => {
                    for &column in &routine.columns {
                        let found = self.of_parameters.iter().find(|(_, of)| *of == column).and_then(|&(leaf, _)| {
                            let slot = self.slot(leaf);
                            tangent(slot, leaf as usize - slot.first_leaf)
                        });
                        columns.push((found, inside(&routine.parameters[column])));
                    }
                }
                Array::ByMembers => {
                    for &column in &routine.member_columns {
                        let leaf = view.gathered[column].0;
                        let slot = self.slot(leaf);
                        columns
                            .push((tangent(slot, leaf as usize - slot.first_leaf), inside(&routine.members[column])));
                    }
                }
                Array::ByInputs => {
                    let of = |(k, input): (usize, &Number)| (graph.known_input(k as u32), inside(input));
                    columns.extend(routine.inputs.iter().enumerate().map(of));
                }
            }
        }
        let leaves: Vec<Scalar> = columns.iter().filter_map(|column| column.0).collect();
        let derived = differentiate(graph, &self.measurement.equations, &leaves, view);
        let moved = self.moved(&derived, routine);
        let (values, derivatives) = moved.split_at(derived.values.len());
        let mut rows: Vec<Vec<Scalar>> = Vec::new();
        for (i, residual) in routine.residuals.iter().enumerate() {
            let outside = units.to_reported(1.0, residual.dimension);
            let mut known = derivatives[i * leaves.len()..(i + 1) * leaves.len()].iter();
            let factor = self.graph.constant(outside);
            let mut row = vec![self.graph.mul(factor, values[i])];
            for &(leaf, inside) in &columns {
                let zero = self.graph.constant(0.0);
                let derivative = leaf.and_then(|_| known.next()).map_or(zero, |found| *found);
                let factor = self.graph.constant(outside * inside);
                row.push(self.graph.mul(factor, derivative));
            }
            rows.push(row);
        }
        // array by array, and there by residual
        let mut outputs = Vec::new();
        let mut first = 0;
        for array in routine.arrays(kind) {
            let width = routine.width(array);
            outputs.extend(rows.iter().flat_map(|row| row[first..first + width].to_vec()));
            first += width;
        }
        outputs
    }

    fn slot(&self, leaf: u32) -> &'p Slot {
        let after = |slot: &&Slot| slot.first_leaf <= leaf as usize;
        self.measurement
            .slots
            .iter()
            .filter(after)
            .max_by_key(|slot| slot.first_leaf)
            .unwrap_or(&self.measurement.slots[0])
    }

    /// Values and derivatives as nodes of the common graph, over arguments in reported units; powers as products and
    /// exponentials.
    fn moved(&mut self, derived: &Derived, routine: &Routine) -> Vec<Scalar> {
        let from = &derived.graph;
        let all: Vec<Scalar> = derived.values.iter().chain(&derived.derivatives).copied().collect();
        let needed = from.needed(&all);
        let units = &self.problem.program.units;
        let mut signed = Signed { graph: &mut self.graph };
        let mut to: Vec<Option<Value>> = vec![None; from.len()];
        let known = |to: &[Option<Value>], s: Scalar| to[s.0 as usize].unwrap_or(Value { negative: false, of: s });
        for id in (0..from.len() as NodeId).filter(|&id| needed[id as usize]) {
            let given = |signed: &mut Signed, given: Scalar, number: &Number| {
                let factor = signed.graph.constant(units.to_internal(1.0, units.unit(number.dimension)));
                let product = signed.graph.mul(factor, given);
                signed.value(product)
            };
            let found = match from.node(id) {
                Node::Constant(bits) => {
                    let constant = signed.graph.constant(f64::from_bits(bits));
                    signed.value(constant)
                }
                Node::Parameter(leaf) => {
                    let at = self.of_parameters.iter().find(|(of, _)| *of == leaf).map_or(0, |(_, at)| *at);
                    let parameter = signed.graph.parameter(at as u32);
                    given(&mut signed, parameter, &routine.parameters[at])
                }
                Node::Input(index) => {
                    let at = index as usize;
                    let number = routine.inputs.get(at).unwrap_or_else(|| &routine.members[at - routine.inputs.len()]);
                    let input = signed.graph.input(index);
                    given(&mut signed, input, number)
                }
                Node::Apply(operation, x, y) => signed.apply(operation, known(&to, x), known(&to, y)),
                // a graph of scalars has no other nodes
                _ => continue,
            };
            to[id as usize] = Some(found);
        }
        all.iter().map(|&s| signed.plain(known(&to, s))).collect()
    }
}

/// In which order outputs are computed: residuals first, then column by column.
fn order(routine: &Routine, outputs: usize) -> Vec<usize> {
    let m = routine.residuals.len();
    let mut order: Vec<usize> = (0..outputs).collect();
    order.sort_by_key(|&at| routine.place(at).map(|(array, residual, column)| (array as usize, column, residual)));
    debug_assert!(order.iter().take(m).eq((0..m).collect::<Vec<_>>().iter()));
    order
}

/// Leaves that are zero: rotations are differentiated by them.
fn zeros(problem: &Problem, measurement: &Measurement) -> Vec<u32> {
    let of = |slot: &Slot| {
        let shape = problem.program.parameters[slot.parameter].shape;
        let first = slot.first_leaf;
        (shape.dimension()..shape.leaves()).map(move |k| (first + k) as u32)
    };
    measurement.slots.iter().flat_map(of).collect()
}

/// What the model says that must vanish: a vector once.
fn formulas(problem: &Problem, measurement: &Measurement) -> Vec<(String, String)> {
    let mut all: Vec<(String, String)> = Vec::new();
    let mut last = None;
    for residual in &measurement.residuals {
        if last == Some(residual.span) {
            continue;
        }
        let again = measurement.residuals.iter().filter(|other| other.span == residual.span).count() > 1;
        let name = if again {
            residual.name.rsplit_once('.').map_or(residual.name.as_str(), |(name, _)| name)
        } else {
            &residual.name
        };
        all.push((name.to_owned(), problem.program.source.slice(residual.span).to_owned()));
        last = Some(residual.span);
    }
    all
}
