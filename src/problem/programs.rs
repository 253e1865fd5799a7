//! The programs of a measurement: its residuals, its outputs and its derivatives, compiled when first wanted.

use std::sync::OnceLock;

use super::layout::Layout;
use super::noise::Noise;
use super::propagated::{Whitened, known, whitened};
use crate::compile::{Measurement, Program, Slot};
use crate::eval::Compiled;
use crate::graph::{Counts, Scalar, View, differentiate};
use crate::simd::InstructionSet;

/// Compiled programs.
#[derive(Clone, Debug, Default)]
pub(super) struct Programs {
    residuals: OnceLock<Compiled>,
    outputs: OnceLock<Compiled>,
    jacobian: OnceLock<Jacobian>,
    by_inputs: OnceLock<Compiled>,
    step: OnceLock<Compiled>,
    whitened: OnceLock<Jacobian>,
    deviations: OnceLock<Compiled>,
}

/// Residuals and their derivatives by parameters, all weighted: by column and then by residual, the residuals themselves last.
#[derive(Clone, Debug)]
pub(super) struct Jacobian {
    pub(super) compiled: Compiled,
    /// Those that are the same for all rows come first, by coordinate.
    pub(super) columns: Vec<Column>,
}

/// What a column differentiates by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Column {
    /// The slot of the measurement.
    pub(super) slot: usize,
    /// Which coordinate of its parameter.
    pub(super) component: usize,
    /// Whether each row has a member of its own.
    pub(super) gathered: bool,
}

/// How the rows of a measurement see its parameters.
#[derive(Clone, Copy, Debug)]
pub(super) struct Seen<'p> {
    pub(super) program: &'p Program,
    pub(super) measurement: &'p Measurement,
}

impl<'p> Seen<'p> {
    /// The numbers of family members, which rows have of their own: each one's slot and component. They are inputs after those
    /// of the measurement.
    pub(super) fn gathered(self) -> Vec<(usize, usize)> {
        let slots = self.measurement.slots.iter().enumerate();
        let family = |(s, slot): (usize, &Slot)| {
            let parameter = &self.program.parameters[slot.parameter];
            let count = if parameter.family { parameter.shape.dimension() } else { 0 };
            (0..count).map(move |component| (s, component))
        };
        slots.flat_map(family).collect()
    }

    fn view(self, weights: &[f64]) -> View {
        let width = self.measurement.inputs.len();
        let leaf = |(s, component): &(usize, usize)| (self.measurement.slots[*s].first_leaf + component) as u32;
        let gathered = self.gathered();
        let gathered = gathered.iter().enumerate().map(|(j, g)| (leaf(g), (width + j) as u32)).collect();
        let mut zeros = Vec::new();
        for slot in &self.measurement.slots {
            let shape = self.program.parameters[slot.parameter].shape;
            zeros.extend((shape.dimension()..shape.leaves()).map(|k| (slot.first_leaf + k) as u32));
        }
        View { gathered, zeros, weights: weights.to_vec(), ..View::default() }
    }

    fn values(self, of: &[Scalar], weights: &[f64], set: InstructionSet) -> Compiled {
        let derived = differentiate(&self.measurement.graph, of, &[], &self.view(weights));
        Compiled::new(&derived.graph, &derived.values, set)
    }

    /// Derivatives by the columns, which are in the order of [`Jacobian`].
    fn jacobian(self, columns: Vec<Column>, weights: &[f64], set: InstructionSet) -> Jacobian {
        // what the residuals do not depend on has no column
        let (columns, leaves) = known(&self, columns);
        let (graph, equations) = (&self.measurement.graph, &self.measurement.equations);
        let derived = differentiate(graph, equations, &leaves, &self.view(weights));
        let (m, n) = (derived.values.len(), leaves.len());
        let by_column = (0..n).flat_map(|column| (0..m).map(move |residual| residual * n + column));
        let mut outputs: Vec<Scalar> = by_column.map(|at| derived.derivatives[at]).collect();
        outputs.extend(&derived.values);
        Jacobian { compiled: Compiled::new(&derived.graph, &outputs, set), columns }
    }

    /// All columns for which `wanted(slot, component)` holds, in the order of [`Jacobian`]; `place` orders those that all rows
    /// share.
    pub(super) fn columns(
        self,
        wanted: impl Fn(usize, usize) -> bool,
        place: impl Fn(usize, usize) -> usize,
    ) -> Vec<Column> {
        let mut columns = Vec::new();
        for (s, slot) in self.measurement.slots.iter().enumerate() {
            let parameter = &self.program.parameters[slot.parameter];
            let components = (0..parameter.shape.dimension()).filter(|&component| wanted(s, component));
            columns.extend(components.map(|component| Column { slot: s, component, gathered: parameter.family }));
        }
        columns.sort_by_key(|c| (c.gathered, if c.gathered { 0 } else { place(c.slot, c.component) }));
        columns
    }

    /// Residuals, weighted by factors.
    pub(super) fn residuals<'a>(self, programs: &'a Programs, weights: &[f64], set: InstructionSet) -> &'a Compiled {
        programs.residuals.get_or_init(|| self.values(&self.measurement.equations, weights, set))
    }

    /// Derived quantities.
    pub(super) fn outputs(self, programs: &Programs, set: InstructionSet) -> &Compiled {
        programs.outputs.get_or_init(|| self.values(&self.measurement.derived, &[], set))
    }

    /// Weighted residuals, then their derivatives by each input, by residual.
    pub(super) fn by_inputs<'a>(self, programs: &'a Programs, weights: &[f64], set: InstructionSet) -> &'a Compiled {
        programs.by_inputs.get_or_init(|| {
            let graph = &self.measurement.graph;
            let used: Vec<Option<Scalar>> =
                (0..self.measurement.inputs.len()).map(|k| graph.known_input(k as u32)).collect();
            let leaves: Vec<Scalar> = used.iter().flatten().copied().collect();
            let mut derived = differentiate(graph, &self.measurement.equations, &leaves, &self.view(weights));
            let zero = derived.graph.constant(0.0);
            let mut outputs = derived.values.clone();
            for row in derived.derivatives.chunks(leaves.len().max(1)).take(derived.values.len()) {
                let mut known = row.iter();
                outputs.extend(used.iter().map(|input| input.and_then(|_| known.next()).map_or(zero, |found| *found)));
            }
            Compiled::new(&derived.graph, &outputs, set)
        })
    }

    /// Derivatives of the derived quantities, by output: by the columns that they know, then by some inputs. They are not kept,
    /// for the columns are others from call to call.
    pub(super) fn sensitivities(
        self,
        columns: Vec<Column>,
        inputs: &[usize],
        set: InstructionSet,
    ) -> (Compiled, Vec<Column>) {
        let (columns, mut leaves) = known(&self, columns);
        let graph = &self.measurement.graph;
        let n = leaves.len();
        let of_inputs: Vec<Option<Scalar>> = inputs.iter().map(|&k| graph.known_input(k as u32)).collect();
        leaves.extend(of_inputs.iter().flatten());
        let mut derived = differentiate(graph, &self.measurement.derived, &leaves, &self.view(&[]));
        let zero = derived.graph.constant(0.0);
        let mut outputs = Vec::new();
        for output in 0..self.measurement.derived.len() {
            let row = &derived.derivatives[output * leaves.len()..(output + 1) * leaves.len()];
            outputs.extend(&row[..n]);
            let mut known = row[n..].iter();
            outputs.extend(of_inputs.iter().map(|input| input.and_then(|_| known.next()).map_or(zero, |found| *found)));
        }
        (Compiled::new(&derived.graph, &outputs, set), columns)
    }

    /// The standard deviations of some inputs, as nodes over the readings.
    pub(super) fn sigmas(self, of: &[Scalar], set: InstructionSet) -> Compiled {
        self.values(of, &[], set)
    }

    /// One Gauss–Helmert step: the corrected readings that come next, how far they move, and whitened residuals.
    pub(super) fn step<'a>(
        self,
        programs: &'a Programs,
        noise: &Noise,
        weights: &[f64],
        set: InstructionSet,
    ) -> &'a Compiled {
        programs.step.get_or_init(|| {
            let Whitened { graph, mut next, shift, residuals, .. } =
                whitened(&self, noise, weights, &self.view(weights), &[]);
            next.push(shift);
            next.extend(residuals);
            Compiled::new(&graph, &next, set)
        })
    }

    /// The standard deviations that rows have of their own and that their inputs decide, in order.
    pub(super) fn deviations<'a>(self, programs: &'a Programs, noise: &Noise, set: InstructionSet) -> &'a Compiled {
        programs.deviations.get_or_init(|| {
            let of: Vec<Scalar> = noise.own.iter().filter_map(|own| own.of).collect();
            self.values(&of, &[], set)
        })
    }

    /// Whitened residuals and derivatives by the free coordinates of all groups that rows touch, at corrected readings.
    #[expect(clippy::too_many_arguments, reason = "what a measurement is bound to")]
    pub(super) fn whitened<'a>(
        self,
        programs: &'a Programs,
        noise: &Noise,
        groups: &[Vec<usize>],
        layout: &Layout,
        place: &[Option<usize>],
        weights: &[f64],
        set: InstructionSet,
    ) -> &'a Jacobian {
        programs.whitened.get_or_init(|| {
            let (columns, leaves) = known(&self, self.free_columns(groups, layout, place));
            let Whitened { graph, residuals, derivatives: mut outputs, .. } =
                whitened(&self, noise, weights, &self.view(weights), &leaves);
            outputs.extend(residuals);
            Jacobian { compiled: Compiled::new(&graph, &outputs, set), columns }
        })
    }

    /// Weighted residuals and derivatives by the free coordinates of all groups that rows touch.
    pub(super) fn free<'a>(
        self,
        programs: &'a Programs,
        groups: &[Vec<usize>],
        layout: &Layout,
        place: &[Option<usize>],
        weights: &[f64],
        set: InstructionSet,
    ) -> &'a Jacobian {
        programs.jacobian.get_or_init(|| self.jacobian(self.free_columns(groups, layout, place), weights, set))
    }

    fn free_columns(self, groups: &[Vec<usize>], layout: &Layout, place: &[Option<usize>]) -> Vec<Column> {
        let at = |group: usize, component: usize| place[layout.groups[group].first + component];
        let wanted = |s: usize, component: usize| groups.iter().any(|row| at(row[s], component).is_some());
        let order = |s: usize, component: usize| groups.first().and_then(|row| at(row[s], component)).unwrap_or(0);
        self.columns(wanted, order)
    }
}

/// Operations of a measurement's residuals and their derivatives by all that is declared free.
pub fn operations(program: &Program, measurement: &Measurement) -> Counts {
    let seen = Seen { program, measurement };
    let free = |s: usize, component: usize| {
        let parameter = &program.parameters[measurement.slots[s].parameter];
        let mut settings = parameter.members.iter().map(|(_, setting)| setting);
        parameter.setting.is_free(component) || settings.any(|setting| setting.is_free(component))
    };
    let columns = seen.columns(free, |s, component| measurement.slots[s].first_leaf + component);
    seen.jacobian(columns, &[], InstructionSet::detect()).compiled.counts()
}
