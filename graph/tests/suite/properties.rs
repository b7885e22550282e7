//! What holds of the plan of any frame; no device.

use lightloom_graph::{
    Declaration, Need, Origin, PassKind, PassOrder, Plan, PlanOptions, ResourceKind, Sharing, Slot, SlotKind, plan,
    plan_with_needs,
};
use proptest::{
    collection::vec,
    prelude::{Strategy, any},
    test_runner::{Config, TestCaseError, TestRunner},
};
use serde_json::{Value, json};
use std::collections::BTreeSet;

const SHARINGS: [Sharing; 4] = [Sharing::Off, Sharing::Exact, Sharing::Merged, Sharing::Placed];
const ORDERS: [PassOrder; 2] = [PassOrder::Recorded, PassOrder::Memory];

/// What a resource is: bytes of a buffer, or size, mips and layers of a texture.
#[derive(Clone, Copy, Debug)]
enum Shape {
    Buffer(u64),
    Texture(u32, u32, u32),
}

/// What a pass does. It reads some of the latest results and writes one more, or one of them again.
#[derive(Clone, Debug)]
#[expect(clippy::struct_excessive_bools, reason = "each is drawn apart from the others")]
struct Step {
    reads: Vec<usize>,
    again: Option<(usize, bool)>,
    shape: Shape,
    out: bool,
    pinned: bool,
    closure: bool,
    keep: bool,
}

fn steps() -> impl Strategy<Value = Vec<Step>> {
    let buffer = (0_u64..5000).prop_map(Shape::Buffer);
    let texture = (0_u32..2, 1_u32..4, 1_u32..3).prop_map(|(size, mips, layers)| Shape::Texture(64 << size, mips, layers));
    let shape = proptest::prop_oneof![buffer, texture];
    let again = proptest::option::weighted(0.2, (0_usize..12, any::<bool>()));
    let often = |percent: f64| proptest::bool::weighted(percent / 100.0);
    let flags = (often(15.0), often(20.0), often(8.0), often(4.0));
    let step = (vec(0_usize..12, 0..4), again, shape, flags)
        .prop_map(|(reads, again, shape, (out, pinned, closure, keep))| Step { reads, again, shape, out, pinned, closure, keep });
    vec(step, 1..40)
}

/// A sound frame of these steps; reads name only what was written.
fn frame(steps: &[Step]) -> Declaration {
    let mut resources = vec![json!({"name": "out", "kind": "buffer", "origin": "imported", "bytes": 4})];
    let mut passes = Vec::new();
    let mut written: Vec<usize> = Vec::new();
    for (index, step) in steps.iter().enumerate() {
        let name = format!("r{index}");
        resources.push(match step.shape {
            Shape::Buffer(bytes) => {
                json!({"name": name, "kind": "buffer", "origin": "transient", "bytes": bytes, "keep": step.keep})
            }
            Shape::Texture(size, mips, layers) => {
                json!({"name": name, "kind": "texture", "origin": "transient", "keep": step.keep,
                "format": "rgba8unorm", "size": [size, 64, layers], "mips": mips})
            }
        });
        let recent = |back: usize| written.get(written.len().wrapping_sub(back + 1)).copied();
        let (target, preserve) =
            step.again.and_then(|(back, preserve)| recent(back).map(|target| (target, preserve))).unwrap_or((index, false));
        let reads: BTreeSet<usize> = step.reads.iter().filter_map(|&back| recent(back)).filter(|&read| read != target).collect();
        let mut writes = vec![json!({"resource": format!("r{target}"), "preserve": preserve})];
        if step.out || index + 1 == steps.len() {
            writes.push(json!({"resource": "out", "preserve": true}));
        }
        let reads: Vec<Value> = reads.iter().map(|read| format!("r{read}").into()).collect();
        let kind = if step.closure { "closure" } else { "compute" };
        passes.push(json!({"name": format!("p{index}"), "kind": kind, "reads": reads, "writes": writes}));
        written.push(target);
    }
    let json = json!({"frame": "random", "resources": resources, "passes": passes});
    let mut declaration = Declaration::from_frame_json(&json.to_string()).unwrap();
    for (pass, step) in declaration.passes.iter_mut().zip(steps) {
        pass.pinned = step.pinned;
    }
    declaration
}

/// Runs `test` on many frames, and shrinks the one on which it panics.
fn for_frames(test: impl Fn(&Declaration)) {
    let config = Config { cases: 192, failure_persistence: None, ..Config::default() };
    TestRunner::new_with_rng(
        config,
        proptest::test_runner::TestRng::deterministic_rng(proptest::test_runner::RngAlgorithm::ChaCha),
    )
    .run(&steps(), |steps| {
        test(&frame(&steps));
        Ok::<(), TestCaseError>(())
    })
    .unwrap();
}

/// The plan of every combination of options.
fn for_plans(test: impl Fn(&Declaration, &Plan, PlanOptions)) {
    for_frames(|declaration| {
        for options in
            SHARINGS.iter().flat_map(|&sharing| ORDERS.map(|order| PlanOptions::default().sharing(sharing).order(order)))
        {
            test(declaration, &plan(declaration, &options).unwrap(), options);
        }
    });
}

/// Transient resources in use, by slot.
fn slots(plan: &Plan) -> impl Iterator<Item = (&Slot, Vec<usize>)> {
    plan.slots.iter().enumerate().map(|(index, slot)| {
        let members: Vec<usize> = (0..plan.slot_of.len()).filter(|&resource| plan.slot_of[resource] == Some(index)).collect();
        (slot, members)
    })
}

#[test]
fn placements_never_overlap_in_time_and_space() {
    for_plans(|declaration, plan, options| {
        for (resource, decl) in declaration.resources.iter().enumerate() {
            let wanted = decl.origin == Origin::Transient && plan.lifetimes[resource].is_some();
            assert_eq!(plan.slot_of[resource].is_some(), wanted, "{} has memory if it is in use: {options:?}", decl.name);
            assert_eq!(plan.offsets[resource].is_some(), wanted, "{}", decl.name);
        }
        for (slot, members) in slots(plan) {
            let listed: BTreeSet<usize> = slot.resources.iter().copied().collect();
            assert_eq!(listed, members.iter().copied().collect(), "a slot lists what lies in it");
            let firsts: Vec<usize> = slot.resources.iter().map(|&r| plan.lifetimes[r].unwrap().first).collect();
            assert!(firsts.is_sorted(), "by time of first use");
            let range = |resource: usize| {
                let start = plan.offsets[resource].unwrap();
                start..start + declaration.resources[resource].bytes
            };
            for (n, &a) in members.iter().enumerate() {
                assert!(range(a).end <= slot.bytes, "r{a} lies inside its slot");
                assert!(slot.kind != SlotKind::Object || range(a).start == 0, "objects have no offsets");
                for &b in &members[..n] {
                    let (x, y) = (plan.lifetimes[a].unwrap(), plan.lifetimes[b].unwrap());
                    let meet = x.first <= y.last && y.first <= x.last;
                    let whole = slot.kind == SlotKind::Object;
                    let touch = whole || (range(a).start < range(b).end && range(b).start < range(a).end);
                    assert!(!(meet && touch), "r{a} and r{b} overlap: {options:?}, {plan:?}");
                }
            }
        }
    });
}

#[test]
fn lifetimes_cover_every_use() {
    for_plans(|declaration, plan, _| {
        let mut covered = Vec::new();
        for step in &plan.steps {
            covered.extend(step.clone());
            for &pass in &plan.order[step.clone()] {
                for access in &declaration.passes[pass].accesses {
                    let life = plan.lifetimes[access.resource].unwrap();
                    assert!(life.first <= step.start && step.end - 1 <= life.last, "whole steps");
                }
            }
        }
        assert!(covered.into_iter().eq(0..plan.order.len()), "steps cover the order");
        for (resource, decl) in declaration.resources.iter().enumerate().filter(|(_, decl)| decl.keep) {
            assert!(plan.lifetimes[resource].is_none_or(|life| life.last == plan.order.len() - 1), "`{}` is kept", decl.name);
        }
    });
}

#[test]
fn the_order_is_topological_and_pinned_passes_keep_theirs() {
    for_plans(|declaration, plan, options| {
        let mut position = vec![None; declaration.passes.len()];
        for (at, &pass) in plan.order.iter().enumerate() {
            assert_eq!(position[pass].replace(at), None, "p{pass} runs once");
        }
        for (b, later) in declaration.passes.iter().enumerate() {
            for (a, earlier) in declaration.passes[..b].iter().enumerate() {
                let (Some(x), Some(y)) = (position[a], position[b]) else { continue };
                let meet = earlier.accesses.iter().any(|one| {
                    later.accesses.iter().any(|other| one.resource == other.resource && (one.writes() || other.writes()))
                });
                assert!(!(meet && x > y), "p{b} must follow p{a}: {:?}", plan.order);
                assert!(!(earlier.pinned && later.pinned && x > y), "p{a} and p{b} are pinned: {:?}", plan.order);
                assert!(options.order == PassOrder::Memory || x < y, "recorded order");
            }
        }
    });
}

#[test]
fn order_saves_memory_and_changes_nothing_else() {
    for_frames(|declaration| {
        let options = PlanOptions::default().sharing(Sharing::Placed);
        let [recorded, ordered] = ORDERS.map(|order| plan(declaration, &options.order(order)).unwrap());
        assert_eq!(recorded.culled, ordered.culled);
        assert_eq!(recorded.memory.peak_live_bytes, recorded.memory.ordered_peak_live_bytes);
        assert_eq!(recorded.memory.peak_live_bytes, ordered.memory.peak_live_bytes);
        let (before, after) = (recorded.memory.peak_live_bytes, ordered.memory.ordered_peak_live_bytes);
        assert!(
            after < before || (after == before && ordered.order == recorded.order),
            "{after} of {before}: {:?}",
            ordered.order
        );
        assert_eq!(ordered, plan(declaration, &options).unwrap(), "planning is deterministic");
    });
}

#[test]
fn objects_that_are_shared_take_less_or_the_order_is_the_recorded_one() {
    for_frames(|declaration| {
        for sharing in [Sharing::Exact, Sharing::Merged] {
            let options = PlanOptions::default().sharing(sharing);
            let [recorded, ordered] = ORDERS.map(|order| plan(declaration, &options.order(order)).unwrap());
            let (before, after) = (recorded.memory.allocated_bytes, ordered.memory.allocated_bytes);
            assert!(
                after < before || (after == before && ordered.order == recorded.order),
                "{sharing:?}: {after} of {before}: {:?}",
                ordered.order
            );
            assert_eq!(ordered, plan(declaration, &options).unwrap(), "planning is deterministic");
            let least = plan(declaration, &options.sharing(Sharing::Placed)).unwrap().memory;
            assert_eq!(ordered.memory.placed_bytes, least.placed_bytes, "by way of placing, whatever is asked for");
            assert_eq!(ordered.memory.pooled_bytes, least.pooled_bytes);
        }
    });
}

#[test]
fn no_step_reads_and_writes_one_arena() {
    for_frames(|declaration| {
        let plan = plan(declaration, &PlanOptions::default()).unwrap();
        for step in &plan.steps {
            let accesses = plan.order[step.clone()].iter().flat_map(|&pass| &declaration.passes[pass].accesses);
            let (mut read, mut written) = (BTreeSet::new(), BTreeSet::new());
            for access in accesses {
                let Some(slot) = plan.slot_of[access.resource] else { continue };
                if plan.slots[slot].kind == SlotKind::Arena {
                    if access.writes() { &mut written } else { &mut read }.insert(slot);
                }
            }
            assert!(read.is_disjoint(&written), "{step:?} of {plan:?}");
        }
        for (slot, members) in slots(&plan).filter(|(slot, _)| slot.kind == SlotKind::Arena) {
            assert!(slot.bytes <= 256 << 20, "arenas are bounded");
            assert!(members.iter().all(|&r| plan.offsets[r].unwrap().is_multiple_of(256)), "ranges can be bound");
            let in_closure = |resource| {
                plan.order
                    .iter()
                    .map(|&pass| &declaration.passes[pass])
                    .any(|pass| pass.kind == PassKind::Closure && pass.accesses.iter().any(|access| access.resource == resource))
            };
            assert!(!members.iter().any(|&resource| in_closure(resource)), "closures are handed whole buffers");
        }
    });
}

#[test]
fn one_description_serves_all_of_an_object() {
    for_frames(|declaration| {
        let merged = plan(declaration, &PlanOptions::default()).unwrap();
        for (slot, members) in slots(&merged).filter(|(slot, _)| slot.kind == SlotKind::Object) {
            let descs: Vec<_> = members.iter().map(|&resource| &declaration.resources[resource].kind).collect();
            let serves = |one: &ResourceKind, other: &ResourceKind| match (one, other) {
                (ResourceKind::Texture(a), ResourceKind::Texture(b)) => {
                    let layers = (a.size[2], b.size[2]);
                    (a.size[0], a.size[1], a.format, a.sample_count) == (b.size[0], b.size[1], b.format, b.sample_count)
                        && layers.0 >= layers.1
                        && a.mip_level_count >= b.mip_level_count
                }
                (ResourceKind::Buffer(a), ResourceKind::Buffer(b)) => a.size.div_ceil(4) == b.size.div_ceil(4),
                _ => false,
            };
            assert!(descs.iter().any(|one| descs.iter().all(|other| serves(one, other))), "{slot:?} of {descs:?}");
        }
        let in_recorded_order =
            |sharing| plan(declaration, &PlanOptions::default().order(PassOrder::Recorded).sharing(sharing)).unwrap();
        let [same, exact] = [Sharing::Merged, Sharing::Exact].map(in_recorded_order);
        let bytes = |plan: &Plan, buffers: bool| -> u64 {
            let of = |slot: &&Slot| matches!(declaration.resources[slot.resources[0]].kind, ResourceKind::Buffer(_)) == buffers;
            plan.slots.iter().filter(of).map(|slot| slot.bytes).sum()
        };
        for buffers in [true, false] {
            assert!(bytes(&same, buffers) <= bytes(&exact, buffers), "merging costs nothing");
        }
        assert_eq!(merged.memory.allocated_bytes, merged.memory.pooled_bytes);
    });
}

#[test]
fn heaps_honour_what_resources_need() {
    for_frames(|declaration| {
        let needs = |resource: usize, _: u32| Need {
            bytes: declaration.resources[resource].bytes.next_multiple_of(64),
            align: [64, 1024, 65536][resource % 3],
            class: resource as u32 % 2,
        };
        let plan = plan_with_needs(declaration, &PlanOptions::default().sharing(Sharing::Placed), &needs).unwrap();
        for (slot, members) in slots(&plan) {
            let classes: BTreeSet<u32> = members.iter().map(|&resource| needs(resource, 0).class).collect();
            assert_eq!(classes.len(), 1, "classes lie apart");
            let unknown = members.iter().any(|&resource| declaration.resources[resource].bytes == 0);
            assert_eq!(slot.kind == SlotKind::Object, unknown, "what has no bytes lies alone");
            assert!(!unknown || members.len() == 1, "what has no bytes lies alone");
            for &resource in &members {
                let (need, offset) = (needs(resource, 0), plan.offsets[resource].unwrap());
                assert!(offset % need.align == 0 && offset + need.bytes <= slot.bytes, "r{resource} at {offset}: {need:?}");
            }
        }
        assert_eq!(plan.memory.placed_bytes, plan.memory.allocated_bytes);
    });
}
