//! Slots that are used again.

use super::schedule::{Place, Step};

/// Gives every result a slot, again as soon as what stood there has had its last use. Slots below `inputs` are kept. Returns
/// how many slots there are.
pub(super) fn assign(steps: &mut [Step], inputs: usize) -> usize {
    let number = |place: &Place| match place {
        Place::Slot(slot) => Some(*slot as usize),
        Place::Uniform(_) | Place::Output(_) => None,
    };
    let all = steps.iter().flat_map(|step| step.operands.iter().chain(&step.results));
    let most = all.filter_map(number).max().map_or(0, |slot| slot + 1).max(inputs);
    let mut last = vec![None; most];
    for (at, step) in steps.iter().enumerate() {
        step.operands.iter().filter_map(number).for_each(|slot| last[slot] = Some(at));
    }
    let mut slot_of: Vec<u32> = (0..most as u32).collect();
    let mut free: Vec<u32> = Vec::new();
    let mut used = inputs as u32;
    for (at, step) in steps.iter_mut().enumerate() {
        let mut ended: Vec<usize> =
            step.operands.iter().filter_map(number).filter(|&slot| slot >= inputs && last[slot] == Some(at)).collect();
        ended.sort_unstable();
        ended.dedup();
        for operand in &mut step.operands {
            if let Place::Slot(slot) = operand {
                *slot = slot_of[*slot as usize];
            }
        }
        // a step reads before it writes, so its result may stand where an operand stood
        free.extend(ended.into_iter().map(|slot| slot_of[slot]));
        let mut unread = Vec::new();
        let known = step.results;
        for k in 0..known.len() {
            let Place::Slot(result) = known[k] else { continue };
            if let Some(same) = (0..k).find(|&earlier| known[earlier] == known[k]) {
                step.results[k] = step.results[same];
                continue;
            }
            let slot = free.pop().unwrap_or_else(|| {
                used += 1;
                used - 1
            });
            slot_of[result as usize] = slot;
            step.results[k] = Place::Slot(slot);
            if last[result as usize].is_none() {
                unread.push(slot);
            }
        }
        // a result that nobody reads
        free.append(&mut unread);
    }
    used as usize
}
