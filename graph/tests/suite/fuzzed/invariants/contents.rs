//! What passes see, by playing the frame.

use super::points::{Point, Points};
use lightloom_graph::{Declaration, Origin, Plan, SlotKind, Write};
use std::collections::BTreeMap;

/// Who wrote what lies where.
#[derive(Default)]
struct Played {
    /// The pass that wrote each point last.
    writer: BTreeMap<Point, usize>,
    /// Per pass and point that it sees: who wrote it.
    seen: BTreeMap<(usize, Point), Option<usize>>,
}

impl Played {
    /// Runs passes in this order. `hit` are the resources whose contents are lost when one is used.
    fn new(points: &Points<'_>, declaration: &Declaration, order: impl Iterator<Item = usize>, hit: &[Vec<usize>]) -> Self {
        let mut played = Self::default();
        for pass in order {
            let accesses = &declaration.passes[pass].accesses;
            for access in accesses.iter().filter(|access| access.read || access.write == Write::Keep) {
                for point in points.of(access) {
                    let writer = played.writer.get(&point).copied();
                    played.seen.insert((pass, point), writer);
                }
            }
            for access in accesses {
                played.writer.retain(|(resource, ..), _| !hit[access.resource].contains(resource));
            }
            for access in accesses.iter().filter(|access| access.writes()) {
                played.writer.extend(points.of(access).map(|point| (point, pass)));
            }
        }
        played
    }
}

/// Every pass that runs sees what it would see if all ran as recorded, each resource in memory of its own; and so does who comes
/// after the frame.
pub(super) fn are_as_recorded(declaration: &Declaration, plan: &Plan, points: &Points<'_>, bytes: impl Fn(usize) -> u64) {
    let resources = declaration.resources.len();
    let recorded = Played::new(points, declaration, 0..declaration.passes.len(), &vec![Vec::new(); resources]);
    let range = |resource: usize| {
        let start = plan.offsets[resource].unwrap_or(0);
        start..start.saturating_add(bytes(resource))
    };
    let shares = |a: usize, b: usize| {
        let slot = plan.slot_of[a].filter(|slot| a != b && plan.slot_of[b] == Some(*slot));
        let touch = range(a).start < range(b).end && range(b).start < range(a).end;
        slot.is_some_and(|slot| touch || plan.slots[slot].kind == SlotKind::Object)
    };
    let hit: Vec<Vec<usize>> = (0..resources).map(|used| (0..resources).filter(|&other| shares(used, other)).collect()).collect();
    let played = Played::new(points, declaration, plan.order.iter().copied(), &hit);
    for (&(pass, point), writer) in &played.seen {
        assert_eq!(*writer, recorded.seen[&(pass, point)], "who wrote {point:?}, which pass {pass} sees: {:?}", plan.order);
    }
    for &pass in &plan.order {
        let own = |resource: usize| matches!(declaration.resources[resource].origin, Origin::Transient | Origin::Current);
        let reads = declaration.passes[pass].accesses.iter().filter(|access| access.read && own(access.resource));
        for point in reads.flat_map(|access| points.of(access)) {
            assert!(played.seen[&(pass, point)].is_some(), "pass {pass} reads {point:?}, which nothing wrote");
        }
    }
    let outlives = |resource: usize| {
        let decl = &declaration.resources[resource];
        decl.keep || super::outlives_frame(decl.origin)
    };
    for (point, writer) in recorded.writer.iter().filter(|((resource, ..), _)| outlives(*resource)) {
        assert_eq!(played.writer.get(point), Some(writer), "who wrote {point:?} last: {:?}", plan.order);
    }
}
