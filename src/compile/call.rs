//! Calls: chains, functions of the model and the prelude, core functions.

use super::chain::Chain;
use super::core::{self, Mismatch};
use super::scope::{Locals, Scope};
use super::snippet::Snippet;
use super::value::Value;
use crate::diag::Code;
use crate::graph::NodeId;
use crate::lang::Expr;
use crate::symbolic::Label;
use crate::unit::Dimension;

impl Scope<'_> {
    pub(super) fn call(
        &mut self,
        name: &str,
        values: Option<Vec<Value>>,
        given: usize,
        expr: &Expr,
        at: &Snippet,
    ) -> Option<Value> {
        if let Some((chain, joints)) = self.declarations.chain_part(name) {
            return self.call_chain(name, (chain, joints), values, given, expr, at);
        }
        if let Some(function) = self.declarations.functions.get(name) {
            let wanted = function.parameters.len();
            if given != wanted {
                return self.checked(Err(core::wrong_arity(name, wanted, given)), expr, at);
            }
            let values = values?;
            let key = (name.to_owned(), values.clone());
            if let Some(&known) = self.calls.get(&key) {
                return known;
            }
            if self.expanding.iter().any(|outer| outer == name) {
                let message = format!("the function `{name}` calls itself");
                let hint = Some("functions may call others, not themselves".into());
                self.report(Code::Circular, expr, at, &message, hint);
                return None;
            }
            let names = function.parameters.iter().cloned().zip(values).collect();
            let locals = Locals { names, function: true };
            let body = function.body.as_ref()?;
            self.expanding.push(name.to_owned());
            let before = self.diagnostics.len();
            let value = self.expression(body, &function.at, &locals);
            self.expanding.pop();
            if value.is_none() && self.diagnostics.len() > before {
                self.blame_call(before, expr, at, name);
            }
            if let Some(value) = value {
                let nodes: Vec<NodeId> = key.1.iter().map(Value::node).collect();
                self.label(value, Label::Call(name.to_owned(), nodes));
            }
            self.calls.insert(key, value);
            return value;
        }
        match core::arity(name) {
            Some(wanted) if wanted != given => self.checked(Err(core::wrong_arity(name, wanted, given)), expr, at),
            Some(_) => {
                let values = values?;
                let result = core::call(&mut self.graph, name, &values)?;
                let value = self.checked(result, expr, at)?;
                self.label(value, Label::Form(name.to_owned(), values.iter().map(Value::node).collect()));
                Some(value)
            }
            None => {
                let hint = self.declarations.suggest_callable(name);
                self.report(Code::UnknownName, expr, at, &format!("there is no function or chain `{name}`"), hint);
                None
            }
        }
    }

    /// A mistake inside a function's body is reported there, with the call that led to it.
    fn blame_call(&mut self, before: usize, expr: &Expr, at: &Snippet, name: &str) {
        for diagnostic in self.diagnostics.0.iter_mut().skip(before) {
            if diagnostic.labels.is_empty() {
                let labelled =
                    diagnostic.clone().label(&at.source, at.span(&expr.span), format!("`{name}` is called here"));
                *diagnostic = labelled;
            }
        }
    }

    fn call_chain(
        &mut self,
        name: &str,
        (declared, joints): (&Chain, usize),
        values: Option<Vec<Value>>,
        given: usize,
        expr: &Expr,
        at: &Snippet,
    ) -> Option<Value> {
        let wanted: Vec<_> = declared.readings(joints).collect();
        if given != wanted.len() {
            let joints: Vec<_> = wanted.iter().map(|(joint, _)| joint.name.as_str()).collect();
            let mismatch = core::wrong_arity(name, wanted.len(), given);
            let hint = if joints.is_empty() {
                "none of its joints moves".to_owned()
            } else {
                format!("one for each moving joint: {}", joints.join(", "))
            };
            return self.checked(Err(mismatch.hint(hint)), expr, at);
        }
        let mut readings = Vec::with_capacity(wanted.len());
        for ((joint, dimension), value) in wanted.iter().zip(values?) {
            match value {
                Value::Scalar(s, d) if d.compatible(*dimension) || self.graph.value(s) == Some(0.0) => readings.push(s),
                Value::Scalar(_, d) => {
                    let message =
                        format!("the joint `{}` reads {}, and this is {}", joint.name, dimension.noun(), d.noun());
                    return self.checked(Err(Mismatch::dimension(message)), expr, at);
                }
                other => {
                    let message = format!("the joint `{}` reads a scalar, and this is {}", joint.name, other.shape());
                    return self.checked(Err(Mismatch::shape(message)), expr, at);
                }
            }
        }
        let mut frame = self.graph.no_motion();
        let (mut readings, mut read) = (readings.into_iter(), Vec::new());
        for (k, joint) in declared.joints.iter().take(joints).enumerate() {
            let reading = joint.reading.and_then(|_| readings.next());
            read.extend(reading.map(|s| s.0));
            let next = joint.frame(self, reading)?;
            frame = self.graph.compose_frame(frame, next);
            let whole = k + 1 == declared.joints.len();
            let part = if whole { declared.name.clone() } else { format!("{}.{}", declared.name, joint.name) };
            self.label(Value::Frame(frame, Dimension::LENGTH), Label::Chain(part, read.clone()));
        }
        Some(Value::Frame(frame, Dimension::LENGTH))
    }
}
