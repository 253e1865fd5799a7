//! Quantities of the model file as numbers: units, nominal values, bounds, priors, tolerances.

use std::sync::Arc;

use super::declarations::Declarations;
use super::program::{Parameter, Role, Setting, Shape};
use super::scope::Scope;
use super::snippet::Snippet;
use super::value::Value as Node;
use crate::diag::{Code, Diagnostic, Diagnostics, Source, Span};
use crate::lang::ExprKind;
use crate::model::{self, Components, Model, Quantity, Text, Value, Values};
use crate::unit::{Base, Dimension, Unit, Units};

/// What reads quantities: the model's units and default tolerances.
pub(crate) struct Quantities {
    pub(crate) units: Units,
    pub(crate) source: Arc<Source>,
    tolerances: [Option<f64>; 5],
    number_tolerance: Option<f64>,
}

impl Quantities {
    /// The default tolerances with some units.
    pub(crate) fn of_units(units: Units, source: &Arc<Source>) -> Self {
        // 0.1 mm and 0.05 mrad, unless the model says otherwise
        let mm = Unit { factor: 1e-3, dimension: Dimension::LENGTH };
        let tolerances = Base::ALL.map(|base| match base {
            Base::Length => Some(units.to_internal(0.1, mm)),
            Base::Angle => Some(5e-5),
            _ => None,
        });
        Quantities { units, source: Arc::clone(source), tolerances, number_tolerance: None }
    }

    /// Reads `units` and `tolerances`.
    pub(crate) fn read(model: &Model, source: &Arc<Source>, diagnostics: &mut Diagnostics) -> Self {
        let mut units = Units::default();
        let declared =
            [&model.units.length, &model.units.angle, &model.units.time, &model.units.mass, &model.units.temperature];
        for (base, text) in Base::ALL.into_iter().zip(declared) {
            let Some(text) = text else { continue };
            match units.with(base, &text.value) {
                Ok(with) => units = with,
                Err(error) => {
                    let code = match error {
                        crate::unit::UnitsError::Unknown(_) => Code::UnknownUnit,
                        crate::unit::UnitsError::Dimension { .. } => Code::WrongUnit,
                    };
                    diagnostics.push(Snippet::new(text, source).whole(code, error.to_string()));
                }
            }
        }
        let mut all = Quantities::of_units(units, source);
        let declared = [
            &model.tolerances.length,
            &model.tolerances.angle,
            &model.tolerances.time,
            &model.tolerances.mass,
            &model.tolerances.temperature,
        ];
        let mut tolerances = all.tolerances;
        for ((base, quantity), tolerance) in Base::ALL.into_iter().zip(declared).zip(&mut tolerances) {
            if let Some(quantity) = quantity
                && let Some(value) = all.positive(quantity, Dimension::of(base), None, diagnostics)
            {
                *tolerance = Some(value);
            }
        }
        all.tolerances = tolerances;
        if let Some(quantity) = &model.tolerances.number {
            all.number_tolerance = all.positive(quantity, Dimension::NUMBER, None, diagnostics);
        }
        all
    }

    /// A constant of a wanted dimension, in internal units. A bare number counts in `bare`, or else in the model's unit.
    pub(crate) fn constant(
        &self,
        quantity: &Quantity,
        wanted: Dimension,
        bare: Option<Unit>,
        diagnostics: &mut Diagnostics,
    ) -> Option<f64> {
        let (value, dimension) = self.any(quantity, diagnostics)?;
        if dimension.is_number() && !self.has_unit(quantity) {
            let unit = bare.unwrap_or_else(|| self.units.unit(wanted));
            let internal = self.units.to_internal(value, unit);
            if wanted == Dimension::ANGLE && internal.abs() > 1.001 * std::f64::consts::TAU {
                let message =
                    format!("a number without a unit is {value} {} here, more than a turn", self.units.symbol(wanted));
                let found = Diagnostic::warning(Code::LargeAngle, message).at(&self.source, quantity.span());
                diagnostics.push(found.hint(format!("write its unit: `{value} deg`")));
            }
            return Some(internal);
        }
        if dimension == wanted || (wanted.is_number() && dimension.compatible(wanted)) {
            return Some(value);
        }
        let message = format!("{} is wanted here, and this is {}", wanted.noun(), dimension.noun());
        diagnostics.push(Diagnostic::error(Code::WrongUnit, message).at(&self.source, quantity.span()));
        None
    }

    /// The same, and it must be positive.
    pub(crate) fn positive(
        &self,
        quantity: &Quantity,
        wanted: Dimension,
        bare: Option<Unit>,
        diagnostics: &mut Diagnostics,
    ) -> Option<f64> {
        let value = self.constant(quantity, wanted, bare, diagnostics)?;
        if value > 0.0 {
            return Some(value);
        }
        let found = Diagnostic::error(Code::NotPositive, "a standard deviation or tolerance is positive")
            .at(&self.source, quantity.span());
        diagnostics.push(found.hint("leave the field out where there is none"));
        None
    }

    /// A constant of whatever dimension, in internal units; a bare number as it stands.
    pub(crate) fn any(&self, quantity: &Quantity, diagnostics: &mut Diagnostics) -> Option<(f64, Dimension)> {
        let text = match quantity {
            Quantity::Number(number) => return Some((number.value, Dimension::NUMBER)),
            Quantity::Text(text) => text,
        };
        let bare = Declarations::bare(self.units, &self.source);
        let mut scope = Scope::new(&bare);
        let snippet = Snippet::new(text, &self.source);
        let value = scope.value(&snippet);
        diagnostics.extend(scope.diagnostics);
        match value? {
            Node::Scalar(s, dimension) => match scope.graph.value(s) {
                Some(value) => Some((value, dimension)),
                None => {
                    let message = "the expression has no finite value";
                    diagnostics.push(snippet.whole(Code::NotFinite, message));
                    None
                }
            },
            other => {
                diagnostics.push(
                    snippet.whole(Code::WrongShape, format!("a number is wanted here, and this is {}", other.shape())),
                );
                None
            }
        }
    }

    /// The unit of a column or parameter.
    pub(crate) fn unit(&self, text: &Text, diagnostics: &mut Diagnostics) -> Option<Unit> {
        match Unit::parse(&text.value) {
            Ok(unit) => Some(unit),
            Err(error) => {
                let hint = error.suggestion.as_ref().map(|near| format!("did you mean `{near}`?"));
                diagnostics.push(
                    Snippet::new(text, &self.source).whole(Code::UnknownUnit, error.to_string()).maybe_hint(hint),
                );
                None
            }
        }
    }

    /// Whether a quantity names parameters, and so is a tie.
    pub(crate) fn is_tie(&self, quantity: &Quantity) -> bool {
        self.contains(quantity, |part| match part {
            ExprKind::Name(name) => name != "pi",
            part => matches!(part, ExprKind::Index { .. }),
        })
    }

    /// Whether a quantity states a unit, if only that of a plain number, such as `5 ppm`.
    fn has_unit(&self, quantity: &Quantity) -> bool {
        self.contains(quantity, |part| matches!(part, ExprKind::Number { unit: Some(_), .. }))
    }

    fn contains(&self, quantity: &Quantity, wanted: impl Fn(&ExprKind) -> bool) -> bool {
        let Quantity::Text(text) = quantity else { return false };
        let Ok(expr) = Snippet::new(text, &self.source).parse() else { return false };
        let mut found = false;
        expr.visit(|part| found |= wanted(&part.kind));
        found
    }

    /// What counts as known well enough where nothing is said: a thousandth of the nominal value, or of one, where there is
    /// no default for the dimension.
    fn tolerance(&self, dimension: Dimension, nominal: f64) -> f64 {
        let mut of_bases = Base::ALL.into_iter().zip(self.tolerances);
        let declared = match of_bases.find(|(base, _)| Dimension::of(*base) == dimension) {
            Some((_, tolerance)) => tolerance,
            None if dimension.is_number() => self.number_tolerance,
            None => None,
        };
        declared.unwrap_or(if nominal == 0.0 { 1e-3 } else { 1e-3 * nominal.abs() })
    }

    /// The setting of a scalar in a chain.
    pub(crate) fn scalar_setting(
        &self,
        value: &Value<Quantity>,
        wanted: Dimension,
        diagnostics: &mut Diagnostics,
    ) -> Option<Setting> {
        let (role, setting) = match value {
            Value::Constant(_) => return None,
            Value::Free(setting) => (Role::Free, setting),
            Value::Held(setting) => (Role::Held, setting),
        };
        let nominal = self.constant(&setting.nominal, wanted, None, diagnostics)?;
        let mut one = |quantity: &Option<Quantity>| match quantity {
            None => Some(None),
            Some(quantity) => self.constant(quantity, wanted, None, diagnostics).map(Some),
        };
        let (min, max) = (one(&setting.min), one(&setting.max));
        let mut positive = |quantity: &Option<Quantity>| match quantity {
            None => Some(None),
            Some(quantity) => self.positive(quantity, wanted, None, diagnostics).map(Some),
        };
        let (sigma, tolerance) = (positive(&setting.sigma), positive(&setting.tolerance));
        let setting_values = Setting {
            roles: vec![role],
            nominal: vec![nominal],
            min: vec![min?.unwrap_or(f64::NEG_INFINITY)],
            max: vec![max?.unwrap_or(f64::INFINITY)],
            sigma: vec![sigma?],
            tolerance: vec![tolerance?.unwrap_or_else(|| self.tolerance(wanted, nominal))],
        };
        self.check_bounds(&setting_values, &[wanted], setting.span, diagnostics).then_some(setting_values)
    }

    fn check_bounds(
        &self,
        setting: &Setting,
        dimensions: &[Dimension],
        span: Span,
        diagnostics: &mut Diagnostics,
    ) -> bool {
        let values = setting.nominal.iter().zip(setting.min.iter().zip(&setting.max));
        for (&dimension, (&nominal, (&min, &max))) in dimensions.iter().zip(values) {
            let shown = |value| self.units.shown(value, dimension);
            let message = if min > max {
                format!("the lower bound {} is above the upper bound {}", shown(min), shown(max))
            } else if nominal < min {
                format!("the nominal value {} is below its lower bound {}", shown(nominal), shown(min))
            } else if nominal > max {
                format!("the nominal value {} is above its upper bound {}", shown(nominal), shown(max))
            } else {
                continue;
            };
            diagnostics.push(Diagnostic::error(Code::BadBounds, message).at(&self.source, span));
            return false;
        }
        true
    }

    /// A free-standing parameter.
    pub(crate) fn parameter(
        &self,
        name: &str,
        declared: &model::Parameter,
        diagnostics: &mut Diagnostics,
    ) -> Option<Parameter> {
        let shape = match declared.shape {
            model::Shape::Scalar => Shape::Scalar,
            model::Shape::Vec3 => Shape::Vec3,
            model::Shape::Rotation => Shape::Rotation,
            model::Shape::Pose => Shape::Pose,
        };
        let unit = match &declared.unit {
            Some(text) => Some(self.unit(text, diagnostics)?),
            None => None,
        };
        let dimensions = match (shape, unit) {
            (Shape::Scalar | Shape::Vec3, Some(unit)) => vec![unit.dimension; shape.dimension()],
            (Shape::Scalar, None) => {
                vec![self.any(declared.value.component(0)?.nominal, diagnostics)?.1]
            }
            (Shape::Vec3, None) => vec![Dimension::LENGTH; 3],
            (Shape::Rotation, _) => vec![Dimension::ANGLE; 3],
            (Shape::Pose, _) => [vec![Dimension::LENGTH; 3], vec![Dimension::ANGLE; 3]].concat(),
        };
        let context = Context { quantities: self, declared, dimensions: &dimensions, unit };
        let setting = context.setting(&declared.value, declared.span, diagnostics)?;
        let mut members = Vec::new();
        for (key, value) in declared.members.iter() {
            members.push((key.value.clone(), context.setting(value, key.span, diagnostics)?));
        }
        Some(Parameter {
            name: name.to_owned(),
            shape,
            dimensions,
            setting,
            family: declared.family,
            members,
            span: declared.span,
        })
    }
}

/// A free-standing parameter whose components are being read.
struct Context<'a> {
    quantities: &'a Quantities,
    declared: &'a model::Parameter,
    dimensions: &'a [Dimension],
    unit: Option<Unit>,
}

impl Context<'_> {
    fn setting(&self, values: &Values, span: Span, diagnostics: &mut Diagnostics) -> Option<Setting> {
        let mut all = Setting::default();
        for (k, &dimension) in self.dimensions.iter().enumerate() {
            self.component(&mut all, values, k, dimension, diagnostics)?;
        }
        self.quantities.check_bounds(&all, self.dimensions, span, diagnostics).then_some(all)
    }

    /// Adds what is said of component `k`: by itself, or else of the whole parameter.
    fn component(
        &self,
        all: &mut Setting,
        values: &Values,
        k: usize,
        dimension: Dimension,
        diagnostics: &mut Diagnostics,
    ) -> Option<()> {
        let (own, outer) = (values.component(k)?, self.declared);
        // of a pose, sigma and tolerance speak of the translation, sigma_angle and tolerance_angle of the rotation
        let (sigma, tolerance, part) = match k {
            0..3 => (&outer.sigma, &outer.tolerance, k),
            _ => (&outer.sigma_angle, &outer.tolerance_angle, k - 3),
        };
        let bare = self.unit.filter(|unit| unit.dimension == dimension);
        let mut read = |own: Option<&Quantity>, outer: &Option<Components>, k: usize, positive: bool| {
            let quantity = own.or_else(|| outer.as_ref()?.at(k));
            let Some(quantity) = quantity else { return Some(None) };
            if positive {
                self.quantities.positive(quantity, dimension, bare, diagnostics).map(Some)
            } else {
                self.quantities.constant(quantity, dimension, bare, diagnostics).map(Some)
            }
        };
        let nominal = read(Some(own.nominal), &None, k, false);
        let (min, max) = (read(own.min, &outer.min, k, false), read(own.max, &outer.max, k, false));
        let (sigma, tolerance) = (read(own.sigma, sigma, part, true), read(own.tolerance, tolerance, part, true));
        let nominal = nominal??;
        all.roles.push(if own.free { Role::Free } else { Role::Held });
        all.nominal.push(nominal);
        all.min.push(min?.unwrap_or(f64::NEG_INFINITY));
        all.max.push(max?.unwrap_or(f64::INFINITY));
        all.sigma.push(sigma?);
        all.tolerance.push(tolerance?.unwrap_or_else(|| self.quantities.tolerance(dimension, nominal)));
        Some(())
    }
}
