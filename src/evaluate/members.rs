//! Family members that nothing has told yet: estimated alone, while everything else stays at its value.

use std::collections::HashSet;

use crate::compile::Role;
use crate::fit::{Fit, Tested, analyse_with};
use crate::problem::{Problem, Undefined};
use crate::solve::{Solver, StartError, Suited};

/// The values to evaluate at, and the fit of the members estimated for it.
#[derive(Clone, Debug)]
pub struct Members {
    /// The value of every coordinate.
    pub point: Vec<f64>,
    /// The fit of those alone, where there are any.
    pub fit: Option<Fit>,
}

/// The free coordinates of family members that are not among the given names.
pub fn unseen(problem: &Problem, given: &[(String, f64)]) -> Vec<usize> {
    let given: HashSet<&str> = given.iter().map(|(name, _)| name.as_str()).collect();
    let layout = &problem.layout;
    let all = layout.coordinates.iter().enumerate();
    all.filter(|(_, coordinate)| {
        layout.groups[coordinate.group].member.is_some()
            && coordinate.role == Role::Free
            && !given.contains(coordinate.name.as_str())
    })
    .map(|(c, _)| c)
    .collect()
}

impl Members {
    /// Everything at the point, which is the nominal one where nothing is given.
    pub fn known(point: Vec<f64>) -> Self {
        Members { point, fit: None }
    }

    /// Estimates some coordinates from where they are, with the weights of the problem; all others are held at the point.
    ///
    /// # Errors
    /// Where the search cannot start, or a derivative at the end is undefined.
    pub fn estimate(
        problem: &Problem,
        point: Vec<f64>,
        coordinates: Vec<usize>,
    ) -> Result<Members, StartError<Undefined>> {
        let alone = problem.with_free(coordinates);
        let solution = Suited::default().solve(&alone, point)?;
        let fit = analyse_with(&alone, solution, Tested::None).map_err(StartError::Undefined)?;
        Ok(Members { point: fit.point.clone(), fit: Some(fit) })
    }
}
