//! Pools of steps that sequences take in turn.

/// Positions in pools of steps: a sequence takes those of one pool, no step is in two sequences, and pools take turns.
#[derive(Clone, Debug, Default)]
pub(crate) struct Turns {
    /// The steps of each pool that earlier sequences have used.
    used: Vec<usize>,
    /// True if a pool makes one sequence only, which may end with its steps.
    is_once: bool,
    /// The pool of this sequence or the next one.
    pool: usize,
    /// The next step of this sequence.
    next: usize,
}

impl Turns {
    pub(crate) fn new(pools: usize, is_once: bool) -> Self {
        Self { used: vec![0; pools], is_once, pool: 0, next: 0 }
    }

    /// Begins a sequence; false if no pool is left.
    pub(crate) fn begin(&mut self) -> bool {
        self.next = self.used.get(self.pool).copied().unwrap_or(0);
        self.pool < self.used.len()
    }

    /// The pool, and the position of the next step in it.
    pub(crate) fn place(&self) -> (usize, usize) {
        (self.pool, self.next)
    }

    /// Goes on to the step after this one.
    pub(crate) fn advance(&mut self) {
        self.next += 1;
    }

    /// Ends a sequence after so many steps. False if it does not count, and is the last: one whose steps ran out, unless each
    /// pool makes one sequence.
    pub(crate) fn end(&mut self, steps: u32, is_whole: bool) -> bool {
        let Some(used) = self.used.get_mut(self.pool).filter(|_| is_whole || self.is_once && steps > 0) else {
            return false;
        };
        *used += steps as usize;
        self.pool += 1;
        if !self.is_once {
            self.pool %= self.used.len();
        }
        true
    }
}
