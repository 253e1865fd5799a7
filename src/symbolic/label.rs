//! What a model calls the nodes of its graph.

use crate::graph::NodeId;

/// One way to say what a node is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Label {
    /// a parameter, input or definition
    Name(String),
    /// a function of the model or of the prelude, with its arguments
    Call(String, Vec<NodeId>),
    /// a chain, or its part up to a joint, with its readings; what it is made of is not told
    Chain(String, Vec<NodeId>),
    /// how it is written, which is not a name: a core function with its arguments
    Form(String, Vec<NodeId>),
    /// a field of another node: `l1.z`
    Field(NodeId, &'static str),
    /// the derivative of another node by what this names
    Derivative(NodeId, String),
}

impl Label {
    /// What is used first where a node has several: a name of the model's before what the node is made of.
    pub(super) fn rank(&self) -> u8 {
        match self {
            Label::Name(_) => 0,
            Label::Derivative(..) => 1,
            Label::Call(..) => 2,
            Label::Chain(..) => 3,
            Label::Field(..) => 4,
            Label::Form(..) => 5,
        }
    }
}

/// Labels of nodes; the first of a node is the one to use.
#[derive(Clone, Debug, Default)]
pub struct Labels {
    all: Vec<(NodeId, Label)>,
}

impl Labels {
    /// Adds a label after those that the node has.
    pub(crate) fn add(&mut self, node: NodeId, label: Label) {
        self.all.push((node, label));
    }

    pub(crate) fn len(&self) -> usize {
        self.all.len()
    }

    /// Forgets all labels but the first ones.
    pub(crate) fn truncate(&mut self, labels: usize) {
        self.all.truncate(labels);
    }

    pub(crate) fn iter(&self) -> impl Iterator<Item = &(NodeId, Label)> {
        self.all.iter()
    }

    /// The labels of nodes that a map keeps, with the numbers that it gives them.
    pub(crate) fn moved(&self, to: impl Fn(NodeId) -> Option<NodeId>) -> Labels {
        let all = |nodes: &[NodeId]| nodes.iter().map(|node| to(*node)).collect::<Option<Vec<_>>>();
        let label = |label: &Label| {
            Some(match label {
                Label::Name(name) => Label::Name(name.clone()),
                Label::Call(name, arguments) => Label::Call(name.clone(), all(arguments)?),
                Label::Chain(name, readings) => Label::Chain(name.clone(), all(readings)?),
                Label::Form(name, arguments) => Label::Form(name.clone(), all(arguments)?),
                Label::Field(node, field) => Label::Field(to(*node)?, field),
                Label::Derivative(node, by) => Label::Derivative(to(*node)?, by.clone()),
            })
        };
        Labels { all: self.all.iter().filter_map(|(node, known)| Some((to(*node)?, label(known)?))).collect() }
    }
}
