//! Transient textures and buffers at offsets of shared memory ([`Sharing::Placed`](crate::Sharing)).
//!
//! wgpu gives every resource memory of its own. On Vulkan its hal layer lets us make the memory, bind images and buffers
//! to it where the plan says, and wrap them as wgpu objects. What wgpu then cannot know is that they alias. So wherever a
//! resource begins its life in memory that others used before, in this frame or in an earlier one, a command buffer of
//! our own hands the memory over, between wgpu's command buffers and in the same submission:
//!
//! ```text
//!   bytes                                      ┊ hand-over          ┊ hand-over
//!     ▲  ┌────────────────────────┐            ┊                    ┊
//!     │  │ a  draws, reads   → home│           ┊┌──────────────────┐┊
//!     │  └────────────────────────┘            ┊│ c           → home│
//!     │  ┌───────────────┐                     ┊│                  │┊┌──────────────
//!     │  │ b       → home│  (free)             ┊└──────────────────┘┊│ d
//!     └──┴───────────────┴─────────────────────┊────────────────────┊┴────────────► time
//!   submit([ hand-over,  wgpu: a b,              hand-over, wgpu: c,  hand-over, wgpu: d ])
//! ```
//!
//! **What a hand-over does.** It waits for everything before it on the queue, makes those writes available and all
//! memory visible to what follows, and moves each image that begins from `UNDEFINED` (its contents are garbage, and its
//! neighbours' are not touched) to the layout in which wgpu believes it is. Buffers have no layout: the barrier is
//! enough for them.
//!
//! **How the layout is known.** Every texture has a *home*, a state fixed by its usages. It is wrapped as being at home,
//! and while it still owns its memory, at the end of each life, wgpu itself is told to move it there
//! (`transition_resources`). So between its lives wgpu believes it at home, whatever the passes did. Rejected: wrapping
//! anew each frame as `UNINITIALIZED`, which costs a wgpu object and every bind group per frame; and telling wgpu to move
//! the texture at the *start* of a life, as that transition names the old layout and may write memory that is another's.
//! A frame that stops half-way leaves textures away from home; then all objects are dropped and made anew.
//!
//! **Few splits.** A hand-over may stand anywhere from the end of the last user of the memory to the first use;
//! `schedule` finds the fewest points that serve all. The first is at the start of the frame, and orders the frame after
//! the one before.
//!
//! **Lifetimes.** Images and buffers are destroyed by the callback that wgpu runs when it and the GPU are done with
//! them, and the callback holds the memory, so memory goes last. The first commands after a hand-over name its textures
//! to wgpu, so that wgpu knows the submission that holds the barrier to be a user of them.
//!
//! **Contents.** wgpu takes what is made outside for initialised and clears nothing. The planner refuses reads of what
//! nothing wrote, so nothing sees garbage. One trap is left: after `StoreOp::Discard` wgpu takes a texture for cleared no
//! more, would clear it before the next use that is not an attachment's clear, and panics as it knows no way to clear a
//! texture made outside. So what lies in a heap is discarded only if it is nothing but an attachment.
//!
//! Memory blocks serve all graphs of an executor, one after the other; one that is too small for a new plan is given up
//! for a larger one, and one of which less than half is used is given up for a smaller one.

#[cfg(all(feature = "placement", any(windows, target_os = "linux", target_os = "android", target_os = "freebsd")))]
mod heaps;
#[cfg(not(all(feature = "placement", any(windows, target_os = "linux", target_os = "android", target_os = "freebsd"))))]
#[path = "absent.rs"]
mod heaps;

pub(super) use heaps::{Heaps, Layout};

/// Why a plan gets no memory here.
#[derive(Clone, Debug, PartialEq, Eq)]
#[allow(dead_code, reason = "never made where there are no heaps")]
pub(super) enum HeapError {
    /// Placement does not serve this; in words for the user. The pool may.
    Unsupported(String),
    /// There is no memory left.
    OutOfMemory,
}
