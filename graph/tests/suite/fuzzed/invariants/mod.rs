//! What holds of the plan of every frame that is accepted, computed anew and slowly, with nothing of the planner's.

use lightloom_graph::{Declaration, Origin, PassOrder, Plan, PlanOptions, Sharing, SlotKind, Write, plan, to_dot, to_json};
use std::collections::BTreeSet;

/// Plans a frame in every way and checks each plan; whether it could be planned, which is so in every way or in none.
pub(crate) fn check(declaration: &Declaration) -> bool {
    let mut accepted = BTreeSet::new();
    for sharing in [Sharing::Off, Sharing::Exact, Sharing::Merged, Sharing::Placed] {
        for order in [PassOrder::Recorded, PassOrder::Memory] {
            let options = PlanOptions::default().sharing(sharing).order(order);
            let planned = plan(declaration, &options);
            accepted.insert(planned.is_ok());
            if let Ok(planned) = planned {
                check_plan(declaration, &planned, options);
            }
        }
    }
    assert_eq!(accepted.len(), 1, "whether a frame can be planned depends on the frame alone");
    accepted.contains(&true)
}

fn check_plan(declaration: &Declaration, plan: &Plan, options: PlanOptions) {
    runs_or_is_culled(declaration, plan);
    only_the_dead_are_culled(declaration, plan);
    in_order(declaration, plan);
    alive(declaration, plan);
    apart(declaration, plan, options);
    assert_eq!(*plan, lightloom_graph::plan(declaration, &options).unwrap(), "planning is deterministic");
    assert!(to_dot(declaration, plan).ends_with("}\n"), "it can be drawn");
    assert!(to_json(declaration, plan).is_object(), "and written");
}

fn runs_or_is_culled(declaration: &Declaration, plan: &Plan) {
    let passes: BTreeSet<usize> = plan.order.iter().copied().chain(plan.culled.iter().map(|culled| culled.index)).collect();
    assert!(passes.into_iter().eq(0..declaration.passes.len()), "every pass runs or is culled");
    assert_eq!(plan.order.len() + plan.culled.len(), declaration.passes.len(), "and only once");
    let covered: Vec<usize> = plan.steps.iter().flat_map(Clone::clone).collect();
    assert!(covered.into_iter().eq(0..plan.order.len()), "steps cover the order");
    assert!(plan.steps.iter().all(|step| !step.is_empty()), "no step is empty");
    assert!(plan.culled.iter().all(|culled| !culled.reason.is_empty()), "every culled pass has its reason");
}

/// A pass runs if its effect outlives the frame, or if a pass that runs sees what it wrote.
fn only_the_dead_are_culled(declaration: &Declaration, plan: &Plan) {
    let passes = &declaration.passes;
    if passes.iter().flat_map(|pass| &pass.accesses).any(|access| !access.part.is_all()) {
        return;
    }
    let mut live = vec![false; passes.len()];
    for index in (0..passes.len()).rev() {
        let outlives = |resource: usize| {
            let resource = &declaration.resources[resource];
            resource.keep || !matches!(resource.origin, Origin::Transient | Origin::Previous)
        };
        // Later passes that run see it, up to the first that overwrites it.
        let seen = |resource: usize| {
            let later = (index + 1..passes.len()).flat_map(|pass| {
                passes[pass].accesses.iter().filter(|access| access.resource == resource).map(move |access| (pass, access))
            });
            for (pass, access) in later {
                if live[pass] && (access.read || access.write != Write::Overwrite) {
                    return true;
                }
                if access.write == Write::Overwrite {
                    return false;
                }
            }
            false
        };
        let writes = || passes[index].accesses.iter().filter(|access| access.writes()).map(|access| access.resource);
        live[index] = passes[index].side_effect || writes().any(outlives) || writes().any(seen);
    }
    for culled in &plan.culled {
        assert!(!live[culled.index], "pass {} is needed, and culled: {}", culled.index, culled.reason);
    }
    for &pass in &plan.order {
        assert!(live[pass], "pass {pass} runs, and nothing needs it");
    }
}

/// Passes that cannot be exchanged are not.
fn in_order(declaration: &Declaration, plan: &Plan) {
    for (position, &later) in plan.order.iter().enumerate() {
        for &earlier in &plan.order[..position] {
            if earlier < later {
                continue;
            }
            // `earlier` runs first and was recorded last.
            let [a, b] = [earlier, later].map(|pass| &declaration.passes[pass]);
            assert!(!(a.pinned && b.pinned), "passes {later} and {earlier} are pinned");
            let conflict = a.accesses.iter().any(|x| {
                b.accesses.iter().any(|y| {
                    let same_part = x.part == y.part || x.part.is_all() || y.part.is_all();
                    x.resource == y.resource && same_part && (x.writes() || y.writes())
                })
            });
            assert!(!conflict, "pass {later} must run before pass {earlier}: {:?}", plan.order);
        }
    }
}

/// A resource is in use from the first step that uses it to the last, or to the end if it is kept.
fn alive(declaration: &Declaration, plan: &Plan) {
    let mut used: Vec<Option<(usize, usize)>> = vec![None; declaration.resources.len()];
    for step in &plan.steps {
        for access in plan.order[step.clone()].iter().flat_map(|&pass| &declaration.passes[pass].accesses) {
            let (first, _) = used[access.resource].unwrap_or((step.start, 0));
            used[access.resource] = Some((first, step.end - 1));
        }
    }
    for (index, used) in used.into_iter().enumerate() {
        let found = plan.lifetimes[index].map(|life| (life.first, life.last));
        let last = plan.order.len().wrapping_sub(1);
        let kept = used.map(|(first, end)| (first, if declaration.resources[index].keep { last } else { end }));
        assert_eq!(found, kept, "the life of resource {index}");
    }
    assert_eq!(plan.live_bytes.len(), plan.order.len(), "bytes at every position");
    assert_eq!(plan.live_bytes.iter().max().copied().unwrap_or(0), plan.memory.ordered_peak_live_bytes, "the peak is the most");
}

/// No two resources lie in one place at one time.
fn apart(declaration: &Declaration, plan: &Plan, options: PlanOptions) {
    let wanted =
        |resource: usize| declaration.resources[resource].origin == Origin::Transient && plan.lifetimes[resource].is_some();
    for resource in 0..declaration.resources.len() {
        assert_eq!(plan.slot_of[resource].is_some(), wanted(resource), "resource {resource} has memory if it needs it");
        assert_eq!(plan.offsets[resource].is_some(), wanted(resource), "and an offset");
    }
    for (index, slot) in plan.slots.iter().enumerate() {
        let members: BTreeSet<usize> = (0..declaration.resources.len()).filter(|&r| plan.slot_of[r] == Some(index)).collect();
        assert_eq!(members, slot.resources.iter().copied().collect(), "a slot lists what lies in it");
        // A frame of more bytes than a number holds cannot run; its plan says only that it is too large.
        if slot.bytes == u64::MAX {
            continue;
        }
        let place = |resource: usize| {
            let start = plan.offsets[resource].unwrap();
            start..start.checked_add(declaration.resources[resource].bytes).expect("it ends within the slot")
        };
        for &a in &members {
            assert!(place(a).end <= slot.bytes, "resource {a} lies inside its slot");
            for &b in members.range(..a) {
                let [x, y] = [a, b].map(|resource| plan.lifetimes[resource].unwrap());
                let meet = x.first <= y.last && y.first <= x.last;
                let touch = place(a).start < place(b).end && place(b).start < place(a).end;
                assert!(!(meet && (touch || slot.kind == SlotKind::Object)), "resources {a} and {b} overlap");
            }
        }
    }
    let memory = plan.memory;
    let slots = plan.slots.iter().fold(0_u64, |sum, slot| sum.saturating_add(slot.bytes));
    assert_eq!(slots, memory.allocated_bytes, "what the slots take");
    assert!(memory.ordered_peak_live_bytes <= memory.allocated_bytes, "less than the lower bound: {memory:?}");
    assert!(options.sharing != Sharing::Off || memory.allocated_bytes == memory.unshared_bytes, "{memory:?}");
}
