//! The chains that a measurement calls, as frames of its graph.

use crate::compile::Measurement;
use crate::graph::{Axis, Frame, Graph, Node, NodeId, Scalar, Tape};
use crate::symbolic::Label;

/// One call of a chain: the frames of its joints, by name, the last one's being the chain's.
pub(super) struct Called {
    pub(super) chain: String,
    pub(super) joints: Vec<String>,
    /// the first of the joints' frames on the tape
    pub(super) first: usize,
}

/// All calls of chains in a measurement, and their frames over its leaves and inputs.
pub(super) struct Calls {
    pub(super) calls: Vec<Called>,
    tape: Tape,
}

/// Numbers of a frame on the tape: its origin, then where its axes point.
const NUMBERS: usize = 12;

impl Calls {
    pub(super) fn of(measurement: &Measurement) -> Calls {
        let mut graph: Graph = (*measurement.graph).clone();
        let chains = || {
            measurement.labels.iter().filter_map(|(node, label)| match label {
                Label::Chain(name, readings) => Some((*node, name.as_str(), readings.as_slice())),
                _ => None,
            })
        };
        let (mut calls, mut outputs, mut known) = (Vec::new(), Vec::new(), Vec::new());
        for (node, chain, readings) in chains().filter(|(_, name, _)| !name.contains('.')) {
            if known.contains(&node) {
                continue;
            }
            known.push(node);
            // the joints on the way to it: parts of the same chain that read the same as far as they go
            let mut frames: Vec<(NodeId, String)> = Vec::new();
            for (part, name, read) in chains() {
                let joint = name.strip_prefix(chain).and_then(|rest| rest.strip_prefix('.'));
                if let Some(joint) = joint.filter(|_| readings.starts_with(read))
                    && frames.iter().all(|(_, known)| known != joint)
                {
                    frames.push((part, joint.to_owned()));
                }
            }
            frames.push((node, chain.to_owned()));
            let base = base_of(&graph, node);
            let first = outputs.len() / NUMBERS;
            for (frame, _) in &frames {
                outputs.extend(numbers(&mut graph, base, Frame(*frame)));
            }
            let joints = frames.into_iter().map(|(_, joint)| joint).collect();
            calls.push(Called { chain: chain.to_owned(), joints, first });
        }
        Calls { calls, tape: Tape::lower(&graph, &outputs) }
    }

    /// Origin and axes of all frames in a row.
    pub(super) fn frames(&self, leaves: &[f64], inputs: &[f64]) -> Vec<[[f64; 3]; 4]> {
        let padded = |numbers: &[f64], wanted: usize| {
            let mut numbers = numbers.to_vec();
            numbers.resize(numbers.len().max(wanted), 0.0);
            numbers
        };
        let (leaves, inputs) = (padded(leaves, self.tape.parameters()), padded(inputs, self.tape.inputs()));
        let all = self.tape.evaluate(&leaves, &inputs);
        let (triples, _) = all.as_chunks::<3>();
        let (frames, _) = triples.as_chunks::<4>();
        frames.to_vec()
    }
}

/// What a chain's frame is seen from, where it is composed with one frame only.
fn base_of(graph: &Graph, chain: NodeId) -> Option<Frame> {
    let mut found = None;
    for id in 0..graph.len() {
        match graph.node(id as NodeId) {
            Node::ComposeFrame(base, of) if of.0 == chain => match found {
                Some(known) if known != base => return None,
                _ => found = Some(base),
            },
            _ => {}
        }
    }
    found
}

/// Origin and axes of a frame, from its base.
fn numbers(graph: &mut Graph, base: Option<Frame>, frame: Frame) -> Vec<Scalar> {
    let frame = base.map_or(frame, |base| graph.compose_frame(base, frame));
    let (origin, rotation) = (graph.origin(frame), graph.rotation_of(frame));
    let axes = Axis::ALL.map(|axis| graph.column(rotation, axis));
    let vectors = [origin].into_iter().chain(axes);
    vectors.flat_map(|vector| Axis::ALL.map(|axis| graph.component(vector, axis))).collect()
}
