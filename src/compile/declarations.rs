//! What the model declares outside its measurements: units, parameters, chains, functions, definitions.

use std::collections::HashMap;
use std::sync::Arc;

use super::chain::Chain;
use super::core;
use super::prelude::PRELUDE;
use super::program::Parameter;
use super::quantity::Quantities;
use super::snippet::Snippet;
use crate::diag::{Code, Diagnostic, Diagnostics, Source, nearest};
use crate::lang::{self, Expr, ExprKind};
use crate::model::Model;
use crate::unit::{Dimension, Units};

/// What a full name stands for.
#[derive(Clone, Debug)]
pub(crate) enum Symbol {
    /// a parameter, by its number
    Parameter(usize),
    /// a constant of a chain
    Constant(f64, Dimension),
    /// an expression in a parameter's place
    Tie(Snippet, Option<Dimension>),
    /// a definition of the model
    Definition(Snippet, Option<Dimension>),
    /// its mistake has been reported
    Broken,
}

/// A function with its body's place.
#[derive(Clone, Debug)]
pub(crate) struct Function {
    pub(crate) parameters: Vec<String>,
    /// none where its mistake has been reported
    pub(crate) body: Option<Expr>,
    pub(crate) at: Snippet,
}

/// Everything that expressions may name, apart from their own measurement.
#[derive(Clone, Debug)]
pub(crate) struct Declarations {
    pub(crate) units: Units,
    pub(crate) source: Arc<Source>,
    pub(crate) parameters: Vec<Parameter>,
    pub(crate) chains: Vec<Chain>,
    pub(crate) functions: HashMap<String, Function>,
    symbols: HashMap<String, Symbol>,
    order: Vec<String>,
}

impl Declarations {
    /// Units and nothing else: what constants are read with.
    pub(crate) fn bare(units: Units, source: &Arc<Source>) -> Self {
        Declarations {
            units,
            source: Arc::clone(source),
            parameters: Vec::new(),
            chains: Vec::new(),
            functions: HashMap::new(),
            symbols: HashMap::new(),
            order: Vec::new(),
        }
    }

    /// Reads all declarations, and reports all their mistakes.
    pub(crate) fn read(model: &Model, source: &Arc<Source>, diagnostics: &mut Diagnostics) -> Self {
        let quantities = Quantities::read(model, source, diagnostics);
        let mut all = Declarations::bare(quantities.units, source);
        for (name, joints) in model.chains.iter() {
            all.refuse_core_name(&name.value, &Snippet::new(name, source), diagnostics);
            let chain = Chain::read(&name.value, joints, &quantities, &mut all, diagnostics);
            all.chains.push(chain);
        }
        for (name, declared) in model.parameters.iter() {
            let at = Snippet::new(name, source);
            all.refuse_core_name(&name.value, &at, diagnostics);
            if !lang::is_name(&name.value) {
                diagnostics.push(
                    at.whole(Code::BadExpression, format!("`{}` is not a name", name.value))
                        .hint("letters, digits and underscores, a letter first"),
                );
            }
            let symbol = match quantities.parameter(&name.value, declared, diagnostics) {
                Some(parameter) => {
                    all.parameters.push(parameter);
                    Symbol::Parameter(all.parameters.len() - 1)
                }
                None => Symbol::Broken,
            };
            all.declare(&name.value, symbol, &at, diagnostics);
        }
        for (name, text) in model.define.iter() {
            let at = Snippet::new(name, source);
            all.refuse_core_name(&name.value, &at, diagnostics);
            all.declare(&name.value, Symbol::Definition(Snippet::new(text, source), None), &at, diagnostics);
        }
        all.read_functions(model, diagnostics);
        all
    }

    /// Adds a symbol; a second one of the same name is a mistake.
    pub(crate) fn declare(&mut self, name: &str, symbol: Symbol, at: &Snippet, diagnostics: &mut Diagnostics) {
        if self.symbols.contains_key(name) || self.chain(name).is_some() {
            diagnostics.push(at.whole(Code::NameTaken, format!("`{name}` is declared twice")));
            return;
        }
        self.symbols.insert(name.to_owned(), symbol);
        self.order.push(name.to_owned());
    }

    fn refuse_core_name(&self, name: &str, at: &Snippet, diagnostics: &mut Diagnostics) {
        if core::arity(name).is_some() || name == "pi" {
            diagnostics.push(at.whole(Code::NameTaken, format!("`{name}` is part of the language")));
        }
    }

    fn read_functions(&mut self, model: &Model, diagnostics: &mut Diagnostics) {
        let own = model.functions.iter().map(|(head, body)| {
            (Snippet::new(head, &self.source), head.value.clone(), Snippet::new(body, &self.source))
        });
        let prelude = PRELUDE
            .iter()
            .map(|(head, body)| (Snippet::alone("prelude", head), (*head).to_owned(), Snippet::alone("prelude", body)));
        for (at, head, body) in own.chain(prelude).collect::<Vec<_>>() {
            let signature = match lang::parse_signature(&head) {
                Ok(signature) => signature,
                Err(error) => {
                    let span = at.span(&error.span);
                    diagnostics.push(
                        Diagnostic::error(Code::BadExpression, error.message)
                            .at(&at.source, span)
                            .maybe_hint(error.hint),
                    );
                    continue;
                }
            };
            let name = signature.name.name;
            if core::arity(&name).is_some() || self.chain(&name).is_some() {
                diagnostics.push(at.whole(Code::NameTaken, format!("`{name}` is already a core function or a chain")));
                continue;
            }
            let in_prelude = at.source.name() == "prelude";
            if self.functions.contains_key(&name) {
                if !in_prelude {
                    diagnostics.push(at.whole(Code::NameTaken, format!("the function `{name}` is declared twice")));
                }
                continue;
            }
            let parsed = body.parse().map_err(|diagnostic| diagnostics.push(*diagnostic)).ok();
            let parameters = signature.parameters.into_iter().map(|parameter| parameter.name).collect();
            self.functions.insert(name, Function { parameters, body: parsed, at: body });
        }
        for head in model.functions.keys() {
            if let Ok(signature) = lang::parse_signature(&head.value) {
                self.check_body(&signature.name.name, diagnostics);
            }
        }
    }

    /// Names and arity in a function's body, so that a function that is never called is checked too.
    fn check_body(&self, name: &str, diagnostics: &mut Diagnostics) {
        let Some(function) = self.functions.get(name) else { return };
        let Some(body) = &function.body else { return };
        let mut fields = Vec::new();
        body.visit(|expr| {
            let mut report = |code, message: String, hint| {
                diagnostics.push(
                    Diagnostic::error(code, message)
                        .at(&function.at.source, function.at.span(&expr.span))
                        .maybe_hint(hint),
                );
            };
            let known = |name: &str| {
                function.parameters.iter().any(|p| p == name) || self.symbols.contains_key(name) || name == "pi"
            };
            match &expr.kind {
                ExprKind::Field(base, field) => {
                    if let ExprKind::Name(base_name) = &base.kind
                        && !known(base_name)
                    {
                        fields.push(base.span.clone());
                        let dotted = format!("{base_name}.{field}");
                        if !self.symbols.contains_key(&dotted) {
                            let hint = self.suggest(&dotted, &function.parameters);
                            report(Code::UnknownName, format!("there is no `{dotted}` here"), hint);
                        }
                    }
                }
                ExprKind::Name(name) if !known(name) && !fields.contains(&expr.span) => {
                    report(
                        Code::UnknownName,
                        format!("there is no `{name}` here"),
                        self.suggest(name, &function.parameters),
                    );
                }
                ExprKind::Call { function: called, arguments, .. } => match self.arity(called) {
                    None => report(
                        Code::UnknownName,
                        format!("there is no function or chain `{called}`"),
                        self.suggest_callable(called),
                    ),
                    Some(wanted) if wanted != arguments.len() => {
                        report(Code::WrongArity, core::wrong_arity(called, wanted, arguments.len()).message, None);
                    }
                    Some(_) => {}
                },
                _ => {}
            }
        });
    }

    fn arity(&self, name: &str) -> Option<usize> {
        let chain = self.chain_part(name);
        chain
            .map(|(chain, joints)| chain.readings(joints).count())
            .or_else(|| self.functions.get(name).map(|function| function.parameters.len()))
            .or_else(|| core::arity(name))
    }

    /// The symbol of a full name.
    pub(crate) fn symbol(&self, name: &str) -> Option<&Symbol> {
        self.symbols.get(name)
    }

    /// The number of a parameter.
    pub(crate) fn parameter(&self, name: &str) -> Option<usize> {
        match self.symbol(name) {
            Some(Symbol::Parameter(number)) => Some(*number),
            _ => None,
        }
    }

    /// All full names in the order of the file.
    pub(crate) fn symbol_names(&self) -> impl Iterator<Item = &str> {
        self.order.iter().map(String::as_str)
    }

    /// Names that are constants or ties of chains.
    pub(crate) fn constants(&self) -> Vec<String> {
        let fixed = |name: &&String| matches!(self.symbols.get(*name), Some(Symbol::Constant(..) | Symbol::Tie(..)));
        self.order.iter().filter(fixed).cloned().collect()
    }

    /// A parameter by its number, which only declaring it gives.
    #[allow(clippy::indexing_slicing, reason = "a number comes from `parameters`, which only grows")]
    pub(crate) fn numbered(&self, parameter: usize) -> &Parameter {
        &self.parameters[parameter]
    }

    /// The chain of this name.
    pub(crate) fn chain(&self, name: &str) -> Option<&Chain> {
        self.chains.iter().find(|chain| chain.name == name)
    }

    /// A chain and how many of its joints a call means: all in `left(…)`, those up to L1 in `left.L1(…)`.
    pub(crate) fn chain_part(&self, name: &str) -> Option<(&Chain, usize)> {
        let (chain, joint) = name.split_once('.').map_or((name, None), |(chain, joint)| (chain, Some(joint)));
        let chain = self.chain(chain)?;
        let last = match joint {
            Some(joint) => chain.joints.iter().position(|known| known.name == joint)? + 1,
            None => chain.joints.len(),
        };
        Some((chain, last))
    }

    /// What a function or chain was probably meant.
    pub(crate) fn suggest_callable(&self, name: &str) -> Option<String> {
        if let Some((first, rest)) = name.split_once('.') {
            return Some(match self.chain(first) {
                Some(chain) => {
                    let joints: Vec<&str> = chain.joints.iter().map(|joint| joint.name.as_str()).collect();
                    format!("the joints of the chain are {}", joints.join(", "))
                }
                None => format!("a function comes before its arguments, `{rest}(…)`"),
            });
        }
        let mut functions: Vec<&str> = self.functions.keys().map(String::as_str).collect();
        functions.sort_unstable();
        let mut all: Vec<&str> = self.chains.iter().map(|chain| chain.name.as_str()).collect();
        all.extend(functions);
        for name in core::names() {
            all.push(name);
        }
        nearest(name, all).map(|near| format!("did you mean `{near}`?"))
    }

    fn suggest(&self, name: &str, locals: &[String]) -> Option<String> {
        let candidates = locals.iter().map(String::as_str).chain(self.symbol_names());
        nearest(name, candidates).map(|near| format!("did you mean `{near}`?"))
    }
}
