//! Scenarios: how data are made up.

use super::columns::Columns;
use super::leaf::{Map, Quantity};
use super::read::{Entry, Reader, group, plain_records, read_all, record, unplaced};
use super::text::Text;
use super::tree::{Body, Kind, Node};

record! {
    /// A made-up experiment.
    "a scenario"
    pub struct Scenario {
        /// What the random numbers start from.
        pub seed: Option<u64>,
        /// The true values of parameters that are not at their nominal ones.
        pub truth: Map<Draw>,
        /// How the rows of each measurement are made.
        pub measurements: Map<Experiment>,
    }
}

record! {
    /// How the rows of a measurement are made.
    "a simulated measurement"
    pub struct Experiment {
        /// How many.
        pub rows: Option<u64>,
        /// Inputs, keys and auxiliary names that are drawn; several that are drawn alike, each by itself, may stand together.
        pub draw: Columns<Draw>,
        /// Named expressions; each sees the ones before.
        pub define: Map<Text>,
        /// Inputs given by formulas.
        pub set: Map<Quantity>,
        /// Inputs found by solving.
        pub solve: Vec<Solve>,
        /// The errors of the readings, where they are not those declared.
        pub noise: Columns<Noise>,
    }
}

record! {
    /// Inputs that make expressions vanish.
    "a `solve` entry"
    pub struct Solve {
        /// The inputs and where they start: numbers, or expressions of what is drawn.
        pub unknowns: Map<Quantity>,
        /// What must vanish.
        pub zero: Zero,
    }
}

record! {
    /// The error of a reading.
    "a noise entry"
    pub struct Noise {
        /// Its mean.
        pub mean: Option<Quantity>,
        /// Its standard deviation.
        pub sigma: Option<Quantity>,
    }
}

plain_records!(Scenario, Experiment, Solve, Noise);

/// What must vanish: one expression, or a list of them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Zero(pub Vec<Text>);

impl Entry for Zero {
    fn read(node: &Node, reader: &mut Reader) -> Option<Self> {
        match &node.kind {
            Kind::Text(one) => Some(Self(vec![one.clone()])),
            Kind::List(items) if !items.is_empty() => read_all(items, reader).map(Self),
            _ => reader.wrong(node, "an expression as text, or a list of them", None),
        }
    }

    fn write(&self) -> Option<Node> {
        match &self.0[..] {
            [one] => one.write(),
            _ => self.0.write(),
        }
    }
}

/// Where a made-up value comes from.
#[derive(Clone, Debug, PartialEq)]
pub enum Draw {
    /// Always the same.
    Constant(Quantity),
    /// Even between two values.
    Uniform(Quantity, Quantity),
    /// Gaussian, with mean and standard deviation.
    Normal(Quantity, Quantity),
    /// Gaussian around the nominal value, with this standard deviation: of a truth.
    Around(Quantity),
    /// One after the other, over and over.
    Cycle(Vec<Quantity>),
    /// Any of them.
    Choice(Vec<Quantity>),
    /// Drawn for so many rows at a time.
    Each(u64, Box<Draw>),
}

const DRAWS: &[&str] = &["Uniform", "Normal", "Around", "Cycle", "Choice", "Each"];

impl Entry for Draw {
    fn read(node: &Node, reader: &mut Reader) -> Option<Self> {
        let Kind::Group(Some(word), body) = &node.kind else {
            return Quantity::read(node, reader).map(Self::Constant);
        };
        let items = match body {
            Body::Tuple(items) => &items[..],
            Body::Bare | Body::Fields(_) => &[],
        };
        match (word.name.as_str(), items) {
            ("Uniform", [low, high]) => {
                let (low, high) = (Quantity::read(low, reader), Quantity::read(high, reader));
                Some(Self::Uniform(low?, high?))
            }
            ("Normal", [mean, sigma]) => {
                let (mean, sigma) = (Quantity::read(mean, reader), Quantity::read(sigma, reader));
                Some(Self::Normal(mean?, sigma?))
            }
            ("Around", [sigma]) => Quantity::read(sigma, reader).map(Self::Around),
            ("Around", _) => reader.wrong(node, "`Around(sigma)`", None),
            ("Cycle" | "Choice", [list]) => {
                let all: Vec<Quantity> = Vec::read(list, reader)?;
                if all.is_empty() {
                    return reader.wrong(list, "at least one value", None);
                }
                Some(match word.name.as_str() {
                    "Cycle" => Self::Cycle(all),
                    _ => Self::Choice(all),
                })
            }
            ("Each", [rows, draw]) => {
                let (rows, draw) = (u64::read(rows, reader), Draw::read(draw, reader));
                match (rows?, draw?) {
                    (0, _) => reader.wrong(node, "at least one row", None),
                    (_, Self::Each(..)) => reader.wrong(node, "`Each` of something else than `Each`", None),
                    (rows, draw) => Some(Self::Each(rows, Box::new(draw))),
                }
            }
            ("Each", _) => reader.wrong(node, "`Each(rows, Uniform(…))`", None),
            ("Uniform", _) => reader.wrong(node, "`Uniform(least, greatest)`", None),
            ("Normal", _) => reader.wrong(node, "`Normal(mean, sigma)`", None),
            ("Cycle" | "Choice", _) => {
                let wanted = format!("`{}([a, b, …])`", word.name);
                reader.wrong(node, &wanted, None)
            }
            _ => reader.unknown_word(word, "way to draw", DRAWS),
        }
    }

    fn write(&self) -> Option<Node> {
        let named = |name, items: Vec<Option<Node>>| {
            let items = items.into_iter().collect::<Option<_>>()?;
            Some(group(Some(name), Body::Tuple(items)))
        };
        let list = |all: &[Quantity]| {
            let items = all.iter().filter_map(Entry::write).collect();
            vec![Some(unplaced(Kind::List(items)))]
        };
        match self {
            Self::Constant(value) => value.write(),
            Self::Uniform(low, high) => named("Uniform", vec![low.write(), high.write()]),
            Self::Normal(mean, sigma) => named("Normal", vec![mean.write(), sigma.write()]),
            Self::Around(sigma) => named("Around", vec![sigma.write()]),
            Self::Cycle(all) => named("Cycle", list(all)),
            Self::Choice(all) => named("Choice", list(all)),
            Self::Each(rows, draw) => named("Each", vec![rows.write(), draw.write()]),
        }
    }
}
