//! Plans for shared memory, and what takes their place where there is none.

use super::{
    Executor, Frame, Planned,
    heap::{HeapError, Heaps},
};
use crate::{Sharing, declaration::Declaration, error::GraphError, plan::PlanOptions};
use std::sync::Arc;

impl Executor {
    pub(super) fn heaps(&self) -> Option<&Heaps> {
        self.heaps.as_ref().and_then(|heaps| heaps.as_ref().ok())
    }

    pub(super) fn held_bytes(&self) -> u64 {
        let placed = self.heaps().map_or(0, Heaps::allocated_bytes);
        self.pool.bytes().saturating_add(self.history.bytes()).saturating_add(placed)
    }

    /// The frame's plan, for heaps where they are asked for and there are some.
    pub(super) fn plan(&mut self, declaration: &Declaration, options: PlanOptions) -> Result<Planned, GraphError> {
        let device = &self.gate.device;
        if options.sharing != Sharing::Placed {
            return self.plans.get(declaration, options);
        }
        match self.heaps.get_or_insert_with(|| Heaps::new(device)) {
            Ok(heaps) => self.plans.get_placed(declaration, options, heaps, device),
            Err(note) => {
                let planned = self.plans.get(declaration, options.sharing(Sharing::Merged))?;
                Ok(Planned { note: note.clone(), ..planned })
            }
        }
    }

    /// Gives the frame its shared memory. Where the device cannot, the frame gets another plan, `planned` says why, and the
    /// answer is true.
    pub(super) fn place(&mut self, frame: &mut Frame<'_>, planned: &mut Planned) -> Result<bool, GraphError> {
        let Some(Ok(heaps)) = &mut self.heaps else { return Ok(false) };
        if planned.sharing != Sharing::Placed {
            return Ok(false);
        }
        let (gate, number) = (self.gate.clone(), self.frame);
        let held = heaps.allocated_bytes();
        let mut acquire = || {
            gate.scoped("placement", held, || match heaps.acquire(&frame.declaration, &frame.plan, number) {
                // What earlier plans held may yet serve.
                Err(HeapError::OutOfMemory) => {
                    heaps.clear();
                    gate.wait(None)?;
                    Ok(heaps.acquire(&frame.declaration, &frame.plan, number))
                }
                other => Ok(other),
            })
        };
        match acquire()? {
            Ok(layout) => {
                for (resource, physical) in layout.physical() {
                    frame.physical[resource] = physical.clone();
                }
                frame.layout = Some(layout);
                Ok(false)
            }
            Err(HeapError::OutOfMemory) => Err(GraphError::OutOfMemory { during: "placement".to_owned(), bytes: held }),
            Err(HeapError::Unsupported(note)) => {
                *planned = Planned { reason: planned.reason.clone(), ..self.plans.fall_back(&frame.declaration, note)? };
                frame.plan = Arc::clone(&planned.plan);
                Ok(true)
            }
        }
    }
}
