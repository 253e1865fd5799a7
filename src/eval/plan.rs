//! Which steps there are: the making of a [`Schedule`](super::schedule::Schedule).

use std::collections::BTreeMap;

use super::schedule::{Action, Addend, MOST_OPERANDS, MOST_PRODUCTS, MOST_SUMS, Place, Prepare, Step};
use crate::graph::{Graph, Node, NodeId, Operation, Scalar, Varies};

/// A node's value: a place, and whether the value there is the opposite. While planning, each result has a slot of its own.
#[derive(Clone, Copy, Debug)]
struct Signed {
    place: Place,
    negative: bool,
}

/// A part of a sum.
#[derive(Clone, Copy, Debug)]
struct Term {
    part: Part,
    negative: bool,
}

#[derive(Clone, Copy, Debug)]
enum Part {
    Node(NodeId),
    Product(NodeId, NodeId),
}

pub(super) struct Planner<'g> {
    graph: &'g Graph,
    needed: Vec<bool>,
    /// nodes that are computed as part of what uses them
    absorbed: Vec<bool>,
    values: Vec<Option<Signed>>,
    /// uniforms and their opposites
    opposites: BTreeMap<u32, u32>,
    /// nodes whose own value is an output
    wanted: Vec<bool>,
    next: u32,
    pub(super) parameters: usize,
    pub(super) inputs: usize,
    pub(super) constants: Vec<f64>,
    pub(super) prepare: Vec<Prepare>,
    pub(super) steps: Vec<Step>,
    /// sines and cosines that are computed and not used
    pub(super) unused: usize,
}

impl<'g> Planner<'g> {
    /// Plans all that the outputs need of a graph of scalar operations.
    pub(super) fn new(graph: &'g Graph, outputs: &[Scalar]) -> Self {
        let needed = graph.needed(outputs);
        let mut planner = Planner {
            graph,
            absorbed: vec![false; needed.len()],
            values: vec![None; needed.len()],
            opposites: BTreeMap::new(),
            wanted: vec![false; needed.len()],
            needed,
            next: 0,
            parameters: 0,
            inputs: 0,
            constants: Vec::new(),
            prepare: Vec::new(),
            steps: Vec::new(),
            unused: 0,
        };
        planner.uniforms();
        planner.absorb(outputs);
        for output in outputs {
            let (of, opposite) = planner.unsigned(output.0);
            planner.wanted[of as usize] = !opposite;
        }
        for (output, &of) in outputs.iter().enumerate() {
            planner.compute(of.0);
            planner.store(of.0, Place::Output(output as u32));
        }
        planner
    }

    fn ids(&self) -> Vec<NodeId> {
        (0..self.needed.len() as NodeId).filter(|&id| self.needed[id as usize]).collect()
    }

    fn varies(&self, id: NodeId) -> bool {
        self.graph.node_varies(id) == Varies::PerRow
    }

    /// Gives places to parameters, inputs, constants and all that follows from them once per iteration.
    fn uniforms(&mut self) {
        let ids = self.ids();
        let mut constants = 0;
        for &id in &ids {
            match self.graph.node(id) {
                Node::Parameter(index) => self.parameters = self.parameters.max(index as usize + 1),
                Node::Input(index) => self.inputs = self.inputs.max(index as usize + 1),
                Node::Constant(_) => constants += 1,
                _ => {}
            }
        }
        self.next = self.inputs as u32;
        let first = self.parameters + constants;
        for id in ids {
            let place = match self.graph.node(id) {
                Node::Parameter(index) => Place::Uniform(index),
                Node::Input(index) => Place::Slot(index),
                Node::Constant(bits) => {
                    self.constants.push(f64::from_bits(bits));
                    Place::Uniform((self.parameters + self.constants.len() - 1) as u32)
                }
                Node::Apply(operation, x, y) if !self.varies(id) => {
                    // what does not vary comes from what does not
                    let [Place::Uniform(x), Place::Uniform(y)] = [x, y].map(|operand| self.value(operand.0).place)
                    else {
                        continue;
                    };
                    self.prepare.push(Prepare { operation, x, y });
                    Place::Uniform((first + self.prepare.len() - 1) as u32)
                }
                _ => continue,
            };
            self.values[id as usize] = Some(Signed { place, negative: false });
        }
    }

    /// The node that this one is the opposite of, or itself, and whether it is the opposite.
    fn unsigned(&self, id: NodeId) -> (NodeId, bool) {
        match self.graph.node(id) {
            Node::Apply(Operation::Neg, x, _) if self.varies(id) => {
                let (of, negative) = self.unsigned(x.0);
                (of, !negative)
            }
            _ => (id, false),
        }
    }

    /// The operands of a node, without their signs.
    fn operands(&self, id: NodeId) -> Vec<NodeId> {
        match self.graph.node(id) {
            Node::Apply(operation, x, _) if operation.row().arity == 1 => vec![self.unsigned(x.0).0],
            Node::Apply(_, x, y) => vec![self.unsigned(x.0).0, self.unsigned(y.0).0],
            _ => Vec::new(),
        }
    }

    /// Finds what is computed as part of what uses it: a product that is only ever part of sums, and a sum that is part of
    /// one other. A sum takes in as much as a step holds; products with few uses go first.
    fn absorb(&mut self, outputs: &[Scalar]) {
        let mut sums: Vec<Vec<NodeId>> = vec![Vec::new(); self.needed.len()];
        let mut alone = vec![false; self.needed.len()];
        for output in outputs {
            let (of, _) = self.unsigned(output.0);
            alone[of as usize] = true;
        }
        let varying: Vec<NodeId> = self.ids().into_iter().filter(|&id| self.varies(id)).collect();
        for &id in &varying {
            let Node::Apply(operation, ..) = self.graph.node(id) else { continue };
            let operands = self.operands(id);
            for &operand in &operands {
                match operation {
                    Operation::Neg => {}
                    Operation::Add | Operation::Sub if operands[0] != operands[1] => {
                        sums[operand as usize].push(id);
                    }
                    _ => alone[operand as usize] = true,
                }
            }
        }
        let is = |id: &NodeId, wanted: &[Operation]| match self.graph.node(*id) {
            Node::Apply(operation, ..) => wanted.contains(&operation),
            _ => false,
        };
        let inner = varying.iter().copied().filter(|&id| !alone[id as usize] && !sums[id as usize].is_empty());
        let (mut products, rest): (Vec<NodeId>, Vec<NodeId>) = inner.partition(|id| is(id, &[Operation::Mul]));
        products.sort_by_key(|&id| sums[id as usize].len());
        // products and addends of each sum as it stands
        let mut has = vec![(0, 2); self.needed.len()];
        for product in products {
            // computed again for each sum, it must not cost more than being computed once: beside another product it does
            let users = &sums[product as usize];
            let costs = users.iter().filter(|&&sum| has[sum as usize].0 > 0).count();
            if users.len() > 1 && costs > 0 {
                continue;
            }
            self.absorbed[product as usize] = true;
            for &sum in &sums[product as usize] {
                let (products, addends) = &mut has[sum as usize];
                (*products, *addends) = (*products + 1, *addends - 1);
            }
        }
        // sums come before what uses them, so an inner one has taken in all that it will
        for &id in rest.iter().filter(|id| is(id, &[Operation::Add, Operation::Sub])) {
            let [user] = sums[id as usize][..] else { continue };
            let (inner, outer) = (has[id as usize], has[user as usize]);
            let (products, addends) = (inner.0 + outer.0, inner.1 + outer.1 - 1);
            if products <= MOST_PRODUCTS && addends <= 1 {
                self.absorbed[id as usize] = true;
                has[user as usize] = (products, addends);
            }
        }
    }

    /// The parts of a sum.
    fn terms(&self, id: NodeId, negative: bool, into: &mut Vec<Term>) {
        let Node::Apply(operation, x, y) = self.graph.node(id) else { return };
        if operation == Operation::Mul {
            return into.push(Term { part: Part::Product(x.0, y.0), negative });
        }
        for (operand, minus) in [(x.0, false), (y.0, operation == Operation::Sub)] {
            let (of, opposite) = self.unsigned(operand);
            let negative = negative != (minus != opposite);
            match self.graph.node(of) {
                Node::Apply(..) if self.absorbed[of as usize] => self.terms(of, negative, into),
                _ => into.push(Term { part: Part::Node(of), negative }),
            }
        }
    }

    /// What has to be known before a node can be computed.
    fn needs(&self, id: NodeId) -> Vec<NodeId> {
        match self.graph.node(id) {
            Node::Apply(Operation::Add | Operation::Sub, ..) => {
                let mut terms = Vec::new();
                self.terms(id, false, &mut terms);
                let parts = terms.into_iter().flat_map(|term| match term.part {
                    Part::Node(node) => vec![node],
                    Part::Product(a, b) => vec![self.unsigned(a).0, self.unsigned(b).0],
                });
                parts.collect()
            }
            _ => self.operands(id),
        }
    }

    /// Computes a node after all that it needs. The stack is our own, for graphs can be deep.
    fn compute(&mut self, id: NodeId) {
        let mut open = vec![self.unsigned(id).0];
        while let Some(&id) = open.last() {
            if self.values[id as usize].is_some() {
                open.pop();
                continue;
            }
            let mut needs = self.needs(id);
            needs.retain(|&operand| self.values[operand as usize].is_none());
            if needs.is_empty() {
                open.pop();
                self.step(id);
            } else {
                open.extend(needs.into_iter().rev());
            }
        }
    }

    /// A node's value, which is known.
    #[allow(
        clippy::unreachable,
        reason = "`compute` takes operands first; any number in place of one would be a wrong one"
    )]
    fn value(&self, id: NodeId) -> Signed {
        let (of, opposite) = if self.varies(id) { self.unsigned(id) } else { (id, false) };
        match self.values[of as usize] {
            Some(Signed { place, negative }) => Signed { place, negative: negative != opposite },
            None => unreachable!("operands are computed before what needs them"),
        }
    }

    fn push(&mut self, action: Action, operands: &[Place]) -> Place {
        let mut all = [operands[0]; MOST_OPERANDS];
        all[..operands.len()].copy_from_slice(operands);
        let result = Place::Slot(self.next);
        let mut results = [result; MOST_SUMS];
        if action == Action::SinCos {
            self.next += 1;
            results[1] = Place::Slot(self.next);
        }
        self.next += 1;
        self.steps.push(Step { action, operands: all, results });
        result
    }

    /// Puts a value to where it is wanted: by the step that computed it, where nothing has read it yet.
    fn store(&mut self, id: NodeId, output: Place) {
        let Signed { place, negative } = self.value(id);
        if let Some(last) = self.steps.last_mut()
            && last.results == [place; MOST_SUMS]
            && matches!(place, Place::Slot(_))
            && !negative
        {
            last.results = [output; MOST_SUMS];
            let (of, opposite) = self.unsigned(id);
            self.values[of as usize] = Some(Signed { place: output, negative: opposite });
            return;
        }
        let action = if negative { Action::Neg } else { Action::Copy };
        self.push(action, &[place]);
        if let Some(step) = self.steps.last_mut() {
            step.results = [output; MOST_SUMS];
        }
    }

    fn step(&mut self, id: NodeId) {
        let Node::Apply(operation, x, y) = self.graph.node(id) else { return };
        let (vx, vy) = match operation {
            Operation::Add | Operation::Sub | Operation::Mul => return self.sum(id),
            _ => (self.value(x.0), self.value(if operation.row().arity == 1 { x.0 } else { y.0 })),
        };
        let (place, negative) = match operation {
            Operation::Div => (self.push(Action::Div, &[vx.place, vy.place]), vx.negative != vy.negative),
            _ => {
                let [x, y] = [vx, vy].map(|value| self.positive(value));
                match operation {
                    Operation::Sqrt => (self.push(Action::Sqrt, &[x]), false),
                    Operation::Sin | Operation::Cos => return self.sin_cos(id, x),
                    _ => (self.push(Action::Call(operation), &[x, y]), false),
                }
            }
        };
        self.values[id as usize] = Some(Signed { place, negative });
    }

    /// A place that holds the value itself.
    fn positive(&mut self, value: Signed) -> Place {
        if value.negative { self.push(Action::Neg, &[value.place]) } else { value.place }
    }

    /// Sine and cosine of one angle in one step.
    fn sin_cos(&mut self, id: NodeId, angle: Place) {
        let both = match self.graph.node(id) {
            Node::Apply(_, x, _) => [Operation::Sin, Operation::Cos].map(|f| self.graph.find(Node::Apply(f, x, x))),
            _ => [None; 2],
        };
        self.push(Action::SinCos, &[angle]);
        let results = self.steps.last().map_or([angle; MOST_SUMS], |step| step.results);
        for (node, place) in both.into_iter().zip(results) {
            match node.filter(|&node| self.needed[node as usize]) {
                Some(node) => self.values[node as usize] = Some(Signed { place, negative: false }),
                None => self.unused += 1,
            }
        }
    }

    /// A uniform, or its opposite.
    fn uniform(&mut self, at: u32, negative: bool) -> Place {
        if !negative {
            return Place::Uniform(at);
        }
        let next = (self.parameters + self.constants.len() + self.prepare.len()) as u32;
        let opposite = *self.opposites.entry(at).or_insert(next);
        if opposite == next {
            self.prepare.push(Prepare { operation: Operation::Neg, x: at, y: at });
        }
        Place::Uniform(opposite)
    }

    /// A sum with all that it takes in, or a product alone. Uniforms take the signs of what they are part of; for the rest
    /// the result may be the opposite, so that an addend is positive, or else as many products as can be: sums alike are
    /// done together.
    fn sum(&mut self, id: NodeId) {
        let mut terms = Vec::new();
        self.terms(id, false, &mut terms);
        let (mut scaled, mut products, mut addends) = (Vec::new(), Vec::new(), Vec::new());
        for Term { part, negative } in terms {
            match part {
                Part::Node(node) => {
                    let value = self.value(node);
                    addends.push(Signed { negative: negative != value.negative, ..value });
                }
                Part::Product(a, b) => {
                    let (a, b) = (self.value(a), self.value(b));
                    let negative = negative != (a.negative != b.negative);
                    match (a.place, b.place) {
                        (Place::Uniform(of), other) | (other, Place::Uniform(of)) => scaled.push((of, other, negative)),
                        (a, b) => products.push((a, b, negative)),
                    }
                }
            }
        }
        let (place, flipped) = match addends.as_slice() {
            [x, y] if scaled.is_empty() && products.is_empty() => match (x.negative, y.negative) {
                (false, false) => (self.push(Action::Add, &[x.place, y.place]), false),
                (false, true) => (self.push(Action::Sub, &[x.place, y.place]), false),
                (true, false) => (self.push(Action::Sub, &[y.place, x.place]), false),
                (true, true) => (self.push(Action::Add, &[x.place, y.place]), true),
            },
            _ => {
                let minus = products.iter().filter(|product| product.2).count();
                let flipped = match addends.first() {
                    Some(Signed { place: Place::Slot(_) | Place::Output(_), negative }) => *negative,
                    // an output wants no sign, where that can be had
                    None if self.wanted[id as usize] && products.len() == MOST_PRODUCTS => false,
                    _ => 2 * minus > products.len(),
                };
                let negative = if flipped { products.len() - minus } else { minus };
                products.sort_by_key(|product| product.2 != flipped);
                let mut operands: Vec<Place> = scaled.iter().map(|&(_, b, _)| b).collect();
                operands.extend(products.iter().map(|&(_, b, _)| b));
                for &(of, _, minus) in &scaled {
                    operands.push(self.uniform(of, minus != flipped));
                }
                operands.extend(products.iter().map(|&(a, _, _)| a));
                let addend = match addends.first() {
                    None => Addend::None,
                    Some(&Signed { place: Place::Uniform(of), negative }) => {
                        operands.push(self.uniform(of, negative != flipped));
                        Addend::Uniform
                    }
                    Some(&Signed { place, .. }) => {
                        operands.push(place);
                        Addend::PerRow
                    }
                };
                let (positive, negative) = ((products.len() - negative) as u8, negative as u8);
                let action = Action::Sum { uniform: scaled.len() as u8, positive, negative, addend, sums: 1 };
                (self.push(action, &operands), flipped)
            }
        };
        self.values[id as usize] = Some(Signed { place, negative: flipped });
    }
}
