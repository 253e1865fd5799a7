//! Scenarios: where the inputs of simulated rows come from.

use std::sync::Arc;

use super::declarations::Declarations;
use super::measurement;
use super::names::coordinates;
use super::program::{Distribution, Input, KeyDistribution, Measurement, Scenario, Sigma, Simulation, Step};
use super::quantity::Quantities;
use super::scope::{Binding, Scope};
use super::snippet::Snippet;
use super::value::Value;
use crate::diag::{Code, Diagnostics, did_you_mean, nearest};
use crate::graph::{Scalar, Tape};
use crate::model::{self, Draw, Quantity, Text};
use crate::unit::{Dimension, Unit};

/// Rows of a simulated measurement that does not say how many.
const ROWS: usize = 100;

/// Compiles a scenario.
pub(crate) fn compile(
    name: &Text,
    declared: &model::Scenario,
    model: &model::Model,
    measurements: &[Measurement],
    declarations: &Declarations,
    quantities: &Quantities,
    diagnostics: &mut Diagnostics,
) -> Scenario {
    let source = &declarations.source;
    let mut truth = Vec::new();
    for (name, draw) in declared.truth.iter() {
        let found = coordinates(&declarations.parameters, &name.value);
        // the numbers of a joint are of several dimensions
        let Some(first) = found.first().filter(|_| !name.value.ends_with(".*")) else {
            let all: Vec<&str> = declarations.parameters.iter().map(|p| p.name.as_str()).collect();
            let hint = nearest(&name.value, all).map(|near| format!("did you mean `{near}`?"));
            let at = Snippet::new(name, source);
            diagnostics.push(
                at.whole(Code::UnknownParameter, format!("there is no parameter `{}`", name.value)).maybe_hint(hint),
            );
            continue;
        };
        let dimension = declarations.numbered(first.parameter).dimensions.get(first.component);
        if let Some(&dimension) = dimension
            && let Some(distribution) =
                distribution(draw, Some((dimension, None)), quantities, diagnostics).map(|(d, _)| d)
        {
            truth.push((name.value.clone(), distribution));
        }
    }
    let mut simulations = Vec::new();
    for (name, experiment) in declared.measurements.iter() {
        let at = Snippet::new(name, source);
        let Some((index, measurement)) = measurements.iter().enumerate().find(|(_, m)| m.name == name.value) else {
            let all: Vec<&str> = measurements.iter().map(|m| m.name.as_str()).collect();
            let found = at.whole(Code::UnknownMeasurement, format!("there is no measurement `{}`", name.value));
            diagnostics.push(found.maybe_hint(did_you_mean(&name.value, "measurements", &all)));
            continue;
        };
        let Some(declared) = model.measurements.get(&name.value) else { continue };
        let builder = Builder { experiment, declared, inputs: &measurement.inputs, at, declarations, quantities };
        simulations.push(builder.build(index, diagnostics));
    }
    Scenario { name: name.value.clone(), seed: declared.seed.unwrap_or(0), truth, measurements: simulations }
}

/// A distribution and the dimension of what it gives.
fn distribution(
    draw: &Draw,
    wanted: Option<(Dimension, Option<Unit>)>,
    quantities: &Quantities,
    diagnostics: &mut Diagnostics,
) -> Option<(Distribution, Dimension)> {
    let mut dimension = None;
    let mut number = |quantity: &Quantity| match wanted {
        Some((wanted, bare)) => quantities.constant(quantity, wanted, bare, diagnostics),
        None => {
            let (value, found) = quantities.any(quantity, diagnostics)?;
            let first = *dimension.get_or_insert(found);
            if first != found && value != 0.0 {
                let message = format!("{} is wanted here, and this is {}", first.noun(), found.noun());
                diagnostics.push(
                    crate::diag::Diagnostic::error(Code::WrongUnit, message).at(&quantities.source, quantity.span()),
                );
                return None;
            }
            Some(value)
        }
    };
    let drawn = match draw {
        Draw::Constant(value) => Distribution::Constant(number(value)?),
        Draw::Uniform(low, high) => Distribution::Uniform(number(low)?, number(high)?),
        Draw::Normal(mean, sigma) => {
            // the sigma of a zero mean decides the dimension
            let sigma = number(sigma)?;
            Distribution::Normal(number(mean)?, sigma)
        }
        Draw::Around(sigma) => Distribution::Around(number(sigma)?),
        Draw::Cycle(all) => Distribution::Cycle(all.iter().map(&mut number).collect::<Option<_>>()?),
        Draw::Choice(all) => Distribution::Choice(all.iter().map(&mut number).collect::<Option<_>>()?),
        Draw::Each(rows, draw) => {
            let (drawn, dimension) = distribution(draw, wanted, quantities, diagnostics)?;
            let rows = usize::try_from(*rows).unwrap_or(usize::MAX);
            return Some((Distribution::Each(rows, Box::new(drawn)), dimension));
        }
    };
    let dimension = wanted.map(|(wanted, _)| wanted).or(dimension).unwrap_or(Dimension::NUMBER);
    let quantity = match draw {
        Draw::Uniform(low, _) => low,
        Draw::Normal(_, sigma) | Draw::Around(sigma) => sigma,
        _ => return Some((drawn, dimension)),
    };
    let wrong = match drawn {
        Distribution::Uniform(low, high) if low > high => "the lower end is above the upper one",
        Distribution::Normal(_, sigma) | Distribution::Around(sigma) if sigma < 0.0 => {
            "a standard deviation is not negative"
        }
        _ => return Some((drawn, dimension)),
    };
    diagnostics.push(crate::diag::Diagnostic::error(Code::BadBounds, wrong).at(&quantities.source, quantity.span()));
    None
}

/// How a name is drawn; none where only numbers are.
fn name_distribution(draw: &Draw) -> Option<KeyDistribution> {
    let name = |quantity: &Quantity| match quantity {
        Quantity::Text(text) => text.value.clone(),
        Quantity::Number(number) => number.value.to_string(),
    };
    let names = |all: &[Quantity]| all.iter().map(name).collect::<Vec<_>>();
    Some(match draw {
        Draw::Cycle(all) => KeyDistribution::Cycle(names(all)),
        Draw::Choice(all) => KeyDistribution::Choice(names(all)),
        Draw::Constant(one) => KeyDistribution::Cycle(names(std::slice::from_ref(one))),
        Draw::Each(rows, draw) => {
            let rows = usize::try_from(*rows).unwrap_or(usize::MAX);
            KeyDistribution::Each(rows, Box::new(name_distribution(draw)?))
        }
        Draw::Uniform(..) | Draw::Normal(..) | Draw::Around(..) => return None,
    })
}

struct Builder<'a> {
    experiment: &'a model::Experiment,
    declared: &'a model::Measurement,
    inputs: &'a [Input],
    at: Snippet,
    declarations: &'a Declarations,
    quantities: &'a Quantities,
}

/// A step and what it needs.
struct Planned {
    step: Step,
    gives: Vec<usize>,
    needs: Vec<bool>,
}

impl Builder<'_> {
    fn build(&self, measurement: usize, diagnostics: &mut Diagnostics) -> Simulation {
        let mut scope = Scope::new(self.declarations);
        let mut auxiliary = Vec::new();
        let (keys, draws) = self.draws(&mut scope, &mut auxiliary, diagnostics);
        measurement::bind(&mut scope, self.declared, self.inputs);
        measurement::definitions(&mut scope, &self.experiment.define, &self.declarations.source);

        let mut planned = Vec::new();
        // inputs whose step has a mistake, which is reported: they are not said to be without a value as well
        let mut broken = Vec::new();
        let number = |name: &Text| self.input(&name.value).map(|(variable, _)| variable);
        for (name, quantity) in self.experiment.set.iter() {
            match self.set(&mut scope, name, quantity, diagnostics) {
                Some(step) => planned.push(step),
                None => broken.extend(number(name)),
            }
        }
        for solve in &self.experiment.solve {
            match self.solve(&mut scope, solve, diagnostics) {
                Some(step) => planned.push(step),
                None => broken.extend(solve.unknowns.keys().filter_map(number)),
            }
        }
        let variables = self.inputs.len() + auxiliary.len();
        let known: Vec<usize> = draws.iter().map(|(variable, _)| *variable).chain(broken).collect();
        let steps = self.order(planned, known, variables, diagnostics);
        let noise = self.noise(diagnostics);
        // the measurement's own mistakes are reported where it is compiled
        let own = scope.diagnostics;
        diagnostics.extend(own);
        let rows = self.experiment.rows.map_or(ROWS, |rows| usize::try_from(rows).unwrap_or(usize::MAX));
        Simulation {
            measurement,
            rows,
            keys,
            draws,
            variables,
            slots: scope.slots,
            leaves: scope.leaves,
            steps,
            noise,
            span: self.at.place(),
        }
    }

    /// An input and its number.
    fn input(&self, name: &str) -> Option<(usize, &Input)> {
        self.inputs.iter().enumerate().find(|(_, input)| input.name == name)
    }

    /// Names and numbers drawn; a drawn name that is neither an input nor a key is an auxiliary variable.
    #[allow(clippy::type_complexity, reason = "a pair of two lists, used once")]
    fn draws(
        &self,
        scope: &mut Scope,
        auxiliary: &mut Vec<String>,
        diagnostics: &mut Diagnostics,
    ) -> (Vec<(usize, KeyDistribution)>, Vec<(usize, Distribution)>) {
        let (mut keys, mut draws) = (Vec::new(), Vec::new());
        for (name, draw) in self.experiment.draw.iter() {
            if let Some(key) = self.declared.keys.iter().position(|key| key.value == name.value) {
                match name_distribution(draw) {
                    Some(drawn) => keys.push((key, drawn)),
                    None => {
                        let at = Snippet::new(name, &self.declarations.source);
                        diagnostics.push(at.whole(Code::WrongKind, "a name is drawn by `Cycle([…])` or `Choice([…])`"));
                    }
                }
                continue;
            }
            if matches!(draw, Draw::Around(_)) {
                let at = Snippet::new(name, &self.declarations.source);
                let message = "`Around` is of a truth: what is drawn for a row has no nominal value";
                diagnostics.push(at.whole(Code::WrongKind, message).hint("write `Normal(mean, sigma)`"));
            }
            let input = self.input(&name.value);
            if input.is_none() && !self.is_new(name, diagnostics) {
                if self.declared.define.get(&name.value).is_none() {
                    scope.bind(&name.value, Binding::Broken);
                }
                continue;
            }
            let wanted = input.map(|(_, input)| (input.unit.dimension, Some(input.unit)));
            let Some((distribution, dimension)) = distribution(draw, wanted, self.quantities, diagnostics) else {
                // reported: nothing that follows from it is
                match input {
                    Some((variable, _)) => draws.push((variable, Distribution::Constant(0.0))),
                    None => scope.bind(&name.value, Binding::Broken),
                }
                continue;
            };
            let variable = input.map(|(variable, _)| variable).unwrap_or_else(|| {
                auxiliary.push(name.value.clone());
                let variable = self.inputs.len() + auxiliary.len() - 1;
                let node = scope.graph.input(variable as u32);
                scope.bind(&name.value, Binding::Value(Value::Scalar(node, dimension)));
                variable
            });
            draws.push((variable, distribution));
        }
        (keys, draws)
    }

    /// Whether an auxiliary name is nobody's else. Another of the same name would be hidden in what is made up, and only there.
    fn is_new(&self, name: &Text, diagnostics: &mut Diagnostics) -> bool {
        let at = Snippet::new(name, &self.declarations.source);
        let mut own = Diagnostics::new();
        if !measurement::refuse_taken_by_model(self.declarations, name, &at, &mut own)
            && self.declared.define.get(&name.value).is_some()
        {
            let message = format!("`{}` is a definition of this measurement", name.value);
            own.push(at.whole(Code::NameTaken, message).hint("give what is drawn a name of its own"));
        }
        let new = own.is_empty();
        diagnostics.extend(own);
        new
    }

    fn unknown_input(&self, name: &Text, diagnostics: &mut Diagnostics) {
        let all: Vec<&str> = self.inputs.iter().map(|input| input.name.as_str()).collect();
        let at = Snippet::new(name, &self.declarations.source);
        let found = at.whole(Code::UnknownName, format!("`{}` is not an input of this measurement", name.value));
        diagnostics.push(found.maybe_hint(did_you_mean(&name.value, "inputs", &all)));
    }

    fn set(
        &self,
        scope: &mut Scope,
        name: &Text,
        quantity: &Quantity,
        diagnostics: &mut Diagnostics,
    ) -> Option<Planned> {
        let Some((variable, input)) = self.input(&name.value) else {
            self.unknown_input(name, diagnostics);
            return None;
        };
        let node = self.scalar(scope, name, quantity, input.unit, diagnostics)?;
        let tape = Tape::lower(&scope.graph, &[node]);
        let needs = tape.dependencies(0).1;
        Some(Planned { step: Step::Set { variable, tape }, gives: vec![variable], needs })
    }

    /// What an input is given or starts from: a number in its unit, or an expression.
    fn scalar(
        &self,
        scope: &mut Scope,
        name: &Text,
        quantity: &Quantity,
        wanted: Unit,
        diagnostics: &mut Diagnostics,
    ) -> Option<Scalar> {
        let text = match quantity {
            Quantity::Number(_) => {
                let value = self.quantities.constant(quantity, wanted.dimension, Some(wanted), diagnostics)?;
                return Some(scope.graph.constant(value));
            }
            Quantity::Text(text) => text,
        };
        let snippet = Snippet::new(text, &self.declarations.source);
        match scope.value(&snippet)? {
            Value::Scalar(s, d) if d.compatible(wanted.dimension) || scope.graph.value(s) == Some(0.0) => Some(s),
            Value::Scalar(_, d) => {
                let message = format!("`{}` is {}, and this is {}", name.value, wanted.dimension.noun(), d.noun());
                diagnostics.push(snippet.whole(Code::WrongDimension, message));
                None
            }
            other => {
                let message = format!("an input is a scalar, and this is {}", other.shape());
                diagnostics.push(snippet.whole(Code::WrongShape, message));
                None
            }
        }
    }

    fn solve(&self, scope: &mut Scope, solve: &model::Solve, diagnostics: &mut Diagnostics) -> Option<Planned> {
        let (mut unknowns, mut starts, mut angles) = (Vec::new(), Vec::new(), Vec::new());
        for (name, quantity) in solve.unknowns.iter() {
            let Some((variable, input)) = self.input(&name.value) else {
                self.unknown_input(name, diagnostics);
                return None;
            };
            let unit = input.unit;
            starts.push(self.scalar(scope, name, quantity, unit, diagnostics)?);
            angles.push(unit.dimension == Dimension::ANGLE);
            unknowns.push(variable);
        }
        let mut nodes = Vec::new();
        for text in &solve.zero.0 {
            let parts = measurement::scalars(scope, &Snippet::new(text, &self.declarations.source))?.1;
            nodes.extend(parts.into_iter().map(|(_, node, _)| node));
        }
        let tape = Tape::lower(&scope.graph, &nodes);
        let mut needs = vec![false; tape.inputs()];
        for output in 0..tape.outputs() {
            for (need, used) in needs.iter_mut().zip(tape.dependencies(output).1) {
                *need |= used;
            }
        }
        for &unknown in &unknowns {
            if let Some(need) = needs.get_mut(unknown) {
                *need = false;
            }
        }
        // a start that the row decides
        let known: Option<Vec<f64>> = starts.iter().map(|&node| scope.graph.value(node)).collect();
        let from = known.is_none().then(|| Tape::lower(&scope.graph, &starts));
        for output in 0..from.as_ref().map_or(0, Tape::outputs) {
            let used = from.as_ref().map_or(Vec::new(), |from| from.dependencies(output).1);
            needs.resize(needs.len().max(used.len()), false);
            needs.iter_mut().zip(used).for_each(|(need, used)| *need |= used);
        }
        let start = known.unwrap_or_else(|| vec![0.0; unknowns.len()]);
        let gives = unknowns.clone();
        Some(Planned { step: Step::Solve { unknowns, start, from, angles, tape }, gives, needs })
    }

    /// Puts the steps into an order in which each has what it needs.
    fn order(
        &self,
        mut planned: Vec<Planned>,
        known: Vec<usize>,
        variables: usize,
        diagnostics: &mut Diagnostics,
    ) -> Vec<Step> {
        let mut has: Vec<bool> = (0..variables).map(|variable| known.contains(&variable)).collect();
        let given: Vec<usize> = planned.iter().flat_map(|p| p.gives.clone()).collect();
        for ((i, input), has) in self.inputs.iter().enumerate().zip(&mut has) {
            if !*has && !given.contains(&i) {
                *has = true;
                if input.default.is_some() {
                    continue;
                }
                let message = format!("the input `{}` is neither drawn, set nor solved for", input.name);
                let hint = "add it to `draw`, `set` or `solve`, or give the input a `default`";
                diagnostics.push(self.at.whole(Code::InputWithoutValue, message).hint(hint));
            }
        }
        let mut steps = Vec::new();
        while !planned.is_empty() {
            let ready = planned.iter().position(|p| p.needs.iter().zip(&has).all(|(need, has)| !need || *has));
            let Some(ready) = ready else {
                let waiting = planned.iter().flat_map(|p| &p.gives).filter_map(|&i| self.inputs.get(i));
                let names: Vec<String> = waiting.map(|input| format!("`{}`", input.name)).collect();
                let message = format!("the inputs {} wait for each other", names.join(", "));
                diagnostics.push(self.at.whole(Code::Circular, message).hint("solve for them in one entry of `solve`"));
                break;
            };
            let next = planned.remove(ready);
            for (_, has) in has.iter_mut().enumerate().filter(|(variable, _)| next.gives.contains(variable)) {
                *has = true;
            }
            steps.push(next.step);
        }
        steps
    }

    fn noise(&self, diagnostics: &mut Diagnostics) -> Vec<(f64, Option<Sigma>)> {
        let mut noise: Vec<(f64, Option<Sigma>)> = self.inputs.iter().map(|input| (0.0, input.sigma)).collect();
        for (name, declared) in self.experiment.noise.iter() {
            let Some((i, input)) = self.input(&name.value) else {
                self.unknown_input(name, diagnostics);
                continue;
            };
            let unit = input.unit;
            let mut number = |quantity: &Option<Quantity>| {
                quantity.as_ref().and_then(|q| self.quantities.constant(q, unit.dimension, Some(unit), diagnostics))
            };
            let (mean, sigma) = (number(&declared.mean).unwrap_or(0.0), number(&declared.sigma).unwrap_or(0.0));
            if sigma < 0.0 {
                let at = Snippet::new(name, &Arc::clone(&self.declarations.source));
                diagnostics.push(at.whole(Code::NotPositive, "a standard deviation is not negative"));
            }
            if let Some(of) = noise.get_mut(i) {
                *of = (mean, Some(Sigma::Constant(sigma)));
            }
        }
        noise
    }
}
