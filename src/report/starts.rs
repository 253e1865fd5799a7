//! How many starts agreed, and how far a continuation came, as text.

use std::fmt::Write;

use super::count;
use super::number::significant;
use crate::fit::{Fit, Minimum, Starts};

/// Other minima, and parameters of each, that are shown.
const MOST_MINIMA: usize = 5;
const MOST_PARAMETERS: usize = 6;

/// Lines of the report; nothing where neither was asked for.
pub(super) fn text(fit: &Fit) -> String {
    let mut out = String::new();
    if let Some(starts) = &fit.starts {
        let _ = writeln!(out, "  {}", sentence(starts));
        if !starts.not_varied.is_empty() {
            let named: Vec<&str> = starts.not_varied.iter().take(MOST_PARAMETERS).map(String::as_str).collect();
            let more = starts.not_varied.len() - named.len();
            let more = if more > 0 { format!(" and {more} more") } else { String::new() };
            let _ = writeln!(out, "  the same in all starts, without bounds or prior: {}{more}", named.join(", "));
        }
    }
    if let Some(told) = fit.continuation {
        let way = match told.reached {
            1.0 => "to the end".to_owned(),
            part => format!("for {} % of the way", significant(100.0 * part, 3)),
        };
        let _ = writeln!(out, "  continuation followed {way} in {}", count(told.steps, "step", "steps"));
    }
    out
}

/// `8 of 10 starts agree; 1 ended in another minimum, of cost 12.3; 1 did not converge`
fn sentence(starts: &Starts) -> String {
    let verb = if starts.agreed == 1 { "agrees" } else { "agree" };
    let mut parts = vec![match (starts.agreed, starts.total) {
        (1, 1) => "1 start".to_owned(),
        (1, total) => format!("1 of {total} starts leads to this minimum, and no other"),
        (agreed, total) => format!("{agreed} of {total} starts {verb}"),
    }];
    let others = starts.minima.get(1..).unwrap_or_default();
    let (shown, more): (&[Minimum], _) = others.split_at(others.len().min(MOST_MINIMA));
    for minimum in shown {
        let good = if minimum.as_good { " which is as good" } else { "" };
        let cost = significant(minimum.cost, 6);
        let at: Vec<String> = minimum
            .at
            .iter()
            .take(MOST_PARAMETERS)
            .map(|(name, value)| format!("{name} {}", significant(*value, 6)))
            .collect();
        let more = if minimum.at.len() > at.len() { ", …" } else { "" };
        parts.push(format!(
            "{} ended in another minimum{good}, of cost {cost} ({}{more})",
            minimum.count,
            at.join(", ")
        ));
    }
    let rest: usize = more.iter().map(|minimum| minimum.count).sum();
    if rest > 0 {
        parts.push(format!("{rest} in {} more", more.len()));
    }
    let unsettled = starts.failed().saturating_sub(starts.undefined);
    if unsettled > 0 {
        parts.push(format!("{unsettled} did not converge"));
    }
    if starts.undefined > 0 {
        parts.push(format!("{} could not begin", starts.undefined));
    }
    parts.join("; ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sentence_says_where_all_starts_went() {
        let minimum = |cost, count, as_good| Minimum {
            cost,
            count,
            as_good,
            at: vec![("p.y".into(), -3.0)],
            ..Minimum::default()
        };
        let starts = Starts {
            total: 10,
            converged: 8,
            undefined: 1,
            agreed: 5,
            not_varied: vec![],
            minima: vec![minimum(1.0, 5, true), minimum(1.0, 2, true), minimum(7.0, 1, false)],
        };
        assert_eq!(
            sentence(&starts),
            "5 of 10 starts agree; 2 ended in another minimum which is as good, of cost 1 (p.y -3); \
             1 ended in another minimum, of cost 7 (p.y -3); 1 did not converge; 1 could not begin"
        );
    }
}
