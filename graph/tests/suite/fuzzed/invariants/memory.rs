//! Where transient resources lie.

use super::held;
use lightloom_graph::{Declaration, Need, Origin, PassKind, Plan, PlanOptions, Sharing, SlotKind};
use std::collections::BTreeSet;

/// No two resources lie in one place at one time, and each lies where it can be used.
pub(super) fn apart(declaration: &Declaration, plan: &Plan, options: PlanOptions, need: &dyn Fn(usize) -> Need) {
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
            let bytes = if slot.kind == SlotKind::Heap { need(resource).bytes } else { declaration.resources[resource].bytes };
            start..start.checked_add(bytes).expect("it ends within the slot")
        };
        let align = |resource: usize| match slot.kind {
            SlotKind::Heap => need(resource).align,
            // What any device asks of the offset of a binding.
            _ => 256,
        };
        for &a in &members {
            assert!(place(a).end <= slot.bytes, "resource {a} lies inside its slot");
            assert!(place(a).start.is_multiple_of(align(a)), "resource {a} lies at a multiple of {}", align(a));
            assert!(slot.kind != SlotKind::Object || place(a).start == 0, "objects have no offsets");
            for &b in members.range(..a) {
                let [x, y] = [a, b].map(|resource| plan.lifetimes[resource].unwrap());
                let meet = x.first <= y.last && y.first <= x.last;
                let touch = place(a).start < place(b).end && place(b).start < place(a).end;
                assert!(!(meet && (touch || slot.kind == SlotKind::Object)), "resources {a} and {b} overlap");
                let classes = [a, b].map(|resource| need(resource).class);
                assert!(slot.kind != SlotKind::Heap || classes[0] == classes[1], "resources {a} and {b} need different heaps");
            }
        }
    }
    let memory = plan.memory;
    let slots = plan.slots.iter().fold(0_u64, |sum, slot| sum.saturating_add(slot.bytes));
    assert_eq!(slots, memory.allocated_bytes, "what the slots take");
    assert!(memory.ordered_peak_live_bytes <= memory.allocated_bytes, "less than the lower bound: {memory:?}");
    assert!(options.sharing != Sharing::Off || memory.allocated_bytes == memory.unshared_bytes, "{memory:?}");
}

/// An arena is one wgpu buffer, which a step either reads or writes; closures are handed whole buffers.
pub(super) fn arenas(declaration: &Declaration, plan: &Plan) {
    let arena = |resource: usize| plan.slot_of[resource].filter(|&slot| plan.slots[slot].kind == SlotKind::Arena);
    for step in &plan.steps {
        let (mut read, mut written) = (BTreeSet::new(), BTreeSet::new());
        for pass in plan.order[step.clone()].iter().map(|&pass| &declaration.passes[pass]) {
            for access in &pass.accesses {
                let Some(arena) = arena(access.resource) else { continue };
                assert!(pass.kind != PassKind::Closure, "`{}` uses part of an arena", pass.name);
                if access.writes() || held(access) { &mut written } else { &mut read }.insert(arena);
            }
        }
        assert!(read.is_disjoint(&written), "positions {step:?} read and write one arena: {:?}", plan.slots);
    }
}
