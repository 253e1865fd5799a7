//! Like steps together, so that what a step does is looked up once for many; and sums that share factors as one step, so that
//! these are loaded once.

use std::collections::BTreeMap;

use super::schedule::{Action, Addend, MOST_OPERANDS, MOST_SUMS, Place, Step};

/// How far ahead like steps are looked for. Further ahead there are more of them, and more sums share factors, but numbers wait
/// longer in their slots: on the flagship 256 takes about a fiftieth less time than 96 or 400.
const WINDOW: usize = 256;

/// The same steps in an order in which each still comes after all that it needs.
pub(super) fn like(steps: &[Step]) -> Vec<Step> {
    let number = |place: &Place| match place {
        Place::Slot(slot) => Some(2 * *slot as usize),
        Place::Output(output) => Some(2 * *output as usize + 1),
        Place::Uniform(_) => None,
    };
    let most = steps.iter().flat_map(|step| step.operands.iter().chain(&step.results)).filter_map(number).max();
    let mut made = vec![usize::MAX; most.map_or(0, |most| most + 1)];
    for (at, step) in steps.iter().enumerate() {
        step.results.iter().filter_map(number).for_each(|place| made[place] = at);
    }
    let needs: Vec<Vec<usize>> = steps
        .iter()
        .map(|step| {
            let mut needs: Vec<usize> = step.operands.iter().filter_map(number).map(|place| made[place]).collect();
            needs.retain(|&at| at != usize::MAX);
            needs.sort_unstable();
            needs.dedup();
            needs
        })
        .collect();
    let mut done = vec![false; steps.len()];
    let mut ordered: Vec<Step> = Vec::with_capacity(steps.len());
    let mut first = 0;
    while first < steps.len() {
        let window = first..steps.len().min(first + WINDOW);
        let ready: Vec<usize> =
            window.filter(|&at| !done[at] && needs[at].iter().all(|&needed| done[needed])).collect();
        let count = |wanted: usize| ready.iter().filter(|&&at| steps[at].kind() == steps[wanted].kind()).count();
        // the first open step is always ready; of the kinds that are ready the largest goes first
        let Some(&best) = ready.iter().rev().max_by_key(|&&at| count(at)) else { break };
        let mut batch = Vec::new();
        for &at in ready.iter().filter(|&&at| steps[at].kind() == steps[best].kind()) {
            done[at] = true;
            batch.push(steps[at]);
        }
        ordered.extend(joined(batch));
        while first < steps.len() && done[first] {
            first += 1;
        }
    }
    ordered
}

/// Sums of one kind, none of which needs another, with those joined that share a factor of every product.
fn joined(mut batch: Vec<Step>) -> Vec<Step> {
    let Some(&Step { action: Action::Sum { uniform, positive, negative, addend, .. }, .. }) = batch.first() else {
        return batch;
    };
    if addend == Addend::Uniform {
        return batch;
    }
    let products = usize::from(uniform + positive + negative);
    let ends = [uniform, uniform + positive].map(usize::from);
    let mut joined = Vec::new();
    loop {
        let mut sharing: BTreeMap<Vec<Place>, Vec<usize>> = BTreeMap::new();
        for (at, step) in batch.iter().enumerate() {
            for choice in choices(step, ends, products) {
                let key: Vec<Place> = choice.iter().map(|(shared, _)| *shared).collect();
                let list = sharing.entry(key).or_default();
                if list.last() != Some(&at) {
                    list.push(at);
                }
            }
        }
        let most = sharing.iter().rev().max_by_key(|(_, list)| list.len().min(MOST_SUMS));
        let Some((key, list)) = most.filter(|(_, list)| list.len() > 1) else { break };
        let list: Vec<usize> = list.iter().copied().take(MOST_SUMS).collect();
        let mut operands = key.clone();
        for &at in &list {
            let choice = choices(&batch[at], ends, products)
                .into_iter()
                .find(|choice| choice.iter().map(|(shared, _)| shared).eq(key));
            operands.extend(choice.into_iter().flatten().map(|(_, own)| own));
            operands.extend((addend == Addend::PerRow).then_some(batch[at].operands[2 * products]));
        }
        let mut step = Step {
            action: Action::Sum { uniform, positive, negative, addend, sums: list.len() as u8 },
            operands: [operands[0]; MOST_OPERANDS],
            results: [batch[list[0]].results[0]; MOST_SUMS],
        };
        step.operands[..operands.len()].copy_from_slice(&operands);
        for (result, &at) in step.results.iter_mut().zip(&list) {
            *result = batch[at].results[0];
        }
        joined.push(step);
        let mut at = 0;
        batch.retain(|_| {
            at += 1;
            !list.contains(&(at - 1))
        });
    }
    joined.sort_by_key(|step| std::cmp::Reverse(step.action));
    joined.extend(batch);
    joined
}

/// All ways to choose a factor of every product as the shared one, with the other beside it; a uniform is never shared. Products
/// of one sort are in the order of the chosen factors, since their order does not matter; `ends` says where the first two
/// sorts end.
fn choices(step: &Step, ends: [usize; 2], products: usize) -> Vec<Vec<(Place, Place)>> {
    (0..1usize << (products - ends[0]))
        .map(|bits| {
            let pair = |k: usize| {
                let (b, a) = (step.operands[k], step.operands[products + k]);
                if k < ends[0] || bits >> (k - ends[0]) & 1 == 0 { (b, a) } else { (a, b) }
            };
            let mut choice: Vec<(Place, Place)> = (0..products).map(pair).collect();
            choice[..ends[0]].sort_unstable();
            choice[ends[0]..ends[1]].sort_unstable();
            choice[ends[1]..].sort_unstable();
            choice
        })
        .collect()
}
