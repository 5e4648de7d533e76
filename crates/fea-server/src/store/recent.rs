//! Short list whose entries are in the order of their last use.

/// Entries, the one used last at the end.
pub(super) struct Recent<T>(Vec<T>);

impl<T> Default for Recent<T> {
    fn default() -> Self {
        Self(Vec::new())
    }
}

impl<T> Recent<T> {
    /// First entry for which `is_it` holds; it then counts as used last.
    pub fn find(&mut self, is_it: impl FnMut(&T) -> bool) -> Option<&T> {
        let at = self.0.iter().position(is_it)?;
        self.0[at..].rotate_left(1);
        self.0.last()
    }

    /// Adds an entry, which counts as used last.
    pub fn push(&mut self, entry: T) {
        self.0.push(entry);
    }

    /// Drops the entries unused for longest until at most `max` are left.
    pub fn shorten(&mut self, max: usize) {
        self.0.drain(..self.0.len().saturating_sub(max));
    }

    /// Keeps the entries for which `is_kept` holds.
    pub fn retain(&mut self, is_kept: impl FnMut(&T) -> bool) {
        self.0.retain(is_kept);
    }

    /// All entries, the one unused for longest first.
    pub fn iter(&self) -> std::slice::Iter<'_, T> {
        self.0.iter()
    }

    /// Drops all entries.
    pub fn clear(&mut self) {
        self.0.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn entry_unused_for_longest_goes_first() {
        let mut recent = Recent::default();
        for entry in [1, 2, 3] {
            recent.push(entry);
        }
        assert_eq!(recent.find(|entry| *entry == 1), Some(&1));
        assert_eq!(recent.find(|entry| *entry == 9), None);
        assert_eq!(recent.iter().copied().collect::<Vec<_>>(), [2, 3, 1]);
        recent.shorten(2);
        assert_eq!(recent.iter().copied().collect::<Vec<_>>(), [3, 1]);
        recent.retain(|entry| *entry != 3);
        recent.shorten(5);
        assert_eq!(recent.iter().copied().collect::<Vec<_>>(), [1]);
        recent.clear();
        assert_eq!(recent.iter().next(), None);
    }
}
