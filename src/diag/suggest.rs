//! "Did you mean": the known name nearest to one that is not known.

/// The candidate nearest to `found`, if any is near enough to be meant.
///
/// Near means at most a third of the characters differ (a swap of neighbours counts once), or only the case does.
#[must_use]
pub fn nearest<'a>(found: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let allowed = (found.chars().count() / 3).max(1);
    let lower = found.to_lowercase();
    candidates
        .into_iter()
        .map(|candidate| {
            let distance = if candidate.to_lowercase() == lower { 0 } else { strsim::osa_distance(found, candidate) };
            (distance, candidate)
        })
        .filter(|&(distance, candidate)| distance <= allowed && distance < candidate.chars().count().max(1))
        .min_by_key(|&(distance, _)| distance)
        .map(|(_, candidate)| candidate)
}

/// A hint: the nearest of the candidates, or else all of them where they are few.
#[must_use]
pub fn did_you_mean(found: &str, kind: &str, candidates: &[&str]) -> Option<String> {
    const FEW: usize = 20;
    if let Some(near) = nearest(found, candidates.iter().copied()) {
        return Some(format!("did you mean `{near}`? {}", list(kind, candidates)));
    }
    (!candidates.is_empty() && candidates.len() <= FEW).then(|| list(kind, candidates))
}

fn list(kind: &str, candidates: &[&str]) -> String {
    let names: Vec<String> = candidates.iter().map(|name| format!("`{name}`")).collect();
    format!("{kind}: {}", names.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn near_names_are_suggested_and_far_ones_are_not() {
        let names = ["Revolute", "Prismatic", "Fixed"];
        assert_eq!(nearest("Revolut", names), Some("Revolute"));
        assert_eq!(nearest("FIXED", names), Some("Fixed"));
        assert_eq!(nearest("Screw", names), None);
        assert_eq!(nearest("x", ["y"]), None);
        assert_eq!(nearest("", ["y"]), None);
    }

    #[test]
    fn the_hint_lists_what_is_legal() {
        let hint = did_you_mean("alhpa", "fields", &["a", "alpha"]).unwrap();
        assert_eq!(hint, "did you mean `alpha`? fields: `a`, `alpha`");
        assert_eq!(did_you_mean("q", "fields", &[]), None);
    }
}
