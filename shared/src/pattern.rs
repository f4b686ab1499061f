//! Contact patterns: the set of fingers that touched.

/// The set of fingers that touched, up to mirror image: fingers counted from the other end give the same pattern.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[repr(u8)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum ContactPattern {
    /// No finger: the approach touched nothing.
    None = 0,
    /// One of the two outer fingers alone.
    Outer = 1,
    /// The middle finger alone.
    Middle = 2,
    /// The middle finger and one outer finger.
    OuterAndMiddle = 3,
    /// Both outer fingers without the middle one.
    BothOuter = 4,
    /// All three: a full touch.
    All = 5,
}

impl ContactPattern {
    /// Every pattern, in the order of their codes.
    pub const ALL: [Self; 6] =
        [Self::None, Self::Outer, Self::Middle, Self::OuterAndMiddle, Self::BothOuter, Self::All];

    /// The pattern of fingers in their order along the row: whether each touched.
    ///
    /// Cost: a few instructions. Cannot fail.
    pub(crate) const fn of([first, middle, last]: [bool; 3]) -> Self {
        // Four bits for each: with no finger, the middle one, an outer one, that and the middle one, both outer ones, all.
        const CODES: u32 = 0x0054_3120;
        match CODES >> (8 * (first as u32 + last as u32) + 4 * middle as u32) & 7 {
            0 => Self::None,
            1 => Self::Outer,
            2 => Self::Middle,
            3 => Self::OuterAndMiddle,
            4 => Self::BothOuter,
            _ => Self::All,
        }
    }

    /// The code, which is also the feature `pattern`: the position in [`ContactPattern::ALL`].
    pub const fn code(self) -> u8 {
        self as u8
    }

    /// The name in files and reports.
    pub const fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Outer => "outer",
            Self::Middle => "middle",
            Self::OuterAndMiddle => "outer and middle",
            Self::BothOuter => "both outer",
            Self::All => "all",
        }
    }
}

impl core::fmt::Display for ContactPattern {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(self.name())
    }
}

/// A set of [`ContactPattern`]s: one bit per pattern, at its [code](ContactPattern::code).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Patterns(u8);

impl Patterns {
    /// No pattern at all.
    const EMPTY: Self = Self(0);
    /// Full touches only.
    pub const FULL: Self = Self(0b10_0000);
    /// Every pattern with at least one contact.
    pub const CONTACTS: Self = Self(0b11_1110);
    /// Every pattern, no contact at all included.
    pub const ALL: Self = Self(0b11_1111);

    /// The set with these bits; `None` if a bit stands for no pattern.
    pub const fn from_bits(bits: u8) -> Option<Self> {
        if bits & !Self::ALL.0 == 0 { Some(Self(bits)) } else { None }
    }

    /// The bits.
    pub const fn bits(self) -> u8 {
        self.0
    }

    /// The set with one more pattern.
    pub const fn with(self, pattern: ContactPattern) -> Self {
        Self(self.0 | 1 << pattern.code())
    }

    /// The patterns that are in both sets.
    pub(crate) const fn and(self, other: Self) -> Self {
        Self(self.0 & other.0)
    }

    /// True if a pattern is in the set.
    pub const fn contains(self, pattern: ContactPattern) -> bool {
        self.0 >> pattern.code() & 1 == 1
    }

    /// True if there is no pattern in the set.
    pub const fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// The patterns in the set, in the order of their codes.
    pub fn iter(self) -> impl Iterator<Item = ContactPattern> {
        ContactPattern::ALL.into_iter().filter(move |&pattern| self.contains(pattern))
    }
}

impl FromIterator<ContactPattern> for Patterns {
    fn from_iter<T: IntoIterator<Item = ContactPattern>>(patterns: T) -> Self {
        patterns.into_iter().fold(Self::EMPTY, Self::with)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pattern_and_its_mirror_image_are_the_same() {
        let fingers = |bits: u8| [bits & 1 != 0, bits & 2 != 0, bits & 4 != 0];
        for bits in 0..8 {
            let [a, b, c] = fingers(bits);
            assert_eq!(ContactPattern::of([a, b, c]), ContactPattern::of([c, b, a]));
        }
        let patterns = [0, 1, 2, 3, 5, 7].map(|bits| ContactPattern::of(fingers(bits)));
        assert_eq!(patterns, ContactPattern::ALL);
    }

    #[test]
    fn sets_hold_what_was_put_in() {
        for (position, pattern) in ContactPattern::ALL.into_iter().enumerate() {
            assert_eq!(usize::from(pattern.code()), position);
            assert!(Patterns::ALL.contains(pattern) && !Patterns::EMPTY.contains(pattern));
            assert_eq!(Patterns::EMPTY.with(pattern).iter().collect::<std::vec::Vec<_>>(), [pattern]);
            assert_eq!(Patterns::CONTACTS.contains(pattern), pattern != ContactPattern::None);
            assert_eq!(Patterns::FULL.contains(pattern), pattern == ContactPattern::All);
        }
        assert_eq!(ContactPattern::ALL.into_iter().collect::<Patterns>(), Patterns::ALL);
        assert_eq!(Patterns::from_bits(Patterns::CONTACTS.bits()), Some(Patterns::CONTACTS));
        assert_eq!(Patterns::from_bits(64), None);
        assert_eq!(Patterns::CONTACTS.and(Patterns::FULL), Patterns::FULL);
        assert!(Patterns::default().is_empty() && !Patterns::FULL.is_empty());
    }
}
