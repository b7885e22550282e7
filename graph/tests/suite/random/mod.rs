//! Random frames, executed and compared word for word with a sequential interpreter.
//!
//! ```text
//!   case (numbers) ──► steps ──┬──► model: one after the other, no notion of plans ──► words ─┐
//!                              └──► graph ──► plan ──► executor, shared memory ──────► words ─┴─ equal
//! ```
//!
//! Every way of sharing memory runs every case, several frames in a row on one executor, so that what earlier frames and
//! earlier cases left in memory would show. `LIGHTLOOM_CASES` asks for more cases than the usual few.
//!
//! `node.rs` says what there is to read and write. A new kind of step is a variant of [`case::Step`], and an arm in `case.rs` (when it may be), `model.rs` (what it gives)
//! and `declare.rs` (how it is said).

mod case;
mod declare;
mod kernels;
mod model;
mod node;

use crate::executor;
use case::{Case, FRAMES, Step};
use kernels::Kernels;
use lightloom_graph::{Executor, Graph, PassOrder, PlanOptions, Sharing};
use model::Model;
use node::{Node, Part};
use proptest::{
    prelude::ProptestConfig,
    test_runner::{RngSeed, TestCaseError, TestError, TestRunner},
};
use std::{cell::RefCell, collections::BTreeMap};

const SHARINGS: [Sharing; 4] = [Sharing::Off, Sharing::Exact, Sharing::Merged, Sharing::Placed];

/// The same cases in every run.
fn runner(cases: u32) -> TestRunner {
    let cases = std::env::var("LIGHTLOOM_CASES").ok().and_then(|text| text.parse().ok()).unwrap_or(cases);
    TestRunner::new(ProptestConfig {
        cases,
        rng_seed: RngSeed::Fixed(0x11_6874),
        failure_persistence: None,
        max_shrink_iters: 1024,
        ..ProptestConfig::default()
    })
}

fn run(runner: &mut TestRunner, test: impl Fn(&Case) -> Result<(), TestCaseError>) {
    match runner.run(&case::cases(), |case| test(&case)) {
        Ok(()) => {}
        // The reason tells the steps; the numbers behind them say little.
        Err(TestError::Fail(reason, _)) => panic!("{reason}"),
        Err(error) => panic!("{error}"),
    }
}

/// The case in words, for a failure.
fn describe(nodes: &[Node], steps: &[Step]) -> String {
    let nodes: Vec<String> =
        nodes.iter().enumerate().map(|(i, node)| format!("n{i}: {:?} {:?}", node.owner, node.kind)).collect();
    let steps: Vec<String> = steps.iter().map(|step| format!("{step:?}")).collect();
    format!("\n  {}\n  {}", nodes.join("\n  "), steps.join("\n  "))
}

/// The steps with a read of every buffer that draws updated, behind the last draw of a row.
///
/// Mesa's lavapipe 22.3 drops a barrier that stands first in a command buffer, and wgpu puts the barriers of a pass there: what
/// a fragment stage stored in a buffer may still be on its way when a compute pass reads it. A copy waits for it.
fn settled(steps: &[Step]) -> Vec<Step> {
    let mut settled = Vec::with_capacity(steps.len());
    let mut updated: Vec<usize> = Vec::new();
    for (index, &step) in steps.iter().enumerate() {
        settled.push(step);
        if let Step::Draw { beside, .. } = step {
            updated.extend(beside);
        }
        if !matches!(steps.get(index + 1), Some(Step::Draw { .. })) {
            settled.extend(updated.drain(..).map(|from| Step::Read { from: Part::whole(from) }));
        }
    }
    settled
}

/// Runs the case's frames in one way of sharing.
fn execute(
    executor: &mut Executor,
    kernels: &mut Kernels,
    case: &Case,
    sharing: Sharing,
    order: PassOrder,
) -> Result<(), TestCaseError> {
    let nodes = case.nodes();
    let mut model = Model::new(&nodes);
    let imports = declare::imports(executor.device(), executor.queue(), &nodes);
    executor.reset_history();
    executor.set_sharing(sharing);
    executor.set_order(order);
    executor.set_threads(case.threads);
    executor.set_transient_attachments(case.transient_attachments);
    executor.set_timing(case.timing);
    for frame in 0..FRAMES {
        let steps = settled(&case.steps(&nodes, frame).0);
        let expected = model.frame(&steps);
        let mut graph = Graph::new("random");
        let reads = declare::frame(&mut graph, kernels, &nodes, &imports, &steps);
        let fail = |what: String| {
            TestCaseError::fail(format!("{sharing:?}, {order:?}, frame {frame}: {what}{}", describe(&nodes, &steps)))
        };
        let output = executor.execute(graph).map_err(|error| fail(error.to_string()))?;
        for (number, (read, expected)) in reads.into_iter().zip(expected).enumerate() {
            let found = output.cast::<u32>(read);
            if let Some(word) = (0..expected.len()).find(|&word| found.get(word) != Some(&expected[word])) {
                let (found, expected) = (found.get(word), expected[word]);
                return Err(fail(format!("read {number}: word {word} is {found:x?}, not {expected:x}")));
            }
        }
    }
    Ok(())
}

#[test]
fn random_frames_give_what_a_sequential_interpreter_gives() {
    let Some(executor) = executor() else { return };
    let state = RefCell::new((executor, Kernels::default()));
    run(&mut runner(96), |case| {
        let (executor, kernels) = &mut *state.borrow_mut();
        for sharing in SHARINGS {
            for order in [PassOrder::Recorded, PassOrder::Memory] {
                execute(executor, kernels, case, sharing, order)?;
            }
        }
        Ok(())
    });
}

#[test]
fn random_reads_of_what_nothing_wrote_are_refused() {
    let kernels = RefCell::new(Kernels::default());
    let refused = RefCell::new(0);
    run(&mut runner(256), |case| {
        let nodes = case.nodes();
        let (mut steps, stale) = case.steps(&nodes, 0);
        let Some((before, step)) = stale else { return Ok(()) };
        steps.truncate(before);
        let plan = |steps: &[Step]| {
            let mut graph = Graph::new("stale");
            declare::frame(&mut graph, &mut kernels.borrow_mut(), &nodes, &[], steps);
            graph.plan(&PlanOptions::default())
        };
        let fail = |what: String| TestCaseError::fail(format!("{what}{}", describe(&nodes, &steps)));
        plan(&steps).map_err(|error| fail(error.to_string()))?;
        let error = plan(&[steps.clone(), vec![step]].concat()).err().ok_or_else(|| fail(format!("{step:?} was planned")))?;
        if !error.to_string().contains("which nothing wrote earlier in the frame") {
            return Err(fail(format!("{step:?}: {error}")));
        }
        *refused.borrow_mut() += 1;
        Ok(())
    });
    let refused = refused.into_inner();
    assert!(refused > 16, "only {refused} cases had such a read");
}

const STEPS: [&str; 8] = ["Compute", "Update", "Arguments", "Draw", "Clear", "Copy", "Closure", "Read"];

fn is_indirect(step: &Step) -> bool {
    matches!(step, Step::Compute { groups: Some(_), .. } | Step::Draw { vertices: Some(_), .. })
}

#[test]
fn random_cases_have_every_kind_of_step_and_share_memory() {
    let count = RefCell::new(BTreeMap::<String, u32>::new());
    let kernels = RefCell::new(Kernels::default());
    run(&mut runner(48), |case| {
        let nodes = case.nodes();
        let mut count = count.borrow_mut();
        for frame in 0..FRAMES {
            let (steps, _) = case.steps(&nodes, frame);
            for step in &steps {
                let text = format!("{step:?}");
                *count.entry(text.split(' ').next().unwrap_or_default().to_owned()).or_default() += 1;
            }
            let mut graph = Graph::new("random");
            declare::frame(&mut graph, &mut kernels.borrow_mut(), &nodes, &[], &steps);
            let plan = graph.plan(&PlanOptions::default()).map_err(|error| TestCaseError::fail(error.to_string()))?;
            *count.entry("culled".to_owned()).or_default() += plan.culled.len() as u32;
            let shared = plan.slots.iter().map(|slot| slot.resources.len().saturating_sub(1)).sum::<usize>();
            let mut add = |what: &str, found: usize| *count.entry(what.to_owned()).or_default() += found as u32;
            add("merged", plan.steps.iter().filter(|range| range.len() > 1).count());
            add("long", usize::from(plan.steps.len() > 128));
            add("indirect", steps.iter().filter(|step| is_indirect(step)).count());
            add("parts", steps.iter().filter(|step| step.writes().iter().any(|part| !part.is_whole())).count());
            *count.entry("shared".to_owned()).or_default() += shared as u32;
        }
        Ok(())
    });
    let count = count.into_inner();
    println!("{count:?}");
    for what in STEPS.into_iter().chain(["culled", "shared", "merged", "indirect", "parts"]) {
        assert!(count.get(what).is_some_and(|&n| n > 20), "{what} in {count:?}");
    }
}
