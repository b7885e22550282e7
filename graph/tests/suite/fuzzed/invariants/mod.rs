//! What holds of the plan of every frame that is accepted, computed anew and slowly, with nothing of the planner's.

mod contents;
mod memory;
mod points;
mod steps;

use lightloom_graph::{
    Access, Declaration, Need, Origin, PassOrder, Plan, PlanOptions, Sharing, Write, plan, plan_with_needs, to_dot, to_json,
};
use points::{Points, overlap};
use std::collections::{BTreeMap, BTreeSet};

/// The name of variables that WGSL may write and the shader only reads. wgpu takes that for a write, and a declaration does not
/// show it.
pub(super) const HELD: &str = "held";

fn held(access: &Access) -> bool {
    *access.binding == *HELD
}

fn outlives_frame(origin: Origin) -> bool {
    !matches!(origin, Origin::Transient | Origin::Previous)
}

/// Plans a frame in every way and checks each plan. The default plan, if the frame can be planned, which is so in every way or
/// in none.
pub(crate) fn check(declaration: &Declaration) -> Option<Plan> {
    let mut accepted = BTreeSet::new();
    for sharing in [Sharing::Off, Sharing::Exact, Sharing::Merged, Sharing::Placed] {
        for (order, for_a_device) in [(PassOrder::Recorded, false), (PassOrder::Memory, false), (PassOrder::Memory, true)] {
            let mut options = PlanOptions::default().sharing(sharing).order(order);
            (options.transient_attachments, options.only_own_bytes) = (for_a_device, for_a_device);
            let need = |resource: usize| need(declaration, resource, for_a_device);
            let plan_it = || plan_with_needs(declaration, &options, &|resource, _| need(resource));
            let planned = plan_it();
            accepted.insert(planned.is_ok());
            if let Ok(planned) = planned {
                check_plan(declaration, &planned, options, &need);
                assert_eq!(planned, plan_it().unwrap(), "planning is deterministic");
                let plain = for_a_device || planned == plan(declaration, &options).unwrap();
                assert!(plain, "without a device, resources need their bytes");
            }
        }
    }
    assert_eq!(accepted.len(), 1, "whether a frame can be planned depends on the frame alone");
    plan(declaration, &PlanOptions::default()).ok()
}

/// What a resource needs of shared memory; on a device, more and other than its bytes.
fn need(declaration: &Declaration, resource: usize, on_a_device: bool) -> Need {
    let bytes = declaration.resources[resource].bytes;
    if on_a_device {
        let padded = bytes.checked_next_multiple_of(64).unwrap_or(bytes);
        Need { bytes: padded, align: [64, 1024, 65536][resource % 3], class: resource as u32 % 2 }
    } else {
        Need { bytes, align: 256, class: 0 }
    }
}

fn check_plan(declaration: &Declaration, plan: &Plan, options: PlanOptions, need: &dyn Fn(usize) -> Need) {
    let points = Points::new(declaration);
    runs_or_is_culled(declaration, plan);
    only_the_dead_are_culled(declaration, plan, &points);
    in_order(declaration, plan);
    steps::may_share_a_render_pass(declaration, plan);
    alive(declaration, plan);
    memory::apart(declaration, plan, options, need);
    memory::arenas(declaration, plan);
    contents::are_as_recorded(declaration, plan, &points, |resource| need(resource).bytes);
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

/// A pass runs if its effect outlives the frame, or if a pass that runs sees some of what it wrote.
fn only_the_dead_are_culled(declaration: &Declaration, plan: &Plan, points: &Points<'_>) {
    let passes = &declaration.passes;
    let mut live = vec![false; passes.len()];
    // Of each point that a pass uses later: whether one that runs sees what is there now.
    let mut seen: BTreeMap<points::Point, bool> = BTreeMap::new();
    for (index, pass) in passes.iter().enumerate().rev() {
        let writes = || pass.accesses.iter().filter(|access| access.writes());
        let outlives = |access: &Access| {
            let resource = &declaration.resources[access.resource];
            resource.keep || outlives_frame(resource.origin)
        };
        let needed = writes().flat_map(|access| points.of(access)).any(|point| seen.get(&point) == Some(&true));
        live[index] = pass.side_effect || writes().any(outlives) || needed;
        for access in pass.accesses.iter().filter(|access| access.write == Write::Overwrite) {
            seen.extend(points.of(access).map(|point| (point, false)));
        }
        for access in pass.accesses.iter().filter(|access| access.read || access.write == Write::Keep) {
            points.of(access).for_each(|point| *seen.entry(point).or_default() |= live[index]);
        }
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
            let conflict =
                a.accesses.iter().any(|x| b.accesses.iter().any(|y| (x.writes() || y.writes()) && overlap(declaration, x, y)));
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
