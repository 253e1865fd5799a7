//! Variance components: declared standard deviations, multiplied group by group.

use super::Problem;
use super::bind::weighting;
use super::noise::Factors;

impl<'p> Problem<'p> {
    /// The same rows with the standard deviations of groups of errors multiplied.
    pub fn with_factors(&self, factors: &Factors) -> Problem<'p> {
        let mut other = self.clone();
        other.blocks = self
            .blocks
            .iter()
            .map(|block| {
                let mut anew = block.anew();
                let made = weighting(self.program, block.measurement, self.weights, block.robust, factors);
                (anew.weights, anew.noise) = (made.weights, made.noise);
                anew
            })
            .collect();
        other
    }
}
