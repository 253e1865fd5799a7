//! From a graph of scalar operations to a straight line of statements, each a number with a name.
//!
//! Outputs are computed one after the other, each after what it needs and nothing before it is needed, so that few numbers are
//! alive at a time. Products go into the sums that they are part of, where compilers fuse them; negations become signs.

use std::collections::HashMap;

use crate::graph::{Graph, Node, NodeId, Operation, Scalar};

/// Products that a sum has at most where sums are joined, and other parts.
const MOST_PRODUCTS: usize = 3;
const MOST_ADDENDS: usize = 1;

/// What an operand is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Atom {
    /// a number, not negative
    Constant(f64),
    /// a number that an argument holds
    Given(NodeId),
    /// the result of a statement before
    Result(NodeId),
}

/// An atom, or its opposite.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Operand {
    pub(super) negative: bool,
    pub(super) atom: Atom,
}

/// A part of a sum: a number, or the product of two. The sign of a product is in its first factor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Term {
    Number(Operand),
    Product(Operand, Operand),
}

impl Term {
    /// The term, or its opposite.
    fn signed(self, opposite: bool) -> Term {
        let signed = |operand: Operand| Operand { negative: operand.negative != opposite, ..operand };
        match self {
            Term::Number(number) => Term::Number(signed(number)),
            Term::Product(a, b) => Term::Product(signed(a), b),
        }
    }
}

/// What a statement computes.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Expression {
    /// One term or several.
    Sum(Vec<Term>),
    /// A row of the table of operations, neither a sum, a difference, a product nor an opposite; a unary one has its operand
    /// twice.
    Call(Operation, Operand, Operand),
}

/// One line.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Statement {
    /// A result.
    Let(NodeId, Expression),
    /// The sine and the cosine of one angle, one of which may not be wanted.
    SinCos { sin: Option<NodeId>, cos: Option<NodeId>, of: Operand },
    /// An output, by its number.
    Store(usize, Expression),
}

/// A straight line of statements.
#[derive(Clone, Debug, Default)]
pub(super) struct Line {
    pub(super) statements: Vec<Statement>,
}

impl Line {
    /// Computes outputs in the order given, each with its number. `given` says which nodes need not be computed.
    pub(super) fn new(graph: &Graph, outputs: &[(usize, Scalar)], given: &dyn Fn(NodeId) -> bool) -> Line {
        let mut writer = Writer::new(graph, outputs, given);
        for &(output, of) in outputs {
            writer.compute(writer.unsigned(of.0).0);
            writer.store(output, of.0);
        }
        Line { statements: writer.statements }
    }

    /// How many operations it is, where a product and the sum it goes into are one, and so is a sine.
    pub(super) fn operations(&self) -> usize {
        let of = |expression: &Expression| match expression {
            Expression::Call(..) => 1,
            Expression::Sum(terms) => {
                let products = terms.iter().filter(|term| matches!(term, Term::Product(..))).count();
                let negative = matches!(terms[..], [Term::Number(Operand { negative: true, .. })]);
                // the first of numbers alone is not added to anything
                products.max(terms.len() - 1).max(usize::from(negative))
            }
        };
        let of = |statement: &Statement| match statement {
            Statement::Let(_, expression) | Statement::Store(_, expression) => of(expression),
            Statement::SinCos { sin, cos, .. } => usize::from(sin.is_some()) + usize::from(cos.is_some()),
        };
        self.statements.iter().map(of).sum()
    }

    /// Calls `visit` with every number that an argument holds and the line reads.
    pub(super) fn reads(&self, mut visit: impl FnMut(NodeId)) {
        self.operands(|operand| {
            if let Atom::Given(id) = operand.atom {
                visit(id);
            }
        });
    }

    /// Calls `visit` with every operation that is called.
    pub(super) fn calls(&self, mut visit: impl FnMut(Operation)) {
        for statement in &self.statements {
            if let Statement::Let(_, Expression::Call(operation, ..))
            | Statement::Store(_, Expression::Call(operation, ..)) = statement
            {
                visit(*operation);
            }
        }
    }

    /// Whether there is a sum with a product in it.
    pub(super) fn multiplies_and_adds(&self) -> bool {
        self.statements.iter().any(|statement| match statement {
            Statement::Let(_, Expression::Sum(terms)) | Statement::Store(_, Expression::Sum(terms)) => {
                terms.len() > 1 && terms.iter().any(|term| matches!(term, Term::Product(..)))
            }
            _ => false,
        })
    }

    fn operands(&self, mut visit: impl FnMut(Operand)) {
        for statement in &self.statements {
            match statement {
                Statement::SinCos { of, .. } => visit(*of),
                Statement::Let(_, Expression::Call(_, x, y)) | Statement::Store(_, Expression::Call(_, x, y)) => {
                    visit(*x);
                    visit(*y);
                }
                Statement::Let(_, Expression::Sum(terms)) | Statement::Store(_, Expression::Sum(terms)) => {
                    for term in terms {
                        match *term {
                            Term::Number(number) => visit(number),
                            Term::Product(a, b) => {
                                visit(a);
                                visit(b);
                            }
                        }
                    }
                }
            }
        }
    }
}

struct Writer<'g> {
    graph: &'g Graph,
    given: &'g dyn Fn(NodeId) -> bool,
    /// nodes that have to be computed, in order
    needed: Vec<NodeId>,
    /// nodes that are computed as part of what uses them
    absorbed: Vec<bool>,
    known: Vec<bool>,
    /// how often a node is used, as a part or as an output
    uses: Vec<usize>,
    statements: Vec<Statement>,
}

impl<'g> Writer<'g> {
    fn new(graph: &'g Graph, outputs: &[(usize, Scalar)], given: &'g dyn Fn(NodeId) -> bool) -> Self {
        let mut writer = Writer {
            graph,
            given,
            needed: Vec::new(),
            absorbed: vec![false; graph.len()],
            known: vec![false; graph.len()],
            uses: vec![0; graph.len()],
            statements: Vec::new(),
        };
        writer.find_needed(outputs);
        writer.absorb(outputs);
        writer
    }

    /// Whether a node is there without being computed.
    fn is_atom(&self, id: NodeId) -> bool {
        (self.given)(id) || matches!(self.graph.node(id), Node::Constant(_) | Node::Parameter(_) | Node::Input(_))
    }

    /// The node that this one is the opposite of, or itself, and whether it is the opposite.
    fn unsigned(&self, id: NodeId) -> (NodeId, bool) {
        match self.graph.node(id) {
            Node::Apply(Operation::Neg, x, _) if !(self.given)(id) => {
                let (of, negative) = self.unsigned(x.0);
                (of, !negative)
            }
            _ => (id, false),
        }
    }

    /// The operands of a node that is computed, without their signs.
    fn parts(&self, id: NodeId) -> Vec<NodeId> {
        match self.graph.node(id) {
            Node::Apply(operation, x, _) if operation.row().arity == 1 => vec![self.unsigned(x.0).0],
            Node::Apply(_, x, y) => vec![self.unsigned(x.0).0, self.unsigned(y.0).0],
            _ => Vec::new(),
        }
    }

    fn find_needed(&mut self, outputs: &[(usize, Scalar)]) {
        let mut wanted = vec![false; self.graph.len()];
        for (_, output) in outputs {
            wanted[self.unsigned(output.0).0 as usize] = true;
        }
        for id in (0..wanted.len() as NodeId).rev() {
            if wanted[id as usize] && !self.is_atom(id) {
                self.needed.push(id);
                for part in self.parts(id) {
                    wanted[part as usize] = true;
                }
            }
        }
        self.needed.reverse();
    }

    /// Finds what is computed as part of what uses it: a product that is only ever part of sums, and a sum that is part of one
    /// other. A product that several sums have is computed again by each, where that takes no more operations.
    fn absorb(&mut self, outputs: &[(usize, Scalar)]) {
        let mut sums: HashMap<NodeId, Vec<NodeId>> = HashMap::new();
        let mut alone = vec![false; self.graph.len()];
        for (_, output) in outputs {
            let (of, _) = self.unsigned(output.0);
            alone[of as usize] = true;
            self.uses[of as usize] += 1;
        }
        for at in 0..self.needed.len() {
            let id = self.needed[at];
            let Node::Apply(operation, ..) = self.graph.node(id) else { continue };
            let parts = self.parts(id);
            for &part in &parts {
                self.uses[part as usize] += 1;
                match operation {
                    Operation::Add | Operation::Sub if parts[0] != parts[1] => sums.entry(part).or_default().push(id),
                    _ => alone[part as usize] = true,
                }
            }
        }
        let is = |id: NodeId, wanted: &[Operation]| match self.graph.node(id) {
            Node::Apply(operation, ..) => wanted.contains(&operation),
            _ => false,
        };
        let inner: Vec<NodeId> =
            self.needed.iter().copied().filter(|id| !alone[*id as usize] && sums.contains_key(id)).collect();
        let mut products: Vec<NodeId> = inner.iter().copied().filter(|&id| is(id, &[Operation::Mul])).collect();
        products.sort_by_key(|id| sums[id].len());
        // products and other parts of each sum
        let mut has = vec![(0, 2); self.graph.len()];
        for product in products {
            let users = &sums[&product];
            if users.len() > 1 && users.iter().any(|&sum| has[sum as usize].0 > 0) {
                continue;
            }
            self.absorbed[product as usize] = true;
            for &sum in users {
                let (products, addends) = &mut has[sum as usize];
                (*products, *addends) = (*products + 1, *addends - 1);
            }
        }
        for id in inner.into_iter().filter(|&id| is(id, &[Operation::Add, Operation::Sub])) {
            let [user] = sums[&id][..] else { continue };
            let (inner, outer) = (has[id as usize], has[user as usize]);
            let (products, addends) = (inner.0 + outer.0, inner.1 + outer.1 - 1);
            if products <= MOST_PRODUCTS && addends <= MOST_ADDENDS {
                self.absorbed[id as usize] = true;
                has[user as usize] = (products, addends);
            }
        }
    }

    fn operand(&self, id: NodeId) -> Operand {
        let (of, negative) = self.unsigned(id);
        match self.graph.node(of) {
            Node::Constant(bits) if !(self.given)(of) => {
                let value = f64::from_bits(bits);
                Operand { negative: negative != (value < 0.0), atom: Atom::Constant(value.abs()) }
            }
            _ if self.is_atom(of) => Operand { negative, atom: Atom::Given(of) },
            _ => Operand { negative, atom: Atom::Result(of) },
        }
    }

    fn product(&self, x: NodeId, y: NodeId, negative: bool) -> Term {
        let (x, y) = (self.operand(x), self.operand(y));
        let negative = negative != (x.negative != y.negative);
        Term::Product(Operand { negative, ..x }, Operand { negative: false, ..y })
    }

    /// The parts of a sum or of a product.
    fn terms(&self, id: NodeId, negative: bool, into: &mut Vec<Term>) {
        let Node::Apply(operation, x, y) = self.graph.node(id) else { return };
        if operation == Operation::Mul {
            return into.push(self.product(x.0, y.0, negative));
        }
        for (part, minus) in [(x.0, false), (y.0, operation == Operation::Sub)] {
            let (of, opposite) = self.unsigned(part);
            let negative = negative != (minus != opposite);
            if self.absorbed[of as usize] {
                self.terms(of, negative, into);
            } else {
                let operand = self.operand(of);
                into.push(Term::Number(Operand { negative: negative != operand.negative, ..operand }));
            }
        }
    }

    fn expression(&self, id: NodeId) -> Expression {
        match self.graph.node(id) {
            Node::Apply(Operation::Add | Operation::Sub | Operation::Mul, ..) => {
                let mut terms = Vec::new();
                self.terms(id, false, &mut terms);
                Expression::Sum(terms)
            }
            Node::Apply(operation, x, y) => Expression::Call(operation, self.operand(x.0), self.operand(y.0)),
            _ => Expression::Sum(vec![Term::Number(self.operand(id))]),
        }
    }

    /// What has to be known before a node can be computed.
    fn needs(&self, id: NodeId, into: &mut Vec<NodeId>) {
        for part in self.parts(id) {
            if self.absorbed[part as usize] {
                self.needs(part, into);
            } else if !self.is_atom(part) && !self.known[part as usize] {
                into.push(part);
            }
        }
    }

    /// Computes a node after all that it needs. The stack is our own, for graphs can be deep.
    fn compute(&mut self, id: NodeId) {
        let mut open = vec![id];
        while let Some(&id) = open.last() {
            if self.known[id as usize] || self.is_atom(id) {
                open.pop();
                continue;
            }
            let mut needs = Vec::new();
            self.needs(id, &mut needs);
            if needs.is_empty() {
                open.pop();
                self.statement(id);
            } else {
                open.extend(needs.into_iter().rev());
            }
        }
    }

    fn statement(&mut self, id: NodeId) {
        let statement = match self.graph.node(id) {
            Node::Apply(Operation::Sin | Operation::Cos, x, _) => {
                let both = [Operation::Sin, Operation::Cos].map(|f| {
                    let found = self.graph.find(Node::Apply(f, x, x));
                    found.filter(|found| self.needed.binary_search(found).is_ok())
                });
                for found in both.into_iter().flatten() {
                    self.known[found as usize] = true;
                }
                Statement::SinCos { sin: both[0], cos: both[1], of: self.operand(x.0) }
            }
            _ => Statement::Let(id, self.expression(id)),
        };
        self.known[id as usize] = true;
        self.statements.push(statement);
    }

    /// Puts a value to where it is wanted: at once, where it was computed for that alone.
    fn store(&mut self, output: usize, id: NodeId) {
        let (of, negative) = self.unsigned(id);
        let alone = self.uses[of as usize] == 1;
        let stored =
            match self.statements.pop_if(|last| alone && matches!(last, Statement::Let(last, _) if *last == of)) {
                Some(Statement::Let(_, Expression::Sum(terms))) => {
                    Expression::Sum(terms.into_iter().map(|term| term.signed(negative)).collect())
                }
                Some(Statement::Let(_, call)) if !negative => call,
                taken => {
                    self.statements.extend(taken);
                    Expression::Sum(vec![Term::Number(self.operand(id))])
                }
            };
        self.statements.push(Statement::Store(output, stored));
    }
}
