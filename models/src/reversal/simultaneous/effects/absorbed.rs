//! Effects that the fit takes up whatever their size: no unknown of theirs could be told from its own.

use super::Entry;

/// The artefact bends under its weight and does not turn its bend with the spindle: M's pattern.
pub const GRAVITY_SAG: Entry = Entry {
    name: "gravity-sag",
    timed: false,
    variants: |_| Vec::new(),
    refused: |_| {
        Some((
            "it does not turn with the spindle, so the slide's form M takes it up whatever its size",
            "compute the sag from section and overhang and take it out of M, or measure with the axis vertical",
        ))
    },
};

/// The stylus ball smooths the artefact's form, the same in both spindle positions: S's pattern.
pub const TIP_RADIUS: Entry = Entry {
    name: "tip-radius",
    timed: false,
    variants: |_| Vec::new(),
    refused: |_| {
        Some((
            "it is the same in both spindle positions, so the artefact's forms S_A and S_B take it up whatever its size",
            "measure again with a stylus of another radius",
        ))
    },
};

/// Both indicators read the same part too much: every form and tilt is scaled.
pub const COMMON_GAIN: Entry = Entry {
    name: "common-gain",
    timed: false,
    variants: |_| Vec::new(),
    refused: |_| {
        Some((
            "it scales every form and tilt alike, so they take it up whatever its size",
            "calibrate one indicator against gauge blocks",
        ))
    },
};
